"""Volumes in fewer bits: the stated bound holds, and what is chosen is the narrowest that keeps an error."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph.data import Mapping, Volume
from nodegraph.data.quantisation import TYPES, bound, narrowest, stored

pytestmark = pytest.mark.slow

ITEMS = {"uint8": 1, "uint16": 2, "float16": 2, "float32": 4}
DTYPES = ("float16", "float32", "float64", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64")


def itemsize(name):
    return np.dtype(name).itemsize


def field(seed, dtype, scale, offset, missing):
    """A random field over a random part of what its type can hold, some of it not finite."""
    rng = np.random.default_rng(seed)
    if dtype.startswith("f"):
        data = (rng.uniform(-1, 1) + rng.random((3, 4, 5)) * 10.0 ** rng.uniform(-3, 3)).astype(dtype)
        if missing:
            data.flat[rng.integers(0, data.size, 4)] = rng.choice([np.nan, np.inf, -np.inf], 4)
    else:
        limits = np.iinfo(dtype)
        ends = rng.integers(max(limits.min, -(2**40)), min(limits.max, 2**40), 2, endpoint=True)
        data = rng.integers(ends.min(), ends.max(), (3, 4, 5), endpoint=True).astype(dtype)
    return Volume(data, mapping=Mapping(scale, offset, "HU"))


@settings(max_examples=300, deadline=None, database=None, derandomize=True)
@given(
    seed=st.integers(0, 2**31), dtype=st.sampled_from(DTYPES), missing=st.booleans(),
    mapping=st.sampled_from([(1.0, 0.0), (-0.5, 1000.0), (1e-6, 3.0), (0.1, -1e9)]),
)  # fmt: skip
def test_no_value_is_off_by_more_than_is_said(seed, dtype, missing, mapping):
    volume = field(seed, dtype, *mapping, missing)
    real = volume.real(np.float64)
    seen = np.isfinite(real)
    for storage in TYPES:
        error = bound(volume, storage)
        if error == np.inf:
            assert not seen.all()
            continue
        found = stored(volume, storage)
        assert found.dtype == storage
        assert found.mapping.unit == "HU"
        back = found.real(np.float64)
        # Sums and products of doubles are themselves known to some units in the last place.
        known = 4 * np.spacing(max(np.abs(real[seen]).max(initial=0.0), abs(mapping[1])))
        assert np.abs(back[seen] - real[seen]).max(initial=0.0) <= error * (1 + 1e-9) + known
        assert np.array_equal(back[~seen], real[~seen], equal_nan=True)


@settings(max_examples=200, deadline=None, database=None, derandomize=True)
@given(seed=st.integers(0, 2**31), dtype=st.sampled_from(DTYPES), missing=st.booleans(), power=st.floats(-9, 0))
def test_what_is_chosen_keeps_the_error_and_nothing_narrower_does(seed, dtype, missing, power):
    volume = field(seed, dtype, 1.0, 0.0, missing)
    allowed = 10.0**power * (volume.range[1] - volume.range[0])
    chosen = narrowest(volume, allowed, itemsize)
    keep = {name for name in TYPES if bound(volume, name) <= allowed and itemsize(name) < volume.dtype.itemsize}
    if chosen is None:
        assert not keep
    else:
        assert chosen in keep
        least = min(itemsize(name) for name in keep)
        assert itemsize(chosen) == least
        assert bound(volume, chosen) == min(bound(volume, name) for name in keep if itemsize(name) == least)


def test_each_type_is_chosen_where_it_is_the_narrowest():
    smooth = np.linspace(0.0, 100.0, 60).reshape(3, 4, 5)
    holes = smooth.copy()
    holes[0, 0, 0] = np.nan
    for data, share, expected in (
        (smooth, 1 / 500, "uint8"), (smooth, 1e-3, "uint16"), (smooth, 1e-5, "uint16"), (smooth, 1e-6, "float32"),
        (smooth, 1e-9, None), (holes, 1 / 500, "float16"), (holes, 1e-5, "float32"),
        (smooth.astype(np.float32), 1e-6, None), (np.rint(smooth).astype(np.int32), 0.0, "uint8"),
        (np.rint(smooth * 100).astype(np.int16), 0.0, None), (np.rint(smooth).astype(np.uint8), 0.5, None),
    ):  # fmt: skip
        volume = Volume(data)
        assert narrowest(volume, share * (volume.range[1] - volume.range[0]), itemsize) == expected


def test_it_counts_what_a_type_takes_where_it_lies():
    """Where 8 bits take as much as 16, the 16 lose less; half floats gain nothing where they take as much as floats."""
    volume = Volume(np.linspace(0.0, 1.0, 60, dtype=np.float32).reshape(3, 4, 5))
    wide = {"uint8": 2, "uint16": 2, "float16": 4, "float32": 4}
    assert narrowest(volume, 0.01, wide.__getitem__) == "uint16"
    assert narrowest(Volume(volume.data * np.nan), 1.0, wide.__getitem__) is None
    assert narrowest(Volume((volume.data * 9000).astype(np.int16)), 100.0, lambda name: 2) is None


@pytest.mark.parametrize("value", [0.0, 123.25, -1e9, 1e300])
@pytest.mark.parametrize("storage", TYPES)
def test_a_constant_is_kept(storage, value):
    volume = Volume(np.full((2, 3, 4), value))
    assert bound(volume, storage) == 0.0
    assert np.all(stored(volume, storage).real(np.float64) == value)


def test_ranges_that_no_mapping_in_single_precision_spans_are_left():
    for spread in (1e-41, 1e39):
        volume = Volume(np.array([0.0, spread]).reshape(1, 1, 2))
        assert narrowest(volume, spread, itemsize) is None


def test_volumes_without_a_finite_value_stay_without():
    data = np.full((2, 2, 2), np.nan)
    data[0, 0, 0] = np.inf
    volume = Volume(data)
    chosen = narrowest(volume, 0.0, itemsize)
    assert chosen == "float16"
    assert np.array_equal(stored(volume, chosen).real(np.float64), data, equal_nan=True)


def test_volumes_of_several_components_and_in_slabs_are_stored_alike():
    data = np.random.default_rng(3).random((40, 200, 200, 2)).astype(np.float32)
    volume = Volume(data)
    found = stored(volume, "uint16")
    assert found.buffer.shape == data.shape
    assert np.abs(found.real(np.float64) - data).max() <= bound(volume, "uint16")
