"""Gradients made beforehand are those that a ray would find on its way."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.data import Camera, Light, Mapping, TransferFunction, Volume, gradients
from nodegraph.data.space import centred
from tests.support.calls import MadeAnew, call

SIZE = (24, 20)
DIMS = (15, 12, 13)
CAMERA = Camera(eye=(30.0, -150.0, 40.0), target=(0, 0, 0), field_of_view=12.0)
LIGHT = Light(position=(-80.0, -200.0, 150.0))
STORED = {
    "uint8": (np.uint8, 100.0, Mapping(0.02, -1.0)),
    "int8": (np.int8, 60.0, Mapping(0.02, 0.3)),
    "int16": (np.int16, 9000.0, Mapping(1e-4, 0.0)),
    "int16 falling": (np.int16, 9000.0, Mapping(-1e-4, 1.0)),
    "float": (np.float32, 1.0, Mapping()),
    "double": (np.float64, 1.0, Mapping()),
}


def volume(name):
    """A dome on a slope: its gradient vanishes nowhere near what is seen of it, else light would swing by rounding.

    It reaches the faces of the volume, where differences fall within the outer half voxel."""
    dtype, size, mapping = STORED[name]
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in DIMS[::-1]), indexing="ij")
    field = 1.0 - 0.4 * ((x - 0.1) ** 2 + (y + 0.2) ** 2 + 0.7 * (z - 0.05) ** 2) + 0.3 * x
    stored = field * size
    return Volume(
        (np.round(stored) if np.dtype(dtype).kind == "i" else stored).astype(dtype),
        centred(DIMS, (1.5, 2.0, 2.5)),
        mapping,
    )


def render(device, field, gradients, **params):
    low, high = field.range
    keys = [(low + (high - low) * at, color, hides) for at, color, hides in
            ((0.0, (0.2, 0.5, 0.9), 0.0), (0.4, (0.9, 0.4, 0.2), 0.05), (1.0, (1, 1, 0.8), 0.3))]  # fmt: skip
    function = TransferFunction(keys)
    return call(
        "render.raycast", device, SIZE, volume=field, camera=CAMERA, light=LIGHT, transfer_function=function,
        termination=1.0, gradients=gradients, iso_value=0.5 * (low + high), **params,
    )  # fmt: skip


@pytest.mark.parametrize("stored", STORED)
@pytest.mark.parametrize("mode", ["composite", "iso"])
def test_precomputed_gradients_are_those_on_the_fly(device, stored, mode):
    field = volume(stored)
    before, on_the_way = (
        render(device, field, kind, mode=mode, integrator="gauss2") for kind in ("precomputed", "on_the_fly")
    )
    assert on_the_way.color[..., 3].max() > 0.5
    unlit = render(device, field, "on_the_fly", mode=mode, integrator="gauss2", lit=False)
    assert np.abs(unlit.color - on_the_way.color).max() > 0.05
    # OpenGL interpolates textures of 8 bits with weights of 8 bits (docs/devices.md): each of the six samples errs.
    coarse = device.name == "gl" and stored.endswith("int8")
    bound = 1e-2 if coarse else 1e-12 if device.name == "cl64" and stored != "float" else 2e-5
    assert np.abs(before.color - on_the_way.color).max() < bound


@pytest.mark.parametrize("dtype", [np.uint8, np.int8, np.uint16, np.int16, np.float32])
@pytest.mark.parametrize("gradients", ["precomputed", "on_the_fly"])
def test_where_nothing_changes_light_has_no_direction(device, dtype, gradients):
    """The gradient is 0 there, and must not be what rounding leaves of it."""
    field = Volume(np.full((12, 12, 12), 100, dtype), centred((12, 12, 12), (2.0,) * 3), Mapping(1 / 255, 0.0))
    white = TransferFunction([(0.0, (1, 1, 1), 0.9), (1.0, (1, 1, 1), 0.97)])
    image = call(
        "render.raycast", device, SIZE, volume=field, camera=CAMERA, transfer_function=white, gradients=gradients,
        ambient=0.2, diffuse=0.7, specular=0.5,
    )  # fmt: skip
    seen = image.color[..., 3] > 0.99
    assert seen.any()
    assert np.abs(image.color[seen][:, :3] / image.color[seen][:, 3:] - 0.9).max() < 1e-5


@pytest.mark.parametrize("greatest", [3, 10, 1000])
def test_values_beside_gradients_are_those_of_the_volume_however_few_there_are(device, greatest, rng):
    """A spike of the transfer function shows what a value is off by."""
    field = Volume(rng.integers(0, greatest + 1, (12, 12, 12)).astype(np.uint16), centred((12, 12, 12)))
    keys = [(0.0, (1, 0, 0), 0.0), (0.5, (0, 1, 0), 0.02), (0.52, (1, 1, 1), 0.5), (0.54, (0, 0, 1), 0.0)]
    keys += [(1.0, (0, 0, 1), 0.1)]
    spike = TransferFunction([(at * greatest, color, hides) for at, color, hides in keys])
    a, b = (
        call(
            "render.raycast", device, SIZE, volume=field, camera=CAMERA, transfer_function=spike, termination=1.0,
            gradients=kind, ambient=1.0, diffuse=0.0, specular=0.0, table_size=8192, step=0.3,
        ).color
        for kind in ("precomputed", "on_the_fly")
    )  # fmt: skip
    assert a[..., 3].max() > 0.1
    assert np.abs(a - b).max() < 1e-4


class Left(MadeAnew):
    """As if a finer picture had made gradients."""

    def kept(self, function, *args):
        return True


def test_a_coarse_picture_takes_gradients_that_a_finer_one_has_left(device, monkeypatch):
    monkeypatch.setattr(gradients, "SECONDS_PER_VOXEL", 1.0)  # so that making them never pays
    field, pictures, said = volume("int16"), [], []
    for memo in (None, Left()):
        told = []
        params = {"mode": "composite", "quality": "interactive/8", "memo": memo, "explain": told.append}
        pictures.append(render(device, field, "automatic", **params).color)
        said.append(" ".join(told))
    assert "taken on the fly" in said[0]
    # In double precision they would spoil it.
    assert ("precomputed: a finer picture has left them" in said[1]) == (device.name != "cl64")
    assert np.abs(pictures[1] - pictures[0]).max() < 2e-5
    told = []
    render(device, field, "automatic", mode="composite", memo=Left(), explain=told.append)
    assert "left them" not in " ".join(told), "a final picture does not depend on what was drawn before"
