"""Grids, their place in the world, their numbers."""

import tracemalloc

import numpy as np
import pytest

from nodegraph.data import Buffer, Labels, Mapping, Volume
from nodegraph.data.space import affine, centred, check_affine, invert, normalize, transform_points
from nodegraph.errors import PortError


def rotation(rng):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


@pytest.mark.parametrize("spacing", [(1, 1, 1), (1e-3, 1.0, 1000.0), (1000.0, 1e-3, 1.0), (2.6e-4, 2.6e-4, 2.9e-4)])
@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_index_to_world_and_back(rng, spacing, offset):
    """Spacings of 1:1000000, any turn, origin a kilometre away: an index comes back to 1e-6 voxel or better."""
    matrix = np.eye(4)
    matrix[:3, :3] = rotation(rng) * spacing
    matrix[:3, 3] = offset
    volume = Volume(np.zeros((4, 5, 6), np.uint8), matrix)
    assert np.allclose(volume.spacing, spacing, rtol=1e-12)
    index = rng.uniform(0, 5, (100, 3))
    back = transform_points(volume.world_to_index, transform_points(volume.index_to_world, index))
    # Double precision has 2^-53 of the offset left in mm, which is so many voxels:
    assert np.abs(back - index).max() <= 1e-9 + 16 * offset * 2.0**-53 / min(spacing)


def test_without_a_matrix_the_grid_is_centred():
    volume = Volume(np.zeros((3, 4, 5), np.float32))
    assert volume.dims == (5, 4, 3)
    assert volume.centre.tolist() == [0.0, 0.0, 0.0]
    assert volume.spacing.tolist() == [1.0, 1.0, 1.0]
    assert volume.corners.min(axis=0).tolist() == [-2.5, -2.0, -1.5]
    assert volume.corners.max(axis=0).tolist() == [2.5, 2.0, 1.5]
    assert np.array_equal(volume.index_to_world, centred((5, 4, 3)))


def test_corner_i_is_high_where_bits_of_i_are_set():
    corners = Volume(np.zeros((2, 2, 2), np.uint8), affine((1, 10, 100))).corners
    assert corners[1].tolist() == [1.5, -5.0, -50.0]
    assert corners[6].tolist() == [-0.5, 15.0, 150.0]


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.eye(3), "4x4"),
        (np.diag([1.0, 1.0, np.nan, 1.0]), "finite"),
        (np.diag([1.0, 1.0, 1.0, 2.0]), "last row"),
        (np.diag([1.0, 0.0, 1.0, 1.0]), "singular"),
        ([[1, 2, 0, 0], [2, 4, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "singular"),
    ],
)
def test_a_matrix_that_is_no_place_is_refused(matrix, message):
    with pytest.raises(PortError, match=message):
        Volume(np.zeros((2, 2, 2), np.uint8), matrix)


def test_tiny_and_huge_voxels_are_not_singular():
    for scale in (1e-9, 1e9):
        matrix = check_affine(np.diag([scale, scale * 1000, scale / 1000, 1.0]))
        assert np.allclose(invert(matrix) @ matrix, np.eye(4), atol=1e-12)


def test_normalize_keeps_zero():
    assert normalize((0, 0, 0)).tolist() == [0.0, 0.0, 0.0]
    assert normalize((0, 3, 4)).tolist() == [0.0, 0.6, 0.8]


@pytest.mark.parametrize(
    "data",
    [
        np.zeros((2, 2)),
        np.zeros((0, 2, 2)),
        np.zeros((2, 2, 2, 0)),
        np.zeros((2, 2, 2), complex),
        np.zeros((2, 2, 2), bool),
    ],
)
def test_what_is_no_volume_is_refused(data):
    with pytest.raises(PortError, match="Volume"):
        Volume(data)


def test_a_view_unless_a_copy_is_asked_for():
    base = np.zeros((2, 2, 2), np.float32)
    assert np.shares_memory(Volume(base).data, base)
    copied = Volume(base, copy=True)
    base[:] = 1.0
    assert not copied.data.any()
    assert np.asarray(Volume(base)) is not None
    assert np.shares_memory(np.asarray(Volume(base)), base)


def test_foreign_byte_order_is_turned():
    volume = Volume(np.arange(8, dtype=">i2").reshape(2, 2, 2))
    assert volume.dtype.isnative
    assert volume.data.ravel().tolist() == list(range(8))


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2", "u4", "i4", "f2", "f4", "f8"])
def test_real_values_are_right_to_single_precision(rng, dtype):
    """Scale and offset nearly cancel: the sum must be taken in double."""
    info = np.iinfo(dtype) if np.dtype(dtype).kind in "iu" else None
    data = rng.integers(info.min, info.max, (5, 6, 7), dtype) if info else rng.normal(size=(5, 6, 7)).astype(dtype)
    mapping = Mapping(1e-3, -1e-3 * float(data[0, 0, 0]), "mT")
    volume = Volume(data, mapping=mapping)
    exact = data.astype(np.float64) * mapping.scale + mapping.offset
    assert np.array_equal(volume.real(), exact.astype(np.float32))
    assert np.array_equal(volume.real(np.float64), exact)


def test_real_is_no_copy_where_nothing_is_to_do():
    volume = Volume(np.ones((2, 2, 2), np.float32))
    assert np.shares_memory(volume.real(), volume.data)


def test_range_leaves_out_what_is_not_finite():
    data = np.array([[[np.nan, -np.inf, 3.0], [-2.0, np.inf, 1.0]]], np.float32)
    assert Volume(data).range == (-2.0, 3.0)
    assert Volume(data, mapping=Mapping(-2.0, 1.0)).range == (-5.0, 5.0)
    assert Volume(np.full((2, 2, 2), np.nan, np.float32)).range == (0.0, 0.0)
    assert Volume(np.full((1, 1, 1), -7, np.int16)).range == (-7.0, -7.0)
    assert Volume(np.array([[[0, 2**32 - 1]]], np.uint32)).range == (0.0, 2.0**32 - 1)


def test_range_is_found_in_slabs_and_kept():
    """No copy of the volume is made, in float64 or otherwise."""
    data = np.zeros((64, 256, 256), np.float32)
    data[40, 3, 3], data[10, 1, 1] = 5.0, np.nan
    volume = Volume(data, mapping=Mapping(2.0))
    tracemalloc.start()
    assert volume.range == (0.0, 10.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < data.nbytes / 2
    assert volume.range is volume.range
    assert "0..10" in volume.summary()


def test_with_data_keeps_the_grid():
    volume = Volume(np.zeros((2, 3, 4), np.int16), affine((1, 2, 3), (4, 5, 6)), Mapping(2.0, 1.0, "HU"))
    same = volume.with_data(np.ones((2, 3, 4), np.int16))
    assert same.mapping == volume.mapping
    assert np.array_equal(same.index_to_world, volume.index_to_world)
    real = volume.with_data(np.ones((2, 3, 4, 3), np.float32))
    assert real.mapping == Mapping(1.0, 0.0, "HU")
    assert real.components == 3
    with pytest.raises(PortError, match="grid"):
        volume.with_data(np.zeros((2, 3, 5)))
    buffer = Buffer.on_device((2, 3, 4), "f4", lambda: pytest.fail("nobody asked for the data"))
    assert volume.with_data(buffer).buffer is buffer


@pytest.mark.parametrize("mapping", [Mapping(0.0), Mapping(np.nan), Mapping(1.0, np.inf)])
def test_a_mapping_that_loses_the_values_is_refused(mapping):
    with pytest.raises(PortError, match="mapping"):
        Volume(np.zeros((2, 2, 2), np.uint8), mapping=mapping)


def test_labels_are_unsigned_views():
    base = np.array([[[0, 1], [2, 127]]], np.int8)
    labels = Labels(base, names={1: "liver"})
    assert labels.dtype == np.uint8
    assert np.shares_memory(labels.data, base)
    assert dict(labels.names) == {1: "liver"}
    wide = Labels(np.array([[[0, 2**32 - 1]]], np.int64))
    assert wide.dtype == np.uint32
    assert wide.data.max() == 2**32 - 1


@pytest.mark.parametrize(
    "data", [np.full((1, 1, 1), -1), np.full((1, 1, 1), 2**32), np.zeros((1, 1, 1)), np.zeros((1, 1, 1, 2), np.uint8)]
)
def test_what_is_no_id_is_refused(data):
    with pytest.raises(PortError, match="Labels"):
        Labels(data)
