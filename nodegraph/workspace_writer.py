"""From a network to the JSON value of a workspace.

Keys stand in the order of the format, nodes and variables in the order of the document, parameters and inputs in the
order of their declarations; what is unknown stands behind the key that it followed when it was read. So the same
network gives the same bytes, and a change gives a small difference.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

from nodegraph.links import codec
from nodegraph.network import GROUP, Extra, Kept, Network, Node
from nodegraph.params import File, Folder, Parameter
from nodegraph.wires import is_many
from nodegraph.workspace_reader import EXPOSE_KEYS, FORMAT, GROUP_KEYS, NODE_KEYS, VARIABLE_KEYS, WORKSPACE_KEYS


def document(root: Network, folder: str | None) -> dict[str, Any]:
    """Return the workspace of a whole network. Paths below ``folder`` become relative to it."""
    keys: dict[str, Any] = {"nodegraph": FORMAT}
    if root.variables:
        keys["variables"] = variables(root, folder)
    keys["nodes"] = nodes(root, folder)
    ui = gather_ui(root)
    if ui:
        keys["ui"] = ui
    return weave(keys, WORKSPACE_KEYS, root.extra)


def nodes(level: Network, folder: str | None) -> dict[str, Any]:
    """The nodes of one level."""
    return {id: node_keys(node, folder) for id, node in level.nodes.items()}


def node_keys(node: Node, folder: str | None) -> dict[str, Any]:
    """One node, group or plain."""
    keys: dict[str, Any] = {"type": node.type}
    if node.version is not None:
        keys["version"] = node.version
    cls = node.processor
    ports = [*(cls.inputs if cls else node.expose.inputs), *(cls.params if cls else node.expose.params)]
    if node.params:
        known: Mapping[str, Parameter] = cls.params if cls is not None else {}
        keys["params"] = in_order(encoded(node, node.params, folder), known)
    if node.links:
        keys["links"] = in_order(node.links, ports)
    if node.inputs:
        keys["inputs"] = in_order({name: _wires(node, name, ports) for name in node.inputs}, ports)
    if node.muted:
        keys["muted"] = True
    if node.network is None:
        return weave(keys, NODE_KEYS, node.extra)
    keys["type"] = GROUP
    keys["nodes"] = nodes(node.network, folder)
    if node.network.variables:
        keys["variables"] = variables(node.network, folder)
    face: dict[str, Any] = {}
    for name, table in (("inputs", node.expose.inputs), ("params", node.expose.params)):
        if table:
            face[name] = {shown: list(ports) for shown, ports in table.items()}
    if node.expose.outputs:
        face["outputs"] = dict(node.expose.outputs)
    face = weave(face, EXPOSE_KEYS, node.expose.extra)
    if face:
        keys["expose"] = face
    return weave(keys, GROUP_KEYS, node.extra)


def encoded(node: Node, values: Mapping[str, Any], folder: str | None = None) -> dict[str, Any]:
    """Values of a node's parameters as JSON, by name."""
    known: Mapping[str, Parameter] = node.processor.params if node.processor is not None else {}
    return {name: _param(known.get(name), value, folder) for name, value in values.items()}


def variables(level: Network, folder: str | None, names: Iterable[str] | None = None) -> dict[str, Any]:
    """The variables of one level, or those of them that are named."""
    found = {}
    for name in level.variables if names is None else names:
        variable = level.variables[name]
        keys: dict[str, Any] = {"kind": variable.kind}
        if variable.expression:
            if variable.value is not None:
                keys["value"] = variable.value
            keys["expression"] = variable.expression
        elif isinstance(variable.value, Kept):
            keys["value"] = variable.value.json
        else:
            keys["value"] = _param(codec((level, name), variable.value), variable.value, folder)
        found[name] = weave(keys, VARIABLE_KEYS, variable.extra)
    return found


def gather_ui(root: Network) -> dict[str, Any]:
    """Everything that only editors look at, that of nodes under their paths."""
    own = {node.path: node.ui for node in root.walk() if node.ui}
    kept = root.ui.get("nodes")
    left = {path: value for path, value in kept.items() if path not in own} if isinstance(kept, dict) else {}
    ui = {key: value for key, value in root.ui.items() if key != "nodes"}
    if kept is not None and not isinstance(kept, dict):
        return {"nodes": kept, **ui}
    return {"nodes": {**own, **left}, **ui} if own or left else ui


def weave(keys: dict[str, Any], order: tuple[str, ...], extra: Extra) -> dict[str, Any]:
    """Put unknown keys back behind those that they followed, or behind the nearest earlier one that is there."""
    if not extra:
        return keys
    names = list(keys)
    for key, (before, _) in extra.items():
        while before and before not in names:
            before = order[order.index(before) - 1] if before in order[1:] else ""
        names.insert(names.index(before) + 1 if before else 0, key)
    return {name: keys[name] if name in keys else extra[name][1] for name in names}


def in_order(written: Mapping[str, Any], known: Iterable[str]) -> dict[str, Any]:
    """Known names in the order of declaration; each unknown one behind the name that it followed."""
    names = [name for name in known if name in written]
    before = ""
    for name in written:
        if name not in names:
            names.insert(names.index(before) + 1 if before else 0, name)
        before = name
    return {name: written[name] for name in names}


def _param(declared: Parameter | None, value: Any, folder: str | None) -> Any:
    if isinstance(value, Kept) or declared is None:
        return value.json if isinstance(value, Kept) else value
    json = declared.encode(value)
    if isinstance(declared, File | Folder) and json and folder is not None and "://" not in json:
        path = os.path.abspath(json)
        below = os.path.commonpath([path, folder]) == folder if _one_drive(path, folder) else False
        return (os.path.relpath(path, folder) if below else path).replace(os.sep, "/")
    return json


def _one_drive(a: str, b: str) -> bool:
    return os.path.splitdrive(a)[0] == os.path.splitdrive(b)[0]


def _wires(node: Node, name: str, ports: list[str]) -> str | list[str]:
    """One source as a string, those of an input that takes many as a list."""
    wires = node.inputs[name]
    as_list = is_many(node, name) if name in ports else name in node.listed
    return list(wires) if as_list or len(wires) != 1 else wires[0]
