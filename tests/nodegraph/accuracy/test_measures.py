"""Errors by port type, against figures worked out by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph import plugins
from nodegraph.accuracy.differences import Differences, distance
from nodegraph.accuracy.measures import Measure, display, errors, mean_flip, measure_of
from nodegraph.accuracy.surfaces import distances_to_surface, point_triangle_distances
from nodegraph.data import Image, Labels, Mesh, Table, Volume
from nodegraph.data.mesh import box
from nodegraph.errors import PortError


def grey(level: float, height: int = 10, width: int = 100) -> np.ndarray:
    return np.full((height, width, 4), level, np.float64)


# -- arrays ----------------------------------------------------------------------------------------------------------


def test_what_is_not_finite_equals_its_like_and_nothing_else() -> None:
    inf, nan = np.inf, np.nan
    value = np.array([1.0, inf, nan, inf, nan, inf, 2.0])
    reference = np.array([4.0, inf, nan, -inf, 1.0, 0.0, nan])
    assert distance(value, reference).tolist() == [3.0, 0.0, 0.0, inf, inf, inf, inf]


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 3000), st.integers(1, 5), st.integers(0, 2**32 - 1))
def test_statistics_in_portions_are_those_of_the_whole(places: int, portions: int, seed: int) -> None:
    values = np.abs(np.random.default_rng(seed).normal(size=(places, 3)))
    differences = Differences(places)
    for part in np.array_split(values, portions):
        differences.add(part)
    worst = np.sort(values.max(axis=1))
    assert differences.max == worst[-1]
    assert differences.p999 == worst[math.ceil(places * 999 / 1000 - 1e-9) - 1]
    assert differences.rmse == pytest.approx(np.sqrt((values**2).mean()), rel=1e-12)


# -- pictures --------------------------------------------------------------------------------------------------------


def test_a_picture_against_figures_worked_out_by_hand() -> None:
    value = grey(0.5)
    value[0, 0] = [0.5, 0.7, 0.5, 0.5]
    value[3, 4] = [0.9, 0.5, 0.5, 0.5]
    found = errors(Image(value), Image(grey(0.5)))
    square = (0.2**2 + 0.4**2) / 4000
    assert found == {
        "max": pytest.approx(0.4),
        "rmse": pytest.approx(math.sqrt(square)),
        "psnr": pytest.approx(-10 * math.log10(square)),
        "p999": pytest.approx(0.2),  # of 1000 pixels one lies above it
    }


def test_identical_pictures_have_no_error() -> None:
    image = Image(grey(0.25), np.full((10, 100), 3.0), np.ones((10, 100), np.uint32))
    assert errors(image, image) == {
        "max": 0.0, "rmse": 0.0, "psnr": math.inf, "p999": 0.0,
        "depth_max": 0.0, "depth_rmse": 0.0, "depth_missed": 0.0, "ids_wrong": 0.0,
    }  # fmt: skip


def test_a_mask_leaves_pixels_out_and_an_empty_one_leaves_nothing_to_say() -> None:
    value = grey(0.5)
    value[0, 0, 0] = np.nan
    mask = np.ones((10, 100), bool)
    assert errors(Image(value), Image(grey(0.5)), mask)["max"] == math.inf
    mask[0, 0] = False
    assert errors(Image(value), Image(grey(0.5)), mask)["max"] == 0.0
    none = errors(Image(value), Image(grey(0.5)), np.zeros((10, 100), bool))
    assert set(none) == {"max", "rmse", "psnr", "p999"}
    assert all(math.isnan(error) for error in none.values())
    with pytest.raises(PortError, match="mask has the shape"):
        errors(Image(value), Image(value), np.ones((3, 3), bool))


def test_a_hole_in_a_picture_is_the_greatest_of_errors() -> None:
    value = grey(0.5)
    value[2, 2, 1] = np.nan
    found = errors(Image(value), Image(grey(0.5)))
    assert found["max"] == found["rmse"] == math.inf
    assert found["psnr"] == -math.inf
    assert found["p999"] == 0.0


def test_depth_is_compared_where_both_see_something_and_missed_where_one_does() -> None:
    inf = np.inf
    value = np.array([[10.0, 12.0, inf, inf], [10.0, 10.0, inf, 10.0]])
    reference = np.array([[10.0, 10.0, 10.0, inf], [10.0, inf, inf, 11.0]])
    found = errors(Image(np.zeros((2, 4, 4)), value), Image(np.zeros((2, 4, 4)), reference))
    assert found["depth_max"] == 2.0
    assert found["depth_rmse"] == pytest.approx(math.sqrt((4.0 + 1.0) / 4))
    assert found["depth_missed"] == 2 / 8
    nothing = Image(np.zeros((2, 4, 4)), np.full((2, 4), inf))
    alone = errors(nothing, nothing)
    assert math.isnan(alone["depth_max"])
    assert alone["depth_missed"] == 0.0


def test_ids_and_pairs_of_distances() -> None:
    ids = np.zeros((2, 2), np.uint32)
    other = ids.copy()
    other[0, 0] = 2**31
    color = np.zeros((2, 2, 2))
    apart = color + np.array([0.0, 3.0])
    found = errors(Image(apart, ids=ids), Image(color, ids=other))
    assert found == {"max": 3.0, "rmse": pytest.approx(math.sqrt(4.5)), "p999": 3.0, "ids_wrong": 0.25}


def test_pictures_of_two_sizes_cannot_be_compared() -> None:
    with pytest.raises(PortError, match="render both in one size"):
        errors(Image(grey(0.5, 10)), Image(grey(0.5, 11)))
    with pytest.raises(PortError, match="cannot be compared"):
        errors(Image(grey(0.5)), Image(grey(0.5)[..., :2]))
    with pytest.raises(PortError, match="an Image cannot be compared with a Table"):
        errors(Image(grey(0.5)), Table({"a": [1]}))


def test_single_against_double_precision() -> None:
    found = errors(Image(grey(0.1).astype(np.float32)), Image(grey(0.1)))
    assert found["max"] == abs(float(np.float32(0.1)) - 0.1)


def test_flip_is_told_when_it_is_asked_for() -> None:
    black, white = Image(grey(0.0, 16, 16)), Image(grey(1.0, 16, 16))
    opaque = np.zeros((16, 16, 4))
    opaque[..., 3] = 1.0
    assert "flip" not in errors(white, black)
    assert errors(white, black, flip=True)["flip"] == pytest.approx(1.0, abs=0.05)
    assert errors(Image(opaque), black, flip=True)["flip"] == 0.0, "over black, the alpha of black makes no difference"
    half = np.zeros((16, 16), bool)
    half[:, :8] = True
    mixed = grey(0.0, 16, 16)
    mixed[:, 12:] = 1.0
    assert mean_flip(Image(mixed), black, half) < mean_flip(Image(mixed), black)
    assert math.isnan(mean_flip(white, black, np.zeros((16, 16), bool)))


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (3, 2)])
def test_flip_of_pictures_that_are_smaller_than_its_filters(shape: tuple[int, int]) -> None:
    one, other = Image(np.full((*shape, 4), 0.2)), Image(np.full((*shape, 4), np.inf))
    assert mean_flip(one, one) == 0.0
    assert 0.0 < mean_flip(other, one) <= 1.0


def test_a_display_shows_srgb_and_black_for_a_hole() -> None:
    color = np.zeros((1, 3, 4))
    color[0, 0] = [0.5, 0.0, 2.0, 1.0]
    color[0, 1] = np.nan
    shown = display(Image(color))
    assert shown.dtype == np.float32
    assert shown[0, 0].tolist() == pytest.approx([0.735357, 0.0, 1.0], abs=1e-5)
    assert shown[0, 1].tolist() == [0.0, 0.0, 0.0]


# -- grids -----------------------------------------------------------------------------------------------------------


def test_a_volume_is_compared_in_real_values() -> None:
    stored = np.arange(24, dtype=np.int16).reshape(2, 3, 4)
    ours = Volume(stored, mapping=(2.0, -10.0, "HU"))
    theirs = Volume(stored * 2.0 - 10.0 + np.where(stored == 5, 3.0, 0.0))
    rmse = math.sqrt(9.0 / 24)
    assert errors(ours, theirs) == {
        "max": 3.0,
        "rmse": pytest.approx(rmse),
        "psnr": pytest.approx(20 * math.log10(46.0 / rmse)),
        "p999": 3.0,
    }


def test_a_constant_reference_has_no_peak() -> None:
    constant = Volume(np.full((2, 2, 2), 7.0))
    assert errors(constant, constant)["psnr"] == math.inf
    assert errors(Volume(np.full((2, 2, 2), 8.0)), constant)["psnr"] == -math.inf


def test_a_volume_of_several_portions_and_components(rng: np.random.Generator) -> None:
    reference = rng.random((30, 200, 200, 2))
    value = reference.copy()
    value[29, 199, 199, 1] += 0.5
    found = errors(Volume(value), Volume(reference))
    assert found["max"] == pytest.approx(0.5)
    assert found["p999"] == 0.0
    assert found["rmse"] == pytest.approx(0.5 / math.sqrt(reference.size))


def test_volumes_on_two_grids_cannot_be_compared() -> None:
    one = Volume(np.zeros((2, 2, 2)))
    with pytest.raises(PortError, match="resample one to the other"):
        errors(one, Volume(np.zeros((2, 2, 3))))
    with pytest.raises(PortError, match="resample one to the other"):
        errors(one, Volume(np.zeros((2, 2, 2)), np.diag([2.0, 1.0, 1.0, 1.0])))
    with pytest.raises(PortError, match="components"):
        errors(one, Volume(np.zeros((2, 2, 2, 3))))


def test_labels_are_right_or_wrong() -> None:
    ids = np.zeros((2, 2, 2), np.uint32)
    other = ids.copy()
    other[0, 0] = 4_000_000_000
    assert errors(Labels(other), Labels(ids)) == {"wrong": 0.25}


# -- meshes ----------------------------------------------------------------------------------------------------------


def cube(side: float) -> Mesh:
    return box([[side * (i & 1), side * (i >> 1 & 1), side * (i >> 2 & 1)] for i in range(8)])


def test_point_and_triangle_in_each_region() -> None:
    triangle = np.array([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
    cases = {
        (1.0, 1.0, 2.0): 2.0,  # over the face
        (2.0, -3.0, 4.0): 5.0,  # an edge
        (-3.0, -4.0, 0.0): 5.0,  # a corner
        (7.0, 0.0, 4.0): 5.0,  # another corner
        (2.0 + 0.6, 1.5 + 0.8, 0.0): 1.0,  # the hypotenuse
        (0.5, 0.5, 0.0): 0.0,
    }
    points = np.array(list(cases))
    found = point_triangle_distances(points, np.repeat(triangle[None], len(points), axis=0))
    assert found.tolist() == pytest.approx(list(cases.values()), abs=1e-14)
    for flat, expected in (([[0.0] * 3] * 3, 13.0), ([[0.0] * 3, [0.0, 0.0, 9.0], [0.0, 0.0, 4.0]], 5.0)):
        assert point_triangle_distances(np.array([[3.0, 4.0, 9.0 if expected == 5.0 else 12.0]]), np.array([flat]))[
            0
        ] == pytest.approx(expected)


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 60), st.floats(-3, 3), st.integers(0, 2**32 - 1))
def test_the_search_finds_what_trying_every_triangle_finds(count: int, spread: float, seed: int) -> None:
    """Triangles of very different sizes, some without area, points near and far."""
    rng = np.random.default_rng(seed)
    sizes = 10.0 ** rng.uniform(-abs(spread), abs(spread), count)
    corners = rng.normal(size=(count, 1, 3)) * 2 + rng.normal(size=(count, 3, 3)) * sizes[:, None, None]
    corners[::7, 2] = corners[::7, 1]
    mesh = Mesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    points = rng.normal(size=(40, 3)) * 10.0 ** rng.uniform(-1, 2, (40, 1))
    brute = np.min([point_triangle_distances(points, np.repeat(c[None], 40, axis=0)) for c in corners], axis=0)
    np.testing.assert_allclose(distances_to_surface(points, mesh), brute, rtol=1e-12, atol=1e-12)


def test_points_that_are_as_far_from_every_triangle(monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    """In the middle of a sphere no triangle can be left out early; a few pairs at a time get there as well."""
    corners = rng.normal(size=(300, 1, 3))
    corners = corners / np.linalg.norm(corners, axis=2, keepdims=True) + 1e-3 * rng.normal(size=(300, 3, 3))
    mesh = Mesh(corners.reshape(-1, 3), np.arange(900).reshape(-1, 3))
    points = 1e-3 * rng.normal(size=(20, 3))
    brute = np.min([point_triangle_distances(points, np.repeat(c[None], 20, axis=0)) for c in corners], axis=0)
    monkeypatch.setattr("nodegraph.accuracy.surfaces.PAIRS", 700)
    np.testing.assert_allclose(distances_to_surface(points, mesh), brute, rtol=1e-13)


def test_a_triangle_and_sampling_it_agree(rng: np.random.Generator) -> None:
    """Independent of every formula: no sample of a triangle is nearer, and some is nearly as near."""
    corners = rng.normal(size=(20, 3, 3))
    points = rng.normal(size=(20, 3)) * 2
    u, v = (grid.ravel() for grid in np.meshgrid(*[np.linspace(0, 1, 201)] * 2))
    u, v = u[u + v <= 1], v[u + v <= 1]
    on = np.einsum("kw,nwi->nki", np.stack([1 - u - v, u, v], axis=1), corners)
    sampled = np.linalg.norm(on - points[:, None], axis=2).min(axis=1)
    exact = point_triangle_distances(points, corners)
    assert (exact <= sampled + 1e-12).all()
    assert (sampled - exact).max() < 0.03


def test_meshes_are_compared_both_ways() -> None:
    inner = cube(1.0)
    grown = Mesh(inner.vertices * 1.5 - 0.25, inner.triangles)
    found = errors(grown, inner)
    assert found["max"] == pytest.approx(0.25 * math.sqrt(3))  # a corner to the corner
    # Eight corners of the inner cube lie 0.25 below the faces, eight of the outer one 0.433 from the inner corners.
    assert found["rmse"] == pytest.approx(math.sqrt((8 * 0.0625 + 8 * 0.1875) / 16))
    assert errors(inner, inner) == {"max": 0.0, "rmse": 0.0}


def test_other_triangles_of_the_same_surface_are_no_error() -> None:
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 0], [9.0, 9, 9]])
    one = Mesh(square[:4], [[0, 1, 2], [0, 2, 3]])
    fan = Mesh(square, [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])  # the last vertex belongs to no triangle
    assert errors(one, fan)["max"] == pytest.approx(0.0, abs=1e-15)


def test_a_mesh_without_triangles_is_infinitely_far_from_one_with() -> None:
    empty = Mesh(np.zeros((0, 3)), np.zeros((0, 3), int))
    assert errors(empty, empty) == {"max": 0.0, "rmse": 0.0}
    assert errors(empty, cube(1.0)) == {"max": math.inf, "rmse": math.inf}


# -- tables and numbers ----------------------------------------------------------------------------------------------


def test_a_table_tells_its_worst_number() -> None:
    reference = Table({"volume": [10.0, 100.0], "count": [4, 0], "name": ["a", "b"]})
    value = Table({"volume": [11.0, 105.0], "count": [4, 0], "name": ["a", "c"]})
    assert errors(value, reference) == {"absolute": 5.0, "relative": pytest.approx(0.1), "text_wrong": 0.5}
    assert errors(Table({"a": [1]}), Table({"a": [0]})) == {"absolute": 1.0, "relative": math.inf}
    assert errors(Table({}), Table({})) == {"absolute": 0.0, "relative": 0.0}
    with pytest.raises(PortError, match="same columns and rows"):
        errors(Table({"a": [1]}), Table({"a": [1, 2]}))
    with pytest.raises(PortError, match="same columns and rows"):
        errors(Table({"a": [1]}), Table({"b": [1]}))


@pytest.mark.parametrize(
    ("value", "reference", "expected"),
    [
        (2.5, 2.0, {"absolute": 0.5, "relative": 0.25}),
        (3, -1.5, {"absolute": 4.5, "relative": 3.0}),
        (np.float32(1.5), 1, {"absolute": 0.5, "relative": 0.5}),
        (0.0, 0.0, {"absolute": 0.0, "relative": 0.0}),
        (math.nan, math.nan, {"absolute": 0.0, "relative": 0.0}),
        (math.nan, 1.0, {"absolute": math.inf, "relative": math.inf}),
        (math.inf, -math.inf, {"absolute": math.inf, "relative": math.inf}),
        ((1.0, 2.0), (1.0, 4.0), {"absolute": 2.0, "relative": 0.5}),
        (True, False, {"wrong": 1.0}),
        ("CT", "CT", {"wrong": 0.0}),
    ],
)
def test_numbers_and_words(value: Any, reference: Any, expected: dict[str, float]) -> None:
    assert errors(value, reference) == expected


def test_what_cannot_be_compared_is_told() -> None:
    with pytest.raises(PortError, match="2 and 3 numbers"):
        errors((1.0, 2.0), (1.0, 2.0, 3.0))
    with pytest.raises(PortError, match="only numbers"):
        errors(("a",), ("b",))
    with pytest.raises(PortError, match="no places that a mask"):
        errors(1.0, 1.0, np.ones((2, 2), bool))


# -- plug-ins --------------------------------------------------------------------------------------------------------


class Tree:
    """A type of a plug-in."""

    def __init__(self, nodes: int) -> None:
        self.nodes = nodes


def test_a_plugin_brings_a_measure_of_its_type(monkeypatch: pytest.MonkeyPatch) -> None:
    measure = Measure(Tree, lambda value, reference, mask: {"nodes": abs(value.nodes - reference.nodes)}, ("nodes",))
    broken = plugins.Plugin("broken", None, "needs the package 'trees': pip install trees", "other")
    found = (plugins.Plugin("tree", measure, "", "trees"), broken)
    with pytest.raises(PortError, match=r"no measure for a Tree; a plug-in may bring one"):
        errors(Tree(1), Tree(2))
    monkeypatch.setattr(plugins, "discover", lambda group: found if group == "nodegraph.measures" else ())
    assert errors(Tree(1), Tree(4)) == {"nodes": 3}
    assert measure_of(Tree(1)).first == "nodes"
    assert measure_of(Image(grey(0.5))).rising == {"psnr"}


def test_every_figure_is_among_those_that_a_measure_declares() -> None:
    image = Image(grey(0.5), np.ones((10, 100)), np.zeros((10, 100), np.uint32))
    table = Table({"a": [1.0], "b": ["x"]})
    volume, labels = Volume(np.zeros((2, 2, 2))), Labels(np.zeros((2, 2, 2), np.uint8))
    for value in (image, volume, labels, cube(1.0), table, 1.5, 1, (1.0,), True, "x"):
        figures = tuple(errors(value, value, flip=True))
        assert figures == measure_of(value).figures
