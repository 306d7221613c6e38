"""Pictures as points of time and error, and what may be said of two clouds of such points."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.float64]
QUICK = 2
"""Frames of a time that only has to find candidates; what is told is measured again, in turns with the peer."""


@dataclass(frozen=True)
class Point:
    """One way to render a scene.

    seconds: of a frame. rmse, maximum: of linear RGB over black, against the reference.
    """

    settings: Mapping[str, Any]
    seconds: float
    rmse: float
    maximum: float

    @property
    def label(self) -> str:
        """The settings in few words."""
        words = []
        for name, value in self.settings.items():
            shown = f"{value:.3g}" if isinstance(value, float) else str(value)
            words.append(shown if isinstance(value, str) else f"{name} {shown}")
        return ", ".join(words)


def errors(picture: Picture, truth: Picture, bits: int | None = None) -> tuple[float, float]:
    """Root mean square and greatest difference of linear RGB; ``bits``: after rounding to so many bits a channel."""
    if bits is not None:
        levels = float(2**bits - 1)
        picture = np.rint(np.clip(picture, 0.0, 1.0) * levels) / levels
    apart = np.abs(picture - truth)
    return float(np.sqrt(np.mean(apart**2))), float(apart.max())


def timed(action: Callable[[], object]) -> float:
    """Seconds of an action that has run before: the least of few."""
    taken = []
    for _ in range(QUICK):
        start = time.perf_counter()
        action()
        taken.append(time.perf_counter() - start)
    return min(taken)


def front(points: Iterable[Point]) -> list[Point]:
    """The points that no other beats in both time and error, from the quickest to the most accurate."""
    from nodegraph.accuracy.front import pareto

    found = list(points)
    kept = pareto([point.seconds for point in found], [point.rmse for point in found])
    return sorted((p for p, keep in zip(found, kept, strict=True) if keep), key=lambda point: point.seconds)


def cheapest(points: Iterable[Point], rmse: float, count: int = 1) -> list[Point]:
    """The quickest points whose error is at most ``rmse``, quickest first."""
    return sorted((point for point in points if point.rmse <= rmse), key=lambda point: point.seconds)[:count]


def advantage(ours: Sequence[Point], theirs: Sequence[Point]) -> float:
    """The least factor by which we are faster, over all of their points, at no larger error; 0 where we cannot be.

    Above 1 our front lies below theirs at every error that they reach.
    """
    factors = []
    for their in theirs:
        best = cheapest(ours, their.rmse)
        factors.append(their.seconds / best[0].seconds if best else 0.0)
    return min(factors, default=math.nan)
