"""By value and gradient magnitude, too, what is left out and cut into blocks changes nothing, over random scenes.

Areas are soft, hard, pointed and narrow, as wide as the values or a few thousandths of them.
Checks: Schlosser 2009, C06, A09 (bricks that cannot be seen are left out without a trace).
"""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.compute import blockwise
from nodegraph.data import Gaussian, TransferFunction2D, Trapezoid
from tests.support.calls import call
from tests.support.random_scenes import TYPES, random_camera, random_volume

pytestmark = pytest.mark.slow

SIZE = (14, 12)
INTEGRATORS = ("midpoint", "preintegrated", "adaptive", "cellwise")
"""By a table, by lines in segments and in their halves, and by cells: the others are relatives of the first."""


def random_areas(rng, values, span, steepest):
    """Up to five about some of the ``values``, which span that much, and over magnitudes up to ``steepest``."""
    areas = []
    for at in rng.choice(values, rng.integers(1, 6)) if values.size else ():
        color, opacity = tuple(rng.random(3)), float(rng.uniform(0.05, 0.95))
        height = steepest * rng.choice([0.05, 0.3, 1.0])
        if rng.random() < 0.3:
            center = (at, height * rng.random())
            sigma = (span * rng.choice([0.003, 0.03, 0.2]), height * rng.choice([0.05, 0.4]))
            areas.append(Gaussian(tuple(map(float, center)), tuple(map(float, sigma)), color, opacity))
            continue
        widths = span * rng.choice([0.02, 0.3], 2) * (rng.random(2) + 0.01)
        bottom, top = ((float(at - 0.3 * width), float(at + 0.7 * width)) for width in widths)
        top = ((top[0], top[0]), bottom, top)[rng.integers(3)]
        least = float(height * 0.5 * rng.random() * rng.integers(0, 2))
        softness = float(rng.choice([0.0, 0.3, 1.0]))
        areas.append(Trapezoid(bottom, top, (least, float(least + height * 0.5)), softness, color, opacity))
    return areas


def random_scene(seed, integrator):
    rng = np.random.default_rng((seed, INTEGRATORS.index(integrator)))
    volume, low, span = random_volume(rng, TYPES[seed % 2])
    camera, _, diagonal = random_camera(rng, volume)
    unit = float(volume.spacing.min())
    values = volume.real(np.float64).ravel()
    there = values[np.isfinite(values) & (values != low)]
    areas = random_areas(rng, there, abs(span), abs(span) / unit)
    shortest = max(0.2, 1.5e-3 * diagonal / unit)
    return {
        "volume": volume,
        "camera": camera,
        "transfer_function": TransferFunction2D(areas, float(unit * rng.choice([0.3, 1.0, 5.0]))),
        "integrator": integrator,
        "lit": integrator == "midpoint",
        "gradients": "on_the_fly",  # whether they are made beforehand depends on what can be skipped
        "termination": 1.0,
        "step": float(np.exp(rng.uniform(np.log(shortest), np.log(max(20.0, shortest))))),
        "table_size": int(rng.choice([16, 256])),
        "order": 2,
    }


def in_blocks(device, params, monkeypatch):
    with monkeypatch.context() as patched:
        patched.setattr(blockwise, "is_needed", lambda volume, device: True)
        patched.setattr(blockwise, "block_size", lambda volume, reach, device: 12)
        return call("render.raycast_2d", device, SIZE, **params)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_skipping_and_blocks_change_nothing(cl64, integrator, monkeypatch):
    """In double precision, where a difference is none of rounding; tests/processors/render/test_raycast_2d.py asks each
    device."""
    seen = 0
    for seed in range(10):
        params = random_scene(seed, integrator)
        skipped, whole = (call("render.raycast_2d", cl64, SIZE, skip=skip, **params) for skip in (True, False))
        assert np.isfinite(whole.color).all(), f"seed {seed}"
        assert np.abs(skipped.color - whole.color).max() <= 1e-6, f"seed {seed}"
        assert np.array_equal(np.isfinite(skipped.depth), np.isfinite(whole.depth)), f"seed {seed}"
        if seed % 5 == 0:
            assert np.abs(in_blocks(cl64, params, monkeypatch).color - whole.color).max() <= 1e-6, f"seed {seed}"
        seen += bool(whole.color.any())
    assert seen > 2
