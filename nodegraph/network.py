"""The document: nodes, their wires, values and variables. It knows nothing of running.

A network is plain data that anybody may read. It is changed by commands (``commands.py``), so that every edit can be
undone; the methods below are short forms of those commands. Names: ids are unique per level, groups join with ``/``,
ports and parameters follow after a point: ``finish/raycast.step``.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from nodegraph.errors import CommandError, GraphError, ParameterError, near_miss

if TYPE_CHECKING:
    from pathlib import Path

    from nodegraph.flat import Flat, ProcessorClass
    from nodegraph.handle import Handle
    from nodegraph.history import History
    from nodegraph.processor import Processor

GROUP = "group"
"""The type of a node that holds a network of its own."""

ID = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")

Extra = dict[str, tuple[str, Any]]
"""Keys of a file that mean nothing here: name to (the key it followed, JSON value). They are written back in place."""


@dataclass(frozen=True, slots=True)
class Kept:
    """A stored value that cannot be used, kept as the JSON that it was.

    ``reason`` says why it cannot, and is written behind the place, which a rename may change: ``: no such parameter``.
    """

    json: Any
    reason: str

    def error(self, where: str) -> ParameterError:
        """The error of whoever needs the value."""
        return ParameterError(where + self.reason)


@dataclass(eq=False, slots=True)
class Variable:
    """A value that parameters share. ``expression`` is its text when it is derived, and empty when it is plain."""

    kind: str
    value: Any = None
    expression: str = ""
    extra: Extra = field(default_factory=dict)


@dataclass(eq=False, slots=True)
class Expose:
    """What a group shows of its inside: each name leads to ports one level down (``"blur.volume"``).

    An input or parameter may lead to several, an output comes from one.
    """

    inputs: dict[str, tuple[str, ...]] = field(default_factory=dict)
    params: dict[str, tuple[str, ...]] = field(default_factory=dict)
    outputs: dict[str, str] = field(default_factory=dict)
    extra: Extra = field(default_factory=dict)


@dataclass(eq=False, slots=True)
class Node:
    """One node of the document; a group is a node with ``network`` and ``expose``.

    Attributes:
        processor: the class, or None for a group and for what is not available here; ``trouble`` then says why.
        params: checked values of parameters that differ from the default. What this installation does not know or
            accept is a `Kept`.
        links: parameter to the name of the variable that it follows.
        inputs: input or wired parameter to its sources, ``("ct.volume",)``, in wire order.
        listed: inputs unknown here whose source was written as a list, so that it is again.
        ui: position and the like; never looked at here.
        parent: the network that holds this node.
        revision: counts changes of what this node may compute.
    """

    id: str
    type: str
    processor: ProcessorClass | None = None
    trouble: GraphError | None = None
    version: int | None = None
    params: dict[str, Any] = field(default_factory=dict)
    links: dict[str, str] = field(default_factory=dict)
    inputs: dict[str, tuple[str, ...]] = field(default_factory=dict)
    listed: frozenset[str] = frozenset()
    muted: bool = False
    network: Network | None = None
    expose: Expose = field(default_factory=Expose)
    ui: dict[str, Any] = field(default_factory=dict)
    extra: Extra = field(default_factory=dict)
    parent: Network | None = None
    revision: int = 0

    @property
    def path(self) -> str:
        """The full path, ``finish/raycast``."""
        owner = self.parent.owner if self.parent is not None else None
        return f"{owner.path}/{self.id}" if owner is not None else self.id

    def leaves(self) -> Iterator[Node]:
        """This node, or all plain nodes inside when it is a group."""
        if self.network is None:
            yield self
        else:
            for node in self.network.nodes.values():
                yield from node.leaves()


class Network:
    """A graph of nodes with a table of variables. The inside of a group is a network, too; see ``owner``.

    Args:
        find: gives the processor class for an id or raises UnknownProcessor. Default: ``nodegraph.registry.find``.

    Attributes:
        revision: counts changes. ``structure``: the revision of the last change of nodes, wires, groups or muting.
        file: where the workspace was read from or saved to, None before.
        token: names this document among all open ones; pasting tells by it whether a copy comes from here.
    """

    def __init__(self, find: Callable[[str], type[Processor]] | None = None, *, owner: Node | None = None) -> None:
        self.nodes: dict[str, Node] = {}
        self.variables: dict[str, Variable] = {}
        self.ui: dict[str, Any] = {}
        self.extra: Extra = {}
        self.owner = owner
        self.file: Path | None = None
        self.revision = 0
        self.structure = 0
        self._find = find
        self._history: History | None = None
        self._touched: set[Node] = set()
        self._flattened: Any = None  # private to flatten.py
        self._token = ""

    # -- looking things up ----------------------------------------------------------------------------------------

    @property
    def root(self) -> Network:
        """The whole document that this level belongs to."""
        level = self
        while level.owner is not None and level.owner.parent is not None:
            level = level.owner.parent
        return level

    @property
    def prefix(self) -> str:
        """What stands before an id of this level in a full path: empty, or ``finish/``."""
        return f"{self.owner.path}/" if self.owner is not None else ""

    @property
    def token(self) -> str:
        if not self._token:
            import secrets

            self._token = secrets.token_hex(8)
        return self._token

    def find(self, type: str) -> type[Processor]:
        """Return the processor class for an id. Raises UnknownProcessor."""
        root = self.root
        if root._find is not None:
            return root._find(type)
        from nodegraph.registry import find

        return find(type)

    def node(self, path: str) -> Node:
        """Return the node at a path below this level. Raises CommandError with the near miss."""
        level, done = self, ""
        *groups, last = path.split("/")
        for part in groups:
            inner = level.nodes[part].network if part in level.nodes else None
            if inner is None:
                raise CommandError(f"{path}: no such group {part!r}{near_miss(part, level.nodes)}")
            level, done = inner, f"{done}{part}/"
        if last not in level.nodes:
            raise CommandError(f"{done}{last}: no such node{near_miss(last, level.nodes)}")
        return level.nodes[last]

    def walk(self) -> Iterator[Node]:
        """All nodes of this level and, after each group, of its inside; in file order."""
        for node in self.nodes.values():
            yield node
            if node.network is not None:
                yield from node.network.walk()

    def levels(self) -> list[Network]:
        """This level and those of all groups below."""
        return [self, *(node.network for node in self.walk() if node.network is not None)]

    def flatten(self) -> Flat:
        """Return the flat snapshot that the scheduler plans on; made anew only where something changed."""
        from nodegraph.flatten import flatten

        return flatten(self.root)

    def note(self, nodes: Iterable[Node], structure: bool) -> None:
        """Count a change of these nodes' values, or of the structure. Commands call this through `Edits`."""
        self.revision += 1
        if structure:
            self.structure = self.revision
        for node in nodes:
            node.revision = self.revision
            self._touched.add(node)

    def __getitem__(self, path: str) -> Handle:
        from nodegraph.handle import Handle

        self.node(path)
        return Handle(self.root, self.prefix + path)

    def __contains__(self, path: object) -> bool:
        try:
            return isinstance(path, str) and self.node(path) is not None
        except CommandError:
            return False

    def __iter__(self) -> Iterator[Handle]:
        from nodegraph.handle import Handle

        return iter([Handle(self.root, self.prefix + id) for id in self.nodes])

    def __len__(self) -> int:
        return len(self.nodes)

    def __repr__(self) -> str:
        return f"<Network {self.prefix or (self.file.name if self.file else '')}: {len(self.nodes)} nodes>"

    # -- changing it: short forms of commands ---------------------------------------------------------------------

    @property
    def history(self) -> History:
        """Undo and redo of the whole document."""
        root = self.root
        if root._history is None:
            from nodegraph.history import History

            root._history = History(root)
        return root._history

    def add(self, type: str | type[Processor], id: str = "", /, **params: Any) -> Handle:
        """Add a node and return it; without an id it is named after its type."""
        from nodegraph.commands import Add
        from nodegraph.handle import Handle

        command = Add(type, id, params, group=self.prefix.rstrip("/"))
        self.history.do(command)
        return Handle(self.root, command.path)

    def remove(self, *paths: str) -> None:
        """Remove nodes with their wires; variables that nobody uses any more go with them."""
        from nodegraph.commands import Remove

        self.history.do(Remove([self.prefix + path for path in paths]))

    def __delitem__(self, path: str) -> None:
        self.remove(path)

    def connect(self, source: str, target: str, *, replace: bool = False) -> None:
        """Wire ``node.output`` to ``node.input`` or to ``node.parameter``."""
        from nodegraph.commands import Connect

        self.history.do(Connect(self.prefix + source, self.prefix + target, replace=replace))

    def disconnect(self, target: str, source: str = "") -> None:
        """Take the wires out of ``node.input``, or the one from ``source``."""
        from nodegraph.commands import Disconnect

        self.history.do(Disconnect(self.prefix + target, self.prefix + source if source else ""))

    def set(self, name: str, value: Any, *, encoded: bool = False) -> None:
        """Set ``node.parameter``, or a variable when the name has no point. ``encoded``: the value is JSON."""
        from nodegraph.commands import Set
        from nodegraph.variable_commands import SetVariable

        command = Set if "." in name else SetVariable
        self.history.do(command(self.prefix + name, value, encoded=encoded))

    def get(self, name: str) -> Any:
        """Return the effective value of ``node.parameter``, or of a variable when the name has no point."""
        from nodegraph import links

        return links.value_of(self, name)

    def rename(self, path: str, id: str) -> None:
        """Give a node another id; wires follow."""
        from nodegraph.commands import Rename

        self.history.do(Rename(self.prefix + path, id))

    def link(self, parameter: str, variable: str) -> None:
        """Let a parameter follow a variable, which is made from the parameter's value when there is none."""
        from nodegraph.variable_commands import Link

        self.history.do(Link(self.prefix + parameter, variable))

    def derive(self, variable: str, expression: str) -> None:
        """Let a variable follow an expression of others, as ``coarse / 2``; an empty one makes it plain again."""
        from nodegraph.variable_commands import SetExpression

        self.history.do(SetExpression(self.prefix + variable, expression))

    def unlink(self, parameter: str) -> None:
        """Let a parameter go its own way again, with the value that it has."""
        from nodegraph.variable_commands import Unlink

        self.history.do(Unlink(self.prefix + parameter))

    def mute(self, path: str, muted: bool = True) -> None:
        """Let data pass a node by."""
        from nodegraph.commands import Mute

        self.history.do(Mute(self.prefix + path, muted))

    def group(self, *paths: str, id: str = GROUP) -> Handle:
        """Put nodes into a group and return it."""
        from nodegraph.group_commands import Group
        from nodegraph.handle import Handle

        command = Group([self.prefix + path for path in paths], id)
        self.history.do(command)
        return Handle(self.root, command.path)

    def ungroup(self, path: str) -> None:
        """Dissolve a group."""
        from nodegraph.group_commands import Ungroup

        self.history.do(Ungroup(self.prefix + path))

    def copy(self, *paths: str) -> dict[str, Any]:
        """Return nodes as JSON, for `paste` here or in another network."""
        from nodegraph.clipboard import copy

        return copy(self.root, [self.prefix + path for path in paths])

    def paste(self, copied: dict[str, Any] | str) -> list[Handle]:
        """Add what was copied and return the new nodes."""
        from nodegraph.clipboard import Paste
        from nodegraph.handle import Handle

        command = Paste(copied, group=self.prefix.rstrip("/"))
        self.history.do(command)
        return [Handle(self.root, path) for path in command.paths]

    def undo(self) -> None:
        """Take back the last step."""
        self.history.undo()

    def redo(self) -> None:
        """Do again what was taken back last."""
        self.history.redo()

    def run(self, sinks: Iterable[str] | str | None = None, **options: Any) -> Any:
        """Evaluate on this process's engine and return what the sinks show; see `nodegraph.scripting.run_network`."""
        from nodegraph.scripting import run_network

        return run_network(self.root, sinks, **options)

    def _repr_png_(self) -> bytes | None:
        """The network's first picture, for notebooks."""
        from nodegraph.scripting import notebook_png

        return notebook_png(self.root)

    def save(self, path: str | Path | None = None) -> None:
        """Write the workspace, by default to the file that it came from."""
        from nodegraph import workspace

        workspace.save(self, path)


def split(name: str, what: str = "node.port") -> tuple[str, str]:
    """Split ``finish/raycast.step`` into path and port. Raises CommandError."""
    path, point, port = name.rpartition(".")
    if not point or not path or not port:
        raise CommandError(f"{name!r}: expected {what}, for example raycast.step")
    return path, port


def check_id(id: str, taken: Iterable[str], where: str = "") -> None:
    """Refuse an id that is no name or that is taken. Raises CommandError."""
    if not ID.fullmatch(id):
        raise CommandError(f"{where}{id!r}: an id has letters, digits and _, and begins with no digit")
    if id in taken:
        raise CommandError(f"{where}{id}: this name is taken")


def unique(id: str, taken: Iterable[str]) -> str:
    """Return ``id``, or the first free one of ``id_2``, ``id_3``, ..."""
    taken = set(taken)
    if id not in taken:
        return id
    stem = re.sub(r"_\d+$", "", id) or id
    number = 2
    while f"{stem}_{number}" in taken:
        number += 1
    return f"{stem}_{number}"
