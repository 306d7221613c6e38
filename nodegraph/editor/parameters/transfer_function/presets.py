"""Presets: files below ``nodegraph/editor/presets``, the user's own, what packages offer as ``nodegraph.presets``.

A preset is a JSON object::

    {"name": "Bone", "kind": "TransferFunction", "group": "CT", "unit": "HU", "value": {"keys": ..., ...}}

``value`` is the encoded value of a parameter of that kind. With ``"relative": true`` its keys run over 0..1 and are
stretched to the range of the data; with ``"colors": true`` it changes colours and leaves opacities alone; ``"bells"``
holds what the editor remembers of its bells. An entry point gives one such object, a list of them, or a function
without arguments that returns either. A file of one's own is one such object, a list, or an encoded value alone.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QImage, QPainter, QPixmap

from nodegraph import params
from nodegraph.data import TransferFunction
from nodegraph.data.image import srgb_encode
from nodegraph.editor.parameters import preset_files
from nodegraph.editor.parameters.color import draw_checks
from nodegraph.editor.parameters.transfer_function.bells import Shape
from nodegraph.editor.parameters.transfer_function.colormaps import colormaps
from nodegraph.editor.parameters.transfer_function.keys import fitted, opacity_at
from nodegraph.errors import FormatError, GraphError


@dataclass(frozen=True)
class Preset:
    """A transfer function with a name.

    group: what it is for. relative: its keys run over 0..1. colors: it is a colour map. file: where it lies, if it is
    the user's own. shape: with its bells.
    """

    name: str
    group: str
    unit: str
    relative: bool
    value: TransferFunction
    colors: bool = False
    file: Path | None = None
    shape: Shape | None = None

    def over(self, low: float, high: float) -> Shape:
        """Keys and bells for data in a range; what is in real values stays as it is."""
        if self.relative:
            return Shape(fitted(self.value, low, high))
        return self.shape if self.shape is not None else Shape(self.value)

    def to_json(self) -> dict[str, Any]:
        """What `read` reads."""
        made: dict[str, Any] = {"name": self.name, "kind": "TransferFunction", "group": self.group, "unit": self.unit}
        made |= {"relative": True} if self.relative else {}
        made |= {"colors": True} if self.colors else {}
        made["value"] = self.value.to_json()
        return made | ({"bells": self.shape.to_json()} if self.shape is not None and self.shape.bells else {})


def presets(unit: str = "") -> list[Preset]:
    """All presets, the user's own first; those in another unit than the data's come last."""
    return sorted(_all(), key=lambda one: (bool(one.unit and unit and one.unit != unit), one.file is None))


def keep(name: str, shape: Shape, unit: str = "") -> Path:
    """Save a preset of the user's own; one of this name is replaced. Raises OSError."""
    file = preset_files.own_file(name)
    write(Preset(name, "Own", unit, False, shape.function, shape=shape), file)
    forget()
    return file


def drop(preset: Preset) -> None:
    """Delete a preset of the user's own. Raises OSError."""
    if preset.file is not None:
        preset.file.unlink(missing_ok=True)
        forget()


def write(preset: Preset, file: Path) -> None:
    """Write a preset as JSON; the file is whole at any time. Raises OSError."""
    preset_files.write(preset.to_json(), file)


def load(file: Path) -> Preset:
    """Read a preset, or a transfer function alone, from JSON. Raises FormatError."""
    try:
        described = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise FormatError(f"no JSON can be read: {error}", file=str(file)) from error
    if isinstance(described, list) and described:
        described = described[0]
    if isinstance(described, dict) and "keys" in described:
        described = {"name": file.stem, "kind": "TransferFunction", "value": described}
    try:
        found = read(described)
    except (GraphError, TypeError, ValueError, KeyError) as error:
        raise FormatError(f"this is no preset of a transfer function: {error}", file=str(file)) from error
    if found is None:
        raise FormatError("this is a preset of another kind of parameter", file=str(file))
    return found


def refusals() -> dict[str, str]:
    """Why presets could not be used, by file or entry point."""
    _all()
    return dict(_refused)


_refused: dict[str, str] = {}


@functools.cache
def _all() -> tuple[Preset, ...]:
    found = []
    _refused.clear()
    for origin, described, file in _described():
        try:
            preset = read(described)
        except (GraphError, TypeError, ValueError, KeyError) as error:
            _refused[origin] = str(error)
            continue
        if preset is not None:
            found.append(replace(preset, file=file))
    return tuple(found)


def forget() -> None:
    """Look anew the next time: packages or files have changed."""
    _all.cache_clear()


def read(described: Any) -> Preset | None:
    """A preset from its JSON object; None for one of another kind. Raises ParameterError, TypeError, KeyError."""
    if not isinstance(described, dict):
        raise TypeError(f"a preset is an object with name, kind and value, not {type(described).__name__}")
    if described["kind"] != "TransferFunction":
        return None
    value = params.TransferFunction(doc="A preset.").decode(described["value"], str(described["name"]))
    return Preset(
        str(described["name"]),
        str(described.get("group", "")),
        str(described.get("unit", "")),
        bool(described.get("relative", False)),
        value,
        bool(described.get("colors", False)),
        shape=_shape(described.get("bells"), value),
    )


def _shape(noted: Any, value: TransferFunction) -> Shape | None:
    """The bells of a preset, where its keys are still those that were made of them."""
    if noted is None:
        return None
    shape = Shape.from_json(noted)
    return shape if shape.function == value else None


def _described() -> Iterator[tuple[str, Any, Path | None]]:
    yield from preset_files.described(_refused)
    for one in colormaps():
        yield one["name"], one, None


def thumbnail(function: TransferFunction, width: int, height: int, solid: bool = False) -> QPixmap:
    """The colours of a function over its domain, shining through as far as they are transparent, unless solid."""
    low, high = function.domain
    rows = low + (high - low) * (np.arange(width) + 0.5) / width
    colors = function.evaluate(rows)[:, :3]
    # The fourth root shows what is thin as well: opacities per millimetre are small.
    alpha = np.ones(width) if solid else opacity_at(function, rows) ** 0.25
    pixels = np.empty((1, width, 4), np.uint8)
    pixels[0, :, :3] = np.rint(srgb_encode(np.clip(colors, 0.0, 1.0)) * 255)
    pixels[0, :, 3] = np.rint(alpha * 255)
    image = QImage(pixels.data, width, 1, 4 * width, QImage.Format.Format_RGBA8888).copy()
    pixmap = QPixmap(width, height)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    area = QRectF(0, 0, width, height)
    draw_checks(painter, area, 4.0)
    painter.drawImage(area, image)
    painter.end()
    return pixmap
