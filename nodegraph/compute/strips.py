"""How long work is cut into pieces that are short enough to cancel between them.

A piece is a strip of full rows (squares cost twice as much on llvmpipe); voxels are a stack of slices of rows.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

TARGET_SECONDS = 0.030
BANDS = 64
"""Parts of a picture, from top to bottom, whose costs are remembered apart: a sky is cheaper than what is below."""
FREE_CELLS = 16384
"""So many cells (pixels, voxels) are drawn at once before anything is known of a kernel's cost."""
START_SECONDS = 0.0004
"""What starting and awaiting a strip costs by itself; without it tiny pictures would look dear."""

Draw = Callable[[int, int], None]


class Pace:
    """What each band of a kernel variant's last draw cost, seconds per cell; None before it ever ran."""

    def __init__(self) -> None:
        self.bands: NDArray[np.float64] | None = None


def run_in_strips(
    draw: Draw,
    total: int,
    cells_per_row: int,
    pace: Pace,
    *,
    multiple: int = 1,
    check: Callable[[], None] | None = None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Call ``draw(first, count)``, which must return when the work is done, until ``total`` rows are covered.

    Heights are chosen to take about 30 ms by what the last draw cost in the same place. Strips start at multiples
    of ``multiple`` rows where they can. ``check()`` is called before every strip and may raise Cancelled;
    ``progress(fraction)`` after it.
    """
    rows = np.arange(total)
    # Seconds that the rows before this one took in the last draw.
    before = None
    if pace.bands is not None:
        before = np.concatenate([[0.0], np.cumsum(pace.bands[rows * BANDS // total] * cells_per_row)])
    measured = np.empty(total)
    free = max(1, FREE_CELLS // cells_per_row)
    first, count, ratio, rate = 0, free, 1.0, 0.0
    while first < total:
        if check is not None:
            check()
        if before is not None:
            count = int(np.searchsorted(before, before[first] + TARGET_SECONDS / ratio, "right")) - 1 - first
        elif first:
            # Nothing is known of the rows ahead: grow slowly, and never far.
            most = min(2 * count, max(free, total // 16))
            count = min(most, int(TARGET_SECONDS / (rate * cells_per_row + 1e-12)))
        count = min(_rounded(count, first, multiple), total - first)
        start = time.perf_counter()
        draw(first, count)
        seconds = max(0.0, time.perf_counter() - start - START_SECONDS)
        rate = seconds / (count * cells_per_row)
        measured[first : first + count] = rate
        if before is not None:
            # A changed parameter may make the whole draw dearer than the last one; the latest strip tells.
            expected = float(before[first + count] - before[first])
            ratio = min(8.0, max(0.5, (seconds + 0.002) / (expected + 0.002)))
        first += count
        if progress is not None:
            progress(first / total)
    pace.bands = measured[(np.arange(BANDS) * total + total // 2) // BANDS]


def _rounded(count: int, first: int, multiple: int) -> int:
    """Round a height so that strips start and end at multiples of ``multiple`` where that takes at most 48 ms."""
    to_boundary = multiple - first % multiple
    if to_boundary == multiple and count * 8 >= multiple * 5:
        return max(multiple, count - count % multiple)
    # Slivers of tiles cost several times as much for each row, and would then be taken for what the rows cost. So a
    # quarter of a tile is the least up to about 100 ms; beyond that, what llvmpipe shades as one block: 4 rows.
    part = max(1, multiple // 4 if count * 64 >= multiple * 5 else multiple // 16)
    count = max(part, count - count % part)
    return count if multiple == 1 else min(count, to_boundary)


def boxes(first: int, count: int, height: int) -> list[tuple[int, int, int, int]]:
    """Split rows ``first .. first + count`` of a stack of slices into boxes (y, rows, z, slices).

    Rows run through all slices in order; a picture is one slice. At most three boxes come out: the rest of a
    slice, whole slices, the start of another.
    """
    found = []
    end = first + count
    if first % height:
        rows = min(height - first % height, count)
        found.append((first % height, rows, first // height, 1))
        first += rows
    slices = (end - first) // height
    if slices:
        found.append((0, height, first // height, slices))
        first += slices * height
    if first < end:
        found.append((0, end - first, first // height, 1))
    return found
