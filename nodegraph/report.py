"""What an evaluation says of itself: events while it runs, and a report at its end."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self

from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.cache import Result
    from nodegraph.compute.dispatch import KernelRun


class State(str):
    """State of a node: clean, dirty, blocked, running or failed; equal to that word. ``reason`` says why."""

    reason: str

    def __new__(cls, name: str, reason: str = "") -> Self:
        self = super().__new__(cls, name)
        self.reason = reason
        return self

    def __repr__(self) -> str:
        return f"<{self}: {self.reason}>" if self.reason else f"<{self}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.reason)


CLEAN = State("clean")


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened to a node while an evaluation ran.

    kind: started, progress, preview, finished, failed, blocked, or note (``path`` may then be empty).
    fraction, text: of a progress report or a note. values: outputs of a preview or of a finished node.
    """

    kind: str
    path: str
    text: str = ""
    fraction: float = 0.0
    seconds: float = 0.0
    size: tuple[int, int] | None = None
    values: Mapping[str, Any] = field(default_factory=dict, repr=False)
    error: GraphError | None = None


@dataclass(slots=True)
class Report:
    """The end of an evaluation.

    values: what the sinks show, by (path, output); a sink without outputs shows its inputs.
    shown: the same by sink, as it was named. states: of every node of the plan.
    errors: why nodes failed or could not start; those below them are merely blocked.
    timings: seconds, bytes: of distinct memory, for every node that ran, memos as ``shadow/propagate``.
    ran, cached: paths in the order in which they ran, or were found to be kept. memos: by node, what it asked for.
    device_seconds: by node, the part of its seconds that its kernels took.
    kernels, decisions: by node, the kernels that made its result and what it said of its own choices, now or when the
    result that is kept was made.
    """

    values: dict[tuple[str, str], Any] = field(default_factory=dict)
    shown: dict[str, dict[str, Any]] = field(default_factory=dict)
    states: dict[str, State] = field(default_factory=dict)
    errors: dict[str, GraphError] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    timings: dict[str, float] = field(default_factory=dict)
    bytes: dict[str, int] = field(default_factory=dict)
    ran: list[str] = field(default_factory=list)
    cached: list[str] = field(default_factory=list)
    memos: dict[str, list[str]] = field(default_factory=dict)
    device_seconds: dict[str, float] = field(default_factory=dict)
    kernels: dict[str, list[KernelRun]] = field(default_factory=dict)
    decisions: dict[str, list[str]] = field(default_factory=dict)

    def add_making(self, path: str, result: Result) -> None:
        """Take in how the result of a node was made."""
        if result.memos:
            self.memos[path] = list(dict.fromkeys([*self.memos.get(path, ()), *result.memos]))
        if result.runs:
            self.kernels[path] = [*self.kernels.get(path, ()), *result.runs]
        if result.decisions:
            self.decisions[path] = list(dict.fromkeys([*self.decisions.get(path, ()), *result.decisions]))

    @property
    def ok(self) -> bool:
        """True when no node failed or was blocked."""
        return not self.errors

    @property
    def exit_code(self) -> int:
        """What the command line returns: 0, 1 when a processor failed, 2 when the input is at fault."""
        return max((error.exit_code for error in self.errors.values()), default=0)

    def raise_first(self) -> None:
        """Raise the first error, if there is one."""
        for error in self.errors.values():
            raise error


Observer = Callable[[Event], None]


class Teller:
    """Delivers events to an observer, which may fail without stopping anything, and collects notes."""

    def __init__(self, report: Report, observer: Observer | None) -> None:
        self._report = report
        self._observer = observer
        self._failed = False

    def emit(self, event: Event) -> None:
        """Deliver an event. The first error of the observer becomes a note."""
        if self._observer is None:
            return
        try:
            self._observer(event)
        except Exception as error:
            if not self._failed:
                self._failed = True
                self._report.notes.append(f"the observer of this evaluation raised {type(error).__name__}: {error}")

    def note(self, text: str, path: str = "") -> None:
        """Say something once, in the report and as an event."""
        if text not in self._report.notes:
            self._report.notes.append(text)
            self.emit(Event("note", path, text))

    def announce(self, text: str) -> None:
        """Say something to the observer that is no remark on the results: the device that was chosen."""
        self.emit(Event("note", "", text))
