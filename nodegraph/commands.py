"""Edits of a network, each undoable as a delta.

A command is made with plain names and does nothing until `History.do` applies it. ``edit`` is where it checks
everything and then changes the document through an `Edits`, which knows how to take it back.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from nodegraph import links
from nodegraph.edits import Edits
from nodegraph.errors import CommandError, ParameterError, PortError, near_miss
from nodegraph.network import Kept, Network, Node, check_id, split, unique
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
            cut_outputs(edits, level, node, _sources_read(level, node.id))
            hide(edits, level, lambda id, _port, gone=node.id: id == gone)
            edits.drop(level.nodes, node.id)
            edits.touch(structure=True)
            used = {(scope, name) for inner in _with_inside(node) for scope, name in _variables_of(inner)}
            reap(edits, used)


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
        inside = list(_with_inside(node))
        edits.rekey(level.nodes, old, self.id)
        edits.assign(node, "id", self.id)
        swap_sources(edits, level, lambda text: _renamed(text, old, self.id))
        swap_faces(edits, level, lambda text: _renamed(text, old, self.id))
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


# -- shared by commands -------------------------------------------------------------------------------------------


def level_at(network: Network, group: str) -> Network:
    """The inside of a group, or the network itself for an empty path. Raises CommandError."""
    if not group:
        return network
    inside = network.node(group).network
    if inside is None:
        raise CommandError(f"{group}: this node is no group")
    return inside


def put_value(edits: Edits, node: Node, param: str, declared: Parameter, value: Any) -> None:
    """Store a checked value in a plain node; the default is stored as nothing."""
    old = node.params.get(param, declared.default)
    if not isinstance(old, Kept) and links.same(declared, old, value):
        return
    if not links.same(declared, value, declared.default):
        edits.put(node.params, param, value)
    elif param in node.params:
        edits.drop(node.params, param)
    edits.touch(node)


def put_wires(edits: Edits, node: Node, name: str, wires: Sequence[str]) -> None:
    """Write the wires of one input; none removes the entry."""
    if wires:
        edits.put(node.inputs, name, tuple(wires))
    elif name in node.inputs:
        edits.drop(node.inputs, name)
    edits.touch(*[leaf for leaf, _ in targets(node, name)], structure=True)


def swap_sources(edits: Edits, level: Network, new: Any) -> None:
    """Rewrite the source of every wire of a level: ``new(text)`` gives the new text, or None to cut the wire."""
    for node in level.nodes.values():
        for name, wires in list(node.inputs.items()):
            swapped = tuple(text for text in map(new, wires) if text is not None)
            if swapped != wires:
                put_wires(edits, node, name, swapped)


def swap_faces(edits: Edits, level: Network, new: Any) -> None:
    """Rewrite what the face of the group around a level leads to."""
    if level.owner is None:
        return
    face = level.owner.expose
    for table in (face.inputs, face.params):
        for name, ports in list(table.items()):
            swapped = tuple(map(new, ports))
            if swapped != ports:
                edits.put(table, name, swapped)
    for name, port in list(face.outputs.items()):
        if new(port) != port:
            edits.put(face.outputs, name, new(port))


def cut_outputs(edits: Edits, level: Network, node: Node, sources: Iterable[str]) -> None:
    """Cut all wires that come from these ``node.output`` of a level."""
    gone = set(sources)
    swap_sources(edits, level, lambda text: None if text in gone else text)


def hide(edits: Edits, level: Network, gone: Any) -> None:
    """Take ports off the face of the group around a level, with what hangs on them outside. ``gone(id, port)``."""
    group = level.owner
    if group is None or group.parent is None:
        return
    for table in (group.expose.inputs, group.expose.params):
        for name, ports in list(table.items()):
            left = tuple(port for port in ports if not gone(*port.split(".", 1)))
            if left == ports:
                continue
            if left:
                edits.put(table, name, left)
                continue
            hide(edits, group.parent, lambda id, port, name=name: id == group.id and port == name)
            if name in group.inputs:
                put_wires(edits, group, name, ())
            edits.drop(table, name)
            if name in group.links:
                scoped = links.lookup(group.parent, group.links[name])
                edits.drop(group.links, name)
                reap(edits, [scoped] if scoped else [])
    for name, port in list(group.expose.outputs.items()):
        if gone(*port.split(".", 1)):
            hide(edits, group.parent, lambda id, port, name=name: id == group.id and port == name)
            cut_outputs(edits, group.parent, group, [f"{group.id}.{name}"])
            edits.drop(group.expose.outputs, name)
    edits.touch(*group.leaves(), structure=True)


def reap(edits: Edits, used: Iterable[links.Scoped]) -> None:
    """Remove those of these variables that nobody follows any more, and what only they were derived from."""
    queue = list(used)
    for scoped in queue:
        level, name = scoped
        if name not in level.variables or any(links.followers(scoped)) or any(links.derived_from(scoped)):
            continue
        variable = level.variables[name]
        operands = [links.lookup(level, operand) for operand in links.names_in(variable)]
        edits.drop(level.variables, name)
        edits.touch()
        queue += [operand for operand in operands if operand is not None]


def put_variable(edits: Edits, scoped: links.Scoped, value: Any) -> None:
    """Write the value of a plain variable. Raises ParameterError where a parameter that follows refuses it."""
    level, name = scoped
    variable = level.variables[name]
    value = links.checked(scoped, value)
    declared = links.codec(scoped, value)
    if not isinstance(variable.value, Kept) and links.same(declared, variable.value, value):
        return
    edits.assign(variable, "value", value)
    touch_followers(edits, scoped)
    for other in links.dependents(scoped)[1:]:
        try:
            links.checked(other, links.evaluate(other))
        except ParameterError as error:
            raise ParameterError(f"{links.label(scoped)}: {value!r} is refused, because {error}") from None


def touch_followers(edits: Edits, scoped: links.Scoped) -> None:
    """Mark every node that a variable decides something of, through expressions and groups too."""
    edits.touch()
    for one in links.dependents(scoped):
        for node, param in links.followers(one):
            edits.touch(*[leaf for leaf, _ in targets(node, param)])


def _renamed(text: str, old: str, new: str) -> str:
    id, _, port = text.partition(".")
    return f"{new}.{port}" if id == old else text


def _sources_read(level: Network, id: str) -> set[str]:
    return {
        text
        for node in level.nodes.values()
        for wires in node.inputs.values()
        for text in wires
        if text.rpartition(".")[0] == id
    }


def _with_inside(node: Node) -> Iterable[Node]:
    yield node
    if node.network is not None:
        yield from node.network.walk()


def _variables_of(node: Node) -> list[links.Scoped]:
    found = [links.lookup(node.parent, name) for name in node.links.values()] if node.parent is not None else []
    if node.network is not None:
        for table in [node.network]:
            for variable in table.variables.values():
                found += [links.lookup(table, name) for name in links.names_in(variable)]
    return [scoped for scoped in found if scoped is not None]
