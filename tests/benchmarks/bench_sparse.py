"""What casting some of the rays saves, and what it costs where nothing can be left out.

Frames of the ray-caster with a `pixel_tolerance` beside frames that cast all rays, midpoint, in processor time: a fog,
which is smooth, and bones and vessels, which are not. The scenes are those of the comparison with VTK.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from nodegraph.engine import Engine
from tests.benchmarks.measure import Row, interleaved, ms
from tests.benchmarks.peers.ours import Ours
from tests.benchmarks.peers.scenes import Scene, chest, fog

TOLERANCES = (0.01, 0.03, 0.1)
LIMITS = {("fog", 512, 1.0, 0.03): 0.7, ("fog", 512, 2.0, 0.03): 0.85, ("bones", 512, 1.0, 0.03): 1.25}
"""What is wanted of the time of all rays."""


def rows() -> Iterator[Row]:
    with Engine(device="gl") as engine:
        for side, step in ((256, 1.0), (512, 1.0), (512, 2.0), (512, 4.0)):
            yield from _saved(engine, "fog", fog((side, side)), step, TOLERANCES)
        yield from _saved(engine, "fog, lit", replace(fog((512, 512)), name="dense, lit", lit=True), 1.0, TOLERANCES)
        yield from _saved(engine, "bones", chest((512, 512)), 1.0, TOLERANCES[1:2])


def _saved(engine: Engine, what: str, scene: Scene, step: float, tolerances: tuple[float, ...]) -> Iterator[Row]:
    """Time of sparse frames as shares of that of all rays, and how far the pictures are from those."""
    ours = Ours(scene, engine)
    turns = itertools.count(1)
    settings = {tolerance: {"step": step, "pixel_tolerance": tolerance} for tolerance in (0.0, *tolerances)}

    def frame(given: dict[str, Any]) -> None:
        # Seen from elsewhere each time, since the engine keeps what it has rendered.
        ours.frame(given, scene.seen_from(1e-4 * next(turns)))

    actions = {str(tolerance): lambda given=given: frame(given) for tolerance, given in settings.items()}
    taken = interleaved(actions, rounds=5, clock=time.process_time)
    every = ours.frame(settings[0.0])
    side = scene.size[0]
    for tolerance in tolerances:
        off = np.abs(ours.frame(settings[tolerance]) - every)
        rms, most, guessed = np.sqrt(np.mean(off[..., :3] ** 2)), off.max(), np.mean(off.max(axis=2) > 0.0)
        mine, all_rays = taken[str(tolerance)], taken["0.0"]
        yield Row(
            f"{what}, {side} x {side}, step {step:g}: pixel_tolerance {tolerance}",
            mine / all_rays,
            "x",
            LIMITS.get((what, side, step, tolerance)),
            f"{ms(mine)} / {ms(all_rays)}; off by {most:.2g}, RMSE {rms:.1e}; {guessed:.0%} of the pixels differ",
        )
