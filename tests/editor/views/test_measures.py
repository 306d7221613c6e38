"""Measures against closed forms, on grids that are anisotropic, turned and sheared. Checks: Rezk-Salama 2001, M16."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph.camera_path import rotation
from nodegraph.data import Plane, Volume
from nodegraph.data.space import transform_points
from nodegraph.editor.views import measures as m
from nodegraph.editor.views.measures import Measure

TURN = rotation(np.array([1.0, 2.0, -0.5]), 0.7)


def grid(spacing=(0.5, 1.25, 3.0), turn=TURN, origin=(10.0, -20.0, 30.0)) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = turn @ np.diag(spacing)
    matrix[:3, 3] = origin
    return matrix


def linear(matrix: np.ndarray, shape=(12, 20, 24), slope=(3.0, -2.0, 5.0), level=7.0, mapping=(1.0, 0.0, "")) -> Volume:
    """A field that is linear in the world, so that trilinear interpolation is exact."""
    z, y, x = np.indices(shape)
    world = transform_points(matrix, np.stack([x, y, z], axis=-1))
    stored = (world @ slope + level - mapping[1]) / mapping[0]
    return Volume(stored, matrix, mapping)


coordinate = st.floats(-100.0, 100.0)
points = st.tuples(coordinate, coordinate, coordinate)


@given(points, points)
@settings(max_examples=30, deadline=None)
def test_a_distance_is_that_of_pythagoras(a, b) -> None:
    assert m.distance(np.array([a, b])) == pytest.approx(math.dist(a, b))


@pytest.mark.parametrize("degrees", [0.0, 0.001, 30.0, 90.0, 135.0, 179.999, 180.0])
def test_an_angle_is_exact_also_when_it_is_flat(degrees: float) -> None:
    ways = [
        np.array([5.0, 0.0, 0.0]),
        0.25 * np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0]),
    ]
    corner = np.array([3.0, 4.0, 5.0])
    there = np.array([corner + TURN @ ways[0], corner, corner + TURN @ ways[1]])
    assert m.angle(there) == pytest.approx(degrees, abs=1e-6)


def test_an_angle_without_legs_is_none() -> None:
    assert math.isnan(m.angle(np.zeros((3, 3))))
    assert m.value_text(Measure("angle", ((0, 0, 0),) * 3)) == "no angle"


def test_areas_of_polygons_in_any_plane() -> None:
    star = np.array([(0, 0, 0), (4, 0, 0), (4, 3, 0), (2, 1, 0), (0, 3, 0)], float)  # 12 less a triangle of 4
    turned = star @ TURN.T + [100.0, -50.0, 20.0]
    assert m.area(turned) == pytest.approx(8.0)
    assert m.area(turned[::-1]) == pytest.approx(8.0)
    circle = np.array([(math.cos(t), math.sin(t), 0) for t in np.linspace(0, 2 * math.pi, 360, endpoint=False)])
    assert m.area(7 * circle @ TURN.T) == pytest.approx(49 * 180 * math.sin(math.radians(1)))
    bow = np.array([(0, 0, 0), (2, 2, 0), (2, 0, 0), (0, 2, 0)], float) @ TURN.T
    assert m.crosses_itself(bow)
    assert math.isnan(m.area(bow))


def rectangle(matrix: np.ndarray, low, high, depth: float, axes=(0, 1, 2)) -> np.ndarray:
    """World corners of a box in two indices, at a depth in the third."""
    u, v, w = axes
    index = np.empty((4, 3))
    index[:, u] = low[0], high[0], high[0], low[0]
    index[:, v] = low[1], low[1], high[1], high[1]
    index[:, w] = depth
    return transform_points(matrix, index)


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2, 0), (2, 0, 1)])
@pytest.mark.parametrize("turn", [np.eye(3), TURN])
def test_on_a_layer_exactly_the_voxels_inside_count(axes, turn) -> None:
    matrix = grid(turn=turn)
    values = np.random.default_rng(3).normal(size=(12, 20, 24))
    volume = Volume(values, matrix)
    corners = rectangle(matrix, (2.5, 3.5), (7.5, 9.5), 4, axes)
    found = m.statistics(volume, corners)
    cut = [slice(None)] * 3
    cut[2 - axes[0]], cut[2 - axes[1]], cut[2 - axes[2]] = slice(3, 8), slice(4, 10), 4
    expected = values[tuple(cut)]
    assert found is not None
    assert found.count == expected.size == 30
    assert (found.mean, found.std) == pytest.approx((expected.mean(), expected.std()), rel=1e-12)
    assert (found.min, found.max) == (expected.min(), expected.max())
    spacing = volume.spacing
    assert m.area(corners) == pytest.approx(5 * spacing[axes[0]] * 6 * spacing[axes[1]])


def test_real_values_between_layers_in_their_unit() -> None:
    matrix = grid()
    volume = linear(matrix, mapping=(0.5, -1024.0, "HU"))
    corners = rectangle(matrix, (1.5, 1.5), (8.5, 8.5), 4.25)
    found = m.statistics(volume, corners)
    assert found is not None
    middle = corners.mean(axis=0)
    assert (found.count, found.unit) == (49, "HU")
    assert found.mean == pytest.approx(float(middle @ (3.0, -2.0, 5.0)) + 7.0)


def test_on_a_sheared_grid_the_voxels_inside_count() -> None:
    shear = np.array([[1.0, 0.4, 0.3], [0.0, 1.0, -0.2], [0.0, 0.0, 1.0]])
    matrix = grid(turn=TURN @ shear)
    volume = linear(matrix)
    corners = rectangle(matrix, (2.5, 2.5), (6.5, 8.5), 5)
    found = m.statistics(volume, corners)
    assert found is not None
    assert found.count == 24
    assert found.mean == pytest.approx(float(corners.mean(axis=0) @ (3.0, -2.0, 5.0)) + 7.0)


@pytest.mark.parametrize("normal", [(1.0, 1.0, 0.3), (0.2, -1.0, 0.9)])
def test_on_an_oblique_plane_a_linear_field_is_met_exactly(normal) -> None:
    matrix = grid(spacing=(0.5, 1.0, 2.0), turn=TURN)
    volume = linear(matrix, shape=(40, 80, 160))
    plane = Plane(tuple(volume.centre), normal)
    right, up = plane.axes
    corners = m.corners_of(plane, volume.centre - 6 * right - 4 * up, volume.centre + 6 * right + 4 * up)
    found = m.statistics(volume, corners)
    assert found is not None
    assert m.area(corners) == pytest.approx(96.0)
    assert found.count == pytest.approx(96.0 / 0.25, rel=0.05)
    slope = np.array((3.0, -2.0, 5.0))
    assert found.mean == pytest.approx(float(volume.centre @ slope) + 7.0, rel=1e-9)
    spread = math.sqrt((slope @ right) ** 2 * 12**2 / 12 + (slope @ up) ** 2 * 8**2 / 12)
    assert found.std == pytest.approx(spread, rel=0.02)


def test_a_disc_of_a_ball_has_its_area_and_its_mean() -> None:
    """The middle cut of 1 - r within its zero: mean 1/3, found by samples a voxel apart."""
    n = 41
    axis = (2 * np.arange(n) + 1) / n - 1
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    volume = Volume(np.maximum(1 - np.sqrt(x * x + y * y + z * z), 0).astype(np.float32), np.diag([2.0, 2.0, 2.0, 1.0]))
    circle = np.array([(math.cos(t), math.sin(t), 0) for t in np.linspace(0, 2 * math.pi, 720, endpoint=False)])
    for basis in (np.eye(3), TURN):
        found = m.statistics(volume, volume.centre + n * circle @ basis.T)
        assert found is not None
        assert found.count * 4.0 == pytest.approx(math.pi * n * n, rel=0.02)
        assert found.mean == pytest.approx(1 / 3, rel=0.02)


def test_what_is_outside_or_no_number_does_not_count() -> None:
    values = np.ones((4, 4, 4), np.float32)
    values[2, 1, 1] = np.nan
    volume = Volume(values, np.eye(4))
    found = m.statistics(volume, rectangle(np.eye(4), (-9.0, -9.0), (9.0, 9.0), 2))
    assert found is not None
    assert (found.count, found.mean) == (15, 1.0)
    assert m.statistics(volume, rectangle(np.eye(4), (5.0, 5.0), (9.0, 9.0), 2)) is None
    assert m.statistics(volume, rectangle(np.eye(4), (0.0, 0.0), (3.0, 3.0), 7)) is None


def test_a_corner_that_is_moved_leaves_a_rectangle() -> None:
    plane = Plane((1, 2, 3), (1, 1, 0.3))
    right, up = plane.axes
    start = np.asarray(plane.origin)
    corners = m.corners_of(plane, start, start + 4 * right + 2 * up)
    measure = Measure("rectangle", tuple(map(tuple, corners.tolist())))
    for place in range(4):
        there = m.moved(measure, place, corners[(place + 2) % 4] + 6 * right + 5 * up)
        assert m.area(there.array) == pytest.approx(30.0)
        np.testing.assert_allclose(there.array[(place + 2) % 4], corners[(place + 2) % 4])
    line = Measure("distance", ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)))
    assert m.moved(line, 1, np.array([0.0, 2.0, 0.0])).points == ((0.0, 0.0, 0.0), (0.0, 2.0, 0.0))


def test_measures_are_written_and_read_and_nonsense_is_not() -> None:
    measure = Measure("angle", ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 2.0, 0.0)))
    assert Measure.from_json(measure.to_json()) == measure
    bad = ({}, None, 3, {"kind": "angle", "points": [[0, 0, 0]]}, {"kind": "weight", "points": []})
    assert [Measure.from_json(json) for json in bad] == [None] * 5
    assert Measure.from_json({"kind": "distance", "points": [[0, 0, 0], [0, 0, "a"]]}) is None


@pytest.mark.parametrize(
    ("length", "text"),
    [(123.456, "123.5 mm"), (12.3456, "12.35 mm"), (0.5, "0.500 mm"), (0.00026, "0.26 µm"), (0.0, "0.000 mm")],
)
def test_lengths_are_told_in_a_unit_that_suits(length: float, text: str) -> None:
    assert m.length_text(length) == text
