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
MEASURED = 0.85
"""Part of `TOLERANCE` that is allowed at the samples: between them the curve bends a little more."""
_GRID = 128  #: parts between two marks, at whose ends the error is measured
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
    marks = np.array(sorted({k.value for k in base.keys} | {at for b in bells for at in (b.low, b.center, b.high)}))
    peaks = [float(base.extinction(bell.opacity)) for bell in bells]
    pieces = _pieces(base, bells, peaks, marks)
    outside = [_end(base, marks[0], -math.inf), _end(base, marks[-1], math.inf)]
    rows: list[Rows] = []
    for left, right in itertools.pairwise([outside[0], *pieces, outside[1]]):
        rows += _seam(left, right, max(peaks))
        rows += list(right[1:-1])
    return TransferFunction([_key(row, base.reference_length) for row in rows], base.reference_length)


def _pieces(base: TransferFunction, bells: Sequence[Bell], peaks: Sequence[float], marks: Rows) -> list[Rows]:
    """Keys from mark to mark, ends included: value, linear RGB, extinction, each (n, 5).

    All pieces are sampled at once, and get more keys until each is near enough.
    """
    low, high = marks[:-1], marks[1:]
    reach = np.array([[b.low <= a and c <= b.high for b in bells] for a, c in zip(low, high, strict=True)])
    allowed = MEASURED * TOLERANCE * (reach * np.asarray(peaks)).max(axis=1)
    true = _samples(base, bells, peaks, low, high)
    colors = _colors(true)
    bend = np.zeros(true.shape[:2])
    bend[:, 1:-1] = np.abs(np.diff(true[..., 1:], 2, axis=1)).max(axis=2)
    bend[:, 0], bend[:, -1] = bend[:, 1], bend[:, -2]
    strain = np.cumsum(np.sqrt(bend), axis=1)
    strain -= strain[:, :1]
    counts = np.ones(len(low), int)
    wrong = np.flatnonzero(allowed > 0.0)
    counts[wrong] = np.maximum(1, np.ceil(strain[wrong, -1] / np.sqrt(8.0 * allowed[wrong])))
    knots = [np.array([0, _GRID])] * len(low)
    while len(wrong):
        for piece in wrong:
            knots[piece] = _knots(strain[piece], int(counts[piece]))
        errors = _errors(true[wrong], colors[wrong], [knots[piece] for piece in wrong])
        still = (errors > allowed[wrong]) & (counts[wrong] < _GRID)
        # The error falls with the square of the count.
        more = np.sqrt(errors[still] / allowed[wrong[still]])
        wrong = wrong[still]
        counts[wrong] = np.minimum(_GRID, np.ceil(counts[wrong] * np.maximum(more, 1.02)) + 1)
    return [
        np.column_stack([true[piece, at, 0], colors[piece, at], true[piece, at, 4]]) for piece, at in enumerate(knots)
    ]


def _samples(base: TransferFunction, bells: Sequence[Bell], peaks: Sequence[float], low: Rows, high: Rows) -> Rows:
    """Value, extinction times colour, extinction at the samples of each piece, (pieces, samples, 5)."""
    share = np.linspace(0.0, 1.0, _GRID + 1)
    x = low[:, None] + (high - low)[:, None] * share
    x[:, -1] = high
    ends = base.evaluate(np.stack([low, np.nextafter(high, low)]))
    flat = ends[0][:, None] * (1.0 - share[:, None]) + ends[1][:, None] * share[:, None]
    rows = np.concatenate([x[..., None], flat[..., :3] * flat[..., 3:], flat[..., 3:]], axis=2)
    for bell, peak in zip(bells, peaks, strict=True):
        up = peak * np.exp(-0.5 * ((x - bell.center) / bell.width) ** 2)
        up[(x <= bell.low) | (x >= bell.high)] = 0.0
        rows[..., 1:4] += up[..., None] * np.asarray(bell.color)
        rows[..., 4] += up
    # Where nothing is seen, the base's colour is the one that goes on.
    unseen = ~rows[..., 4].any(axis=1)
    rows[unseen, :, 1:4] = flat[unseen, :, :3]
    return rows


def _colors(rows: Rows) -> Rows:
    """Colours of sums, (pieces, samples, 3). At an end of a piece where nothing is seen, that of the next sample."""
    up = rows[..., 4:]
    colors = rows[..., 1:4] / np.where(up > 0.0, up, 1.0)
    for end, beside in ((0, 1), (-1, -2)):
        dark = (up[:, end, 0] <= 0.0) & (up[:, beside, 0] > 0.0)
        colors[dark, end] = colors[dark, beside]
    return np.asarray(colors)


def _knots(strain: Rows, count: int) -> NDArray[np.int64]:
    """Samples at which keys stand: as many as are asked for, where it bends most."""
    if count <= 1:
        return np.array([0, _GRID])
    places = np.interp(np.linspace(0.0, strain[-1], count + 1), strain, np.arange(_GRID + 1.0))
    places[0], places[-1] = 0.0, _GRID
    return np.asarray(np.unique(np.rint(places).astype(int)))


def _errors(true: Rows, colors: Rows, knots: Sequence[NDArray[np.int64]]) -> Rows:
    """The most that keys at some samples of each piece miss of extinction, and of extinction times colour."""
    samples = np.arange(_GRID + 1)
    first = [np.minimum(np.searchsorted(at, samples, "right") - 1, len(at) - 2) for at in knots]
    before = np.stack([at[place] for at, place in zip(knots, first, strict=True)])
    after = np.stack([at[place + 1] for at, place in zip(knots, first, strict=True)])
    piece = np.arange(len(knots))[:, None]
    share = ((samples - before) / (after - before))[..., None]
    rows = np.concatenate([colors, true[..., 4:]], axis=2)
    made = rows[piece, before] * (1.0 - share) + rows[piece, after] * share
    made[..., :3] *= made[..., 3:]
    return np.asarray(np.abs(made - true[..., 1:]).max(axis=(1, 2)))


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
