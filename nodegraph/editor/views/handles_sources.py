"""What handles look like in the world and what their grips do: lights, and the cameras of other views."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from nodegraph.data import Camera, Light
from nodegraph.data.space import Vector, transform_points
from nodegraph.editor.views import handles_geometry as geometry
from nodegraph.editor.views.handles_geometry import Lens
from nodegraph.editor.views.handles_shapes import Grip, Line, Shape, numbers
from nodegraph.editor.views.navigation import Point

BALL = 0.36
"""Radius of the ball on which a lamp far away is shown, in the shorter side of the picture."""
RIM = 48
"""Lines of a circle."""


class LightShape(Shape):
    """A lamp: near ones where they are, those far away on a ball about the focus of the view.

    camera: of the view, which a light that is fixed to the eye goes with.
    """

    def __init__(self, light: Light, camera: Camera) -> None:
        self.light = light
        self.focus = np.asarray(camera.target, np.float64)
        to_world = camera.eye_to_world if light.frame == "eye" else np.eye(4)
        self.to_world = to_world
        self.position = np.asarray(light.position, np.float64)

    @property
    def near(self) -> bool:
        """Whether the lamp is at a place rather than in a direction."""
        return self.light.type == "point"

    def lines(self, lens: Lens) -> list[Line]:
        lamp = self._lamp(lens)
        if self.near:
            return [Line(lamp, self.focus, faint=True)]
        right, up, _ = lens.camera.basis
        turns = np.linspace(0.0, 2.0 * np.pi, RIM + 1)[:, None]
        rim = self.focus + self._radius(lens) * (np.cos(turns) * right + np.sin(turns) * up)
        return [*(Line(a, b, faint=True) for a, b in itertools.pairwise(rim)), Line(lamp, self.focus)]

    def grips(self, lens: Lens) -> list[Grip]:
        return [Grip("lamp", self._lamp(lens), "lamp")]

    def moved(self, lens: Lens, grip: Grip, start: Point, end: Point) -> Any:
        turn = self.to_world[:3, :3]
        if self.near:
            position = self.position + turn.T @ geometry.facing(lens, grip.at, start, end)
        else:
            pixels = BALL * min(lens.size)
            world = geometry.turned(lens, self.focus, turn @ self.position, pixels, start, end)
            position = turn.T @ world * float(np.linalg.norm(self.position))
        return Light(**{**self.light.to_json(), "position": numbers(position, 5)})

    def says(self, grip: str) -> str:
        frame = "" if self.light.frame == "world" else ", as the eye sees it"
        listed = ", ".join(f"{part:.3g}" for part in self.position)
        return f"from {listed}{' mm' if self.near else ''}{frame}"

    def _radius(self, lens: Lens) -> float:
        return BALL * min(lens.size) * lens.pixel(max(lens.depth(self.focus), lens.near))

    def _lamp(self, lens: Lens) -> Vector:
        if self.near:
            return transform_points(self.to_world, self.position)
        world: Vector = self.to_world[:3, :3] @ self.position
        return self.focus + world * (self._radius(lens) / float(np.linalg.norm(world)))


class CameraShape(Shape):
    """The pyramid that a camera sees (orthographic: the block), down to its focus. aspect: width by height."""

    def __init__(self, camera: Camera, aspect: float = 1.0) -> None:
        self.camera = camera
        self.aspect = aspect
        self.eye, self.target = (np.asarray(point, np.float64) for point in (camera.eye, camera.target))

    def lines(self, lens: Lens) -> list[Line]:
        right, up, _ = self.camera.basis
        own = Lens(self.camera, (round(1000 * self.aspect), 1000))
        half = 500.0 * own.pixel(own.distance)
        frame = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        far = [self.target + half * (x * self.aspect * right + y * up) for x, y in frame]
        flat = self.camera.orthographic
        near = [self.eye + (corner - self.target) if flat else self.eye for corner in far]
        found = [Line(far[i - 1], far[i]) for i in range(4)]
        found += [Line(a, b) for a, b in zip(near, far, strict=True)]
        if flat:
            found += [Line(near[i - 1], near[i]) for i in range(4)]
        roof = self.target + 1.25 * half * up  # says where up is
        found += [Line(far[2], roof), Line(roof, far[3]), Line(self.eye, self.target, faint=True)]
        return found

    def grips(self, lens: Lens) -> list[Grip]:
        middle = (self.eye + self.target) / 2
        return [Grip("eye", self.eye), Grip("target", self.target, "ring"), Grip("whole", middle, "square")]

    def moved(self, lens: Lens, grip: Grip, start: Point, end: Point) -> Any:
        shift = geometry.facing(lens, grip.at, start, end)
        eye = self.eye + (shift if grip.name != "target" else 0.0)
        target = self.target + (shift if grip.name != "eye" else 0.0)
        return self.camera.with_(eye=numbers(eye), target=numbers(target))

    def says(self, grip: str) -> str:
        if grip == "whole":
            return "eye and target"
        listed = ", ".join(f"{part:.4g}" for part in (self.eye if grip == "eye" else self.target))
        return f"{grip} {listed} mm"
