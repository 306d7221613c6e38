"""What the files of other programs hold, and random things to write."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

FILES = Path(__file__).parent / "files"

_Z, _Y, _X = np.meshgrid(np.arange(4), np.arange(5), np.arange(6), indexing="ij")
SCALAR = (_X + 10 * _Y + 100 * _Z - 50).astype(np.int16)
VECTOR = np.stack([SCALAR + 1000 * c for c in range(3)], -1).astype(np.float32)

_C, _S = math.cos(0.3), math.sin(0.3)
MATRIX = np.array([[1, 0, 0, -12.5], [0, _C, -_S, 40.25], [0, _S, _C, 1000.125], [0, 0, 0, 1]]) @ np.diag(
    [0.5, 1.25, 3.0, 1.0]
)


def oblique(rng: np.random.Generator) -> np.ndarray:
    """A turned, anisotropic index-to-world matrix."""
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    matrix = np.eye(4)
    matrix[:3, :3] = q * np.sign(np.linalg.det(q)) * rng.uniform(0.1, 5.0, 3)
    matrix[:3, 3] = rng.uniform(-300, 300, 3)
    return matrix


def turned(rng: np.random.Generator, dtype: str, shape: tuple[int, ...] = (3, 4, 5)) -> np.ndarray:
    """Random numbers over the whole range of a type."""
    if np.dtype(dtype).kind == "f":
        return rng.normal(size=shape).astype(dtype)
    info = np.iinfo(dtype)
    return rng.integers(info.min, info.max, shape, np.dtype(dtype), endpoint=True)
