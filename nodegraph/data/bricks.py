"""Bricks: what is where in a volume, coarsely, so that a renderer need not look where nothing can be seen.

A brick is 4 x 4 x 4 cells. Brick b of an axis covers the cells 4 b .. 4 b + 3, that is voxels 4 b .. 4 b + 4: one
plane of voxels is shared with the next brick, so that whatever is interpolated inside a brick comes from its own
voxels. The first and the last brick reach to the outer faces of the volume (-1/2 and n - 1/2), where the value of the
outermost voxels goes on.

    ranges = brick_ranges(volume)                                     one pass over the volume
    visible = visible_bricks(ranges, table, lookup)                   one look-up per brick, for each transfer function
    reaches = brick_reaches(visible)                                  how far a ray may leap, for each octant

All of them are pure functions of volumes, arrays and numbers. Arrays of bricks are (z, y, x), as volumes are.
Source: Schlosser 2009, C06 (least and greatest value, transparency by a prefix sum); docs/decisions/0007.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.buffer import Array
from nodegraph.data.transfer_function import TransferFunction
from nodegraph.data.transfer_function_2d import TransferFunction2D
from nodegraph.data.volume import Volume
from nodegraph.errors import PortError

BRICK = 4
"""Cells along each edge of a brick."""

FARTHEST = 255
"""The greatest distance that `brick_distances` tells apart."""

FARTHEST_LEAP = 32
"""Bricks that are leapt over at once, at most: finding a greater distance takes longer than leaping twice."""

VALUE_ROUNDING = 2.0**-20
"""Relative error of an interpolated value in single precision: 16 roundings (seven interpolations, the mapping)."""

ROW_ROUNDING = 2.0**-21
"""Relative error of the place in a table that single precision finds for a value: 8 roundings."""

Flags = NDArray[np.bool_]

MOSTLY_VISIBLE = 0.95


def brick_counts(dims: tuple[int, int, int]) -> tuple[int, int, int]:
    """Number of bricks (x, y, z) of a grid of ``dims`` voxels (x, y, z): ceil((n - 1) / 4), at least 1."""
    x, y, z = (max(1, -(-(n - 1) // BRICK)) for n in dims)
    return x, y, z


def brick_ranges(volume: Volume, group: int = 1) -> NDArray[np.float64]:
    """Least and greatest real value in each brick of a volume of one component: (bz, by, bx, 2), float64.

    Voxels that are not a number count for nothing; a brick that has no others gets (inf, -inf). A brick with an
    infinite voxel gets (-inf, inf). The ranges are wider than the exact ones by what a device that computes in single
    precision, on the volume less its origin, may be off; where nothing is rounded, as in a brick of zeros of a float
    or an unsigned volume, they are exact. Reads some planes of the volume at a time, or a layer of its chunks, and
    keeps none of them. Of ``group`` bricks along each axis one range is made: an eighth of the memory for 2.
    """
    if volume.components != 1:
        raise PortError(f"brick_ranges: expected one component, got {volume.components}; choose one of them")
    stored = _stored_ranges(volume) if group == 1 else _grouped(_stored_ranges(volume), group)
    finite = stored[np.isfinite(stored)]
    least, greatest = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    scale, offset = volume.mapping.scale, volume.mapping.offset
    with np.errstate(over="ignore", invalid="ignore"):
        ranges = stored.astype(np.float64) * scale + offset
        if scale < 0.0:
            ranges = ranges[..., ::-1]
        error = np.zeros(ranges.shape[:-1])
        for shift in _shifts(volume.dtype, least, greatest):
            # A device adds two parts: the voxel, counted from `shift`, and all that is constant.
            varying = np.abs(ranges - offset - shift * scale).max(axis=-1)
            constant = offset - volume.origin + shift * scale
            error = np.maximum(error, VALUE_ROUNDING * (varying + abs(constant)))
        ranges = ranges + error[..., None] * (-1.0, 1.0)
    nothing = np.isnan(stored).any(axis=-1)  # NaN alone: it is left where there is nothing else
    infinite = ~np.isfinite(ranges).all(axis=-1)
    ranges[infinite] = (-np.inf, np.inf)
    ranges[nothing] = (np.inf, -np.inf)
    return ranges


def value_ranges(volume: Volume, group: int = 1) -> Volume:
    """`brick_ranges` as a volume of two components, one voxel for each brick."""
    return Volume(brick_ranges(volume, group))


def visible_bricks(
    ranges: Array, table: Array, lookup: tuple[float, float], threshold: float = 0.0, level: float = 0.0
) -> Flags:
    """True for the bricks (bz, by, bx) in which some value has an extinction above ``threshold`` per mm.

    ``table`` is `TransferFunction.table(rows)`, (rows, 4), read with linear interpolation and clamped at its ends, and
    ``lookup`` is `TransferFunction.lookup(rows, level)`: what takes a value, less ``level``, to a place in it. A brick
    is invisible when no row that its values can touch, in single precision, is above the threshold. Bricks without
    values are invisible: what is not a number is transparent.
    """
    extinction = np.asarray(table)[:, 3]
    above = np.concatenate([[0], np.cumsum(extinction > threshold)])  # above[j] - above[i]: how many of rows i .. j - 1
    scale, offset = lookup
    last = len(extinction) - 1
    with np.errstate(over="ignore", invalid="ignore"):
        products = (np.asarray(ranges, np.float64) - level) * scale
        error = ROW_ROUNDING * (np.abs(products) + abs(offset))
        low = np.floor(products[..., 0] + offset - error[..., 0])
        high = np.ceil(products[..., 1] + offset + error[..., 1])
    # NaN comes of a table of one value (inf * 0), all of whose rows are the same.
    first = np.clip(np.nan_to_num(low, nan=0.0), 0, last).astype(np.intp)
    end = np.clip(np.nan_to_num(high, nan=last), 0, last).astype(np.intp) + 1
    found: Flags = (ranges[..., 0] <= ranges[..., 1]) & (above[end] > above[first])
    return found


def visible_by_keys(ranges: Array, function: TransferFunction, threshold: float = 0.0) -> Flags:
    """True for the bricks (bz, by, bx) in which a value has an extinction above ``threshold`` per mm by the keys.

    By the keys themselves, that is, and not by a table.
    """
    if not function.keys:
        return np.zeros(ranges.shape[:-1], np.bool_)
    places = np.array([key.value for key in function.keys])
    extinction = function.extinction(np.array([key.opacity for key in function.keys]))
    # Where a line between two keys passes the threshold, they get a third.
    low, high = np.minimum(extinction[:-1], extinction[1:]), np.maximum(extinction[:-1], extinction[1:])
    crossed = np.flatnonzero((low < threshold) & (high > threshold))
    with np.errstate(over="ignore", invalid="ignore"):
        share = (threshold - extinction[crossed]) / (extinction[crossed + 1] - extinction[crossed])
        crossings = places[crossed] + share * (places[crossed + 1] - places[crossed])
    # Beyond the greatest numbers there is no telling, and all of the line counts as above.
    told = (places[crossed] <= crossings) & (crossings <= places[crossed + 1])
    places = np.insert(places, crossed[told] + 1, crossings[told])
    over = np.insert(extinction > threshold, crossed[told] + 1, False)
    # Interval i lies between keys i - 1 and i; beyond the ends the outermost keys go on.
    above = np.concatenate([[over[0]], over[:-1] | over[1:], [over[-1]]])
    counts = np.concatenate([[0], np.cumsum(above)])
    first = np.searchsorted(places, ranges[..., 0], side="left")
    end = np.searchsorted(places, ranges[..., 1], side="right") + 1
    found: Flags = (ranges[..., 0] <= ranges[..., 1]) & (counts[np.maximum(end, first)] > counts[first])
    return found


def visible_by_areas(ranges: Array, function: TransferFunction2D, threshold: float = 0.0) -> Flags:
    """True for the bricks (bz, by, bx) in which a value may have an extinction above ``threshold`` per mm.

    By the areas themselves and not by a table, at whichever magnitude: ``ranges`` say nothing of
    gradients.
    """
    ends = np.array([area.bounds[0] for area in function.areas]).reshape(-1, 2)
    extinction = np.array([function.extinction(area.opacity) for area in function.areas])
    # Place 2 i + 1 is end i itself, where areas touch that end and begin there; place 2 i + 2 what lies behind it.
    places = np.unique(ends)
    sums = np.zeros(2 * len(places) + 1)
    for (low, high), most in zip(np.searchsorted(places, ends), extinction, strict=True):
        sums[2 * low + 1 : 2 * high + 2] += most
    counts = np.concatenate([[0], np.cumsum(sums > threshold)])
    first, last = (
        np.searchsorted(places, ranges[..., end], "left") + np.searchsorted(places, ranges[..., end], "right")
        for end in (0, 1)
    )
    found: Flags = (ranges[..., 0] <= ranges[..., 1]) & (counts[np.maximum(last, first) + 1] > counts[first])
    return found


def visible_above(ranges: Array, iso: float, level: float = 0.0) -> Flags:
    """True for the bricks (bz, by, bx) in which a value reaches ``iso``, both compared less ``level``."""
    rounding = 2.0**-23 * abs(iso - level)
    found: Flags = (ranges[..., 0] <= ranges[..., 1]) & (ranges[..., 1] >= iso - rounding)
    return found


def brick_distances(visible: Array) -> NDArray[np.uint8]:
    """Chebyshev distance, in bricks, from each brick (bz, by, bx) to the nearest that is visible: 0 .. 255.

    255 stands for all that is farther, or nowhere. So all bricks nearer than d to one at distance d are invisible.
    """
    return _chebyshev(np.asarray(visible, np.bool_))


def brick_reaches(visible: Array, quickly: bool = False) -> NDArray[np.float16]:
    """How far, in bricks, it is from the middle of each brick to the far sides of a cube that a ray may leap over.

    (8 bz, by, bx), as shaders/common/bricks.glsl reads it: -1/2 .. 31 1/2, below 0 for a visible brick. The cube begins
    with the brick, goes into one of eight octants, and ends before the nearest visible brick of that octant. Octant
    x + 2 y + 4 z, where 1 stands for an axis along which coordinates grow, begins with layer bz times its number. From
    every brick that a ray comes to it goes on in the same octant; of a cube about a brick most would lie behind it.
    ``quickly``: of such a cube nonetheless, the same for all octants, in a fifth of the time.
    """
    reaches = (np.arange(FARTHEST_LEAP + 1) - 0.5).astype(np.float16)
    if quickly:
        about = np.take(reaches, np.minimum(brick_distances(visible), FARTHEST_LEAP))
        return np.concatenate([about] * 8)
    found = [(~np.asarray(visible, np.bool_)).astype(np.uint8) * np.uint8(FARTHEST_LEAP)]
    for _ in range(3):
        # The last axis comes to the front, where shifting is fast; after three turns all are where they were.
        turned = [np.ascontiguousarray(np.moveaxis(each, -1, 0)) for each in found]
        found = [_nearest(each, **way) for way in ({"behind": True}, {"ahead": True}) for each in turned]
    return np.take(reaches, np.concatenate(found))


class Leaps(NamedTuple):
    """`brick_reaches` as a volume, and the share of the bricks that can be seen."""

    reaches: Volume
    share: float

    @classmethod
    def over(cls, visible: Flags) -> Leaps:
        """What a ray-caster needs to leap over the bricks that are not ``visible``."""
        return cls(Volume(brick_reaches(visible)), float(visible.mean()))


def visible_box(visible: Array, dims: tuple[int, int, int]) -> tuple[Array, Array] | None:
    """Least box (low, high) about the visible bricks in the index space (x, y, z) of a volume of ``dims`` voxels.

    Where the outermost bricks are visible it reaches to the outer faces, -1/2 and n - 1/2. None when nothing is.
    """
    if not np.any(visible):
        return None
    low, high = np.empty(3), np.empty(3)
    for axis in range(3):
        others = tuple(2 - other for other in range(3) if other != axis)
        found = np.flatnonzero(np.any(visible, axis=others))
        first, last = int(found[0]), int(found[-1])
        low[axis] = first * BRICK if first > 0 else -0.5
        high[axis] = (last + 1) * BRICK if last < visible.shape[2 - axis] - 1 else dims[axis] - 0.5
    return low, high


def _shifts(dtype: np.dtype[Any], least: float, greatest: float) -> tuple[float, ...]:
    """From where devices count stored numbers: the storage table of docs/devices.md. Double precision asks nobody."""
    if dtype.kind == "i" and dtype.itemsize <= 2:
        return 0.0, -(2.0 ** (8 * dtype.itemsize - 1))  # OpenCL as they are, OpenGL without a sign
    middle = least + (greatest - least) / 2
    if dtype.kind in "iu" and dtype.itemsize > 2 and max(abs(least), abs(greatest)) > 2.0**24:
        return (float(math.floor(middle)),)
    if dtype.kind == "f" and dtype.itemsize > 4 and abs(middle) > greatest - least:
        return (middle,)
    return (0.0,)


def _chebyshev(found: Flags) -> NDArray[np.uint8]:
    """Chebyshev distance of each cell to the nearest that is True, at most 255.

    One axis after the other: what lies k away along this axis and d away along the axes before is max(k, d) away.
    """
    distance = (~found).astype(np.uint8) * np.uint8(FARTHEST)
    for _ in range(distance.ndim):
        # The next axis comes to the front, where shifting is fast; after three turns all are where they were.
        before = np.ascontiguousarray(np.moveaxis(distance, -1, 0))
        distance = _nearest(before, ahead=True, behind=True)
    return distance


def _nearest(before: NDArray[np.uint8], ahead: bool = False, behind: bool = False) -> NDArray[np.uint8]:
    """The least of max(k, what stands k cells ahead along the first axis, behind, or either), k = 0, 1, ..."""
    distance, longer, steps = before.copy(), before.copy(), np.empty_like(before)
    for k in range(1, min(len(before), FARTHEST)):
        if k >= distance.max():
            break  # nothing gets nearer by steps as long as this
        steps.fill(k)  # numpy is eight times slower with a number than with an array of it
        np.maximum(longer, steps, out=longer)
        if ahead:
            np.minimum(distance[:-k], longer[k:], out=distance[:-k])
        if behind:
            np.minimum(distance[k:], longer[:-k], out=distance[k:])
    return distance


def _stored_ranges(volume: Volume) -> Array:
    """Least and greatest stored number of each brick (bz, by, bx, 2); NaN where there is nothing else."""
    nx, ny, nz = volume.dims
    x, y, z = brick_counts((nx, ny, nz))
    half = volume.dtype == np.float16  # numpy is slow with it
    result = np.empty((z, y, x, 2), np.float32 if half else volume.dtype)
    result[...] = (
        (np.nan, np.nan) if result.dtype.kind == "f" else (np.iinfo(result.dtype).max, np.iinfo(result.dtype).min)
    )
    for first, slab in volume.buffer.slabs(BRICK):
        slab = slab.reshape(-1, ny, nx)
        end = first + len(slab)
        for layer in range(first // BRICK, (end - 1) // BRICK + 1):
            start = layer * BRICK
            planes = slab[max(start, first) - first : min(start + BRICK, end) - first]
            planes = planes.astype(np.float32) if half else planes
            if layer < z:
                _merge(planes, result[layer])
            if 0 < layer and first <= start:
                _merge(planes[:1], result[layer - 1])  # the plane that two layers share
    return result


def _grouped(ranges: Array, group: int) -> Array:
    """Ranges (bz, by, bx, 2) of boxes of ``group`` bricks an edge."""
    for axis in range(3):
        starts = np.arange(0, ranges.shape[axis], group)
        ends = [u.reduceat(ranges[..., i], starts, axis=axis) for i, u in enumerate((np.fmin, np.fmax))]
        ranges = np.stack(ends, axis=-1)
    return ranges


def _merge(planes: Array, ranges: Array) -> None:
    """Widen the ranges (by, bx, 2) of a layer of bricks by some of its planes (planes, y, x)."""
    found = _reduced(planes, ranges.shape, np.minimum, np.maximum)
    if found.dtype.kind == "f" and np.isnan(found).any():
        found = _reduced(planes, ranges.shape, np.fmin, np.fmax)  # slower, and not poisoned by NaN
    np.fmin(ranges[..., 0], found[..., 0], out=ranges[..., 0])
    np.fmax(ranges[..., 1], found[..., 1], out=ranges[..., 1])


def _reduced(planes: Array, shape: tuple[int, ...], least: np.ufunc, greatest: np.ufunc) -> Array:
    """Least and greatest number of some planes (planes, y, x) in each brick (by, bx, 2) of a layer."""
    y, x, _ = shape
    found = np.empty(shape, planes.dtype)
    for end, ufunc in enumerate((least, greatest)):
        plane = ufunc.reduce(planes, axis=0)
        found[..., end] = _reduce_axis(ufunc, _reduce_axis(ufunc, plane, y).T, x).T
    return found


def _reduce_axis(ufunc: np.ufunc, rows: Array, count: int) -> Array:
    """Reduce the first axis to ``count`` bricks, of which each takes in the first row of the next."""
    rows = np.ascontiguousarray(rows)
    whole = len(rows) // BRICK
    # numpy reduces a short axis in the middle several times as fast as it does with reduceat.
    result: Array = ufunc.reduce(rows[: whole * BRICK].reshape(whole, BRICK, rows.shape[1]), axis=1)
    if whole < count:
        result = np.concatenate([result, ufunc.reduce(rows[whole * BRICK :], axis=0)[None]])
    shared = rows[BRICK::BRICK]
    ufunc(result[: len(shared)], shared, out=result[: len(shared)])
    return result


def unless_most(visible: Flags) -> Flags | None:
    """Visible bricks; None where nearly all are: asking for the others would cost more than they do."""
    return None if visible.mean() > MOSTLY_VISIBLE else visible
