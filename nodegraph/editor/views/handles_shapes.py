"""What handles look like in the world and what their grips do: boxes and planes.

A shape knows one value of a parameter at the beginning of a drag. It says which lines and grips stand for it, and which
value a drag of a grip leads to.
"""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from nodegraph.data import Plane
from nodegraph.data.space import Matrix, Vector, invert, normalize, transform_points
from nodegraph.editor.views import handles_geometry as geometry
from nodegraph.editor.views.handles_geometry import Lens
from nodegraph.editor.views.navigation import Point

AXES = "xyz"
ARROW = 64.0
"""Length of an arrow in pixels where it begins."""
INSIDE = 12.0
"""A grip is put so many pixels inside of the picture, where its place can be chosen."""
STEPS = (np.arange(15) + 0.5) / 15
LATTICE = np.array([*itertools.product(STEPS, STEPS)])
"""Places of a face, 0..1, where its grip may be."""
THINNEST = 1e-3
"""Least thickness of a box that a drag leaves, in sides of the whole."""


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A line of the world. faint: seen through what it belongs to. grip: what is dragged by it, if anything."""

    a: Vector
    b: Vector
    faint: bool = False
    grip: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class Grip:
    """A point of the world that can be dragged. sign: "dot", "square" or "ring"."""

    name: str
    at: Vector
    sign: str = "dot"


class Shape(ABC):
    """The handle of one value."""

    @abstractmethod
    def lines(self, lens: Lens) -> list[Line]:
        """What is drawn."""

    @abstractmethod
    def grips(self, lens: Lens) -> list[Grip]:
        """What can be dragged."""

    @abstractmethod
    def moved(self, lens: Lens, grip: Grip, start: Point, end: Point) -> Any:
        """The value after a drag of a grip. Raises ParameterError where it would be none."""

    def grip(self, lens: Lens, name: str) -> Grip:
        """The grip of a name; that of a line has no point of its own."""
        return next(grip for grip in self.grips(lens) if grip.name == name)

    @abstractmethod
    def says(self, grip: str) -> str:
        """What a grip holds, in a few words with its numbers."""


class BoxShape(Shape):
    """Six faces and a middle.

    value: ((x, y, z), (x, y, z)) in a space of its own, or None for all. to_world: from that space to the world, mm.
    whole: the box that stands for all. bounded: whether the box stays within the whole.
    """

    def __init__(self, value: Any, to_world: Matrix, whole: Any, unit: str = "", bounded: bool = False) -> None:
        self.low, self.high = (np.asarray(corner, np.float64) for corner in (whole if value is None else value))
        self.to_world = to_world
        self.whole = tuple(np.asarray(corner, np.float64) for corner in whole)
        self.unit = unit
        self.bounded = bounded
        places = np.full((3, 2, 3), 0.5)
        for axis in range(3):
            places[axis, :, axis] = (0.0, 1.0)
        self.faces = self._world(self.low + places * (self.high - self.low))  # middles: [axis, side]

    def lines(self, lens: Lens) -> list[Line]:
        away = {(axis, side): self._faces_away(lens, axis, side) for axis in range(3) for side in (0, 1)}
        found = []
        for axis in range(3):
            others = [other for other in range(3) if other != axis]
            for sides in itertools.product((0, 1), repeat=2):
                fractions = np.zeros((2, 3))
                fractions[1, axis] = 1.0
                fractions[:, others] = sides
                faint = all(away[face] for face in zip(others, sides, strict=True))
                a, b = self._world(self.low + fractions * (self.high - self.low))
                found.append(Line(a, b, faint))
        return found

    def grips(self, lens: Lens) -> list[Grip]:
        faces = [
            Grip(f"{end} {AXES[axis]}", in_picture(lens, self.faces[axis][side], partial(self._lattice, axis, side)))
            for axis in range(3)
            for side, end in enumerate(("low", "high"))
        ]
        return [*faces, Grip("middle", self._world((self.low + self.high) / 2), "square")]

    def moved(self, lens: Lens, grip: Grip, start: Point, end: Point) -> Any:
        low, high = self.low.copy(), self.high.copy()
        if grip.name == "middle":
            shift = geometry.facing(lens, grip.at, start, end)
            own = invert(self.to_world)[:3, :3] @ shift
            if self.bounded:
                own = np.clip(own, np.minimum(self.whole[0] - low, 0.0), np.maximum(self.whole[1] - high, 0.0))
            return _box(low + own, high + own)
        name, _, axis_name = grip.name.partition(" ")
        axis, side = AXES.index(axis_name), int(name == "high")
        far = geometry.along(lens, grip.at, self.to_world[:3, axis], start, end)
        thin = min(THINNEST * float(self.whole[1][axis] - self.whole[0][axis]), float(high[axis] - low[axis]))
        if side:
            most = self.whole[1][axis] if self.bounded else math.inf
            high[axis] = max(min(high[axis] + far, most), low[axis] + thin)
        else:
            least = self.whole[0][axis] if self.bounded else -math.inf
            low[axis] = min(max(low[axis] + far, least), high[axis] - thin)
        return _box(low, high)

    def says(self, grip: str) -> str:
        unit = f" {self.unit}" if self.unit else ""
        name, _, axis = grip.partition(" ")
        if not axis:
            return " × ".join(f"{side:.4g}" for side in self.high - self.low) + unit
        corner, word = (self.high, "to") if name == "high" else (self.low, "from")
        return f"{axis} {word} {corner[AXES.index(axis)]:.4g}{unit}"

    def _world(self, points: Vector) -> Vector:
        return transform_points(self.to_world, points)

    def _lattice(self, axis: int, side: int) -> Vector:
        """Points (n, 3) of a face, world mm."""
        fractions = np.full((len(LATTICE), 3), float(side))
        fractions[:, [other for other in range(3) if other != axis]] = LATTICE
        return self._world(self.low + fractions * (self.high - self.low))

    def _faces_away(self, lens: Lens, axis: int, side: int) -> bool:
        a, b = (self.to_world[:3, other] for other in range(3) if other != axis)
        normal = np.cross(a, b)
        out = (1.0 if side else -1.0) * float(np.sign(normal @ self.to_world[:3, axis]))
        return bool(out * float(normal @ lens.towards(self.faces[axis][side])) > 0.0)


def _box(low: Vector, high: Vector) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return numbers(low), numbers(high)


def numbers(values: Sequence[float] | Vector, digits: int = 6) -> tuple[float, ...]:
    """Numbers with no more digits than a hand can set."""
    return tuple(float(f"{float(value):.{digits}g}") for value in values)


def in_picture(lens: Lens, first: Vector, others: Callable[[], Vector]) -> Vector:
    """A point where it is in the picture, else the nearest to it of some others (n, 3) that is, else the first."""
    if _inside(lens, first):
        return first
    points = others()
    far = np.where(_inside(lens, points), np.linalg.norm(points - first, axis=1), np.inf)
    nearest: Vector = points[int(far.argmin())] if np.isfinite(far).any() else first
    return nearest


def _inside(lens: Lens, points: Vector) -> Any:
    """Which of some points (..., 3) are seen well inside of the picture."""
    places, depths = lens.places(points)
    return (depths > lens.near) & (np.minimum(places, lens.size - places).min(axis=-1) > INSIDE)


class PlaneShape(Shape):
    """Where a plane cuts a box, a ring that moves its origin in it, an arrow that tilts it; the outline pushes it.

    corners: eight of a box, world mm, as `Volume.corners` has them; empty where nothing is known to be cut.
    """

    def __init__(self, plane: Plane, corners: Vector) -> None:
        self.plane = plane
        self.origin, self.normal = np.asarray(plane.origin, np.float64), plane.unit_normal
        self.outline = cut_outline(self.origin, self.normal, corners)
        self.middle = self.outline.mean(axis=0) if len(self.outline) else self.origin

    def lines(self, lens: Lens) -> list[Line]:
        outline = self.outline if len(self.outline) else self._square(lens)
        found = [Line(a, b, grip="push") for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True)]
        anchor, arrow = self._anchor(lens), self._arrow(lens)
        return [*found, Line(anchor - arrow, anchor), Line(anchor, anchor + arrow, grip="push")]

    def grips(self, lens: Lens) -> list[Grip]:
        anchor, arrow = self._anchor(lens), self._arrow(lens)
        tilts = [Grip("tilt", anchor + arrow), Grip("tilt back", anchor - arrow)]
        return [*tilts, Grip("origin", anchor, "ring")]

    def grip(self, lens: Lens, name: str) -> Grip:
        return Grip(name, self._anchor(lens)) if name == "push" else super().grip(lens, name)

    def moved(self, lens: Lens, grip: Grip, start: Point, end: Point) -> Any:
        anchor = self._anchor(lens)
        if grip.name == "push":
            far = geometry.along(lens, anchor, self.normal, start, end)
            return Plane(numbers(self.origin + far * self.normal), self.plane.normal)
        if grip.name == "origin":
            shift = geometry.within(lens, anchor, self.normal, start, end)
            return Plane(numbers(anchor + shift), self.plane.normal)
        sign = 1.0 if grip.name == "tilt" else -1.0
        normal = sign * geometry.turned(lens, anchor, sign * self.normal, ARROW, start, end)
        # Tilted about what is seen of it, not about an origin that may be far away.
        return Plane(numbers(anchor), numbers(normal, 5))

    def says(self, grip: str) -> str:
        if grip == "push":
            return f"{float(self.origin @ self.normal):.4g} mm along its normal"
        if grip == "origin":
            return f"through {_listed(self.origin)} mm"
        return f"normal {_listed(self.normal)}"

    def _anchor(self, lens: Lens) -> Vector:
        """Where the arrow stands: at the origin, or at a place of the cut that is in the picture."""
        if not len(self.outline):
            return self.origin
        return in_picture(lens, self.origin, self._fan)

    def _fan(self) -> Vector:
        """Points (n, 3) all over the cut."""
        fan: Vector = self.middle + (self.outline[:, None] - self.middle) * np.linspace(0.0, 1.0, 7)[:, None]
        return fan.reshape(-1, 3)

    def _arrow(self, lens: Lens) -> Vector:
        arrow: Vector = self.normal * ARROW * lens.pixel(max(lens.depth(self._anchor(lens)), lens.near))
        return arrow

    def _square(self, lens: Lens) -> Vector:
        right, up = self.plane.axes
        half = 0.25 * lens.size[1] * lens.pixel(lens.distance)
        return np.array([self.origin + half * (x * right + y * up) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])


def _listed(values: Vector) -> str:
    return ", ".join(f"{float(value):.4g}" for value in values)


def cut_outline(origin: Vector, normal: Vector, corners: Vector) -> Vector:
    """The corners (n, 3), in order around it, of the polygon in which a plane cuts a box; none where it misses.

    corners: (8, 3) in the order of `Volume.corners`: bit 0 of the place says low or high x, bit 1 y, bit 2 z.
    """
    if len(corners) != 8:
        return np.empty((0, 3))
    sides = (np.asarray(corners) - origin) @ normal
    found = []
    for a, b in itertools.combinations(range(8), 2):
        if (a ^ b).bit_count() == 1 and sides[a] * sides[b] <= 0.0 and sides[a] != sides[b]:
            found.append(corners[a] + (corners[b] - corners[a]) * (sides[a] / (sides[a] - sides[b])))
    if len(found) < 3:
        return np.empty((0, 3))
    points = np.array(found)
    spread = points - points.mean(axis=0)
    right = normalize(spread[np.argmax(np.linalg.norm(spread, axis=1))])
    angles = np.arctan2(spread @ np.cross(normal, right), spread @ right)
    ordered: Vector = points[np.argsort(angles)]
    return ordered
