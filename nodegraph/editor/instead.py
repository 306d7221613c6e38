"""Evaluating a document with other values of parameters than it has, for as long as somebody points at something."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from nodegraph import links
from nodegraph.wires import targets

if TYPE_CHECKING:
    from nodegraph.flat import Flat
    from nodegraph.network import Node

Values = Mapping[tuple[str, str], Any]
"""Values by the path of a plain node and the name of its parameter."""

_revisions = itertools.count(-1, -1)  # of the document's own there are none below 0


def with_values(flat: Flat, values: Values) -> Flat:
    """A snapshot with other values; of what is not there, or is wired, nothing changes."""
    nodes = dict(flat.nodes)
    for (path, name), value in values.items():
        if path in nodes and name in nodes[path].values:
            changed = MappingProxyType({**nodes[path].values, name: value})
            nodes[path] = replace(nodes[path], values=changed, revision=next(_revisions))
    return replace(flat, nodes=MappingProxyType(nodes))


def decided_with(node: Node, name: str) -> list[tuple[str, str]]:
    """Parameters of plain nodes that change when this one is set: its own, and those linked to the same variable."""
    found: dict[tuple[str, str], None] = {}
    for leaf, inner in targets(node, name):
        found[leaf.path, inner] = None
        link = links.link_of(leaf, inner)
        scoped = links.lookup(link[0].parent, link[2]) if link is not None and link[0].parent is not None else None
        for other, param, _ in links.parameters(scoped) if scoped is not None else ():
            found[other.path, param] = None
    return list(found)
