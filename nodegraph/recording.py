"""Writes down what is done to a network as the Python that does it.

recording = Recording(network)
...                              # edits, undo, redo, by whoever
print(recording.text())          # a script that ends with the same network, and the same steps to undo
"""

from __future__ import annotations

import json
import keyword
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nodegraph import workspace
from nodegraph.clipboard import FROM, Paste
from nodegraph.commands import Add, Command, Connect, Disconnect, Mute, Remove, Rename, Reset, Set, SetUI
from nodegraph.data import Value
from nodegraph.group_commands import Group, HidePort, ShowPort, Ungroup
from nodegraph.variable_commands import (
    AddVariable,
    Link,
    RemoveVariable,
    RenameVariable,
    SetExpression,
    SetVariable,
    Unlink,
)

if TYPE_CHECKING:
    from nodegraph.history import Step
    from nodegraph.network import Network


@dataclass(slots=True)
class _Line:
    """One line of Python. target: what it sets, where a later line on the same makes it superfluous."""

    text: str
    target: str = ""


@dataclass(slots=True)
class _Block:
    """The lines of one gesture, or a line that stands alone (``step`` None)."""

    step: Step | None
    name: str
    lines: list[_Line] = field(default_factory=list)

    def add(self, line: _Line) -> None:
        # Of a drag the first and the last value are kept: the first makes the step, even where the last takes it back.
        if line.target and [one.target for one in self.lines[-2:]] == [line.target] * 2:
            self.lines[-1] = line
        else:
            self.lines.append(line)

    def python(self) -> list[str]:
        if self.step is None or len(self.lines) == 1:
            return [line.text for line in self.lines]
        return [f"with net.history.gesture({self.name!r}):", *(f"    {line.text}" for line in self.lines)]


class Recording:
    """Listens to the history of a network until it is closed."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self._file = network.file if not network.history.modified else None
        self._before = workspace.dumps(network) if network.nodes or network.variables or network.ui else ""
        self._blocks: list[_Block] = []
        self._names: dict[str, set[str]] = {}
        network.history.observers.append(self._see)

    def close(self) -> None:
        """Listen no more; what was written stays."""
        if self._see in self.network.history.observers:
            self.network.history.observers.remove(self._see)

    @property
    def steps(self) -> int:
        """How many things were done: edits, gestures, undo, redo, saves."""
        return len(self._blocks)

    def saved(self, path: Path) -> None:
        """Note that the network was saved."""
        if self._file is not None and path.absolute() == self._file.absolute():
            self._file = None  # the file no longer holds what the recording began with
        self._blocks.append(_Block(None, "", [_Line(f"net.save({str(path)!r})")]))

    def text(self) -> str:
        """The whole script."""
        names = {module: set(found) for module, found in self._names.items()}
        if self._file is not None:
            start = f"net = nodegraph.load({str(self._file)!r})"
        elif self._before:
            names.setdefault("nodegraph", set()).add("workspace")
            start = f"net = workspace.loads({self._before!r})"
        else:
            start = "net = nodegraph.Network()"
        imports = [f"from {module} import {', '.join(sorted(found))}" for module, found in sorted(names.items())]
        lines = [line for block in self._blocks for line in block.python()]
        return "\n".join(["import nodegraph", *imports, "", start, *lines]) + "\n"

    # -- listening --------------------------------------------------------------------------------------------------

    def _see(self, commands: list[Command]) -> None:
        history = self.network.history
        if history.act == "cancel":
            if self._blocks and self._blocks[-1].step is not None and commands:
                self._blocks.pop()
            return
        if history.act != "do":
            self._blocks.append(_Block(None, "", [_Line(f"net.{history.act}()")]))
            return
        step = history.open_step
        for command in commands:
            last = self._blocks[-1] if self._blocks else None
            if step is None or last is None or last.step is not step:
                last = _Block(step, step.name if step is not None else "")
                self._blocks.append(last)
            last.add(self._python(command))

    def _python(self, command: Command) -> _Line:
        write = _WRITERS.get(type(command))
        if write is None:
            return _Line(f"raise NotImplementedError({f'{type(command).__name__} cannot be written down'!r})")
        target = getattr(command, "target", "") if isinstance(command, Set) else ""
        if isinstance(command, SetUI):
            target = f"{command.path} {command.key}"
        return _Line(write(self, command), target or (command.variable if isinstance(command, SetVariable) else ""))

    # -- writing ----------------------------------------------------------------------------------------------------

    def value(self, value: Any) -> str:
        """A value as Python that makes it again."""
        if isinstance(value, Value) and hasattr(value, "to_json"):
            name = type(value).__name__
            self._names.setdefault(type(value).__module__, set()).add(name)
            return f"{name}.from_json({self.value(value.to_json())})"
        if isinstance(value, (np.ndarray, np.generic)):
            return self.value(value.tolist())
        if isinstance(value, float) and not math.isfinite(value):
            return f"float({str(value)!r})"
        if isinstance(value, Mapping):
            return "{" + ", ".join(f"{self.value(key)}: {self.value(item)}" for key, item in value.items()) + "}"
        if isinstance(value, list):
            return "[" + ", ".join(map(self.value, value)) + "]"
        if isinstance(value, tuple):
            return "(" + ", ".join(map(self.value, value)) + ("," if len(value) == 1 else "") + ")"
        return repr(str(value)) if isinstance(value, Path) else repr(value)

    def call(self, function: str, *arguments: Any, **named: Any) -> str:
        """A call with values; named arguments that are None, False or empty are left out."""
        told = [self.value(one) for one in arguments]
        told += [f"{name}={self.value(one)}" for name, one in named.items() if one not in (None, False, "")]
        return f"{function}({', '.join(told)})"

    def command(self, kind: type[Command], *arguments: Any, **named: Any) -> str:
        """A command that `Network` has no short form for."""
        self._names.setdefault(kind.__module__, set()).add(kind.__name__)
        return f"net.history.do({self.call(kind.__name__, *arguments, **named)})"


def _add(write: Recording, command: Add) -> str:
    type = command.type if isinstance(command.type, str) else command.type.id
    id = command.path.rpartition("/")[2]
    if command.group or not all(name.isidentifier() and not keyword.iskeyword(name) for name in command.params):
        return write.command(Add, type, id, command.params, group=command.group)
    params = "".join(f", {name}={write.value(value)}" for name, value in command.params.items())
    return f"net.add({type!r}, {id!r}{params})"


def _connect(write: Recording, command: Connect) -> str:
    if command.place is not None:
        where = {"replace": command.replace, "place": str(command.place)}
        return write.command(Connect, command.source, command.target, **where).replace(
            f"place={str(command.place)!r}", f"place={command.place}"
        )
    return write.call("net.connect", command.source, command.target, replace=command.replace)


def _reset(write: Recording, command: Reset) -> str:
    path, _, name = command.target.rpartition(".")
    usual = name.isidentifier() and not keyword.iskeyword(name) and not name.startswith("_")
    return f"del net[{path!r}].{name}" if usual else write.command(Reset, command.target)


def _mute(write: Recording, command: Mute) -> str:
    return write.call("net.mute", command.path) if command.muted else f"net.mute({command.path!r}, False)"


def _paste(write: Recording, command: Paste) -> str:
    copied = json.loads(command.copied) if isinstance(command.copied, str) else dict(command.copied)
    text = write.value(copied)
    if copied.get(FROM) == write.network.token:
        # What was copied here follows the variables that are here.
        text = write.value({**copied, FROM: ""}).replace(f"{FROM!r}: ''", f"{FROM!r}: net.token")
    if not command.group:
        return f"net.paste({text})"
    write.command(Paste, "")
    return f"net.history.do(Paste({text}, group={command.group!r}))"


def _add_variable(write: Recording, command: AddVariable) -> str:
    told = {"expression": command.expression, "encoded": command.encoded}
    return write.command(AddVariable, command.variable, command.kind, command.value, **told)


_WRITERS: dict[type[Command], Callable[[Recording, Any], str]] = {
    Add: _add,
    Remove: lambda write, c: write.call("net.remove", *c.paths),
    Connect: _connect,
    Disconnect: lambda write, c: write.call("net.disconnect", c.target, *([c.source] if c.source else [])),
    Set: lambda write, c: write.call("net.set", c.target, c.value, encoded=c.encoded),
    Reset: _reset,
    Rename: lambda write, c: write.call("net.rename", c.path, c.id),
    Mute: _mute,
    SetUI: lambda write, c: write.command(SetUI, c.path, c.key, c.value),
    Link: lambda write, c: write.call("net.link", c.target, c.variable),
    Unlink: lambda write, c: write.call("net.unlink", c.target),
    SetVariable: lambda write, c: write.call("net.set", c.variable, c.value, encoded=c.encoded),
    AddVariable: _add_variable,
    SetExpression: lambda write, c: write.call("net.derive", c.variable, c.expression),
    RenameVariable: lambda write, c: write.command(RenameVariable, c.variable, c.new),
    RemoveVariable: lambda write, c: write.command(RemoveVariable, c.variable),
    Group: lambda write, c: write.call("net.group", *c.paths, id=c.id),
    Ungroup: lambda write, c: write.call("net.ungroup", c.path),
    ShowPort: lambda write, c: write.command(ShowPort, c.group, c.face, c.shown, c.port),
    HidePort: lambda write, c: write.command(HidePort, c.group, c.face, c.shown),
    Paste: _paste,
}
