"""Answers that can be written down: what a picture or a filtered field must be, in double precision and numpy alone.

Nothing here is shared with kernels or processors; cameras are worked out anew from their numbers. Lengths are mm.
"""

from __future__ import annotations

import math

import numpy as np


def phi(x):
    """The normal distribution: share of a Gaussian of width 1 below x."""
    return 0.5 * np.vectorize(math.erfc)(-np.asarray(x, np.float64) / math.sqrt(2.0))


# Rays -----------------------------------------------------------------------------------------------------------------


def axes(camera):
    """Unit vectors right, up and forward of a camera, from its eye, target and up."""
    forward = np.subtract(camera.target, camera.eye)
    forward = forward / np.linalg.norm(forward)
    right = np.cross(forward, camera.up)
    right = right / np.linalg.norm(right)
    return right, np.cross(right, forward), forward


def film(camera, size):
    """Where the middles of pixels lie: (h, w) to the right and upwards, in tangents (perspective) or mm."""
    tangent = math.tan(math.radians(camera.field_of_view / 2))
    half = camera.height / 2 if camera.projection == "orthographic" else tangent
    y, x = np.mgrid[: size[1], : size[0]] + 0.5
    pixel = 2 * half / size[1]
    return (x - size[0] / 2) * pixel, (size[1] / 2 - y) * pixel


def rays(camera, size):
    """Origins and unit directions in world space (h, w, 3), and their cosines to the axis of view (h, w)."""
    right, up, forward = axes(camera)
    across, upwards = film(camera, size)
    offset = across[..., None] * right + upwards[..., None] * up
    if camera.projection == "orthographic":
        return np.asarray(camera.eye) + offset, np.broadcast_to(forward, offset.shape), np.ones(across.shape)
    length = np.sqrt(1 + across**2 + upwards**2)
    return np.broadcast_to(camera.eye, offset.shape), (forward + offset) / length[..., None], 1 / length


def box_interval(origins, directions, low, high):
    """Distances (h, w) at which rays enter and leave an axis-aligned box; entry > exit where they miss."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (low - origins) / directions, (high - origins) / directions
    return np.nanmax(np.minimum(a, b), axis=-1), np.nanmin(np.maximum(a, b), axis=-1)


def closest(origins, directions, point):
    """Distance along each ray to where it is closest to a point, and how close it comes there, both (h, w)."""
    to_point = np.asarray(point) - origins
    along = (to_point * directions).sum(axis=-1)
    return along, np.sqrt(np.maximum((to_point**2).sum(axis=-1) - along**2, 0.0))


def ball_entry(origins, directions, centre, radius):
    """Distances (h, w) at which rays meet a sphere first; NaN where they miss."""
    along, off = closest(origins, directions, centre)
    with np.errstate(invalid="ignore"):
        return along - np.sqrt(radius**2 - off**2)


def plane_depth(camera, size, normal, distance):
    """Depth (h, w) of a plane through the middle of the view at ``distance``; its normal is given in eye space
    (x right, y up, z to the viewer). With a pixel at (x, y, -1) z: n . (x, y, -1) z = -n_z distance."""
    across, upwards = film(camera, size)
    nx, ny, nz = normal
    if camera.projection == "orthographic":
        return distance + (nx * across + ny * upwards) / nz
    return nz * distance / (nz - nx * across - ny * upwards)


# Emission and absorption ----------------------------------------------------------------------------------------------


def gaussian_optical_depth(extinction, width, off, low, high):
    """Of the extinction e exp(-r^2 / 2 w^2) along a ray that passes its centre at ``off``, between two signed distances
    from there: r^2 = off^2 + s^2, so e exp(-off^2 / 2 w^2) times a Gaussian's integral, w sqrt(2 pi) (Phi - Phi)."""
    share = phi(np.asarray(high) / width) - phi(np.asarray(low) / width)
    return extinction * width * math.sqrt(2 * math.pi) * np.exp(-(np.asarray(off) ** 2) / (2 * width**2)) * share


def ramp_of_colour(extinction, length, first, last):
    """Emission of a homogeneous slab whose colour goes linearly from ``first`` to ``last``.

    The integral of (a + b t) e exp(-e t) over 0..L, by parts: a (1 - T) + b ((1 - T) / e - L T), T = exp(-e L).
    """
    seen = math.exp(-extinction * length)
    slope = (np.asarray(last) - np.asarray(first)) / length
    return np.asarray(first) * (1 - seen) + slope * ((1 - seen) / extinction - length * seen)


def layers(slabs):
    """RGBA of slabs (opacity, rgb) laid behind each other, first in front: sum of c_i a_i prod_{j < i} (1 - a_j)."""
    color, clear = np.zeros(3), 1.0
    for opacity, rgb in slabs:
        color = color + clear * opacity * np.asarray(rgb)
        clear *= 1 - opacity
    return np.array([*color, 1 - clear])


# Shapes ---------------------------------------------------------------------------------------------------------------


def outline(camera, points):
    """Corners (n, 2) of the convex outline of points as the camera sees them, in the units of `film`."""
    from scipy.spatial import ConvexHull

    right, up, forward = axes(camera)
    p = np.asarray(points) - camera.eye
    seen = np.stack([p @ right, p @ up], axis=-1)
    if camera.projection != "orthographic":
        seen = seen / (p @ forward)[:, None]
    return seen[ConvexHull(seen).vertices]


def area_and_perimeter(polygon):
    """Of a polygon (n, 2): half the sum of cross products of neighbouring corners, and the sum of sides."""
    following = np.roll(polygon, -1, axis=0)
    cross = polygon[:, 0] * following[:, 1] - polygon[:, 1] * following[:, 0]
    return abs(cross.sum()) / 2, np.linalg.norm(following - polygon, axis=1).sum()


# Screen space ---------------------------------------------------------------------------------------------------------


def step_edge_blur(x, jump, sigma):
    """G * D - D at ``x`` behind the edge of a depth that falls by ``jump`` there: -jump (1 - Phi(x / sigma))."""
    return -jump * (1 - phi(np.asarray(x) / sigma))


def corner_blur(x, y, jump, sigma):
    """The same within a quarter of the plane that lies deeper than the rest: G is a product, so is the share of it."""
    return -jump * (1 - phi(np.asarray(x) / sigma) * phi(np.asarray(y) / sigma))


def cap_share(x, radius):
    """Volume of the part of a ball beyond a plane at distance x from its middle, over that of half the ball:
    the integral of pi (R^2 - u^2) over x..R, over 2/3 pi R^3 = (1 - q)^2 (2 + q) / 2 with q = x / R."""
    q = np.clip(np.asarray(x, np.float64) / radius, 0.0, 1.0)
    return (1 - q) ** 2 * (2 + q) / 2


def step_edge_occlusion(x, jump, radius, thickness):
    """Share of the half ball before a plane that faces the viewer which lies behind a parallel nearer plane.

    The nearer plane is ``jump`` in front and ends ``x`` beside the point. Hidden is u > x, -jump < w < -jump +
    thickness, with w < 0 (before the plane): at each w a segment of a disc of radius r = sqrt(R^2 - w^2), of area
    r^2 acos(x / r) - x sqrt(r^2 - x^2). The integral over w is done by 200 Gauss-Legendre points in the angle.
    """
    x = np.atleast_1d(np.asarray(x, np.float64))[:, None]
    low, high = -min(jump, radius), min(0.0, thickness - jump)
    if high <= low:
        return np.zeros(len(x))
    nodes, weights = np.polynomial.legendre.leggauss(200)
    first, last = math.asin(low / radius), math.asin(high / radius)
    angle = first + (last - first) * (nodes + 1) / 2
    r = radius * np.cos(angle)  # w = R sin(angle), dw = R cos(angle) d(angle)
    q = np.clip(x / r, -1.0, 1.0)
    segment = r**2 * np.arccos(q) - x * np.sqrt(np.maximum(r**2 - x**2, 0.0))
    volume = (segment * r * weights).sum(axis=1) * (last - first) / 2
    return volume / (2 / 3 * math.pi * radius**3)
