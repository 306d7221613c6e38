"""A transfer function as bands of values in which it is linear, for kernels that read no table at even places."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.transfer_function import TransferFunction

FARTHEST = 3e38
"""Beyond any value that single precision holds."""


def bands(function: TransferFunction, level: float = 0.0) -> tuple[NDArray[np.float64], int]:
    """(4 n, 4) rows and the number of steps, s, of a search: n = 2^s + 1 bands, the last of them empty.

    A band has four rows: linear RGB and extinction per mm at its first and at its last value; the integral of (colour
    times extinction, extinction) over all bands before it, exactly; and its two ends, values less ``level``, with how
    far the matter jumps at each (the most of colour times extinction and extinction). The first band is all below the
    first key, and one is all above the last key: there the outermost keys go on.
    """
    keys = function.keys
    colors = np.array([[*key.color, float(function.extinction(key.opacity))] for key in keys] or [[0.0] * 4])
    values = np.array([key.value for key in keys] or [0.0]) - level
    # Between two keys, but for those that make a step, which take no room.
    between = [i for i in range(len(values) - 1) if values[i + 1] > values[i]]
    near = colors[[0, *between, -1]]
    far = colors[[0, *(i + 1 for i in between), -1]]
    start = values[[0, *between, -1]]
    end = values[[0, *(i + 1 for i in between), -1]]
    steps = max(1, int(np.ceil(np.log2(len(start)))))
    count = 2**steps + 1
    rows = np.zeros((count, 4, 4))
    rows[:, 3, :2] = FARTHEST
    rows[: len(start), 0], rows[: len(start), 1] = near, far
    rows[: len(start), 3, 0], rows[: len(start), 3, 1] = start, end
    width = (end - start)[:, None]
    light = (near[:, :3] * (2 * near[:, 3:] + far[:, 3:]) + far[:, :3] * (near[:, 3:] + 2 * far[:, 3:])) / 6
    within = width * np.concatenate([light, 0.5 * (near[:, 3:] + far[:, 3:])], axis=1)
    light_at = [np.concatenate([end[:, :3] * end[:, 3:], end[:, 3:]], axis=1) for end in (near, far)]
    jumps = np.abs(light_at[0][1:] - light_at[1][:-1]).max(axis=1, initial=0.0)
    rows[1 : len(start), 3, 2], rows[: len(start) - 1, 3, 3] = jumps, jumps
    rows[1 : len(start) + 1, 2] = np.minimum(np.cumsum(within, axis=0), FARTHEST)
    return rows.reshape(-1, 4), steps
