"""Blocks: a volume that is larger than memory, cut so that a renderer can take it piece by piece, front to back.

A block is a box of whole cells, a multiple of a brick wide. Blocks adjoin without overlap; the voxels that a block has
to read are more: the plane that it shares with the next block, and ``reach`` voxels around for what looks beyond a
sample (central differences need one). The outermost blocks go on to the outer faces of the volume.

    for block in front_to_back(volume, camera, visible=visible_bricks(...)):
        part = volume.part(block.first, block.stop)

How a ray-caster carries its sums from block to block: docs/decisions/0009-out-of-core.md.
Source: Rezk-Salama 2001, R15 (blocks that share a plane of voxels).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.bricks import BRICK, FARTHEST, Flags, brick_counts, brick_distances
from nodegraph.data.buffer import Array
from nodegraph.data.camera import Camera
from nodegraph.data.space import transform_points
from nodegraph.data.volume import Grid
from nodegraph.errors import PortError

BLOCK = 128
"""Cells along each edge of a block, unless told otherwise: 4.3 MB of 16-bit voxels with all that they share."""

Voxel = tuple[int, int, int]
Pixels = tuple[int, int, int, int]


class Block(NamedTuple):
    """A box of cells of a grid. Everything is (x, y, z) in the index space of the whole grid."""

    place: Voxel
    """Which block along each axis."""
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    """The space that the block stands for, low <= p < high: at voxel centres inside, -1/2 and n - 1/2 outside."""
    first: Voxel
    stop: Voxel
    """The voxels to read, first <= voxel < stop, as `Volume.part` takes them."""


def block_counts(dims: Voxel, size: int = BLOCK) -> Voxel:
    """Number of blocks (x, y, z) of ``size`` cells an edge."""
    if size < BRICK or size % BRICK:
        raise PortError(f"blocks: expected a multiple of {BRICK} cells, got {size}")
    x, y, z = (max(1, -(-(n - 1) // size)) for n in dims)
    return x, y, z


def block_at(dims: Voxel, place: Voxel, size: int = BLOCK, reach: int = 1) -> Block:
    """The block at a place of the grid of blocks, with what it reads ``reach`` voxels around it."""
    low, high, first, stop = [], [], [], []
    for i, count, n in zip(place, block_counts(dims, size), dims, strict=True):
        start, end = i * size, min((i + 1) * size, n - 1)
        low.append(start if i > 0 else -0.5)
        high.append(end if i < count - 1 else n - 0.5)
        first.append(max(start - reach, 0))
        stop.append(min(end + 1 + reach, n))
    return Block(place, _three(low), _three(high), _three(first), _three(stop))


def visible_blocks(visible: Flags, dims: Voxel, size: int = BLOCK, span: float = 0.0) -> Flags:
    """True for the blocks (z, y, x) that hold a visible brick; ``visible`` is that of `bricks.visible_bricks`.

    A block renders the segments of rays whose middle lies in it. ``span``, in voxels, is how far from its middle a
    segment is looked at: half a step, or 0 for one sample in the middle. Bricks as near as that count as well.
    """
    if visible.shape != brick_counts(dims)[::-1]:
        expected = brick_counts(dims)[::-1]
        raise PortError(f"blocks: expected bricks {expected} (z, y, x) for a grid of {dims}, got {visible.shape}")
    rings = min(math.ceil(span / BRICK), FARTHEST - 1)
    found = visible if rings == 0 else brick_distances(visible) <= rings
    for axis, count in enumerate(block_counts(dims, size)[::-1]):
        found = np.logical_or.reduceat(found, np.arange(count) * (size // BRICK), axis=axis)
    return found


def front_to_back(
    grid: Grid,
    camera: Camera,
    visible: Flags | None = None,
    size: int = BLOCK,
    reach: int = 1,
    span: float = 0.0,
) -> Iterator[Block]:
    """The blocks of a grid, so that no ray of the camera enters one before those that lie in front of it.

    ``visible`` are the visible bricks (bz, by, bx); blocks without any, see `visible_blocks`, are left out. Along a ray
    each coordinate of index space moves one way only, away from the eye's. So along each axis the blocks are ranked by
    how many lie between them and the eye's own; no rank falls along a ray, and going by ranks, axis by axis, is a right
    order for all rays at once. It holds for sheared and mirrored grids, too, since straight lines stay straight.
    The slowest axis of the data comes first: neighbours are read one after the other, while the chunks that they share
    are still kept.
    """
    counts = block_counts(grid.dims, size)
    ranked = [_ranked(n, eye, way, size) for n, eye, way in zip(counts, *_eye_and_way(grid, camera), strict=True)]
    wanted = None if visible is None else visible_blocks(visible, grid.dims, size, span)
    for z in ranked[2]:
        for y in ranked[1]:
            for x in ranked[0]:
                if wanted is None or wanted[z, y, x]:
                    yield block_at(grid.dims, (x, y, z), size, reach)


def pixels_of(block: Block, grid: Grid, camera: Camera, size: tuple[int, int], margin: float = 0.0) -> Pixels | None:
    """The pixels (left, top, right, bottom), ends left out, whose rays may pass through a block; None for no pixel.

    ``margin``, in voxels, makes the block larger on all sides: half a step, for the segments whose middle lies in a
    block may reach, and where a ray enters the volume lie, so far outside.
    All pixels where the block reaches behind a perspective eye, for then its corners do not bound its image.
    """
    width, height = size
    ends = np.array(block.low) - margin, np.array(block.high) + margin
    corners = np.array([[ends[i >> axis & 1][axis] for axis in range(3)] for i in range(8)])
    from_eye = transform_points(grid.index_to_world, corners) - np.asarray(camera.eye)
    right, up, forward = (from_eye @ axis for axis in camera.basis)
    if camera.orthographic:
        half = camera.height / 2
    else:
        rounding = 1e-6 * np.abs(from_eye).max()
        if forward.max() < -rounding:
            return None
        if forward.min() <= rounding:
            return 0, 0, width, height
        half = math.tan(math.radians(camera.field_of_view) / 2)
        right, up = right / forward, up / forward
    across = (right / (half * width / height) + 1.0) / 2.0 * width
    down = (1.0 - up / half) / 2.0 * height
    # The middle of pixel i lies at i + 1/2; a pixel more on each side is for the rounding of a device.
    left, end = (math.floor(across.min() - 0.5) - 1, math.ceil(across.max() - 0.5) + 2)
    top, bottom = (math.floor(down.min() - 0.5) - 1, math.ceil(down.max() - 0.5) + 2)
    box = (max(left, 0), max(top, 0), min(end, width), min(bottom, height))
    return box if box[0] < box[2] and box[1] < box[3] else None


def _eye_and_way(grid: Grid, camera: Camera) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The eye and the direction of view in index space; the way is NaN where the eye itself decides."""
    eye = transform_points(grid.world_to_index, np.asarray(camera.eye))
    if camera.orthographic:
        return eye, grid.world_to_index[:3, :3] @ camera.basis[2]
    return eye, np.full(3, np.nan)


def _ranked(count: int, eye: float, way: float, size: int) -> list[int]:
    """Blocks along an axis, nearest first."""
    if not math.isnan(way):
        return list(range(count)) if way >= 0.0 else list(range(count - 1, -1, -1))
    own = min(max(math.floor(eye / size), 0), count - 1)
    return sorted(range(count), key=lambda i: abs(i - own))


def _three(values: Array | list[float] | list[int]) -> tuple:  # type: ignore[type-arg]
    x, y, z = values
    return x, y, z
