"""The limit: how many samples and leaps a ray takes at the least, and how long reading what they need takes alone.

Rays are followed as the ray-caster follows them, in numpy: leaps over bricks in which nothing can be seen, unless
nearly all can, then four samples, and so on to the end. llvmpipe runs rays of 4 x 2 pixels in step, so what counts is
the most of any of them.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nodegraph.data import TransferFunction
from nodegraph.data.bricks import BRICK, brick_ranges, brick_reaches, unless_most, visible_bricks
from tests.benchmarks.peers.floor import Stage
from tests.benchmarks.peers.scenes import Scene

STEPS = (2.0, 1.0, 0.5)
TILES = 1500
"""Of 4 x 2 pixels, drawn at random."""
ROUNDING = 1e-3
"""Bricks that a leap stays short of its goal, as in shaders/common/bricks.glsl."""
GROUP = 4
"""Samples that are made without a question between them."""
ROWS = 2048
ENOUGH = 254.0 / 255.0
VOXEL, VALUE = "one voxel, not interpolated", "the value, interpolated"
SAMPLE = "value, table, opacity, blending: a sample"

Numbers = NDArray[np.float64]


@dataclass(frozen=True)
class Counts:
    """On average: segments in the volume, samples that can be seen, samples and leaps that are made in step.

    faint: `skip_opacity` of the ray-caster.
    """

    scene: str
    step: float
    faint: float
    segments: float
    visible: float
    samples: float
    leaps: float

    def seconds(self, pixels: int, lowest: Sequence[Stage], each: str = VALUE) -> float:
        """Of a frame in which nothing is done but ``each`` for a sample, and reading a brick for a leap."""
        costs = {stage.name: stage.nanoseconds for stage in lowest}
        one = self.samples * costs[each] + self.leaps * costs[VOXEL]
        return pixels * one * 1e-9 / (os.cpu_count() or 1)


class Rays:
    """Rays of a scene in index space, eight neighbours in a row."""

    def __init__(self, scene: Scene) -> None:
        self.scene, volume = scene, scene.volume
        self.data = np.asarray(volume.data).reshape(volume.dims[::-1]).astype(np.float32)
        random = np.random.default_rng(1)
        width, height = scene.size
        corners = np.stack([random.integers(0, width // 4, TILES) * 4, random.integers(0, height // 2, TILES) * 2], 1)
        inside = np.array([(i % 4, i // 4) for i in range(8)])
        rays = [scene.camera.ray(scene.size, x, y) for x, y in (corners[:, None] + inside).reshape(-1, 2).tolist()]
        to_index = volume.world_to_index
        self.origin = np.array([origin for origin, _ in rays]) @ to_index[:3, :3].T + to_index[:3, 3]
        self.along = np.array([direction for _, direction in rays]) @ to_index[:3, :3].T
        with np.errstate(divide="ignore"):
            ends = [(side - self.origin) / self.along for side in (-0.5, np.array(volume.dims) - 0.5)]
        self.enter = np.maximum(np.minimum(*ends).max(axis=1), 0.0)
        self.leave = np.maximum(*ends).min(axis=1)

    def at(self, chosen: NDArray[np.intp], t: Numbers) -> Numbers:
        """Points, (n, 3), t mm from the eye."""
        points: Numbers = self.origin[chosen] + self.along[chosen] * t[:, None]
        return points

    def values(self, points: Numbers) -> Numbers:
        """Interpolated values."""
        from scipy.ndimage import map_coordinates

        found: Numbers = map_coordinates(self.data, points[:, ::-1].T, order=1, mode="nearest")
        return found


def counts(scene: Scene, faint: Sequence[float] = (0.0,)) -> list[Counts]:
    """What rays of a scene take at each of ``STEPS``, where bricks are left out that hide up to ``faint`` a voxel."""
    rays, function = Rays(scene), scene.transfer_function
    ranges, done = brick_ranges(scene.volume), []
    for opacity in faint:
        threshold = -math.log1p(-opacity) / scene.step_length(1.0)
        asked = unless_most(visible_bricks(ranges, function.table(ROWS), function.lookup(ROWS), threshold))
        reaches = None if asked is None else brick_reaches(asked)
        done += [_followed(rays, function, reaches, step, opacity) for step in STEPS]
    return done


def _followed(
    rays: Rays, function: TransferFunction, reaches: NDArray[Any] | None, step: float, faint: float
) -> Counts:
    length = rays.scene.step_length(step)
    first = np.floor(rays.enter / length)
    last = np.where(rays.leave > rays.enter, np.ceil(rays.leave / length) - 1.0, -1.0)
    n = len(first)
    k, hidden, seen, taken, leapt = first.copy(), np.zeros(n), 0, 0.0, 0.0
    going = np.flatnonzero(k <= last)
    while going.size:
        if reaches is not None:
            looked = np.zeros(n)
            k[going] = _leap(rays, reaches, length, k, last, going, looked)[going]
            leapt += _in_step(looked)
        going = going[k[going] <= last[going]]
        made = np.zeros(n)
        made[going] = GROUP
        taken += _in_step(made)
        for i in range(GROUP):
            points = rays.at(going, (k[going] + i + 0.5) * length)
            extinction = function.evaluate(rays.values(points))[:, 3] * (k[going] + i <= last[going])
            seen += int(np.count_nonzero(extinction > 0.0))
            hidden[going] += (1.0 - hidden[going]) * -np.expm1(-extinction * length)
        k[going] += GROUP
        going = going[(k[going] <= last[going]) & (hidden[going] < ENOUGH)]
    segments = float(np.maximum(last - first + 1.0, 0.0).sum())
    return Counts(rays.scene.name, step, faint, segments / n, seen / n, taken / n, leapt / n)


def _leap(
    rays: Rays,
    reaches: NDArray[Any],
    length: float,
    k: Numbers,
    last: Numbers,
    going: NDArray[np.intp],
    looked: Numbers,
) -> Numbers:
    """The first segments, from k on, in whose middle something may be; ``looked`` counts the bricks asked."""
    here, layers = k.copy(), reaches.shape[0] // 8
    farthest = np.array([*reaches.shape[:0:-1], layers]) - 1
    octant = (rays.along >= 0.0) @ [1, 2, 4]
    while going.size:
        place = rays.at(going, (here[going] + 0.5) * length) / BRICK
        brick = np.floor(place)
        x, y, z = np.clip(brick, 0, farthest).astype(int).T
        looked[going] += 1
        per_brick = BRICK / np.where(rays.along[going] == 0.0, 1e-30, rays.along[going] * length)
        reach = reaches[z + layers * octant[going], y, x][:, None].astype(float) - ROUNDING
        exits = (brick + 0.5 - place) * per_brick + reach * np.abs(per_brick)
        far = np.floor(exits.min(axis=1) + 1.0)
        here[going] = np.minimum(here[going] + np.maximum(far, 0.0), last[going] + 1.0)
        going = going[(far > 0.0) & (here[going] <= last[going])]
    return here


def _in_step(each: Numbers) -> float:
    """The sum where all eight of a row do as many as the busiest of them."""
    return float(each.reshape(-1, 8).max(axis=1).sum() * 8)
