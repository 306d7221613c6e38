"""What a measurement found: one point for each setting and device, and all of them with what they were taken from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from nodegraph.accuracy.front import pareto
from nodegraph.errors import ParameterError, near_miss_or_all

if TYPE_CHECKING:
    from nodegraph.data import Image
    from nodegraph.data.buffer import Array


LONGEST = 60
"""As much of a value as is told, characters: a transfer function is long."""


@dataclass(frozen=True)
class Point:
    """One setting on one device: what it costs and how wrong it is.

    settings:        JSON values by place.
    seconds:         median from the request until the result lies on the host; of the nodes that are timed.
    device_seconds:  median of what their kernels took.
    prepare_seconds: what their memos took when they were made; once, and not part of ``seconds``.
    bytes:           distinct memory of their results and memos.
    runs:            each of the times that ``seconds`` is the median of.
    errors:          figures by name, see `nodegraph.accuracy.measures`; empty where the setting failed.
    reference:       place of its reference in `Measured.references`.
    image:           the picture, where the result is one.
    failure:         why there is no result; empty where there is.
    front:           no other point with this reference beats it in both time and error.
    """

    settings: Mapping[str, Any]
    device: str
    seconds: float = math.nan
    device_seconds: float = math.nan
    prepare_seconds: float = math.nan
    bytes: int = 0
    runs: tuple[float, ...] = ()
    errors: Mapping[str, float] = field(default_factory=dict)
    reference: int = 0
    image: Image | None = field(default=None, repr=False, compare=False)
    failure: str = ""
    notes: tuple[str, ...] = ()
    front: bool = False

    @property
    def label(self) -> str:
        """The settings in one line."""
        return ", ".join(f"{place}={text(value)}" for place, value in self.settings.items()) or "as it is"


@dataclass(frozen=True)
class ReferenceNote:
    """What a reference was like. ``image``, ``mask``: where it is a picture, it and where it converged.

    left_out: the share of it that did not converge.
    difference: the greatest that is left between its last two rounds; bound: what was asked for.
    failure: why there is none.
    """

    settings: Mapping[str, Any]
    summary: str = ""
    converged: bool = False
    difference: float = math.nan
    bound: float = math.nan
    rounds: int = 0
    left_out: float = 0.0
    image: Image | None = field(default=None, repr=False, compare=False)
    mask: Array | None = field(default=None, repr=False, compare=False)
    failure: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Measured:
    """All points of one measurement. ``error`` is the figure that the front is about."""

    name: str
    view: str
    size: tuple[int, int] | None
    repeats: int
    error: str
    rising: frozenset[str]
    units: Mapping[str, str]
    points: tuple[Point, ...]
    references: tuple[ReferenceNote, ...]
    timed: tuple[str, ...]
    devices: Mapping[str, str]
    machine: str
    notes: tuple[str, ...] = ()

    @property
    def places(self) -> tuple[str, ...]:
        """What was varied."""
        return tuple(dict.fromkeys(place for point in self.points for place in point.settings))

    @property
    def figures(self) -> tuple[str, ...]:
        """Names of the errors, in the order in which they are told."""
        return tuple(dict.fromkeys(name for point in self.points for name in point.errors))

    def with_front(self, error: str = "") -> Measured:
        """The same with the front marked, of ``error`` where it is named. Raises ParameterError for an unknown one.

        Points beat each other only under one reference: what has another one answers another question.
        """
        error = error or self.error
        if self.figures and error not in self.figures:
            raise ParameterError(f"{error}: no such error here{near_miss_or_all(error, self.figures)}")
        sign = -1.0 if error in self.rising else 1.0
        marks = [False] * len(self.points)
        for reference in {point.reference for point in self.points}:
            rivals = [i for i, point in enumerate(self.points) if point.reference == reference]
            times = [self.points[i].seconds for i in rivals]
            errors = [sign * self.points[i].errors.get(error, math.nan) for i in rivals]
            for i, mark in zip(rivals, pareto(times, errors), strict=True):
                marks[i] = mark
        points = tuple(replace(point, front=mark) for point, mark in zip(self.points, marks, strict=True))
        return replace(self, error=error, points=points)


def text(value: Any) -> str:
    """A JSON value as it would be typed."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, (list, tuple)):
        return ",".join(text(part) for part in value)
    told = str(value)
    return told if len(told) <= LONGEST else f"{told[: LONGEST - 3]}..."
