"""What the canvas shows of the document's nodes: their ports, names and wires. Reads the network, knows no Qt."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from nodegraph.bends import is_coordinate
from nodegraph.errors import GraphError
from nodegraph.network import Network, Node
from nodegraph.params import Parameter
from nodegraph.ports import Input, connects, port_type
from nodegraph.wires import check_cycle, declaration, feeds, is_many, output_leaf, value_type

Wire = tuple[str, str, str]
"""Source ``node.output``, target id, target port; all of one level."""


@dataclass(frozen=True, slots=True)
class Port:
    """A plug of a node. ``type`` is None where nobody knows it: the processor is not there, or has no such port."""

    name: str
    output: bool
    type: type | None
    required: bool = False
    many: bool = False
    parameter: bool = False
    doc: str = ""

    @property
    def color(self) -> str:
        return port_type(self.type).color if self.type is not None else "#d9534f"

    @property
    def shape(self) -> str:
        return port_type(self.type).shape if self.type is not None else "ring"

    @property
    def type_name(self) -> str:
        return port_type(self.type).name if self.type is not None else "unknown type"


@dataclass(frozen=True, slots=True)
class Face:
    """All that is painted of a node and that only a change of the structure can change."""

    id: str
    title: str
    inputs: tuple[Port, ...]
    outputs: tuple[Port, ...]
    muted: bool
    group: bool
    known: bool
    tags: tuple[tuple[str, str], ...] = ()
    """Ports shown on the face of the group around: (``in.name`` or ``out.name``, name on the face)."""


def face_of(node: Node) -> Face:
    """What is shown of a node now."""
    return Face(
        node.id,
        title_of(node),
        tuple(inputs_of(node)),
        tuple(outputs_of(node)),
        node.muted,
        node.network is not None,
        node.network is not None or node.processor is not None,
        tuple(_tags(node)),
    )


def title_of(node: Node) -> str:
    """The kind of a node in words: ``Gaussian Blur``, ``Group of 5``, ``filter.old (not available)``."""
    if node.network is not None:
        return f"Group of {len(node.network.nodes)}"
    if node.processor is None:
        return f"{node.type} (not available)"
    return spaced(node.processor.__name__)


def spaced(name: str) -> str:
    """``GaussianBlur`` and ``Raycast2D`` as two words."""
    return re.sub(r"(?<=[a-z])(?=[A-Z0-9])|(?<=[A-Z0-9])(?=[A-Z][a-z])", " ", name)


def inputs_of(node: Node) -> Iterator[Port]:
    """All inputs, then those parameters and unknown names that a wire leads into."""
    if node.network is not None:
        declared = list(node.expose.inputs)
    else:
        declared = list(node.processor.inputs) if node.processor is not None else []
    for name in declared:
        yield input_port(node, name)
    for name in node.inputs:
        if name not in declared:
            yield input_port(node, name)


def input_port(node: Node, name: str) -> Port:
    """One input or parameter of a node as a plug."""
    try:
        found = declaration(node, name, "")
    except GraphError:
        return Port(name, False, None)
    first = found[0]
    required = any(isinstance(one, Input) and one.required for one in found)
    return Port(name, False, value_type(first), required, is_many(node, name), isinstance(first, Parameter), first.doc)


def outputs_of(node: Node) -> Iterator[Port]:
    """All outputs, then those that wires name although nobody knows them."""
    if node.network is not None:
        declared = list(node.expose.outputs)
    else:
        declared = list(node.processor.outputs) if node.processor is not None else []
    for name in declared:
        yield output_port(node, name)
    if node.processor is None and node.network is None and node.parent is not None:
        named = {text for other in node.parent.nodes.values() for wires in other.inputs.values() for text in wires}
        for text in sorted(named):
            id, _, name = text.rpartition(".")
            if id == node.id:
                yield Port(name, True, None)


def output_port(node: Node, name: str) -> Port:
    """One output of a node as a plug."""
    try:
        leaf, output = output_leaf(node, name, "")
    except GraphError:
        return Port(name, True, None)
    if leaf.processor is None:
        return Port(name, True, None)
    port = leaf.processor.outputs[output]
    return Port(name, True, port.type, doc=port.doc)


def _tags(node: Node) -> Iterator[tuple[str, str]]:
    owner = node.parent.owner if node.parent is not None else None
    if owner is None:
        return
    for faces in (owner.expose.inputs, owner.expose.params):
        for shown, ports in faces.items():
            for port in ports:
                id, _, name = port.partition(".")
                if id == node.id:
                    yield f"in.{name}", shown
    for shown, port in owner.expose.outputs.items():
        id, _, name = port.partition(".")
        if id == node.id:
            yield f"out.{name}", shown


def wires_of(level: Network) -> Iterator[Wire]:
    """All wires of a level, in file order."""
    for node in level.nodes.values():
        for name, sources in node.inputs.items():
            for source in sources:
                yield source, node.id, name


# -- what may be wired ----------------------------------------------------------------------------------------------


def ids_above(level: Network, start: str) -> set[str]:
    """Ids of a level that a node reads from, directly or not, with its own."""
    seen, stack = {start}, [start]
    while stack:
        for sources in level.nodes[stack.pop()].inputs.values():
            for source in sources:
                id = source.rpartition(".")[0]
                if id in level.nodes and id not in seen:
                    seen.add(id)
                    stack.append(id)
    return seen


def ids_below(level: Network, start: str) -> set[str]:
    """Ids of a level that read from a node, directly or not, with its own."""
    readers: dict[str, set[str]] = {}
    for source, target, _ in wires_of(level):
        readers.setdefault(source.rpartition(".")[0], set()).add(target)
    seen, stack = {start}, [start]
    while stack:
        for id in readers.get(stack.pop(), ()):
            if id not in seen:
                seen.add(id)
                stack.append(id)
    return seen


def accepts_type(node: Node, name: str, given: type) -> bool:
    """Whether a value of a type may be wired into an input or parameter."""
    try:
        return all(connects(given, value_type(port)) for port in declaration(node, name, ""))
    except GraphError:
        return False


def is_fed_outside(node: Node, name: str) -> bool:
    """Whether a wire around the group that holds a node feeds this input already."""
    return len(feeds(node, name)) > len(node.inputs.get(name, ())) and not is_many(node, name)


def legal_targets(level: Network, source: str) -> set[tuple[str, str]]:
    """Inputs of a level that an output may be wired to, as (id, input)."""
    giver, _, output = source.rpartition(".")
    given = output_port(level.nodes[giver], output).type
    if given is None:
        return set()
    above = ids_above(level, giver)
    found: set[tuple[str, str]] = set()
    for node in level.nodes.values():
        for port in inputs_of(node):
            legal = port.type is not None and accepts_type(node, port.name, given)
            if (
                legal
                and not _closes_cycle(level, source, node, port.name, above)
                and not is_fed_outside(node, port.name)
            ):
                found.add((node.id, port.name))
    return found


def legal_sources(level: Network, target: str, name: str) -> set[tuple[str, str]]:
    """Outputs of a level that may be wired to an input, as (id, output)."""
    node = level.nodes[target]
    if is_fed_outside(node, name):
        return set()
    below = ids_below(level, target)
    return {
        (other.id, port.name)
        for other in level.nodes.values()
        for port in outputs_of(other)
        if port.type is not None
        and accepts_type(node, name, port.type)
        and not _closes_cycle(level, f"{other.id}.{port.name}", node, name, {target} if other.id in below else set())
    }


def _closes_cycle(level: Network, source: str, node: Node, name: str, near: set[str]) -> bool:
    """Whether a wire would close a cycle. Only nodes ``near`` can; groups among them are looked into."""
    if node.id not in near:
        return False
    try:
        check_cycle(level, source, node, name)
    except GraphError:
        return True
    return False


def fitting_inputs(node: Node, given: type) -> list[str]:
    """Inputs of a node that take a value of a type: those with no wire first."""
    names = [port.name for port in inputs_of(node) if port.type is not None and accepts_type(node, port.name, given)]
    return sorted(names, key=lambda name: bool(node.inputs.get(name)))


def fitting_parameters(node: Node, given: type) -> list[str]:
    """Parameters of a node, not wired and following nothing, that take a value of a type."""
    if node.network is not None:
        names = list(node.expose.params)
    else:
        names = list(node.processor.params) if node.processor is not None else []
    free = [name for name in names if name not in node.inputs and name not in node.links]
    return [name for name in free if accepts_type(node, name, given)]


def fitting_output(node: Node, wanted: Callable[[type], bool]) -> str | None:
    """The first output of a node whose type suits."""
    return next((port.name for port in outputs_of(node) if port.type is not None and wanted(port.type)), None)


def as_position(value: Any) -> tuple[float, float] | None:
    """A position as it is stored, or None where what is stored is none."""
    if isinstance(value, (list, tuple)) and len(value) == 2 and all(map(is_coordinate, value)):
        return float(value[0]), float(value[1])
    return None
