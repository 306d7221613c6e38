"""Copy and paste: parts of a network as JSON, between networks and through the system's clipboard.

What is copied is a workspace of its own: the nodes, the wires between them, the variables that they follow. Pasted into
the same document, links go to the same variables. In another one the variables come along; where a name is taken with
another value, the newcomer is called ``camera_2``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any

from nodegraph import bends, json_text, links
from nodegraph.changes import level_at, rename_uses, with_id, with_inside
from nodegraph.commands import Command
from nodegraph.edits import Edits
from nodegraph.errors import CommandError, UnknownProcessor
from nodegraph.flat import ProcessorClass
from nodegraph.network import Network, Node, unique
from nodegraph.workspace_reader import FORMAT, read
from nodegraph.workspace_writer import nodes as write_nodes
from nodegraph.workspace_writer import variables as write_variables

FROM = "copied_from"
"""Key of a copy that holds the token of its document."""


def copy(network: Network, paths: Iterable[str]) -> dict[str, Any]:
    """Return nodes of one level as a JSON value that `Paste` takes. Wires from elsewhere are left out.

    Raises CommandError for nodes that are not there or lie on different levels.
    """
    chosen = [network.node(path) for path in dict.fromkeys(paths)]
    if not chosen:
        raise CommandError("copy: name at least one node")
    level = chosen[0].parent
    assert level is not None
    if any(node.parent is not level for node in chosen):
        raise CommandError("copy: these nodes lie on different levels; choose nodes of one")
    ids = {node.id for node in chosen}
    written = {id: keys for id, keys in write_nodes(level, None).items() if id in ids}
    for keys in written.values():
        _keep_inner_wires(keys, ids)
    found: dict[str, Any] = {"nodegraph": FORMAT, FROM: network.root.token}
    followed = _followed(chosen)
    if followed:
        found["variables"] = {}
        for table, name in followed:
            found["variables"] |= write_variables(table, None, [name])
    found["nodes"] = written
    skip = len(level.prefix)
    ui = {inner.path[skip:]: inner.ui for node in chosen for inner in with_inside(node) if inner.ui}
    if ui:
        found["ui"] = {"nodes": ui}
    return found


class Paste(Command):
    """Put a copy (or the nodes of any workspace) into a network, with new ids where old ones are taken.

    ``paths`` says where the nodes went.
    """

    name = "paste"

    def __init__(self, copied: Mapping[str, Any] | str, *, group: str = "") -> None:
        super().__init__()
        self.copied = copied
        self.group = group
        self.paths: list[str] = []

    def edit(self, network: Network, edits: Edits) -> None:
        level = level_at(network, self.group)
        keys = json_text.parse(self.copied, "clipboard") if isinstance(self.copied, str) else self.copied
        came = read(dict(keys) if isinstance(keys, Mapping) else keys, None, "clipboard", _finder(network))
        here = isinstance(keys, Mapping) and keys.get(FROM) == network.token
        self._bring_variables(edits, came, level, here)
        ids: dict[str, str] = {}
        for id in came.nodes:
            ids[id] = unique(id, [*level.nodes, *ids.values(), *(other for other in came.nodes if other != id)])
            ids[id] = id if id not in level.nodes else ids[id]
        moved = list(came.nodes.values())
        for node in moved:
            node.parent = level
            node.id = ids[node.id]
            node.ui = bends.renamed(node.ui, partial(_bent_source, node.inputs, ids))
            node.inputs = {name: tuple(with_id(text, ids) for text in wires) for name, wires in node.inputs.items()}
        for node in moved:
            edits.put(level.nodes, node.id, node)
        self.paths = [node.path for node in moved]
        edits.touch(*[leaf for node in moved for leaf in node.leaves()], structure=True)

    def _bring_variables(self, edits: Edits, came: Network, level: Network, here: bool) -> None:
        """Bring variables to the top level, operands before what is derived from them."""
        settled: dict[str, str] = {}
        taken = [name for table in level.root.levels() for name in table.variables]
        for name in _operands_first(came):
            variable = came.variables[name]
            there = links.lookup(level, name)
            if there is not None and (here or _alike(came, name, there, settled)):
                settled[name] = name
                continue
            new = unique(name, [*taken, *settled.values(), *(other for other in came.variables if other != name)])
            if there is None and name not in taken:
                new = name
            settled[name] = new
            rename_uses(Edits(came), (came, name), new)
            edits.put(level.root.variables, new, variable)


def _bent_source(inputs: Mapping[str, tuple[str, ...]], ids: Mapping[str, str], name: str, source: str) -> str | None:
    """The new source of a wire that bends; None where the wire was not copied."""
    return with_id(source, ids) if source in inputs.get(name, ()) else None


def _alike(came: Network, name: str, there: links.Scoped, settled: Mapping[str, str]) -> bool:
    """Whether a variable that comes says the same as the one that is there under its name."""
    mine, theirs = came.variables[name], there[0].variables[there[1]]
    if mine.expression or theirs.expression:
        kept = all(settled.get(operand) == operand for operand in links.names_in(mine))
        return kept and (mine.kind, mine.expression) == (theirs.kind, theirs.expression)
    a = write_variables(came, None, [name])[name]
    b = write_variables(there[0], None, [there[1]])[there[1]]
    return bool((a["kind"], a["value"]) == (b["kind"], b["value"]))


def _operands_first(came: Network) -> list[str]:
    order: list[str] = []

    def visit(name: str, above: tuple[str, ...]) -> None:
        if name in order or name in above or name not in came.variables:
            return
        for operand in links.names_in(came.variables[name]):
            visit(operand, (*above, name))
        order.append(name)

    for name in came.variables:
        visit(name, ())
    return order


def _followed(chosen: list[Node]) -> list[links.Scoped]:
    """Variables outside the chosen nodes that their links and expressions lead to."""
    inside = {table for node in chosen if node.network is not None for table in node.network.levels()}
    queue: list[links.Scoped] = []

    def follow(level: Network | None, name: str) -> None:
        scoped = links.lookup(level, name) if level is not None else None
        if scoped is not None and scoped not in queue and scoped[0] not in inside:
            queue.append(scoped)

    for node in chosen:
        for inner in with_inside(node):
            for name in inner.links.values():
                follow(inner.parent, name)
            for variable in inner.network.variables.values() if inner.network is not None else ():
                for name in links.names_in(variable):
                    follow(inner.network, name)
    for table, name in queue:  # grows while it is walked
        for operand in links.names_in(table.variables[name]):
            follow(table, operand)
    return queue


def _keep_inner_wires(keys: dict[str, Any], ids: set[str]) -> None:
    wires: dict[str, str | list[str]] = {}
    for name, sources in keys.get("inputs", {}).items():
        listed = [sources] if isinstance(sources, str) else sources
        kept = [text for text in listed if text.partition(".")[0] in ids]
        if kept:
            wires[name] = kept[0] if isinstance(sources, str) else kept
    if wires:
        keys["inputs"] = wires
    else:
        keys.pop("inputs", None)


def _finder(network: Network) -> Any:
    """Find classes as the network does, and those that its own nodes already have."""
    own = {node.type: node.processor for node in network.walk() if node.processor is not None}

    def find(type: str) -> ProcessorClass:
        try:
            return network.find(type)
        except UnknownProcessor:
            if type in own:
                return own[type]
            raise

    return find
