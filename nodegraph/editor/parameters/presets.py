"""Presets of parameters: values with a name, the user's own and those of installed packages.

A preset is a JSON object, as the transfer functions have them::

    {"name": "From above", "kind": "Camera", "value": {"eye": ..., "target": ...}}

A value that only one parameter understands, as a number, says which: ``"for": "render.raycast.step"``. Own presets lie
in ``presets`` in the user's folder for configuration, one in each file.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from nodegraph import links
from nodegraph.editor.parameters import preset_files
from nodegraph.editor.parameters.place import Place
from nodegraph.errors import GraphError

OBJECTS = ("Camera", "Light", "Plane", "Box", "Color", "Matrix")
"""Kinds whose values mean the same for every parameter of the kind."""
ELSEWHERE = ("TransferFunction",)
"""Kinds whose widgets have presets of their own."""


@dataclass(frozen=True, slots=True)
class Preset:
    """A value for a parameter. file: where it lies, None for one of a package."""

    name: str
    value: Any
    file: Path | None = None


def presets_for(place: Place) -> list[Preset]:
    """What can be chosen for a parameter, by name: of its kind, meant for it, and accepted by its declaration."""
    found = []
    for _, described, file in preset_files.described({}):
        try:
            if described["kind"] == place.declared.kind and described.get("for", _key(place)) == _key(place):
                value = place.declared.decode(described["value"], str(described["name"]))
                found.append(Preset(str(described["name"]), value, file))
        except (GraphError, KeyError, TypeError, AttributeError):
            continue  # another version's, or beyond the limits of this parameter
    return sorted(found, key=lambda preset: preset.name.casefold())


def keep(place: Place, name: str) -> Path:
    """Save the value of a parameter under a name; one of this name is replaced. Raises OSError, ParameterError."""
    declared = place.declared
    described = {"name": name, "kind": declared.kind, "value": declared.encode(place.value())}
    if declared.kind not in OBJECTS:
        described["for"] = _key(place)
    scope = [] if declared.kind in OBJECTS else [_key(place)]
    file = preset_files.own_file(declared.kind, *scope, name)
    preset_files.write(described, file)
    return file


def drop(preset: Preset) -> None:
    """Delete a preset of the user's own. Raises OSError."""
    if preset.file is not None:
        preset.file.unlink(missing_ok=True)


def _key(place: Place) -> str:
    """The parameter by the id of its processor, so that all nodes of one type share it."""
    leaf, name, _ = links.plain_parameter(place.node, place.name)
    return f"{leaf.type}.{name}"
