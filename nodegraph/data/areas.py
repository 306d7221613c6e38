"""A transfer function of value and gradient magnitude as its areas, for kernels that read no table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.bricks import Flags
from nodegraph.data.buffer import Array
from nodegraph.data.transfer_function_2d import LEAST, Gaussian, TransferFunction2D


def areas(function: TransferFunction2D, level: float = 0.0) -> NDArray[np.float64]:
    """(4 n, 4) rows, four for each area, values less ``level``; one that is nowhere where there are none.

    1. Linear RGB and extinction per mm. 2. Least and greatest value, least and greatest magnitude. 3. Ends of the
    bottom and of the top; of a Gaussian its middle, and one over its standard deviations. 4. Magnitude of the bottom,
    one over the height, softness (-1: a Gaussian), and 1 where the bottom may be soft.
    """
    rows = np.zeros((max(len(function.areas), 1), 4, 4))
    rows[:, 1] = (0.0, 0.0, -1.0, -1.0)
    for row, area in zip(rows, function.areas, strict=False):
        (low, high), magnitudes = area.bounds
        row[0] = (*area.color, function.extinction(area.opacity))
        row[1] = (low - level, high - level, *magnitudes)
        if isinstance(area, Gaussian):
            row[2] = (area.center[0] - level, area.center[1], *(_inverse(sigma) for sigma in area.sigma))
            row[3] = (0.0, 0.0, -1.0, 0.0)
        else:
            least, greatest = magnitudes
            row[2] = (*(value - level for value in (*area.bottom, *area.top)),)
            row[3] = (least, _inverse(greatest - least), area.softness, float(least > 0.0))
    return rows.reshape(-1, 4)


def visible_by_areas(ranges: Array, function: TransferFunction2D, threshold: float = 0.0) -> Flags:
    """True for the bricks (bz, by, bx) in which a value may have an extinction above ``threshold`` per mm.

    By the areas themselves and not by a table, at whichever magnitude: ``ranges`` are those of
    `nodegraph.data.bricks.brick_ranges`, which say nothing of gradients.
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


def _inverse(width: float) -> float:
    return 1.0 / max(width, LEAST)
