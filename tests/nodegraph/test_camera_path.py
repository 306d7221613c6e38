"""The way between two cameras, by its laws."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph.camera_path import between, orbit, rotation
from nodegraph.data import Camera

coordinate = st.floats(-500.0, 500.0)
place = st.tuples(coordinate, coordinate, coordinate)


@st.composite
def cameras(draw: st.DrawFn) -> Camera:
    target, offset, up = draw(place), draw(place), draw(place)
    lengths = np.linalg.norm(offset), np.linalg.norm(up)
    across = np.linalg.norm(np.cross(offset, up))
    if min(lengths) < 1.0 or across < 1e-2 * lengths[0] * lengths[1]:
        offset, up = (0.0, -300.0, 20.0), (0.0, 0.0, 1.0)
    return Camera(np.add(target, offset).tolist(), target, up, height=draw(st.floats(1.0, 1000.0)))


def radius(camera: Camera) -> float:
    return float(np.linalg.norm(np.subtract(camera.eye, camera.target)))


@given(cameras(), cameras(), st.floats(0.0, 1.0))
@settings(max_examples=60, deadline=None)
def test_the_way_ends_where_it_should_and_stays_between_the_two_spheres(a: Camera, b: Camera, t: float) -> None:
    assert between(a, b, 0.0) == a
    assert between(a, b, 1.0) == b
    there = between(a, b, t)
    low, high = sorted((radius(a), radius(b)))
    assert low * (1 - 1e-9) <= radius(there) <= high * (1 + 1e-9)
    np.testing.assert_allclose(there.target, (1 - t) * np.asarray(a.target) + t * np.asarray(b.target), atol=1e-9)


@given(cameras(), cameras(), st.floats(0.05, 0.95))
@settings(max_examples=50, deadline=None)
def test_the_way_back_is_the_way_there(a: Camera, b: Camera, t: float) -> None:
    turn = np.column_stack(b.basis) @ np.column_stack(a.basis).T
    if np.trace(turn) < -0.999:  # half a turn: two ways are equally short
        return
    there, back = between(a, b, t), between(b, a, 1 - t)
    np.testing.assert_allclose(there.eye, back.eye, atol=1e-5)
    np.testing.assert_allclose(there.basis[1], back.basis[1], atol=1e-5)


@given(cameras(), cameras())
@settings(max_examples=20, deadline=None)
def test_the_way_has_no_jump(a: Camera, b: Camera) -> None:
    steps = [between(a, b, t) for t in np.linspace(0.0, 1.0, 41)]
    for one, following in itertools.pairwise(steps):
        for axis in range(3):
            # A whole turn is the longest way, of direction and of up; the picture never turns faster than that.
            assert np.linalg.norm(one.basis[axis] - following.basis[axis]) < 2 * 2 * math.pi / 40 + 1e-6


def test_two_level_cameras_go_round_with_the_horizon_level() -> None:
    a = Camera((0, -300, 100), (0, 0, 0))
    b = orbit(a, 130.0).with_(eye=(200, 150, -90))
    for t in np.linspace(0.1, 0.9, 9):
        assert abs(between(a, b, t).basis[0][2]) < 1e-12


def test_an_orbit_is_a_turn_about_up_that_adds_and_closes() -> None:
    camera = Camera((30, -300, 120), (10, 5, -8), up=(0.1, 0.2, 1.0))
    np.testing.assert_allclose(orbit(orbit(camera, 70.0), 290.0).eye, camera.eye, atol=1e-9)
    assert radius(orbit(camera, 41.0)) == pytest.approx(radius(camera))
    right = camera.basis[0]
    assert (np.subtract(orbit(camera, 10.0).eye, camera.eye) @ right) > 0  # to its own right


def test_a_turn_of_half_a_circle_arrives() -> None:
    a = Camera((0, -300, 0), (0, 0, 0), up=(0, 0, 1))
    b = Camera((0, 300, 0), (0, 0, 0), up=(0, 0, -1))
    middle = between(a, b, 0.5)
    assert radius(middle) == pytest.approx(300.0)
    np.testing.assert_allclose(between(a, b, 1 - 1e-9).eye, b.eye, atol=1e-5)


def test_a_rotation_turns_counter_clockwise_about_its_axis() -> None:
    np.testing.assert_allclose(rotation(np.array([0, 0, 2.0]), math.pi / 2) @ [1, 0, 0], [0, 1, 0], atol=1e-12)
