"""Where wires lead: through the faces of groups, past muted nodes, and whether they may be drawn.

A wire is stored at its target, as the text ``node.output`` of a node on the same level. Here it is followed.
"""

from __future__ import annotations

from collections.abc import Iterator

from nodegraph.errors import CycleError, GraphError, MutedError, PortError, near_miss, near_miss_or_all
from nodegraph.network import Network, Node, split
from nodegraph.params import Parameter
from nodegraph.ports import Input, connects, port_type

Wire = tuple[Network, str]
"""The level that a wire lies on, and its source ``node.output`` there."""


# -- ports of nodes and of groups ---------------------------------------------------------------------------------


def targets(node: Node, name: str) -> list[tuple[Node, str]]:
    """Plain ports that an input or parameter leads to: itself, or what a group shows under this name."""
    if node.network is None:
        return [(node, name)]
    found = []
    for inner in (*node.expose.inputs.get(name, ()), *node.expose.params.get(name, ())):
        id, _, port = inner.rpartition(".")
        if id in node.network.nodes:
            found += targets(node.network.nodes[id], port)
    return found


def declaration(node: Node, name: str, where: str) -> list[Input | Parameter]:
    """Declarations behind an input or parameter: one, or several where a group shows several under one name.

    Raises PortError for a name that is not there, or a processor that is not available.
    """
    found: list[Input | Parameter] = []
    for leaf, port in targets(node, name):
        cls = leaf.processor
        if cls is None:
            raise PortError(f"{where}: {leaf.type} is not available here, so nothing is known of its ports")
        if port in cls.inputs:
            found.append(cls.inputs[port])
        elif port in cls.params:
            found.append(cls.params[port])
        else:
            known = [*cls.inputs, *cls.params]
            raise PortError(f"{where}: {leaf.path} has no input or parameter {port!r}{near_miss(port, known)}")
    if not found:
        known = [*node.expose.inputs, *node.expose.params]
        raise PortError(f"{where}: the group {node.path} shows no input or parameter {name!r}{near_miss(name, known)}")
    return found


def output_leaf(node: Node, name: str, where: str) -> tuple[Node, str]:
    """The plain output behind ``node.name``. Raises PortError for a name that is not there."""
    while node.network is not None:
        inner = node.expose.outputs.get(name)
        if inner is None:
            miss = near_miss_or_all(name, node.expose.outputs)
            raise PortError(f"{where}: the group {node.path} shows no output {name!r}{miss}")
        node, name = source_node(node.network, inner, where)
    if node.processor is not None and name not in node.processor.outputs:
        raise PortError(f"{where}: {node.path} has no output {name!r}{near_miss_or_all(name, node.processor.outputs)}")
    return node, name


def source_node(level: Network, source: str, where: str) -> tuple[Node, str]:
    """The node of a level that ``node.output`` names, and the output. Raises PortError."""
    id, _, output = source.rpartition(".")
    if not id:
        raise PortError(f"{where}: {source!r} names no output of a node; write it as node.output")
    if id not in level.nodes:
        raise PortError(f"{where}: there is no node {level.prefix}{id}{near_miss(id, level.nodes)}")
    return level.nodes[id], output


def value_type(port: Input | Parameter) -> type:
    """What a wire into this input or parameter carries."""
    return port.type if isinstance(port, Input) else port.value_type


def is_many(node: Node, name: str) -> bool:
    """Whether an input takes any number of wires; all that a group shows under the name must."""
    found = [leaf.processor.inputs.get(port) for leaf, port in targets(node, name) if leaf.processor is not None]
    return bool(found) and all(port is not None and port.many for port in found)


def feeds(node: Node, name: str) -> list[Wire]:
    """All wires into an input or parameter of a node: its own, then those into the faces of groups around it."""
    wires: list[Wire] = [(node.parent, source) for source in node.inputs.get(name, ())] if node.parent else []
    owner = node.parent.owner if node.parent is not None else None
    if owner is not None:
        inner = f"{node.id}.{name}"
        for faces in (owner.expose.inputs, owner.expose.params):
            for face, ports in faces.items():
                if inner in ports:
                    wires += feeds(owner, face)
    return wires


# -- may this wire be drawn? --------------------------------------------------------------------------------------


def check_types(level: Network, source: str, target: Node, name: str) -> None:
    """Raise PortError where a wire from ``source`` cannot carry what the target takes."""
    where = f"{target.path}.{name}"
    leaf, output = output_leaf(*source_node(level, source, where), where)
    if leaf.processor is None:
        raise PortError(f"{where}: {leaf.type} is not available here, so nothing is known of its outputs")
    given = leaf.processor.outputs[output].type
    for port in declaration(target, name, where):
        wanted = value_type(port)
        if not connects(given, wanted):
            raise PortError(
                f"{where}: takes {port_type(wanted).name}, but {level.prefix}{source} gives {port_type(given).name}"
            )


def check_cycle(level: Network, source: str, target: Node, name: str) -> None:
    """Raise CycleError where a wire from ``source`` would let the target depend on itself, muted nodes included."""
    ends = {leaf for leaf, _ in targets(target, name)}
    start, _ = output_leaf(*source_node(level, source, f"{target.path}.{name}"), f"{target.path}.{name}")
    came_from: dict[Node, Node | None] = {start: None}
    stack = [start]
    while stack:
        node = stack.pop()
        if node in ends:
            path = [node]
            while (reader := came_from[path[-1]]) is not None:
                path.append(reader)
            raise CycleError([step.path for step in (*path, node)])
        for above in _above(node):
            if above not in came_from:
                came_from[above] = node
                stack.append(above)


def _above(node: Node) -> Iterator[Node]:
    """Plain nodes whose outputs a plain node reads directly."""
    assert node.parent is not None
    names = {*node.inputs}
    owner = node.parent.owner
    if owner is not None:
        shown = (
            port for faces in (owner.expose.inputs, owner.expose.params) for ports in faces.values() for port in ports
        )
        names |= {split(port)[1] for port in shown if port.rpartition(".")[0] == node.id}
    for name in names:
        for level, source in feeds(node, name):
            try:
                yield output_leaf(*source_node(level, source, ""), "")[0]
            except PortError:
                continue  # a wire of the file that leads nowhere; it blocks, but closes no cycle


# -- following a wire ---------------------------------------------------------------------------------------------


Known = dict[tuple[Node, str], tuple[Node, str]]
"""Outputs of muted nodes and groups that were followed to their ends; shared by the calls of one pass."""


def resolve(level: Network, source: str, where: str, known: Known) -> tuple[Node, str] | GraphError:
    """Return the plain, unmuted output that a wire comes from, or the error why there is none.

    ``where`` is the port at its end, which the message begins with.
    """
    seen: dict[tuple[Node, str], None] = {}
    while True:
        try:
            node, output = source_node(level, source, where)
        except PortError as error:
            return error
        if not node.muted and node.processor is not None and output in node.processor.outputs:
            if seen:
                known.update(dict.fromkeys(seen, (node, output)))
            return node, output
        if (node, output) in known:
            return known[node, output]
        if (node, output) in seen:
            return CycleError([node.path, node.path])
        seen[node, output] = None
        if node.muted:
            name = pass_through(node, output)
            if name is None:
                return MutedError(
                    f"{where}: {node.path} is muted and has no input that could stand for {output!r}; unmute it"
                )
            wires = feeds(node, name)
            if not wires:
                return MutedError(
                    f"{where}: {node.path} is muted and its input {name!r} is not wired; wire or unmute it"
                )
            level, source = wires[0]
        elif node.network is not None:
            inner = node.expose.outputs.get(output)
            if inner is None:
                miss = near_miss_or_all(output, node.expose.outputs)
                return PortError(f"{where}: the group {node.path} shows no output {output!r}{miss}")
            level, source = node.network, inner
        elif node.processor is not None:
            miss = near_miss_or_all(output, node.processor.outputs)
            return PortError(f"{where}: {node.path} has no output {output!r}{miss}")
        else:
            return node, output  # of an unknown processor; whether it has that output is not known either


def pass_through(node: Node, output: str) -> str | None:
    """The input whose value a muted node hands on as ``output``: the first of the output's type, or None."""
    try:
        leaf, name = output_leaf(node, output, "")
    except PortError:
        return None
    if leaf.processor is None:
        return None
    wanted = leaf.processor.outputs[name].type
    inputs = node.expose.inputs if node.network is not None else leaf.processor.inputs
    for candidate in inputs:
        try:
            ports = declaration(node, candidate, "")
        except PortError:
            continue
        if all(isinstance(port, Input) and connects(port.type, wanted) for port in ports):
            return candidate
    return None
