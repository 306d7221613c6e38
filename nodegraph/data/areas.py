"""A transfer function of value and gradient magnitude as its areas, for kernels that read no table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

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


def _inverse(width: float) -> float:
    return 1.0 / max(width, LEAST)
