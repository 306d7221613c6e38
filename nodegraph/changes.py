"""What several commands do: changes of the document that keep it whole, made through an `Edits`."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any

from nodegraph import bends, expressions, links
from nodegraph.edits import Edits
from nodegraph.errors import CommandError, ParameterError
from nodegraph.network import Kept, Network, Node
from nodegraph.params import Parameter
from nodegraph.wires import targets


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
    """Write the wires of one input; none removes the entry. The bends of a wire go with it."""
    bends.follow(edits, node, name, lambda source: source if source in wires else None)
    if wires:
        edits.put(node.inputs, name, tuple(wires))
    elif name in node.inputs:
        edits.drop(node.inputs, name)
    edits.touch(*[leaf for leaf, _ in targets(node, name)], structure=True)


def swap_sources(edits: Edits, level: Network, new: Callable[[str], str | None]) -> None:
    """Rewrite the source of every wire of a level: ``new(text)`` gives the new text, or None to cut the wire."""
    for node in level.nodes.values():
        for name, wires in list(node.inputs.items()):
            swapped = tuple(text for text in map(new, wires) if text is not None)
            if swapped != wires:
                bends.follow(edits, node, name, new)
                put_wires(edits, node, name, swapped)


def swap_faces(
    edits: Edits, level: Network, leads: Callable[[str], tuple[str, ...]], output: Callable[[str], str]
) -> None:
    """Rewrite what the face of the group around a level shows: ``leads`` for inputs and parameters, ``output``."""
    if level.owner is None:
        return
    face = level.owner.expose
    for table in (face.inputs, face.params):
        for name, ports in list(table.items()):
            swapped = tuple(port for ports_of_one in map(leads, ports) for port in ports_of_one)
            if swapped != ports:
                edits.put(table, name, swapped)
    for name, port in list(face.outputs.items()):
        if output(port) != port:
            edits.put(face.outputs, name, output(port))


def cut_outputs(edits: Edits, level: Network, gone: Collection[str]) -> None:
    """Cut all wires of a level that come from these ``node.output``."""
    swap_sources(edits, level, lambda text: None if text in gone else text)


def hide_ports(
    edits: Edits, level: Network, gone: Callable[[str], bool], faces: Iterable[str] = ("inputs", "params", "outputs")
) -> None:
    """Take those ``node.port`` of a level for which ``gone`` holds off the face of the group around it."""
    group = level.owner
    if group is None:
        return
    for face in faces:
        table: dict[str, Any] = getattr(group.expose, face)
        for name, ports in list(table.items()):
            ports = (ports,) if isinstance(ports, str) else ports
            left = tuple(port for port in ports if not gone(port))
            if not left:
                hide_face(edits, group, face, name)
            elif left != ports:
                edits.put(table, name, left)
                edits.touch(*group.leaves(), structure=True)


def hide_face(edits: Edits, group: Node, face: str, name: str) -> None:
    """Take a name off a group's face, with the wires outside that hang on it. What was linked keeps its value."""
    level = group.parent
    assert level is not None
    port = f"{group.id}.{name}"
    if face == "outputs":
        hide_ports(edits, level, port.__eq__, ("outputs",))
        cut_outputs(edits, level, {port})
    else:
        hide_ports(edits, level, port.__eq__, ("inputs", "params"))
        if name in group.links:
            unlink(edits, group, name)
        if name in group.inputs:
            put_wires(edits, group, name, ())
    edits.touch(*group.leaves(), structure=True)
    edits.drop(getattr(group.expose, face), name)


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


def unlink(edits: Edits, node: Node, param: str) -> None:
    """Take a link away and store the value that it gave."""
    scoped = links.lookup(node.parent, node.links[param]) if node.parent is not None else None
    kept: list[tuple[Node, str, Parameter, Any]] = []
    for leaf, name in targets(node, param):
        declared = leaf.processor.params.get(name) if leaf.processor is not None else None
        if declared is not None:
            try:
                kept.append((leaf, name, declared, links.linked_value(leaf, name, declared)))
            except ParameterError:
                continue  # it had no usable value; the stored one or the default counts again
    if node.trouble is not None and scoped is not None:
        try:
            value = links.evaluate(scoped)
            json = links.codec(scoped, value).encode(value)
            edits.put(node.params, param, Kept(json, f": {node.trouble}"))
        except ParameterError:
            pass  # neither the value nor the processor is known: there is nothing to keep
    edits.drop(node.links, param)
    for leaf, name, declared, value in kept:
        if links.link_of(leaf, name) is None:
            put_value(edits, leaf, name, declared, value)
    edits.touch(*[leaf for leaf, _ in targets(node, param)])
    reap(edits, [scoped] if scoped else [])


def rename_uses(edits: Edits, scoped: links.Scoped, new: str) -> None:
    """Give a variable another name where links and expressions mention it; its own entry is left to the caller."""
    _, name = scoped
    followers, derived = list(links.followers(scoped)), list(links.derived_from(scoped))
    for node, param in followers:
        edits.put(node.links, param, new)
    for table, other in derived:
        variable = table.variables[other]
        text = expressions.parse(variable.expression, "").renamed({name: new})
        edits.assign(variable, "expression", text)
    edits.touch(*[leaf for node, param in followers for leaf, _ in targets(node, param)])


def with_id(text: str, ids: Mapping[str, str]) -> str:
    """``node.port`` with the node's id replaced, where ``ids`` has a new one."""
    id, point, port = text.partition(".")
    return f"{ids.get(id, id)}{point}{port}"


def sources_read(level: Network, id: str) -> set[str]:
    """Outputs of a node that wires of its level come from, as ``node.output``."""
    return {
        text
        for node in level.nodes.values()
        for wires in node.inputs.values()
        for text in wires
        if text.rpartition(".")[0] == id
    }


def with_inside(node: Node) -> Iterable[Node]:
    """A node and, when it is a group, all nodes inside."""
    yield node
    if node.network is not None:
        yield from node.network.walk()


def variables_of(node: Node) -> list[links.Scoped]:
    """Variables that a node's links, or the expressions in a group's own table, name."""
    found = [links.lookup(node.parent, name) for name in node.links.values()] if node.parent is not None else []
    if node.network is not None:
        for variable in node.network.variables.values():
            found += [links.lookup(node.network, name) for name in links.names_in(variable)]
    return [scoped for scoped in found if scoped is not None]
