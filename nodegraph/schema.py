"""A JSON Schema of workspaces, made from the declarations of processors.

Editors of text use it to complete and check what is typed. It is stricter than reading: a workspace may hold
processors, ports and parameters that this installation does not know (they are kept), but a known processor has the
parameters of its declaration. `nodegraph docs` writes it to docs/workspace.schema.json; the tests check that it is
current and that it accepts every shipped workspace.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from nodegraph.network import GROUP, ID
from nodegraph.workspace_reader import FORMAT

if TYPE_CHECKING:
    from nodegraph.processor import Processor

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_NAME = f"^{ID.pattern}$"
_SOURCE = rf"^{ID.pattern}\..+$"


def workspace_schema(processors: Iterable[type[Processor]] | None = None) -> dict[str, Any]:
    """Return the schema. ``processors``: those it knows in detail; default: all built-in ones."""
    known = sorted(_built_in() if processors is None else processors, key=lambda cls: cls.id)
    return {
        "$schema": DIALECT,
        "title": "nodegraph workspace",
        "description": "A network of processors; see workspace-format.md.",
        "type": "object",
        "required": ["nodegraph"],
        "properties": {
            "nodegraph": {"const": FORMAT, "description": "Version of the format."},
            "variables": {"$ref": "#/$defs/variables"},
            "nodes": {"$ref": "#/$defs/nodes"},
            "ui": {"type": "object", "description": "What only editors look at; nodes by path under 'nodes'."},
        },
        "$defs": {**_shared(known), **{f"processor.{cls.id}": _processor(cls) for cls in known}},
    }


def _shared(known: list[type[Processor]]) -> dict[str, Any]:
    """Definitions of the format itself."""
    source = {"type": "string", "pattern": _SOURCE}
    sources = {"anyOf": [source, {"type": "array", "items": source}]}
    return {
        "nodes": {
            "type": "object",
            "propertyNames": {"pattern": _NAME},
            "additionalProperties": {"$ref": "#/$defs/node"},
        },
        "variables": {
            "type": "object",
            "propertyNames": {"pattern": _NAME},
            "additionalProperties": {"$ref": "#/$defs/variable"},
        },
        "variable": {
            "type": "object",
            "description": "A value that parameters share: plain, or derived by an expression.",
            "required": ["kind"],
            "anyOf": [{"required": ["value"]}, {"required": ["expression"]}],
            "properties": {
                "kind": {"type": "string", "description": "Kind of the parameters that follow it."},
                "value": {},
                "expression": {"type": "string", "maxLength": 500},
            },
        },
        "node": {
            "type": "object",
            "required": ["type"],
            "properties": {
                "type": {"anyOf": [{"enum": [cls.id for cls in known]}, {"const": GROUP}, {"type": "string"}]},
                "version": {"type": "integer", "minimum": 1, "description": "Version of the processor."},
                "params": {"type": "object", "description": "Values that differ from the defaults."},
                "links": {
                    "type": "object",
                    "description": "Parameters and the variables that they follow.",
                    "additionalProperties": {"type": "string", "pattern": _NAME},
                },
                "inputs": {
                    "type": "object",
                    "description": "Inputs and wired parameters, and where their values come from.",
                    "additionalProperties": sources,
                },
                "muted": {"type": "boolean", "default": False},
            },
            "allOf": [
                {"if": _is_type(GROUP), "then": {"$ref": "#/$defs/group"}},
                *({"if": _is_current(cls), "then": {"$ref": f"#/$defs/processor.{cls.id}"}} for cls in known),
            ],
        },
        "group": {
            "description": "A node that holds a network, and what it shows of it.",
            "properties": {
                "params": {"maxProperties": 0},
                "nodes": {"$ref": "#/$defs/nodes"},
                "variables": {"$ref": "#/$defs/variables"},
                "expose": {
                    "type": "object",
                    "properties": {
                        "inputs": {"type": "object", "additionalProperties": {"type": "array", "items": source}},
                        "params": {"type": "object", "additionalProperties": {"type": "array", "items": source}},
                        "outputs": {"type": "object", "additionalProperties": source},
                    },
                },
            },
        },
    }


def _processor(cls: type[Processor]) -> dict[str, Any]:
    """What a node of this processor may have."""
    described = {name: {"description": p.doc, **_with_default(p), **p.schema()} for name, p in cls.params.items()}
    ports = [*cls.inputs, *cls.params]
    one = {"type": "string", "pattern": _SOURCE}
    wires = {
        name: {"type": "array", "items": one} if port.many else one for name, port in cls.inputs.items()
    } | dict.fromkeys(cls.params, one)
    return {
        "description": " ".join((cls.__doc__ or "").strip().split("\n\n")[0].split()),
        "properties": {
            "params": {"properties": described, "additionalProperties": False},
            "links": {"propertyNames": {"enum": list(cls.params)}},
            "inputs": {"propertyNames": {"enum": ports}, "properties": wires},
        },
    }


def _with_default(parameter: Any) -> dict[str, Any]:
    return {"default": parameter.encode(parameter.default)}


def _is_type(id: str) -> dict[str, Any]:
    return {"required": ["type"], "properties": {"type": {"const": id}}}


def _is_current(cls: type[Processor]) -> dict[str, Any]:
    """A node of this processor as it is now; one of an older version has other parameters and is migrated."""
    return {"required": ["type"], "properties": {"type": {"const": cls.id}, "version": {"const": cls.version}}}


def _built_in() -> list[type[Processor]]:
    from nodegraph import registry

    found = [entry.id for entry in registry.entries() if entry.origin == "nodegraph" and not entry.reason]
    return [registry.find(id) for id in found]
