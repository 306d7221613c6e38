"""The document that is open in the editor, and everything that widgets may do with it.

Widgets read ``session.network`` and change it only through `Session.do`; they hold no value of the document. The engine
works on a thread of its own. Whatever it says arrives here, on the thread of the window, before any signal is sent.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from PySide6.QtCore import QObject, QTimer, Signal
from shiboken6 import isValid

from nodegraph import workspace
from nodegraph.commands import Command, SetUI
from nodegraph.editor import garbage
from nodegraph.editor.channels import Channels
from nodegraph.editor.instead import Values
from nodegraph.editor.mailbox import Mailbox, Task
from nodegraph.editor.states import Running, States
from nodegraph.engine import Engine
from nodegraph.errors import GraphError
from nodegraph.network import Network, Node
from nodegraph.rebinding import Rebind
from nodegraph.report import Event, Report, State

if TYPE_CHECKING:
    from nodegraph.accuracy.running import Cancelled, Show
    from nodegraph.editor.previews import Preview
    from nodegraph.flat import Flat
    from nodegraph.history import History


T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Message:
    """Something to tell the user. level: error, warning or info. path: of the node that it is about, or empty."""

    level: str
    path: str
    text: str


class Session(QObject):
    """One open document with its history, its engine, and what is selected in it. Close it when the window closes."""

    changed = Signal(object)  # list[Command] that were done, undone or redone
    stepped = Signal()  # a gesture has ended, and is a step now
    replaced = Signal()  # another document is open
    selected = Signal(object)  # tuple[str, ...] of node paths
    entered = Signal(str)  # path of the group whose inside is shown, empty for the top
    started = Signal(str)  # node path
    progressed = Signal(str, float, str)  # node path, fraction, text
    finished = Signal(object)  # Report, also a partial one with the preview of a node
    answered = Signal(object, object)  # channel, Report: the end of what was asked there, at session.quality(channel)
    previewed = Signal(object, object)  # channel, dict[str, value]: what its sink may show until it is answered
    values_changed = Signal(object)  # set[str] of node paths
    states_changed = Signal()
    message = Signal(object)  # Message
    saved = Signal(object)  # Path

    def __init__(self, network: Network | None = None, engine: Engine | None = None) -> None:
        super().__init__()
        garbage.keep_to_this_thread()
        self.engine = engine if engine is not None else Engine()
        self.report = Report()
        self.level = ""
        self.frame: int  # of the animation, the one that is shown
        self.network: Network
        self.mail = Mailbox(self)
        self.states: States
        self._channels = Channels(self)
        self._precise: Engine | None = None
        self._told: dict[str, str] = {}
        self._selected: list[Node] = []
        self._gestures = 0
        # Many commands may come within one event of the mouse; the views are asked once, when it is over.
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.timeout.connect(self._channels.refresh)
        self._adopt(network if network is not None else Network())

    # -- the document -------------------------------------------------------------------------------------------

    @property
    def history(self) -> History:
        return self.network.history

    @property
    def path(self) -> Path | None:
        """The file of the document, None before it was saved."""
        return self.network.file

    @property
    def modified(self) -> bool:
        return self.history.modified

    def do(self, command: Command) -> bool:
        """Do a command. What is refused becomes a message, and False is returned."""
        try:
            self.history.do(command)
        except GraphError as error:
            self.tell("error", str(error))
            return False
        return True

    @contextmanager
    def gesture(self, name: str) -> Iterator[None]:
        """Make one undo step of everything that is done inside; an exception takes all of it back."""
        self.begin(name)
        try:
            yield
        except BaseException:
            self.cancel()
            raise
        self.end()

    def begin(self, name: str) -> None:
        """Start a gesture; one inside another joins it. While one is open, views show interactive quality."""
        if self._gestures == 0:
            self.history.begin(name)
        self._gestures += 1

    def end(self) -> None:
        """End a gesture, keep it as one step, and ask for final quality."""
        if self._gestures == 0:
            return
        self._gestures -= 1
        if self._gestures == 0:
            self.history.end()
            self._soon.start()
            self.stepped.emit()

    def cancel(self) -> None:
        """End all open gestures and take back what they did."""
        if self._gestures:
            self._gestures = 0
            self.history.cancel()
            self._soon.start()

    @property
    def in_gesture(self) -> bool:
        return self._gestures > 0

    def undo(self) -> None:
        """Take back the last step, if there is one and no drag is under way."""
        if self.history.undo_name and not self.in_gesture:
            self.history.undo()

    def redo(self) -> None:
        """Do again what was taken back last, if there is something and no drag is under way."""
        if self.history.redo_name and not self.in_gesture:
            self.history.redo()

    def tell(self, level: str, text: str, path: str = "") -> None:
        """Send a message: "error", "warning" or "info"."""
        self.message.emit(Message(level, path or self._place(text), text))

    # -- what is selected ---------------------------------------------------------------------------------------

    @property
    def selection(self) -> tuple[str, ...]:
        """Paths of the selected nodes, in the order in which they were chosen. A rename keeps them selected."""
        return tuple(node.path for node in self._selected)

    def select(self, *paths: str) -> None:
        """Select these nodes and no others; paths without a node are passed over."""
        before = self.selection
        self._selected = [self.network.node(path) for path in dict.fromkeys(paths) if path in self.network]
        if self.selection != before:
            self.selected.emit(self.selection)

    def enter(self, group: str) -> None:
        """Show the inside of a group; an empty path is the top level."""
        if group and (group not in self.network or self.network.node(group).network is None):
            group = ""
        if group != self.level:
            self.level = group
            self.entered.emit(group)

    # -- files --------------------------------------------------------------------------------------------------

    def new(self) -> None:
        """Begin an empty document."""
        self._adopt(Network())

    def open(self, path: str | Path) -> bool:
        """Open a workspace, or the one that a picture carries. On an error the old document stays."""
        try:
            network = workspace.load(path)
        except GraphError as error:
            self.tell("error", str(error))
            return False
        self._adopt(network)
        return True

    def adopt(self, network: Network) -> None:
        """Let a network that was made elsewhere, as by recovery, be the document."""
        self._adopt(network)

    def save(self, path: str | Path | None = None) -> bool:
        """Write the document, by default to its own file; the file is whole at any time."""
        try:
            workspace.save(self.network, path)
        except GraphError as error:
            self.tell("error", str(error))
            return False
        self.saved.emit(self.path)
        self.tell("info", f"saved {self.path}")
        return True

    def close(self) -> None:
        """Cancel what runs and free every thread and device."""
        self._soon.stop()
        self.mail.cancel()
        self._channels.clear()
        self._forget_document()
        self.engine.close(5.0)
        if self._precise is not None:
            self._precise.close(5.0)
        self.mail.close()

    # -- results ------------------------------------------------------------------------------------------------

    def state(self, path: str) -> State:
        """State of a node, with the reason; that of a group is the worst one inside."""
        return self.states.of(path)

    def value(self, path: str, output: str) -> Any | None:
        """What an output holds, as far as it is kept. It may lie on a device: read its numbers off this thread only."""
        source = self.network.flatten().source(f"{path}.{output}")
        if not isinstance(source, tuple):
            return None
        found = self.engine.last(self.network).tasks.get(source[0])
        result = self.engine.cache.get(found[0].fingerprint) if found is not None else None
        if result is not None and source[1] in result.values:
            return result.values[source[1]]
        return self.report.values.get(source)

    def watch(self, channel: object, sink: str, size: tuple[int, int] | None) -> None:
        """Keep a sink up to date until `unwatch`: ask now and after every change. `answered` brings each report.

        While a gesture is open, pictures come as finely as the budget allows; at rest, finer and finer until final.
        """
        self._channels.watch(channel, sink, size)

    def watches(self, channel: object) -> bool:
        """Whether a channel shows something that is kept up to date: a view, not a passing question."""
        slot = self._channels.of(channel)
        return slot is not None and slot.watched

    def quality(self, channel: object) -> str:
        """The level of what was answered last on a channel, or runs there now: "final", or "interactive/n"."""
        slot = self._channels.of(channel)
        return slot.quality if slot is not None else "final"

    @property
    def budget_ms(self) -> float:
        """Milliseconds that a picture may take while something moves; views that move together share it."""
        return self._channels.budget_ms

    @budget_ms.setter
    def budget_ms(self, value: float) -> None:
        self._channels.budget_ms = value

    def running(self, channel: object) -> Running | None:
        """The node that runs for a channel now, and how far it is; None where none does."""
        return self.states.running(channel)

    def unwatch(self, channel: object) -> None:
        """Stop asking for what a channel shows, and cancel what runs for it."""
        self._channels.drop(channel)

    def ask(self, sink: str, size: tuple[int, int] | None, quality: str = "final", channel: object = None) -> None:
        """Evaluate a sink once, off this thread. A newer question on the channel (default: the sink) supersedes it."""
        self._channels.ask(sink if channel is None else channel, sink, size, quality)

    def retry(self) -> None:
        """Try again what failed, although nothing it depends on has changed."""
        self.engine.retry()
        self._soon.start()

    def rebind(self) -> list[str]:
        """Give every node the processor that its type finds now, and ask the views anew. Returns what was lost."""
        command = Rebind()
        command.apply(self.network)
        self.engine.retry()
        if command.structural:
            self._on_change([command])
        self._soon.start()
        return command.told

    def show_instead(self, values: Values) -> None:
        """Let the views show other values of parameters than the document has, until it is called with none.

        Neither the document, nor its history, nor the states of nodes know of it.
        """
        if values != self._channels.instead:
            self._channels.instead = dict(values)
            self._soon.start()

    def preview(self, value: Any, callback: Callable[[Preview | None], object]) -> Callable[[], None]:
        """Make what is shown of a value of a port off this thread and call back with it, with None where that failed.

        What is returned cancels it: the rest is not made, and nobody is called.
        """
        from nodegraph.editor.previews import preview_of

        stop = threading.Event()
        made_of = partial(preview_of, value, stop.is_set)
        self.work(made_of, lambda made: None if stop.is_set() else callback(made))
        return stop.set

    def work(
        self, function: Callable[[], T], callback: Callable[[T | None], object], owner: QObject | None = None
    ) -> None:
        """Run a function beside the window and call back on the window's thread, with None where it raised.

        Nobody is called back once ``owner`` is deleted: a window may close while something is made for it.
        """
        if owner is None:
            self.mail.work(function, callback)
        else:
            self.mail.work(function, lambda made: callback(made) if isValid(owner) else None)

    def begin_task(
        self,
        function: Callable[[Show, Cancelled], T],
        told: Callable[[str, float | None], object],
        then: Callable[[T | BaseException], object],
    ) -> Task[T]:
        """Run something long beside the window; see `Task`. It ends with the session."""
        return self.mail.begin(function, told, then)

    @property
    def precise(self) -> Engine:
        """An engine in double precision, for references. It computes nothing before it is asked."""
        if self._precise is None:
            self._precise = Engine("cl64")
        return self._precise

    def note(self, key: str, value: Any) -> None:
        """Keep something about the window in the document's ``ui``; that is no step that anybody would undo."""
        SetUI("", key, value).apply(self.network)

    # -- behind it ----------------------------------------------------------------------------------------------

    def _adopt(self, network: Network) -> None:
        self._forget_document()
        if hasattr(self, "states"):
            self._channels.clear()
            self._channels.instead = {}
        self.network = network
        self.report = Report()
        self.level = ""
        self.frame = 0
        self._gestures = 0
        self._selected = []
        self._told = {}
        self.states = States(network)
        self.history.observers.append(self._on_change)
        self.replaced.emit()
        self.selected.emit(())

    def _forget_document(self) -> None:
        if hasattr(self, "network") and self._on_change in self.history.observers:
            self.history.observers.remove(self._on_change)

    def _on_change(self, commands: list[Command]) -> None:
        there = set(self.network.walk())
        before = len(self._selected)
        self._selected = [node for node in self._selected if node in there]
        if self.level and (self.level not in self.network or self.network.node(self.level).network is None):
            self.enter("")
        self.changed.emit(commands)
        if len(self._selected) != before:
            self.selected.emit(self.selection)
        if any(command.touched or command.structural for command in commands):
            self.states_changed.emit()
            self._soon.start()

    # -- what channels bring --------------------------------------------------------------------------------------

    def take_event(self, name: object, event: Event) -> None:
        """Tell that a node began, goes on, ended or says something, in an evaluation for a channel."""
        if event.kind == "started":
            self.states.start(name, event.path)
            self.started.emit(event.path)
        elif event.kind == "progress":
            self.states.progress(event.path, event.fraction, event.text)
            self.progressed.emit(event.path, event.fraction, event.text)
        elif event.kind == "finished":
            self.states.stop(name, event.path)
            self.progressed.emit(event.path, 1.0, "")
        elif event.kind == "note" and event.text:
            self.tell("info", event.text, event.path)

    def take_preview(self, name: object, path: str, values: Mapping[str, Any], shown: dict[str, Any]) -> None:
        """Tell what a node that still runs has so far; ``shown``: what of it the sink of the channel shows."""
        given = {(path, output): value for output, value in values.items()}
        self.finished.emit(Report(values=given, states={path: State("running")}))
        if shown:
            self.previewed.emit(name, shown)

    def take(self, name: object, flat: Flat, report: Report) -> None:
        """Tell of the end of an evaluation; what failed becomes a message, once."""
        if self.watches(name):
            self.report = report
        self.states.learn(flat, report)
        for path in report.states:
            text = str(report.errors[path]) if path in report.errors else ""
            if text and self._told.get(path) != text:
                self.tell("error", text, path)
            self._told[path] = text
        self.finished.emit(report)
        self.answered.emit(name, report)
        self.values_changed.emit(set(report.states))

    def _place(self, text: str) -> str:
        """The node that a message names at its front, empty where it names none."""
        front = text.partition(":")[0].strip()
        for path in (front, front.rpartition(".")[0]):
            if path and path in self.network:
                return path
        return ""
