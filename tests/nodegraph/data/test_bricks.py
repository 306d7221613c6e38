"""Bricks against brute force, and against what a device of single precision finds inside them.

Checks: Schlosser 2009, T58, T60, T61.
"""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from nodegraph.data import TransferFunction, Volume
from nodegraph.data.bricks import (
    BRICK,
    brick_counts,
    brick_distances,
    brick_ranges,
    brick_reaches,
    visible_above,
    visible_box,
    visible_bricks,
    visible_by_keys,
)
from nodegraph.errors import PortError

pytestmark = pytest.mark.slow

ROWS = 64
DTYPES = ("u1", "i1", "u2", "i2", "i4", "u4", "f2", "f4", "f8")
sizes = st.sampled_from((1, 2, 3, 4, 5, 7, 8, 9, 10, 16, 17, 18, 25))
mappings = st.sampled_from(((1.0, 0.0), (-1.0, 0.0), (0.1, -3.0), (-2.5, 1e3), (1.0, -1024.0)))


@st.composite
def volumes(draw):
    """Odd sizes, all types, either sign of the scale; a few levels, so that bricks are alike; NaN and inf in reals."""
    shape = (draw(sizes), draw(sizes), draw(sizes))
    dtype = np.dtype(draw(st.sampled_from(DTYPES)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    if dtype.kind == "f":
        levels = np.array([-50.0, 0.0, 0.25, 1.0, 3.5, 1000.0])
    else:
        limits = np.iinfo(dtype)
        levels = np.array([limits.min, max(limits.min, -1), 0, 1, 2, 100, limits.max])
    data = rng.choice(levels, shape, p=rng.dirichlet(np.full(len(levels), 0.1))).astype(dtype)
    # A block of something else, so that most bricks differ from some.
    z, y, x = (rng.integers(0, n) for n in shape)
    data[z:, y : y + 5, x : x + 6] = rng.choice(levels)
    if dtype.kind == "f" and draw(st.booleans()):
        share = draw(st.sampled_from((0.001, 0.1, 1.0)))
        data[rng.random(shape) < share] = rng.choice([np.nan, np.nan, np.inf, -np.inf])
    return Volume(data, mapping=(*draw(mappings), ""))


@st.composite
def transfer_functions(draw, low, high):
    """Keys inside and outside of the values, steps among them, mostly transparent."""
    values = [low, high, 0.0, (low + high) / 2, low - 1.0, high + 1.0, 0.3 * low + 0.7 * high]
    at = sorted(draw(st.lists(st.sampled_from(values), max_size=5)))
    at = [v for i, v in enumerate(at) if i < 2 or v != at[i - 2]]
    return TransferFunction([(v, (1.0, 1.0, 1.0), draw(st.sampled_from((0.0, 0.0, 0.5, 1.0)))) for v in at])


def voxels_of(b, n):
    return slice(BRICK * b, min(BRICK * b + BRICK, n - 1) + 1)


def test_bricks_share_a_plane_and_cover_every_cell():
    assert brick_counts((1, 2, BRICK)) == (1, 1, 1)
    assert brick_counts((BRICK + 1, BRICK + 2, 32 * BRICK + 1)) == (1, 2, 32)


@settings(max_examples=150, deadline=None)
@given(volumes())
def test_ranges_hold_all_values_of_a_brick_and_little_more(volume):
    """Checks: Schlosser 2009, T60, by brute force in double precision."""
    ranges = brick_ranges(volume)
    x, y, z = brick_counts(volume.dims)
    assert ranges.shape == (z, y, x, 2)
    real = volume.real(np.float64)
    numbers = real[np.isfinite(real)]
    shift = 2.0**15 if volume.dtype == np.int16 else 2.0**7 if volume.dtype == np.int8 else 0.0
    most = np.abs(numbers).max(initial=0.0) + 2.0 * abs(volume.mapping.offset) + shift * abs(volume.mapping.scale)
    nx, ny, nz = volume.dims
    for b in np.ndindex(z, y, x):
        part = real[voxels_of(b[0], nz), voxels_of(b[1], ny), voxels_of(b[2], nx)]
        low, high = ranges[b]
        if np.isnan(part).all():
            assert (low, high) == (np.inf, -np.inf)
        elif np.isinf(part).any():
            assert (low, high) == (-np.inf, np.inf)
        else:
            assert low <= np.nanmin(part)
            assert high >= np.nanmax(part)
            assert max(np.nanmin(part) - low, high - np.nanmax(part)) <= 1e-5 * most


@pytest.mark.parametrize("dtype", ["u1", "u2", "f2", "f4", "f8"])
def test_where_nothing_is_rounded_a_range_is_exact(dtype):
    """Air at 0 under a ramp from 0 is the commonest of scenes: a range of one ulp about 0 would show all of it."""
    data = np.zeros((2 * BRICK + 1,) * 3, dtype)
    data[BRICK + 1 :, BRICK + 1 :, BRICK + 1 :] = 200
    ranges = brick_ranges(Volume(data))
    ramp = TransferFunction([(0.0, (1, 1, 1), 0.0), (255.0, (1, 1, 1), 0.5)])
    visible = visible_bricks(ranges, ramp.table(ROWS), ramp.lookup(ROWS))
    assert ranges[0, 0, 0].tolist() == [0.0, 0.0]
    assert np.argwhere(visible).tolist() == [[1, 1, 1]]


def single_precision(volume, index):
    """Real values less the volume's origin at points of index space (n, 3) (x, y, z), as a float kernel finds them."""
    f = np.float32
    data = volume.data
    last = np.array(volume.dims) - 1
    p = np.clip(index.astype(f), 0, last.astype(f))
    a = p.astype(int)
    b = np.minimum(a + 1, last)
    t = p - a.astype(f)
    numbers = data[np.isfinite(data)].astype(np.float64)
    shift = -(2.0**15) if volume.dtype == np.int16 else 0.0
    if volume.dtype.kind in "iu" and np.abs(numbers).max(initial=0.0) > 2**24:  # kept as float32 about the middle
        shift = float(np.floor((numbers.min() + numbers.max()) / 2))

    def fetch(z, y, x):
        return (data[z, y, x].astype(np.float64) - shift).astype(f)

    corners = [fetch((a, b)[i >> 2][:, 2], (a, b)[i >> 1 & 1][:, 1], (a, b)[i & 1][:, 0]) for i in range(8)]
    for axis in range(3):
        corners = [u + (v - u) * t[:, axis] for u, v in zip(corners[::2], corners[1::2], strict=True)]
    scale, offset, _ = volume.mapping
    return corners[0] * f(scale) + f(offset - volume.origin + shift * scale)


def extinction_of(values, table, lookup):
    """Extinction per mm of values, in single precision: common/classify.glsl. NaN is transparent."""
    f = np.float32
    place = values * f(lookup[0]) + f(lookup[1])
    place = np.where(place > 0, np.minimum(place, f(len(table) - 1)), f(0))
    a = place.astype(int)
    rows = table[:, 3].astype(f)
    b = np.minimum(a + 1, len(table) - 1)
    found = rows[a] + (rows[b] - rows[a]) * (place - a.astype(f))
    return np.where(np.isnan(values), f(0), found)


@settings(max_examples=200, deadline=None)
@given(st.data())
@np.errstate(all="ignore")
def test_nothing_can_be_seen_inside_an_invisible_brick(data):
    """Checks: Schlosser 2009, T61. Samples inside bricks, on their faces and at voxels, in single precision."""
    volume = data.draw(volumes())
    function = data.draw(transfer_functions(*volume.range))
    level = volume.origin
    table, lookup = function.table(ROWS), function.lookup(ROWS, level)
    ranges = brick_ranges(volume)
    visible = visible_bricks(ranges, table, lookup, level=level)
    rng = np.random.default_rng(0)
    n = np.array(volume.dims)
    for z, y, x in np.argwhere(~visible)[:40]:
        low = BRICK * np.array([x, y, z])
        high = np.minimum(low + BRICK, n - 1)
        low, high = np.where(low == 0, -0.5, low), np.where(high == n - 1, n - 0.5, high)
        points = low + (high - low) * rng.random((64, 3)).round(rng.choice([0, 2, 9]))
        points[32:] = np.clip(points[32:].round(), low, high)
        assert not extinction_of(single_precision(volume, points), table, lookup).any()


@pytest.mark.parametrize("dtype", ["i2", "u2", "i4", "f4"])
def test_a_range_is_as_wide_as_single_precision_is_wrong(dtype):
    """A ramp that begins at the value of a uniform volume, or just above: at times rounding lifts a sample onto it."""
    rng = np.random.default_rng(5)
    wrong = {True: 0, False: 0}
    for _ in range(200):
        stored = np.full((2, 2, 2), rng.integers(0, 20), dtype)
        volume = Volume(stored, mapping=(rng.uniform(0.01, 3.0), rng.uniform(-1.0, 1.0), ""))
        key = volume.range[0] + rng.choice([0.0, 1e-4]) * volume.mapping.scale
        ramp = TransferFunction([(key - 10.0, (1, 1, 1), 0.0), (key, (1, 1, 1), 0.0), (key + 10.0, (1, 1, 1), 0.5)])
        table, lookup = ramp.table(2 * ROWS + 1), ramp.lookup(2 * ROWS + 1, volume.origin)
        points = rng.uniform(0, 1, (64, 3))
        seen = extinction_of(single_precision(volume, points), table, lookup).any()
        wrong[bool(seen)] += 1
        assert visible_bricks(brick_ranges(volume), table, lookup, level=volume.origin).all() or not seen
    assert wrong[True] > 10


@settings(max_examples=60, deadline=None)
@given(st.data())
@np.errstate(invalid="ignore")
def test_a_brick_is_visible_only_where_a_row_near_its_values_is(data):
    """The look-up finds what a loop over the rows finds, but for rounding: as many invisible bricks as there may be."""
    volume = data.draw(volumes())
    function = data.draw(transfer_functions(*volume.range))
    table, (scale, offset) = function.table(ROWS), function.lookup(ROWS)
    ranges = brick_ranges(volume)
    visible = visible_bricks(ranges, table, (scale, offset))
    for b in np.ndindex(visible.shape):
        low, high = ranges[b]
        ends = np.clip(
            np.nan_to_num([low * scale + offset, high * scale + offset], posinf=ROWS, neginf=-1), 0, ROWS - 1
        )
        slack = 1e-3 + 1e-6 * (
            abs(offset) + np.abs(np.nan_to_num([low * scale, high * scale], posinf=0, neginf=0)).max()
        )
        first = max(int(np.floor(ends[0] - slack)), 0)
        last = min(int(np.ceil(ends[1] + slack)), ROWS - 1)
        if visible[b]:
            assert low <= high
            assert (table[first : last + 1, 3] > 0.0).any()


def test_a_higher_threshold_hides_more_and_level_moves_values_and_table_alike():
    data = np.zeros((BRICK + 1, BRICK + 1, 3 * BRICK + 1), np.float32)
    data[..., BRICK + 1], data[..., 2 * BRICK + 1] = 0.5, 1.0
    ramp = TransferFunction([(0.0, (1, 1, 1), 0.0), (0.1, (1, 1, 1), 0.0), (1.0, (1, 1, 1), 0.5)])
    table, ranges = ramp.table(ROWS), brick_ranges(Volume(data))
    full = float(ramp.extinction(0.5))
    for level in (0.0, 0.5, -7.0):
        lookup = ramp.lookup(ROWS, level)
        assert visible_bricks(ranges, table, lookup, 0.0, level).ravel().tolist() == [False, True, True]
        assert visible_bricks(ranges, table, lookup, 0.75 * full, level).ravel().tolist() == [False, False, True]
        assert not visible_bricks(ranges, table, lookup, full, level).any()
        assert visible_above(ranges, 0.5, level).ravel().tolist() == [False, True, True]
        assert not visible_above(ranges, 1.001, level).any()


@settings(max_examples=100, deadline=None)
@given(st.data())
def test_nothing_is_left_out_that_the_keys_themselves_show(data):
    """What integrates by the keys sees spikes that a table misses: the exact extinction at voxels and between them."""
    volume = data.draw(volumes())
    function = data.draw(transfer_functions(*volume.range))
    visible = visible_by_keys(brick_ranges(volume), function)
    real = volume.real(np.float64)
    nx, ny, nz = volume.dims
    for z, y, x in np.argwhere(~visible):
        part = real[voxels_of(z, nz), voxels_of(y, ny), voxels_of(x, nx)]
        part = part[~np.isnan(part)]
        if part.size:
            assert not function.evaluate(part)[..., 3].any()
            assert not any(key.opacity for key in function.keys if part.min() <= key.value <= part.max())


@settings(max_examples=100, deadline=None)
@given(st.data(), st.floats(0.001, 1.0))
def test_what_the_keys_show_above_a_threshold_is_kept_and_nothing_else(data, share):
    volume = data.draw(volumes())
    function = data.draw(transfer_functions(*volume.range))
    most = max((float(function.extinction(key.opacity)) for key in function.keys), default=0.0)
    threshold = share * most
    ranges = brick_ranges(volume)
    visible = visible_by_keys(ranges, function, threshold)
    assert not np.any(visible & ~visible_by_keys(ranges, function))
    for b in np.ndindex(visible.shape):
        low, high = ranges[b]
        if low <= high:
            # A piece of a line is greatest where it ends; at a step a key may be met from either side.
            inside = [key.value for key in function.keys if low <= key.value <= high]
            ends = np.array([low, high, *inside, *np.nextafter(inside, -np.inf)])
            greatest = function.evaluate(ends)[:, 3].max()
            assert visible[b] or greatest <= threshold * (1 + 1e-9)
            assert not visible[b] or greatest >= threshold * (1 - 1e-9) or np.isinf(ends).any()


def test_keys_at_the_ends_of_all_numbers_hide_nothing_that_is_above_a_threshold():
    function = TransferFunction([(-1e308, (1, 1, 1), 0.0), (1e308, (1, 1, 1), 0.5)])
    assert visible_by_keys(np.array([[9e307, 9.9e307]]), function, 0.3).all()


@pytest.mark.parametrize("keys", [[], [(0.5, (1, 1, 1), 0.5)], [(0.5, (1, 1, 1), 0.0), (0.5, (1, 1, 1), 1.0)]])
def test_transfer_functions_without_a_width(keys):
    """No keys: nothing is visible; one key: all that is a number; a lone step: what reaches it, infinity too."""
    data = np.full((1, 1, 4 * BRICK + 1), np.nan, np.float32)
    data[..., BRICK + 1 : 2 * BRICK], data[..., 2 * BRICK + 1 : 3 * BRICK] = 0.0, 1.0
    data[..., 3 * BRICK + 1 :] = np.inf
    function = TransferFunction(keys)
    visible = visible_bricks(brick_ranges(Volume(data)), function.table(ROWS), function.lookup(ROWS)).ravel().tolist()
    assert visible == [[False] * 4, [False, True, True, True], [False, False, True, True]][len(keys)]


@settings(max_examples=150, deadline=None)
@given(hnp.arrays(np.bool_, st.tuples(*[st.integers(1, 7)] * 3)))
def test_distances_are_those_of_brute_force(visible):
    """Checks: Schlosser 2009, T58."""
    found = brick_distances(visible)
    assert (found.dtype, found.shape) == (np.uint8, visible.shape)
    seen = np.argwhere(visible)
    for cell in np.argwhere(np.ones_like(visible)):
        assert found[tuple(cell)] == (np.abs(seen - cell).max(axis=1).min() if len(seen) else 255)


def test_distances_end_at_255():
    visible = np.zeros((1, 1, 600), bool)
    visible[..., 0] = True
    assert brick_distances(visible)[0, 0].tolist() == [*range(255), *[255] * 345]


def test_a_ray_leaps_to_what_can_be_seen_on_its_way():
    visible = np.zeros((1, 1, 40), bool)
    visible[..., 3] = True
    behind, ahead = brick_reaches(visible)[:2, 0]
    assert ahead[:6].tolist() == [2.5, 1.5, 0.5, -0.5, 31.5, 31.5]
    assert behind[:6].tolist() == [31.5, 31.5, 31.5, -0.5, 0.5, 1.5]
    assert behind[-1] == 31.5, "no leap is longer"


@given(hnp.arrays(np.bool_, st.tuples(*[st.integers(1, 7)] * 3)))
def test_reaches_are_those_of_brute_force_in_each_octant(visible):
    reaches = brick_reaches(visible).reshape(2, 2, 2, *visible.shape)
    seen = np.argwhere(visible)
    for octant in itertools.product((0, 1), repeat=3):
        for cell in np.argwhere(np.ones_like(visible)):
            away = (seen - cell) * (2 * np.array(octant) - 1)
            there = away[(away >= 0).all(axis=1)]
            assert reaches[(*octant, *cell)] == (there.max(axis=1).min() if len(there) else 32) - 0.5
    about = brick_reaches(visible, quickly=True).reshape(8, *visible.shape)
    assert (about == np.minimum(brick_distances(visible), 32) - 0.5).all()


@settings(max_examples=100, deadline=None)
@given(st.tuples(sizes, sizes, sizes), st.integers(0, 2**32 - 1), st.sampled_from((0.0, 0.03, 0.3, 1.0)))
def test_the_visible_box_is_the_least_that_holds_all_visible_bricks(dims, seed, share):
    counts = brick_counts(dims)
    visible = np.random.default_rng(seed).random(counts[::-1]) < share
    box = visible_box(visible, dims)
    assert (box is None) == (not visible.any())
    if box is not None:
        where = np.argwhere(visible)[:, ::-1]
        low = np.where(where == 0, -0.5, BRICK * where).min(axis=0)
        high = np.where(where == np.array(counts) - 1, np.array(dims) - 0.5, BRICK * (where + 1)).max(axis=0)
        assert box[0].tolist() == low.tolist()
        assert box[1].tolist() == high.tolist()


def test_ranges_of_a_mapped_file_are_those_of_the_array(tmp_path):
    data = np.random.default_rng(3).integers(-1000, 3000, (30, 21, 19)).astype(np.int16)
    np.save(tmp_path / "v.npy", data)
    mapped = Volume(np.load(tmp_path / "v.npy", mmap_mode="r"))
    assert np.array_equal(brick_ranges(mapped), brick_ranges(Volume(data)))


def test_a_vector_field_has_no_ranges():
    with pytest.raises(PortError, match="brick_ranges: expected one component, got 3; choose one of them"):
        brick_ranges(Volume(np.zeros((2, 2, 2, 3), np.float32)))
