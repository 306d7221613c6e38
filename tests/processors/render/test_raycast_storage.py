"""Voxels bound in fewer bits (`value_error`): pictures within a bound, exact skipping, and memory as it is told."""

import math

import numpy as np
import pytest

from nodegraph.compute import blockwise
from nodegraph.data import Camera, Mapping, TransferFunction, TransferFunction2D, Trapezoid, Volume
from nodegraph.data.space import centred
from nodegraph.engine import Engine
from nodegraph.explain import scene
from nodegraph.network import Network
from tests.support.calls import call

pytestmark = pytest.mark.slow

SIZE = (24, 20)
CAMERA = Camera(eye=(30.0, -150.0, 40.0), target=(0, 0, 0), field_of_view=12.0)
LOW, HIGH = -1000.0, 3000.0
N, SPACING = 12, 2.0
OPACITY = 0.3
SLOPE = -math.log(1 - OPACITY) / (HIGH - LOW)
"""Extinction per mm and unit of value."""
RAMP = TransferFunction([(LOW, (0.9, 0.5, 0.2), 0.0), (HIGH, (0.9, 0.5, 0.2), OPACITY)])
LONGEST = math.sqrt(3) * N * SPACING
"""mm that a ray may have in the volume."""


def field(dtype, seed=5):
    """Random values over the whole range, in a cube of 24 mm."""
    values = LOW + (HIGH - LOW) * np.random.default_rng(seed).random((N, N, N))
    values.flat[:2] = LOW, HIGH
    mapping = Mapping(unit="HU")
    if dtype == "uint16":
        values, mapping = (values - LOW) * 15.0, Mapping(1 / 15.0, LOW, "HU")
    elif dtype == "int32":
        values, mapping = values * 1e4, Mapping(1e-4, 0.0, "HU")
    return Volume(values.astype(dtype), centred((N, N, N), [SPACING] * 3), mapping)


def render(device, volume, told=None, **params):
    params = {"camera": CAMERA, "transfer_function": RAMP, "lit": False, "termination": 1.0, "step": 0.5} | params
    explain = told.append if told is not None else None
    return call("render.raycast", device, SIZE, volume=volume, explain=explain, **params)


EIGHT = "voxels are bound as uint8, "
SIXTEEN = "voxels are bound as uint16, "


@pytest.mark.parametrize("dtype", ["float32", "float64", "int16", "uint16", "int32"])
def test_the_picture_is_off_by_what_values_are_off_at_most(device, dtype):
    """An optical depth is off by the slope of the transfer function, times the length, times the error of values."""
    volume = field(dtype)
    exact = render(device, volume).color
    found = []
    for share in (0.01, 0.002, 1e-5, 1e-9):
        told = []
        color = render(device, volume, told, value_error=share).color
        found.append((np.abs(color - exact).max(), told[0]))
        assert found[-1][0] <= SLOPE * LONGEST * share * (HIGH - LOW) + 2e-6
    if device.name == "gl":
        # 8 bits would lie in 16, so they are not chosen, and 16 bits have nothing to gain.
        assert all(text.startswith(SIXTEEN) == (not dtype.endswith("16")) for _, text in found[:3])
    else:
        assert all(text.startswith(EIGHT) for _, text in found[:2])
        assert found[2][1].startswith(SIXTEEN) == (not dtype.endswith("16"))
        assert found[1][0] > 10 * found[2][0]
        assert found[0][0] > 1e-4
    assert ": nothing that takes less" in found[3][1]
    assert found[3][0] == 0.0


@pytest.mark.parametrize("mode", ["composite", "maximum", "first_hit", "iso"])
def test_what_is_empty_is_found_in_what_is_bound(device, mode):
    """Edges of what can be seen lie among the values that rounding moves: skipping has to change nothing."""
    rng = np.random.default_rng(2)
    data = np.zeros((20, 20, 20), np.float32)
    data[4:15, 3:12, 6:18] = rng.choice([0.0, 0.11, 0.1199, 0.1201, 0.13], (11, 9, 12))
    data[9, 9, 9] = 1.0
    volume = Volume(data, centred((20, 20, 20), [1.3] * 3))
    tf = TransferFunction([(0.12, (0.9, 0.5, 0.2), 0.0), (0.12, (0.9, 0.5, 0.2), 0.2), (1.0, (0.9, 0.5, 0.2), 0.5)])
    scene = {"mode": mode, "transfer_function": tf, "iso_value": 0.12, "hit_extinction": 0.1}
    for share in (0.004, 1e-5):
        whole = render(device, volume, value_error=share, skip=False, **scene)
        skipped = render(device, volume, value_error=share, **scene)
        assert np.abs(skipped.color - whole.color).max() <= 1e-6
        assert np.array_equal(np.isfinite(skipped.depth), np.isfinite(whole.depth))
        assert skipped.color[..., 3].max() > 0.05


def test_voxels_that_are_not_finite_stay_transparent(device):
    data = field("float64").data.copy()
    data[:, :, :5], data[:, :, 5] = np.nan, np.inf
    volume = Volume(data.astype(np.float32 if device.name == "gl" else np.float64), centred((N, N, N), [SPACING] * 3))
    told = []
    found = render(device, volume, told, value_error=1e-3).color
    # On OpenCL half floats would take as much as floats.
    expected = {"gl": "float16", "cl": "float64: nothing", "cl64": "float"}[device.name]
    assert told[0].startswith(f"voxels are bound as {expected}")
    whole = render(device, volume).color
    assert np.isfinite(found).all()
    assert np.abs(found - whole).max() <= SLOPE * LONGEST * 1e-3 * (HIGH - LOW) + 2e-6
    assert np.array_equal(found[..., 3] == 0.0, whole[..., 3] == 0.0)


def test_constants_and_bytes_have_nothing_to_lose(gl):
    cube = (4, 4, 4)
    for data, expected in (
        (np.full(cube, 7.25, np.float32), "uint16, "), (np.full(cube, 7, np.uint8), "uint8: nothing"),
    ):  # fmt: skip
        tf = TransferFunction([(0.0, (1, 1, 1), 0.0), (10.0, (1, 1, 1), 0.5)])
        told = []
        found = render(gl, Volume(data), told, transfer_function=tf, value_error=1.0)
        assert np.abs(found.color - render(gl, Volume(data), transfer_function=tf).color).max() < 1e-6
        assert told[0].startswith(
            f"voxels are bound as {expected}" if expected else "voxels are bound as uint8: nothing"
        )


@pytest.mark.parametrize("lit", [False, True])
@pytest.mark.parametrize("name", ["gl", "cl64"])
def test_light_and_two_dimensions_read_the_same_voxels(request, name, lit):
    """Wherever a slope is taken, of the smooth field it is nearly what it was; and nothing is left of the old one."""
    device = request.getfixturevalue(name)
    at = (np.arange(24) - 11.5) * 2.0
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    volume = Volume(np.exp(-(x * x + y * y + z * z) / 200.0), centred((24, 24, 24), (2.0, 2.0, 2.0)))
    tf = TransferFunction([(0.2, (0.9, 0.5, 0.2), 0.0), (1.0, (0.9, 0.5, 0.2), 0.4)])
    boundary = TransferFunction2D([Trapezoid.rectangle((0.2, 1.1), (0.0, 1.0), (0.9, 0.5, 0.2), 0.3, 0.5)])
    for id, function in [("render.raycast", tf)] * lit + [("render.raycast_2d", boundary)]:
        for gradients in ("on_the_fly", "precomputed"):
            scene = {"volume": volume, "camera": CAMERA, "transfer_function": function, "lit": lit, "step": 1.0}
            scene |= {"gradients": gradients}
            exact = call(id, device, SIZE, **scene).color
            near = call(id, device, SIZE, value_error=1e-5, **scene).color
            told = []
            far = call(id, device, SIZE, value_error=0.004, explain=told.append, **scene).color
            assert any("instead of" in text for text in told)
            assert 0.0 < np.abs(near - exact).max() < 2e-3
            assert np.abs(far - exact).max() < 0.1


def test_blocks_are_read_as_they_are(gl, monkeypatch):
    monkeypatch.setattr(blockwise, "is_needed", lambda volume, device: True)
    monkeypatch.setattr(blockwise, "block_size", lambda volume, reach, device: 8)
    told = []
    found = render(gl, field("float32"), told, value_error=0.01)
    assert "voxels are bound as they are: blocks know no value_error" in told
    assert np.array_equal(found.color, render(gl, field("float32")).color)


def test_memory_falls_as_it_is_told_and_a_turn_of_the_camera_stores_nothing_anew():
    network = Network()
    network.add("source.synthetic", "field", kind="torus", voxels=(64, 64, 64))
    network.add("render.raycast", "raycast", lit=False, skip=False, camera=CAMERA)
    network.connect("field.volume", "raycast.volume")
    taken = {}
    for share in (0.0, 1e-3):
        with Engine(device="gl", disk=False) as engine:
            network.set("raycast.value_error", share)
            network.set("raycast.camera", CAMERA)
            first = scene(engine, network, "raycast", size=SIZE).nodes["raycast"]
            taken[share] = next(read.bytes for read in first.kernels[0].run.fields if read.name == "volume")
            network.set("raycast.camera", CAMERA.with_(eye=(0.0, -150.0, 40.0)))
            again = scene(engine, network, "raycast", size=SIZE).nodes["raycast"]
            assert again.ran
    assert {memo.name: memo.made for memo in first.memos} == {"narrowed": True, "table": True}
    assert {memo.name: memo.made for memo in again.memos} == {"narrowed": False, "table": False}
    assert taken == {0.0: 64**3 * 4, 1e-3: 64**3 * 2}
    assert any("uint16, 0.5 MiB instead of 1:" in text for text in first.decisions)
