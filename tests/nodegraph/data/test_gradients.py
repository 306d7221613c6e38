"""Gradients made beforehand: what they are, and when they pay."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.data import Camera, Mapping, Volume
from nodegraph.data.gradients import FRAMES, gradient_type, index_gradient, middle, saves_time, visible_samples
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
    ("dtype", "low", "high", "mapping"),
    [
        ("i2", -100, 3000, (1.0, -1024.0)),
        ("i2", -20000, 20000, (-0.5, 7.0)),
        ("u2", 40000, 65535, (0.1, 0.0)),
        ("u1", 0, 255, (1.0, 0.0)),
        ("i8", 2**53 + 1, 2**53 + 101, (1.0, 0.0)),
        ("f4", -1.0, 1.0, (2.0, 1.0)),
        ("f8", 1e9, 1e9 + 1e-3, (1.0, 0.0)),
    ],
)
def test_beside_gradients_stand_values_without_loss(dtype, low, high, mapping, rng):
    stored = rng.integers(low, high, (4, 5, 6), endpoint=True) if dtype[0] != "f" else rng.uniform(low, high, (4, 5, 6))
    stored.reshape(-1)[:2] = low, high
    volume = Volume(stored.astype(dtype), mapping=Mapping(*mapping))
    found = index_gradient(volume)
    off = (np.longdouble(middle(volume)) - mapping[1]) / mapping[0]
    off = off if dtype[0] == "f" else np.round(off)
    less = np.pad(volume.data, 1, mode="edge").astype(np.longdouble) - off
    assert np.abs(2.0 * found.real(np.float64)[..., 3] - less * mapping[0]).max() <= (high - low) * 1e-7


def test_a_part_has_the_gradients_and_values_of_the_whole(rng):
    whole = Volume(rng.integers(-20000, 20000, (9, 8, 7)).astype(np.int16))
    part = whole.part((1, 2, 3), (6, 7, 8))
    assert part.range != whole.range
    inner = index_gradient(part, whole)
    assert inner.dtype == index_gradient(whole).dtype
    np.testing.assert_array_equal(inner.data[2:-2, 2:-2, 2:-2], index_gradient(whole).data[5:8, 4:7, 3:6])


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
    pays, why = saves_time(volume, 1e6, Room(8 * 32**3 - 1))
    assert not pays
    assert why.startswith("0 MiB of them")
    assert saves_time(volume, 1e6, Room(8 * 32**3))[0]
