"""The flat view of a network: what the scheduler plans on.

Groups are dissolved, muted nodes are passed through, links and expressions are worked out. A ``Flat`` is a snapshot: it
does not change when the network does, so it may be handed to another thread. ``Network.flatten()`` makes and caches it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.processor import Processor

ProcessorClass: TypeAlias = "type[Processor]"

Source = tuple[str, str]
"""Path of a plain, unmuted node and the name of one of its outputs."""


@dataclass(frozen=True, slots=True)
class FlatNode:
    """One plain node of the flattened network.

    Attributes:
        path: the full path, ``finish/raycast``.
        type: the processor's id as the document has it.
        processor: the class, or None when the id is unknown or its plug-in is broken.
        sources: for every declared input, in declaration order, where its values come from: one source for a plain
            input, any number (in wire order) for ``many``, none when it is not wired.
        wired: parameters that a wire feeds, and from where. The wire beats the link, the link beats the stored value.
        values: effective values of the visible parameters that are not wired, defaults included, in declaration order.
        problem: why this node itself cannot run (unknown processor, half wired, a value that its declaration refuses,
            a member of a cycle, ...), or None. Trouble further up is not repeated here.
        revision: changes whenever anything of this node may have changed; it never returns to an old number.
        version: the version of the document's node, None when the file had none.
    """

    path: str
    type: str
    processor: ProcessorClass | None
    sources: Mapping[str, tuple[Source, ...]]
    wired: Mapping[str, Source]
    values: Mapping[str, Any]
    problem: GraphError | None
    revision: int
    version: int | None = None

    @property
    def blocked(self) -> str:
        """The problem as one sentence, empty when there is none."""
        return str(self.problem) if self.problem is not None else ""

    def params(self) -> dict[str, Any]:
        """Return a fresh dict of the effective values (see ``values``)."""
        return dict(self.values)


@dataclass(frozen=True, slots=True)
class Flat:
    """The flattened network.

    Attributes:
        nodes: plain, unmuted nodes by path, in topological order: a node stands after all its sources. Every source
            named in it is a key of it; members of a cycle have no sources and say so in ``problem``.
        outputs: for every output ``path.output`` of a muted node or a group, the source that it stands for, or the
            error that says why there is none. Outputs of plain nodes stand for themselves and are not listed.
        muted: full paths of muted nodes and groups.
        revision: the network's revision that this is a picture of.
        structure: changes only when nodes, wires, groups or muting change, or when a value blocks a node or frees it.
            Nodes, their sources and what is blocked are the same for equal numbers.
    """

    nodes: Mapping[str, FlatNode]
    outputs: Mapping[str, Source | GraphError]
    muted: frozenset[str]
    revision: int
    structure: int

    def source(self, name: str) -> Source | GraphError | None:
        """Return what ``node.output`` stands for: a source, the error why there is none, or None when unknown."""
        if name in self.outputs:
            return self.outputs[name]
        path, _, output = name.rpartition(".")
        return (path, output) if path in self.nodes else None

    def params_of(self, path: str) -> dict[str, Any]:
        """Return the effective values of a node's visible, unwired parameters."""
        return self.nodes[path].params()
