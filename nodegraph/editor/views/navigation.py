"""What a drag or a key does to a camera. Pixels have their origin at the top left; no Qt here.

Each function takes the camera at the start of a gesture and returns the one that it leads to, so that a drag back to
where it began ends where it began, whatever way the mouse took.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from nodegraph.camera_path import rotated, rotation
from nodegraph.data import Camera, Plane
from nodegraph.data.space import Vector, normalize

Size = tuple[int, int]
Point = tuple[float, float]

BALL = 0.85
"""Radius of the ball that a drag turns, in half the shorter side of the picture."""

STEEPEST = 89.0
"""Degrees that somebody who flies may look up or down."""

AXES: dict[str, tuple[str, tuple[float, float, float], tuple[float, float, float]]] = {
    "front": ("Front", (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)),
    "back": ("Back", (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
    "left": ("Left", (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "right": ("Right", (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "top": ("Top", (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)),
    "bottom": ("Bottom", (0.0, 0.0, -1.0), (0.0, -1.0, 0.0)),
}
"""Views along the axes of the world: label, where the eye is seen from the target, up. The world is LPS."""


def turn(camera: Camera, size: Size, start: Point, end: Point) -> Camera:
    """Turn what is seen about the focus, so that the point of a ball that was grabbed follows the cursor.

    The ball goes over into a hyperbola outside, where a drag along its rim rolls.
    Source: Shoemake 1992, "Arcball"; Bell's sheet as in Henriksen, Sporring, Hornbaek 2004, "Virtual trackballs".
    """
    a, b = _on_ball(size, start), _on_ball(size, end)
    axis = np.cross(a, b)
    if float(axis @ axis) < 1e-24:
        return camera
    angle = math.atan2(float(np.linalg.norm(axis)), float(a @ b))
    right, up, forward = camera.basis
    axis_in_world = axis[0] * right + axis[1] * up - axis[2] * forward
    return rotated(camera, rotation(axis_in_world, -angle))  # the camera goes the other way than what it sees


def _on_ball(size: Size, point: Point) -> Vector:
    """Unit vector, eye space, to where the line through a pixel meets the sheet."""
    radius = BALL * min(size) / 2
    x, y = (point[0] - size[0] / 2) / radius, (size[1] / 2 - point[1]) / radius
    square = x * x + y * y
    z = math.sqrt(1.0 - square) if square <= 0.5 else 0.5 / math.sqrt(square)
    return normalize(np.array([x, y, z]))


def roll(camera: Camera, size: Size, start: Point, end: Point) -> Camera:
    """Turn the picture about its middle with the cursor."""
    angles = [math.atan2(size[1] / 2 - y, x - size[0] / 2) for x, y in (start, end)]
    return rolled(camera, math.degrees(angles[1] - angles[0]))


def rolled(camera: Camera, degrees: float) -> Camera:
    """Turn the picture counter-clockwise."""
    _, _, forward = camera.basis
    return rotated(camera, rotation(forward, math.radians(degrees)))


def pan(camera: Camera, size: Size, start: Point, end: Point) -> Camera:
    """Shift the camera so that what lies under the cursor at the depth of the focus stays under it."""
    shift = on_focus(camera, size, start) - on_focus(camera, size, end)
    return camera.with_(
        eye=tuple(np.add(camera.eye, shift).tolist()), target=tuple(np.add(camera.target, shift).tolist())
    )


def zoom(camera: Camera, size: Size, at: Point, factor: float) -> Camera:
    """Make what lies at the focus ``1 / factor`` times as large; what is under the cursor there stays under it."""
    fixed = on_focus(camera, size, at)
    target = fixed + factor * np.subtract(camera.target, fixed)
    if camera.orthographic:
        shift = target - camera.target
        eye = np.add(camera.eye, shift)
        return camera.with_(eye=tuple(eye.tolist()), target=tuple(target.tolist()), height=camera.height * factor)
    eye = fixed + factor * np.subtract(camera.eye, fixed)
    return camera.with_(eye=tuple(eye.tolist()), target=tuple(target.tolist()))


def switched(camera: Camera) -> Camera:
    """The other projection, with what lies at the focus as large as before."""
    tangent = math.tan(math.radians(camera.field_of_view) / 2)
    offset = np.subtract(camera.eye, camera.target)
    if not camera.orthographic:
        return camera.with_(projection="orthographic", height=2 * float(np.linalg.norm(offset)) * tangent)
    eye = np.add(camera.target, normalize(offset) * camera.height / (2 * tangent))
    return camera.with_(projection="perspective", eye=tuple(eye.tolist()))


def along(camera: Camera, axis: str) -> Camera:
    """Look at the same focus from the same distance along an axis of the world; ``axis`` is a key of AXES."""
    _, direction, up = AXES[axis]
    distance = float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
    return camera.with_(eye=tuple(np.add(camera.target, np.multiply(direction, distance)).tolist()), up=up)


def flown(camera: Camera, step: Iterable[float]) -> Camera:
    """Move eye and focus by (right, up, forward) mm as the camera sees them."""
    right, up, forward = camera.basis
    x, y, z = step
    shift = x * right + y * up + z * forward
    return camera.with_(
        eye=tuple(np.add(camera.eye, shift).tolist()), target=tuple(np.add(camera.target, shift).tolist())
    )


def looked(camera: Camera, degrees: tuple[float, float]) -> Camera:
    """Turn the camera in its place: (to the right about its own up, upwards). It never looks straight along up."""
    up = normalize(camera.up)
    offset = rotation(up, -math.radians(degrees[0])) @ np.subtract(camera.target, camera.eye)
    length = float(np.linalg.norm(offset))
    level = normalize(offset - (offset @ up) * up)
    height = math.degrees(math.asin(max(-1.0, min(1.0, float(offset @ up) / length))))
    angle = math.radians(min(max(height + degrees[1], -STEEPEST), STEEPEST))
    offset = length * (math.cos(angle) * level + math.sin(angle) * up)
    return camera.with_(target=tuple(np.add(camera.eye, offset).tolist()))


def fitted(camera: Camera, corners: Iterable[Iterable[float]], size: Size, margin: float = 1.05) -> Camera:
    """Show all of some points (world, mm) from the same direction, their middle in the focus."""
    points = np.asarray([tuple(corner) for corner in corners], np.float64)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    right, up, forward = camera.basis
    offsets = points - middle
    wide, tall, near = np.abs(offsets @ right), np.abs(offsets @ up), -(offsets @ forward)
    aspect = size[0] / size[1]
    tangent = math.tan(math.radians(camera.field_of_view) / 2)
    height = 2 * margin * max(float(tall.max()), float(wide.max()) / aspect, 1e-6)
    distance = float((near + margin * np.maximum(tall, wide / aspect) / tangent).max())
    if camera.orthographic:
        distance = max(float(np.linalg.norm(np.subtract(camera.eye, camera.target))), 2 * float(near.max()))
    eye = middle - max(distance, 1e-3) * forward
    return camera.with_(eye=tuple(eye.tolist()), target=tuple(middle.tolist()), height=height)


def centred(camera: Camera, point: Iterable[float]) -> Camera:
    """Put the focus on a point of the world, without a turn and at the same distance."""
    shift = np.asarray(tuple(point)) - camera.target
    return camera.with_(eye=tuple(np.add(camera.eye, shift).tolist()), target=tuple(np.add(camera.target, shift)))


def on_focus(camera: Camera, size: Size, at: Point) -> Vector:
    """The point of the world under a place of the picture, in the plane of the focus that faces the camera."""
    _, _, forward = camera.basis
    return world_at(camera, size, at, float(np.subtract(camera.target, camera.eye) @ forward))


def world_at(camera: Camera, size: Size, at: Point, depth: float) -> Vector:
    """The point of the world (mm) under a place of the picture, ``depth`` mm from the eye along the view axis."""
    origin, direction = camera.ray(size, at[0] - 0.5, at[1] - 0.5)  # pixels there count from their middle
    _, _, forward = camera.basis
    point: Vector = origin + direction * depth / float(direction @ forward)
    return point


def seen_at(camera: Camera, size: Size, point: Iterable[float]) -> Point:
    """The place of the picture where a point of the world is seen; the inverse of `world_at`."""
    right, up, forward = camera.basis
    offset = np.asarray(tuple(point)) - camera.eye
    half = camera.rays(size)["half_size"]
    scale = 1.0 if camera.orthographic else float(offset @ forward)
    return (
        (float(offset @ right) / (half[0] * scale) + 1) * size[0] / 2,
        (1 - float(offset @ up) / (half[1] * scale)) * size[1] / 2,
    )


# -- cuts with a plane ------------------------------------------------------------------------------------------------


def cut_height(plane: Plane, corners: Vector, size: Size, height: float = 0.0) -> float:
    """What the picture of a cut covers from bottom to top, mm; 0 stands for all of the volume, as in render.slice."""
    if height > 0.0:
        return height
    right, up = plane.axes
    offsets = np.asarray(corners) - plane.origin
    tall, wide = 2 * np.abs(offsets @ up).max(), 2 * np.abs(offsets @ right).max()
    return float(max(tall, wide * size[1] / size[0]))


def on_plane(plane: Plane, height: float, size: Size, at: Point) -> Vector:
    """The point of the world under a place of the picture of a cut that covers ``height`` mm."""
    right, up = plane.axes
    pixel = height / size[1]
    point: Vector = plane.origin + right * pixel * (at[0] - size[0] / 2) + up * pixel * (size[1] / 2 - at[1])
    return point


def seen_on_plane(plane: Plane, height: float, size: Size, point: Iterable[float]) -> Point:
    """The place of the picture of a cut under which a point of the world lies, along the normal; undoes `on_plane`."""
    right, up = plane.axes
    offset, pixel = np.asarray(tuple(point)) - plane.origin, height / size[1]
    return float(offset @ right) / pixel + size[0] / 2, size[1] / 2 - float(offset @ up) / pixel


def through(plane: Plane, point: Iterable[float]) -> Plane:
    """The plane moved along its normal until it goes through a point."""
    off = float((np.asarray(tuple(point)) - plane.origin) @ plane.unit_normal)
    return Plane(tuple((plane.origin + off * plane.unit_normal).tolist()), plane.normal)


def common_point(planes: Iterable[Plane], near: Iterable[float]) -> Vector:
    """The point of all planes that is nearest to another; where they have none in common, one as near as can be."""
    start, planes = np.asarray(tuple(near), np.float64), list(planes)
    if not planes:
        return start
    normals = np.array([plane.unit_normal for plane in planes])
    offs = np.array([(plane.origin - start) @ plane.unit_normal for plane in planes])
    point: Vector = start + np.linalg.lstsq(normals, offs, rcond=None)[0]
    return point


def scrolled(plane: Plane, world_to_index: Vector, steps: float) -> Plane:
    """The plane moved along its normal by so many voxels."""
    along_voxels = np.asarray(world_to_index)[:3, :3] @ plane.unit_normal
    step = 1.0 / max(float(np.abs(along_voxels).max()), 1e-12)
    return Plane(tuple((plane.origin + plane.unit_normal * step * steps).tolist()), plane.normal)


def windowed(window: tuple[float, float], size: Size, start: Point, end: Point) -> tuple[float, float]:
    """The interval of grey after a drag: to the right makes it wider, upwards makes its values lower (brighter)."""
    low, high = window
    width = max(high - low, 1e-12)
    wider = width * math.exp(2.0 * (end[0] - start[0]) / size[0])
    middle = (low + high) / 2 + width * (end[1] - start[1]) / size[1]
    return middle - wider / 2, middle + wider / 2
