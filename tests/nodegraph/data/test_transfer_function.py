"""Keys, extinction, tables. Checks: Rezk-Salama 2001, R01; Lindemann 2014, L01."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph.data import TransferFunction
from nodegraph.data.transfer_function import MAX_OPACITY
from nodegraph.errors import ParameterError

BONE = [(-100.0, (0, 0, 0), 0.0), (200.0, (1, 0.5, 0.25), 0.5), (900.0, (1, 1, 1), 1.0)]


@given(opacity=st.floats(0.0, MAX_OPACITY), length=st.floats(1e-3, 1e3))
@settings(deadline=None)
def test_an_opacity_holds_over_its_reference_length(opacity, length):
    """Beer and Lambert: through reference_length mm of the material, 1 - opacity of the light is left."""
    extinction = TransferFunction(reference_length=length).extinction(opacity)
    assert -np.expm1(-extinction * length) == pytest.approx(opacity, rel=1e-9, abs=1e-300)


def test_two_halves_hide_as_much_as_the_whole():
    function = TransferFunction(reference_length=3.0)
    half = -np.expm1(-function.extinction(0.7) * 1.5)
    assert 1 - (1 - half) ** 2 == pytest.approx(0.7, rel=1e-12)


def test_another_reference_length_with_keys_re_expressed_changes_nothing():
    fine = TransferFunction(BONE, 1.0)
    keys = [(v, c, float(-np.expm1(-fine.extinction(o) * 0.25))) for v, c, o in BONE]
    values = np.linspace(-300, 1200, 4001)
    assert np.allclose(TransferFunction(keys, 0.25).evaluate(values), fine.evaluate(values), rtol=1e-9, atol=1e-12)


def test_full_opacity_is_finite():
    assert TransferFunction().extinction(1.0) == pytest.approx(24 * np.log(2), rel=1e-6)


def test_between_keys_extinction_is_linear_not_opacity():
    function = TransferFunction([(0, (0, 0, 0), 0.0), (1, (1, 1, 1), 0.9)])
    assert function.evaluate([0.5])[0, 3] == pytest.approx(0.5 * -np.log(0.1), rel=1e-12)
    assert function.evaluate([0.25])[0, :3].tolist() == [0.25] * 3


def test_beyond_the_ends_values_stay_and_nan_is_nothing():
    function = TransferFunction(BONE)
    out = function.evaluate([-np.inf, -1e30, np.inf, 1e30, np.nan])
    assert np.array_equal(out[0], out[1])
    assert np.array_equal(out[0], function.evaluate([-100.0])[0])
    assert np.array_equal(out[2], function.evaluate([900.0])[0])
    assert np.array_equal(out[3], out[2])
    assert out[4].tolist() == [0.0] * 4


def test_a_step_has_a_left_and_a_right_side():
    function = TransferFunction([(0, (0, 0, 0), 0), (1, (0, 0, 0), 0), (1, (1, 0, 0), 0.5), (2, (1, 0, 0), 0.5)])
    assert function.is_step
    assert not TransferFunction(BONE).is_step
    left, at, right = function.evaluate([np.nextafter(1, 0), 1.0, 1.5])
    assert left[0] == 0.0
    assert at[0] == right[0] == 1.0


def test_without_keys_all_is_transparent():
    function = TransferFunction()
    assert not function.evaluate(np.linspace(-5, 5, 11)).any()
    assert not function.table(16).any()
    assert function.domain == (0.0, 1.0)


def lookup(function, values, size):
    """The numpy twin of a kernel's table lookup."""
    table = function.table(size)
    scale, offset = function.lookup(size)
    at = np.clip(np.asarray(values) * scale + offset, 0, size - 1)
    low = np.minimum(np.floor(at).astype(int), size - 2)
    weight = (at - low)[:, None]
    return table[low] * (1 - weight) + table[low + 1] * weight


def test_a_table_differs_from_the_function_only_in_cells_with_a_key():
    function, size = TransferFunction(BONE), 257
    low, high = function.domain
    values = np.linspace(low - 50, high + 50, 20011)
    error = np.abs(lookup(function, values, size) - function.evaluate(values)).max(axis=1)
    width = (high - low) / (size - 1)
    beside_a_key = np.abs(values[:, None] - [key.value for key in function.keys]).min(axis=1) < width
    assert error[~beside_a_key].max() < 1e-10
    # Inside such a cell: at most a quarter of the cell times the change of slope.
    extinctions = [float(function.extinction(key.opacity)) for key in function.keys]
    slopes = np.diff(extinctions) / np.diff([key.value for key in function.keys])
    assert error.max() <= 0.25 * width * abs(slopes[1] - slopes[0]) + 1e-10


def test_a_finer_table_is_closer():
    function = TransferFunction(BONE)
    values = np.linspace(*function.domain, 9973)
    errors = [np.abs(lookup(function, values, n) - function.evaluate(values)).mean() for n in (64, 256, 1024)]
    assert errors[0] > errors[1] > errors[2]


def test_a_lone_step_has_both_sides_in_a_table():
    function = TransferFunction([(300, (0, 0, 0), 0), (300, (1, 0, 0), 0.5)])
    values = [-1e4, 0, 299.9, 300.1, 500, 1e4]
    assert np.array_equal(lookup(function, values, 256), function.evaluate(values))


@pytest.mark.parametrize("size", [1, 2, 5])
def test_a_function_of_one_value_has_a_flat_table(size):
    function = TransferFunction([(3, (0.1, 0.2, 0.3), 0.5)])
    table = function.table(size)
    assert len(table) == max(size, 2)
    assert np.array_equal(table, np.repeat(function.evaluate([3]), max(size, 2), axis=0))
    assert function.lookup(size) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("keys", "length", "message"),
    [
        ("abc", 1.0, r"tf\.keys: expected a list"),
        ([(0, (0, 0, 0))], 1.0, r"tf\.keys\[0\]: expected \[value"),
        ([(0, (0, 0), 0)], 1.0, r"tf\.keys\[0\]\.color: expected 3"),
        ([(0, (0, 0, -1), 0)], 1.0, r"tf\.keys\[0\]\.color: expected linear RGB"),
        ([(0, (0, 0, 0), 1.5)], 1.0, r"tf\.keys\[0\]\.opacity: 1\.5 is outside 0\.\.1"),
        ([("nan", (0, 0, 0), 0)], 1.0, r"tf\.keys\[0\]\.value: expected a finite"),
        ([(1, (0, 0, 0), 0), (0, (0, 0, 0), 0)], 1.0, r"tf\.keys\[1\]: values must ascend"),
        ([(1, (0, 0, 0), 0)] * 3, 1.0, r"tf\.keys\[2\]: at most two keys"),
        ([], 0.0, r"tf\.reference_length: expected a length above 0"),
        ([], "inf", r"tf\.reference_length: expected a finite"),
    ],
)
def test_refusals_name_the_place(keys, length, message):
    with pytest.raises(ParameterError, match=message):
        TransferFunction(keys, length, where="tf")


def test_unknown_json_keys_are_refused_with_the_near_miss():
    with pytest.raises(ParameterError, match="reference_length"):
        TransferFunction.from_json({"reference_lenght": 1})
