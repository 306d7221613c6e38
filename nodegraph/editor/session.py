"""The document that is open in the editor, and everything that widgets may do with it.

Widgets read ``session.network`` and change it only through `Session.do`; they hold no value of the document. The engine
works on a thread of its own. Whatever it says arrives here, on the thread of the window, before any signal is sent.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtGui import QImage

from nodegraph import workspace
from nodegraph.commands import Command, SetUI
from nodegraph.editor import garbage
from nodegraph.editor.channels import Channel
from nodegraph.editor.mailbox import Mailbox
from nodegraph.editor.states import States
from nodegraph.engine import Engine
from nodegraph.errors import Cancelled, GraphError, one_sentence
from nodegraph.network import Network, Node
from nodegraph.rebinding import Rebind
from nodegraph.report import Event, Report, State

if TYPE_CHECKING:
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
    replaced = Signal()  # another document is open
    selected = Signal(object)  # tuple[str, ...] of node paths
    entered = Signal(str)  # path of the group whose inside is shown, empty for the top
    started = Signal(str)  # node path
    progressed = Signal(str, float, str)  # node path, fraction, text
    finished = Signal(object)  # Report, also a partial one with the preview of a node
    answered = Signal(object, object)  # channel, Report: the end of what was asked there
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
        self.network: Network
        self._channels: dict[object, Channel] = {}
        self._mail = Mailbox(self)
        self._told: dict[str, str] = {}
        self._selected: list[Node] = []
        self._states: States
        self._gestures = 0
        # Many commands may come within one event of the mouse; the views are asked once, when it is over.
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.timeout.connect(self._ask_views)
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
        self._channels.clear()
        self._forget_document()
        self.engine.close(5.0)
        self._mail.close()

    # -- results ------------------------------------------------------------------------------------------------

    def state(self, path: str) -> State:
        """State of a node, with the reason; that of a group is the worst one inside."""
        return self._states.of(path)

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

    def watch(self, channel: object, sink: str, size: tuple[int, int]) -> None:
        """Keep a sink up to date until `unwatch`: ask now and after every change. `answered` brings each report."""
        self.ask(sink, size, "interactive" if self.in_gesture else "final", channel)
        self._channels[channel].watched = True

    def watches(self, channel: object) -> bool:
        """Whether a channel shows something that is kept up to date: a view, not a passing question."""
        return channel in self._channels and self._channels[channel].watched

    def unwatch(self, channel: object) -> None:
        """Stop asking for what a channel shows, and cancel what runs for it."""
        gone = self._channels.pop(channel, None)
        if gone is not None and gone.running is not None:
            self._states.stop(channel)
            gone.running.cancel()

    def ask(self, sink: str, size: tuple[int, int] | None, quality: str = "final", channel: object = None) -> None:
        """Evaluate a sink off this thread. A newer question on the same channel (default: the sink) supersedes it.

        An interactive evaluation that runs is let go on for a moment when another comes, so that a drag shows pictures
        instead of cancelling each one.
        """
        name = sink if channel is None else channel
        slot = self._channels.setdefault(name, Channel(sink))
        slot.sink, slot.size = sink, size
        if slot.may_wait(quality):
            slot.pending = quality
        else:
            self._start(name, slot, quality)

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

    def picture(self, value: Any, callback: Callable[[QImage | None], object], size: tuple[int, int] | None) -> None:
        """Make a small picture of any value of a port off this thread and call back with it, or with None."""
        from nodegraph.editor.previews import picture_of

        self.work(partial(picture_of, value, size), callback)

    def work(self, function: Callable[[], T], callback: Callable[[T | None], object]) -> None:
        """Run a function beside the window and call back on the window's thread, with None where it raised."""
        self._mail.work(function, callback)

    def note(self, key: str, value: Any) -> None:
        """Keep something about the window in the document's ``ui``; that is no step that anybody would undo."""
        SetUI("", key, value).apply(self.network)

    # -- behind it ----------------------------------------------------------------------------------------------

    def _adopt(self, network: Network) -> None:
        self._forget_document()
        for slot in self._channels.values():
            if slot.running is not None:
                slot.running.cancel()
        self._channels.clear()
        self.network = network
        self.report = Report()
        self.level = ""
        self._gestures = 0
        self._selected = []
        self._told = {}
        self._states = States(network)
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

    def _ask_views(self) -> None:
        quality = "interactive" if self.in_gesture else "final"
        for name, slot in list(self._channels.items()):
            if slot.watched:
                self.ask(slot.sink, slot.size, quality, name)

    def _start(self, name: object, slot: Channel, quality: str) -> None:
        self._states.stop(name)
        slot.pending = ""
        slot.ticket = ticket = object()  # the engine may speak before `submit` has returned
        try:
            flat = self.network.flatten()
            evaluation = self.engine.submit(
                self.network,
                slot.sink,
                size=slot.asked_size(quality),
                quality=quality,
                on_event=lambda event: self._mail.post(partial(self._on_event, name, ticket, event)),
                channel=(id(self), name),
            )
        except GraphError as error:
            self.tell("error", str(error))
            return
        slot.running, slot.quality, slot.since = evaluation, quality, time.monotonic()
        self._mail.wait_for(evaluation, partial(self._on_end, name, ticket, flat))

    def _on_event(self, name: object, ticket: object, event: Event) -> None:
        slot = self._channels.get(name)
        if slot is None or slot.ticket is not ticket:
            return
        if event.kind == "started":
            self._states.start(name, event.path)
            self.started.emit(event.path)
        elif event.kind == "progress":
            self._states.progress(event.path, event.fraction, event.text)
            self.progressed.emit(event.path, event.fraction, event.text)
        elif event.kind == "preview":
            values = {(event.path, output): value for output, value in event.values.items()}
            shown = {slot.sink: dict(event.values)} if event.path == slot.sink else {}
            self.finished.emit(Report(values=values, shown=shown, states={event.path: State("running")}))
        elif event.kind == "finished":
            self._states.stop(name, event.path)
            self.progressed.emit(event.path, 1.0, "")
        elif event.kind == "note" and event.text:
            self.tell("info", event.text, event.path)

    def _on_end(self, name: object, ticket: object, flat: Flat, outcome: Report | BaseException) -> None:
        slot = self._channels.get(name)
        if slot is None or slot.ticket is not ticket:
            return
        slot.running = None
        self._states.stop(name)
        if isinstance(outcome, Report):
            slot.learn(outcome)
            self._take(name, flat, outcome)
        elif not isinstance(outcome, Cancelled):
            self.tell("error", one_sentence(outcome))
        self.states_changed.emit()
        slot = self._channels.get(name)
        if slot is not None and slot.running is None and slot.pending:
            self._start(name, slot, slot.pending)

    def _take(self, name: object, flat: Flat, report: Report) -> None:
        if self.watches(name):
            self.report = report
        self._states.learn(flat, report)
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
