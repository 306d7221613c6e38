"""The comparison with VTK, as far as it needs no VTK: scenes, settings, what is said of points, the page."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from nodegraph import formats, registry
from nodegraph.data import Camera, TransferFunction, Volume
from nodegraph.data.space import centred
from nodegraph.requests import LEVELS, coarser
from tests.benchmarks.peers import page
from tests.benchmarks.peers.compare import Match, is_whole
from tests.benchmarks.peers.floor import Stage
from tests.benchmarks.peers.limit import GROUP, SAMPLE, STEPS, VALUE, VOXEL, counts
from tests.benchmarks.peers.orbit import Orbit
from tests.benchmarks.peers.points import Point, advantage, cheapest, errors, front
from tests.benchmarks.peers.scenes import CHEST, Scene, bordered, chest, fog
from tests.benchmarks.peers.settings import ladders

QUICK, MIDDLE, EXACT = (
    Point({"step": 4.0}, 1.0, 0.1, 0.5),
    Point({"step": 2.0}, 2.0, 0.01, 0.1),
    Point({}, 4.0, 1e-3, 1e-2),
)


def test_errors_are_those_of_numpy() -> None:
    truth = np.zeros((2, 2, 3))
    picture = truth.copy()
    picture[0, 0, 0] = 0.12
    assert errors(picture, truth) == pytest.approx((0.12 / np.sqrt(12), 0.12))


def test_in_eight_bits_our_picture_is_rounded_as_a_window_rounds_it() -> None:
    truth = np.full((4, 4, 3), 100.4 / 255)
    rmse, maximum = errors(truth, truth, bits=8)
    assert rmse == pytest.approx(0.4 / 255)
    assert maximum == pytest.approx(0.4 / 255)
    assert errors(truth, truth, bits=15)[0] < 1e-4


def test_the_cheapest_keeps_the_error() -> None:
    points = [EXACT, QUICK, MIDDLE]
    assert cheapest(points, 0.05) == [MIDDLE]
    assert cheapest(points, 0.2, count=2) == [QUICK, MIDDLE]
    assert cheapest(points, 1e-4) == []


def test_the_front_leaves_out_what_is_beaten() -> None:
    beaten = Point({}, 3.0, 0.05, 0.2)
    assert front([EXACT, beaten, QUICK, MIDDLE]) == [QUICK, MIDDLE, EXACT]


def test_the_advantage_is_the_least_over_all_points_of_the_other() -> None:
    theirs = [Point({}, 3.0, 0.1, 0.5), Point({}, 8.0, 2e-3, 0.1)]
    assert advantage([QUICK, MIDDLE, EXACT], theirs) == pytest.approx(2.0)
    assert advantage([QUICK, MIDDLE], theirs) == 0.0, "one of their points is more accurate than all of ours"


def test_the_outermost_voxels_are_invisible_and_the_others_as_they_were() -> None:
    data = np.arange(4 * 5 * 6, dtype=np.int16).reshape(4, 5, 6)
    result = bordered(data, -7)
    assert (result[1:-1, 1:-1, 1:-1] == data[1:-1, 1:-1, 1:-1]).all()
    assert (result == -7).sum() == 4 * 5 * 6 - 2 * 3 * 4


def test_the_chest_lies_where_its_file_says_along_axes_that_all_ascend() -> None:
    read, scene = formats.read(str(CHEST)), chest((8, 8))
    volume = scene.volume
    assert (np.diag(volume.index_to_world)[:3] > 0).all()
    rng = np.random.default_rng(3)
    for _ in range(50):
        x, y, z = (int(rng.integers(1, n - 1)) for n in volume.dims)
        world = volume.index_to_world @ (x, y, z, 1.0)
        i, j, k = np.rint((read.world_to_index @ world)[:3]).astype(int)
        assert volume.data[z, y, x] == read.data[k, j, i]
    assert scene.visible_share() < 0.25


def test_the_fog_is_visible_everywhere_but_at_its_border() -> None:
    assert fog((8, 8), side=24).visible_share() == pytest.approx((22 / 24) ** 3)


def test_a_turned_camera_keeps_its_distance_and_comes_round() -> None:
    scene = fog((8, 8), side=8)
    eye, target = np.array(scene.camera.eye), np.array(scene.camera.target)
    turned = np.array(scene.seen_from(90.0).eye)
    assert np.linalg.norm(turned - target) == pytest.approx(np.linalg.norm(eye - target))
    assert turned[2] == pytest.approx(eye[2])
    assert scene.seen_from(360.0).eye == pytest.approx(scene.camera.eye)


def test_every_setting_that_is_tried_is_one_of_the_ray_caster() -> None:
    params = registry.find("render.raycast").params
    tried = [settings for ladder in ladders() for settings in ladder]
    for settings in tried:
        for name, value in settings.items():
            if name == "level":
                assert value in LEVELS
            else:
                params[name].check(value, name)
    assert len({tuple(sorted(settings.items(), key=str)) for settings in tried}) == len(tried)


def test_the_page_keeps_its_text_and_says_what_was_missed(tmp_path: Path) -> None:
    path = tmp_path / page.NAME
    path.write_text(f"before\n{page.BEGIN}\nold\n{page.END}\nafter\n", "utf-8")
    slow = Orbit("sparse", "interactive", 5.0, 0.2, 0.3, 0.01, 0.1)
    page.write(path, [], [slow], [], [Stage("a sample", 17.25)])
    text = path.read_text("utf-8")
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "old" not in text
    assert "| a sample | 17.2 ns |" in text
    assert page.missed([], [slow]) == ["orbit, sparse: 5.0 frames a second, 12 are wanted"]


def test_a_match_without_a_setting_of_ours_is_no_match() -> None:
    assert Match(scene := fog((8, 8), 8), "gpu", MIDDLE, 0.01, None).factor == 0.0
    assert Match(scene, "gpu", MIDDLE, 0.2, QUICK).factor == 2.0
    assert Match(scene.illuminated(), "fixed-point", MIDDLE, 0.2, QUICK).wanted == 1.5


def test_a_level_takes_pixels_away() -> None:
    for settings in (settings for ladder in ladders() for settings in ladder if "level" in settings):
        size, step = coarser((256, 256), settings["step"], settings["level"])
        assert size[0] < 256
        assert step is not None
        assert step <= max(settings["step"], 1.0)
        assert not is_whole(Point(settings, 1.0, 0.1, 0.1))


@pytest.mark.slow
def test_rays_are_followed_as_they_are_cast() -> None:
    """Fog is looked at everywhere; of two seen slabs, far apart, rays leap over all between and before them."""
    dense = counts(fog((32, 32), side=32))
    for one, step in zip(dense, STEPS, strict=True):
        assert one.step == step
        assert one.segments <= one.samples < 1.6 * one.segments + 4 * GROUP
        assert one.visible < one.segments
        assert one.leaps == 0
    data = np.zeros((64, 64, 64), np.int16)
    data[:, 8:10] = data[:, 50:52] = 100
    camera = Camera((0, -300, 0), (0, 0, 0), (0, 0, 1), "orthographic", height=32.0)
    thin = TransferFunction([(50.0, (1, 1, 1), 0.0), (100.0, (1, 1, 1), 1e-4)])
    slabs = Scene("slabs", Volume(data, centred((64, 64, 64), (1.0,) * 3)), thin, camera, (32, 32))
    for one in counts(slabs, (1e-3,)):
        assert one.samples == one.visible == 0
    for one in counts(slabs):
        # Along y: two slabs of 2 voxels, each in one or two bricks of 4.
        assert one.segments == pytest.approx(64 / one.step, abs=1)
        assert one.visible == pytest.approx(4 / one.step, abs=2)
        assert one.visible <= one.samples <= 16 / one.step + 2 * GROUP
        # One that says yes before each group of samples; else before the slabs, between and behind them.
        assert 3 <= one.leaps - one.samples / GROUP <= 6
        lowest = [Stage(VALUE, 10.0), Stage(VOXEL, 5.0)]
        cores = os.cpu_count() or 1
        assert one.seconds(1000, lowest) == pytest.approx((one.samples * 10 + one.leaps * 5) * 1e-6 / cores)
        dearer = [*lowest, Stage(SAMPLE, 20.0)]
        assert one.seconds(1000, dearer, SAMPLE) == pytest.approx((one.samples * 20 + one.leaps * 5) * 1e-6 / cores)
