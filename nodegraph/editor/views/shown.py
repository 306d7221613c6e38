"""A picture ready for a screen: made of an `Image` beside the window's thread, with the numbers that a pick reads."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from PySide6.QtGui import QColor, QImage

from nodegraph.data import Image
from nodegraph.data.buffer import Array
from nodegraph.formats import srgb

CHANNELS = ("color", "alpha", "depth", "ids")
CHECKER = 8
"""Side in pixels of the squares that show what is transparent."""

VIEWPORT = "#16181b"
"""What is around and behind pictures, in the light theme, too: a bright surround hides what is dim."""

_LEVELS = 1 << 14
_SRGB = np.rint(np.asarray(srgb.encode(np.linspace(0.0, 1.0, _LEVELS, dtype=np.float32))) * 255.0).astype(np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A picture on the screen.

    picture: opaque. image: what it was made of; its numbers lie on the host now, so any thread may read them.
    low, high: of a channel of numbers, what is black and what is white.
    """

    picture: QImage
    image: Image
    low: float = 0.0
    high: float = 1.0

    @property
    def size(self) -> tuple[int, int]:
        return self.image.size


def shown(image: Image, background: tuple[float, float, float] | None = None, channel: str = "color") -> Shown:
    """A picture of one channel of an image: "color" over a linear background (None: a checkerboard), or of numbers.

    Alpha, depth, ids, single channels and lengths of pairs are grey between their least and greatest finite value;
    what is not finite is black. Call it off the window's thread: it reads what may lie on a device.
    """
    color, depth, ids = np.asarray(image.color), image.depth, image.ids  # this brings them to the host
    low, high = 0.0, 1.0
    if channel == "color" and image.channels == 4:
        return Shown(opaque(_over(color, background)), image)
    if channel == "alpha" and image.channels == 4:
        grey = np.clip(color[..., 3], 0.0, 1.0)
    else:
        values = depth if channel == "depth" else ids if channel == "ids" else None
        if values is None:
            values = color[..., 0] if image.channels != 2 else np.maximum(color[..., 1] - color[..., 0], 0.0)
        grey, low, high = _stretched(np.asarray(values, np.float32))
    return Shown(opaque(np.repeat((grey * 255.0 + 0.5).astype(np.uint8)[..., None], 3, axis=2)), image, low, high)


def channels_of(image: Image) -> list[str]:
    """The channels that `shown` can show of an image."""
    there = {
        "color": True,
        "alpha": image.channels == 4,
        "depth": image.depth_buffer is not None,
        "ids": image.ids_buffer is not None,
    }
    return [name for name in CHANNELS if there[name]]


def encoded(linear: Array) -> Array:
    """Bytes of sRGB; what is not a number is black."""
    clipped = np.clip(np.nan_to_num(linear, nan=0.0), 0.0, 1.0)
    bytes_: Array = _SRGB[(clipped * np.float32(_LEVELS - 1) + np.float32(0.5)).astype(np.uint16)]
    return bytes_


def _over(color: Array, background: tuple[float, float, float] | None) -> Array:
    """Colour over its background in linear light, as bytes."""
    if background is None:
        rows, columns = (np.arange(side) // CHECKER for side in color.shape[:2])
        light = (rows[:, None] + columns[None, :]) % 2 == 1
        behind = np.where(light, np.float32(0.30), np.float32(0.22))[..., None]
    else:
        behind = np.asarray(background, np.float32)
    return encoded(color[..., :3] + (1.0 - color[..., 3:]) * behind)


def _stretched(values: Array) -> tuple[Array, float, float]:
    finite = np.isfinite(values)
    if not finite.any():
        return np.zeros(values.shape, np.float32), 0.0, 0.0
    low, high = float(values[finite].min()), float(values[finite].max())
    span = high - low if high > low else 1.0
    grey = np.where(finite, (np.where(finite, values, low) - low) / span, 0.0)
    return grey if high > low else np.where(finite, np.float32(0.5), np.float32(0.0)), low, high


def linear(color: QColor) -> tuple[float, float, float]:
    """A colour of the screen as linear light."""
    red, green, blue = np.asarray(srgb.decode(np.array([color.redF(), color.greenF(), color.blueF()]))).tolist()
    return red, green, blue


def opaque(pixels: Array) -> QImage:
    """A QImage that owns a copy of (h, w, 3) bytes."""
    height, width = pixels.shape[:2]
    four = np.full((height, width, 4), 255, np.uint8)
    four[..., :3] = pixels
    return QImage(four.data, width, height, 4 * width, QImage.Format.Format_RGBX8888).copy()
