"""Which pixels are cast when some are guessed, and what the guesses are; pictures are formulas instead of rays."""

from types import SimpleNamespace

import numpy as np
import pytest

from nodegraph.compute.sparse_pixels import cast_sparsely
from nodegraph.data.buffer import Buffer

SIZE = (90, 71)


class Rays:
    """Casts a picture that is given: color(x, y) in every channel, depth(x, y). ``cast``: the pixels that were."""

    def __init__(self, color, depth=None, size=SIZE):
        columns, rows = np.meshgrid(np.arange(size[0]), np.arange(size[1]))
        values = np.broadcast_to(color(columns, rows), columns.shape)
        self.color = np.repeat(values[..., None], 4, axis=2).astype(np.float32)
        far = np.full(columns.shape, np.inf) if depth is None else depth(columns, rows)
        self.depth = np.broadcast_to(far, columns.shape).astype(np.float32)
        self.size, self.cast, self.told = size, [], []

    def __call__(self, pixels=None):
        if pixels is None:
            return SimpleNamespace(color=Buffer(self.color), depth=Buffer(self.depth))
        columns, rows = (pixels[..., i].astype(int) for i in (0, 1))
        self.cast.append(set(zip(columns.ravel().tolist(), rows.ravel().tolist(), strict=True)))
        return SimpleNamespace(color=Buffer(self.color[rows, columns]), depth=Buffer(self.depth[rows, columns]))

    def render(self, device, tolerance):
        found = cast_sparsely(self, device, self.size, tolerance, self.told.append)
        return found.color.array, found.depth.array


def test_a_plane_seen_from_aslant_is_guessed_up_to_the_edge_of_the_picture(device):
    """A slope is not uneven, however steep, in colour or depth. The last row and column have no corner beyond."""
    rays = Rays(lambda x, y: 0.1 + 0.005 * x + 0.004 * y, lambda x, y: 300.0 + 2.0 * x + y)
    color, depth = rays.render(device, 1e-5)
    assert np.abs(color - rays.color).max() < 1e-5
    assert np.abs(depth - rays.depth).max() < 1e-5 * 300.0
    beyond = (89 - 88) * 71 + (71 - 69) * 90
    assert sum(map(len, rays.cast)) < 23 * 18 + beyond


def test_no_pixel_is_cast_twice_and_what_is_cast_is_shown(device):
    rays = Rays(lambda x, y: np.where(x > 60, np.random.default_rng(3).random(x.shape), 0.2 + 0.002 * x))
    color, _ = rays.render(device, 1e-4)
    every = set().union(*rays.cast)
    assert sum(map(len, rays.cast)) == len(every) < 0.6 * SIZE[0] * SIZE[1]
    columns, rows = np.array(sorted(every)).T
    assert np.array_equal(color[rows, columns], rays.color[rows, columns])
    assert {(x, y) for x in range(62, 90) for y in range(71)} <= every
    assert "guessed" in rays.told[0]


@pytest.mark.parametrize("tolerance", [0.01, 0.03, 0.1])
@pytest.mark.parametrize(
    "form",
    [
        lambda u: 0.4 * np.sin(u / 16.0) + 0.5,
        lambda u: np.abs((u / 40.0) % 2.0 - 1.0),
        lambda u: ((u // 50.0) % 2.0) * 0.9 + 0.05,
        lambda u: np.where(u > 33.3, np.sqrt(np.maximum(u - 33.3, 0.0)) / 11.0, 0.0) + 0.01,
    ],
    ids=["wave", "bends", "jumps", "round edge"],
)
def test_what_is_wider_than_four_pixels_keeps_the_tolerance(gl, form, tolerance):
    """Smooth, bent and torn pictures, turned in all directions and shifted by parts of a pixel."""
    cast = []
    for turn in np.linspace(0.0, np.pi, 7):
        rays = Rays(lambda x, y, a=turn: form(x * np.cos(a) + y * np.sin(a) + 40.0 + 3.0 * a))
        color, _ = rays.render(gl, tolerance)
        assert np.abs(color - rays.color).max() <= tolerance * (1.0 + 1e-5)
        cast.append(sum(map(len, rays.cast)) if "guessed" in rays.told[0] else color[..., 0].size)
    assert np.mean(cast) < 0.85 * SIZE[0] * SIZE[1]


def test_depth_beside_nothing_is_cast(gl):
    """A depth between something and nothing would be nobody's; one that bends is guessed within its share."""
    rays = Rays(lambda x, y: 0.5 + 0.0 * x, lambda x, y: np.where(x > 43, np.inf, 400.0 + 0.02 * (y - 30.0) ** 2))
    _, depth = rays.render(gl, 0.01)
    assert np.array_equal(np.isinf(depth), np.isinf(rays.depth))
    there = np.isfinite(depth)
    assert np.all(np.abs(depth[there] - rays.depth[there]) <= 0.01 * rays.depth[there])
    assert {(x, y) for x in (41, 42, 43, 44) for y in range(71)} <= set().union(*rays.cast)


def test_what_is_not_a_number_is_not_guessed_from(gl):
    rays = Rays(lambda x, y: np.where((x == 40) & (y == 32), np.nan, 0.5))
    color, _ = rays.render(gl, 0.1)
    assert np.argwhere(np.isnan(color[..., 0])).tolist() == [[32, 40]]


def test_all_are_cast_where_few_would_be_left_out(gl):
    rays = Rays(lambda x, y: np.where(x > 20, np.random.default_rng(3).random(x.shape), 0.3))
    color, depth = rays.render(gl, 0.01)
    assert np.array_equal(color, rays.color)
    assert np.array_equal(depth, rays.depth)
    assert len(rays.cast) == 1
    assert "every pixel" in rays.told[0]
