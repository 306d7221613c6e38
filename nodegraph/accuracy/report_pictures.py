"""Pictures of a report: what was rendered, and where it differs from the reference, amplified."""

from __future__ import annotations

import base64
import math
from typing import NamedTuple

import numpy as np

from nodegraph.accuracy.differences import distance
from nodegraph.data import Image
from nodegraph.data.buffer import Array
from nodegraph.data.image import srgb_decode

WIDEST = 480
"""Pictures that are larger, pixels, are shown reduced by a whole factor."""

#: From no difference to the greatest: black, violet, red, orange, pale yellow, as sRGB. Its lightness rises evenly.
SCALE = np.array(
    [[0, 0, 4], [58, 12, 96], [137, 34, 106], [203, 65, 73], [245, 125, 21], [250, 193, 39], [252, 255, 164]]
)
HOLE = (0.0, 1.0, 1.0)
"""Where one of two pictures holds no finite number: a colour that the scale has not."""
LEFT_OUT = (0.03, 0.08, 0.14)
"""Where the reference did not converge."""


class Amplified(NamedTuple):
    """A difference image, opaque RGBA, and what it was multiplied by; 0 where nothing differs."""

    image: Image
    factor: float


def amplified(value: Image, reference: Image, mask: Array | None = None) -> Amplified:
    """The greatest difference over the channels of each pixel, times a power of two that brings it to 0..1.

    The factor is chosen such that 99.9 % of the pixels fit, so that a few bad ones do not leave the rest black.
    Pixels where ``mask`` is False do not count and are drawn in one colour, `LEFT_OUT`.
    """
    apart = distance(value.color, reference.color).max(axis=2)
    counted = np.ones(apart.shape, bool) if mask is None else mask
    apart = reduce(np.where(counted, apart, 0.0), np.max)
    # Of a square of pixels that is drawn as one, one that counts is enough.
    nothing = reduce(counted.astype(np.float64), np.max) == 0.0
    finite = apart[np.isfinite(apart) & ~nothing]
    level = 0.0
    if finite.size:
        level = float(np.partition(finite, -1 - finite.size // 1000)[-1 - finite.size // 1000])
        level = level or float(finite.max())
    factor = 2.0 ** math.floor(-math.log2(level)) if level > 0.0 else 0.0
    shown = np.where(np.isfinite(apart), np.clip(apart * (factor or 1.0), 0.0, 1.0), 0.0)
    places = np.linspace(0.0, 1.0, len(SCALE))
    color = np.stack([np.interp(shown, places, SCALE[:, channel] / 255) for channel in range(3)], axis=2)
    color = srgb_decode(color)
    color[~np.isfinite(apart)] = HOLE
    color[nothing] = LEFT_OUT
    return Amplified(_opaque(color), factor)


def shown(image: Image) -> Image:
    """A picture over black, reduced to what fits; one channel as grey, two distances as the length between them."""
    if image.channels == 4:
        color = image.color[..., :3]
    else:
        grey = image.color[..., :1].astype(np.float64)
        if image.channels == 2:
            with np.errstate(invalid="ignore"):
                length = image.color[..., 1:] - grey
            length = np.where(np.isfinite(length), np.maximum(length, 0.0), 0.0)
            grey = length / (length.max() or 1.0)
        color = np.repeat(grey, 3, axis=2)
    color = np.clip(np.nan_to_num(color), 0.0, 1.0)
    return _opaque(np.stack([reduce(color[..., channel], np.mean) for channel in range(3)], axis=2))


def reduce(plane: Array, how: object) -> Array:
    """A plane (h, w) made smaller by a whole factor until it fits; ``how`` is np.mean or np.max of each square."""
    factor = math.ceil(max(plane.shape) / WIDEST)
    if factor == 1:
        return plane
    tall, wide = (math.ceil(side / factor) * factor for side in plane.shape)
    # The last row and column are repeated, so that every pixel is in some square.
    padded = np.pad(plane, ((0, tall - plane.shape[0]), (0, wide - plane.shape[1])), mode="edge")
    squares = padded.reshape(tall // factor, factor, wide // factor, factor)
    found: Array = squares.max(axis=(1, 3)) if how is np.max else squares.mean(axis=(1, 3))
    return found


def data_url(image: Image) -> str:
    """A picture as text that a page can carry: an sRGB PNG in base 64."""
    from nodegraph.formats import png

    return png_url(png.encode(image, background=(0.0, 0.0, 0.0)))


def png_url(encoded: bytes) -> str:
    """The bytes of a PNG file as text that a page can carry."""
    return f"data:image/png;base64,{base64.b64encode(encoded).decode('ascii')}"


def _opaque(color: Array) -> Image:
    return Image(np.concatenate([color, np.ones((*color.shape[:2], 1))], axis=2).astype(np.float32))
