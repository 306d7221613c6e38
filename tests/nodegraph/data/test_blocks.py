"""Blocks against brute force: rays are followed point by point through the blocks that they meet."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from nodegraph.data import Camera, Volume
from nodegraph.data.blocks import block_at, block_counts, front_to_back, pixels_of, visible_blocks
from nodegraph.data.bricks import BRICK, brick_counts
from nodegraph.data.space import transform_points
from nodegraph.errors import PortError

pytestmark = pytest.mark.slow

SIZE = 8
seeds = st.integers(0, 2**32 - 1)


def scene(seed):
    """A grid of some blocks anywhere in the world, sheared and mirrored at times, and a camera in, at or before it."""
    rng = np.random.default_rng(seed)
    dims = tuple(int(n) for n in rng.choice([1, 2, 8, 9, 10, 17, 25, 30, 33], 3))
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.choice([-1, 1], 3) * rng.uniform(0.3, 3.0, 3)
    if rng.random() < 0.3:
        matrix[:3, :3] = np.diag(rng.choice([-2.0, 1.0, 0.5], 3))  # rays along the axes
    elif rng.random() < 0.3:
        matrix[0, 1] += 0.7
    matrix[:3, 3] = rng.uniform(-50, 50, 3)
    volume = Volume(rng.integers(0, 99, dims[::-1]).astype(np.uint8), matrix)
    n = np.array(dims)
    eye = transform_points(matrix, rng.uniform(-1, 2, 3) * n if rng.random() < 0.7 else rng.integers(0, 5, 3) * SIZE)
    to = transform_points(matrix, rng.uniform(0, 1, 3) * n)
    if rng.random() < 0.3:
        to = eye + matrix[:3, int(rng.integers(3))]
    orthographic = rng.random() < 0.4
    return volume, Camera(
        eye, to, np.cross(to - eye, rng.normal(size=3)), "orthographic" if orthographic else "perspective",
        field_of_view=float(rng.choice([10, 60, 150])), height=float(rng.uniform(5, 60)),
    )  # fmt: skip


def places(volume, points):
    """Which block points of index space lie in (n, 3); outside the volume -1."""
    n = np.array(volume.dims)
    counts = np.array(block_counts(volume.dims, SIZE))
    inside = ((points >= -0.5) & (points < n - 0.5)).all(axis=1)
    at = np.clip(np.floor(points / SIZE), 0, counts - 1).astype(int)
    return np.where(inside[:, None], at, -1)


@settings(max_examples=100, deadline=None)
@given(seeds)
def test_along_every_ray_blocks_come_in_order(seed):
    """Checks: Schlosser 2009, T63, for a grid instead of an octree: perspective, orthographic, the eye anywhere."""
    volume, camera = scene(seed)
    blocks = list(front_to_back(volume, camera, size=SIZE))
    assert len(blocks) == np.prod(block_counts(volume.dims, SIZE))
    turn = {block.place: i for i, block in enumerate(blocks)}
    size = (6, 5)
    reach = float(np.linalg.norm(volume.corners - np.asarray(camera.eye), axis=1).max())
    for x, y in np.ndindex(*size):
        origin, direction = camera.ray(size, x, y)
        t = np.linspace(-reach if camera.orthographic else 0.0, reach, 400)[:, None]
        points = transform_points(volume.world_to_index, origin + t * direction)
        # What lies on a face belongs to both sides, as rounding has it.
        clear = np.abs(points - SIZE * np.round(points / SIZE)).min(axis=1) > 1e-9
        met = np.where(clear[:, None], places(volume, points), -1)
        order = [turn[tuple(place)] for place in met if place[0] >= 0]
        assert order == sorted(order)
        for place in {tuple(p) for p in met[t[:, 0] >= 0.0] if p[0] >= 0}:
            left, top, right, bottom = pixels_of(blocks[turn[place]], volume, camera, size)
            assert left <= x < right
            assert top <= y < bottom


@settings(max_examples=60, deadline=None)
@given(seeds, st.integers(0, 2))
def test_blocks_fill_the_volume_and_read_what_interpolation_needs(seed, reach):
    """Checks: Rezk-Salama 2001, NP-17: values and differences inside a block are those of the whole volume."""
    volume, camera = scene(seed)
    n = np.array(volume.dims)
    covered = 0.0
    rng = np.random.default_rng(seed)
    real = volume.real(np.float64)
    for block in front_to_back(volume, camera, size=SIZE, reach=reach):
        low, high = np.array(block.low), np.array(block.high)
        covered += (high - low).prod()
        part = volume.part(block.first, block.stop)
        points = rng.uniform(low, high, (20, 3))
        for shift in np.array([[0, 0, 0], [reach, 0, 0], [0, -reach, 0], [0, 0, reach]]):
            # The edge of the volume repeats, and only there a block ends where the volume does.
            at = np.clip(points + shift, 0, n - 1)
            expected = ndimage.map_coordinates(real, at.T[::-1], order=1, mode="nearest")
            local = np.clip(points - block.first + shift, 0, np.array(part.dims) - 1)
            assert np.allclose(ndimage.map_coordinates(part.real(np.float64), local.T[::-1], order=1), expected)
    assert np.isclose(covered, n.prod())


@settings(max_examples=60, deadline=None)
@given(seeds)
def test_each_sample_belongs_to_one_block_in_single_precision(seed):
    """What makes a picture in blocks the picture of the whole: neighbours compute the same numbers for a shared plane.

    A block owns the segments whose middle lies between the last plane by which the ray comes in and the first by which
    it goes out; the outer faces bound nothing here. With crossings (plane - origin) * (1 / direction) that both
    neighbours compute alike, no segment of the ray is lost or taken twice.
    """
    volume, camera = scene(seed)
    f = np.float32
    rays = camera.rays((5, 5), volume.world_to_index)
    step = f(0.37 * volume.spacing.min())
    k = np.arange(0, 2000)
    s = (k.astype(f) + f(0.5)) * step
    for x, y in np.ndindex(5, 5):
        off = [(x + 0.5) / 5 * 2 - 1, 1 - (y + 0.5) / 5 * 2]
        offset = off[0] * rays["half_size"][0] * rays["right"] + off[1] * rays["half_size"][1] * rays["up"]
        origin = (rays["base"] + (offset if camera.orthographic else 0.0)).astype(f)
        direction = (rays["forward"] + (0.0 if camera.orthographic else offset)).astype(f)

        def segments(block, o=origin, d=direction):
            enter, leave = f(-np.inf), f(np.inf)
            for axis, (place, count) in enumerate(zip(block.place, block_counts(volume.dims, SIZE), strict=True)):
                low = f(block.low[axis]) if place > 0 else f(-np.inf)
                high = f(block.high[axis]) if place < count - 1 else f(np.inf)
                if d[axis] == 0:
                    if not low <= o[axis] < high:
                        return np.zeros(0, int)
                    continue
                inverse = f(1) / d[axis]
                a, b = (low - o[axis]) * inverse, (high - o[axis]) * inverse
                enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
            return k[(s >= enter) & (s < leave)]

        met = [segments(block) for block in front_to_back(volume, camera, size=SIZE)]
        assert np.array_equal(np.concatenate(met), k), "all of them, each once, in order along the ray"


@settings(max_examples=60, deadline=None)
@given(seeds, st.sampled_from((0.0, 0.05, 1.0)))
def test_blocks_without_a_visible_brick_are_left_out_and_no_others(seed, share):
    volume, camera = scene(seed)
    counts = brick_counts(volume.dims)
    visible = np.random.default_rng(seed).random(counts[::-1]) < share
    size = 2 * SIZE
    found = [block.place for block in front_to_back(volume, camera, visible, size)]
    expected = {tuple(int(i) * BRICK // size for i in brick[::-1]) for brick in np.argwhere(visible)}
    assert len(found) == len(set(found))
    assert set(found) == expected
    order = [block.place for block in front_to_back(volume, camera, size=size) if block.place in expected]
    assert found == order
    near = visible_blocks(visible, volume.dims, size, span=BRICK - 1.0)
    wider = ndimage.binary_dilation(visible, np.ones((3, 3, 3)))
    assert np.array_equal(near, visible_blocks(wider, volume.dims, size))


def test_what_a_block_reads_beyond_its_own():
    """Checks: Rezk-Salama 2001, NP-18: a shared plane costs ((B + 1) / B)^3, 1.024 for 128."""
    inner = block_at((1024,) * 3, (3, 3, 3), reach=0)
    assert (inner.low, inner.high) == ((384, 384, 384), (512, 512, 512))
    assert (inner.first, inner.stop) == ((384, 384, 384), (513, 513, 513))
    assert np.isclose((129 / 128) ** 3, 1.0236, atol=1e-4)
    last = block_at((1024, 1024, 1), (7, 0, 0))
    assert (last.low, last.high) == ((896, -0.5, -0.5), (1023.5, 128, 0.5))
    assert (last.first, last.stop) == ((895, 0, 0), (1024, 130, 1))


def test_blocks_are_made_of_bricks():
    with pytest.raises(PortError, match=f"blocks: expected a multiple of {BRICK} cells, got {BRICK + 1}"):
        block_counts((64, 64, 64), BRICK + 1)
    n = 8 * BRICK
    with pytest.raises(PortError, match=rf"bricks \(8, 8, 8\) \(z, y, x\) for a grid of \({n}, {n}, {n}\), got"):
        visible_blocks(np.ones((8, 8, 9), bool), (n, n, n))


def test_a_block_behind_the_eye_has_no_pixel_and_one_around_it_has_all():
    volume = Volume(np.zeros((17, 17, 17), np.uint8))
    before, inside = Camera((0, -100, 0)), Camera((1, 2, 3), (1, 50, 3))
    near, far = (block_at(volume.dims, (0, i, 0), SIZE) for i in (0, 1))
    box = pixels_of(near, volume, before, (100, 80))
    assert 0 < box[0] < 50 < box[2] < 100
    assert pixels_of(near, volume, Camera((0, -100, 0), (0, -200, 0)), (100, 80)) is None
    assert pixels_of(far, volume, inside, (100, 80)) == (0, 0, 100, 80)
    wider = pixels_of(near, volume, before, (100, 80), margin=4.0)
    assert wider[0] < box[0]
    assert wider[2] > box[2]
