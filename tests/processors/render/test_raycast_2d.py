"""Rays classified by value and gradient magnitude, against closed forms, one dimension and numpy, on each device."""

import numpy as np
import pytest

from nodegraph.compute import blockwise
from nodegraph.data import (
    Camera,
    Gaussian,
    Image,
    Light,
    Mapping,
    TransferFunction,
    TransferFunction2D,
    Trapezoid,
    Volume,
)
from nodegraph.data.space import centred
from nodegraph.errors import PortError
from nodegraph.registry import find
from tests.support import raycast_twin as twin
from tests.support.calls import call

pytestmark = pytest.mark.slow

SIZE = (24, 20)
CAMERA = Camera(eye=(30.0, -150.0, 40.0), target=(0, 0, 0), field_of_view=20.0)
FLAT = Camera(eye=(0.0, -150.0, 0.0), target=(0, 0, 0), projection="orthographic", height=8.0)
AMBER, BLUE = (0.9, 0.5, 0.1), (0.1, 0.3, 0.9)
INTEGRATORS = find("render.raycast_2d").params["integrator"].choices
each = pytest.mark.parametrize("integrator", INTEGRATORS)


def render(device, volume, function, camera=CAMERA, size=SIZE, **params):
    params = {"lit": False, "termination": 1.0} | params
    return call("render.raycast_2d", device, size, volume=volume, camera=camera, transfer_function=function, **params)


def distance(n=32, spacing=1.0):
    """Distance of voxel centres from the middle of the grid, mm."""
    at = (np.arange(n) - (n - 1) / 2) * spacing
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    return np.sqrt(x * x + y * y + z * z)


def ball(n=32):
    """A smooth ball of radius 10 mm."""
    return Volume((1 / (1 + np.exp(distance(n) - 10.0))).astype(np.float32))


def turned(dims, spacing):
    """A grid that is turned, anisotropic, and off the middle of the world."""
    c, s = np.cos(0.4), np.sin(0.4)
    turn = np.array([[c, -s, 0, 1.0], [s, c, 0, -2.0], [0, 0, 1, 3.0], [0, 0, 0, 1.0]])
    return turn @ np.array([[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]]) @ centred(dims, spacing)


@pytest.mark.parametrize("lit", [False, True], ids=["unlit", "lit"])
def test_over_all_magnitudes_it_is_the_picture_of_one_dimension(device, lit):
    """A soft rectangle is four keys; what is left is the error of the table, which falls with its size."""
    wide = TransferFunction2D([Trapezoid.rectangle((0.2, 0.9), (0.0, 10.0), AMBER, 0.4, 0.5)])
    keys = [(0.2, AMBER, 0.0), (0.375, AMBER, 0.4), (0.725, AMBER, 0.4), (0.9, AMBER, 0.0)]
    common = {"volume": ball(), "camera": CAMERA, "lit": lit, "termination": 1.0, "step": 0.5}
    flat = call("render.raycast", device, SIZE, transfer_function=TransferFunction(keys), table_size=8192, **common)
    errors = []
    for size in (32, 512):
        image = call("render.raycast_2d", device, SIZE, transfer_function=wide, table_size=size, **common)
        errors.append(np.abs(image.color - flat.color).max())
    assert errors[0] < 0.05
    assert errors[1] < 1e-3
    both = np.isfinite(flat.depth)
    assert np.array_equal(both, np.isfinite(image.depth))
    assert np.abs(flat.depth[both] - image.depth[both]).max() < 0.02


@pytest.mark.parametrize("unit", [1.0, 1e-3, 1e4])
def test_a_ramp_has_one_magnitude_in_value_units_per_mm(device, unit):
    """Through 12 mm of a field that rises by 3 units per mm, the opacity is that of a slab, or nothing."""
    n, spacing = 12, np.array([0.5, 1.0, 2.0])
    volume = Volume(
        np.broadcast_to(np.arange(n), (n, n, n)).astype(np.int16 if unit == 1e4 else np.float32),
        centred((n, n, n), spacing),
        Mapping(1.5 * unit, -7.0 * unit, "HU"),
    )
    slope = 3.0 * unit
    camera = FLAT.with_(height=3.0)
    for low, high, expected in ((0.8, 1.2, 1 - 0.7**12.0), (1.1, 1.5, 0.0), (0.2, 0.9, 0.0)):
        area = Trapezoid.rectangle((-1e3 * unit, 1e3 * unit), (low * slope, high * slope), AMBER, 0.3)
        for step in (0.3, 2.0):
            color = render(device, volume, TransferFunction2D([area]), camera, (5, 5), step=step).color
            assert np.abs(color[..., 3] - expected).max() < 1e-5
            assert np.abs(color[..., :3] - expected * np.array(AMBER)).max() < 1e-5


@each
def test_a_shell_of_one_magnitude_hides_by_the_length_of_its_chords(device, integrator):
    """A field that falls by 1 per mm between 9 and 13 mm from the middle, and is flat inside and outside.

    Inside and outside have no gradient, so only the shell is seen, and the values of the inside are in its range.
    """
    n, radius, wide = 64, (9.0, 13.0), 40.0
    field = np.clip(radius[1] - distance(n, 0.5), 0.0, radius[1] - radius[0])
    volume = Volume(field.astype(np.float32), centred((n, n, n), [0.5] * 3))
    size = (32, 32)
    area = Trapezoid.rectangle((-1.0, 5.0), (0.7, 1.3), BLUE, 0.1)
    image = render(device, volume, TransferFunction2D([area]), FLAT.with_(height=wide), size, integrator=integrator)
    at = ((np.arange(size[0]) + 0.5) / size[0] - 0.5) * wide
    x, z = np.meshgrid(at, at)
    chord = [2 * np.sqrt(np.maximum(r * r - x * x - z * z, 0.0)) for r in radius]
    expected = 1 - 0.9 ** (chord[1] - chord[0])
    # Differences over two voxels take the corners of the field off by up to a voxel, 0.5 mm, on either side.
    error = np.abs(image.color[..., 3] - expected)
    assert error.mean() < 0.02
    middle = image.color[15:17, 15:17, 3].mean()
    rim = image.color[16, np.argmin(np.abs(at - 9.0)), 3]
    assert middle == pytest.approx(1 - 0.9**8.0, abs=0.06)
    assert rim > 1.4 * middle, "a shell is most opaque where it is seen along its wall"
    whole = TransferFunction([(-1, BLUE, 0.0), (0.0, BLUE, 0.0), (0.01, BLUE, 0.1), (5, BLUE, 0.1)])
    filled = call("render.raycast", device, size, volume=volume, camera=FLAT.with_(height=wide),
                  transfer_function=whole, lit=False).color[15:17, 15:17, 3].mean()  # fmt: skip
    assert filled > 1.5 * middle, "by value alone it is a full ball"


@pytest.mark.parametrize("lit", [False, True], ids=["unlit", "lit"])
def test_it_equals_the_numpy_ray_caster(device, rng, lit):
    dims, spacing = (13, 11, 9), (1.5, 2.0, 2.5)
    volume = Volume(rng.random(dims[::-1]).astype(np.float32), turned(dims, spacing))
    function = TransferFunction2D(
        [Trapezoid((0.1, 0.4), (0.3, 0.9), (0.0, 0.25), 0.6, AMBER, 0.3), Gaussian((0.6, 0.1), (0.1, 0.04), BLUE, 0.5)]
    )
    phong = {"ambient": 0.2, "diffuse": 0.7, "specular": 0.3, "shininess": 12.0}
    light = Light("point", "world", (20, -60, 40))
    shade = twin.phong(volume, CAMERA, light, **phong) if lit else None
    expected, depth = twin.composite(volume, function, CAMERA, SIZE, 0.75, shade, slopes=True)
    params = {"step": 0.5, "lit": lit, "light": light, "table_size": 1024, **phong}
    image = render(device, volume, function, **params)
    assert expected[..., 3].max() > 0.5
    assert np.abs(image.color - expected).max() < 3e-3
    assert np.abs(image.color - expected).mean() < 1e-4
    both = np.isfinite(depth) & np.isfinite(image.depth)
    assert np.mean(np.isfinite(depth) != np.isfinite(image.depth)) < 0.01
    assert np.median(np.abs(image.depth[both] - depth[both])) < 1e-2


MANY = TransferFunction2D(
    [
        Trapezoid((0.1, 0.4), (0.3, 0.9), (0.0, 0.5), 0.6, AMBER, 0.3),
        Trapezoid((0.5, 0.9), (0.6, 0.6), (0.2, 1.1), 1.0, BLUE, 0.4),
        Trapezoid.rectangle((0.42, 0.45), (0.1, 2.0), (0.2, 0.9, 0.3), 0.7),
        Gaussian((0.6, 0.6), (0.1, 0.2), (0.7, 0.7, 0.1), 0.5),
        Gaussian((0.3, 0.9), (0.004, 0.006), (0.1, 0.9, 0.9), 0.9),
    ]
)
"""Soft, hard, pointed, narrow; they overlap."""


def one_cell(rng):
    """A volume of one cell, gradients at its voxels, the camera that looks through it, and a way of 0.9 mm inside."""
    placed = centred((2, 2, 2), (1.0, 1.0, 1.0))
    volume = Volume(rng.random((2, 2, 2)), placed)
    gradient = Volume(rng.normal(size=(2, 2, 2, 3)) * 0.7, placed)
    camera = Camera(eye=(0.0, -50.0, 0.0), target=(0, 0, 0), projection="orthographic", height=0.9)
    return volume, gradient, camera, (49.55, 50.45)


def met(volume, gradient, camera, size, distances):
    """Value and magnitude (h, w, n) at distances (n) along each ray."""
    origins, directions, *_ = twin.bounds(volume, camera, size)
    points = origins[..., None, :] + directions[..., None, :] * np.asarray(distances)[:, None]
    slopes = [
        twin.sample(Volume(np.ascontiguousarray(gradient.data[..., i]), volume.index_to_world), points)
        for i in range(3)
    ]
    return twin.sample(volume, points), np.linalg.norm(np.stack(slopes), axis=0)


def laid_over(emission, length):
    """RGBA (h, w, 4) of emission (h, w, n, 4) in n equal parts of ``length`` mm, front to back."""
    part = length / emission.shape[2]
    depth = emission[..., 3] * part
    before = np.cumsum(depth, axis=-1) - depth
    share = np.exp(-before) * -np.expm1(-depth)
    seen = np.where(emission[..., 3] > 0, share / np.where(emission[..., 3] > 0, emission[..., 3], 1.0), 0.0)
    return np.concatenate([(seen[..., None] * emission[..., :3]).sum(2), share.sum(2)[..., None]], axis=-1)


FEW = (4, 3)
DENSELY = (np.arange(40000) + 0.5) / 40000


@pytest.mark.parametrize("seed", [1, 3])
def test_between_two_points_it_sums_the_areas_on_the_straight_line(device, seed):
    """A segment of `preintegrated`, whose extinction and colour are means: against 40 000 samples of the line."""
    volume, gradient, camera, (near, far) = one_cell(np.random.default_rng(seed))
    params = {"gradient": gradient, "interval": Image(np.full((FEW[1], FEW[0], 2), (near, far))), "step": 1e3}
    image = render(device, volume, MANY, camera, FEW, integrator="preintegrated", **params)
    ends = met(volume, gradient, camera, FEW, (near, far))
    on_lines = (both[..., :1] + (both[..., 1:] - both[..., :1]) * DENSELY for both in ends)
    mean = MANY.emission(*on_lines).mean(axis=2)
    hidden = -np.expm1(-mean[..., 3:] * (far - near))
    expected = np.concatenate([mean[..., :3] / np.maximum(mean[..., 3:], 1e-300) * hidden, hidden], axis=-1)
    assert np.ptp(expected[..., 3]) > 0.05
    # An interval is widened by the rounding of 50 mm, and the narrowest area is narrow.
    assert np.abs(image.color - expected).max() < (5e-5 if device.name == "cl64" else 1e-3)


@pytest.mark.parametrize("seed", [1, 3])
def test_cellwise_and_adaptive_meet_every_area_of_a_cell(device, seed):
    """Against 40 000 samples of each ray in numpy, which err by a 40 000th of it where an area ends."""
    volume, gradient, camera, (near, far) = one_cell(np.random.default_rng(seed))
    at = met(volume, gradient, camera, FEW, near + (far - near) * DENSELY)
    expected = laid_over(MANY.emission(*at), far - near)
    params = {"gradient": gradient, "interval": Image(np.full((FEW[1], FEW[0], 2), (near, far))), "step": 0.1}
    exact = render(device, volume, MANY, camera, FEW, integrator="cellwise", **params)
    assert np.ptp(expected[..., 3]) > 0.05
    assert np.abs(exact.color - expected).max() < (3e-5 if device.name == "cl64" else 2e-4)
    for tolerance in (1e-2, 1e-3):
        near_it = render(device, volume, MANY, camera, FEW, integrator="adaptive", tolerance=tolerance, **params)
        assert np.abs(near_it.color - expected).max() < tolerance


@pytest.mark.parametrize("integrator", ["midpoint", "preintegrated", "adaptive", "cellwise"])
def test_a_gradient_that_is_not_finite_is_transparent_like_a_value(gl, integrator):
    """Whole numbers are always finite; what is brought along beside them may not be."""
    volume = Volume(np.full((8, 8, 8), 100, np.uint8))
    slopes = np.full((8, 8, 8, 3), 0.5, np.float32)
    everything = TransferFunction2D([Trapezoid.rectangle((0.0, 255.0), (0.0, 5.0), AMBER, 0.3)])
    camera = FLAT.with_(height=4.0)
    for hole in (np.nan, np.inf):
        slopes[:, 4] = hole
        gradient = Volume(slopes.copy(), volume.index_to_world)
        alpha = render(gl, volume, everything, camera, (4, 4), gradient=gradient, integrator=integrator).color[..., 3]
        # Between the planes beside it nothing is seen, so six of eight voxels are left, give or take a segment.
        assert np.all(np.isfinite(alpha))
        assert np.abs(np.log1p(-alpha) / np.log(0.7) - 6.0).max() < 1.01


def test_beside_what_is_not_finite_all_devices_show_the_same(gl, cl, cl64, rng):
    """Gradients made beforehand know nothing there where differences on the fly still do."""
    data = rng.random((10, 10, 10)).astype(np.float32)
    data[rng.random(data.shape) < 0.03] = np.nan
    function = TransferFunction2D([Trapezoid.rectangle((0.3, 0.8), (0.1, 0.5), AMBER, 0.3, 0.5)])
    shown = [
        render(one, Volume(data), function, FLAT, (64, 64), integrator="cellwise").color for one in (gl, cl, cl64)
    ]  # fmt: skip
    assert shown[2][..., 3].mean() > 0.05
    assert max(np.mean(np.abs(one - shown[2]).max(axis=-1) > 1e-3) for one in shown[:2]) < 0.01
    half = [
        render(cl64, Volume(data), function, FLAT, (8, 8), integrator="adaptive", tolerance=1e-4, step=step).color
        for step in (0.25, 0.5)
    ]  # fmt: skip
    exact = render(cl64, Volume(data), function, FLAT, (8, 8), integrator="cellwise").color
    assert max(np.median(np.abs(one - exact).max(axis=-1)) for one in half) < 1e-4


@pytest.mark.parametrize("step", [0.5, 2.0, 8.0])
def test_adaptive_finds_where_values_end(device, step):
    """Of a slab of 8 voxels the last are NaN: 5 mm are seen by value, 4.5 by differences; both from -1/2 on."""
    data = np.full((8, 8, 8), 0.5, np.float32)
    data[:, 6:] = np.nan
    for eye in (50.0, 50.2, 50.4):
        camera = Camera(eye=(0.0, -eye, 0.0), target=(0, 0, 0), projection="orthographic", height=1.0)
        params = {"volume": Volume(data), "camera": camera, "integrator": "adaptive", "tolerance": 1e-4, "step": step}
        params |= {"lit": False, "termination": 1.0}
        flat = TransferFunction([(0.0, AMBER, 0.1), (1.0, AMBER, 0.1)])
        area = TransferFunction2D([Trapezoid.rectangle((0.0, 1.0), (0.0, 1.0), AMBER, 0.1)])
        for id, function, length in (("render.raycast", flat, 5.5), ("render.raycast_2d", area, 4.5)):
            alpha = call(id, device, (2, 2), transfer_function=function, **params).color[..., 3]
            assert np.abs(np.log1p(-alpha) / np.log(0.9) - length).max() < 5e-3


def test_beside_the_tip_of_a_soft_triangle_the_line_is_summed_in_closed_form(device):
    """Where the slopes of its sides are divided by a width that vanishes; the tip stands at magnitude 0."""
    placed = centred((2, 2, 2), (1.0, 1.0, 1.0))
    volume, slopes = Volume(np.full((2, 2, 2), 0.503), placed), np.zeros((2, 2, 2, 3))
    slopes[:, 1, :, 1] = 1.0
    function = TransferFunction2D([Trapezoid((0.5, 0.5), (0.0, 1.0), (0.0, 1.0), 1.0, AMBER, 0.9)])
    camera = Camera(eye=(0.0, -50.0, 0.0), target=(0, 0, 0), projection="orthographic", height=0.5)
    interval = Image(np.full((1, 1, 2), (49.5, 50.5)))
    expected = -np.expm1(-function.emission(0.503, (np.arange(1000000) + 0.5) / 1000000)[:, 3].mean())
    for integrator in ("preintegrated", "adaptive"):
        params = {"integrator": integrator, "step": 1e3, "gradient": Volume(slopes, placed), "interval": interval}
        alpha = render(device, volume, function, camera, (1, 1), **params).color[0, 0, 3]
        # In single precision the interval is widened by the rounding of 50 mm.
        assert alpha == pytest.approx(expected, abs=1e-9 if device.name == "cl64" else 2e-4)


@pytest.mark.parametrize("order", [1, 3, 8])
def test_cellwise_finds_what_is_narrower_than_a_millionth_of_a_cell(cl64, order):
    """A hard slab, and a Gaussian, in a field that rises by 1 from voxel to voxel."""
    volume = Volume(np.broadcast_to(np.arange(6.0)[None, :, None], (6, 6, 6)).copy())
    for width in (1e-3, 1e-6):
        slab = Trapezoid.rectangle((2.37, 2.37 + width), (0.5, 1.5), AMBER, 1 - np.exp(-1.0))
        function = TransferFunction2D([slab], width)
        alpha = render(cl64, volume, function, FLAT.with_(height=1.0), (1, 1), integrator="cellwise", order=order)
        assert alpha.color[0, 0, 3] == pytest.approx(1 - np.exp(-1.0), abs=1e-6)
        bell = Gaussian((2.37, 1.0), (width, 1.0), BLUE, 1 - np.exp(-1.0))
        narrow = TransferFunction2D([bell], width)
        found = render(cl64, volume, narrow, FLAT.with_(height=1.0), (1, 1), integrator="cellwise", order=order)
        floor = np.exp(-4.5)
        depth = (np.sqrt(2 * np.pi) * 0.9973002039367398 - 6 * floor) / (1 - floor)  # of what is above the end
        assert found.color[0, 0, 3] == pytest.approx(1 - np.exp(-depth), abs=3e-6)


def test_a_ray_that_runs_along_an_edge_ends(cl64):
    """Of exp(y) the magnitude is a share of the value; no part of the ray tells on which side of this edge it is."""
    y = np.exp(0.3 * np.arange(8.0))
    volume = Volume(np.broadcast_to(y[None, :, None], (8, 8, 8)).copy())
    slope = np.sinh(0.3)
    area = Trapezoid((0.0, 50.0), (10.0 / slope, 50.0), (0.0, 10.0), 0.0, AMBER, 0.3)
    color = render(
        cl64, volume, TransferFunction2D([area]), FLAT.with_(height=1.0), (1, 1), integrator="cellwise"
    ).color
    assert 0.0 <= color[0, 0, 3] <= 1.0


SHELL = TransferFunction2D([Trapezoid.rectangle((0.2, 0.8), (0.1, 0.4), AMBER, 0.4, 0.3)])


def test_where_gradients_come_from_changes_nothing(device):
    volume = ball()
    made = {way: render(device, volume, SHELL, lit=True, gradients=way).color for way in ("on_the_fly", "precomputed")}
    assert np.abs(made["on_the_fly"] - made["precomputed"]).max() < (1e-6 if device.name == "cl64" else 1e-4)
    gradient = call("filter.gradient", device, volume=volume)
    wired = render(device, volume, SHELL, lit=True, gradient=gradient).color
    assert np.abs(made["on_the_fly"] - wired).max() < 1e-4, "the shell is far from the border"


@pytest.mark.parametrize("integrator", ["midpoint", "cellwise"])
def test_skipping_changes_nothing(device, integrator):
    """All integrators and random scenes: tests/processors/render/test_raycast_2d_skip.py."""
    area = Trapezoid.rectangle((0.5, 0.8), (0.1, 0.4), AMBER, 0.4, 0.3)
    for lit in (False, True):
        # Whether they are made beforehand depends on what can be skipped.
        params = {"lit": lit, "gradients": "on_the_fly", "integrator": integrator}
        pictures = [render(device, ball(), TransferFunction2D([area]), skip=skip, **params) for skip in (True, False)]
        assert np.abs(pictures[0].color - pictures[1].color).max() < 1e-6
        seen = np.isfinite(pictures[0].depth)
        assert np.allclose(pictures[0].depth[seen], pictures[1].depth[seen], rtol=0, atol=1e-3)


def test_faint_bricks_are_left_out_by_what_they_hide_over_a_voxel(device):
    """Of 16 faint voxels before 8 that are not: bricks 0 to 2 are left out, which reach from -1/2 to 12."""
    data = np.full((5, 24, 5), 0.2, np.float32)
    data[:, 16:] = 1.0
    volume = Volume(data, centred((5, 24, 5), [2.0] * 3))
    everywhere = (0.0, 10.0)
    areas = [
        Trapezoid.rectangle((0.0, 0.6), everywhere, AMBER, 0.1), Trapezoid.rectangle((0.6, 1.2), everywhere, BLUE, 0.4)
    ]  # fmt: skip
    function = TransferFunction2D(areas, reference_length=2.0)
    whole, same, less = (
        render(device, volume, function, FLAT.with_(height=4.0), (3, 3), step=0.25, termination=1.0, skip_opacity=x)
        .color[..., 3]
        for x in (0.0, 0.09, 0.11)
    )  # fmt: skip
    assert np.array_equal(whole, same)
    missing = (np.log1p(-less) - np.log1p(-whole)) / -np.log(0.9)
    assert np.abs(missing - 12.5).max() < 0.25


@pytest.mark.parametrize(("integrator", "skip"), [("midpoint", True), ("gauss3", False), ("cellwise", True)])
def test_blocks_show_what_one_piece_shows(device, integrator, skip, monkeypatch):
    params = {"lit": integrator in ("midpoint", "cellwise"), "integrator": integrator, "skip": skip}
    whole = render(device, ball(24), SHELL, **params)
    monkeypatch.setattr(blockwise, "is_needed", lambda volume, device: True)
    monkeypatch.setattr(blockwise, "block_size", lambda volume, reach, device: 12)
    blocks = render(device, ball(24), SHELL, **params)
    assert np.abs(whole.color - blocks.color).max() < (1e-9 if device.name == "cl64" else 1e-4)


@each
def test_what_is_not_finite_is_transparent(device, integrator):
    data = np.full((12, 12, 12), 0.5, np.float32)
    data += np.linspace(0, 1.2, 12, dtype=np.float32)
    everything = TransferFunction2D([Trapezoid.rectangle((-5.0, 5.0), (0.0, 5.0), AMBER, 0.3)])
    camera = FLAT.with_(height=6.0)
    full = render(device, Volume(data), everything, camera, (6, 6), integrator=integrator).color[..., 3]
    data = data.copy()
    data[:, 5:7] = (np.nan, np.inf, -np.inf, *[np.nan] * 9)
    holed = render(device, Volume(data), everything, camera, (6, 6), integrator=integrator).color[..., 3]
    assert np.isfinite(holed).all()
    assert full.min() == pytest.approx(1 - 0.7**12, abs=1e-5)
    # Beside what is missing gradients are, too: two planes, one on either side, and one that differences reach.
    assert np.all(holed < 1 - 0.7**8)
    assert np.all(holed > 1 - 0.7**5)


@each
def test_values_far_from_zero_are_seen_alike(device, integrator):
    volume = ball()
    far = Volume(volume.data, np.asarray(volume.index_to_world), Mapping(1.0, 1e5, ""))
    (area,) = SHELL.areas
    moved = TransferFunction2D([area._replace(bottom=(1e5 + 0.2, 1e5 + 0.8), top=(1e5 + 0.2, 1e5 + 0.8))])
    near, away = (
        render(device, *what, integrator=integrator).color for what in ((volume, SHELL), (far, moved))
    )  # fmt: skip
    assert np.abs(near - away).max() < 1e-4


@each
def test_an_empty_function_and_thin_volumes(device, integrator):
    assert not render(device, ball(), TransferFunction2D(), integrator=integrator).color.any()
    inside = TransferFunction2D([Trapezoid.rectangle((0.0, 1.0), (0.0, 1.0), AMBER, 0.3)])
    for shape in ((1, 1, 1), (1, 8, 8), (8, 1, 8)):
        volume = Volume(np.full(shape, 0.5, np.float32))
        color = render(device, volume, inside, FLAT.with_(height=0.9), (3, 3), integrator=integrator).color
        assert color[1, 1, 3] == pytest.approx(1 - 0.7 ** shape[1], abs=1e-5)


def test_a_ray_ends_where_enough_is_hidden(gl):
    exact = render(gl, ball(), SHELL, step=0.1)
    early = render(gl, ball(), SHELL, step=0.1, termination=0.9)
    error = np.abs(exact.color - early.color).max()
    assert 0.0 < error <= 0.1
    assert np.array_equal(np.isfinite(exact.depth), np.isfinite(early.depth))


@pytest.mark.parametrize("n", [4, 16])
def test_a_coarser_picture_shows_the_same_view_in_the_size_that_was_asked_for(gl, n):
    size = (96, 80)
    final, coarse = (render(gl, ball(), SHELL, size=size, quality=q) for q in ("final", f"interactive/{n}"))
    assert coarse.size == final.size == size
    assert np.abs(final.color - coarse.color).mean() < 0.03


def test_inputs_that_do_not_fit_are_refused(gl):
    other = Volume(np.zeros((4, 4, 4, 3), np.float32))
    with pytest.raises(PortError, match="another grid"):
        render(gl, ball(), SHELL, gradient=other)
    interval = call("render.entry_exit_points", gl, (8, 8), geometry=call("geometry.proxy_box", volume=ball()))
    with pytest.raises(PortError, match="24x20"):
        render(gl, ball(), SHELL, interval=interval)
