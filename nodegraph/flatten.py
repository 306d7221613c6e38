"""Make the flat snapshot of a network, and make it anew only where something changed.

The topology (who reads whom, in what order) belongs to the network's ``structure`` and is kept while that stands.
A change of values rebuilds just the nodes that commands have marked: a drag in a network of 500 nodes costs one node.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from nodegraph.errors import CycleError, GraphError, MutedError, ParameterError, PortError, near_miss
from nodegraph.flat import Flat, FlatNode, Source
from nodegraph.links import link_of, linked_value
from nodegraph.network import Kept, Network, Node
from nodegraph.params import Parameter
from nodegraph.ports import Input, article, connects, port_type
from nodegraph.wires import Known, Wire, feeds, resolve, value_type


@dataclass(slots=True)
class _Links:
    """What the structure says of one plain node."""

    sources: dict[str, tuple[Source, ...]]
    wired: dict[str, Source]
    problem: GraphError | None


@dataclass(slots=True)
class _Kept:
    """The last snapshot of a network, and what it was made from."""

    flat: Flat
    structure: int
    links: dict[Node, _Links]
    paths: dict[Node, str]


def flatten(root: Network) -> Flat:
    """Return the flat view of a whole document; see `Network.flatten`."""
    kept: _Kept | None = root._flattened
    if kept is not None and kept.flat.revision == root.revision:
        return kept.flat
    if kept is None or kept.structure != root.structure:
        kept = root._flattened = _rebuild(root, kept)
    else:
        kept.flat = _refresh(root, kept)
    root._touched.clear()
    return kept.flat


def _refresh(root: Network, kept: _Kept) -> Flat:
    """The same structure with new values."""
    nodes = dict(kept.flat.nodes)
    structure = kept.flat.structure
    for node in root._touched:
        path = kept.paths.get(node)
        if path is None:  # muted, or a group
            continue
        old, new = nodes[path], _flat_node(node, path, kept.links[node], root.revision)
        nodes[path] = new
        if old.blocked != new.blocked:
            structure = root.revision  # planners remember what is blocked per structure
    return Flat(nodes, kept.flat.outputs, kept.flat.muted, root.revision, structure)


def _rebuild(root: Network, old: _Kept | None) -> _Kept:
    paths: dict[Node, str] = {}
    muted: set[str] = set()
    faces: list[Node] = []
    _collect(root, "", paths, muted, faces)
    known: Known = {}
    links = {node: _links_of(node, path, known) for node, path in paths.items()}
    by_path = {path: node for node, path in paths.items()}
    order = _order(by_path, links)
    nodes: dict[str, FlatNode] = {}
    for path in order:
        node = by_path[path]
        nodes[path] = _reuse(old, node, path, links[node], root) or _flat_node(node, path, links[node], root.revision)
    outputs = {
        f"{node.path}.{name}": _as_source(resolve(node.parent, f"{node.id}.{name}", f"{node.path}.{name}", known))
        for node in faces
        if node.parent is not None
        for name in (node.expose.outputs if node.network is not None else _outputs(node))
    }
    flat = Flat(nodes, outputs, frozenset(muted), root.revision, root.structure)
    return _Kept(flat, root.structure, links, paths)


def _collect(level: Network, prefix: str, paths: dict[Node, str], muted: set[str], faces: list[Node]) -> None:
    """Sort the nodes of a level into plain ones that count, muted ones, and those whose outputs stand for others."""
    for node in level.nodes.values():
        path = prefix + node.id
        if node.muted:
            muted.add(path)
        if node.muted or node.network is not None:
            faces.append(node)
        if node.network is not None:
            if not node.muted:
                _collect(node.network, f"{path}/", paths, muted, faces)
        elif not node.muted:
            paths[node] = path


def _outputs(node: Node) -> Iterable[str]:
    return node.processor.outputs if node.processor is not None else ()


def _as_source(found: tuple[Node, str] | GraphError) -> Source | GraphError:
    return found if isinstance(found, GraphError) else (found[0].path, found[1])


# -- one node -----------------------------------------------------------------------------------------------------


def _flat_node(node: Node, path: str, links: _Links, revision: int) -> FlatNode:
    problem, wired = links.problem, links.wired
    values: dict[str, Any] = {}
    if node.processor is not None:
        try:
            values, wired = _values(node, path, links.wired)
        except ParameterError as error:
            problem = problem or error
    return FlatNode(
        path, node.type, node.processor, links.sources, wired, values, problem, revision, version=node.version
    )


def _reuse(old: _Kept | None, node: Node, path: str, links: _Links, root: Network) -> FlatNode | None:
    """The node of the last snapshot, when nothing that it holds can have changed."""
    if old is None or node in root._touched or old.paths.get(node) != path:
        return None
    before = old.links[node]
    if before.sources != links.sources or before.wired != links.wired or str(before.problem) != str(links.problem):
        return None
    return old.flat.nodes[path]


def _values(node: Node, path: str, wired: dict[str, Source]) -> tuple[dict[str, Any], dict[str, Source]]:
    """Effective values and wires of the visible parameters. Raises ParameterError for a value that cannot be used."""
    cls = node.processor
    assert cls is not None
    grouped = node.parent is not None and node.parent.owner is not None
    values: dict[str, Any] = {}
    for name, declared in cls.params.items():
        if name in wired:
            continue
        if name in node.links or (grouped and link_of(node, name) is not None):
            values[name] = linked_value(node, name, declared)
        else:
            values[name] = node.params.get(name, declared.default)
    for name, value in (*values.items(), *node.params.items()):
        if isinstance(value, Kept) and name not in wired and name not in node.links:
            raise value.error(f"{path}.{name}")
    for name in node.links:
        if name not in cls.params:
            raise ParameterError(f"{path}.{name}: no such parameter{near_miss(name, cls.params)}")
    hiding = _hidden_by_known(node, values)
    if hiding:
        values = {name: value for name, value in values.items() if name not in hiding}
        wired = {name: source for name, source in wired.items() if name not in hiding}
    return values, wired


def _hidden_by_known(node: Node, values: dict[str, Any]) -> frozenset[str]:
    """Parameters that mean nothing under these values. One that depends on a wired parameter counts as visible."""
    cls = node.processor
    assert cls is not None
    if not any(declared.visible_if for declared in cls.params.values()):
        return frozenset()
    shown = cls.visible(values)
    return frozenset(
        name
        for name, declared in cls.params.items()
        if name not in shown and all(other in values for other in declared.visible_if)
    )


# -- wires --------------------------------------------------------------------------------------------------------


def _links_of(node: Node, path: str, known: Known) -> _Links:
    """Follow all wires into a plain node and say what is wrong with them."""
    cls = node.processor
    if cls is None:
        return _Links({}, {}, _at(path, node.trouble) if node.trouble is not None else None)
    sources: dict[str, tuple[Source, ...]] = dict.fromkeys(cls.inputs, ())
    wired: dict[str, Source] = {}
    problems: list[GraphError] = []
    for name, wires in _wires_into(node).items():
        port = cls.inputs.get(name) or cls.params.get(name)
        if port is None:
            miss = near_miss(name, [*cls.inputs, *cls.params])
            problems.append(PortError(f"{path}.{name}: no such input or parameter{miss}; disconnect it"))
            continue
        found = _follow(f"{path}.{name}", port, wires, problems, known)
        if name in sources:
            sources[name] = found
        elif found:
            wired[name] = found[0]
    for name, declared in cls.inputs.items():
        if not sources[name] and declared.required and not problems:
            name_of_type = port_type(declared.type).name
            what = f"wire {'at least one ' + name_of_type if declared.many else article(name_of_type)} to it"
            problems.append(PortError(f"{path}.{name}: nothing is connected; {what}"))
    return _Links(sources, wired, problems[0] if problems else None)


def _at(path: str, error: GraphError) -> GraphError:
    """The same error with the node's path before its message."""
    told = copy.copy(error)
    told.args = (f"{path}: {error}",)
    return told


def _wires_into(node: Node) -> dict[str, list[Wire]]:
    """All wires into a plain node by port: its own, then those through the faces of groups around it."""
    level = node.parent
    assert level is not None
    found: dict[str, list[Wire]] = {name: [(level, text) for text in texts] for name, texts in node.inputs.items()}
    owner = level.owner
    if owner is not None:
        for faces in (owner.expose.inputs, owner.expose.params):
            for face, ports in faces.items():
                for port in ports:
                    id, _, name = port.partition(".")
                    if id == node.id and (wires := feeds(owner, face)):
                        found.setdefault(name, []).extend(wires)
    return found


def _follow(
    where: str, port: Input | Parameter, wires: list[Wire], problems: list[GraphError], known: Known
) -> tuple[Source, ...]:
    """Sources of one port, in wire order; what is wrong goes to ``problems``."""
    if len(wires) > 1 and not (isinstance(port, Input) and port.many):
        problems.append(PortError(f"{where}: {len(wires)} wires come in where one may; disconnect the others"))
        return ()
    wanted = value_type(port)
    sources: list[Source] = []
    for level, text in wires:
        found = resolve(level, text, where, known)
        if isinstance(found, MutedError) and not (isinstance(port, Input) and port.required):
            continue  # as if it were not wired
        if isinstance(found, GraphError):
            problems.append(found)
            continue
        above, output = found
        given = above.processor.outputs[output].type if above.processor is not None else wanted
        if given is wanted or connects(given, wanted):
            sources.append((above.path, output))
        else:
            names = port_type(wanted).name, port_type(given).name
            problems.append(PortError(f"{where}: takes {names[0]}, but {above.path}.{output} gives {names[1]}"))
    return tuple(sources)


def _order(nodes: dict[str, Node], links: dict[Node, _Links]) -> list[str]:
    """Paths so that each stands after its sources, close to file order. Members of cycles lose their sources."""
    done: list[str] = []
    state: dict[str, int] = {}  # 1: on the way, 2: done
    for start in nodes:
        stack = [(start, iter(_needed(links[nodes[start]])))] if start not in state else []
        state.setdefault(start, 1)
        while stack:
            path, needed = stack[-1]
            above = next(needed, None)
            if above is None:
                stack.pop()
                if state[path] != 2:
                    state[path] = 2
                    done.append(path)
            elif above not in state:
                state[above] = 1
                stack.append((above, iter(_needed(links[nodes[above]]))))
            elif state[above] == 1:
                circle = [step for step, _ in stack]
                _break_cycle(circle[circle.index(above) :], nodes, links)
    return done


def _needed(links: _Links) -> list[str]:
    return [source[0] for sources in links.sources.values() for source in sources] + [
        source[0] for source in links.wired.values()
    ]


def _break_cycle(circle: list[str], nodes: dict[str, Node], links: dict[Node, _Links]) -> None:
    """Block every member. ``circle`` runs from reader to source; the message runs with the data."""
    told = CycleError([*reversed(circle), circle[-1]])
    for path in circle:
        one = links[nodes[path]]
        one.sources = dict.fromkeys(one.sources, ())
        one.wired = {}
        one.problem = told
