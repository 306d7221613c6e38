"""Gradients of a scalar volume made beforehand, and whether making them pays for a ray-caster."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from nodegraph.data.camera import Camera
from nodegraph.data.space import affine
from nodegraph.data.volume import Mapping, Volume

SECONDS_PER_VOXEL = 13e-9
"""What it takes to make the gradient of a voxel; with the next measured by tests/benchmarks/bench_gradients.py."""
SECONDS_PER_SAMPLE = {"gl": 32e-9, "cl": 67e-9, "cl64": 67e-9}
"""What one read instead of seven saves of a sample that is lit."""
FRAMES = 4
"""How often a volume is expected to be seen before it changes. A frame of interactive quality has fewer samples, and is
one of many; these make up for each other."""


def index_gradient(volume: Volume, whole: Volume | None = None) -> Volume:
    """Central differences of a scalar volume at its voxels, per index unit, and beside them its value: (z, y, x, 4).

    They are what a ray would find there itself: interpolated between voxels they are the differences of the
    interpolated field. Whole numbers stay whole, all multiplied by the same one. There is a voxel more on each side,
    where the field repeats its edge: towards it differences fall, in the outer half voxel.

    The fourth component is half of what the value is more than `middle` says, so that a sample that is lit takes one
    read. ``whole``: the volume of which this one is a part, and by which all parts are stored alike.
    """
    whole = whole or volume
    data = np.pad(volume.data.reshape(volume.dims[::-1]), 1, mode="edge")
    result = np.empty((*data.shape, 4), gradient_type(whole))
    with np.errstate(invalid="ignore", over="ignore"):  # beside a voxel that is not finite
        for axis in range(3):
            here = np.moveaxis(data, 2 - axis, 0)
            into = np.moveaxis(result[..., axis], 2 - axis, 0)
            n = len(here)
            for i in range(n):
                np.subtract(here[min(i + 1, n - 1)], here[max(i - 1, 0)], out=into[i], dtype=result.dtype)
        # They may have more digits than the result, and in double precision int64 would not be itself.
        wide = np.longdouble if data.dtype.kind in "iu" and data.dtype.itemsize == 8 else np.float64
        less = wide(_stored_middle(whole))
        for values, beside in zip(data, result[..., 3], strict=True):
            np.subtract(values, less, out=beside, dtype=wide, casting="unsafe")
    spread = _spread(whole)
    if spread > 1:
        result *= result.dtype.type(spread)
    placed = volume.index_to_world @ affine(origin=(-1.0, -1.0, -1.0))
    return Volume(result, placed, Mapping(0.5 * volume.mapping.scale / spread))


def middle(volume: Volume) -> float:
    """The value beside which `index_gradient` stores a half of what values are more."""
    return _stored_middle(volume) * volume.mapping.scale + volume.mapping.offset


def _spread(volume: Volume) -> int:
    """By what whole differences are multiplied to fill 16 bits, of which OpenGL loses as much however few are used."""
    if gradient_type(volume).kind != "i":
        return 1
    low, high = volume.range
    return max(1, int(np.iinfo(np.int16).max // max(1.0, round((high - low) / abs(volume.mapping.scale)))))


def _stored_middle(volume: Volume) -> float:
    """What is taken off stored numbers so that digits are left for them: 0 for what single precision holds as it is."""
    if volume.dtype.kind == "f" and volume.dtype.itemsize <= 4:
        return 0.0
    low, high = volume.range
    stored = (0.5 * (low + high) - volume.mapping.offset) / volume.mapping.scale
    return stored if volume.dtype.kind == "f" else float(round(stored))


def gradient_type(volume: Volume) -> np.dtype[np.generic]:
    """What holds differences of voxels without loss: int16 where their range allows, else a float."""
    low, high = volume.range
    whole = volume.dtype.kind in "iu" and volume.dtype.itemsize <= 2
    exact = whole and (high - low) / abs(volume.mapping.scale) < 2**15
    return np.dtype(np.int16 if exact else np.float64 if volume.dtype.itemsize > 4 else np.float32)


def vanishing(volume: Volume) -> float:
    """What may be left of a difference of 0 that is stored as a whole number, per index unit; 0 for floats.

    A 64th of the least difference: OpenGL stores them about the middle of 16 bits, which single precision rounds.
    """
    return abs(volume.mapping.scale) / 128.0 if gradient_type(volume).kind == "i" else 0.0


def visible_samples(
    volume: Volume, camera: Camera, size: tuple[int, int], step_length: float, visible_share: float
) -> float:
    """How many samples, ``step_length`` mm apart, the rays of a picture have in the share of a volume that can be seen.

    By volumes: a sample stands for a pixel's square at the distance of the middle times a step. What lies outside the
    picture or behind what is opaque is counted, too, so it is rather too many.
    """
    edges = volume.index_to_world[:3, :3] * np.asarray(volume.dims)
    away = max(float(np.linalg.norm(volume.centre - camera.eye)), 0.5 * float(np.linalg.norm(edges.sum(axis=1))))
    tangent = math.tan(math.radians(camera.field_of_view) / 2.0)
    pixel = (camera.height if camera.orthographic else 2.0 * tangent * away) / max(size[1], 1)
    covered = abs(float(np.linalg.det(edges))) * visible_share
    samples = covered / (pixel * pixel * step_length)
    diagonal = float(np.linalg.norm(volume.corners[7] - volume.corners[0]))
    return min(samples, size[0] * size[1] * diagonal / step_length)


def saves_time(volume: Volume, samples: float, device: Any) -> tuple[bool, str]:
    """Whether gradients should be made beforehand, and why: figures for `explain`.

    They should where reading them saves, over `FRAMES` frames of ``samples`` samples, more than making them costs,
    and where they fit the ``device``. It is the whole budget that counts and not what is left of it: else gradients
    that were made would speak against themselves.
    """
    shape = tuple(n + 2 for n in volume.dims[::-1])
    voxels = math.prod(shape)
    kind = gradient_type(volume)
    if not device.fits((*shape, 4), kind):
        return False, f"{4 * kind.itemsize * voxels / 2**20:.0f} MiB of them would take too much of the device"
    cost = SECONDS_PER_VOXEL * voxels
    saved = SECONDS_PER_SAMPLE.get(device.name, 0.0) * samples
    figures = f"{cost * 1e3:.3g} ms to make, {saved * 1e3:.3g} ms less a frame for {samples:.3g} samples"
    return cost < FRAMES * saved, f"{figures}, {FRAMES} frames expected"


def beforehand(
    choice: str, volume: Volume, samples: float, device: Any, streamed: bool, left: Callable[[], bool]
) -> tuple[bool, str]:
    """Whether gradients are made once for all voxels, for ``samples`` of them a frame, and why.

    ``choice`` is "automatic", "on_the_fly" or "precomputed"; ``streamed`` volumes are rendered block by block; ``left``
    says whether they are there already, and may be taken though making them would not pay.
    """
    if choice != "automatic":
        return choice == "precomputed", "as is asked for"
    if np.dtype(device.real).itemsize > 4:
        return False, "kept in single precision they would spoil double"
    if streamed:
        return False, "they would be made for each block in each frame"
    pays, why = saves_time(volume, samples, device)
    return (True, "a finer picture has left them") if not pays and left() else (pays, why)
