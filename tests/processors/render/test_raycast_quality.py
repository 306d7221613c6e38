"""What the ray-caster leaves out on request: levels of quality, sparse pixels, the early end of rays."""

import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph import registry
from nodegraph.accuracy.settings import quality_parameters
from nodegraph.compute.casting import enlarged
from nodegraph.data import Camera, Image, Light, Mapping, TransferFunction, Volume
from nodegraph.data.space import affine, centred
from nodegraph.network import Network
from nodegraph.plan import plan
from nodegraph.requests import LEVELS, level
from tests.support.calls import call

pytestmark = pytest.mark.slow

SIZE = (53, 45)
CAMERA = Camera(eye=(30.0, -150.0, 40.0), target=(0, 0, 0), field_of_view=24.0)
FLAT = Camera(eye=(30.0, -150.0, 40.0), target=(0, 0, 0), projection="orthographic", height=64.0)
RAMP = TransferFunction([(0.0, (0.1, 0.2, 0.9), 0.0), (0.3, (0.9, 0.3, 0.1), 0.0), (1.0, (0.9, 0.8, 0.6), 0.4)])
INTEGRATORS = ("midpoint", "trapezoid", "preintegrated", "gauss2", "gauss3", "adaptive", "cellwise")


def render(device, volume, camera=CAMERA, tf=RAMP, size=SIZE, **params):
    params = {"lit": False, "termination": 1.0, "step": 1.0} | params
    return call("render.raycast", device, size, volume=volume, camera=camera, transfer_function=tf, **params)


def blob(n=24, width=0.18):
    """A ball with soft edges: exp(-r^2 / 2 w^2) in a cube of 48 mm."""
    at = ((np.arange(n) + 0.5) / n - 0.5) * 48.0
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    data = np.exp(-(x**2 + y**2 + 1.7 * z**2) / (2 * (48.0 * width) ** 2)).astype(np.float32)
    return Volume(data, centred((n, n, n), [48.0 / n] * 3))


# -- levels of quality --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("camera", [CAMERA, FLAT], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("n", LEVELS[:4])
def test_a_coarser_picture_shows_the_same_view_in_the_size_that_was_asked_for(device, camera, n):
    """A smooth scene loses little, at sizes that no fraction divides; shifted by a pixel it would lose more."""
    volume = blob()
    final = render(device, volume, camera, step=0.5)
    coarse = render(device, volume, camera, step=0.5, quality=level(n))
    assert coarse.size == final.size == SIZE
    assert coarse.color.dtype == final.color.dtype
    lost = np.sqrt(np.mean((coarse.color - final.color) ** 2))
    shifted = [np.roll(coarse.color, by, axis) for axis in (0, 1) for by in (-1, 1)]
    assert 0.0 < lost < 0.009 * math.sqrt(n)
    assert lost < 0.8 * min(np.sqrt(np.mean((other - final.color) ** 2)) for other in shifted)


@pytest.mark.parametrize("integrator", ["midpoint", "trapezoid", "preintegrated", "gauss2"])
def test_neighbouring_rays_of_a_coarse_picture_miss_other_things(gl, integrator):
    """A thin shell under long steps: enlarging takes means of four cuts, and plain rays show bands instead."""
    shell = TransferFunction([(0.4, (1, 1, 1), 0.0), (0.5, (1, 1, 1), 0.05), (0.6, (1, 1, 1), 0.0)])
    volume, size = blob(), (64, 64)
    given = {"camera": FLAT.with_(height=24.0), "tf": shell, "integrator": integrator, "step": 3.0}
    exact = render(gl, volume, size=size, **given | {"integrator": "cellwise"}).color
    coarse = render(gl, volume, size=size, quality=level(4), **given)
    small = render(gl, volume, size=(32, 32), **given)
    plain = enlarged(small, size, gl).color
    error, without = (np.sqrt(np.mean((picture - exact) ** 2)) for picture in (coarse.color, plain))
    # What preintegration errs by lies within segments, wherever they begin.
    assert error < (0.95 if integrator == "preintegrated" else 0.8) * without
    # Nothing of the kind is done to what is not enlarged, and to pixels that are told from those around them.
    again = render(gl, volume, size=(32, 32), pixel_tolerance=1e-6, **given).color
    assert np.abs(again - small.color).max() < 1e-5


@pytest.mark.parametrize("seed", range(4))
def test_steps_that_begin_elsewhere_leave_out_only_what_cannot_be_seen(device, seed):
    """Near and inside a volume: with and without leaps, and no ray sees what lies behind the eye."""
    rng = np.random.default_rng(seed)
    data = np.zeros((24, 24, 24), np.float32)
    data[rng.random(data.shape) < 0.01] = 1.0
    eye = rng.uniform(-20.0, 20.0, 3)
    camera = Camera(eye=eye, target=eye + rng.normal(size=3), field_of_view=70.0)
    volume = Volume(data, centred((24, 24, 24), [2.0] * 3))
    given = {"camera": camera, "size": (32, 32), "quality": level(4), "step": (0.7, 3.0)[seed % 2]}
    leapt, all_of_it = (render(device, volume, skip=skip, **given).color for skip in (True, False))
    assert all_of_it.max() > 0.05
    assert np.abs(leapt - all_of_it).max() <= 1e-6


@pytest.mark.parametrize("step", [1.0, 8.0])
@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_no_level_sees_what_is_behind_the_eye(device, projection, step):
    data = np.zeros((9, 64, 9), np.float32)
    data[:, :28] = 1.0
    behind = TransferFunction([(0.5, (1, 1, 1), 0.0), (1.0, (1, 1, 1), 0.9)])
    camera = Camera(eye=(0, -2.5, 0), target=(0, 10, 0), projection=projection, field_of_view=40.0, height=6.0)
    volume = Volume(data, centred((9, 64, 9), [1.0] * 3))
    image = render(device, volume, camera, behind, (16, 16), step=step, quality=level(4))
    assert image.color.max() == 0.0


def test_a_ray_that_hides_nothing_has_no_depth(device):
    """Also where the depth is asked for that hides nothing, by every integrator."""
    data = np.zeros((8, 8, 8), np.float32)
    data[:, :, 4:] = 1.0
    right = TransferFunction([(0.5, (1, 1, 1), 0.0), (1.0, (1, 1, 1), 0.9)])
    volume = Volume(data, centred((8, 8, 8), [2.0] * 3))
    for integrator in INTEGRATORS:
        image = render(device, volume, FLAT, right, (32, 24), integrator=integrator, depth_opacity=0.0)
        hides = image.color[..., 3] > 0.0
        assert 0.02 < hides.mean() < 0.5, integrator
        assert np.array_equal(np.isfinite(image.depth), hides), integrator


def test_depth_of_a_coarse_picture_is_that_of_a_ray(gl):
    """Two planes one behind the other: no depth lies between them."""
    data = np.zeros((16, 16, 16), np.float32)
    data[:8, 3] = 1.0
    data[:, 12] = 1.0
    image = render(gl, Volume(data), FLAT.with_(eye=(0, -150, 0), height=14.0), mode="iso", quality="interactive/8")
    depth = image.depth[np.isfinite(image.depth)]
    assert np.all((np.abs(depth - 145.0) <= 0.5) | (np.abs(depth - 154.0) < 0.01))
    assert np.ptp(depth) > 8.0


def test_the_work_falls_with_the_level():
    """Pixels times samples are about one n-th, whatever the step, and the picture keeps its shape."""
    coarser = vars(sys.modules[registry.find("render.raycast").__module__])["coarser"]
    for step in (0.05, 0.5, 1.0, 3.0, None):
        for n in (1, *LEVELS):
            (width, height), longer = coarser((1024, 640), step, n)
            samples = 1.0 if step is None else step / longer
            assert width * height * samples == pytest.approx(1024 * 640 / n, rel=0.03)
            assert width / height == pytest.approx(1.6, rel=0.01)
            assert step is None or longer <= max(step, 1.0) * (1 + 1e-12)
    assert coarser((3, 1), 1.0, 64) == ((3, 1), 1.0)
    assert coarser((1, 1000), 1.0, 64) == ((1, 125), 1.0)


def test_entry_points_are_asked_for_in_the_size_that_is_cast(engine):
    network = Network()
    network.add("source.synthetic", "volume", voxels=(16, 16, 16), extent=(40, 40, 40))
    network.add("geometry.proxy_box", "box")
    network.add("render.entry_exit_points", "points")
    network.add("render.raycast", "raycast", step=1.0, lit=False)
    for source, target in (
        ("volume.volume", "box.volume"), ("box.geometry", "points.geometry"), ("volume.volume", "raycast.volume"),
        ("points.interval", "raycast.interval"),
    ):  # fmt: skip
        network.connect(source, target)
    for one in ("points", "raycast"):
        network.link(f"{one}.camera", "camera")
    network.set("camera", CAMERA)
    pictures = {}
    for quality, expected in (("final", (64, 48)), ("interactive/4", (32, 24))):
        tasks = plan(network.flatten(), ["raycast"], size=(64, 48), quality=quality).tasks
        asked = next(task for task in tasks if task.path == "points")
        assert (asked.size, asked.quality) == (expected, "final")
        report = engine.evaluate(network, "raycast", size=(64, 48), quality=quality)
        report.raise_first()
        pictures[quality] = report.values["raycast", "image"].color
    without = call_without_interval(engine, network)
    assert np.abs(pictures["interactive/4"] - without).max() < 2e-5


def call_without_interval(engine, network):
    network.disconnect("raycast.interval")
    report = engine.evaluate(network, "raycast", size=(64, 48), quality="interactive/4")
    report.raise_first()
    return report.values["raycast", "image"].color


def test_measure_and_tune_see_what_is_approximated():
    """Each approximation is a knob, with the value that a reference takes."""
    network = Network()
    network.add("source.synthetic", "volume")
    network.add("filter.reduce", "reduce")
    network.add("filter.quantize", "quantize")
    network.add("render.raycast", "raycast")
    network.add("output.view", "view")
    for source, target in (
        ("volume.volume", "reduce.volume"), ("reduce.reduced", "quantize.volume"),
        ("quantize.quantized", "raycast.volume"), ("raycast.image", "view.image"),
    ):  # fmt: skip
        network.connect(source, target)
    knobs = {knob.place: knob.parameter for knob in quality_parameters(network, "view")}
    expected = {
        "reduce.halvings": (0,), "quantize.max_error": (0.0,), "raycast.pixel_tolerance": (0.0,),
        "raycast.termination": (1.0,), "raycast.value_error": (0.0,), "raycast.skip_opacity": (0.0,),
    }  # fmt: skip
    assert {place: knobs[place].reference for place in expected} == expected
    assert {"quantize.storage", "raycast.table_size"} <= set(knobs)


# -- sparse pixels ------------------------------------------------------------------------------------------------


LARGE = (106, 90)
MIST = TransferFunction([(0.0, (0.1, 0.2, 0.9), 0.01), (1.0, (0.9, 0.8, 0.6), 0.1)])


def noise_beside_mist():
    """Noise on the left, which no tolerance keeps, and one value on the right, which bends nowhere."""
    data = np.random.default_rng(5).random((30, 30, 30)).astype(np.float32)
    data[:, :, 12:] = 0.5
    return Volume(data, centred((30, 30, 30), (3.0, 3.0, 4.0)))


@pytest.mark.parametrize("camera", [CAMERA, FLAT], ids=["perspective", "orthographic"])
def test_sparse_rays_are_the_same_rays(device, camera):
    """Where the picture is uneven all pixels are cast, and none differs; where it is not most are guessed, and do."""
    volume, near = noise_beside_mist(), camera.with_(field_of_view=10.0, height=30.0)
    every = render(device, volume, near, MIST, LARGE)
    sparse = render(device, volume, near, MIST, LARGE, pixel_tolerance=1e-3)
    assert np.abs(sparse.color - every.color)[:, :16].max() < 2e-6
    assert np.allclose(sparse.depth[:, :16], every.depth[:, :16], rtol=2e-6)
    assert np.any(sparse.color != every.color, axis=2)[:, 70:].mean() > 0.3
    assert np.abs(sparse.color - every.color).max() <= 1e-3


@pytest.mark.parametrize("size", [(1, 1), (4, 3), (5, 2), (9, 1), (9, 9), SIZE])
def test_where_nothing_agrees_all_pixels_are_cast(device, size):
    near = CAMERA.with_(field_of_view=10.0)
    every = render(device, noise_beside_mist(), near, MIST, size=size)
    sparse = render(device, noise_beside_mist(), near, MIST, size=size, pixel_tolerance=1e-12)
    assert np.abs(sparse.color - every.color).max() < 2e-6
    assert np.allclose(sparse.depth, every.depth, rtol=2e-6)


def test_sparse_rays_keep_their_own_entry_points(gl):
    """Every ray is cut by the interval of its own pixel, at each stride."""
    volume = noise_beside_mist()
    columns, rows = np.meshgrid(np.arange(LARGE[0]), np.arange(LARGE[1]))
    entry = 130.0 + 0.18 * columns + 0.06 * rows
    interval = Image(np.stack([entry, entry + 20.0], axis=2).astype(np.float32))
    near = CAMERA.with_(field_of_view=10.0)
    every = render(gl, volume, near, MIST, LARGE, interval=interval)
    sparse = render(gl, volume, near, MIST, LARGE, interval=interval, pixel_tolerance=1e-3)
    assert np.abs(sparse.color - every.color)[:, :16].max() < 2e-6
    assert np.any(sparse.color != every.color)
    assert every.color[..., 3].min() > 0.05
    # A script's interval of the whole size leaves the level of quality no choice.
    assert np.array_equal(
        render(gl, volume, near, MIST, LARGE, interval=interval, quality="interactive/8").color, every.color
    )


@pytest.mark.parametrize("tolerance", [0.03, 0.1])
@pytest.mark.parametrize("mode", ["composite", "maximum", "first_hit"])
def test_scenes_wider_than_the_grid_keep_the_tolerance(device, mode, tolerance):
    """Checks: Orhun 2004, OR-60: at most the tolerance of difference, fewer rays."""
    volume, near = blob(), CAMERA.with_(field_of_view=6.0)
    tf = RAMP if mode == "composite" else TransferFunction([(0.0, (0, 0, 0), 0.0), (1.0, (1, 1, 1), 0.8)])
    size = (160, 128)
    every = render(device, volume, near, tf, size, mode=mode)
    sparse = render(device, volume, near, tf, size, mode=mode, pixel_tolerance=tolerance)
    guessed = np.any(sparse.color != every.color, axis=2)
    assert np.abs(sparse.color - every.color).max() <= tolerance
    assert guessed.mean() > 0.02
    both = np.isfinite(every.depth) & np.isfinite(sparse.depth)
    assert np.all(np.abs(sparse.depth[both] - every.depth[both]) <= tolerance * every.depth[both])


def test_what_is_thinner_than_the_grid_may_be_lost_and_is_found_where_it_meets_a_corner(gl):
    """The limit that the parameter tells of: a wire between the rows that are cast is not seen."""
    data = np.zeros((40, 3, 40), np.float32)
    data[:, 1, 18] = 1.0
    camera = Camera(eye=(0, -100, 0), target=(0, 0, 0), projection="orthographic", height=40.0)
    tf = TransferFunction([(0.0, (1, 1, 1), 0.0), (0.4, (1, 1, 1), 0.0), (0.6, (1, 1, 1), 0.9)])
    size = (40, 40)
    shown = {}
    for tolerance in (0.0, 0.05):
        picture = render(gl, Volume(data), camera, tf, size=size, step=0.5, pixel_tolerance=tolerance)
        shown[tolerance] = np.flatnonzero(picture.color[8:32, :, 3].max(axis=0) > 0.3)
    assert shown[0.0].tolist() == [18]
    assert shown[0.05].tolist() == []
    moved = Volume(data, np.diag([1.0, 1.0, 1.0, 1.0]) @ affine((1, 1, 1), (-17.5, -1.0, -19.5)))
    assert np.flatnonzero(
        render(gl, moved, camera, tf, size=size, step=0.5, pixel_tolerance=0.05).color[8:32, :, 3].max(axis=0) > 0.3
    ).tolist() == [20]


# -- bricks in which little is seen ---------------------------------------------------------------------------------


SPACING = 2.0
LAYERED = TransferFunction([(0.0, (1, 1, 1), 0.0), (0.2, (1, 1, 1), 0.1), (1.0, (1, 1, 1), 0.4)], SPACING)
"""Opacities of a voxel."""


def layers():
    """Along y 16 voxels that hide a tenth each, and 8 that hide more. Brick 3 ends at the first of them."""
    data = np.full((5, 24, 5), 0.2, np.float32)
    data[:, 16:] = 1.0
    return Volume(data, centred((5, 24, 5), [SPACING] * 3))


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_faint_bricks_are_left_out_by_what_they_hide_over_a_voxel(device, integrator):
    """Bricks 0 to 2 reach from the face at -1/2 to voxel 12: what is missing is the optical depth of 12.5 voxels."""
    scene = {"camera": FLAT.with_(eye=(0, -150, 0), height=4.0), "tf": LAYERED, "size": (3, 3), "step": 0.25}
    scene |= {"integrator": integrator, "tolerance": 1e-6}
    whole, same, less = (
        render(device, layers(), skip_opacity=asked, **scene).color[..., 3] for asked in (0.0, 0.09, 0.11)
    )
    assert np.array_equal(whole, same)
    missing = np.log1p(-less) - np.log1p(-whole)
    voxels = missing / -math.log(0.9)
    # A segment is left out as a whole, or not at all, but by what goes from cell to cell.
    assert np.abs(voxels - 12.5).max() < (1e-4 if integrator == "cellwise" else 0.26)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_where_all_is_faint_nothing_is_seen_at_equality_too(device, integrator):
    """Also not where rays enter and leave, where segments are cut; nor by rows of tables, which are rounded."""
    data = np.broadcast_to(np.linspace(0.3, 0.6, 9, dtype=np.float32), (9, 9, 9))
    flat = TransferFunction(
        [(0.0, (1, 1, 1), 0.0), (0.2, (1, 1, 1), 0.1), (0.7, (1, 1, 1), 0.1), (1.0, (1, 1, 1), 0.5)]
    )
    volume = Volume(data, centred((9, 9, 9), [1.0] * 3))
    for level_, step in (("final", 1.0), ("final", 0.3), ("interactive/4", 1.0)):
        for camera in (CAMERA, FLAT):
            image = render(device, volume, camera, flat, (24, 18), integrator=integrator, step=step, skip_opacity=0.1,
                           quality=level_)  # fmt: skip
            assert not image.color.any()


@pytest.mark.parametrize("lit", [False, True], ids=["dark", "lit"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_faint_bricks_hide_no_more_than_was_allowed(gl, cl, integrator, lit):
    """Random volumes whose bricks differ, transfer functions and cameras; without gloss no colour is above 1."""
    missed = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        dims, spacing = rng.integers(9, 22, 3), rng.uniform(1.0, 2.0, 3)
        strength = rng.choice([0.05, 0.3, 1.0], [-(-n // 5) for n in dims[::-1]]).repeat(5, 0).repeat(5, 1).repeat(5, 2)
        data = (rng.random(dims[::-1]) * strength[: dims[2], : dims[1], : dims[0]]).astype(np.float32)
        volume = Volume(data, centred(dims, spacing))
        places = np.sort(rng.uniform(0.0, 1.0, 3))
        tf = TransferFunction(
            [(0.0, (1, 1, 1), 0.0), *((v, tuple(rng.random(3)), rng.choice([0.01, 0.05, 0.6])) for v in places)]
        )
        eye = 80.0 * np.array([math.cos(seed), math.sin(seed), 0.3])
        camera = Camera(eye=eye.tolist(), target=(0, 0, 0), up=(0, 0, 1), field_of_view=25.0)
        allowed = float(rng.choice([0.005, 0.02, 0.1]))
        scene = {
            "integrator": integrator,
            "step": float(rng.choice([0.5, 2.0])),
            "tolerance": 0.01,
            "order": 2,
            "lit": lit,
        }
        scene |= {"ambient": 0.3, "diffuse": 0.7, "specular": 0.0, "light": Light(), "gradients": "on_the_fly"}
        device = (gl, cl)[seed % 2]
        pictures = [render(device, volume, camera, tf, (16, 12), skip_opacity=x, **scene).color for x in (0.0, allowed)]
        distances = float(np.linalg.norm(volume.corners[7] - volume.corners[0])) / spacing.min()
        apart = float(np.abs(pictures[1] - pictures[0]).max())
        assert apart <= 1.0 - (1.0 - allowed) ** distances + 2e-6
        missed.append(apart)
    assert max(missed) > 1e-3  # something was left out


# -- the early end of rays ----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("lit", [False, True], ids=["dark", "lit"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_a_ray_that_ends_early_errs_by_at_most_what_was_left(cl, integrator, lit):
    """Random volumes, transfer functions and cameras. Without gloss nothing is brighter than its colour, at most 1."""
    ended = []

    @settings(max_examples=6, deadline=None, database=None, derandomize=True)
    @given(
        seed=st.integers(0, 2**31), threshold=st.sampled_from([0.5, 0.8, 0.95, 0.999]),
        step=st.sampled_from([0.3, 1.0, 2.5]), orthographic=st.booleans(),
    )  # fmt: skip
    def check(seed, threshold, step, orthographic):
        rng = np.random.default_rng(seed)
        n = rng.integers(4, 9, 3)
        volume = Volume(
            rng.random(n).astype(np.float32), centred(n[::-1], rng.uniform(1.0, 4.0, 3)), Mapping(3.0, -1.0)
        )
        places = np.sort(rng.uniform(-1.0, 2.0, 4))
        tf = TransferFunction([(v, tuple(rng.random(3)), rng.choice([0.0, 0.3, 0.97])) for v in places])
        away = rng.standard_normal(3)
        eye = 60.0 * away / np.linalg.norm(away)
        camera = Camera(eye=eye.tolist(), target=(0, 0, 0), up=np.roll(eye, 1).tolist(), field_of_view=30.0)
        if orthographic:
            camera = camera.with_(projection="orthographic", height=30.0)
        scene = {"integrator": integrator, "step": step, "order": 2, "tolerance": 0.01, "depth_opacity": 0.3}
        scene |= {"lit": lit, "ambient": 0.2, "diffuse": 0.8, "specular": 0.0, "light": Light()}
        whole = render(cl, volume, camera, tf, size=(16, 12), termination=1.0, **scene)
        ends = render(cl, volume, camera, tf, size=(16, 12), termination=threshold, **scene)
        difference = whole.color - ends.color
        assert difference.max() <= 1.0 - threshold + 2e-6
        assert difference.min() >= -2e-6  # what is behind adds light and takes none
        ended.append(float(difference.max()))

    check()
    assert max(ended) > 1e-3  # some rays did end
