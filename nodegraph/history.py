"""Undo and redo."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from nodegraph.errors import CommandError

if TYPE_CHECKING:
    from nodegraph.commands import Command
    from nodegraph.network import Network


@dataclass(slots=True)
class Step:
    """What one undo takes back: a command, or all commands of one gesture."""

    name: str
    commands: list[Command] = field(default_factory=list)


class History:
    """The steps that led to the present state of a network.

    ``observers`` are called with the commands that were done, undone or redone, after each change. ``modified``
    compares with the state that `mark_saved` was called in. ``act`` says to observers what happens: "do", "undo",
    "redo", or "cancel" of a gesture.
    """

    def __init__(self, network: Network) -> None:
        self.network = network
        self.observers: list[Callable[[list[Command]], object]] = []
        self.act = "do"
        self._done: list[Step] = []
        self._undone: list[Step] = []
        self._gesture: Step | None = None
        self._saved: Step | None = None
        self._lost = False  # the saved state can no longer be reached

    def do(self, command: Command) -> Command:
        """Apply a command and note it. A command that raises leaves the network as it was."""
        command.apply(self.network)
        if command.empty:
            return command
        self._forget_undone()
        if self._gesture is None:
            self._done.append(Step(command.name, [command]))
        elif not (self._gesture.commands and self._gesture.commands[-1].absorb(command)):
            self._gesture.commands.append(command)
        self._tell([command], "do")
        return command

    @contextmanager
    def gesture(self, name: str) -> Iterator[None]:
        """Make one step of everything done inside. An exception takes all of it back. Inner gestures join the outer."""
        if self._gesture is not None:
            yield
            return
        self.begin(name)
        try:
            yield
        except BaseException:
            self.cancel()
            raise
        self.end()

    def begin(self, name: str) -> None:
        """Start a gesture: a drag that begins with a press and ends, elsewhere in the program, with a release."""
        if self._gesture is not None:
            raise CommandError(f"{name}: the gesture {self._gesture.name!r} has not ended")
        self._gesture = Step(name)

    def end(self) -> None:
        """End the gesture and keep it as one step."""
        step, self._gesture = self._gesture, None
        if step is not None and step.commands:
            self._done.append(step)

    def cancel(self) -> None:
        """End the gesture and take back what it did."""
        step, self._gesture = self._gesture, None
        if step is not None:
            self._revert(step, "cancel")

    def undo(self) -> None:
        """Take back the last step. Raises CommandError when there is none or while a gesture is under way."""
        step = self._take(self._done, "undo")
        self._undone.append(step)
        self._revert(step, "undo")

    def redo(self) -> None:
        """Do again the step that was taken back last. Raises CommandError when there is none."""
        step = self._take(self._undone, "redo")
        for command in step.commands:
            command.apply(self.network)
        self._done.append(step)
        self._tell(step.commands, "redo")

    @property
    def undo_name(self) -> str:
        """Name of the step that `undo` takes back, empty when there is none."""
        return self._done[-1].name if self._done else ""

    @property
    def redo_name(self) -> str:
        """Name of the step that `redo` does again, empty when there is none."""
        return self._undone[-1].name if self._undone else ""

    @property
    def open_step(self) -> Step | None:
        """The step of the gesture under way, None where there is none."""
        return self._gesture

    @property
    def modified(self) -> bool:
        """Whether the network differs from what was saved last."""
        return self._lost or (self._done[-1] if self._done else None) is not self._saved or self._gesture is not None

    def mark_saved(self) -> None:
        """Note that the present state is on disk."""
        self._saved = self._done[-1] if self._done else None
        self._lost = False

    def clear(self) -> None:
        """Forget all steps; the network stays as it is."""
        self._lost = self.modified
        self._done.clear()
        self._undone.clear()
        self._saved = None

    def commands(self) -> Iterator[Command]:
        """Every command that some step holds, whether it is done or undone now."""
        for step in (*self._done, *self._undone, *([self._gesture] if self._gesture is not None else [])):
            yield from step.commands

    def _take(self, steps: list[Step], what: str) -> Step:
        if self._gesture is not None:
            raise CommandError(f"{what}: the gesture {self._gesture.name!r} has not ended")
        if not steps:
            raise CommandError(f"{what}: there is nothing to {what}")
        return steps.pop()

    def _revert(self, step: Step, act: str) -> None:
        for command in reversed(step.commands):
            command.revert(self.network)
        self._tell(step.commands, act)

    def _forget_undone(self) -> None:
        if any(step is self._saved for step in self._undone):
            self._lost = True
        self._undone.clear()

    def _tell(self, commands: list[Command], act: str) -> None:
        self.act = act
        for observer in list(self.observers):
            observer(commands)
