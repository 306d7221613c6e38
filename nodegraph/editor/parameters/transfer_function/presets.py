"""Presets: the files below ``nodegraph/editor/presets`` and what installed packages offer as ``nodegraph.presets``.

A preset is a JSON object::

    {"name": "Bone", "kind": "TransferFunction", "group": "CT", "unit": "HU", "value": {"keys": ..., ...}}

``value`` is the encoded value of a parameter of that kind. With ``"relative": true`` its keys run over 0..1 and are
stretched to the range of the data. An entry point gives one such object, a list of them, or a function without
arguments that returns either.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QImage, QPainter, QPixmap

from nodegraph import params
from nodegraph.data import TransferFunction
from nodegraph.data.image import srgb_encode
from nodegraph.editor.parameters.color import draw_checks
from nodegraph.editor.parameters.transfer_function.keys import fitted, opacity_at
from nodegraph.errors import GraphError

FOLDER = Path(__file__).parents[2] / "presets"


@dataclass(frozen=True)
class Preset:
    """A transfer function with a name. group: what it is for. relative: its keys run over 0..1."""

    name: str
    group: str
    unit: str
    relative: bool
    value: TransferFunction

    def over(self, low: float, high: float) -> TransferFunction:
        """The function for data in a range; one in real values stays as it is."""
        return fitted(self.value, low, high) if self.relative else self.value


def presets(unit: str = "") -> list[Preset]:
    """All presets; those in another unit than the data's come last."""
    return sorted(_all(), key=lambda one: bool(one.unit and unit and one.unit != unit))


def refusals() -> dict[str, str]:
    """Why presets could not be used, by file or entry point."""
    _all()
    return dict(_refused)


_refused: dict[str, str] = {}


@functools.cache
def _all() -> tuple[Preset, ...]:
    found = []
    _refused.clear()
    for origin, described in _described():
        try:
            preset = read(described)
        except (GraphError, TypeError, ValueError, KeyError) as error:
            _refused[origin] = str(error)
            continue
        if preset is not None:
            found.append(preset)
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
    )


def _described() -> Iterator[tuple[str, Any]]:
    for file in sorted(FOLDER.glob("*.json")):
        try:
            listed = json.loads(file.read_text(encoding="utf-8"))
        except ValueError as error:
            _refused[file.name] = str(error)
            continue
        for one in listed if isinstance(listed, list) else [listed]:
            yield f"{file.name}/{one.get('name', '') if isinstance(one, dict) else ''}", one
    from nodegraph import plugins

    for plugin in plugins.discover("nodegraph.presets"):
        offered = plugin.object
        try:
            offered = offered() if callable(offered) else offered
        except Exception as error:
            _refused[plugin.name] = plugins.explain_failure(error)
            continue
        if plugin.reason:
            _refused[plugin.name] = plugin.reason
            continue
        for one in offered if isinstance(offered, (list, tuple)) else [offered]:
            yield plugin.name, one


def thumbnail(function: TransferFunction, width: int, height: int) -> QPixmap:
    """The colours of a function over its domain, shining through as far as they are transparent."""
    low, high = function.domain
    rows = low + (high - low) * (np.arange(width) + 0.5) / width
    colors = function.evaluate(rows)[:, :3]
    # The fourth root shows what is thin as well: opacities per millimetre are small.
    alpha = opacity_at(function, rows) ** 0.25
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
