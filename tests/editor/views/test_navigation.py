"""Turning, panning, zooming and cutting, by their laws."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph.data import Camera, Plane, Volume
from nodegraph.editor.views import navigation as nav

SIZE = (320, 200)
x = st.floats(-50.0, 370.0)
y = st.floats(-50.0, 250.0)
points = st.tuples(x, y)
inside = st.tuples(st.floats(1.0, 319.0), st.floats(1.0, 199.0))
coordinate = st.floats(-300.0, 300.0)


@st.composite
def cameras(draw: st.DrawFn) -> Camera:
    eye, up = (draw(st.tuples(coordinate, coordinate, coordinate)) for _ in range(2))
    length = np.linalg.norm(eye) * np.linalg.norm(up)
    if length < 10.0 or np.linalg.norm(eye) < 5.0 or np.linalg.norm(np.cross(eye, up)) < 0.02 * length:
        eye, up = (20.0, -300.0, 10.0), (0.0, 0.0, 1.0)
    target = draw(st.tuples(coordinate, coordinate, coordinate))
    lens = draw(st.sampled_from(["perspective", "orthographic"]))
    return Camera(np.add(eye, target).tolist(), target, up, lens, draw(st.floats(5.0, 100.0)), draw(st.floats(5, 500)))


def same(a: Camera, b: Camera, scale: float = 1e-6) -> None:
    assert a.projection == b.projection
    np.testing.assert_allclose(a.eye, b.eye, atol=scale)
    np.testing.assert_allclose(a.target, b.target, atol=scale)
    np.testing.assert_allclose(a.basis[1], b.basis[1], atol=scale)
    assert a.height == pytest.approx(b.height)


@given(cameras(), points, points)
@settings(max_examples=80, deadline=None)
def test_turning_there_and_back_is_nothing(camera: Camera, a: nav.Point, b: nav.Point) -> None:
    same(nav.turn(nav.turn(camera, SIZE, a, b), SIZE, b, a), camera)
    same(nav.turn(camera, SIZE, a, a), camera)


@given(cameras(), points, points)
@settings(max_examples=80, deadline=None)
def test_a_turn_keeps_focus_and_distance(camera: Camera, a: nav.Point, b: nav.Point) -> None:
    turned = nav.turn(camera, SIZE, a, b)
    assert turned.target == camera.target
    distances = [np.linalg.norm(np.subtract(one.eye, one.target)) for one in (camera, turned)]
    assert distances[0] == pytest.approx(distances[1])


def test_what_faces_the_viewer_follows_the_cursor() -> None:
    camera = Camera((0, -300, 0), (0, 0, 0), projection="orthographic", height=200)
    radius = nav.BALL * 100  # in pixels, and, at this height, in mm
    grabbed = np.array([0.0, -radius, 0.0])
    for end in ((190.0, 100.0), (160.0, 70.0), (140.0, 120.0)):
        place = nav.seen_at(nav.turn(camera, SIZE, (160.0, 100.0), end), SIZE, grabbed)
        np.testing.assert_allclose(place, end, atol=1e-6)


@given(cameras(), inside, inside)
@settings(max_examples=80, deadline=None)
def test_panning_keeps_the_point_under_the_cursor(camera: Camera, a: nav.Point, b: nav.Point) -> None:
    point = nav.on_focus(camera, SIZE, a)
    panned = nav.pan(camera, SIZE, a, b)
    np.testing.assert_allclose(nav.seen_at(panned, SIZE, point), b, atol=1e-4)
    same(nav.pan(panned, SIZE, b, a), camera)


@given(cameras(), inside, st.floats(0.2, 5.0))
@settings(max_examples=80, deadline=None)
def test_zooming_keeps_the_point_under_the_cursor(camera: Camera, at: nav.Point, factor: float) -> None:
    point = nav.on_focus(camera, SIZE, at)
    zoomed = nav.zoom(camera, SIZE, at, factor)
    np.testing.assert_allclose(nav.seen_at(zoomed, SIZE, point), at, atol=1e-4)
    same(nav.zoom(zoomed, SIZE, at, 1 / factor), camera, 1e-5)


def test_a_zoom_makes_things_larger_by_its_factor() -> None:
    for camera in (Camera(), nav.switched(Camera())):
        middle = (160.0, 100.0)
        before = nav.seen_at(camera, SIZE, (10.0, 0.0, 0.0))[0] - 160.0
        after = nav.seen_at(nav.zoom(camera, SIZE, middle, 0.5), SIZE, (10.0, 0.0, 0.0))[0] - 160.0
        assert after == pytest.approx(2 * before)


def test_a_roll_turns_the_picture_counter_clockwise() -> None:
    camera = Camera((0, -300, 0), (0, 0, 0))
    right_of_it = np.array([20.0, 0.0, 0.0])
    column, row = nav.seen_at(nav.rolled(camera, 90.0), SIZE, right_of_it)
    assert column == pytest.approx(160.0)
    assert row < 90.0  # above the middle now
    dragged = nav.roll(camera, SIZE, (200.0, 100.0), (160.0, 60.0))
    np.testing.assert_allclose(nav.seen_at(dragged, SIZE, right_of_it), (column, row), atol=1e-6)


@given(cameras())
@settings(max_examples=50, deadline=None)
def test_switching_keeps_the_size_of_the_focus_and_goes_back(camera: Camera) -> None:
    right, _, _ = camera.basis
    point = np.asarray(camera.target) + 3.0 * right
    switched = nav.switched(camera)
    assert switched.orthographic != camera.orthographic
    np.testing.assert_allclose(nav.seen_at(switched, SIZE, point), nav.seen_at(camera, SIZE, point), atol=1e-6)
    again = nav.switched(switched)
    np.testing.assert_allclose(nav.seen_at(again, SIZE, point), nav.seen_at(camera, SIZE, point), atol=1e-6)


@pytest.mark.parametrize("axis", list(nav.AXES))
def test_views_along_axes_look_along_them(axis: str) -> None:
    camera = Camera((30, -200, 70), (5, 6, 7))
    looked = nav.along(camera, axis)
    np.testing.assert_allclose(looked.basis[2], -np.asarray(nav.AXES[axis][1]), atol=1e-12)
    assert looked.target == camera.target
    distances = [np.linalg.norm(np.subtract(one.eye, one.target)) for one in (camera, looked)]
    assert distances[0] == pytest.approx(distances[1])


@given(cameras())
@settings(max_examples=50, deadline=None)
def test_a_fit_shows_everything_and_wastes_no_room(camera: Camera) -> None:
    corners = np.array([(x, y, z) for x in (-40, 60) for y in (10, 30) for z in (0, 90)], float)
    fitted = nav.fitted(camera, corners, SIZE)
    places = np.array([nav.seen_at(fitted, SIZE, corner) for corner in corners])
    assert (places >= 0).all()
    assert (places <= SIZE).all()
    shares = np.abs(places - np.divide(SIZE, 2)).max(axis=0) / np.divide(SIZE, 2)
    assert shares.max() > 0.85
    assert nav.centred(fitted, (1.0, 2.0, 3.0)).target == (1.0, 2.0, 3.0)


@given(cameras(), inside, st.floats(1.0, 900.0))
@settings(max_examples=80, deadline=None)
def test_a_place_of_the_picture_and_its_depth_give_the_point_that_is_seen_there(
    camera: Camera, at: nav.Point, depth: float
) -> None:
    point = nav.world_at(camera, SIZE, at, depth)
    np.testing.assert_allclose(nav.seen_at(camera, SIZE, point), at, atol=1e-5)
    assert float((point - camera.eye) @ camera.basis[2]) == pytest.approx(depth)


# -- cuts -------------------------------------------------------------------------------------------------------------


def test_a_cut_covers_the_volume_and_its_middle_is_the_origin() -> None:
    volume = Volume(np.zeros((10, 20, 30), np.float32), np.diag([1.0, 2.0, 3.0, 1.0]))
    plane = Plane((14.5, 19.0, 13.5), (0, 0, 1))
    height = nav.cut_height(plane, volume.corners, (300, 400))
    assert height == pytest.approx(40.0)
    np.testing.assert_allclose(nav.on_plane(plane, height, (300, 400), (150, 200)), plane.origin)
    right, up = plane.axes
    corner = nav.on_plane(plane, height, (300, 400), (0, 0))
    np.testing.assert_allclose(corner, plane.origin - 15 * right + 20 * up)
    assert nav.cut_height(plane, volume.corners, (300, 400), 7.0) == 7.0


@pytest.mark.parametrize(("normal", "step"), [((0, 0, 1), 3.0), ((0, 5, 0), 2.0), ((-1, 0, 0), 1.0)])
def test_a_notch_is_a_voxel_and_back_again(normal: tuple[float, ...], step: float) -> None:
    world_to_index = np.linalg.inv(np.diag([1.0, 2.0, 3.0, 1.0]))
    plane = Plane((1, 2, 3), normal)
    moved = nav.scrolled(plane, world_to_index, 2)
    offset = np.subtract(moved.origin, plane.origin)
    assert float(offset @ plane.unit_normal) == pytest.approx(2 * step)
    np.testing.assert_allclose(nav.scrolled(moved, world_to_index, -2).origin, plane.origin)


def test_a_window_is_as_wide_as_the_drag_is_long() -> None:
    window = (-100.0, 300.0)
    assert nav.windowed(window, SIZE, (5, 5), (5, 5)) == pytest.approx(window)
    low, high = nav.windowed(window, SIZE, (0, 0), (160, 0))
    assert (high - low, (low + high) / 2) == pytest.approx((400 * math.e, 100.0))
    low, high = nav.windowed(window, SIZE, (0, 100), (0, 0))
    assert (high - low, (low + high) / 2) == pytest.approx((400.0, -100.0))  # upwards is brighter
