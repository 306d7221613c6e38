"""Small pictures of any value of a port, for previews and views. Nothing here needs the window's thread."""

from __future__ import annotations

from typing import Any

import numpy as np
from PySide6.QtGui import QImage

from nodegraph.data import Image, Volume
from nodegraph.data.buffer import Array
from nodegraph.data.image import srgb_encode

_LEVELS = 1 << 14
_SRGB = np.rint(srgb_encode(np.linspace(0.0, 1.0, _LEVELS)) * 255.0).astype(np.uint8)


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
    data = np.asarray(volume.data)
    if data.ndim == 4:
        data = data[..., 0]
    depth, rows, columns = data.shape
    z, y, x = (float(step) for step in np.asarray(volume.spacing)[::-1])
    cuts = (
        (data[depth // 2], rows * y, columns * x),
        (data[::-1, rows // 2], depth * z, columns * x),
        (data[::-1, :, columns // 2], depth * z, rows * y),
    )
    middle = np.concatenate([np.asarray(cut, np.float32).ravel() for cut, _, _ in cuts])
    finite = middle[np.isfinite(middle)]
    low, high = np.percentile(finite, (1.0, 99.5)) if finite.size else (0.0, 1.0)
    canvas = np.zeros((edge, 3 * edge), np.uint8)
    for place, (cut, tall, wide) in enumerate(cuts):
        fit = edge / max(tall, wide)
        height, width = max(1, round(tall * fit)), max(1, round(wide * fit))
        at = np.ix_(_steps(height, cut.shape[0]), _steps(width, cut.shape[1]))
        shown = _grey(np.clip(cut[at], low, high))
        top, left = (edge - height) // 2, place * edge + (edge - width) // 2
        canvas[top : top + height, left : left + width] = shown
    return to_qimage(canvas)


def middle_slice(volume: Volume, size: tuple[int, int]) -> QImage:
    """The axial slice in the middle in its true proportions, as large as fits. Reads that slice alone."""
    depth = volume.dims[2]
    cut = np.asarray(volume.buffer.part((depth // 2,), (depth // 2 + 1,)))[0]
    tall, wide = (side * float(step) for side, step in zip(cut.shape[:2], volume.spacing[1::-1], strict=True))
    fit = min(size[0] / wide, size[1] / tall)
    at = np.ix_(*(_steps(max(1, round(side * fit)), n) for side, n in zip((tall, wide), cut.shape, strict=False)))
    cut = np.asarray(cut[at] if cut.ndim == 2 else cut[..., 0][at], np.float32)
    finite = cut[np.isfinite(cut)]
    low, high = np.percentile(finite, (1.0, 99.5)) if finite.size else (0.0, 1.0)
    return to_qimage(_grey(np.clip(cut, low, high)))


def _steps(pixels: int, samples: int) -> Array:
    steps: Array = np.minimum(((np.arange(pixels) + 0.5) * samples / pixels).astype(int), samples - 1)
    return steps


def _scaled(picture: QImage, size: tuple[int, int] | None) -> QImage:
    from PySide6.QtCore import Qt

    if size is None or (picture.width() <= size[0] and picture.height() <= size[1]):
        return picture
    return picture.scaled(*size, Qt.AspectRatioMode.KeepAspectRatio, Qt.TransformationMode.SmoothTransformation)
