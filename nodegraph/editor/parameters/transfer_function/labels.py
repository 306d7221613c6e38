"""A transfer function as a table of labels: each whole number has a step of its own, half a number to either side.

It says what a label looks like only where values are not interpolated: between two labels, linear interpolation passes
through the numbers of others.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from nodegraph.data import TransferFunction
from nodegraph.data.transfer_function import Key
from nodegraph.editor.parameters.transfer_function.grips import fresh_color
from nodegraph.editor.parameters.transfer_function.keys import opacity_at

Color = tuple[float, float, float]
OPACITY = 0.8
"""What a new label hides of a reference length."""


@dataclass(frozen=True)
class Label:
    """One label. color: linear RGB. opacity: what it has, or had before it was hidden. name: for the reader."""

    id: int
    color: Color
    opacity: float
    visible: bool = True
    name: str = ""


def read(function: TransferFunction, ids: Iterable[int], noted: Mapping[str, Any]) -> list[Label]:
    """What a function makes of labels. noted: names, and opacities of hidden ones, as `notes` wrote them."""
    order = sorted(ids)
    names, hidden = _table(noted, "names"), _table(noted, "hidden")
    rows = function.evaluate([float(one) for one in order])
    found = []
    for one, row, up in zip(order, rows, opacity_at(function, [float(one) for one in order]), strict=True):
        seen, before, name = bool(up > 0.0), hidden.get(str(one), OPACITY), names.get(str(one), "")
        kept = before if isinstance(before, (int, float)) and 0.0 < before <= 1.0 else OPACITY
        red, green, blue = (round(float(part), 5) for part in row[:3])
        opacity = float(f"{up:.6g}") if seen else float(kept)
        found.append(Label(one, (red, green, blue), opacity, seen, name if isinstance(name, str) else ""))
    return found


def notes(labels: Iterable[Label]) -> dict[str, dict[str, Any]]:
    """What a function does not say of labels, for `read`."""
    listed = list(labels)
    names = {str(label.id): label.name for label in listed if label.name}
    hidden = {str(label.id): label.opacity for label in listed if not label.visible}
    return {key: table for key, table in (("names", names), ("hidden", hidden)) if table}


def function_of(labels: Iterable[Label], reference_length: float = 1.0) -> TransferFunction:
    """Steps for labels. Beyond them, and in gaps between their numbers, everything is transparent."""
    keys: list[Key] = []
    for label in sorted(labels, key=lambda label: label.id):
        left, right = label.id - 0.5, label.id + 0.5
        up = label.opacity if label.visible else 0.0
        if keys and keys[-1].value == left:
            keys.pop()  # the neighbour's step to nothing
        else:
            keys.append(Key(left, label.color, 0.0))
        keys += [Key(left, label.color, up), Key(right, label.color, up), Key(right, label.color, 0.0)]
    return TransferFunction(keys, reference_length)


def in_colors(labels: Iterable[Label]) -> list[Label]:
    """Every label in a colour of its own, unlike its neighbours'; 0 is nothing, and hidden."""
    return [Label(one.id, fresh_color(one.id), one.opacity, one.id != 0, one.name) for one in labels]


def _table(noted: Mapping[str, Any], name: str) -> dict[str, Any]:
    found = noted.get(name) if isinstance(noted, Mapping) else None
    return found if isinstance(found, dict) else {}
