"""Areas over value and gradient magnitude: what they weigh, how they add, their table, their JSON.

Checks: Rezk-Salama 2001, T06; Schlosser 2009, C06 (nothing that can be seen is left out).
"""

import json

import numpy as np
import pytest

from nodegraph.data import Gaussian, TransferFunction, TransferFunction2D, Trapezoid, bricks
from nodegraph.errors import ParameterError

RED, BLUE, GREY = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.5, 0.5, 0.5)
BOX = Trapezoid.rectangle((20.0, 40.0), (5.0, 15.0), RED, 0.5)
TRIANGLE = Trapezoid((30.0, 30.0), (20.0, 40.0), (0.0, 20.0), 0.5, BLUE, 0.8)
BELL = Gaussian((60.0, 10.0), (10.0, 3.0), GREY, 0.25)
MANY = TransferFunction2D([BOX, TRIANGLE, BELL], 2.5)


def sampled(function, columns, rows, values, gradients):
    """The table, read as a kernel reads it: linear in between, clamped at its border."""
    table = function.table(columns, rows)
    a, b, c, d = function.lookup(columns, rows)
    x, y = np.clip(values * a + b, 0, columns - 1), np.clip(gradients * c + d, 0, rows - 1)
    i, j = np.minimum(x.astype(int), columns - 2), np.minimum(y.astype(int), rows - 2)
    u, v = (x - i)[..., None], (y - j)[..., None]
    below = table[j, i] * (1 - u) + table[j, i + 1] * u
    return below * (1 - v) + (table[j + 1, i] * (1 - u) + table[j + 1, i + 1] * u) * v


def test_a_hard_rectangle_is_all_or_nothing_with_its_edges():
    function = TransferFunction2D([BOX])
    full = -np.log(0.5)
    inside = function.evaluate([20.0, 30.0, 40.0, 30.0], [5.0, 10.0, 15.0, 15.0])
    assert np.allclose(inside, [*RED, full])
    assert not function.evaluate([19.999, 40.001, 30.0, 30.0], [10.0, 10.0, 4.999, 15.001]).any()


def test_softness_is_a_share_of_half_the_width_and_half_the_height():
    function = TransferFunction2D([Trapezoid.rectangle((0.0, 10.0), (10.0, 30.0), RED, 0.5, 0.4)])
    full = -np.log(0.5)
    across = function.evaluate([0.0, 1.0, 2.0, 5.0, 8.0, 9.0, 10.0], 20.0)[:, 3]
    assert np.allclose(across / full, [0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0])
    along = function.evaluate(5.0, [10.0, 12.0, 14.0, 20.0, 26.0, 28.0, 30.0])[:, 3]
    assert np.allclose(along / full, [0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0])
    assert function.evaluate(1.0, 12.0)[3] == pytest.approx(0.25 * full), "a corner is the product"


def test_an_edge_at_no_gradient_is_hard():
    function = TransferFunction2D([Trapezoid.rectangle((0.0, 10.0), (0.0, 30.0), RED, 0.5, 1.0)])
    assert function.evaluate(5.0, 0.0)[3] == pytest.approx(-np.log(0.5))


def test_the_sides_of_a_trapezoid_lean():
    function = TransferFunction2D([Trapezoid((28.0, 30.0), (20.0, 40.0), (0.0, 20.0), 0.0, BLUE, 0.8)])
    shown = function.evaluate([28.0, 27.9, 24.0, 23.9, 35.0, 35.1, 20.0], [0.0, 0.0, 10.0, 10.0, 10.0, 10.0, 20.0])
    assert (shown[:, 3] > 0).tolist() == [True, False, True, False, True, False, True]
    assert TransferFunction2D([TRIANGLE]).evaluate(30.0, 0.0)[3] >= 0.0, "the tip is a single value"


def test_a_gaussian_ends_at_three_deviations():
    function = TransferFunction2D([BELL])
    full = -np.log(0.75)
    assert function.evaluate(60.0, 10.0)[3] == pytest.approx(full)
    ring = [(60 + 10 * r, 10.0) for r in (1.0, 2.0, 2.999, 3.0, 4.0)]
    shown = np.array([function.evaluate(*at)[3] for at in ring]) / full
    floor = np.exp(-4.5)
    assert shown[:2] == pytest.approx((np.exp([-0.5, -2.0]) - floor) / (1 - floor))
    assert 0 < shown[2] < 1e-4
    assert shown[3:].tolist() == [0.0, 0.0]


def test_where_areas_overlap_extinctions_add_in_any_order():
    red = Trapezoid.rectangle((0.0, 2.0), (0.0, 2.0), RED, 0.5)
    blue = Trapezoid.rectangle((1.0, 3.0), (0.0, 2.0), BLUE, 0.75)
    both = TransferFunction2D([red, blue]).evaluate(1.5, 1.0)
    a, b = -np.log(0.5), -np.log(0.25)
    assert both == pytest.approx([a / (a + b), 0.0, b / (a + b), a + b])
    assert np.array_equal(both, TransferFunction2D([blue, red]).evaluate(1.5, 1.0))


def test_another_reference_length_with_opacities_re_expressed_changes_nothing():
    finer = [area._replace(opacity=1 - (1 - area.opacity) ** 0.1) for area in MANY.areas]
    v, g = np.meshgrid(np.linspace(0, 100, 60), np.linspace(0, 30, 50))
    assert np.allclose(TransferFunction2D(finer, 0.25).evaluate(v, g), MANY.evaluate(v, g), rtol=1e-9, atol=1e-12)


def test_over_all_magnitudes_it_is_a_function_of_one_variable():
    """A soft rectangle is four keys: extinction is linear in both."""
    function = TransferFunction2D([Trapezoid.rectangle((10.0, 50.0), (0.0, 1e6), RED, 0.5, 0.5)])
    flat = TransferFunction([(10, RED, 0.0), (20, RED, 0.5), (40, RED, 0.5), (50, RED, 0.0)])
    values = np.linspace(0, 60, 1001)
    for gradient in (0.0, 3.0, 1e4):
        assert np.allclose(function.evaluate(values, gradient)[:, 3], flat.evaluate(values)[:, 3], atol=1e-12)


def test_what_is_not_finite_is_nothing():
    values, gradients = [30.0, np.nan, np.inf, 30.0, 30.0, -np.inf], [10.0, 10.0, 10.0, np.nan, np.inf, 10.0]
    assert MANY.evaluate(values, gradients)[:, 3].astype(bool).tolist() == [True] + [False] * 5
    assert not TransferFunction2D().evaluate(0.0, 0.0).any()


@pytest.mark.parametrize("function", [MANY, TransferFunction2D([BOX]), TransferFunction2D([BELL])], ids=str)
def test_the_table_meets_the_function_on_its_grid_and_converges(function):
    columns, rows = 40, 31
    a, b, c, d = function.lookup(columns, rows)
    values, gradients = (np.arange(1, columns - 1) - b) / a, (np.arange(rows) - d) / c
    exact = function.emission(values[None, 1:-1], gradients[2:-2, None])  # rounding decides about hard edges
    assert np.allclose(function.table(columns, rows)[2:-2, 2:-2], exact, atol=1e-9)
    v, g = np.meshgrid(np.linspace(0, 100, 301), np.linspace(0, 30, 201))
    errors = [np.abs(sampled(function, n, n, v, g) - function.emission(v, g)).mean() for n in (32, 128, 512)]
    assert errors[1] < 0.5 * errors[0]
    assert errors[2] < 0.5 * errors[1]


def test_beyond_the_table_is_nothing():
    for function in (MANY, TransferFunction2D([BOX])):
        values, gradients = np.array([-1e9, 1e9, 30.0, -1e9]), np.array([1.0, 1.0, 1e9, 1e9])
        assert not sampled(function, 16, 16, values, gradients).any()
    assert not TransferFunction2D([BOX]).table(16, 16)[0].any(), "below the least magnitude"
    shown = sampled(TransferFunction2D([TRIANGLE]), 64, 64, np.array([30.0]), np.array([0.0]))
    assert shown.shape == (1, 4)


def test_colours_do_not_fade_towards_an_edge():
    matter = sampled(TransferFunction2D([BOX]), 16, 16, np.array([19.5]), np.array([10.0]))[0]
    assert matter[3] > 0
    assert matter[:3] / matter[3] == pytest.approx(RED)


def test_equal_functions_share_one_table_that_nobody_can_change():
    assert MANY.table(16, 16) is TransferFunction2D(list(MANY.areas), 2.5).table(16, 16)
    with pytest.raises(ValueError, match="read-only"):
        MANY.table(16, 16)[0, 0, 0] = 1.0
    with pytest.raises(ParameterError, match="at least 4"):
        MANY.table(3, 16)


def test_values_far_from_zero_keep_their_place():
    function = TransferFunction2D([BOX._replace(bottom=(1e6, 1e6 + 2), top=(1e6, 1e6 + 2))])
    a, b, _, _ = function.lookup(64, 64, less=1e6)
    assert (b, 2.0 * a + b) == pytest.approx((1.0, 62.0))


def test_no_brick_that_can_be_seen_is_left_out(rng):
    """Each brick against many values in its range and magnitudes."""
    low = rng.uniform(-10, 110, 100)
    ranges = np.stack([low, low + rng.exponential(6.0, 100)], -1)[None, None]
    found = bricks.visible_bricks(ranges, MANY.greatest(64, 48), MANY.lookup(64, 48)[:2])[0, 0]
    values = ranges[0, 0, :, :1] + np.linspace(0, 1, 50) * np.diff(ranges[0, 0])
    seen = sampled(MANY, 64, 48, values[..., None], np.linspace(0, 30, 40)[None, None])[..., 3].max(axis=(1, 2)) > 0
    assert np.all(found[seen])
    assert not found.all()
    assert found.sum() <= seen.sum() + 6, "and hardly any other is kept"


def test_json_and_parts_round_trip():
    text = json.dumps(MANY.to_json(), allow_nan=False)
    assert TransferFunction2D.from_json(json.loads(text)) == MANY
    assert TransferFunction2D.from_parts(*MANY.to_parts()) == MANY
    assert hash(TransferFunction2D.from_json(MANY.to_json())) == hash(MANY)
    assert MANY != TransferFunction2D(MANY.areas)
    without = {key: value for key, value in BOX.to_json().items() if key != "softness"}
    assert TransferFunction2D([without]) == TransferFunction2D([BOX])
    assert MANY.summary() == "3 areas over 20..90 x 0..20 per mm, opacity per 2.5 mm"


BAD = [
    ("areas", "abc", "expected a list"),
    ("areas", 3, "expected a list"),
    ("areas", [3], r"areas\[0\]: expected an object"),
    ("areas", [{"shape": "trapez"}], "trapezoid"),
    ("areas", [{}], "there is trapezoid, gaussian"),
    ("areas", [{**BOX.to_json(), "colour": 1}], "unknown key 'colour'"),
    ("areas", [{k: v for k, v in BOX.to_json().items() if k != "opacity"}], "a trapezoid needs one"),
    ("areas", [{k: v for k, v in BELL.to_json().items() if k != "sigma"}], "a gaussian needs one"),
    ("areas", [BOX._replace(opacity=1.5)], "outside 0..1"),
    ("areas", [BOX._replace(opacity=np.nan)], "finite"),
    ("areas", [BOX._replace(color=(1, 2))], "expected 3 numbers"),
    ("areas", [BOX._replace(color=(-1, 0, 0))], "at least 0"),
    ("areas", [BOX._replace(bottom=(2, 1))], "the least value comes first"),
    ("areas", [BOX._replace(bottom=(1, 1), top=(2, 2))], "one of them needs a width"),
    ("areas", [BOX._replace(bottom=(1, np.inf))], "finite"),
    ("areas", [BOX._replace(gradients=(5, 5))], "the least first"),
    ("areas", [BOX._replace(gradients=(-1, 5))], "at least 0"),
    ("areas", [BOX._replace(softness=2)], "outside 0..1"),
    ("areas", [BOX._replace(bottom=None)], "expected 2 numbers"),
    ("areas", [BELL._replace(sigma=(0, 1))], "above 0"),
    ("areas", [BELL._replace(center=(0, -1))], "at least 0"),
    ("reference_length", 0.0, "above 0 mm"),
]


@pytest.mark.parametrize(("name", "value", "message"), BAD)
def test_refusals_are_one_sentence_that_begins_with_the_place(name, value, message):
    with pytest.raises(ParameterError, match=message) as raised:
        TransferFunction2D(**{name: value}, where="node.tf")
    assert str(raised.value).startswith(f"node.tf.{name}")
    assert "\n" not in str(raised.value)
