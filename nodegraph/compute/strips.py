"""How long work is cut into pieces that are short enough to cancel between them.

A piece is a strip of full rows (squares cost twice as much on llvmpipe) or, for voxels, a slab of slices.
"""

from __future__ import annotations

import time
from collections.abc import Callable

TARGET_SECONDS = 0.030
# A strip whose cost nobody has measured covers at most this share of the picture: the rows below an empty sky
# may be a hundred times dearer than those above them.
UNKNOWN_SHARE = 16
# How much of the worst rate is kept from draw to draw, so that one slow moment is forgotten in the end.
MEMORY = 0.9

Draw = Callable[[int, int], None]


class Pace:
    """The worst cost of a row-pixel that one kernel variant showed lately; sets the height of the next strip."""

    def __init__(self) -> None:
        self.seconds_per_cell: float | None = None

    def rows(self, cells_per_row: int, total: int, multiple: int) -> int:
        """Return how many rows to draw next: about 30 ms worth, a multiple of ``multiple`` where that is possible."""
        if self.seconds_per_cell is None:
            wanted = max(1, min(total // UNKNOWN_SHARE, 65536 // max(1, cells_per_row)))
        else:
            wanted = max(1, int(TARGET_SECONDS / (self.seconds_per_cell * cells_per_row + 1e-12)))
        if wanted > multiple:
            wanted -= wanted % multiple
        return min(wanted, total)


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

    ``check()`` is called before every strip and may raise Cancelled; ``progress(fraction)`` after it.
    """
    first = 0
    worst = 0.0
    remembered = (pace.seconds_per_cell or 0.0) * MEMORY
    while first < total:
        if check is not None:
            check()
        count = pace.rows(cells_per_row, total, multiple)
        count = min(count, total - first)
        start = time.perf_counter()
        draw(first, count)
        seconds = time.perf_counter() - start
        worst = max(worst, seconds / (count * cells_per_row))
        known = pace.seconds_per_cell
        # Within a draw the rate only grows, and a first guess is corrected by at most a factor of four.
        pace.seconds_per_cell = max(worst, remembered) if known is not None or first else max(worst, 1e-12)
        first += count
        if progress is not None:
            progress(first / total)


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
