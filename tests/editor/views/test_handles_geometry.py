"""Lines, axes, planes and balls on a picture, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.data import Camera
from nodegraph.editor.views import handles_geometry as geometry
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.handles_geometry import Lens

SIZE = (200, 100)
FRONT = Lens(Camera((0, -100, 0), (0, 0, 0), field_of_view=2 * np.degrees(np.arctan(0.5))), SIZE)
"""Looks along y from 100 mm: a pixel is 1 mm at the origin; x goes right, z up."""
FLAT = Lens(Camera((0, -100, 0), (0, 0, 0), projection="orthographic", height=100.0), SIZE)
SLANTED = Lens(Camera((70, -60, 50), (3, 2, 1), up=(0.1, 0, 1), field_of_view=40.0), SIZE)
X, Y, Z = np.eye(3)
ORIGIN = np.zeros(3)


@pytest.mark.parametrize("lens", [FRONT, FLAT, SLANTED])
def test_one_point_and_many_are_seen_alike(lens: Lens) -> None:
    points = np.random.default_rng(1).uniform(-20, 20, (20, 3))
    places, depths = lens.places(points)
    for point, place, depth in zip(points, places, depths, strict=True):
        np.testing.assert_allclose(lens.place(point), place, atol=1e-9)
        assert depth == pytest.approx(lens.depth(point))
        np.testing.assert_allclose(nav.world_at(lens.camera, SIZE, tuple(place), depth), point, atol=1e-9)


def test_what_lies_behind_the_eye_has_no_place() -> None:
    assert FRONT.place(np.array([0.0, -101.0, 0.0])) is None
    assert FLAT.place(np.array([5.0, -101.0, 0.0])) is None
    assert FRONT.place(ORIGIN) == pytest.approx((100.0, 50.0))


def cut(lens: Lens, a: np.ndarray, b: np.ndarray, margin: float = 1.25) -> tuple[np.ndarray, np.ndarray] | None:
    """One line, beside another one that is seen whole."""
    first, last, there = lens.clipped(np.array([a, ORIGIN]), np.array([b, Y]), margin)
    assert there[1]
    np.testing.assert_array_equal((first[1], last[1]), (ORIGIN, Y))
    return (first[0], last[0]) if there[0] else None


def test_a_line_is_cut_where_the_eye_is_and_at_the_sides() -> None:
    a, b = cut(FRONT, np.array([0.0, -300.0, 0.0]), np.array([0.0, 100.0, 0.0]))
    np.testing.assert_allclose(a, [0.0, -100.0 + FRONT.near, 0.0], atol=1e-9)
    np.testing.assert_allclose(b, [0.0, 100.0, 0.0])
    a, b = cut(FRONT, -1000 * X, 1000 * X, margin=1.0)
    np.testing.assert_allclose((a[0], b[0]), (-100.0, 100.0))
    a, b = cut(FLAT, -1000 * X, 1000 * X, margin=1.5)
    np.testing.assert_allclose((a[0], b[0]), (-150.0, 150.0))
    assert cut(FRONT, np.array([0, -300.0, 0]), np.array([0, -101.0, 0])) is None
    assert cut(FRONT, np.array([500, 0.0, 0]), np.array([500, 50.0, 0])) is None


@pytest.mark.parametrize("lens", [FRONT, FLAT])
def test_an_axis_across_the_view_moves_by_pixels(lens: Lens) -> None:
    assert geometry.along(lens, ORIGIN, X, (10, 10), (35, 17)) == pytest.approx(25.0)
    assert geometry.along(lens, ORIGIN, 5 * X, (10, 10), (35, 17)) == pytest.approx(5.0)  # in lengths of the axis
    assert geometry.along(lens, ORIGIN, Z, (10, 10), (35, 17)) == pytest.approx(-7.0)


def test_an_axis_that_is_seen_slanted_moves_by_its_foreshortening() -> None:
    axis = np.array([0.6, 0.8, 0.0])
    assert geometry.along(FLAT, ORIGIN, axis, (0, 0), (6, 0)) == pytest.approx(10.0)


@pytest.mark.parametrize("lens", [FRONT, FLAT, SLANTED])
def test_the_point_stays_under_the_cursor(lens: Lens) -> None:
    random = np.random.default_rng(2)
    for _ in range(50):
        point, axis = random.uniform(-15, 15, 3), random.normal(size=3)
        far = random.uniform(-20, 20)
        start, end = lens.place(point), lens.place(point + far * axis)
        seen = np.linalg.norm(np.subtract(end, start))
        if seen / lens.size[1] < 0.1:
            continue
        assert geometry.along(lens, point, axis, start, end) == pytest.approx(far, rel=1e-6)
        shift = random.uniform(-10, 10, 3)
        shift -= normal_part(shift, axis)
        place = lens.place(point + shift)
        if abs(lens.towards(point) @ axis) / np.linalg.norm(axis) > 0.3:
            np.testing.assert_allclose(geometry.within(lens, point, axis, start, place), shift, atol=1e-6)
        depth = lens.depth(point)
        moved = point + geometry.facing(lens, point, start, end)
        assert lens.depth(moved) == pytest.approx(depth)
        np.testing.assert_allclose(lens.place(moved), end, atol=1e-6)


def normal_part(shift: np.ndarray, axis: np.ndarray) -> np.ndarray:
    unit = axis / np.linalg.norm(axis)
    return unit * (shift @ unit)


@pytest.mark.parametrize("lens", [FRONT, FLAT])
def test_an_axis_seen_end_on_goes_away_with_a_drag_upwards(lens: Lens) -> None:
    assert geometry.along(lens, ORIGIN, Y, (50, 50), (90, 40)) == pytest.approx(10.0)
    assert geometry.along(lens, ORIGIN, -Y, (50, 50), (90, 40)) == pytest.approx(-10.0)


@pytest.mark.parametrize("lens", [FRONT, FLAT, SLANTED])
def test_nothing_jumps_and_nothing_is_endless(lens: Lens) -> None:
    """No movement is no change; a pixel more is a little more, also over vanishing points and horizons."""
    random = np.random.default_rng(3)
    for _ in range(12):
        point, axis = random.uniform(-15, 15, 3), random.normal(size=3)
        axis /= np.linalg.norm(axis)
        start = (100.0, 50.0)
        assert geometry.along(lens, point, axis, start, start) == 0.0
        np.testing.assert_allclose(geometry.within(lens, point, axis, start, start), 0.0, atol=1e-9)
        np.testing.assert_allclose(geometry.turned(lens, point, axis, 60.0, start, start), axis, atol=1e-9)
        heading = random.normal(size=2)
        heading /= np.linalg.norm(heading)
        before = axis
        for pixels in range(0, 2400, 40):
            end = (start[0] + heading[0] * pixels, start[1] + heading[1] * pixels)
            far = geometry.along(lens, point, axis, start, end)
            assert np.isfinite(far)
            if not lens.camera.orthographic:
                assert lens.depth(point + far * axis) > 0.0
            shift = geometry.within(lens, point, axis, start, end)
            assert abs(shift @ axis) < 1e-6 * max(1.0, np.linalg.norm(shift))
            assert np.linalg.norm(shift) < 1e5
            direction = geometry.turned(lens, point, axis, 1000.0, start, end)
            assert np.linalg.norm(direction) == pytest.approx(1.0)
            assert np.linalg.norm(direction - before) < 0.45, "40 of 1000 pixels, at most over the rim"
            before = direction


def test_beyond_its_vanishing_point_an_axis_stops_at_a_limit() -> None:
    axis = np.array([0.5, 1.0, 0.0])  # vanishes 50 pixels to the right of the middle
    limit = geometry.along(FRONT, ORIGIN, axis, (100, 50), (150, 50))
    assert limit == pytest.approx(100.0 * (geometry.FARTHER - 1))
    assert geometry.along(FRONT, ORIGIN, axis, (100, 50), (190, 50)) == limit
    assert geometry.along(FRONT, ORIGIN, axis, (100, 50), (140, 50)) == pytest.approx(400.0)


def test_a_plane_from_its_edge_moves_like_one_that_faces_the_camera() -> None:
    for lens in (FRONT, FLAT):
        np.testing.assert_allclose(geometry.within(lens, ORIGIN, Z, (0, 0), (12, 9)), [12.0, 0.0, 0.0], atol=1e-9)


def test_a_plane_is_not_dragged_over_its_horizon() -> None:
    slanted = np.array([0.0, 1.0, -1.0])  # its horizon lies 100 pixels above the middle
    far = [geometry.within(FRONT, ORIGIN, slanted, (7, 100), (7, 100 - up))[1] for up in (0, 50, 95, 99, 101, 300)]
    limit = 100 * (geometry.FARTHER - 1)
    np.testing.assert_allclose(far, [0.0, 100.0, limit, limit, limit, limit], atol=1e-9)


def test_the_tip_of_an_arrow_follows_the_cursor_and_goes_round() -> None:
    towards = -Y
    assert geometry.turned(FLAT, ORIGIN, towards, 50.0, (0, 0), (30, 0)) == pytest.approx((0.6, -0.8, 0.0))
    assert geometry.turned(FLAT, ORIGIN, towards, 50.0, (0, 0), (0, -30)) == pytest.approx((0.0, -0.8, 0.6))
    assert geometry.turned(FLAT, ORIGIN, towards, 50.0, (0, 0), (50, 0)) == pytest.approx((1.0, 0.0, 0.0))
    assert geometry.turned(FLAT, ORIGIN, towards, 50.0, (0, 0), (70, 0)) == pytest.approx((0.6, 0.8, 0.0))
    assert geometry.turned(FLAT, ORIGIN, towards, 50.0, (0, 0), (100, 0)) == pytest.approx((0.0, 1.0, 0.0))
    behind = np.array([0.6, 0.8, 0.0])
    assert geometry.turned(FLAT, ORIGIN, behind, 50.0, (0, 0), (-30, 0)) == pytest.approx((0.0, 1.0, 0.0))
