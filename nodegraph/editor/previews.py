"""Small pictures of any value of a port, for previews and views. Nothing here needs the window's thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtGui import QImage, QPainter

from nodegraph.data import Camera, Image, Labels, Light, Mesh, Plane, Table, TransferFunction, Volume
from nodegraph.data.buffer import Array
from nodegraph.data.image import srgb_encode
from nodegraph.editor import sketches

_LEVELS = 1 << 14
_SRGB = np.rint(srgb_encode(np.linspace(0.0, 1.0, _LEVELS)) * 255.0).astype(np.uint8)


THUMBNAIL = (260, 200)
TILE = 128
ROWS, COLUMNS = 6, 5
"""How much of a table is shown."""


@dataclass(frozen=True, slots=True)
class Preview:
    """What is shown of a value: a picture, lines of text, rows of a table with their heads first; or part of that."""

    picture: QImage | None = None
    lines: tuple[str, ...] = ()
    rows: tuple[tuple[str, ...], ...] = ()


def preview_of(value: Any, cancelled: Callable[[], bool] = lambda: False) -> Preview:
    """What there is to see of a value of a port; of one that nobody can show, nothing.

    Volumes and labels: a small ray-cast and the middle slices. Images: a thumbnail and the range. Meshes: shaded.
    Tables: the first rows. Transfer functions: their colours and opacity. The others say what they are.
    """
    if isinstance(value, Image):
        return Preview(picture_of(value, THUMBNAIL), (_image_told(value),))
    if isinstance(value, (Volume, Labels)):
        return Preview(_grid(value, cancelled))
    if isinstance(value, Mesh):
        drawn = sketches.draw(value, 2 * THUMBNAIL[1], cancelled)
        return Preview(_scaled(to_qimage(drawn), THUMBNAIL) if drawn is not None else None)
    if isinstance(value, Table):
        return Preview(rows=_rows(value))
    if isinstance(value, TransferFunction):
        return Preview(_strip(value))
    if isinstance(value, (Camera, Light, Plane)):
        return Preview(lines=tuple(f"{name}: {_short(part)}" for name, part in value.to_json().items()))
    return Preview()


def picture_of(value: Any, size: tuple[int, int] | None = None) -> QImage | None:
    """A picture of a value, at most ``size`` (width, height) in pixels; None where there is nothing to see.

    Images as they are: four channels in sRGB with alpha, others as grey from their least to their largest value, pairs
    of distances as the length between them. Volumes as their three middle slices: axial, coronal, sagittal.
    """
    if isinstance(value, Image):
        return _scaled(_image(value), size)
    if isinstance(value, Volume):
        return _slices(value, size or (384, 128))
    return None


def to_qimage(pixels: Array) -> QImage:
    """A QImage that owns a copy of (h, w, 4) bytes RGBA, not premultiplied, or of (h, w) grey bytes."""
    pixels = np.ascontiguousarray(pixels)
    height, width = pixels.shape[:2]
    kind = QImage.Format.Format_RGBA8888 if pixels.ndim == 3 else QImage.Format.Format_Grayscale8
    return QImage(pixels.data, width, height, pixels.strides[0], kind).copy()


def _image(image: Image) -> QImage:
    color = np.asarray(image.color)
    if image.channels != 4:
        values = color[..., 0] if image.channels == 1 else np.maximum(color[..., 1] - color[..., 0], 0.0)
        return to_qimage(_grey(values))
    alpha = np.clip(np.nan_to_num(color[..., 3:], nan=0.0), 0.0, 1.0)
    straight = np.divide(color[..., :3], alpha, out=np.zeros_like(color[..., :3]), where=alpha > 0.0)
    pixels = np.empty((*color.shape[:2], 4), np.uint8)
    pixels[..., :3] = _encoded(straight)
    pixels[..., 3] = np.rint(alpha[..., 0] * 255.0)
    return to_qimage(pixels)


def _encoded(linear: Array) -> Array:
    clipped = np.clip(np.nan_to_num(linear, nan=0.0), 0.0, 1.0)
    encoded: Array = _SRGB[(clipped * (_LEVELS - 1) + 0.5).astype(np.uint16)]
    return encoded


def _grey(values: Array) -> Array:
    """Bytes from the least to the largest finite value; what is not finite is black."""
    values = np.asarray(values, np.float32)
    finite = np.isfinite(values)
    if not finite.any():
        return np.zeros(values.shape, np.uint8)
    low, high = float(values[finite].min()), float(values[finite].max())
    scaled = (np.where(finite, values, low) - low) / (high - low) if high > low else np.where(finite, 0.5, 0.0)
    grey: Array = np.rint(np.clip(scaled, 0.0, 1.0) * 255.0).astype(np.uint8)
    return grey


def _slices(volume: Volume, size: tuple[int, int]) -> QImage:
    """Three squares side by side, each slice in its true proportions."""
    edge = max(8, min(size[0] // 3, size[1]))
    return to_qimage(np.concatenate(_tiles(volume, edge), axis=1))


def _tiles(grid: Volume | Labels, edge: int) -> list[Array]:
    """The middle slices, axial, coronal and sagittal, each in a square: grey, or RGBA in the colours of labels."""
    depth, rows, columns = grid.dims[::-1]
    z, y, x = (float(step) for step in np.asarray(grid.spacing)[::-1])
    axial, coronal, sagittal = (_middle(grid, axis) for axis in range(3))
    cuts = (
        (axial, rows * y, columns * x),
        (coronal[::-1], depth * z, columns * x),
        (sagittal[::-1], depth * z, rows * y),
    )
    labels = isinstance(grid, Labels)
    low, high = (0.0, 1.0) if labels else _usual([cut for cut, _, _ in cuts])
    tiles: list[Array] = []
    for cut, up, across in cuts:
        fit = edge / max(up, across)
        height, width = max(1, round(up * fit)), max(1, round(across * fit))
        at = np.ix_(_steps(height, cut.shape[0]), _steps(width, cut.shape[1]))
        tile: Array = np.zeros((edge, edge, 4) if labels else (edge, edge), np.uint8)
        if labels:
            tile[..., 3] = 255
        top, left = (edge - height) // 2, (edge - width) // 2
        room = tile[top : top + height, left : left + width]
        if labels:
            room[..., :3] = sketches.label_colors(cut[at])
        else:
            room[:] = _between(cut[at], low, high)
        tiles.append(tile)
    return tiles


def _middle(grid: Volume | Labels, axis: int) -> Array:
    """The middle slice across an axis of the data, (z, y, x); only what it needs is read."""
    low, high = [0, 0, 0], list(grid.buffer.shape[:3])
    low[axis], high[axis] = high[axis] // 2, high[axis] // 2 + 1
    part = grid.buffer.part(low, high)
    cut: Array = (part if part.ndim == 3 else part[..., 0]).squeeze(axis)
    return cut


def middle_slice(volume: Volume, size: tuple[int, int]) -> QImage:
    """The axial slice in the middle in its true proportions, as large as fits. Reads that slice alone."""
    cut = _middle(volume, 0)
    tall, wide = (side * float(step) for side, step in zip(cut.shape, volume.spacing[1::-1], strict=True))
    fit = min(size[0] / wide, size[1] / tall)
    at = np.ix_(*(_steps(max(1, round(side * fit)), n) for side, n in zip((tall, wide), cut.shape, strict=True)))
    return to_qimage(_between(cut[at], *_usual([cut])))


def _usual(cuts: list[Array]) -> tuple[float, float]:
    """Between which values most of these slices lie."""
    middle = np.concatenate([np.asarray(cut, np.float32).ravel() for cut in cuts])
    finite = middle[np.isfinite(middle)]
    if not finite.size:
        return 0.0, 1.0
    low, high = np.percentile(finite, (1.0, 99.5))
    return float(low), float(high)


def _between(values: Array, low: float, high: float) -> Array:
    """Grey from one value to another; what is not finite is black."""
    values = np.asarray(values, np.float32)
    finite = np.isfinite(values)
    scaled = (np.where(finite, values, low) - low) / (high - low) if high > low else np.where(finite, 0.5, 0.0)
    grey: Array = np.rint(np.clip(scaled, 0.0, 1.0) * 255.0).astype(np.uint8)
    return grey


def _grid(grid: Volume | Labels, cancelled: Callable[[], bool]) -> QImage | None:
    """Four squares: the ray-cast, and beside and below it the slices."""
    drawn = sketches.cast(grid, TILE, cancelled)
    if cancelled():
        return None
    if drawn is not None and isinstance(grid, Volume):
        _ = grid.range  # kept there, and said in its summary from now on
    gap = 3
    picture = QImage(2 * TILE + gap, 2 * TILE + gap, QImage.Format.Format_ARGB32_Premultiplied)
    picture.fill(Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    places = [(TILE + gap, 0), (0, TILE + gap), (TILE + gap, TILE + gap)]
    painter.fillRect(0, 0, TILE, TILE, Qt.GlobalColor.black)
    if drawn is not None:
        painter.drawImage(0, 0, to_qimage(drawn))
    for (x, y), tile in zip(places, _tiles(grid, TILE), strict=True):
        painter.drawImage(x, y, to_qimage(tile))
    painter.end()
    return picture


def _image_told(image: Image) -> str:
    """Range of an image in words; its size is in its summary."""
    color = np.asarray(image.color)
    finite = color[np.isfinite(color)]
    return f"values {finite.min():.4g} .. {finite.max():.4g}" if finite.size else "no finite value"


def _rows(table: Table) -> tuple[tuple[str, ...], ...]:
    """The first rows of a table below its heads; where there is more, dots say so."""
    names = table.columns[:COLUMNS]
    more = ("\u2026",) if len(table.columns) > COLUMNS else ()
    heads = [f"{name} [{table.units[name]}]" if table.units.get(name) else name for name in names]
    rows: list[tuple[str, ...]] = [(*heads, *more)]
    for i in range(min(ROWS, len(table))):
        rows.append((*(_cell(table[name][i]) for name in names), *more))
    if len(table) > ROWS:
        rows.append((f"\u2026 {len(table) - ROWS} more",))
    return tuple(rows)


def _cell(value: Any) -> str:
    return f"{value:.5g}" if isinstance(value, np.floating) else str(value)


def _short(part: Any) -> str:
    if isinstance(part, (list, tuple)):
        return ", ".join(_short(one) for one in part)
    return f"{part:.5g}" if isinstance(part, float) else str(part)


def _strip(function: TransferFunction) -> QImage:
    """The colours of a transfer function over its domain, as high as they are opaque."""
    width, height = THUMBNAIL[0], 64
    low, high = function.domain
    found = function.evaluate(np.linspace(low, high, width))
    opacity = 1.0 - np.exp(-found[:, 3] * function.reference_length)
    pixels = np.zeros((height, width, 4), np.uint8)
    pixels[..., :3] = _encoded(found[:, :3])
    above = np.arange(height)[:, None] < (1.0 - opacity)[None, :] * (height - 4)
    pixels[..., 3] = np.where(above, 40, 255)
    return to_qimage(pixels)


def _steps(pixels: int, samples: int) -> Array:
    steps: Array = np.minimum(((np.arange(pixels) + 0.5) * samples / pixels).astype(int), samples - 1)
    return steps


def _scaled(picture: QImage, size: tuple[int, int] | None) -> QImage:
    if size is None or (picture.width() <= size[0] and picture.height() <= size[1]):
        return picture
    return picture.scaled(*size, Qt.AspectRatioMode.KeepAspectRatio, Qt.TransformationMode.SmoothTransformation)
