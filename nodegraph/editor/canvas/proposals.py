"""What suggests itself when a processor comes to stand among others: wires to its neighbours, values to share.

Reads the network, knows no Qt. Nothing is proposed that the commands would refuse.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from nodegraph import links
from nodegraph.editor.canvas.faces import (
    Port,
    accepts_type,
    ids_above,
    inputs_of,
    is_fed_outside,
    outputs_of,
)
from nodegraph.errors import GraphError
from nodegraph.expressions import RESERVED
from nodegraph.network import Network, Node, unique
from nodegraph.ports import Input, port_type

Box = tuple[float, float, float, float]
"""Left, top, width and height of a node."""

AHEAD = 320.0
"""How far apart the facing sides of two nodes may be for a wire between them to suggest itself."""
ASIDE = 240.0
OVERLAP = 60.0
SAME_NAME = 150.0
"""How much nearer an output seems that is called like the input."""
SHARED = ("Camera", "Light", "Plane", "TransferFunction")
"""Kinds that mean the same wherever they are: two nodes may share one although nobody shares it yet."""

Known = Callable[[str, str], Any]
"""The value of ``id``, ``output`` as far as it is known, else None."""


@dataclass(frozen=True, slots=True)
class WireProposal:
    """A wire from ``node.output`` to an input."""

    source: str
    target: str
    name: str


@dataclass(frozen=True, slots=True)
class LinkProposal:
    """Let ``node.parameter`` follow a variable, which ``giver`` (``node.parameter``) follows, too.

    fresh: the variable is made first, of the giver's value.
    """

    parameter: str
    variable: str
    giver: str
    fresh: bool = False


Proposal = WireProposal | LinkProposal


def propose(level: Network, node: Node, boxes: Mapping[str, Box], known: Known) -> list[Proposal]:
    """All that suggests itself for a node of a level, or one that could be added to it.

    ``boxes`` holds where nodes are, that of the node itself under its own id.
    """
    return [*propose_wires(level, node, boxes, known), *propose_links(level, node, boxes)]


def detached(level: Network, processor: Any) -> Node:
    """A node as it would be added to a level, without being in it."""
    return Node(" ", processor.id, processor, version=processor.version, parent=level)  # no node has this id


# -- wires ----------------------------------------------------------------------------------------------------------


def propose_wires(level: Network, node: Node, boxes: Mapping[str, Box], known: Known) -> Iterator[WireProposal]:
    """Wires from the nearest outputs on its left to what a node needs, and from its outputs to what is on its right."""
    own = boxes[node.id]
    before = {id: cost for id, box in boxes.items() if id != node.id and (cost := _cost(box, own)) is not None}
    after = {id: cost for id, box in boxes.items() if id != node.id and (cost := _cost(own, box)) is not None}
    above: set[str] = set()
    for sources in node.inputs.values():
        for source in sources:
            above |= _above(level, source.rpartition(".")[0])
    taken: set[str] = set()
    for port in inputs_of(node):
        if not port.required or node.inputs.get(port.name) or is_fed_outside(node, port.name):
            continue
        offers = [
            (cost - SAME_NAME * (out.name == port.name), f"{id}.{out.name}")
            for id, cost in before.items()
            if id in level.nodes
            for out in outputs_of(level.nodes[id])
            if f"{id}.{out.name}" not in taken and _fits(level.nodes[id], out, node, port, known)
        ]
        if offers:
            _, source = min(offers)
            taken.add(source)
            above |= _above(level, source.rpartition(".")[0])
            yield WireProposal(source, node.id, port.name)
    read = {source for other in level.nodes.values() for sources in other.inputs.values() for source in sources}
    for out in outputs_of(node):
        if f"{node.id}.{out.name}" in read:
            continue
        wanted = [
            (cost - SAME_NAME * (out.name == port.name), id, port.name)
            for id, cost in after.items()
            if id in level.nodes and id not in above
            for port in inputs_of(level.nodes[id])
            if port.required
            and not level.nodes[id].inputs.get(port.name)
            and not is_fed_outside(level.nodes[id], port.name)
            and _fits(node, out, level.nodes[id], port, known)
        ]
        if wanted:
            _, id, name = min(wanted)
            yield WireProposal(f"{node.id}.{out.name}", id, name)


def _above(level: Network, id: str) -> set[str]:
    return ids_above(level, id) if id in level.nodes else set()


def _cost(left: Box, right: Box) -> float | None:
    """How far a wire from one node to another would run; None where they are not neighbours in this order."""
    ahead = right[0] - (left[0] + left[2])
    aside = abs((right[1] + right[3] / 2) - (left[1] + left[3] / 2))
    if not -OVERLAP <= ahead <= AHEAD or aside > ASIDE:
        return None
    return max(ahead, 0.0) + aside


def _fits(giver: Node, out: Port, taker: Node, port: Port, known: Known) -> bool:
    """Whether a wire may run here and means something: what an input asks of a value beyond its type is kept, too."""
    if out.type is None or port.type is None or not accepts_type(taker, port.name, out.type):
        return False
    declared = taker.processor.inputs.get(port.name) if taker.processor is not None else None
    if not isinstance(declared, Input) or not declared.accepts:
        return True
    value = known(giver.id, out.name)
    if value is None:
        return True
    try:
        return all(condition.test(value) for condition in declared.accepts)
    except Exception:  # a condition of somebody's plug-in: what it thinks is not known
        return False


# -- links ----------------------------------------------------------------------------------------------------------


def propose_links(level: Network, node: Node, boxes: Mapping[str, Box]) -> Iterator[LinkProposal]:
    """Variables that parameters like those of a node follow, and what the nearest node has that may be shared."""
    if node.processor is None:
        return
    others = sorted(
        (other for other in level.nodes.values() if other is not node),
        key=lambda other: _distance(boxes.get(other.id), boxes[node.id]),
    )
    for name, declared in node.processor.params.items():
        if name in node.links or node.inputs.get(name):
            continue
        free: list[str] = []
        for other in others:
            for theirs in _alike(other, name, declared.kind):
                scoped = _followed(other, theirs)
                if scoped is not None and links.fits(scoped[0].variables[scoped[1]], declared):
                    yield LinkProposal(f"{node.id}.{name}", scoped[1], f"{other.id}.{theirs}")
                    break
                if scoped is None and theirs not in other.links and not other.inputs.get(theirs):
                    free.append(f"{other.id}.{theirs}")
            else:
                continue
            break
        else:
            if free and declared.kind in SHARED:
                yield LinkProposal(f"{node.id}.{name}", _fresh(level, free[0].rpartition(".")[2]), free[0], fresh=True)


def _alike(other: Node, name: str, kind: str) -> Iterator[str]:
    """Parameters of a node that mean the same as one: of its name and kind, or any camera for a camera."""
    if other.processor is None:
        return
    for theirs, declared in other.processor.params.items():
        if declared.kind == kind and (theirs == name or kind == "Camera"):
            yield theirs


def _followed(node: Node, name: str) -> links.Scoped | None:
    """The variable that a parameter follows by itself."""
    if name not in node.links or node.parent is None:
        return None
    return links.lookup(node.parent, node.links[name])


def _fresh(level: Network, name: str) -> str:
    taken = [other for table in level.root.levels() for other in table.variables]
    return unique(f"{name}_value" if name in RESERVED else name, taken)


def _distance(one: Box | None, other: Box) -> float:
    if one is None:
        return float("inf")
    x = (one[0] + one[2] / 2) - (other[0] + other[2] / 2)
    y = (one[1] + one[3] / 2) - (other[1] + other[3] / 2)
    return float(x * x + y * y)


# -- words ----------------------------------------------------------------------------------------------------------


def told(proposal: Proposal) -> str:
    """A proposal in a few words."""
    if isinstance(proposal, WireProposal):
        return f"{proposal.source} \u2192 {proposal.target}.{proposal.name}"
    return f"share {proposal.giver}"


def explained(level: Network, proposal: Proposal) -> str:
    """A proposal in a sentence."""
    if isinstance(proposal, WireProposal):
        id, _, output = proposal.source.rpartition(".")
        node = level.nodes.get(id)
        type = next((p.type for p in outputs_of(node) if p.name == output), None) if node is not None else None
        what = f" ({port_type(type).name})" if type is not None else ""
        return f"Wire {proposal.source}{what} to {proposal.target}.{proposal.name}"
    made = "a new variable" if proposal.fresh else "the variable"
    return f"Let {proposal.parameter} follow {made} {proposal.variable}, as {proposal.giver} does"


def possible(level: Network, node: Node, proposal: Proposal) -> bool:
    """Whether a proposal that was made before can still be followed."""
    try:
        if isinstance(proposal, WireProposal):
            giver, _, _ = proposal.source.rpartition(".")
            taker = level.nodes.get(proposal.target)
            if giver not in level.nodes or taker is None or taker.inputs.get(proposal.name):
                return False
            return proposal.target not in ids_above(level, giver)
        id, _, name = proposal.giver.rpartition(".")
        own = proposal.parameter.rpartition(".")[2]
        free = own not in node.links and not node.inputs.get(own)
        scoped = links.lookup(level, proposal.variable)
        return (
            free
            and id in level.nodes
            and (scoped is None) == proposal.fresh
            and (proposal.fresh or level.nodes[id].links.get(name) == proposal.variable)
        )
    except GraphError:
        return False
