"""What the ray-caster leaves out changes nothing: pictures with and without skipping, over random scenes.

Every scene is drawn from a seed: volumes of 2 to 70 voxels an axis, of several types, with holes (NaN, inf),
anisotropic and turned; transfer functions of thin bands, jumps, one key or none; eyes outside, inside and on lines
along the axes.
Checks: Schlosser 2009, C06, T21 (bricks that cannot be seen are left out without a trace).
"""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.data import Image, Light, TransferFunction
from tests.support.calls import call
from tests.support.random_scenes import TYPES, random_camera, random_volume

pytestmark = pytest.mark.slow

SIZE = (14, 12)
SAME = 1e-6
"""Greatest difference of a colour."""
MODES = (
    "midpoint",
    "trapezoid",
    "preintegrated",
    "gauss2",
    "gauss3",
    "adaptive",
    "cellwise",
    "maximum",
    "first_hit",
    "iso",
)


def random_function(rng, volume, low, span):
    """Over values from ``low`` on, ``span`` wide; about a value that there is, so that something can be seen."""
    kind = rng.choice(["band", "jump", "ramp", "peaks", "one", "empty"], p=[0.3, 0.2, 0.2, 0.2, 0.06, 0.04])
    there = (volume.real(np.float64).ravel() - low) / span
    there = there[np.isfinite(there) & (there > 0.02)]
    at = float(rng.choice(there)) * rng.uniform(0.6, 1.0) if there.size else 0.5
    if kind == "band":
        width = 10.0 ** rng.uniform(-2.5, -0.7)
        keys = [(0.0, 0.0), (at, 0.0), (at + width / 2, 0.8), (at + width, 0.0), (1.2, 0.0)]
    elif kind == "jump":
        keys = [(0.0, 0.0), (at, 0.0), (at, 0.6), (1.1, 0.2)]
    elif kind == "ramp":
        keys = [(at, 0.0), (1.0, rng.uniform(0.01, 1.0))]
    elif kind == "peaks":
        places = np.sort(rng.uniform(0.02, 1.1, 7))
        keys = [(place, rng.uniform(0, 0.9) * (i % 3 == 1)) for i, place in enumerate(places)]
    elif kind == "one":
        keys = [(at, rng.uniform(0.0, 0.5))]
    else:
        keys = []
    found = [(low + span * place, tuple(rng.random(3)), float(hides)) for place, hides in keys]
    return sorted(found, key=lambda key: key[0])  # a negative scale turns them about


def random_scene(rng, mode, lit, interval, dtype):
    volume, low, span = random_volume(rng, dtype)
    camera, away, diagonal = random_camera(rng, volume)
    unit = float(volume.spacing.min())
    function = TransferFunction(random_function(rng, volume, low, span), float(volume.spacing.mean()))
    shortest = max(0.2, 1.5e-3 * diagonal / unit)
    params = {
        "volume": volume,
        "camera": camera,
        "transfer_function": function,
        "lit": lit,
        "light": Light(),
        "gradients": "on_the_fly",  # whether they are made beforehand depends on what can be skipped
        "termination": 1.0,
        "step": float(np.exp(rng.uniform(np.log(shortest), np.log(max(20.0, shortest))))),
        "mode": mode if mode in ("maximum", "first_hit", "iso") else "composite",
        "table_size": int(rng.choice([64, 2048])),
        "pair_table_size": 48,
        "iso_value": low + span * float(rng.uniform(0.1, 0.9)),
        "hit_extinction": float(10.0 ** rng.uniform(-3, 0)) / unit,
        "order": 2,
        "tolerance": 1e-2,
    }
    if params["mode"] == "composite":
        params["integrator"] = mode
    if interval:
        cuts = np.sort(away + diagonal * rng.uniform(-0.5, 0.5, (SIZE[1], SIZE[0], 2)), axis=-1)
        params["interval"] = Image(np.maximum(cuts, 0.0).astype(np.float32))
    return params, diagonal


def both(device, params):
    return [call("render.raycast", device, SIZE, skip=skip, **params) for skip in (True, False)]


def differences(skipped, whole, diagonal):
    """Greatest difference of the colour, and of the depth as a share of the scene; inf where only one has a depth."""
    color = float(np.abs(skipped.color - whole.color).max())
    a, b = skipped.depth, whole.depth
    if (np.isfinite(a) != np.isfinite(b)).any():
        return color, np.inf
    seen = np.isfinite(a)
    return color, float(np.abs(a[seen] - b[seen]).max(initial=0.0)) / diagonal


def compare(device, mode, seeds, lit, interval, dtype):
    """Assert it for some scenes of one kind; returns in how many something is seen."""
    seen = 0
    for seed in seeds:
        params, diagonal = random_scene(np.random.default_rng((seed, MODES.index(mode))), mode, lit, interval, dtype)
        skipped, whole = both(device, params)
        assert np.isfinite(whole.color).all(), f"seed {seed}"
        color, depth = differences(skipped, whole, diagonal)
        assert color <= SAME, f"seed {seed}: the colour differs by {color:g}"
        assert depth <= 1e-3, f"seed {seed}: the depth differs by {depth:g} of the scene"
        seen += bool(whole.color.any())
    return seen


def kinds(number):
    """Lit, with an interval, and type of voxel: four kinds, which types go with which differs by the number."""
    pairs = [(lit, interval) for lit in (False, True) for interval in (False, True)]
    return [(*pair, TYPES[(k + number) % 4]) for k, pair in enumerate(pairs)]


@pytest.mark.parametrize("name", ["gl", "cl64"])
@pytest.mark.parametrize("mode", MODES)
def test_skipping_changes_nothing(request, mode, name):
    """Four scenes of each kind. On both devices together a mode meets eight kinds of the sixteen there are."""
    device = request.getfixturevalue(name)
    number = ("gl", "cl64").index(name)
    seen = 0
    for k, kind in enumerate(kinds(number + MODES.index(mode))):
        first = 100 * number + 10 * k
        seen += compare(device, mode, range(first, first + 4), *kind)
    assert seen > 3
