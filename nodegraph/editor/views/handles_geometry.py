"""Between the world and a picture of it: where a line is seen, and what a drag over the picture means. No Qt here.

Every drag is relative to the point that is dragged: where the cursor has not moved, nothing has. Where a drag means
nothing (an axis that points at the viewer, a plane seen from its edge, what lies beyond a vanishing point), the nearest
thing that means something is done instead, so nothing jumps.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nodegraph.data import Camera
from nodegraph.data.space import Vector, normalize
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.navigation import Point, Size

NEAR = 1e-3
"""Least depth that is drawn, in distances from the eye to the focus."""
FARTHER = 20.0
"""A drag takes nothing farther or nearer than so many times its depth."""
END_ON = 0.12
"""An axis that is seen shorter than this part of its length is dragged by going up and down."""
EDGE_ON = 0.08
"""Cosine to the line of sight below which a plane is seen from its edge."""


@dataclass(frozen=True)
class Lens:
    """A camera and the size of its picture in pixels."""

    camera: Camera
    size: Size

    @cached_property
    def _half(self) -> Vector:
        """Half of what is seen at a depth of 1 mm, (width, height) mm; orthographic: at any depth."""
        return np.array(self.camera.rays(self.size)["half_size"], np.float64)

    @cached_property
    def distance(self) -> float:
        """From the eye to the focus, mm."""
        return float(np.linalg.norm(np.subtract(self.camera.target, self.camera.eye)))

    @property
    def near(self) -> float:
        """Least depth that is seen, mm."""
        return NEAR * self.distance

    def depth(self, point: Vector) -> float:
        """Along the view axis from the eye, mm."""
        return float(np.subtract(point, self.camera.eye) @ self.camera.basis[2])

    def pixel(self, depth: float) -> float:
        """What a pixel covers at a depth, mm."""
        return 2.0 * float(self._half[1]) / self.size[1] * (1.0 if self.camera.orthographic else depth)

    def place(self, point: Vector) -> Point | None:
        """Where a point of the world is seen; None behind the eye."""
        if self.depth(point) < self.near:
            return None
        (x, y), _ = self.places(point)
        return float(x), float(y)

    def places(self, points: Vector) -> tuple[Vector, Vector]:
        """Where points (..., 3) are seen (..., 2), and their depths (...). Behind the eye a place means nothing."""
        seen, depth, reach = self._seen(points)
        reach = np.maximum(reach, self.near * self._half) if not self.camera.orthographic else reach
        return (seen / reach * (0.5, -0.5) + 0.5) * self.size, depth

    def clipped(self, a: Vector, b: Vector, margin: float = 1.25) -> tuple[Vector, Vector, Vector]:
        """The parts of lines from a (n, 3) to b (n, 3) that lie in front of the eye and not far outside of the picture.

        Returns their ends, and which lines (n,) have such a part; the ends of others mean nothing.
        Source: Liang, Barsky 1984, "A new concept and method for line clipping".
        """
        room = [self._room(end, margin) for end in (a, b)]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = room[0] / (room[0] - room[1])
        first = np.where((room[0] < 0.0) & (room[1] >= 0.0), crossing, 0.0).max(axis=1)
        last = np.where((room[1] < 0.0) & (room[0] >= 0.0), crossing, 1.0).min(axis=1)
        there = ~((room[0] < 0.0) & (room[1] < 0.0)).any(axis=1) & (first < last)
        way = np.subtract(b, a)
        return a + first[:, None] * way, a + last[:, None] * way, there

    def _room(self, points: Vector, margin: float) -> Vector:
        """How far points (n, 3) lie inside of each plane (n, 5) of the pyramid of sight. Linear in the point."""
        seen, depth, reach = self._seen(points)
        return np.concatenate([(depth - self.near)[:, None], margin * reach - seen, margin * reach + seen], axis=1)

    def _seen(self, points: Vector) -> tuple[Vector, Vector, Vector]:
        """Right and up (..., 2) and depth (...) from the eye, mm, and half of what is seen there (..., 2)."""
        offsets = np.asarray(points, np.float64) - self.camera.eye
        right, up, forward = self.camera.basis
        depth = offsets @ forward
        reach = (
            np.broadcast_to(self._half, (*depth.shape, 2))
            if self.camera.orthographic
            else depth[..., None] * self._half
        )
        return np.stack([offsets @ right, offsets @ up], axis=-1), depth, reach

    def towards(self, point: Vector) -> Vector:
        """Unit vector of the line of sight through a point."""
        if self.camera.orthographic:
            return self.camera.basis[2]
        return normalize(np.subtract(point, self.camera.eye))


def along(lens: Lens, point: Vector, axis: Vector, start: Point, end: Point) -> float:
    """How far a drag takes a point along an axis, in lengths of the axis.

    What counts is the part of the drag along the line that the axis is seen as. With s pixels of it, depth w of the
    point, L pixels a length there and a change of depth by k a length, the point goes t = s w / (L w - s k) lengths:
    the map from a line to its picture is projective. An axis that is seen end-on goes away from the viewer with a drag
    upwards.
    """
    camera = lens.camera
    right, up, forward = camera.basis
    depth, slope = lens.depth(point), float(axis @ forward)
    pixel = lens.pixel(depth)
    seen = np.array([float(axis @ right), -float(axis @ up)])
    if not camera.orthographic:  # going away also pulls a point towards the middle of the picture
        offset = np.subtract(point, camera.eye)
        seen -= slope / depth * np.array([float(offset @ right), -float(offset @ up)])
    length = float(np.linalg.norm(axis))
    shown = float(np.linalg.norm(seen))
    if shown < END_ON * length:
        far = (start[1] - end[1]) * pixel / length * (1.0 if slope >= 0.0 else -1.0)
        return _limited(far, depth, 0.0 if camera.orthographic else slope)
    pixels = float(np.subtract(end, start) @ (seen / shown))
    scale = shown / pixel
    if camera.orthographic:
        return pixels / scale
    room = scale * depth - pixels * slope
    if room <= 0.0:  # beyond the point where the axis vanishes
        return _limited(np.inf if pixels > 0.0 else -np.inf, depth, slope)
    return _limited(pixels * depth / room, depth, slope)


def _limited(far: float, depth: float, slope: float) -> float:
    """A way whose end stays in front of the eye and within sight."""
    if slope == 0.0:
        return far
    ends = sorted([(depth / FARTHER - depth) / slope, (depth * FARTHER - depth) / slope])
    return min(max(far, ends[0]), ends[1])


def facing(lens: Lens, point: Vector, start: Point, end: Point) -> Vector:
    """How a drag shifts a point, mm, in the plane through it that faces the camera."""
    depth = lens.depth(point)
    shift: Vector = nav.world_at(lens.camera, lens.size, end, depth) - nav.world_at(
        lens.camera, lens.size, start, depth
    )
    return shift


def within(lens: Lens, point: Vector, normal: Vector, start: Point, end: Point) -> Vector:
    """How a drag shifts a point, mm, in the plane through it with a normal.

    A plane that is seen from its edge is dragged as if it faced the camera, without the part along its normal. A drag
    over the horizon of the plane stops before it.
    """
    normal = normalize(normal)
    place = lens.place(point)
    if place is None or abs(float(lens.towards(point) @ normal)) < EDGE_ON:
        flat = facing(lens, point, start, end)
        edge: Vector = flat - normal * float(flat @ normal)
        return edge
    move = np.subtract(end, start)
    if not lens.camera.orthographic:
        # One over the depth of the plane is linear over the picture; it is 0 at the horizon.
        depth = lens.depth(point)
        here, there = (1.0 / depth, _nearness(lens, point, normal, tuple(np.add(place, move).tolist())))
        if there < here / FARTHER:
            move = move * (here - here / FARTHER) / (here - there)
        elif there > here * FARTHER:
            move = move * (here * FARTHER - here) / (there - here)
    x, y = np.add(place, move).tolist()
    origin, direction = lens.camera.ray(lens.size, x - 0.5, y - 0.5)
    reach = float(np.subtract(point, origin) @ normal) / float(direction @ normal)
    shift: Vector = origin + direction * reach - point
    return shift


def _nearness(lens: Lens, point: Vector, normal: Vector, place: Point) -> float:
    """One over the depth at which a place of the picture shows the plane through a point."""
    _, direction = lens.camera.ray(lens.size, place[0] - 0.5, place[1] - 0.5)
    unit_depth = direction / float(direction @ lens.camera.basis[2])
    return float(unit_depth @ normal) / float(np.subtract(point, lens.camera.eye) @ normal)


def turned(lens: Lens, centre: Vector, direction: Vector, radius: float, start: Point, end: Point) -> Vector:
    """The unit direction that a drag of the tip of an arrow leads to.

    The tip lies on a ball of ``radius`` pixels and stays under the cursor. Who drags on over the rim of the ball comes
    to its other side, as if the cursor came back.
    """
    back = -lens.towards(centre)
    right = normalize(np.cross(lens.camera.basis[1], back))
    up = np.cross(back, right)
    unit = normalize(direction)
    side = 1.0 if float(unit @ back) >= 0.0 else -1.0
    at = np.array([float(unit @ right), float(unit @ up)])
    at += np.array([end[0] - start[0], start[1] - end[1]]) / radius
    far = float(np.linalg.norm(at))
    if far > 1.0:
        at *= max(2.0 - far, 0.0) / far
        side = -side
    height = side * np.sqrt(max(1.0 - float(at @ at), 0.0))
    found: Vector = normalize(at[0] * right + at[1] * up + height * back)
    return found
