"""What nobody renders until somebody does: far eyes, numbers far from 0, inputs that do not fit."""

import numpy as np
import pytest

from nodegraph import Network
from nodegraph.data import Camera, Image, Light, Mapping, TransferFunction, Volume
from nodegraph.data.space import centred
from nodegraph.engine import Engine
from nodegraph.errors import DeviceError, ParameterError, PortError
from tests.support.calls import call

pytestmark = pytest.mark.slow

SIZE = (32, 26)
CAMERA = Camera(eye=(30.0, -150.0, 40.0), target=(0, 0, 0), field_of_view=24.0)
MODES = ("composite", "maximum", "first_hit", "iso")


def ramp(low=0.0, high=1.0):
    """A transfer function whose keys lie at 0, 0.3 and 1 of a range."""
    keys = [(0.0, (0.1, 0.2, 0.9), 0.0), (0.3, (0.9, 0.3, 0.1), 0.0), (1.0, (0.9, 0.8, 0.6), 0.4)]
    return TransferFunction([(low + v * (high - low), color, opacity) for v, color, opacity in keys])


def ball(n=16):
    at = ((np.arange(n) + 0.5) / n - 0.5) * 48.0
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    data = np.exp(-((x - 3) ** 2 + (y + 2) ** 2 + 1.7 * (z - 5) ** 2) / 150.0).astype(np.float32)
    return Volume(data, centred((n, n, n), [48.0 / n] * 3))


def render(device, volume, camera=CAMERA, size=SIZE, **params):
    params = {"termination": 1.0, "transfer_function": ramp(), "hit_extinction": 0.1} | params
    return call("render.raycast", device, size, volume=volume, camera=camera, **params)


@pytest.mark.parametrize("mode", MODES)
def test_values_that_lie_close_together_far_from_zero_keep_their_digits(device, mode):
    """1e9 .. 1e9 + 1 in double, ids above 2^24, and bytes with a great offset are the ball in other units."""
    plain = ball()
    expected = render(device, plain, mode=mode).color
    grid = plain.index_to_world
    for volume, low, high in (
        (Volume(plain.data.astype(np.float64) - 1e9 - 2.0, grid), -1e9 - 2.0, -1e9 - 1.0),
        (Volume((plain.data * 2e6).astype(np.uint32) + np.uint32(2**31), grid), 2.0**31, 2.0**31 + 2e6),
        (Volume((plain.data * 65535).astype(np.uint16), grid, Mapping(1 / 65535, 1e7)), 1e7, 1e7 + 1),
    ):
        shown = render(device, volume, mode=mode, transfer_function=ramp(low, high), iso_value=low + 0.5 * (high - low))
        assert np.abs(shown.color - expected).max() < 0.02
        assert np.abs(shown.color - expected).mean() < 2e-4


def test_a_gradient_keeps_its_digits_far_from_zero(device):
    plain = ball()
    expected = call("filter.gradient", device, volume=plain).data
    far = Volume(plain.data.astype(np.float64) + 1e9, plain.index_to_world)
    assert np.abs(call("filter.gradient", device, volume=far).data - expected).max() < 1e-6


def test_a_slice_keeps_its_digits_far_from_zero(device):
    plain = ball()
    far = Volume(plain.data.astype(np.float64) + 1e9, plain.index_to_world)
    for plain_look, far_look in (
        ({"window": (0.0, 1.0)}, {"window": (1e9, 1e9 + 1)}),
        ({"transfer_function": ramp()}, {"transfer_function": ramp(1e9, 1e9 + 1)}),
    ):
        coloring = next(iter(plain_look))
        a = call("render.slice", device, SIZE, volume=plain, coloring=coloring, **plain_look).color
        b = call("render.slice", device, SIZE, volume=far, coloring=coloring, **far_look).color
        assert np.ptp(a) > 0.1
        assert np.abs(a - b).max() < 1e-4


@pytest.mark.parametrize("scale", [1e-25, 1e30])
def test_light_does_not_depend_on_the_unit_of_the_values(device, scale):
    plain = ball()
    volume = Volume(plain.data * np.float32(scale), plain.index_to_world)
    for mode in ("composite", "first_hit", "iso"):
        a = render(device, plain, mode=mode).color
        b = render(device, volume, mode=mode, transfer_function=ramp(0.0, scale), iso_value=0.5 * scale).color
        assert np.abs(a - b).max() < 2e-3


def test_numbers_that_the_device_cannot_hold_are_refused_in_one_sentence(gl, cl, cl64):
    plain = ball()
    volume = Volume(plain.data.astype(np.float64) * 1e200, plain.index_to_world)
    for device in (gl, cl):
        with pytest.raises(ParameterError, match=r"volume: .*single precision.*cl64"):
            render(device, volume, transfer_function=ramp(0.0, 1e200))
    assert np.abs(render(cl64, volume, transfer_function=ramp(0, 1e200)).color - render(cl64, plain).color).max() < 1e-9


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
@pytest.mark.parametrize("distance", [1e6, 1e9])
def test_an_eye_far_away_sees_what_double_precision_sees(gl, cl, cl64, distance, projection):
    """Single precision has no digits for a voxel at 1000 km; samples and depth are counted from near the volume."""
    direction = np.array([0.2, -1.0, 0.27]) / np.linalg.norm([0.2, -1.0, 0.27])
    camera = Camera(
        eye=direction * distance, target=(0, 0, 0), projection=projection, height=50.0,
        field_of_view=float(np.degrees(2 * np.arctan(25.0 / distance))),
    )  # fmt: skip
    for mode in MODES:
        exact = render(cl64, ball(), camera, mode=mode, light=Light("directional", "eye", (0.3, 0.4, 0.8)))
        for device in (gl, cl):
            image = render(device, ball(), camera, mode=mode, light=Light("directional", "eye", (0.3, 0.4, 0.8)))
            error = np.abs(image.color - exact.color)
            assert exact.color[..., 3].max() > 0.3
            assert error.mean() <= 2e-5
            assert np.percentile(error.max(axis=-1), 99.5) <= 2e-3
            both = np.isfinite(image.depth) & np.isfinite(exact.depth)
            assert np.mean(np.isfinite(image.depth) != np.isfinite(exact.depth)) < 2e-3
            assert np.median(np.abs(image.depth[both] / exact.depth[both] - 1)) < 1e-7


def test_a_ray_has_samples_where_their_number_from_the_eye_passes_31_bits(device):
    """2^31 steps of 0.001 voxel are 2 km: no counter may begin at the eye."""
    volume = Volume(np.ones((2, 2, 2), np.float32))
    tf = TransferFunction([(0.0, (1, 1, 1), 0.5), (1.0, (1, 1, 1), 0.5)])
    camera = Camera(eye=(0, -5e6, 0), target=(0, 0, 0), projection="orthographic", height=1.0)
    alpha = render(device, volume, camera, (2, 2), transfer_function=tf, step=1e-3, lit=False).color[..., 3]
    assert np.abs(alpha - 0.75).max() < 1e-4


def test_depth_is_the_first_visible_point_when_nothing_need_be_hidden(device):
    image = render(device, ball(), depth_opacity=0.0)
    assert np.array_equal(np.isfinite(image.depth), image.color[..., 3] > 0)


def test_a_ray_that_ends_early_still_has_its_depth(device):
    full = render(device, ball(), depth_opacity=0.9)
    early = render(device, ball(), depth_opacity=0.9, termination=0.5)
    assert np.isfinite(full.depth).any()
    assert np.array_equal(full.depth, early.depth)


def test_an_interval_of_another_size_is_refused(device):
    interval = Image(np.ones((5, 7, 2), np.float32))
    with pytest.raises(PortError, match=r"interval: expected 32x26 pixels, got 7x5"):
        render(device, ball(), interval=interval)


@pytest.mark.parametrize("pair", [(np.nan, 300.0), (0.0, np.nan), (np.nan, np.nan), (300.0, 100.0), (np.inf, np.inf)])
def test_an_interval_that_is_none_shows_nothing(device, pair):
    interval = Image(np.full((SIZE[1], SIZE[0], 2), pair, np.float32))
    for mode in MODES:
        assert not render(device, ball(), interval=interval, mode=mode).color.any()


@pytest.mark.parametrize("pair", [(-50.0, 1e3), (-np.inf, np.inf), (0.0, 3e38)])
def test_an_interval_beyond_the_volume_changes_nothing(device, pair):
    interval = Image(np.full((SIZE[1], SIZE[0], 2), pair, np.float32))
    for mode in MODES:
        a, b = render(device, ball(), mode=mode).color, render(device, ball(), interval=interval, mode=mode).color
        assert np.abs(a - b).max() <= 1e-6


def test_a_gradient_of_another_grid_is_refused(device):
    gradient = call("filter.gradient", device, volume=ball(12))
    with pytest.raises(PortError, match=r"gradient: .*another grid.*compute it from this volume"):
        render(device, ball(16), gradient=gradient)
    moved = Volume(call("filter.gradient", device, volume=ball()).data, centred((16, 16, 16), (2.9, 3.0, 3.0)))
    with pytest.raises(PortError, match="another grid"):
        render(device, ball(), gradient=moved)


def slab(depth=100):
    return Volume(np.ones((4, depth, 4), np.float32))


@pytest.mark.parametrize("lit", [False, True])
def test_a_hundred_thousand_samples_a_ray_hide_what_one_does(device, lit):
    """llvmpipe ends loops after 65535 turns and says nothing: there such a run is refused, and none loses a sample."""
    tf = TransferFunction([(0.0, (1, 1, 1), 0.01), (1.0, (1, 1, 1), 0.01)])
    camera = Camera(eye=(0, -300, 0), target=(0, 0, 0), projection="orthographic", height=1.0)
    most = device.limits.get("turns")
    for step in (1e-3, 1.7e-3, 4e-3, 7e-3, 1.0):
        params = {"transfer_function": tf, "step": step, "lit": lit}
        if most is not None and 100 / step * (4 if lit else 1) > most:
            with pytest.raises(DeviceError, match="ends loops after"):
                render(device, slab(), camera, (2, 2), **params)
        else:
            image = render(device, slab(), camera, (2, 2), **params)
            assert np.abs(image.color[..., 3] - (1 - 0.99**100)).max() < 1e-4


def test_a_step_that_opengl_cannot_count_runs_on_the_next_device():
    network = Network()
    for type, path in (("source.synthetic", "source"), ("render.raycast", "raycast"), ("output.view", "view")):
        network.add(type, path)
    network.connect("source.volume", "raycast.volume")
    network.connect("raycast.image", "view.image")
    network["source"].voxels = (2, 100, 2)
    network["source"].extent = (0.2, 100.0, 0.2)
    network["raycast"].step = 1e-3
    with Engine(device="gl", disk=False) as engine:
        report = engine.evaluate(network, size=(2, 2))
        assert not report.errors
        limited = engine.devices.opened[0].limits["turns"] is not None
        assert any("ends loops after" in note and "running on cl" in note for note in report.notes) == limited
