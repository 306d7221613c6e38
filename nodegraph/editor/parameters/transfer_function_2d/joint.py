"""How often values and gradient magnitudes occur together in a volume."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nodegraph.data import Volume
from nodegraph.editor.parameters.transfer_function.histogram import Crop, stored_bins, voxels

COLUMNS, ROWS = 256, 256
Place = tuple[int, ...]


@dataclass(frozen=True)
class JointHistogram:
    """counts: (rows, columns), columns over the values low..high, rows over the magnitudes 0..top, ends included.

    unit: of the values; magnitudes are in it per mm.
    """

    counts: NDArray[np.int64]
    low: float
    high: float
    top: float
    unit: str = ""

    def usual(self, outliers: float = 1e-4, steepest: float = 1e-3) -> tuple[float, float, float]:
        """The values without the rarest at either end, and the greatest magnitude without the ``steepest`` share."""
        total = int(self.counts.sum())
        if not total:
            return self.low, self.high, self.top
        across, along = np.cumsum(self.counts.sum(axis=0)) / total, np.cumsum(self.counts.sum(axis=1)) / total
        rows, columns = self.counts.shape
        width = (self.high - self.low) / columns
        first = int(np.searchsorted(across, outliers, side="right"))
        last = int(np.searchsorted(across, 1.0 - outliers, side="left"))
        highest = int(np.searchsorted(along, 1.0 - steepest, side="left"))
        return self.low + first * width, self.low + (last + 1) * width, self.top * (highest + 1) / rows

    @property
    def unit_per_mm(self) -> str:
        """The unit of the magnitudes."""
        return f"{self.unit}/mm" if self.unit else "1/mm"


def count(volume: Volume, crop: Crop | None = None, columns: int = COLUMNS, rows: int = ROWS) -> JointHistogram:
    """Count the voxels of a volume (the first of several components), or of a part of it, by value and gradient.

    Differences are those of the ray-caster: over two voxels, the edge repeated. Three planes are kept of what is read.
    The range of the magnitudes doubles, and two rows become one, as often as a magnitude lies above it.
    """
    scale, offset, unit = volume.mapping
    volume = volume.component(0)
    columns, (first, last) = stored_bins(volume, columns)
    low, high = ((0, 0, 0), volume.dims) if crop is None else voxels(crop, volume.dims)
    linear = volume.world_to_index[:3, :3]
    metric = linear @ linear.T  # squared length per mm of a gradient per index unit
    counts = np.zeros((rows, columns), np.int64)
    top = 0.0
    for before, here, after in _with_neighbours(volume, low, high):
        with np.errstate(invalid="ignore", over="ignore"):  # beside voxels that are not finite
            slopes = (_difference(here, 1), _difference(here, 0), 0.5 * (after - before))
            squares = sum(
                (metric[i, j] * (1.0 if i == j else 2.0)) * slopes[i] * slopes[j]
                for i in range(3) for j in range(i, 3) if metric[i, j] != 0.0
            )  # fmt: skip
            magnitudes = np.sqrt(np.maximum(squares, 0.0)) * abs(scale)
        part = slice(low[1], high[1]), slice(low[0], high[0])
        here, magnitudes = here[part], magnitudes[part]
        finite = np.isfinite(magnitudes) & np.isfinite(here)
        values, magnitudes = here[finite], magnitudes[finite]
        if not len(values):
            continue
        greatest = float(magnitudes.max())
        top = top or 2.0 * greatest
        while greatest > top:
            counts = np.concatenate([counts.reshape(rows // 2, 2, columns).sum(axis=1), np.zeros_like(counts)])[:rows]
            top *= 2.0
        column = np.clip((values - first) * (columns / (last - first)), 0, columns - 1).astype(np.int32)
        row = np.minimum(magnitudes * (rows / top if top > 0.0 else 0.0), rows - 1).astype(np.int32)
        counts += np.bincount(row * columns + column, minlength=rows * columns).reshape(rows, columns)
    ends = (first * scale + offset, last * scale + offset)
    return JointHistogram(counts[:, ::-1] if scale < 0 else counts, min(ends), max(ends), top or 1.0, unit)


def _with_neighbours(volume: Volume, low: Place, high: Place) -> Iterator[tuple[NDArray[np.float64], ...]]:
    """Each plane (y, x) of stored numbers from low to high, between its neighbours; the edge repeats."""
    before = here = None
    x, y, z = volume.dims
    first, end = max(low[2] - 1, 0), min(high[2] + 1, z)
    place = first - 1  # of `here`
    for _, slab in volume.part((0, 0, first), (x, y, end)).buffer.slabs():
        for plane in slab.reshape(-1, y, x):
            after = plane.astype(np.float64)
            if here is not None and place >= low[2]:
                yield here if before is None else before, here, after
            before, here, place = here, after, place + 1
    if here is not None and place < high[2]:
        yield here if before is None else before, here, here


def _difference(plane: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Half of the difference between the neighbours along an axis of a plane; the edge repeats."""
    padded = np.pad(plane, [(1, 1) if own == axis else (0, 0) for own in range(2)], mode="edge")
    n = plane.shape[axis]
    return 0.5 * (padded.take(range(2, n + 2), axis) - padded.take(range(n), axis))
