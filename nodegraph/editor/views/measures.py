"""Distances, angles and regions in the world, and the statistics of the values of a volume in a region. No Qt here.

Source: Rezk-Salama 2001, M16.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nodegraph.data import Plane, Volume
from nodegraph.data.space import Vector, normalize, transform_points

POINTS = {"distance": 2, "angle": 3, "rectangle": 4, "polygon": 3}
"""How many points a kind of measure has; a polygon has at least three."""
REGIONS = ("rectangle", "polygon")
MOST_SAMPLES = 1 << 20
"""On a plane that does not lie along the grid."""
AT_ONCE = 1 << 17
SAME_DIRECTION = 1e-6

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Measure:
    """What somebody measures: points of the world, mm. Those of a region lie in one plane, in order around it."""

    kind: str
    points: tuple[tuple[float, float, float], ...]

    def to_json(self) -> dict[str, Any]:
        return {"kind": self.kind, "points": [list(point) for point in self.points]}

    @classmethod
    def from_json(cls, json: Any) -> Measure | None:
        """The measure, or None where somebody who edited the file made none of it."""
        try:
            kind = json["kind"]
            points = np.asarray(json["points"], np.float64)
        except (KeyError, TypeError, ValueError):
            return None
        if kind not in POINTS or points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            return None
        count = POINTS[kind]
        if len(points) < count or (len(points) > count and kind != "polygon"):
            return None
        return cls(kind, tuple(tuple(point) for point in points.tolist()))

    @property
    def is_region(self) -> bool:
        return self.kind in REGIONS

    @property
    def array(self) -> Points:
        """Points (n, 3)."""
        return np.asarray(self.points, np.float64)


@dataclass(frozen=True, slots=True)
class Statistics:
    """Of the values in a region: how many samples, and of these mean, standard deviation (of all, not of a sample)."""

    count: int
    mean: float
    std: float
    min: float
    max: float
    unit: str = ""


def distance(points: Points) -> float:
    """Between two points, mm."""
    return float(np.linalg.norm(points[1] - points[0]))


def angle(points: Points) -> float:
    """At the second of three points, degrees; NaN where two of them are one."""
    a, b = points[0] - points[1], points[2] - points[1]
    if not a.any() or not b.any():
        return math.nan
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(a, b))), float(a @ b)))


def area(points: Points) -> float:
    """Of a polygon in a plane, mm^2, whatever way it is gone around; NaN where it crosses itself."""
    if crosses_itself(points):
        return math.nan
    return float(np.linalg.norm(_area_vector(points)))


def crosses_itself(points: Points) -> bool:
    """Whether two edges of a polygon that are no neighbours meet."""
    a = _flat(points)
    b, count = np.roll(a, -1, axis=0), len(points)
    starts, ends = _sides(a, b, a), _sides(a, b, b)  # of edge i: where the ends of edge j lie
    apart = starts * ends < 0.0
    edges = np.arange(count)
    gap = (edges[:, None] - edges[None, :]) % count
    return bool((apart & apart.T & (gap > 1) & (gap < count - 1)).any())


def corners_of(plane: Plane, a: Vector, b: Vector) -> Points:
    """The rectangle along the axes of a plane that two points of it span."""
    right, _ = plane.axes
    across = right * float((b - a) @ right)
    return np.array([a, a + across, b, b - across])


def moved(measure: Measure, place: int, point: Vector) -> Measure:
    """The measure with one point elsewhere. A rectangle stays one: the corner across stays where it is."""
    points = measure.array.copy()
    if measure.kind == "rectangle":
        along = [normalize(points[(place + way) % 4] - points[(place + 2) % 4]) for way in (1, 3)]
        fixed = points[(place + 2) % 4]
        for way, axis in zip((1, 3), along, strict=True):
            points[(place + way) % 4] = fixed + axis * float((point - fixed) @ axis)
    points[place] = point
    return Measure(measure.kind, tuple(tuple(one) for one in points.tolist()))


def statistics(volume: Volume, points: Points) -> Statistics | None:
    """Of the real values of a scalar volume inside a polygon in a plane; None where it holds no finite sample.

    On a plane along the grid the samples are the voxels whose centres lie inside; between two layers of voxels, the
    values are interpolated between these. On any other plane they lie a least spacing apart and are interpolated
    linearly. What is outside of the volume does not count. Reads the part of the volume that is needed and no more.
    """
    if crosses_itself(points) or volume.components != 1:
        return None
    indices = _on_grid(volume, points)
    if indices is None:
        indices = _between(volume, points)
    dims = np.asarray(volume.dims)
    inside = ((indices >= -0.5 - 1e-9) & (indices <= dims - 0.5 + 1e-9)).all(axis=1)
    indices = np.clip(indices[inside], 0, dims - 1)
    if not len(indices):
        return None
    parts = [indices[first : first + AT_ONCE] for first in range(0, len(indices), AT_ONCE)]
    values = np.concatenate([_interpolated(volume, part) for part in parts])
    values = values[np.isfinite(values)]
    if not len(values):
        return None
    ends = float(values.min()), float(values.max())
    return Statistics(len(values), float(values.mean()), float(values.std()), *ends, volume.mapping.unit)


def _on_grid(volume: Volume, points: Points) -> Points | None:
    """Indices (n, 3) of the voxels inside a polygon that lies along the grid; None where it does not."""
    normal = normalize(_area_vector(points))
    steps = volume.index_to_world[:3, :3].T @ normal  # how far from the plane one goes with each index
    axis = int(np.argmax(np.abs(steps)))
    others = [i for i in range(3) if i != axis]
    if np.abs(steps[others]).max() > SAME_DIRECTION * abs(steps[axis]):
        return None
    corners = transform_points(volume.world_to_index, points)
    cells = _lattice(corners[:, others], (0.0, 0.0), 1.0, np.asarray(volume.dims)[others])
    depth = float(corners[:, axis].mean())
    nearest = round(depth)
    indices = np.empty((len(cells), 3))
    indices[:, others] = cells
    indices[:, axis] = nearest if abs(depth - nearest) < 1e-3 else depth
    return indices


def _between(volume: Volume, points: Points) -> Points:
    """Index coordinates (n, 3) of places inside a polygon, a least spacing apart, or farther where these are many."""
    right, up = Plane(normal=tuple(_area_vector(points).tolist())).axes
    basis = np.array([right, up])
    flat = (points - points[0]) @ basis.T
    box = np.ptp(flat, axis=0)
    pitch = max(float(volume.spacing.min()), math.sqrt(float(box[0] * box[1]) / MOST_SAMPLES))
    first = flat.min(axis=0) + pitch / 2
    places = _lattice(flat, (float(first[0]), float(first[1])), pitch, None)
    return transform_points(volume.world_to_index, points[0] + places @ basis)


def _lattice(polygon: Points, first: tuple[float, float], pitch: float, ends: NDArray[np.int64] | None) -> Points:
    """Points ``first + pitch * (i, j)`` inside a polygon (n, 2), row by row between the edges that cross the row.

    ends: with it, only 0 <= i < ends[0] and 0 <= j < ends[1].
    """
    low = np.ceil((polygon.min(axis=0) - first) / pitch - 1e-9).astype(int)
    high = np.floor((polygon.max(axis=0) - first) / pitch + 1e-9).astype(int)
    if ends is not None:
        low, high = np.maximum(low, 0), np.minimum(high, ends - 1)
    begins, stops = polygon, np.roll(polygon, -1, axis=0)
    found = []
    for row in range(int(low[1]), int(high[1]) + 1):
        y = first[1] + pitch * row
        cuts = (begins[:, 1] <= y) != (stops[:, 1] <= y)
        a, b = begins[cuts], stops[cuts]
        crossings = np.sort(a[:, 0] + (y - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0]))
        for enters, leaves in crossings.reshape(-1, 2):
            start = max(math.ceil((enters - first[0]) / pitch), int(low[0]))
            stop = min(math.ceil((leaves - first[0]) / pitch), int(high[0]) + 1)
            columns = first[0] + pitch * np.arange(start, stop)
            found.append(np.column_stack([columns, np.full(len(columns), y)]))
    return np.concatenate(found) if found else np.empty((0, 2))


def _interpolated(volume: Volume, indices: Points) -> NDArray[np.float64]:
    """Real values at index coordinates inside the grid, linearly between voxel centres."""
    low = np.floor(indices).astype(int)
    first = low.min(axis=0)
    end = np.minimum(low.max(axis=0) + 2, volume.dims)
    block = volume.part(first, end).real(np.float64)
    weight, low = indices - low, low - first
    top = np.asarray(block.shape[::-1]) - 1
    total = np.zeros(len(indices))
    for corner in range(8):
        steps = np.array([corner & 1, corner >> 1 & 1, corner >> 2 & 1])
        share = np.where(steps, weight, 1.0 - weight).prod(axis=1)
        x, y, z = np.minimum(low + steps, top).T
        values = block[z, y, x]
        total += np.where(share > 0.0, share * values, 0.0)  # a voxel that is not a number counts where it is met
    return total


def _area_vector(points: Points) -> Vector:
    """Along the normal of a polygon, as long as its area. Source: Newell's method."""
    offsets = points - points[0]
    vector: Vector = np.cross(offsets, np.roll(offsets, -1, axis=0)).sum(axis=0) / 2
    return vector


def _flat(points: Points) -> Points:
    """Two coordinates of points in a plane, mm."""
    offsets = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(offsets)
    flat: Points = offsets @ axes[:2].T
    return flat


def _sides(a: Points, b: Points, c: Points) -> Points:
    """Entry (i, j) tells by its sign on which side of the line from a[i] to b[i] the point c[j] lies."""
    way, offset = b - a, c[None] - a[:, None]
    sides: Points = way[:, None, 0] * offset[..., 1] - way[:, None, 1] * offset[..., 0]
    return sides


# -- words ------------------------------------------------------------------------------------------------------------


def length_text(length: float) -> str:
    """A length with its unit, µm where millimetres would be small."""
    return f"{length * 1000:.4g} µm" if 0.0 < length < 0.1 else f"{_number(length)} mm"


def area_text(size: float) -> str:
    """An area with its unit."""
    return f"{size * 1e6:.4g} µm²" if 0.0 < size < 0.01 else f"{_number(size)} mm²"


def volume_text(size: float) -> str:
    """A volume with its unit."""
    return f"{size * 1e9:.4g} µm³" if 0.0 < size < 0.001 else f"{_number(size)} mm³"


def value_text(measure: Measure) -> str:
    """The value of a measure with its unit."""
    points = measure.array
    if measure.kind == "distance":
        return length_text(distance(points))
    if measure.kind == "angle":
        degrees = angle(points)
        return f"{degrees:.1f}°" if math.isfinite(degrees) else "no angle"
    size = area(points)
    return area_text(size) if math.isfinite(size) else "crosses itself"


def statistics_rows(found: Statistics) -> list[str]:
    """Two lines for a plate."""
    unit = f" {found.unit}" if found.unit else ""
    return [
        f"mean {found.mean:.5g} ± {found.std:.4g}{unit}",
        f"{found.min:.5g} .. {found.max:.5g}{unit}, {found.count} samples",
    ]


def _number(number: float) -> str:
    return f"{number:.1f}" if number >= 100 else f"{number:.2f}" if number >= 1 else f"{number:.3f}"
