"""Edits of the areas of a two-dimensional transfer function. Each returns a new area or function.

Points are (value, magnitude). A handle is a name: the sides of an area, and the corners of a trapezoid.
"""

from __future__ import annotations

import numpy as np

from nodegraph.data import Gaussian, TransferFunction2D, Trapezoid
from nodegraph.data.transfer_function_2d import ENDS, Area, Pair

Point = tuple[float, float]


def handles(area: Area) -> dict[str, Point]:
    """Where an area is taken hold of to give it another shape."""
    if isinstance(area, Gaussian):
        (value, gradient), (wide, high) = area.center, (ENDS * sigma for sigma in area.sigma)
        sides = {"left": (value - wide, gradient), "right": (value + wide, gradient), "top": (value, gradient + high)}
        return sides | ({"bottom": (value, gradient - high)} if gradient >= high else {})
    (low, high), middle = area.gradients, 0.5 * sum(area.gradients)
    return {
        "bottom left": (area.bottom[0], low), "bottom right": (area.bottom[1], low),
        "top left": (area.top[0], high), "top right": (area.top[1], high),
        "left": (0.5 * (area.bottom[0] + area.top[0]), middle), "right": (0.5 * (area.bottom[1] + area.top[1]), middle),
        "bottom": (0.5 * sum(area.bottom), low), "top": (0.5 * sum(area.top), high),
    }  # fmt: skip


def outlines(area: Area) -> list[list[Point]]:
    """Closed lines: where an area ends, and of a Gaussian before that one standard deviation."""
    if isinstance(area, Trapezoid):
        corners = handles(area)
        return [[corners[name] for name in ("bottom left", "bottom right", "top right", "top left")]]
    turn = np.linspace(0.0, 2.0 * np.pi, 64, endpoint=False)
    (value, gradient), (wide, high) = area.center, area.sigma
    return [
        list(
            zip((value + k * wide * np.cos(turn)).tolist(), (gradient + k * high * np.sin(turn)).tolist(), strict=True)
        )
        for k in (1.0, ENDS)
    ]


def contains(area: Area, point: Point) -> bool:
    """Whether an area can be taken hold of at a point; of a Gaussian, within two standard deviations."""
    value, gradient = point
    if isinstance(area, Gaussian):
        across, along = (value - area.center[0]) / area.sigma[0], (gradient - area.center[1]) / area.sigma[1]
        return across * across + along * along <= 4.0
    least, greatest = area.gradients
    up = (gradient - least) / (greatest - least)
    sides = [a + (b - a) * up for a, b in zip(area.bottom, area.top, strict=True)]
    return 0.0 <= up <= 1.0 and sides[0] <= value <= sides[1]


def moved(area: Area, across: float, along: float) -> Area:
    """An area moved by a difference of values and of magnitudes; none of it goes below magnitude 0."""
    if isinstance(area, Gaussian):
        return area._replace(center=(area.center[0] + across, max(0.0, area.center[1] + along)))
    low, high = area.gradients
    along = max(along, -low)
    return area._replace(
        bottom=_shifted(area.bottom, across), top=_shifted(area.top, across), gradients=(low + along, high + along)
    )


def resized(area: Area, handle: str, point: Point, least: Point) -> Area:
    """An area with one of its handles at a point, at least ``least`` wide and high."""
    value, gradient = point
    if isinstance(area, Gaussian):
        wide, high = area.sigma
        if handle in ("left", "right"):
            wide = max(least[0], abs(value - area.center[0])) / ENDS
        else:
            high = max(least[1], abs(gradient - area.center[1])) / ENDS
        return area._replace(sigma=(wide, high))
    bottom, top, gradients = area.bottom, area.top, area.gradients
    if "bottom" in handle:
        gradients = (max(0.0, min(gradient, gradients[1] - least[1])), gradients[1])
    if "top" in handle:
        gradients = (gradients[0], max(gradient, gradients[0] + least[1]))
    right = "right" in handle
    if handle in ("left", "right"):
        # Both ends move alike, each at most to the other side of its base.
        by = value - 0.5 * (bottom[right] + top[right])
        bottom, top = (_end(base, right, base[right] + by, least[0]) for base in (bottom, top))
    elif "left" in handle or "right" in handle:
        if "bottom" in handle:
            bottom = _end(bottom, right, value, 0.0 if top[1] - top[0] >= least[0] else least[0])
        else:
            top = _end(top, right, value, 0.0 if bottom[1] - bottom[0] >= least[0] else least[0])
    return area._replace(bottom=bottom, top=top, gradients=gradients)


def straightened(area: Trapezoid) -> Trapezoid:
    """The rectangle whose sides stand in the middle of those of a trapezoid."""
    low, high = (0.5 * (a + b) for a, b in zip(area.bottom, area.top, strict=True))
    return area._replace(bottom=(low, high), top=(low, high))


def added(function: TransferFunction2D, area: Area) -> TransferFunction2D:
    """A function with one area more."""
    return TransferFunction2D([*function.areas, area], function.reference_length)


def replaced(function: TransferFunction2D, place: int, area: Area) -> TransferFunction2D:
    """A function with another area at a place. Raises ParameterError."""
    areas = [*function.areas[:place], area, *function.areas[place + 1 :]]
    return TransferFunction2D(areas, function.reference_length)


def removed(function: TransferFunction2D, place: int) -> TransferFunction2D:
    """A function without the area at a place."""
    return TransferFunction2D([*function.areas[:place], *function.areas[place + 1 :]], function.reference_length)


def _shifted(pair: Pair, by: float) -> Pair:
    return pair[0] + by, pair[1] + by


def _end(pair: Pair, right: bool, value: float, least: float) -> Pair:
    """A pair with another right or left end, at least so far from the other one."""
    return (pair[0], max(value, pair[0] + least)) if right else (min(value, pair[1] - least), pair[1])
