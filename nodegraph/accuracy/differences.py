"""How far two arrays of numbers lie apart: greatest, root mean square, 99.9 percentile."""

from __future__ import annotations

import math

import numpy as np

from nodegraph.data.buffer import Array


def distance(value: Array, reference: Array) -> Array:
    """|value - reference| in float64, element by element.

    What is not finite counts as equal to its like only: inf and inf, nan and nan are 0 apart, anything else and nan is
    infinitely far away. So a hole in a result is the greatest of errors and never a nan that compares as no error.
    """
    a, b = np.asarray(value, np.float64), np.asarray(reference, np.float64)
    with np.errstate(invalid="ignore", over="ignore"):
        apart: Array = np.abs(a - b)
    odd = np.isnan(apart)
    if odd.any():
        alike = (a == b) | (np.isnan(a) & np.isnan(b))
        apart = np.where(odd, np.where(alike, 0.0, np.inf), apart)
    return apart


class Differences:
    """Statistics of distances that come in portions, so that nothing as large as a volume is kept.

    A place (a pixel, a voxel) may hold several numbers; the greatest distance at a place is what `max` and `p999`
    look at, `rmse` looks at every number. Where there is no place at all, everything is nan: nothing was compared.
    """

    def __init__(self, places: int) -> None:
        self.places = places
        # The 99.9 percentile is the least of so many greatest: the smallest distance that 99.9 % do not exceed.
        self._kept = places - (999 * places + 999) // 1000 + 1
        self._greatest = np.zeros(0)
        self._squares = 0.0
        self._numbers = 0

    def add(self, distances: Array) -> None:
        """Count distances (n, c): c numbers at each of n places."""
        if not distances.size:
            return
        with np.errstate(over="ignore"):
            self._squares += float(np.sum(distances * distances))
        self._numbers += distances.size
        here = np.concatenate([self._greatest, distances.max(axis=1)])
        if len(here) > self._kept:
            here = np.partition(here, len(here) - self._kept)[-self._kept :]
        self._greatest = here

    @property
    def max(self) -> float:
        """The greatest distance."""
        return float(self._greatest.max()) if self._numbers else math.nan

    @property
    def rmse(self) -> float:
        """Root of the mean square."""
        return math.sqrt(self._squares / self._numbers) if self._numbers else math.nan

    @property
    def p999(self) -> float:
        """The least distance that 99.9 % of the places do not exceed."""
        return float(self._greatest.min()) if self._numbers else math.nan

    def psnr(self, peak: float) -> float:
        """Peak signal to noise ratio, 20 log10(peak / rmse), dB; inf where nothing differs."""
        rmse = self.rmse
        if math.isnan(rmse):
            return math.nan
        if rmse == 0.0:
            return math.inf
        return -math.inf if peak <= 0.0 or math.isinf(rmse) else 20.0 * math.log10(peak / rmse)
