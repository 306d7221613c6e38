"""The scene that every ray-caster of the benchmarks renders: a phantom like a CT of a chest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from nodegraph.data import Camera, TransferFunction, Volume
from nodegraph.data.space import centred

SIDE = 256
SIZE = (512, 512)
STEP = 1.0  # mm; voxels are 1 mm

# Centre and half axes in units of the half side, value in HU; later ones lie over earlier ones.
ELLIPSOIDS = (
    ((0.0, 0.0, 0.0), (0.86, 0.62, 0.95), 40),  # body
    ((0.0, 0.0, 0.0), (0.80, 0.56, 0.93), 45),  # muscle
    ((-0.38, 0.0, 0.05), (0.30, 0.42, 0.70), -820),  # right lung
    ((0.38, 0.0, 0.05), (0.30, 0.42, 0.70), -820),  # left lung
    ((0.05, -0.05, -0.05), (0.24, 0.26, 0.30), 220),  # heart with contrast
    ((0.0, 0.42, 0.0), (0.10, 0.10, 0.95), 650),  # spine
    ((0.10, 0.24, 0.1), (0.06, 0.06, 0.80), 320),  # aorta
)


@dataclass(frozen=True)
class Scene:
    volume: Volume
    camera: Camera
    transfer_function: TransferFunction


def phantom(side: int = SIDE) -> NDArray[np.int16]:
    """(z, y, x) int16 in HU, smooth borders of about two voxels, ribs and a little texture, made slice by slice."""
    axis = (np.arange(side, dtype=np.float32) + 0.5) / side * 2 - 1
    y, x = axis[:, None], axis[None, :]
    data = np.empty((side, side, side), np.int16)
    softness = 2.0 / side
    for k, z in enumerate(axis):
        plane = np.full((side, side), -1000.0, np.float32)
        for (cx, cy, cz), (ax, ay, az), value in ELLIPSOIDS:
            radius = np.sqrt(((x - cx) / ax) ** 2 + ((y - cy) / ay) ** 2 + ((z - cz) / az) ** 2)
            inside = np.clip((1.0 - radius) * min(ax, ay, az) / (2 * softness) + 0.5, 0.0, 1.0)
            plane += inside * (value - plane)
        ring = np.abs(np.sqrt((x / 0.80) ** 2 + (y / 0.56) ** 2) - 0.97)
        ribs = np.clip(1.0 - ring / 0.03, 0.0, 1.0) * max(0.0, float(np.cos(z * 31.0)))
        plane += ribs * (500.0 - plane) * (abs(float(z)) < 0.8)
        plane += 12.0 * np.sin(23.0 * x + 17.0 * y + 29.0 * z)
        data[k] = np.rint(plane).astype(np.int16)
    return data


def scene(side: int = SIDE) -> Scene:
    """Phantom, camera and transfer function; the field of view holds the whole volume."""
    data = phantom(side)
    volume = Volume(data, centred((side, side, side), (256.0 / side,) * 3))
    camera = Camera(eye=(180.0, -560.0, 120.0), target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), field_of_view=30.0)
    keys = [
        (0.0, (0.8, 0.3, 0.2), 0.0),
        (50.0, (0.8, 0.3, 0.2), 0.002),
        (220.0, (0.9, 0.35, 0.25), 0.02),
        (350.0, (1.0, 0.7, 0.5), 0.10),
        (700.0, (1.0, 0.95, 0.85), 0.35),
    ]
    return Scene(volume, camera, TransferFunction(keys, reference_length=1.0))


def table(function: TransferFunction, entries: int = 2048) -> tuple[NDArray[np.float32], float, float]:
    """RGB and extinction per mm, (entries, 4), and the first and last value, for the hand-written peers."""
    low, high = function.domain
    values = np.linspace(low, high, entries)
    keys = function.keys
    at = [key.value for key in keys]
    columns = [np.interp(values, at, [key.color[c] for key in keys]) for c in range(3)]
    extinction = [-np.log1p(-min(key.opacity, 1 - 2.0**-24)) / function.reference_length for key in keys]
    columns.append(np.interp(values, at, extinction))
    return np.stack(columns, axis=1).astype(np.float32), low, high
