"""From the JSON value of a workspace to a network.

What is not understood is kept: unknown keys with their place, nodes of unknown processors with all they have, values
that a parameter refuses. Such nodes are blocked, with the reason. Refused is only what has no meaning at all: a wrong
JSON type where the format says another, a version from the future.
"""

from __future__ import annotations

import copy
import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nodegraph.errors import GraphError, ParameterError, UnknownProcessor, WorkspaceError, near_miss
from nodegraph.json_text import pointer
from nodegraph.links import codec
from nodegraph.network import GROUP, ID, Expose, Extra, Kept, Network, Node, Variable
from nodegraph.params import File, Folder, Parameter

if TYPE_CHECKING:
    from nodegraph.processor import Processor

FORMAT = 1
"""The version of the format, the value of the key ``nodegraph``."""
DEEPEST_GROUP = 32

WORKSPACE_KEYS = ("nodegraph", "variables", "nodes", "ui")
NODE_KEYS = ("type", "version", "params", "links", "inputs", "muted")
GROUP_KEYS = ("type", "version", "links", "inputs", "muted", "nodes", "variables", "expose")
VARIABLE_KEYS = ("kind", "value", "expression")
EXPOSE_KEYS = ("inputs", "params", "outputs")


def read(
    document: Any, folder: str | None, file: str = "", find: Callable[[str], type[Processor]] | None = None
) -> Network:
    """Return the network of a workspace document. Raises WorkspaceError with a JSON pointer."""
    return _Reader(folder, file, find).workspace(document)


def decoded(node: Node, cls: type[Processor], params: dict[str, Any], version: int | None) -> Node:
    """A node of a processor with these parameters, given as JSON: beside the document, and like ``node`` otherwise.

    What the processor does not know or accept is a `Kept`.
    """
    made = Node(node.id, node.type, version=None if version is None else min(version, cls.version), parent=node.parent)
    _Reader(None, "", None).bind(made, cls, params, "")
    return made


def following(keys: dict[str, Any], known: tuple[str, ...]) -> Extra:
    """The unknown ones of an object's keys, each with the key that it follows."""
    extra: Extra = {}
    before = ""
    for key, value in keys.items():
        if key not in known:
            extra[key] = (before, value)
        before = key
    return extra


class _Reader:
    def __init__(self, folder: str | None, file: str, find: Callable[[str], type[Processor]] | None) -> None:
        self.folder = folder
        self.file = file
        self.root = Network(find)

    def error(self, at: str, message: str) -> WorkspaceError:
        return WorkspaceError(message, file=self.file, pointer=at)

    def object(self, value: Any, at: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise self.error(at, f"expected an object, found {_kind(value)}")
        return value

    def text(self, value: Any, at: str) -> str:
        if not isinstance(value, str):
            raise self.error(at, f"expected a string, found {_kind(value)}")
        return value

    def texts(self, value: Any, at: str) -> tuple[str, ...]:
        """A string, or a list of strings."""
        if isinstance(value, list):
            return tuple(self.text(one, f"{at}/{i}") for i, one in enumerate(value))
        return (self.text(value, at),)

    # -- levels ---------------------------------------------------------------------------------------------------

    def workspace(self, document: Any) -> Network:
        keys = self.object(document, "")
        if "nodegraph" not in keys:
            raise self.error("", "this is no workspace: the key 'nodegraph' with the version of the format is missing")
        version = self.version(keys["nodegraph"], "/nodegraph")
        if version is None or version > FORMAT:
            raise self.error(
                "/nodegraph", f"format {version} is newer than {FORMAT}, the newest known; update nodegraph"
            )
        root = self.root
        root.extra = following(keys, WORKSPACE_KEYS)
        self.level(root, keys, "", 0)
        root.ui = dict(self.object(keys.get("ui", {}), "/ui"))
        self.hand_out_ui(root)
        self.variables(root)
        root.note((), structure=True)
        return root

    def level(self, level: Network, keys: dict[str, Any], at: str, depth: int) -> None:
        if depth > DEEPEST_GROUP:
            raise self.error(at, f"groups are nested more than {DEEPEST_GROUP} deep")
        for name, value in self.object(keys.get("variables", {}), f"{at}/variables").items():
            level.variables[name] = self.variable(name, value, pointer(f"{at}/variables", name))
        for id, value in self.object(keys.get("nodes", {}), f"{at}/nodes").items():
            here = pointer(f"{at}/nodes", id)
            if not ID.fullmatch(id):
                raise self.error(here, f"{id!r}: an id has letters, digits and _, and begins with no digit")
            level.nodes[id] = self.node(level, id, self.object(value, here), here, depth)

    def hand_out_ui(self, root: Network) -> None:
        """Give each node its own part of ``ui.nodes``; what belongs to no node stays in ``root.ui``."""
        shared = root.ui.get("nodes")
        if not isinstance(shared, dict):
            return
        left = {}
        for path, value in shared.items():
            if path in root and isinstance(value, dict):
                root.node(path).ui = dict(value)
            else:
                left[path] = value
        if left:
            root.ui["nodes"] = left
        else:
            del root.ui["nodes"]

    # -- variables ------------------------------------------------------------------------------------------------

    def variable(self, name: str, value: Any, at: str) -> Variable:
        if not ID.fullmatch(name):
            raise self.error(at, f"{name!r}: a variable's name has letters, digits and _, and begins with no digit")
        keys = self.object(value, at)
        for needed in ("kind",) if "expression" in keys else ("kind", "value"):
            if needed not in keys:
                raise self.error(at, f"the variable has no {needed!r}")
        return Variable(
            self.text(keys["kind"], f"{at}/kind"),
            keys.get("value"),  # as JSON; decoded when its followers are known
            self.text(keys.get("expression", ""), f"{at}/expression"),
            following(keys, VARIABLE_KEYS),
        )

    def variables(self, level: Network) -> None:
        """Decode the values of variables as the parameters that follow them say."""
        for name, variable in level.variables.items():
            if variable.expression:
                continue
            json, where = variable.value, f"{level.prefix}variables.{name}"
            try:
                declared = codec((level, name), json)
                variable.value = self.absolute(declared, declared.decode(json, where))
            except (ParameterError, TypeError, ValueError) as error:
                variable.value = Kept(json, _behind(where, error))
        for node in level.nodes.values():
            if node.network is not None:
                self.variables(node.network)

    # -- nodes ----------------------------------------------------------------------------------------------------

    def node(self, level: Network, id: str, keys: dict[str, Any], at: str, depth: int) -> Node:
        if "type" not in keys:
            raise self.error(at, "the node has no 'type'")
        node = Node(id, self.text(keys["type"], f"{at}/type"), parent=level)
        node.version = self.version(keys.get("version"), f"{at}/version")
        muted = keys.get("muted", False)
        if not isinstance(muted, bool):
            raise self.error(f"{at}/muted", f"expected true or false, found {_kind(muted)}")
        node.muted = muted
        for param, variable in self.object(keys.get("links", {}), f"{at}/links").items():
            node.links[param] = self.text(variable, pointer(f"{at}/links", param))
        wires = self.object(keys.get("inputs", {}), f"{at}/inputs")
        for name, sources in wires.items():
            node.inputs[name] = self.texts(sources, pointer(f"{at}/inputs", name))
        node.listed = frozenset(name for name, sources in wires.items() if isinstance(sources, list))
        if node.type == GROUP:
            self.group(node, keys, at, depth)
        else:
            node.extra = following(keys, NODE_KEYS)
            self.plain(node, dict(self.object(keys.get("params", {}), f"{at}/params")), at)
        return node

    def group(self, node: Node, keys: dict[str, Any], at: str, depth: int) -> None:
        if self.object(keys.get("params", {}), f"{at}/params"):
            raise self.error(f"{at}/params", "a group has no values of its own; write them into the nodes inside")
        node.extra = following(keys, GROUP_KEYS)
        node.network = Network(owner=node)
        self.level(node.network, keys, at, depth + 1)
        face = self.object(keys.get("expose", {}), f"{at}/expose")
        here = f"{at}/expose"
        node.expose = Expose(
            {
                name: self.texts(ports, pointer(f"{here}/inputs", name))
                for name, ports in self.object(face.get("inputs", {}), f"{here}/inputs").items()
            },
            {
                name: self.texts(ports, pointer(f"{here}/params", name))
                for name, ports in self.object(face.get("params", {}), f"{here}/params").items()
            },
            {
                name: self.text(port, pointer(f"{here}/outputs", name))
                for name, port in self.object(face.get("outputs", {}), f"{here}/outputs").items()
            },
            following(face, EXPOSE_KEYS),
        )
        for table, ports in (("inputs", node.expose.inputs), ("params", node.expose.params)):
            for name, leads in ports.items():
                for port in leads:
                    self.inner_port(node, port, pointer(f"{here}/{table}", name))
        for name, port in node.expose.outputs.items():
            self.inner_port(node, port, pointer(f"{here}/outputs", name))

    def inner_port(self, group: Node, port: str, at: str) -> None:
        id, point, name = port.partition(".")
        inside = group.network.nodes if group.network is not None else {}
        if not point or not name or id not in inside:
            raise self.error(at, f"{port!r} is no port inside the group{near_miss(id, inside)}")

    def plain(self, node: Node, params: dict[str, Any], at: str) -> None:
        """Find the processor of a node, bring its parameters up to date and decode them."""
        try:
            cls = self.root.find(node.type)
        except UnknownProcessor as error:
            self.unavailable(node, params, error)
            return
        self.bind(node, cls, params, at)

    def bind(self, node: Node, cls: type[Processor], params: dict[str, Any], at: str) -> None:
        """Let a node be of a processor, with its parameters as JSON."""
        version = cls.version if node.version is None else node.version
        if version > cls.version:
            raise self.error(
                f"{at}/version",
                f"{node.path} is version {version} of {cls.id}, newest known is {cls.version}; update it",
            )
        if version < cls.version:
            try:
                params = dict(cls.migrate(copy.deepcopy(params), version))
            except Exception as error:
                told = f"{cls.id}: cannot bring parameters of version {version} up to {cls.version}: {error!r}"
                self.unavailable(node, params, ParameterError(told))
                return
        node.processor, node.type, node.version = cls, cls.id, cls.version
        for name, json in params.items():
            where = f"{node.path}.{name}"
            declared = cls.params.get(name)
            if declared is None:
                miss = near_miss(name, cls.params)
                node.params[name] = Kept(json, f": no such parameter{miss}; remove it")
                continue
            try:
                value = self.absolute(declared, declared.decode(json, where))
            except ParameterError as error:
                node.params[name] = Kept(json, _behind(where, error))
                continue
            if declared.encode(value) != declared.encode(declared.default):
                node.params[name] = value

    def unavailable(self, node: Node, params: dict[str, Any], error: GraphError) -> None:
        """Keep a node just as it is, blocked."""
        node.trouble = error
        node.params = {name: Kept(json, f": {error}") for name, json in params.items()}

    def version(self, value: Any, at: str) -> int | None:
        if value is None:
            return None
        if not isinstance(value, int) or isinstance(value, bool) or value < 1:
            raise self.error(at, f"a version is a whole number from 1, found {_kind(value)}")
        return value

    def absolute(self, declared: Parameter, value: Any) -> Any:
        """A path of the file, relative to the file's folder, as an absolute one."""
        if not isinstance(declared, File | Folder) or not value or self.folder is None or "://" in value:
            return value
        return os.path.normpath(os.path.join(self.folder, value))


def _behind(where: str, error: Exception) -> str:
    """The message of an error without the place that it begins with."""
    text = str(error)
    return text.removeprefix(where) if text.startswith(where) else f": {text}"


def _kind(value: Any) -> str:
    """What a JSON value is, for messages."""
    if value is None:
        return "null"
    names = {dict: "an object", list: "an array", str: "a string", bool: "true or false"}
    return names.get(type(value), f"the number {value!r}")
