"""Coordinate systems: 4x4 matrices between index space and world space.

Index space counts voxels, (x, y, z), with voxel centres at integers. World space is millimetres in LPS
(x to the patient's left, y to the back, z to the head). All of it is double precision.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nodegraph.errors import PortError

Matrix = NDArray[np.float64]
Vector = NDArray[np.float64]


def frozen(array: Any) -> NDArray[np.float64]:
    """Return a read-only double-precision copy."""
    copy = np.array(array, np.float64)
    copy.flags.writeable = False
    return copy


def affine(spacing: Sequence[float] = (1.0, 1.0, 1.0), origin: Sequence[float] = (0.0, 0.0, 0.0)) -> Matrix:
    """Index-to-world matrix of an axis-aligned grid. ``spacing`` and ``origin`` are (x, y, z) in mm."""
    matrix = np.diag([*map(float, spacing), 1.0])
    matrix[:3, 3] = origin
    return matrix


def centred(dims: Sequence[int], spacing: Sequence[float] = (1.0, 1.0, 1.0)) -> Matrix:
    """Index-to-world matrix of an axis-aligned grid whose middle lies at the world's origin."""
    scale = np.asarray(spacing, np.float64)
    return affine(spacing, (-(np.asarray(dims, np.float64) - 1.0) / 2.0 * scale).tolist())


def check_affine(matrix: Any) -> Matrix:
    """Return ``matrix`` as a frozen 4x4 affine, or raise PortError when it is none or is singular."""
    result = frozen(matrix)
    if result.shape != (4, 4):
        raise PortError(f"index_to_world: expected a 4x4 matrix, got shape {result.shape}")
    if not np.isfinite(result).all() or not np.array_equal(result[3], [0.0, 0.0, 0.0, 1.0]):
        raise PortError("index_to_world: expected a finite affine matrix whose last row is 0 0 0 1")
    with np.errstate(over="ignore"):
        lengths = np.linalg.norm(result[:3, :3], axis=0)
    if (lengths == 0.0).any() or abs(np.linalg.det(result[:3, :3] / lengths)) < 1e-9:
        raise PortError("index_to_world: the matrix is singular; a voxel has no volume")
    return result


def invert(matrix: Matrix) -> Matrix:
    """Inverse of an affine matrix, scaled first so that spacings of 1:1000 and of nanometres keep their digits."""
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    linear = np.linalg.inv(matrix[:3, :3] / lengths) / lengths[:, None]
    result = np.eye(4)
    result[:3, :3] = linear
    result[:3, 3] = -linear @ matrix[:3, 3]
    return result


def transform_points(matrix: Matrix, points: Any) -> NDArray[np.float64]:
    """Apply an affine matrix to points (..., 3)."""
    return np.asarray(points, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]


def normalize(vector: Any) -> Vector:
    """Unit vector; the zero vector stays zero."""
    v = np.asarray(vector, np.float64)
    length = math.sqrt(float(v @ v))
    return v / length if length > 0.0 else v
