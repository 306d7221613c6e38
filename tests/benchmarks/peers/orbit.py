"""A camera that goes round the chest while somebody drags: 60 frames in interactive quality."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from nodegraph.engine import Engine
from tests.benchmarks.peers.ours import Ours
from tests.benchmarks.peers.points import errors
from tests.benchmarks.peers.scenes import chest

FRAMES = 60
CHECKED = 4
"""Frames whose error is measured, evenly spread: a reference takes longer than the whole orbit."""
WANTED = 12.0
SETTINGS = {"step": 1.0}


@dataclass(frozen=True)
class Orbit:
    """How one orbit went.

    frames_per_second: over all frames, the first ones included, in which times are learnt. median, slowest: seconds.
    rmse, maximum:     the worst of the frames that were checked, linear RGB against the reference.
    """

    scene: str
    quality: str
    frames_per_second: float
    median: float
    slowest: float
    rmse: float
    maximum: float


def orbits(size: tuple[int, int], engine: Engine, say: Callable[[str], None]) -> list[Orbit]:
    """Bones and vessels without and with light; in interactive quality, and in final for comparison."""
    plain = chest(size)
    result = []
    for scene in (plain, replace(plain, name="sparse, lit", lit=True)):
        ours = Ours(scene, engine)
        truths = {}
        for quality in ("interactive", "final"):
            ours.frame(SETTINGS, scene.seen_from(-3.0), quality)  # compiles, uploads
            taken, shown = [], {}
            for i in range(FRAMES):
                # A hair apart for each quality, so that no picture of the other is shown again.
                camera = scene.seen_from(360.0 / FRAMES * i + 1e-6 * (quality == "final"))
                start = time.perf_counter()
                picture = ours.frame(SETTINGS, camera, quality)
                taken.append(time.perf_counter() - start)
                if i % (FRAMES // CHECKED) == 0:
                    shown[i] = np.asarray(picture[..., :3], np.float64)
            found = []
            for i, picture in shown.items():
                if i not in truths:
                    ours.network["raycast"].camera = scene.seen_from(360.0 / FRAMES * i)
                    truths[i] = ours.truth()
                found.append(errors(picture, truths[i]))
            orbit = Orbit(
                scene.name,
                quality,
                FRAMES / sum(taken),
                statistics.median(taken),
                max(taken),
                max(rmse for rmse, _ in found),
                max(maximum for _, maximum in found),
            )
            told = f"{orbit.frames_per_second:.1f} frames a second, median {orbit.median * 1000:.0f} ms"
            say(f"{orbit.scene}: {quality}: {told}, rmse {orbit.rmse:.2e}")
            result.append(orbit)
    return result
