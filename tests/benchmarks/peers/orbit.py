"""A camera that goes round the chest while somebody drags: 60 frames, each at the level that its time allows."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nodegraph.engine import Engine
from nodegraph.pacing import Pacing
from nodegraph.requests import coarseness
from tests.benchmarks.peers.ours import Ours
from tests.benchmarks.peers.points import errors
from tests.benchmarks.peers.scenes import chest

FRAMES = 60
CHECKED = 2
"""Frames whose error is measured, evenly spread: a reference takes longer than the whole orbit. The first frames, in
which times are learnt, are not among them."""
WANTED = 12.0
BUDGET_MS = 0.85 * 1000.0 / WANTED
"""Of a frame's time; the rest is for the picture's way to the host, and for frames that are dearer than the last."""
SETTINGS = {"step": 1.0}


@dataclass(frozen=True)
class Orbit:
    """How one orbit went.

    frames_per_second: over all frames, the first ones included, in which times are learnt. median, slowest: seconds.
    rmse, maximum:     the worst of the frames that were checked, linear RGB against the reference.
    coarseness:        the usual level: about one n-th of the work of final. 1 in final quality.
    """

    scene: str
    quality: str
    frames_per_second: float
    median: float
    slowest: float
    rmse: float
    maximum: float
    coarseness: int = 1


def orbits(size: tuple[int, int], engine: Engine, say: Callable[[str], None]) -> list[Orbit]:
    """Bones and vessels in interactive quality, and in final for comparison."""
    result = []
    for scene in (chest(size),):
        ours = Ours(scene, engine)
        truths = {}
        for quality in ("interactive", "final"):
            for coarse in ("interactive/64", "final"):
                ours.frame(SETTINGS, scene.seen_from(-3.0), coarse)  # compiles, uploads
            pacing = Pacing(BUDGET_MS)
            taken, shown, levels = [], {}, []
            for i in range(FRAMES):
                # A hair apart for each quality, so that no picture of the other is shown again.
                camera = scene.seen_from(360.0 / FRAMES * i + 1e-6 * (quality == "final"))
                start = time.perf_counter()
                asked = pacing.quality() if quality == "interactive" else quality
                picture, report = ours.run(SETTINGS, camera, asked)
                pacing.learn(report, asked)
                taken.append(time.perf_counter() - start)
                levels.append(coarseness(asked))
                if i % (FRAMES // CHECKED) == FRAMES // CHECKED // 2:
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
                statistics.median_low(levels),
            )
            told = f"{orbit.frames_per_second:.1f} frames a second, median {orbit.median * 1000:.0f} ms"
            told += f", usual level 1 / {orbit.coarseness}"
            say(f"{orbit.scene}: {quality}: {told}, rmse {orbit.rmse:.2e}")
            result.append(orbit)
    return result
