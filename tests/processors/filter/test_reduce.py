import numpy as np
import pytest
from scipy import ndimage

from nodegraph.data import Mapping, Volume
from nodegraph.data.space import affine
from tests.support.calls import call


def sample(volume, world):
    """Trilinear values at points (n, 3) of the world, edges repeated."""
    matrix = volume.world_to_index
    index = world @ matrix[:3, :3].T + matrix[:3, 3]
    return ndimage.map_coordinates(volume.real(np.float64), index.T[::-1], order=1, mode="nearest")


def random_volume(rng, dtype="f4"):
    shape = tuple(rng.integers(1, 18, 3))
    data = rng.integers(-100, 100, shape).astype(dtype) if np.dtype(dtype).kind == "i" else rng.random(shape, dtype)
    turn = np.linalg.qr(rng.standard_normal((3, 3)))[0]
    matrix = affine(rng.uniform(0.3, 3.0, 3).tolist(), rng.uniform(-50, 50, 3).tolist())
    matrix[:3, :3] = turn @ matrix[:3, :3]
    return Volume(data, matrix, Mapping(2.0, 10.0, "HU"))


@pytest.mark.parametrize(("method", "reach"), [("box", 0), ("binomial", 1)])
@pytest.mark.parametrize("dtype", ["f4", "f8", "i2"])
def test_between_voxels_it_differs_by_at_most_the_range_of_what_was_averaged(method, reach, dtype):
    """The stated bound, for random fields: the range over the old voxels that make the new ones around a point."""
    rng = np.random.default_rng(7)
    for halvings in (1, 2, 3):
        volume = random_volume(rng, dtype)
        reduced = call("filter.reduce", volume=volume, halvings=halvings, method=method)
        assert reduced.dtype == volume.dtype
        inside = rng.uniform(-0.5, np.array(volume.dims) - 0.5, (200, 3))
        world = inside @ volume.index_to_world[:3, :3].T + volume.index_to_world[:3, 3]
        cell = 2**halvings
        far = cell + reach * (cell - 1)
        values = volume.real(np.float64)
        size = 2 * far + 1
        high = ndimage.maximum_filter(values, size, mode="nearest")
        low = ndimage.minimum_filter(values, size, mode="nearest")
        at = tuple(np.clip(np.rint(inside[:, ::-1]), 0, np.array(values.shape) - 1).astype(int).T)
        bound = (high - low)[at] + (1.0 if dtype == "i2" else 1e-4)  # half a stored unit is one HU here
        difference = np.abs(sample(reduced, world) - sample(volume, world))
        assert np.all(difference <= bound)
        assert difference.max() > 0.0 or max(volume.dims) == 1


@pytest.mark.parametrize("method", ["box", "binomial"])
def test_an_affine_field_stays_what_it_is_and_where_it_is(method):
    """Checks: Orhun 2004, OR-05."""
    z, y, x = np.mgrid[:16, :24, :32].astype(np.float32)
    volume = Volume(0.5 * x - 0.25 * y + 2.0 * z, affine((1.0, 2.0, 0.5), (3.0, -7.0, 100.0)))
    reduced = call("filter.reduce", volume=volume, halvings=2, method=method)
    assert reduced.dims == (8, 6, 4)
    assert np.allclose(reduced.spacing, 4 * volume.spacing)
    if method == "box":
        assert np.allclose(reduced.corners, volume.corners)
    inner = np.array([[i, j, k] for i in range(2, 6) for j in range(2, 4) for k in (1, 2)], float)
    world = inner @ reduced.index_to_world[:3, :3].T + reduced.index_to_world[:3, 3]
    slack = 1e-4 if method == "box" else 1.5  # four slices along z: the border is felt two voxels in
    assert np.abs(sample(reduced, world) - sample(volume, world)).max() <= slack


def test_box_means_are_means():
    data = np.arange(64, dtype=np.float64).reshape(4, 4, 4)
    reduced = call("filter.reduce", volume=Volume(data), halvings=1)
    assert np.allclose(reduced.data, data.reshape(2, 2, 2, 2, 2, 2).mean(axis=(1, 3, 5)))
    assert call("filter.reduce", volume=Volume(data), halvings=12).data.item() == pytest.approx(data.mean())


def test_whole_numbers_stay_whole_and_nothing_is_rounded_twice():
    data = np.zeros((4, 4, 4), np.int16)
    data[0, 0, 0] = 63  # a 64th of it is nearly 1; rounded at each halving it would be lost or doubled
    assert call("filter.reduce", volume=Volume(data), halvings=2).data.item() == 1
    big = Volume(np.full((2, 2, 2), 2**31 - 1, np.int32))
    assert call("filter.reduce", volume=big, halvings=1).data.item() == 2**31 - 1


def test_what_is_not_finite_takes_no_part():
    data = np.ones((4, 4, 4), np.float32)
    data[0, 0, 0], data[0, 0, 1] = np.nan, np.inf
    data[2:, 2:, 2:] = np.nan
    reduced = call("filter.reduce", volume=Volume(data), halvings=1).data
    assert np.isnan(reduced[1, 1, 1])
    assert np.all(np.delete(reduced.ravel(), 7) == 1.0)


def test_thin_axes_are_left_alone_and_components_stay_apart():
    data = np.zeros((1, 6, 7, 2), np.float32)
    data[..., 1] = 1.0
    volume = Volume(data, affine((1.0, 2.0, 3.0), (0.0, 0.0, 0.0)))
    reduced = call("filter.reduce", volume=volume, halvings=1)
    assert reduced.data.shape == (1, 3, 4, 2)
    assert np.allclose(reduced.spacing, (2.0, 4.0, 3.0))
    assert np.all(reduced.data[..., 0] == 0.0)
    assert np.all(reduced.data[..., 1] == 1.0)
    assert np.array_equal(call("filter.reduce", volume=volume, halvings=0).data, data)
