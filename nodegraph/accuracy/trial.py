"""One setting on one device: run it anew as often as one likes, without its results being answered from the cache."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from nodegraph.accuracy.running import Cancelled as Stop
from nodegraph.accuracy.running import evaluated, shown_value
from nodegraph.cache import blocks, each_buffer
from nodegraph.errors import Cancelled, GraphError

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.network import Network
    from nodegraph.report import Event, Report


class Trial:
    """Runs one network on one engine and notes what that costs.

    Before each run the results of the ``timed`` nodes are forgotten, so these nodes run; what is above them, and what
    their memos made, stays in the cache of the engine. ``failure`` says why there is no result, if there is none.
    ``made``, shared by the trials of an engine, holds the seconds of memos by label: one that an earlier setting
    made costs the next one as much. ``stop`` is asked while it runs, and ends it with Cancelled.
    """

    def __init__(
        self,
        network: Network,
        view: str,
        size: tuple[int, int] | None,
        settings: Mapping[str, Any],
        device: str,
        engine: Engine,
        timed: Sequence[str],
        made: dict[str, float] | None = None,
        stop: Stop | None = None,
    ) -> None:
        self.network = network
        self.view = view
        self.size = size
        self.settings = settings
        self.device = device
        self.engine = engine
        self.timed = frozenset(timed)
        self.made = made if made is not None else {}
        self.stop = stop
        self.failure = ""
        self.notes: tuple[str, ...] = ()
        self.seconds: list[float] = []
        self.device_seconds: list[float] = []
        self.prepare_seconds = 0.0
        self.bytes = 0

    @property
    def label(self) -> str:
        """For a line of progress."""
        return f"{' '.join(f'{place}={value}' for place, value in self.settings.items())} on {self.device}".strip()

    def first(self) -> Any:
        """Run once without counting the time: kernels are built, memos made, bytes counted. Returns the value."""
        sizes: dict[int, int] = {}

        def count(event: Event) -> None:
            if event.kind == "finished" and event.path in self.timed:
                sizes.update((identity, nbytes) for identity, nbytes, _ in blocks(event.values))

        self._forget()
        report = self._evaluate(count)
        if report is None:
            return None
        memos = {label for path in self.timed for label in report.memos.get(path, ())}
        self.made.update({label: report.timings[label] for label in memos if label in report.timings})
        self.prepare_seconds = sum(self.made.get(label, 0.0) for label in memos)
        self.bytes = sum(sizes.values()) + sum(report.bytes.get(label, 0) for label in memos)
        return shown_value(report, self.view)

    def time(self) -> None:
        """Run once and note the seconds."""
        self._forget()
        start = time.perf_counter()
        report = self._evaluate()
        if report is None:
            return
        each_buffer(report.shown[self.view], lambda buffer: buffer.array)
        seconds = time.perf_counter() - start
        # Nodes above that the cache could not hold ran again; that is not what was asked.
        others = [path for path in report.ran if path in report.states and path not in self.timed]
        self.seconds.append(max(0.0, seconds - sum(report.timings[path] for path in others)))
        self.device_seconds.append(sum(report.device_seconds.get(path, 0.0) for path in self.timed))
        if others:
            self._note(f"{', '.join(others)}: made again, since the cache could not hold it; its time is taken off")

    def _forget(self) -> None:
        plan = self.engine.plan(self.network, [self.view], size=self.size)
        self.engine.cache.forget(task.fingerprint for task in plan.tasks if task.path in self.timed)

    def _evaluate(self, on_event: Any = None) -> Report | None:
        try:
            report = evaluated(self.engine, self.network, self.view, self.size, on_event, self.stop)
        except Cancelled:
            raise
        except GraphError as error:
            self.failure = str(error)
            return None
        for note in report.notes:
            self._note(note)
        moved = [note for note in report.notes if f": {self.device} failed (" in note and note.endswith(" instead")]
        if moved:
            self.failure = moved[0]  # what another device takes is no answer for this one
            return None
        if report.errors or not report.shown.get(self.view):
            self.failure = "; ".join(str(error) for error in report.errors.values()) or f"{self.view}: it shows nothing"
            return None
        return report

    def _note(self, text: str) -> None:
        if text not in self.notes:
            self.notes = (*self.notes, text)
