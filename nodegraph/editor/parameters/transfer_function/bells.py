"""Bells: Gaussian bumps of extinction on top of the keys of a transfer function, written into the document as keys.

The engine knows keys only, and its tables, pair tables and the breaks of its integrators rely on that. So a bell is
what the editor remembers; the document has keys that follow it within `TOLERANCE` of its peak.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.numbers import number, numbers
from nodegraph.data.transfer_function import MAX_OPACITY, Key, TransferFunction
from nodegraph.errors import ParameterError

TOLERANCE = 1e-3
"""What the keys may miss of the extinction, and of extinction times colour, as a part of the highest bell there."""
REACH = 4.0
"""Widths from the centre at which a bell ends: 3.4e-4 of its peak is cut there, which `TOLERANCE` includes."""
_GRID = 192  #: samples between two marks on which the error is measured
_LEAST = 1e-9  #: the least width, as a part of the value's own size

Rows = NDArray[np.float64]
Color = tuple[float, float, float]


class Bell(NamedTuple):
    """Extinction ``peak * exp(-((value - center) / width)^2 / 2)``, where the peak hides ``opacity``.

    width: the standard deviation, in the unit of the values. color: linear RGB.
    """

    center: float
    width: float
    opacity: float
    color: Color

    @property
    def low(self) -> float:
        return self.center - REACH * self.width

    @property
    def high(self) -> float:
        return self.center + REACH * self.width


@dataclass(frozen=True)
class Shape:
    """What the user draws: keys, and bells that are added to them. ``function`` is what the document gets."""

    base: TransferFunction = field(default_factory=TransferFunction)
    bells: tuple[Bell, ...] = ()

    @property
    def function(self) -> TransferFunction:
        return compose(self.base, self.bells)

    def with_base(self, base: TransferFunction) -> Shape:
        return Shape(base, self.bells)

    def with_bell(self, place: int, bell: Bell | None) -> Shape:
        """Put a bell at a place, one more at the end, or with None take it away."""
        put = (*self.bells[:place], *([bell] if bell is not None else []), *self.bells[place + 1 :])
        return Shape(self.base, put)

    def to_json(self) -> dict[str, Any]:
        bells = [[bell.center, bell.width, bell.opacity, list(bell.color)] for bell in self.bells]
        return {"base": self.base.to_json(), "bells": bells}

    @classmethod
    def from_json(cls, json: Any) -> Shape:
        """Raises ParameterError, TypeError, KeyError or ValueError for what `to_json` did not write."""
        base = TransferFunction.from_json(json["base"])
        return cls(base, tuple(checked(*one) for one in json["bells"]))


def checked(center: Any, width: Any, opacity: Any, color: Any) -> Bell:
    """A bell of numbers that make sense. Raises ParameterError."""
    middle, sigma, up = number(center, "bell.center"), number(width, "bell.width"), number(opacity, "bell.opacity")
    red, green, blue = numbers(color, 3, "bell.color")
    if not math.isfinite(middle) or not math.isfinite(sigma) or sigma < least_width(middle):
        raise ParameterError(f"bell: expected a finite centre and a width above 0, got {middle:g} and {sigma:g}")
    if not 0.0 <= up <= 1.0 or not min(red, green, blue) >= 0.0:
        raise ParameterError("bell: expected an opacity in 0..1 and colours of at least 0")
    return Bell(middle, sigma, up, (red, green, blue))


def least_width(center: float) -> float:
    """The least width of a bell at a centre that numbers can tell from none."""
    return _LEAST * max(abs(center), 1e-3)


@functools.lru_cache(maxsize=64)
def compose(base: TransferFunction, bells: tuple[Bell, ...]) -> TransferFunction:
    """Keys that follow a function with bells on it.

    Extinctions add up, to that of an opacity of 1 at most; the colour is their mean, weighted by extinction. Keys stand
    where the keys of the base, the centres and the ends of the bells are, and between these as close as curvature
    demands.
    """
    if not bells:
        return base
    marks = sorted({key.value for key in base.keys} | {place for b in bells for place in (b.low, b.center, b.high)})
    pieces = [
        _piece(base, tuple(b for b in bells if b.low <= low and high <= b.high), low, high)
        for low, high in itertools.pairwise(marks)
    ]
    outside = [_end(base, marks[0], -math.inf), _end(base, marks[-1], math.inf)]
    peak = max(float(base.extinction(bell.opacity)) for bell in bells)
    rows: list[Rows] = []
    for left, right in itertools.pairwise([outside[0], *pieces, outside[1]]):
        rows += _seam(left, right, peak)
        rows += list(right[1:-1])
    return TransferFunction([_key(row, base.reference_length) for row in rows], base.reference_length)


def _sum(base_ends: Rows, bells: Sequence[tuple[Bell, float]], x: Rows, low: float, high: float) -> Rows:
    """Value, extinction times colour and extinction at places from low to high, (n, 5)."""
    share = ((x - low) / (high - low))[:, None]
    flat = base_ends[0] * (1.0 - share) + base_ends[1] * share
    rows = np.column_stack([x, flat[:, :3] * flat[:, 3:], flat[:, 3]])
    for bell, peak in bells:
        up = peak * np.exp(-0.5 * ((x - bell.center) / bell.width) ** 2)
        up[(x <= bell.low) | (x >= bell.high)] = 0.0
        rows[:, 1:4] += up[:, None] * np.asarray(bell.color)
        rows[:, 4] += up
    return rows


@functools.lru_cache(maxsize=256)  # while one bell is dragged, what the others do elsewhere stays
def _piece(base: TransferFunction, bells: tuple[Bell, ...], low: float, high: float) -> Rows:
    """Keys from mark to mark, ends included: value, linear RGB, extinction, (n, 5). All bells reach over all of it."""
    ends = base.evaluate([low, np.nextafter(high, low)])
    active = [(bell, float(base.extinction(bell.opacity))) for bell in bells]
    if not any(peak > 0.0 for _, peak in active):
        return np.column_stack([[low, high], ends])
    x = low + (high - low) * np.linspace(0.0, 1.0, _GRID + 1)
    x[-1] = high
    true = _sum(ends, active, x, low, high)
    colors = _colors(true)
    allowed = TOLERANCE * max(peak for _, peak in active)
    bend = np.abs(np.diff(true[:, 1:], 2, axis=0)).max(axis=1)
    strain = np.concatenate([[0.0], np.cumsum(np.sqrt(np.concatenate([bend[:1], bend])))])
    count = max(1, math.ceil(strain[-1] / math.sqrt(8.0 * allowed)))
    while True:
        knots = np.unique(np.rint(np.interp(np.linspace(0.0, strain[-1], count + 1), strain, range(_GRID + 1))))
        knots = knots.astype(int)
        knots[0], knots[-1] = 0, _GRID
        if count >= _GRID or _error(true, colors, knots) <= allowed:
            break
        count = min(_GRID, math.ceil(count * 1.1) + 1)
    return np.column_stack([x[knots], colors[knots], true[knots, 4]])


def _colors(rows: Rows) -> Rows:
    """Colours of sums, (n, 3); where nothing is seen, that of the nearest place where something is."""
    seen = np.flatnonzero(rows[:, 4] > 0.0)
    colors = np.zeros((len(rows), 3))
    colors[seen] = rows[seen, 1:4] / rows[seen, 4:]
    places = np.arange(len(rows))
    nearest = seen[np.clip(np.searchsorted(seen, places), 0, len(seen) - 1)]
    return np.asarray(colors[np.where(rows[:, 4] > 0.0, places, nearest)])


def _error(true: Rows, colors: Rows, knots: NDArray[np.int64]) -> float:
    """The most that keys at some samples miss of extinction, and of extinction times colour."""
    x, at = true[:, 0], true[knots, 0]
    up = np.interp(x, at, true[knots, 4])
    worst = float(np.abs(up - true[:, 4]).max())
    for channel in range(3):
        made = np.interp(x, at, colors[knots, channel]) * up
        worst = max(worst, float(np.abs(made - true[:, 1 + channel]).max()))
    return worst


def _end(base: TransferFunction, mark: float, side: float) -> Rows:
    """Beyond the last mark the base goes on as it is: two equal rows, (2, 5)."""
    row = base.evaluate([np.nextafter(mark, side)])[0]
    return np.array([[mark, *row], [mark, *row]])


def _seam(left: Rows, right: Rows, peak: float) -> list[Rows]:
    """The key between two pieces, or both sides of a step."""
    a, b = left[-1], right[0]
    if abs(a[4] - b[4]) <= 1e-9 * peak:
        if np.abs(a[1:4] - b[1:4]).max() <= 1e-6 or not right[:, 4].any():
            return [a]
        if not left[:, 4].any():
            return [b]
    return [a, b]


def _key(row: Rows, reference_length: float) -> Key:
    red, green, blue = (round(float(part), 6) for part in row[1:4])
    opacity = min(MAX_OPACITY, -math.expm1(-float(row[4]) * reference_length))
    return Key(float(row[0]), (red, green, blue), max(0.0, opacity))
