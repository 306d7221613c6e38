"""Places that a drag catches on: round numbers, peaks of the histogram, keys of this and of other functions."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from nodegraph.editor.parameters.transfer_function.histogram import Histogram

REACH = 5.0
"""Pixels from which a place catches."""


@dataclass(frozen=True)
class Catch:
    """A place on an axis, and what is there."""

    place: float
    what: str


def nearest(at: float, catches: Iterable[Catch], reach: float) -> Catch | None:
    """The nearest catch within reach; of equally near ones the first."""
    best: Catch | None = None
    for catch in catches:
        distance = abs(catch.place - at)
        if distance <= reach and (best is None or distance < abs(best.place - at)):
            best = catch
    return best


@functools.lru_cache(maxsize=4)
def peaks(histogram: Histogram, most: int = 12) -> tuple[float, ...]:
    """Values at which a histogram has peaks, the most frequent first.

    A peak is the highest bin of a neighbourhood of a sixtieth of the range on either side, after smoothing, and
    rises, as the logarithm shows it, by a twentieth of the highest above the valleys towards higher ground.
    """
    counts = histogram.counts.astype(np.float64)
    bins = len(counts)
    if bins < 5 or not counts.any():
        return ()
    logs = np.log1p(counts)
    reach = max(1, bins // 60)
    width = max(1, reach // 2)
    smooth = np.convolve(np.pad(logs, width, mode="edge"), np.full(2 * width + 1, 1.0 / (2 * width + 1)), "valid")
    found: list[tuple[float, int]] = []
    top = float(smooth.max())
    for place in map(int, np.flatnonzero(smooth > 0.1 * top)):
        low, high = max(0, place - reach), min(bins, place + reach + 1)
        if smooth[place] < smooth[low:high].max() or place in (0, bins - 1):
            continue
        if _rise(smooth, place) >= 0.05 * top:
            peak = low + int(np.argmax(logs[low:high]))
            found.append((float(counts[peak]), peak))
    size = (histogram.high - histogram.low) / bins
    best = sorted(set(found), reverse=True)[:most]
    return tuple(histogram.low + (place + 0.5) * size for _, place in best)


def _rise(heights: np.ndarray, place: int) -> float:
    """How far a peak stands above the higher of its two valleys: its prominence."""
    top = heights[place]
    valleys = []
    for side in (heights[:place][::-1], heights[place + 1 :]):
        higher = np.flatnonzero(side > top)
        reach = side[: higher[0] + 1] if len(higher) else side
        valleys.append(float(reach.min()) if len(reach) else 0.0)
    return float(top - max(valleys))
