"""Casting some of the rays of a picture, and guessing the pixels between them (docs/decisions/0010-quality.md)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.buffer import Array, Buffer

SPARSE = "render/sparse"
STRIDE = 4
"""From one pixel that is cast first to the next."""
SHRINKS = 3.0
"""By so much second differences shrink when the distance of pixels is halved: between 2, at a bend, and 4."""
WORTH = 0.5
"""Share of what is seen that must be even in a grid of half the stride: below it sparse rays cost more than all."""
TILE = 16
"""Pixels a side of what is cast together. What rays read of a volume then stays in the caches of processors."""

Cast = Callable[..., Any]
Places = tuple[NDArray[np.intp], NDArray[np.intp]]


class Picture(NamedTuple):
    """Colour (h, w, 4) and depth (h, w), on the host."""

    color: Buffer
    depth: Buffer


def cast_sparsely(
    cast: Cast, device: Any, size: tuple[int, int], tolerance: float, explain: Callable[[str], None]
) -> Any:
    """Cast every fourth pixel of every fourth row, then of every second, then of all, those that cannot be guessed.

    ``cast(pixels)`` returns colour and depth of the rays of pixels (h, w, 2), column and row of each; ``cast()`` of
    all. Pixels are listed, not masked: devices run neighbouring rays in step, so one that is left out among others
    saves nothing. Where hardly any can be guessed, all are cast. Source: Orhun 2004, OR-60.
    """
    stride = STRIDE
    columns, rows = np.meshgrid(np.arange(0, size[0], stride), np.arange(0, size[1], stride))
    found = cast(_pixels((columns, rows)))
    color, depth, count = found.color.array, found.depth.array, columns.size
    while stride > 1:
        guess = device.run(SPARSE, depth.shape[::-1], color=color, depth=depth, tolerance=tolerance)
        seen = color[..., 3] > 0.0
        if stride == STRIDE and seen.any() and np.mean(guess.depths.array[..., 3][seen] <= SHRINKS) < WORTH:
            explain("every pixel is cast: too few agree with those around them within pixel_tolerance")
            return cast()
        stride //= 2
        color, depth, known = _interleaved(color, depth, guess, tuple((n - 1) // stride + 1 for n in size))
        if not known.all():
            places = _listed(~known)
            found = cast(_pixels(places, stride))
            color[places[::-1]], depth[places[::-1]] = found.color.array, found.depth.array
            count += known.size - int(np.count_nonzero(known))
    explain(f"{count / depth.size:.0%} of the pixels are cast, the others guessed")
    return Picture(Buffer(color), Buffer(depth))


def _pixels(places: Places, stride: int = 1) -> Array:
    """What a kernel reads: (h, w, 2), column and row."""
    return np.stack(places, axis=2).astype(np.float32) * np.float32(stride)


def _interleaved(
    color: Array, depth: Array, guess: Any, size: tuple[int, ...]
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Corners and guesses as one grid of a size (w, h), and which pixels of it are known."""
    width, height = size
    fine_color = np.empty((height, width, 4), color.dtype)
    fine_depth = np.empty((height, width), depth.dtype)
    known = np.ones((height, width), bool)
    fine_color[::2, ::2], fine_depth[::2, ::2] = color, depth
    depths = guess.depths.array
    for i, (colors, down, right) in enumerate(((guess.right, 0, 1), (guess.below, 1, 0), (guess.centre, 1, 1))):
        here = slice(down, None, 2), slice(right, None, 2)
        own = slice((height - down + 1) // 2), slice((width - right + 1) // 2)
        fine_color[here], fine_depth[here] = colors.array[own], depths[own][..., i]
        known[here] = depths[own][..., 3] <= 1.0
    # Beyond the last corner there is nothing to go by.
    known[:, width - 1 + width % 2 :] = False
    known[height - 1 + height % 2 :] = False
    return fine_color, fine_depth, known


def _listed(wanted: NDArray[np.bool_]) -> Places:
    """Columns and rows of pixels as two pictures (h, w) in which neighbours stay together; the last pixel repeats."""
    height, width = wanted.shape
    padded = np.zeros((height + -height % TILE, width + -width % TILE), bool)
    padded[:height, :width] = wanted
    across = padded.shape[1] // TILE
    # Tiles of the picture one after the other, in each of them blocks of 4 x 2, which many devices run in step.
    ordered = padded.reshape(-1, TILE // 2, 2, across, TILE // 4, 4).transpose(0, 3, 1, 4, 2, 5)
    places = np.flatnonzero(ordered)
    # The list fills pictures of 64 columns, which stand beside each other, block by block.
    beside = max(1, round(float(len(places)) ** 0.5 / 64.0))
    places = np.append(places, np.full(-len(places) % (beside * 64 * 2), places[-1]))
    listed = places.reshape(beside, -1, 16, 2, 4).transpose(1, 3, 0, 2, 4).reshape(-1, beside * 64)
    tile, inner = np.divmod(listed, TILE * TILE)
    block, pixel = np.divmod(inner, 8)
    columns = tile % across * TILE + block % (TILE // 4) * 4 + pixel % 4
    rows = tile // across * TILE + block // (TILE // 4) * 2 + pixel // 4
    return columns, rows
