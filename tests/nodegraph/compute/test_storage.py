"""Every row of the storage table, on every device, against numpy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nodegraph.compute.storage import WIDE_BYTES, choose
from nodegraph.data import Labels, Volume
from nodegraph.data.buffer import Buffer
from nodegraph.errors import ParameterError
from nodegraph.shaders import Source

SCALAR = Source.of(
    """
field3 v;
field2 points;
struct Out { float smooth_value; float exact; };
Out pixel(ivec2 at) {
    vec4 p = fetch2(points, at);
    return Out(sample3(v, p.xyz), fetch3(v, ivec3(floor(p.xyz + 0.5))));
}
""",
    "tests/scalar.glsl",
)
VECTOR = Source.of(
    """
field3v v;
field2 points;
vec4 pixel(ivec2 at) { return sample3v(v, fetch2(points, at).xyz); }
""",
    "tests/vector.glsl",
)
LABELS = Source.of(
    """
field3u labels;
uint voxel(ivec3 at) { return fetch3u(labels, at); }
""",
    "tests/labels.glsl",
)

DIMS = (7, 6, 5)


def stored(name: str, rng: np.random.Generator) -> np.ndarray[Any, Any]:
    """Data (5, 6, 7) that is awkward for its type: both ends of its range, negative numbers, large offsets."""
    if name == "float64 far":
        return 1e9 + rng.uniform(-1, 1, DIMS[::-1])
    if name == "int32 beyond 2^24":
        return (100_000_000 + rng.integers(-1000, 1000, DIMS[::-1])).astype(np.int32)
    if name == "uint32 high":
        return (4_000_000_000 + rng.integers(0, 1000, DIMS[::-1])).astype(np.uint32)
    if name == "big-endian int16":
        return stored("int16", rng).astype(">i2")
    dtype = np.dtype(name)
    if dtype.kind == "f":
        return rng.uniform(-50, 200, DIMS[::-1]).astype(dtype)
    ends = np.iinfo(dtype)
    if dtype.itemsize > 2:
        return rng.integers(max(ends.min, -(2**23)), 2**23, DIMS[::-1]).astype(dtype)
    data = rng.integers(ends.min, ends.max + 1, DIMS[::-1]).astype(dtype)
    data.flat[:2] = ends.min, ends.max
    return data


def positions(rng: np.random.Generator) -> np.ndarray[Any, Any]:
    """Index-space points as an image (8, 9, 4): inside, on centres, and up to two voxels outside."""
    points = np.zeros((8, 9, 4))
    points[..., :3] = rng.uniform(-2.0, 1.0 + np.array(DIMS), (8, 9, 3))
    points[0, :, :3] = np.round(points[0, :, :3])
    return np.round(points * 1024) / 1024  # exact in every precision


def trilinear(data: np.ndarray[Any, Any], points: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Interpolate (z, y, x[, c]) at index-space points (..., 3), clamped to the edge, in double."""
    p = np.clip(points[..., :3], 0, np.array(data.shape[2::-1]) - 1.0)
    low = np.minimum(np.floor(p).astype(int), np.maximum(np.array(data.shape[2::-1]) - 2, 0))
    high = np.minimum(low + 1, np.array(data.shape[2::-1]) - 1)
    t = p - low
    total: Any = 0.0
    for corner in range(8):
        pick = [corner & 1, corner >> 1 & 1, corner >> 2 & 1]
        i = [np.where(pick[k], high[..., k], low[..., k]) for k in range(3)]
        weight = np.prod([t[..., k] if pick[k] else 1 - t[..., k] for k in range(3)], axis=0)
        value = data[i[2], i[1], i[0]].astype(np.float64)
        total = total + (weight[..., None] if value.ndim > weight.ndim else weight) * value
    return np.asarray(total)


NAMES = (
    "uint8", "int8", "uint16", "int16", "big-endian int16", "int32", "uint32", "int32 beyond 2^24", "uint32 high",
    "float16", "float32", "float64", "float64 far", "int64",
)  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_interpolated_and_fetched_values_equal_numpy(device: Any, rng: np.random.Generator, name: str) -> None:
    data, points = stored(name, rng), positions(rng)
    out = device.run(SCALAR, (9, 8), v=Volume(data, mapping=(0.5, -3.0, "")), points=points)
    nearest = np.clip(np.floor(points[..., :3] + 0.5).astype(int), 0, np.array(DIMS) - 1)
    interpolated = trilinear(data, points) * 0.5 - 3.0
    fetched = data[nearest[..., 2], nearest[..., 1], nearest[..., 0]].astype(np.float64) * 0.5 - 3.0
    # What the precision can say: rounding of the result, and the weights' rounding of the spread of the data.
    eps = float(np.finfo(device.real).eps)
    spread = float(np.ptp(data.astype(np.float64))) * 0.5
    assert np.abs(out.smooth_value.array - interpolated).max() <= eps * (8 * spread + 4 * np.abs(interpolated).max())
    # A normalised texture returns stored / 65535, whose product with 65535 may be off in its last bit.
    assert np.abs(out.exact.array - fetched).max() <= eps * (spread + np.abs(fetched).max())


@pytest.mark.parametrize(
    ("components", "name"), [(1, "float32"), (2, "int16"), (3, "float32"), (3, "uint8"), (4, "float64"), (4, "float16")]
)
def test_vectors_equal_numpy_and_absent_components_are_zero(
    device: Any, rng: np.random.Generator, components: int, name: str
) -> None:
    data = np.stack([stored(name, rng) for _ in range(components)], axis=-1)
    points = positions(rng)
    got = device.run(VECTOR, (9, 8), v=Volume(data, mapping=(2.0, 5.0, "")), points=points).array
    want = trilinear(data, points) * 2.0 + 5.0
    assert np.abs(got[..., :components] - want).max() <= 40 * np.finfo(device.real).eps * np.abs(want).max()
    assert (got[..., components:] == 0).all()


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16, np.uint32])
def test_labels_are_exact(device: Any, rng: np.random.Generator, dtype: Any) -> None:
    data = rng.integers(0, np.iinfo(dtype).max, DIMS[::-1], dtype=dtype, endpoint=True)
    data.flat[0] = np.iinfo(dtype).max
    if dtype is np.uint32:
        data.flat[1:3] = 2**24 + 1, 2**31 + 1
    got = device.run(LABELS, DIMS, labels=Labels(data)).array
    assert got.dtype == np.uint32
    assert (got == data).all()


def test_nan_and_infinity_reach_the_kernel(device: Any) -> None:
    for dtype in (np.float16, np.float32, np.float64):
        data = np.zeros(DIMS[::-1], dtype)
        data[1, 2, 3], data[2, 2, 3], data[3, 2, 3] = np.nan, np.inf, -np.inf
        points = np.zeros((1, 5, 4))
        points[0, :, :3] = [(3, 2, z) for z in range(5)]
        got = device.run(SCALAR, (5, 1), v=Volume(data), points=points).exact.array[0]
        assert np.array_equal(got, [0.0, np.nan, np.inf, -np.inf, 0.0], equal_nan=True)


def test_a_wide_range_of_float64_keeps_float32_accuracy(device: Any) -> None:
    data = np.full(DIMS[::-1], 1e9)
    data[0, 0, 0] += 1e-3
    storage = device.describe_storage(Volume(data), "field3")
    if device.name == "cl64":
        assert (storage.element, storage.loss) == ("f8", "")
    else:
        assert storage.element == "f4"
        assert storage.offset == pytest.approx(1e9)
        assert "float64 kept as float32 about 1e+09" in storage.loss


def test_one_voxel(device: Any) -> None:
    points = np.zeros((1, 1, 4))
    for data in (np.full((1, 1, 1), -5, np.int16), np.full((1, 1, 1), 7.5, np.float32)):
        out = device.run(SCALAR, (1, 1), v=Volume(data), points=points)
        assert out.smooth_value.array[0, 0] == pytest.approx(float(data[0, 0, 0]), rel=1e-6)
        assert out.exact.array[0, 0] == pytest.approx(float(data[0, 0, 0]), rel=1e-6)


def test_arrays_that_are_not_contiguous_are_read_right(device: Any, rng: np.random.Generator) -> None:
    data = rng.uniform(0, 1, (10, 12, 14)).astype(np.float32)[::2, ::-2, ::2]
    points = positions(rng)
    want = device.run(SCALAR, (9, 8), v=np.ascontiguousarray(data), points=points).smooth_value.array
    assert want.std() > 0.05
    for form in (data, np.asfortranarray(data), data.astype(">f4")):
        assert (device.run(SCALAR, (9, 8), v=form, points=points).smooth_value.array == want).all()


def test_large_8_bit_volumes_are_not_widened() -> None:
    small = choose(Buffer(np.zeros((4, 4, 4), np.int8)), "field3", "gl", filtering=True)
    assert (small.storage.element, small.storage.filtered, small.factor, small.shift) == ("u2", True, 257, -128.0)
    large = choose(Buffer(np.zeros((1, 1, WIDE_BYTES), np.uint8)), "field3", "gl", filtering=True)
    assert (large.storage.element, large.storage.filtered, large.factor) == ("u1", False, 1)


def test_conversion_goes_slab_by_slab() -> None:
    data = np.arange(64 * 256 * 256, dtype=np.int32).astype(np.int16).reshape(64, 256, 256)
    placement = choose(Buffer(data), "field3", "gl", filtering=True)
    slabs = list(placement.slabs(data))
    assert [first for first, _ in slabs] == [0, 64] or max(slab.nbytes for _, slab in slabs) <= 8 << 20
    joined = np.concatenate([slab for _, slab in slabs])[..., 0]
    assert (joined.astype(np.int32) - 32768 == data).all()


@pytest.mark.parametrize(
    ("kind", "data", "message"),
    [
        ("field3", np.zeros((4, 4), np.float32), r"expects data \(z, y, x\), got shape \(4, 4\)"),
        ("field3", np.zeros((4, 4, 4, 3), np.float32), r"expects data \(z, y, x\), got shape \(4, 4, 4, 3\)"),
        ("field3v", np.zeros((4, 4, 4, 5), np.float32), r"expects data \(z, y, x\) or \(z, y, x, 1 to 4\)"),
        ("field2", np.zeros((0, 4), np.float32), r"got shape \(0, 4\)"),
        ("field3u", np.zeros((4, 4, 4), np.int64), "expected uint8, uint16 or uint32 ids, got int64"),
        ("field3", np.zeros((4, 4, 4), np.complex64), "expected integers or reals, got complex64"),
    ],
)
def test_what_does_not_fit_a_field_is_refused(kind: str, data: Any, message: str) -> None:
    with pytest.raises(ParameterError, match=f"^raycast.v: .*{message}"):
        choose(Buffer(data), kind, "gl", where="raycast.v")
