"""Gradients made beforehand: what they are, and when they pay."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.data import Camera, Mapping, Volume
from nodegraph.data.gradients import FRAMES, gradient_type, index_gradient, saves_time, visible_samples
from nodegraph.data.space import centred


class Room:
    """A device on which a number of bytes fits."""

    name = "gl"

    def __init__(self, nbytes=1e12):
        self.nbytes = nbytes

    def fits(self, shape, dtype):
        return np.prod(shape) * np.dtype(dtype).itemsize <= self.nbytes


def test_gradients_are_central_differences_of_real_values_and_fall_towards_the_faces(rng):
    volume = Volume(rng.integers(-300, 300, (4, 5, 6)).astype(np.int16), centred((6, 5, 4)), Mapping(-0.5, 7.0))
    found = index_gradient(volume)
    assert found.dims == (8, 7, 6)
    assert found.dtype == np.int16
    real = np.pad(volume.real(np.float64), 2, mode="edge")
    for axis in range(3):
        ahead, behind = np.roll(real, -1, 2 - axis), np.roll(real, 1, 2 - axis)
        expected = 0.5 * (ahead - behind)[1:-1, 1:-1, 1:-1]
        np.testing.assert_allclose(found.real(np.float64)[..., axis], expected, atol=1e-12)
    np.testing.assert_allclose(found.index_to_world @ [1, 1, 1, 1], volume.index_to_world @ [0, 0, 0, 1])


@pytest.mark.parametrize(
    ("dtype", "low", "high", "kind"),
    [
        ("i2", -100, 3000, "i2"),
        ("i2", -20000, 20000, "f4"),
        ("u1", 0, 255, "i2"),
        ("f4", 0, 1, "f4"),
        ("f8", 0, 1, "f8"),
    ],
)
def test_whole_numbers_stay_whole_where_their_differences_fit(dtype, low, high, kind):
    assert gradient_type(Volume(np.array([[[low, high]]], dtype))) == np.dtype(kind)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_visible_samples_are_about_those_of_rays_through_a_cube(projection):
    volume = Volume(np.zeros((20, 20, 20), np.float32), centred((20, 20, 20)))
    lens = {"height": 40.0} if projection == "orthographic" else {"field_of_view": 2 * np.degrees(np.arctan(20 / 500))}
    camera = Camera(eye=(0, -500, 0), target=(0, 0, 0), projection=projection, **lens)
    # The cube covers 50 x 50 of 100 x 100 pixels, each for 20 mm.
    assert visible_samples(volume, camera, (100, 100), 0.5, 1.0) == pytest.approx(50 * 50 * 40, rel=0.02)
    assert visible_samples(volume, camera, (100, 100), 0.5, 0.25) == pytest.approx(50 * 50 * 10, rel=0.02)
    inside = camera.with_(eye=(0, -0.1, 0))
    assert 0 < visible_samples(volume, inside, (100, 100), 0.5, 1.0) <= 100 * 100 * np.sqrt(3) * 20 / 0.5 * 1.001


def test_gradients_are_made_beforehand_where_they_pay_within_some_frames_and_fit():
    volume = Volume(np.zeros((30, 30, 30), np.int16))
    pays, why = saves_time(volume, 1e6, Room())
    assert pays
    assert f"{FRAMES} frames" in why
    assert not saves_time(volume, 1e3, Room())[0]
    pays, why = saves_time(volume, 1e6, Room(6 * 32**3 - 1))
    assert not pays
    assert why.startswith("0 MiB of them")
    assert saves_time(volume, 1e6, Room(6 * 32**3))[0]
