"""Volumes and cameras drawn from a seed: what a ray-caster may be given."""

from __future__ import annotations

import numpy as np

from nodegraph.data import Camera, Mapping, Volume
from nodegraph.data.space import centred

TYPES = (np.float32, np.int16, np.uint8, np.float64)
"""Of voxels."""


def random_volume(rng, dtype):
    """Balls and a sheet in a void whose value is constant, with some noise in places, and holes where it is a float."""
    dims = tuple(int(n) for n in np.exp(rng.uniform(np.log(2), np.log(70), 3)))
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in dims[::-1]), indexing="ij")
    field = np.zeros(dims[::-1])
    for _ in range(rng.integers(1, 4)):
        cx, cy, cz = rng.uniform(-0.8, 0.8, 3)
        r2 = (x - cx) ** 2 + (y - cy) ** 2 + (z - cz) ** 2
        field = np.maximum(field, rng.uniform(0.3, 1.0) * np.clip(1.2 - r2 / rng.uniform(0.01, 0.4), 0.0, 1.0))
    if rng.random() < 0.3:
        field += 0.4 * (np.abs(x + 0.3 * y) < 0.05)
    if rng.random() < 0.4:
        field += rng.uniform(0.0, 0.2) * rng.random(field.shape) * (z > rng.uniform(-1, 1))
    spacing = np.exp(rng.uniform(-1.0, 1.0, 3)) * 10.0 ** rng.integers(-2, 3)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    placed = np.eye(4)
    if rng.random() < 0.6:
        placed[:3, :3] = turn
    placed[:3, 3] = rng.uniform(-1, 1, 3) * 100.0 * rng.integers(0, 2)
    placed = placed @ centred(dims, spacing)
    if np.dtype(dtype).kind == "f":
        data = field.astype(dtype)
        for hole in (np.nan, np.inf, -np.inf):
            if rng.random() < 0.25:
                data[rng.random(data.shape) < rng.choice([0.001, 0.02])] = hole
        return Volume(data, placed), 0.0, 1.0
    scale, offset = float(rng.choice([1.0, 0.5, -2.0])), float(rng.choice([0.0, -1024.0]))
    high = 250.0 if dtype == np.uint8 else 3000.0
    data = np.clip(np.round(field * high / 1.6), 0, high).astype(dtype)
    return Volume(data, placed, Mapping(scale, offset)), offset, high / 1.6 * scale


def random_camera(rng, volume):
    """Outside, inside, orthographic; a third along an axis of the volume, so that rays lie in planes of voxels."""
    middle = volume.corners.mean(axis=0)
    diagonal = float(np.linalg.norm(volume.corners[7] - volume.corners[0]))
    axes = volume.index_to_world[:3, :3]
    along = rng.random() < 0.35
    direction = axes[:, rng.integers(3)] * rng.choice([-1, 1]) if along else rng.normal(size=3)
    direction = direction / np.linalg.norm(direction)
    target = middle if along else middle + 0.1 * diagonal * rng.normal(size=3)
    away = diagonal * rng.choice([0.02, 0.3, 1.0, 2.0, 40.0])
    projection = "orthographic" if rng.random() < 0.4 else "perspective"
    lens = {"height": diagonal * 0.8} if projection == "orthographic" else {
        "field_of_view": float(np.clip(np.degrees(2 * np.arctan(0.45 * diagonal / away)), 1.0, 90.0))
    }  # fmt: skip
    up = axes[:, int(np.argmin(np.abs(axes.T @ direction)))]
    return Camera(eye=target - direction * away, target=target, up=up, projection=projection, **lens), away, diagonal
