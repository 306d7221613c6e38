"""Small renderings of volumes and meshes with numpy alone: they need no device, and may be cancelled at any step.

Both look at the scene from the front, right and above, without perspective, lit from the eye. Coordinates are world
millimetres in LPS: x to the patient's left, y to the back, z up.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from nodegraph.data import Labels, Mesh, Volume
from nodegraph.data.buffer import Array

Floats = NDArray[np.float32]
Cancelled = Callable[[], bool]

FORWARD = np.array([-0.45, 0.84, -0.31]) / np.linalg.norm([-0.45, 0.84, -0.31])
RIGHT = np.cross(FORWARD, [0.0, 0.0, 1.0]) / np.linalg.norm(np.cross(FORWARD, [0.0, 0.0, 1.0]))
UP = np.cross(RIGHT, FORWARD)
FINEST = 64
"""Most samples of a volume along each axis: a sketch has no more pixels for them."""
THRESHOLD = 0.22
"""Normalised values up to this are transparent."""
LARGEST = 1 << 28
"""Bytes of a volume in a file that a sketch may read as a whole."""
DARK, BRIGHT = np.array([0.62, 0.36, 0.26], np.float32), np.array([1.0, 0.95, 0.86], np.float32)
MESH = np.array([0.62, 0.76, 0.66], np.float32)


def reduced(grid: Volume | Labels) -> tuple[Array, NDArray[np.float64]] | None:
    """Every n-th voxel, at most `FINEST` along an axis, and the matrix from world to its indices (x, y, z).

    None where all of a large file would have to be read for it.
    """
    if grid.buffer.chunks is not None and not grid.buffer.resident and grid.buffer.nbytes > LARGEST:
        return None
    data = grid.data if grid.data.ndim == 3 else grid.data[..., 0]
    steps = [max(1, -(-size // FINEST)) for size in data.shape]
    starts = [step // 2 if size > step // 2 else 0 for step, size in zip(steps, data.shape, strict=True)]
    picked = data[starts[0] :: steps[0], starts[1] :: steps[1], starts[2] :: steps[2]]
    to_index = np.array(grid.world_to_index, np.float64)
    to_index[:3, 3] -= starts[::-1]
    to_index[:3] /= np.array(steps[::-1], np.float64)[:, None]
    return np.ascontiguousarray(picked), to_index


def cast(grid: Volume | Labels, edge: int, cancelled: Cancelled) -> NDArray[np.uint8] | None:
    """A ray-cast of a volume, (edge, edge, 4) RGBA with straight alpha; labels as solids in their colours.

    The usual values, from the first to the 99.5th percentile, run from transparent and dark to dense and bright.
    None where it was cancelled, or cannot be made.
    """
    found = reduced(grid)
    if found is None:
        return None
    data, to_index = found
    labels = isinstance(grid, Labels)
    values = data if labels else _normalised(data)
    normals = _normals((values > 0).astype(np.float32) if labels else values, to_index)
    left, bottom, near, radius, deep = _extent(values, to_index, 0 if labels else THRESHOLD)
    across = (np.arange(edge) + 0.5) / edge * 2 - 1
    x, y = np.meshgrid(left + across * radius, bottom - across * radius)
    start = x[..., None] * RIGHT + y[..., None] * UP + near * FORWARD
    first = (start.reshape(-1, 3) @ to_index[:3, :3].T + to_index[:3, 3]).astype(np.float32)
    count = FINEST * 3 // 2
    step = (to_index[:3, :3] @ FORWARD * (deep / count)).astype(np.float32)
    shape = np.array(data.shape[::-1], np.float32)
    color = np.zeros((edge * edge, 3), np.float32)
    through = np.ones(edge * edge, np.float32)
    flat = np.ascontiguousarray(values).reshape(-1)
    for i in range(count):
        if cancelled():
            return None
        at = first + (i + 0.5) * step
        inside = np.flatnonzero(((at > -0.5) & (at < shape - 0.5)).all(axis=1) & (through > 0.02))
        if not inside.size:
            continue
        at = at[inside]
        near = np.clip(np.rint(at), 0, shape - 1).astype(np.int64)
        place = (near[:, 2] * data.shape[1] + near[:, 1]) * data.shape[2] + near[:, 0]
        if labels:
            ids = flat[place]
            opacity = (ids != 0).astype(np.float32) * 0.9
            tint = label_colors(ids).astype(np.float32) / 255.0
        else:
            value = _linear(values, at)
            opacity = 1.0 - np.exp(-9.0 * np.maximum(value - THRESHOLD, 0.0) ** 1.5)
            tint = DARK + np.clip(value * 1.2 - 0.2, 0.0, 1.0)[:, None] * (BRIGHT - DARK)
        light = 0.3 + 0.7 * np.abs(normals[place] @ FORWARD.astype(np.float32))
        weight = through[inside] * opacity
        color[inside] += (weight * light)[:, None] * tint
        through[inside] *= 1.0 - opacity
    return _picture(color, 1.0 - through, edge)


def draw(mesh: Mesh, edge: int, cancelled: Cancelled) -> NDArray[np.uint8] | None:
    """A mesh with flat shading on both sides, (edge, edge, 4) RGBA with straight alpha; None where it was cancelled.

    Points are spread over every triangle, a few for each pixel that it covers, and the nearest in each pixel is kept.
    """
    corners, faces = mesh.vertices, mesh.triangles.astype(np.int64)
    if not len(faces):
        return None
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = (edge - 2) / (float(np.linalg.norm(high - low)) or 1.0)
    moved = (corners - (low + high) / 2) * scale
    seen = np.column_stack([moved @ RIGHT, -(moved @ UP), moved @ FORWARD])
    a, b, c = (seen[faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    light = 0.25 + 0.75 * np.abs(normal[:, 2]) / np.where(length > 0, length, 1.0)
    points = np.minimum(np.ceil(np.abs(normal[:, 2]) / 2 * 4).astype(np.int64) + 1, 4 * edge * edge)
    depth = np.full(edge * edge, np.inf, np.float32)
    shade = np.zeros(edge * edge, np.float32)
    done = 0
    while done < len(faces):
        if cancelled():
            return None
        last = max(done + 1, int(np.searchsorted(np.cumsum(points[done:]), 1 << 17)) + done)
        owner = np.repeat(np.arange(done, last), points[done:last])
        number = np.arange(len(owner)) - np.repeat(np.cumsum(points[done:last]) - points[done:last], points[done:last])
        # A sequence of low discrepancy; what falls beyond the diagonal is folded back into the triangle.
        u, v = (number * 0.7548776662 + 0.5) % 1.0, (number * 0.5698402910 + 0.5) % 1.0
        beyond = u + v > 1.0
        u, v = np.where(beyond, 1.0 - u, u), np.where(beyond, 1.0 - v, v)
        spot = a[owner] + u[:, None] * (b - a)[owner] + v[:, None] * (c - a)[owner]
        pixel = np.floor(spot[:, :2] + edge / 2).astype(np.int64)
        kept = ((pixel >= 0) & (pixel < edge)).all(axis=1)
        place = pixel[kept, 1] * edge + pixel[kept, 0]
        far = spot[kept, 2].astype(np.float32)
        order = np.argsort(-far, kind="stable")  # the nearest is written last
        place, far, lit = place[order], far[order], light[owner[kept]][order].astype(np.float32)
        nearer = far < depth[place]
        depth[place[nearer]], shade[place[nearer]] = far[nearer], lit[nearer]
        done = last
    covered = np.isfinite(depth)
    return _picture(np.where(covered, shade, 0.0)[:, None] * MESH, covered.astype(np.float32), edge)


def label_colors(ids: Array) -> NDArray[np.uint8]:
    """A colour for each id, (..., 3); 0 is black. Neighbouring ids differ much in hue: golden angle."""
    hue = (np.asarray(ids, np.float64) * 0.61803398875) % 1.0
    parts = [np.clip(np.abs((hue * 6.0 + shift) % 6.0 - 3.0) - 1.0, 0.0, 1.0) for shift in (0.0, 4.0, 2.0)]
    color = 0.35 + 0.6 * np.stack(parts, axis=-1)
    color[np.asarray(ids) == 0] = 0.0
    return np.asarray(np.rint(color * 255.0), np.uint8)


def _extent(values: Array, to_index: NDArray[np.float64], threshold: float) -> tuple[float, float, float, float, float]:
    """What the picture shows: the middle of all that is not transparent along RIGHT and UP, its near end along FORWARD.

    Then half the side of the square that holds it and how deep it is, all in mm; of a volume without any, all of it.
    """
    there = np.argwhere(values > threshold)[:, ::-1]
    if not len(there):
        there = np.array([[0, 0, 0], values.shape[::-1]])
    world = (there - to_index[:3, 3]) @ np.linalg.inv(to_index[:3, :3]).T
    spans = [(float((world @ way).min()), float((world @ way).max())) for way in (RIGHT, UP, FORWARD)]
    voxel = float(np.linalg.norm(np.linalg.inv(to_index[:3, :3]), axis=0).max())
    (left, right), (low, high), (near, far) = spans
    radius = max(right - left, high - low) / 2 * 1.04 + voxel
    return (left + right) / 2, (low + high) / 2, near - voxel, radius, far - near + 2 * voxel


def _picture(color: Floats, alpha: Floats, edge: int) -> NDArray[np.uint8]:
    straight = color / np.maximum(alpha, 1e-6)[:, None]
    pixels = np.concatenate([straight, alpha[:, None]], axis=1)
    return np.asarray(np.rint(np.clip(pixels, 0.0, 1.0) * 255.0), np.uint8).reshape(edge, edge, 4)


def _normalised(data: Array) -> Floats:
    values = data.astype(np.float32)
    finite = np.isfinite(values)
    if not finite.any():
        return np.zeros(values.shape, np.float32)
    low, high = np.percentile(values[finite], (1.0, 99.5))
    if high <= low:
        low, high = float(values[finite].min()), float(values[finite].max())
    scaled = (np.where(finite, values, low) - low) / ((high - low) or 1.0)
    return np.asarray(np.clip(scaled, 0.0, 1.0), np.float32)


def _normals(values: Floats, to_index: NDArray[np.float64]) -> Floats:
    """Unit gradients in the world, one row for each voxel."""
    slopes = [np.gradient(values, axis=axis) if values.shape[axis] > 1 else np.zeros_like(values) for axis in (2, 1, 0)]
    world = np.stack(slopes, axis=-1).reshape(-1, 3) @ to_index[:3, :3].astype(np.float32)
    length = np.linalg.norm(world, axis=1, keepdims=True)
    return np.asarray(world / np.maximum(length, 1e-12), np.float32)


def _linear(values: Floats, at: Floats) -> Floats:
    """Trilinear interpolation at indices (n, 3) as x, y, z; beyond the outer voxels their values go on."""
    sizes = np.array(values.shape[::-1])
    at = np.clip(at, 0.0, (sizes - 1).astype(np.float32))
    low = np.minimum(at.astype(np.int64), np.maximum(sizes - 2, 0))
    part = at - low
    high = np.minimum(low + 1, sizes - 1)
    total = np.zeros(len(at), np.float32)
    for z, fz in ((low[:, 2], 1.0 - part[:, 2]), (high[:, 2], part[:, 2])):
        for y, fy in ((low[:, 1], 1.0 - part[:, 1]), (high[:, 1], part[:, 1])):
            for x, fx in ((low[:, 0], 1.0 - part[:, 0]), (high[:, 0], part[:, 0])):
                total += values[z, y, x] * (fz * fy * fx)
    return total
