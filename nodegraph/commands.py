"""Edits of a network, each undoable as a delta.

A command is made with plain names and does nothing until `History.do` applies it. ``edit`` is where it checks
everything and then changes the document through an `Edits`, which knows how to take it back.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from nodegraph import links
from nodegraph.changes import (
    cut_outputs,
    hide_ports,
    level_at,
    put_value,
    put_variable,
    put_wires,
    reap,
    sources_read,
    swap_faces,
    swap_sources,
    variables_of,
    with_id,
    with_inside,
)
from nodegraph.edits import Edits
from nodegraph.errors import CommandError, ParameterError, PortError, near_miss
from nodegraph.network import Network, Node, check_id, split, unique
from nodegraph.params import Parameter
from nodegraph.wires import check_cycle, check_types, feeds, is_many, targets

if TYPE_CHECKING:
    from nodegraph.processor import Processor


class Command:
    """One edit. ``apply`` does it (or does it again), ``revert`` takes it back exactly."""

    name = "edit"

    def __init__(self) -> None:
        self._edits: Edits | None = None

    def edit(self, network: Network, edits: Edits) -> None:
        """Check the edit and make it through ``edits``. Raises GraphError; what was begun is then taken back."""
        raise CommandError(f"{self.name}: this command changes nothing")

    def apply(self, network: Network) -> None:
        if self._edits is not None:
            self._edits.redo()
            return
        edits = Edits(network.root)
        try:
            self.edit(network.root, edits)
        except BaseException:
            if not edits.empty:
                edits.undo()
            raise
        self._edits = edits

    def revert(self, network: Network) -> None:
        if self._edits is None:
            raise CommandError(f"{self.name}: this was never done, so it cannot be undone")
        self._edits.undo()

    @property
    def empty(self) -> bool:
        """True when the edit was done and changed nothing."""
        return self._edits is None or self._edits.empty

    @property
    def touched(self) -> frozenset[str]:
        """Paths of the nodes whose values may have changed."""
        return frozenset(node.path for node in self._edits.touched) if self._edits else frozenset()

    @property
    def structural(self) -> bool:
        """Whether nodes, wires, groups or muting changed."""
        return self._edits is not None and self._edits.structure

    def absorb(self, later: Command) -> bool:
        """Take over a later command on the very same values; see `Edits.absorb`."""
        return (
            type(self) is type(later)
            and self._edits is not None
            and later._edits is not None
            and self._edits.absorb(later._edits)
        )


class Add(Command):
    """Add a node of a processor, given by id or class, at the end of a level. ``path`` says where it went."""

    name = "add"

    def __init__(
        self, type: str | type[Processor], id: str = "", params: Mapping[str, Any] | None = None, *, group: str = ""
    ) -> None:
        super().__init__()
        self.type = type
        self.id = id
        self.params = dict(params or {})
        self.group = group
        self.path = ""

    def edit(self, network: Network, edits: Edits) -> None:
        level = level_at(network, self.group)
        cls = network.find(self.type) if isinstance(self.type, str) else self.type
        id = self.id or unique(cls.id.rpartition(".")[2], level.nodes)
        check_id(id, level.nodes, level.prefix)
        node = Node(id, cls.id, cls, version=cls.version, parent=level)
        for name, value in self.params.items():
            where = f"{level.prefix}{id}.{name}"
            if name not in cls.params:
                raise ParameterError(f"{where}: no such parameter{near_miss(name, cls.params)}")
            checked = cls.params[name].check(value, where)
            if not links.same(cls.params[name], checked, cls.params[name].default):
                node.params[name] = checked
        self.path = level.prefix + id
        edits.put(level.nodes, id, node)
        edits.touch(node, structure=True)


class Remove(Command):
    """Remove nodes with the wires into and out of them, and variables that nobody follows any more."""

    name = "remove"

    def __init__(self, paths: Iterable[str]) -> None:
        super().__init__()
        self.paths = list(paths)

    def edit(self, network: Network, edits: Edits) -> None:
        for node in [network.node(path) for path in dict.fromkeys(self.paths)]:
            level = node.parent
            if level is None or level.nodes.get(node.id) is not node:
                continue  # it went with a group that was removed just before
            cut_outputs(edits, level, sources_read(level, node.id))
            hide_ports(edits, level, partial(_belongs, node.id))
            edits.drop(level.nodes, node.id)
            edits.touch(structure=True)
            reap(edits, [scoped for inner in with_inside(node) for scoped in variables_of(inner)])


class Connect(Command):
    """Wire ``node.output`` to an input or parameter on the same level.

    A single input that is wired already refuses a second wire, unless ``replace``. ``place``: position among the wires
    of an input that takes many.
    """

    name = "connect"

    def __init__(self, source: str, target: str, *, replace: bool = False, place: int | None = None) -> None:
        super().__init__()
        self.source = source
        self.target = target
        self.replace = replace
        self.place = place

    def edit(self, network: Network, edits: Edits) -> None:
        path, name = split(self.target, "node.input")
        node = network.node(path)
        level = node.parent
        assert level is not None
        giver, output = split(self.source, "node.output")
        if network.node(giver).parent is not level:
            raise PortError(f"{self.target}: {self.source} lies on another level; show the port on the group's face")
        source = f"{network.node(giver).id}.{output}"
        check_types(level, source, node, name)
        there = node.inputs.get(name, ())
        if is_many(node, name):
            if source in there:
                raise PortError(f"{self.target}: is wired to {self.source} already")
            place = len(there) if self.place is None else self.place
            wires = (*there[:place], source, *there[place:])
        else:
            own = [level.prefix + text for text in there]
            others = [one.prefix + text for end in targets(node, name) for one, text in feeds(*end)]
            others = [text for text in others if text not in own]
            if others or (own and not self.replace):
                raise PortError(f"{self.target}: is wired to {[*others, *own][0]} already; disconnect it first")
            wires = (source,)
        if wires == there:
            return
        check_cycle(level, source, node, name)
        put_wires(edits, node, name, wires)


class Disconnect(Command):
    """Take all wires out of an input or parameter, or the one from ``source``."""

    name = "disconnect"

    def __init__(self, target: str, source: str = "") -> None:
        super().__init__()
        self.target = target
        self.source = source

    def edit(self, network: Network, edits: Edits) -> None:
        path, name = split(self.target, "node.input")
        node = network.node(path)
        there = node.inputs.get(name, ())
        if not there:
            raise PortError(f"{self.target}: nothing is connected here{near_miss(name, node.inputs)}")
        wires: tuple[str, ...] = ()
        if self.source:
            source = self.source.rpartition("/")[2]
            if source not in there:
                raise PortError(f"{self.target}: no wire comes from {self.source}{near_miss(source, there)}")
            wires = tuple(text for text in there if text != source)
        put_wires(edits, node, name, wires)


class Set(Command):
    """Set a parameter. One that follows a plain variable sets that; one that follows an expression or a wire refuses.

    ``encoded``: the value is JSON, as in a workspace, and not a Python value.
    """

    name = "set"

    def __init__(self, target: str, value: Any, *, encoded: bool = False) -> None:
        super().__init__()
        self.name = f"{self.name} {target.rpartition('.')[2]}"  # menus say what would be undone
        self.target = target
        self.value = value
        self.encoded = encoded

    def edit(self, network: Network, edits: Edits) -> None:
        path, param = split(self.target, "node.parameter")
        node = network.node(path)
        links.plain_parameter(node, param)  # says what is wrong with the name
        for leaf, name in targets(node, param):
            self._set(edits, *links.plain_parameter(leaf, name))

    def _set(self, edits: Edits, node: Node, param: str, declared: Parameter) -> None:
        where = f"{node.path}.{param}"
        wires = feeds(node, param)
        if wires:
            level, text = wires[-1]
            raise ParameterError(f"{where}: follows the wire from {level.prefix}{text}; disconnect it first")
        link = links.link_of(node, param)
        if link is None:
            put_value(edits, node, param, declared, self._checked(declared, where))
            return
        holder, _, name = link
        scoped = links.lookup(holder.parent, name) if holder.parent is not None else None
        if scoped is None:
            raise ParameterError(f"{where}: follows {name!r}, which is no variable; unlink it first")
        variable = scoped[0].variables[scoped[1]]
        if variable.expression:
            raise ParameterError(
                f"{where}: follows {links.label(scoped)} = {variable.expression}; change the expression or unlink it"
            )
        put_variable(edits, scoped, self._checked(declared, where))

    def _checked(self, declared: Parameter, where: str) -> Any:
        return declared.decode(self.value, where) if self.encoded else declared.check(self.value, where)


class Reset(Set):
    """Return a parameter to its default."""

    name = "reset"

    def __init__(self, target: str) -> None:
        super().__init__(target, None)

    def _checked(self, declared: Parameter, where: str) -> Any:
        return declared.default

    def edit(self, network: Network, edits: Edits) -> None:
        path, param = split(self.target, "node.parameter")
        node = network.node(path)
        if node.network is None and param in node.params and param not in getattr(node.processor, "params", ()):
            edits.drop(node.params, param)  # a value that nobody here knows
            edits.touch(node)
            return
        super().edit(network, edits)


class Rename(Command):
    """Give a node another id. Wires and the group's face follow; its place stays."""

    name = "rename"

    def __init__(self, path: str, id: str) -> None:
        super().__init__()
        self.path = path
        self.id = id

    def edit(self, network: Network, edits: Edits) -> None:
        node = network.node(self.path)
        level = node.parent
        assert level is not None
        old = node.id
        if self.id == old:
            return
        check_id(self.id, level.nodes, level.prefix)
        inside = list(with_inside(node))
        ids = {old: self.id}
        edits.rekey(level.nodes, old, self.id)
        edits.assign(node, "id", self.id)
        swap_sources(edits, level, lambda text: with_id(text, ids))
        swap_faces(edits, level, lambda port: (with_id(port, ids),), lambda port: with_id(port, ids))
        edits.touch(*inside, structure=True)


class Mute(Command):
    """Mute a node, or wake it up."""

    name = "mute"

    def __init__(self, path: str, muted: bool = True) -> None:
        super().__init__()
        self.path = path
        self.muted = bool(muted)

    def edit(self, network: Network, edits: Edits) -> None:
        node = network.node(self.path)
        if node.muted != self.muted:
            edits.assign(node, "muted", self.muted)
            edits.touch(structure=True)


class SetUI(Command):
    """Note what only editors look at, for a node or (empty path) the workspace; a value of None removes it."""

    name = "arrange"

    def __init__(self, path: str, key: str, value: Any) -> None:
        super().__init__()
        self.path = path
        self.key = key
        self.value = value

    def edit(self, network: Network, edits: Edits) -> None:
        ui = network.node(self.path).ui if self.path else network.ui
        if not self.path and self.key == "nodes":
            raise CommandError("ui.nodes: what belongs to a node is set on the node")
        if self.value is None:
            if self.key in ui:
                edits.drop(ui, self.key)
        elif ui.get(self.key) != self.value:
            edits.put(ui, self.key, self.value)


def _belongs(id: str, port: str) -> bool:
    return port.partition(".")[0] == id
