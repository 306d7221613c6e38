"""How long work is cut into pieces that are short enough to cancel between them.

A piece is a strip of full rows (squares cost twice as much on llvmpipe) or, for voxels, a slab of slices.
"""

from __future__ import annotations

import time
from collections.abc import Callable

TARGET_SECONDS = 0.030
# Strips of a variant that never ran before cover at most this share of the picture, whatever they cost: the rows
# below an empty sky may be a hundred times dearer than those above them. Below FREE_CELLS nobody counts.
UNKNOWN_SHARE = 16
FREE_CELLS = 16384
# How much of the worst rate is kept from draw to draw, so that one slow moment is forgotten in the end.
KEPT = 0.9
# What starting and awaiting a strip costs by itself; without it tiny pictures would look dear.
START_SECONDS = 0.0004

Draw = Callable[[int, int], None]


class Pace:
    """The worst cost of a cell (pixel, voxel) that one kernel variant showed lately; None before it ever ran."""

    def __init__(self) -> None:
        self.seconds_per_cell: float | None = None


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

    Heights are chosen to take about 30 ms, in multiples of ``multiple`` rows where that is possible. ``check()`` is
    called before every strip and may raise Cancelled; ``progress(fraction)`` after it.
    """
    known = pace.seconds_per_cell is not None
    floor = (pace.seconds_per_cell or 0.0) * KEPT
    rate = pace.seconds_per_cell or 0.0
    most = total if known else max(1, total // UNKNOWN_SHARE, FREE_CELLS // cells_per_row)
    first = 0
    while first < total:
        if check is not None:
            check()
        count = max(1, int(min(most, TARGET_SECONDS / (rate * cells_per_row + 1e-12))))
        if count > multiple:
            count -= count % multiple
        count = min(count, total - first)
        start = time.perf_counter()
        draw(first, count)
        seconds = max(0.0, time.perf_counter() - start - START_SECONDS)
        floor = max(floor, seconds / (count * cells_per_row))
        rate = max(rate, floor)
        first += count
        if progress is not None:
            progress(first / total)
    pace.seconds_per_cell = floor


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
