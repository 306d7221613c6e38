import numpy as np
import pytest

from nodegraph.data import Mapping, Volume
from nodegraph.errors import PortError
from tests.support.calls import call

BOUND = {"uint8": 1 / 510, "uint16": 1 / 131070, "float16": 1 / 8192}


@pytest.mark.parametrize("storage", list(BOUND))
def test_values_keep_the_stated_bound(storage):
    """Random fields of all types and mappings; the bound is of the real values, and is nearly reached."""
    rng = np.random.default_rng(11)
    reached = 0.0
    for dtype in ("f4", "f8", "i2", "i4", "u2"):
        for scale, offset in ((1.0, 0.0), (-0.5, 1000.0), (1e-6, 3.0)):
            data = rng.random((5, 6, 7)) * 50000
            volume = Volume(data.astype(dtype), mapping=Mapping(scale, offset, "HU"))
            low, high = volume.range
            quantized = call("filter.quantize", volume=volume, storage=storage)
            assert quantized.dtype == storage
            assert quantized.mapping.unit == "HU"
            lost = np.abs(quantized.real(np.float64) - volume.real(np.float64)).max()
            assert lost <= BOUND[storage] * (high - low) * (1 + 1e-6)
            reached = max(reached, lost / (BOUND[storage] * (high - low)))
    assert reached > 0.5


def test_whole_numbers_that_fit_lose_nothing():
    data = np.random.default_rng(2).integers(-100, 150, (4, 5, 6)).astype(np.int16)
    volume = Volume(data, mapping=Mapping(0.5, 7.0))
    quantized = call("filter.quantize", volume=volume, storage="uint8")
    assert np.array_equal(quantized.real(np.float64), volume.real(np.float64))
    assert call("filter.quantize", volume=volume).dtype == np.uint8  # automatic, and nothing may be lost


def test_automatic_takes_the_smallest_that_keeps_the_error():
    volume = Volume(np.linspace(0.0, 100.0, 60, dtype=np.float32).reshape(3, 4, 5))
    for max_error, expected in ((0.0, "f4"), (1e-4, "f4"), (1e-3, "u2"), (0.1, "u2"), (0.2, "u1")):
        quantized = call("filter.quantize", volume=volume, max_error=max_error)
        assert quantized.dtype == expected
        assert np.abs(quantized.real(np.float64) - volume.real(np.float64)).max() <= max_error
    halves = Volume(volume.data.astype(np.float16))
    assert call("filter.quantize", volume=halves, max_error=1e-3).dtype == np.float16  # 16 bits would win nothing


def test_what_is_not_finite_stays_so_or_is_refused():
    data = np.linspace(0.0, 1.0, 27, dtype=np.float32).reshape(3, 3, 3)
    data[0, 0, 0], data[1, 1, 1], data[2, 2, 2] = np.nan, np.inf, -np.inf
    volume = Volume(data)
    found = call("filter.quantize", volume=volume, max_error=0.1)
    assert found.dtype == np.float16
    assert np.array_equal(np.isnan(found.real()), np.isnan(data))
    assert found.real()[1, 1, 1] == np.inf
    assert found.real()[2, 2, 2] == -np.inf
    for storage in ("uint8", "uint16"):
        with pytest.raises(PortError, match="not finite; store them as float16"):
            call("filter.quantize", volume=volume, storage=storage)


@pytest.mark.parametrize("storage", ["automatic", *BOUND])
def test_a_constant_is_kept(storage):
    volume = Volume(np.full((2, 3, 4), 123.25, np.float32))
    assert np.all(call("filter.quantize", volume=volume, storage=storage).real(np.float64) == 123.25)
