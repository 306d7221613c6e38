"""Triangle meshes in world space."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.buffer import Array, Buffer
from nodegraph.data.value import Parts, Value
from nodegraph.errors import PortError


class Mesh(Value):
    """Triangles: ``vertices`` (n, 3) world mm, ``triangles`` (m, 3) indices, counter-clockwise seen from outside."""

    kind: ClassVar[str] = "Mesh"
    _vertices: Buffer
    _triangles: Buffer

    def __init__(self, vertices: Any, triangles: Any) -> None:
        points = np.ascontiguousarray(vertices, np.float64)
        indices = np.asarray(triangles)
        if indices.size and (indices.dtype.kind not in "iu" or int(indices.min()) < 0):
            raise PortError(f"Mesh: expected triangles of indices from 0, got {indices.dtype} from {indices.min()}")
        faces = np.ascontiguousarray(indices, np.uint32)
        if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
            raise PortError(f"Mesh: expected finite vertices (n, 3), got shape {points.shape}")
        if faces.ndim != 2 or faces.shape[1] != 3:
            raise PortError(f"Mesh: expected triangles (m, 3), got shape {faces.shape}")
        if faces.size and int(faces.max()) >= len(points):
            raise PortError(f"Mesh: triangle index {int(faces.max())} is outside 0..{len(points) - 1}")
        self._set(_vertices=Buffer(points), _triangles=Buffer(faces))

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(n, 3) world mm."""
        return self._vertices.array

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """(m, 3) indices into `vertices`."""
        return self._triangles.array

    @property
    def buffers(self) -> tuple[Buffer, ...]:
        return self._vertices, self._triangles

    def planes(self) -> NDArray[np.float64]:
        """The distinct planes of the faces, (k, 4): ``normal . p + d <= 0`` inside, unit normals, mm.

        Faces without area are left out. For a convex closed mesh these planes are the mesh.
        """
        a, b, c = (self.vertices[self.triangles[:, i]] for i in range(3))
        normals = np.cross(b - a, c - a)
        lengths = np.linalg.norm(normals, axis=1)
        extent = float(np.ptp(self.vertices, axis=0).max()) if len(self.vertices) else 0.0
        keep = lengths > 1e-12 * extent * extent
        normals, anchors = normals[keep] / lengths[keep, None], a[keep]
        # About a vertex instead of the origin: far away, the distances would have no digits left to compare.
        reach = np.einsum("ij,ij->i", normals, anchors - self.vertices[:1])
        distinct: list[int] = []
        left = np.arange(len(normals))
        while left.size:
            first = left[0]
            distinct.append(int(first))
            turned = np.abs(normals[left] - normals[first]).max(axis=1) >= 1e-9
            left = left[turned | (np.abs(reach[left] - reach[first]) > 1e-9 * extent)]
        offsets = -np.einsum("ij,ij->i", normals[distinct], anchors[distinct])
        return np.column_stack([normals[distinct], offsets]).reshape(-1, 4)

    def is_closed(self) -> bool:
        """True when every edge has a neighbour that runs the other way; vertices at one place count as one."""
        extent = float(np.ptp(self.vertices, axis=0).max()) if len(self.vertices) else 0.0
        if not self.triangles.size or extent == 0.0:
            return False
        places = np.round((self.vertices - self.vertices[0]) / (1e-9 * extent)).astype(np.int64)
        _, same = np.unique(places, axis=0, return_inverse=True)
        faces = same.reshape(-1)[self.triangles].astype(np.int64)
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        edges = edges[edges[:, 0] != edges[:, 1]]
        there, back = np.sort(edges @ [len(places), 1]), np.sort(edges @ [1, len(places)])
        return bool(len(edges)) and bool((there == back).all())

    def is_convex(self) -> bool:
        """True when the mesh is closed and no vertex lies outside any face: it is the intersection of its planes."""
        planes = self.planes()
        if not len(planes) or not self.is_closed():
            return False
        extent = float(np.ptp(self.vertices, axis=0).max())
        used = self.vertices[np.unique(self.triangles)]
        return all(bool((used @ plane[:3] + plane[3] <= 1e-6 * extent).all()) for plane in planes)

    def summary(self) -> str:
        return f"{len(self.vertices)} vertices, {len(self.triangles)} triangles"

    def to_parts(self) -> Parts:
        return {}, {"vertices": self.vertices, "triangles": self.triangles}

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: dict[str, Array]) -> Mesh:
        return cls(arrays["vertices"], arrays["triangles"])


BOX_TRIANGLES = np.array(
    [
        [[0, 2, 1], [1, 2, 3]],
        [[4, 5, 6], [5, 7, 6]],
        [[0, 1, 4], [1, 5, 4]],
        [[2, 6, 3], [3, 6, 7]],
        [[0, 4, 2], [2, 4, 6]],
        [[1, 3, 5], [3, 7, 5]],
    ]
).reshape(12, 3)
"""Faces of a box whose corner i has its x, y, z high where bits 0, 1, 2 of i are set."""


def box(corners: Any) -> Mesh:
    """The closed mesh of a parallelepiped with corners (8, 3) in bit order (x lowest), facing outwards."""
    points = np.asarray(corners, np.float64)
    edges = points[[1, 2, 4]] - points[0]
    flipped = float(np.linalg.det(edges)) < 0.0
    return Mesh(points, BOX_TRIANGLES[:, ::-1] if flipped else BOX_TRIANGLES)
