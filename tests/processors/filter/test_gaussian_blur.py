import numpy as np
import pytest

from nodegraph.data import Mapping, Volume
from nodegraph.data.space import centred
from tests.support.calls import call


def test_variance_grows_by_sigma_squared_in_millimetres():
    """An impulse becomes a Gaussian whose width is physical along every axis."""
    data = np.zeros((41, 41, 41), np.float32)
    data[20, 20, 20] = 1.0
    spacing = np.array([0.5, 1.0, 2.0])
    volume = Volume(data, centred((41, 41, 41), spacing))
    out = call("filter.gaussian_blur", volume=volume, sigma=2.0).data.astype(np.float64)
    assert out.sum() == pytest.approx(1.0, abs=1e-5)
    at = np.arange(41) - 20
    for axis, width in ((2, 0.5), (1, 1.0), (0, 2.0)):
        profile = out.sum(axis=tuple(i for i in range(3) if i != axis))
        assert np.sqrt((profile * (at * width) ** 2).sum()) == pytest.approx(2.0, rel=0.02)


def test_constants_stay_and_sigma_zero_changes_nothing():
    volume = Volume(np.full((5, 6, 7), 300, np.int16), mapping=Mapping(2.0, -100.0, "HU"))
    out = call("filter.gaussian_blur", volume=volume, sigma=3.0)
    assert np.allclose(out.data, 500.0, rtol=1e-6)
    assert out.mapping == Mapping(1.0, 0.0, "HU")
    noise = Volume(np.random.default_rng(1).random((4, 4, 4)).astype(np.float32))
    assert np.array_equal(call("filter.gaussian_blur", volume=noise, sigma=0.0).data, noise.data)


def test_what_is_not_a_number_takes_no_part():
    data = np.ones((9, 9, 9), np.float32)
    data[4, 4, 4] = np.nan
    data[0, 0, 0] = np.inf
    out = call("filter.gaussian_blur", volume=Volume(data), sigma=1.0).data
    assert np.allclose(out, 1.0, atol=1e-6)


def test_components_do_not_mix():
    data = np.zeros((6, 6, 6, 2), np.float32)
    data[..., 1] = 1.0
    out = call("filter.gaussian_blur", volume=Volume(data), sigma=2.0).data
    assert np.allclose(out[..., 0], 0.0)
    assert np.allclose(out[..., 1], 1.0, atol=1e-6)


@pytest.mark.parametrize("sigma", [1e6, 1e307])
def test_a_huge_sigma_needs_no_huge_memory(sigma):
    volume = Volume(np.random.default_rng(2).random((3, 1, 4)).astype(np.float32))
    out = call("filter.gaussian_blur", volume=Volume(volume.data, np.diag([0.01, 0.01, 0.01, 1])), sigma=sigma).data
    assert np.isfinite(out).all()


@pytest.mark.parametrize(("reach", "left_out"), [(2.0, 0.0455), (3.0, 2.7e-3), (4.0, 6.4e-5), (6.0, 2e-9)])
def test_what_is_cut_off_is_at_most_its_weight(reach, left_out):
    """The tails beyond ``reach`` sigma weigh erfc(reach / sqrt 2) along each axis."""
    data = np.random.default_rng(1).random((12, 14, 16))
    kept, whole = (
        call("filter.gaussian_blur", volume=Volume(data), sigma=1.5, reach=r, precision="double").data
        for r in (reach, 10.0)
    )
    error = np.abs(kept - whole).max()
    assert 0.0 < error <= 3 * left_out


def test_single_precision_is_the_rounding_of_double():
    data = np.random.default_rng(2).random((12, 14, 16)) * 1000
    single, double = (
        call("filter.gaussian_blur", volume=Volume(data), sigma=1.5, precision=p).data for p in ("single", "double")
    )
    assert single.dtype == np.float32
    assert double.dtype == np.float64
    assert 0.0 < np.abs(single - double).max() <= 1000 * 3 * 2.0**-23
