"""Between two cameras, and around what they look at: plain geometry of `Camera` values."""

from __future__ import annotations

import math

import numpy as np

from nodegraph.data import Camera
from nodegraph.data.space import Matrix, Vector, normalize

SAME_UP = 1e-9
"""Least distance between two unit vectors of up that are two directions."""


def rotation(axis: Vector, radians: float) -> Matrix:
    """3x3 rotation about an axis, counter-clockwise seen against it. Source: Rodrigues' formula."""
    x, y, z = normalize(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: Matrix = np.eye(3) + math.sin(radians) * cross + (1.0 - math.cos(radians)) * (cross @ cross)
    return turned


def rotated(camera: Camera, turn: Matrix) -> Camera:
    """The camera carried around its target by a 3x3 rotation of world space."""
    offset = turn @ np.subtract(camera.eye, camera.target)
    return camera.with_(eye=tuple(np.add(camera.target, offset).tolist()), up=tuple((turn @ camera.up).tolist()))


def orbit(camera: Camera, degrees: float) -> Camera:
    """The camera after a turn to its right about its own up, through its target: what a turntable shows."""
    return rotated(camera, rotation(np.asarray(camera.up), math.radians(degrees)))


def between(a: Camera, b: Camera, t: float) -> Camera:
    """The camera a part ``t`` of the way from ``a`` to ``b``; 0 gives ``a`` and 1 gives ``b``, exactly.

    The focus moves on a line. The eye moves on a sphere about it whose radius grows by equal factors, as does the
    height of an orthographic picture, so that a zoom looks even. Two cameras with the same up go around it the
    shorter way and keep the horizon level; others turn about the one axis that takes the first orientation to the
    second (spherical linear interpolation). The projection is that of ``a`` until the end.
    Source: Shoemake 1985, "Animating rotation with quaternion curves".
    """
    if t <= 0.0 or t >= 1.0:
        return a if t <= 0.0 else b
    target = (1.0 - t) * np.asarray(a.target) + t * np.asarray(b.target)
    near, far = np.subtract(a.eye, a.target), np.subtract(b.eye, b.target)
    radius = _even(float(np.linalg.norm(near)), float(np.linalg.norm(far)), t)
    up = normalize(np.asarray(a.up))
    if np.linalg.norm(up - normalize(np.asarray(b.up))) < SAME_UP:
        direction = _level(normalize(near), normalize(far), up, t)
    else:
        start, end = (np.column_stack([right, high, -forward]) for right, high, forward in (a.basis, b.basis))
        turned = _part(end @ start.T, t) @ start
        direction, up = turned[:, 2], turned[:, 1]
    return Camera(
        eye=tuple((target + radius * direction).tolist()),
        target=tuple(target.tolist()),
        up=tuple(up.tolist()),
        projection=a.projection,
        field_of_view=(1.0 - t) * a.field_of_view + t * b.field_of_view,
        height=_even(a.height, b.height, t),
    )


def _even(a: float, b: float, t: float) -> float:
    """Between two positive numbers, by equal factors."""
    return math.exp((1.0 - t) * math.log(a) + t * math.log(b))


def _level(a: Vector, b: Vector, up: Vector, t: float) -> Vector:
    """Between two directions around an axis: azimuth the shorter way, elevation evenly."""
    across = normalize(a - (a @ up) * up)
    beside = np.cross(up, across)
    azimuth = math.atan2(float(b @ beside), float(b @ across))
    low, high = (math.asin(max(-1.0, min(1.0, float(d @ up)))) for d in (a, b))
    elevation = (1.0 - t) * low + t * high
    flat = math.cos(t * azimuth) * across + math.sin(t * azimuth) * beside
    direction: Vector = math.cos(elevation) * flat + math.sin(elevation) * up
    return direction


def _part(turn: Matrix, t: float) -> Matrix:
    """A part of a rotation, about the same axis. Half a turn has two axes of equal right; one is taken."""
    sine = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2.0
    angle = math.atan2(float(np.linalg.norm(sine)), (float(np.trace(turn)) - 1.0) / 2.0)
    if angle < 1e-12:
        return np.eye(3)
    if math.pi - angle > 1e-6:
        return rotation(sine, t * angle)
    outer = (turn + np.eye(3)) / 2.0  # axis times its transpose
    return rotation(outer[:, int(np.argmax(np.diag(outer)))], t * angle)
