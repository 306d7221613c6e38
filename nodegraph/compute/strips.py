"""How long work is cut into pieces that are short enough to cancel between them.

A piece is a strip of full rows (squares cost twice as much on llvmpipe); voxels are a stack of slices of rows. Where
the least strip would take far too long, it is cut into columns too.
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
FREE_RATE = TARGET_SECONDS / FREE_CELLS
"""Seconds that such a cell is taken for."""
LEAST_RATE = 0.1 * FREE_RATE
"""Seconds that the next cell is taken for at least: a cheap sky says little of what is below."""
START_SECONDS = 0.0004
"""What starting and awaiting a strip costs by itself; without it tiny pictures would look dear."""

LONG_SECONDS = 0.06
"""What the least strip may take before it is cut into columns."""

Draw = Callable[..., None]
"""``draw(first, count)`` for full rows, ``draw(first, count, x, columns)`` for a part of them."""


class Pace:
    """What each band of a kernel variant's last draw cost, seconds per cell and work; None before it ever ran."""

    def __init__(self) -> None:
        self.bands: NDArray[np.float64] | None = None


def run_in_strips(
    draw: Draw,
    total: int,
    cells_per_row: int,
    pace: Pace,
    *,
    work: float = 1.0,
    multiple: int = 1,
    least_columns: int = 0,
    check: Callable[[], None] | None = None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Call ``draw(first, count)``, which must return when the work is done, until ``total`` rows are covered.

    Heights are chosen to take about 30 ms by what the last draw cost in the same place. Strips start at multiples
    of ``multiple`` rows where they can. ``work`` tells how dear a cell is in this draw, beside others of the same
    kernel (1: nothing out of the ordinary). Strips are cut into multiples of ``least_columns`` columns, 0 for never,
    where they must. ``check()`` is called before every strip or part and may raise Cancelled; ``progress(fraction)``
    after a strip.
    """
    columns = cells_per_row
    cost_per_row = cells_per_row * work
    rows = np.arange(total)
    # Seconds that the rows before this one took in the last draw.
    before = None
    if pace.bands is not None:
        before = np.concatenate([[0.0], np.cumsum(pace.bands[rows * BANDS // total] * cost_per_row)])
    measured = np.empty(total)
    free = max(1, int(FREE_CELLS / cost_per_row))
    first, count, ratio, rate = 0, free, 1.0, 0.0
    while first < total:
        if check is not None:
            check()
        if before is not None:
            count = int(np.searchsorted(before, before[first] + TARGET_SECONDS / ratio, "right")) - 1 - first
        elif first:
            # Nothing is known of the rows ahead: grow slowly, and never far.
            most = min(2 * count, max(free, total // 16))
            count = min(most, int(TARGET_SECONDS / (max(rate, LEAST_RATE) * cost_per_row)))
        count = min(_rounded(count, first, multiple), total - first)
        if before is not None:
            likely = float(before[first + count] - before[first]) * ratio
        else:
            # Of an unknown kernel the free cells are taken for a strip.
            likely = count * cost_per_row * (max(rate, LEAST_RATE) if first else FREE_RATE)
        start = time.perf_counter()
        if likely > LONG_SECONDS and 0 < least_columns < columns:
            seconds = _draw_parts(draw, first, count, columns, least_columns, likely / columns, check)
        else:
            draw(first, count)
            seconds = max(0.0, time.perf_counter() - start - START_SECONDS)
        rate = seconds / (count * cost_per_row)
        measured[first : first + count] = rate
        if before is not None:
            # A changed parameter may make the whole draw dearer than the last one; the latest strip tells.
            expected = float(before[first + count] - before[first])
            ratio = min(8.0, max(0.5, (seconds + 0.002) / (expected + 0.002)))
        first += count
        if progress is not None:
            progress(first / total)
    pace.bands = measured[(np.arange(BANDS) * total + total // 2) // BANDS]


def _draw_parts(
    draw: Draw, first: int, count: int, columns: int, least: int, likely: float, check: Callable[[], None] | None
) -> float:
    """Draw a strip in parts of about 30 ms, as wide as ``likely`` seconds per column and then the parts tell."""
    x, total, width = 0, 0.0, columns
    while x < columns:
        if check is not None and x:
            check()
        most = int(TARGET_SECONDS / (likely + 1e-12))
        width = min(max(least, min(most, width) // least * least), columns - x)
        start = time.perf_counter()
        draw(first, count, x, width)
        seconds = max(0.0, time.perf_counter() - start - START_SECONDS)
        total += seconds
        # The next columns may be dearer: never more than four times as wide.
        likely, width, x = seconds / width, 4 * width, x + width
    return total


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
