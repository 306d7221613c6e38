"""What the ray-caster leaves out changes nothing: pictures with and without skipping, over random scenes.

Every scene is drawn from a seed: volumes of 2 to 70 voxels an axis, of several types, with holes (NaN, inf),
anisotropic and turned; transfer functions of thin bands, jumps, one key or none; eyes outside, inside and on lines
along the axes.
Checks: Schlosser 2009, C06, T21 (bricks that cannot be seen are left out without a trace).
"""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.data import Camera, Image, Light, Mapping, TransferFunction, Volume
from nodegraph.data.space import centred
from tests.support.calls import call

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
TYPES = (np.float32, np.int16, np.uint8, np.float64)


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
        "tolerance": 1e-3,
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


@pytest.mark.parametrize("mode", MODES)
def test_skipping_changes_nothing(device, mode):
    """Four scenes of each kind. On the three devices together a mode meets twelve kinds of the sixteen there are."""
    number = ("gl", "cl", "cl64").index(device.name)
    seen = 0
    for k, kind in enumerate(kinds(number + MODES.index(mode))):
        first = 100 * number + 10 * k
        seen += compare(device, mode, range(first, first + 4), *kind)
    assert seen > 3
