"""Streams of evaluations, of which only the newest counts: what each view shows, and how finely it is asked for.

While something moves, the quality of a picture is the finest that is expected to keep the budget; at rest it is refined
until it is final (`nodegraph.pacing`, docs/decisions/0010-quality.md).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from nodegraph.editor.instead import Values, with_values
from nodegraph.errors import Cancelled, GraphError, one_sentence
from nodegraph.pacing import BUDGET_MS, Pacing
from nodegraph.report import Event, Report
from nodegraph.subjects import upstream

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.evaluation import Evaluation
    from nodegraph.flat import Flat, FlatNode

PATIENCE = 1.0  #: seconds that a picture of a drag may take before a newer change cancels it


@dataclass(slots=True, eq=False)
class Channel:
    """What is asked for, what runs, and what is asked next.

    sink, size: of the question; a size of None is the sink's own. watched: whether every change asks again.
    running, since: the evaluation under way; ticket: what its answers bear. moving: whether a drag asked for it.
    quality: of what runs, or of the last answer. pending: whether to ask once more when it ends.
    pacing: what the sink's nodes cost. busy: whether anything had to be run for the last answer.
    settled: everything that the last final picture was made of, None before there is one.
    """

    sink: str
    size: tuple[int, int] | None = None
    watched: bool = False
    running: Evaluation | None = None
    since: float = 0.0
    ticket: object = None
    moving: bool = False
    quality: str = "final"
    pending: bool = False
    pacing: Pacing = field(default_factory=Pacing)
    busy: bool = False
    settled: object = None

    def may_end(self, moving: bool) -> bool:
        """Whether what runs shall end before the next: only a picture of a drag, and only while the drag goes on."""
        if self.running is None or not self.moving or not moving:
            return False
        return time.monotonic() - self.since < PATIENCE

    def level(self, flat: Flat) -> str:
        """The quality to begin with after a change; final where nothing of the picture changed, or listens to it."""
        made_of = _made_of(flat, self.sink)
        listens = any(
            node.processor is not None and "quality" in node.processor.services for node in _above(flat, self.sink)
        )
        if not listens or (made_of is not None and made_of == self.settled):
            return "final"
        return self.pacing.quality()

    def learn(self, flat: Flat, report: Report, made_up: bool = False) -> None:
        """Take in what an answer cost, and whether it is the last word; of what is made up it is not."""
        self.busy = bool(report.ran)
        self.pacing.learn(report, self.quality)
        if self.quality == "final" and not made_up:
            self.settled = _made_of(flat, self.sink)

    def finer(self, report: Report) -> str | None:
        """What to ask for after an answer while nothing moves: finer and finer until final, then None."""
        if report.ok:
            return self.pacing.finer(self.quality)
        return None if self.quality == "final" else "final"


class Channels:
    """All streams of a session. It asks the engine, and brings what the engine says to the session's signals."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.budget_ms = BUDGET_MS
        self.instead: Values = {}  # what is shown while somebody points at something
        self._all: dict[object, Channel] = {}

    def of(self, name: object) -> Channel | None:
        return self._all.get(name)

    @property
    def at_rest(self) -> bool:
        """Whether nothing runs and nothing waits to."""
        return not any(slot.running is not None or slot.pending for slot in self._all.values())

    def watch(self, name: object, sink: str, size: tuple[int, int] | None) -> None:
        """Ask now and at every `refresh`, coarse first where that is quicker."""
        slot = self._all.setdefault(name, Channel(sink))
        slot.sink, slot.size, slot.watched = sink, size, True
        self._follow(name, slot)

    def ask(self, name: object, sink: str, size: tuple[int, int] | None, quality: str) -> None:
        """Ask once."""
        slot = self._all.setdefault(name, Channel(sink))
        slot.sink, slot.size = sink, size
        self._start(name, slot, quality)

    def drop(self, name: object) -> None:
        """Forget a channel and cancel what runs for it."""
        slot = self._all.pop(name, None)
        if slot is not None and slot.running is not None:
            self.session.states.stop(name)
            slot.running.cancel()

    def clear(self) -> None:
        """Forget all channels."""
        for name in list(self._all):
            self.drop(name)

    def refresh(self) -> None:
        """Ask again for everything that is watched: something has changed, or a drag has ended."""
        for name, slot in list(self._all.items()):
            if slot.watched:
                self._follow(name, slot)

    def _follow(self, name: object, slot: Channel) -> None:
        moving = self.session.in_gesture or bool(self.instead)
        if slot.may_end(moving):
            slot.pending = True
            return
        # Several views that move together share the time of one picture.
        busy = sum(1 for other in self._all.values() if other.watched and (other.busy or other is slot))
        slot.pacing.budget_ms = self.budget_ms / busy
        self._start(name, slot, slot.level(self._flat(slot)), moving)

    def _flat(self, slot: Channel) -> Flat:
        """The document, or what is shown in its place."""
        flat = self.session.network.flatten()
        return with_values(flat, self.instead) if self.instead and slot.watched else flat

    def _start(self, name: object, slot: Channel, quality: str, moving: bool = False) -> None:
        session = self.session
        session.states.stop(name)
        slot.pending, slot.moving = False, moving
        slot.ticket = ticket = object()  # the engine may speak before `submit` has returned
        try:
            flat, made_up = self._flat(slot), bool(self.instead and slot.watched)
            evaluation = session.engine.submit(
                flat if made_up else session.network,
                slot.sink,
                size=slot.size,
                quality=quality,
                on_event=lambda event: session.mail.post(partial(self._on_event, name, ticket, event, made_up)),
                channel=(id(session), name),
            )
        except GraphError as error:
            session.tell("error", str(error))
            return
        slot.running, slot.quality, slot.since = evaluation, quality, time.monotonic()
        session.mail.wait_for(evaluation, partial(self._on_end, name, ticket, flat, made_up))

    def _on_event(self, name: object, ticket: object, event: Event, made_up: bool) -> None:
        slot = self._all.get(name)
        if slot is None or slot.ticket is not ticket:
            return
        if made_up:
            return  # nodes and their states are as the document has them
        if event.kind == "preview":
            self.session.take_preview(name, event.path, event.values, _seen(self.session, slot.sink, event))
        else:
            self.session.take_event(name, event)

    def _on_end(self, name: object, ticket: object, flat: Flat, made_up: bool, outcome: Report | BaseException) -> None:
        slot = self._all.get(name)
        if slot is None or slot.ticket is not ticket:
            return
        session = self.session
        slot.running = None
        session.states.stop(name)
        next_: Callable[[], object] | None = None
        if isinstance(outcome, Report):
            slot.learn(flat, outcome, made_up)
            if made_up:
                session.answered.emit(name, outcome)
            else:
                session.take(name, flat, outcome)
            if slot.watched and not slot.pending and not session.in_gesture:
                finer = slot.finer(outcome)
                next_ = partial(self._start, name, slot, finer) if finer is not None else None
        elif not isinstance(outcome, Cancelled):
            session.tell("error", one_sentence(outcome))
        session.states_changed.emit()
        # Who was told may have asked for something else meanwhile, or gone.
        if self._all.get(name) is not slot or slot.ticket is not ticket:
            return
        if slot.pending:
            self._follow(name, slot)
        elif next_ is not None:
            next_()


def _made_of(flat: Flat, sink: str) -> object:
    """Differs whenever something that a sink depends on has changed; None where that is not known."""
    return tuple((node.path, node.revision) for node in _above(flat, sink)) or None


def _above(flat: Flat, sink: str) -> Iterator[FlatNode]:
    """The node of a sink, which may be one output of it, and everything that it needs."""
    source = None if sink in flat.nodes else flat.source(sink)
    return upstream(flat, source[0] if isinstance(source, tuple) else sink)


def _seen(session: Session, sink: str, event: Event) -> dict[str, Any]:
    """What of a preview the sink itself shows: its own outputs, or inputs that it is given directly."""
    if event.path == sink:
        return dict(event.values)
    node = session.network.flatten().nodes.get(sink)
    return {
        name: event.values[output]
        for name, sources in (node.sources if node is not None else {}).items()
        for path, output in sources
        if path == event.path and output in event.values
    }
