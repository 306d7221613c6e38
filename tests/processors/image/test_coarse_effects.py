"""Effects of the screen at levels of quality: final is untouched, and what a coarse picture loses is bounded."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from nodegraph import registry
from nodegraph.data import Camera, Image
from nodegraph.requests import LEVELS, level
from tests.support.calls import call

CAMERA = Camera(eye=(0.0, -500.0, 0.0), target=(0.0, 0.0, 0.0), field_of_view=30.0)
SIDE = 72


@pytest.fixture(scope="module")
def scene() -> Image:
    """A ball before a wall with ripples, a step, and nothing above."""
    y, x = np.mgrid[:SIDE, :SIDE] * (256.0 / SIDE)
    ball = 60.0 * np.sqrt(np.clip(1.0 - ((x - 128) / 90) ** 2 - ((y - 128) / 90) ** 2, 0.0, 1.0))
    depth = (500.0 - ball + 6.0 * np.sin(x / 19) * np.sin(y / 17)).astype(np.float32)
    depth[:, SIDE * 3 // 4 :] += 40.0
    depth[: SIDE // 12] = np.inf
    color = np.full((SIDE, SIDE, 4), 0.8, np.float32)
    color[..., 3] = 1.0
    color[np.isinf(depth)] = 0.0
    return Image(color, depth, np.full((SIDE, SIDE), 7, np.uint32))


def rmse(a: Image, b: Image) -> float:
    return float(np.sqrt(np.mean((a.color - b.color) ** 2)))


@pytest.mark.parametrize("sampling", ["hashed", "every_pixel"])
def test_occlusion_is_grainy_and_right_on_average(device, scene, sampling):
    def shaded(quality: str) -> Image:
        return call(
            "image.ssao", device, image=scene, camera=CAMERA, radius=20.0, sampling=sampling, quality=quality
        ).shaded

    final = shaded("final")
    for n in LEVELS[::2]:
        coarse = shaded(level(n))
        assert coarse.size == final.size
        assert np.array_equal(coarse.depth, final.depth)
        assert np.array_equal(coarse.ids, final.ids)
        assert 0.0 < rmse(coarse, final) < min(0.006 * n, 0.06)
        # What is lost is grain: it is lost to both sides, and no pixel by more than the strength.
        assert abs(np.mean(coarse.color - final.color)) < 0.01
        assert np.abs(coarse.color - final.color).max() <= 0.8


def test_about_one_nth_of_the_pixels_is_looked_at():
    fewer = vars(sys.modules[registry.find("image.ssao").__module__])["fewer"]
    assert [fewer(64, n) for n in LEVELS] == [32, 16, 8, 4, 4, 4]
    assert fewer(float("inf"), 4) == 4096
    assert all(fewer(count, 2) % 2 == 0 for count in range(2, 200))


def test_depth_darkening_of_every_so_many_pixels_is_nearly_that_of_all(device, scene):
    def darkened(quality: str) -> Image:
        return call("image.depth_darkening", device, image=scene, sigma=8.0, quality=quality)

    final = darkened("final")
    for n in LEVELS:
        coarse = darkened(level(n))
        assert np.array_equal(coarse.depth, final.depth)
        assert np.array_equal(coarse.color[..., 3], final.color[..., 3])
        assert rmse(coarse, final) < 0.015
    narrow = [
        call("image.depth_darkening", device, image=scene, sigma=1.0, quality=q).color for q in ("final", level(64))
    ]
    assert np.array_equal(*narrow)  # less than a pixel wide: every pixel counts at every level


def test_a_grid_under_a_gaussian_is_as_fine_as_its_width():
    stride = vars(sys.modules[registry.find("image.depth_darkening").__module__])["stride"]
    assert [stride(7.7, n) for n in (1, *LEVELS)] == [1, 2, 4, 7, 7, 7, 7]
    assert stride(0.3, 64) == 1
