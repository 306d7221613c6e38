"""A volume that does not fit, rendered block by block, against the same volume in one piece, on each device.

In single precision the differences are rounding: sums are grouped otherwise, and the direction of a short gradient
has few digits. In double precision there are next to none, which shows that no sample is lost, moved or taken twice.
"""

import numpy as np
import pytest

from nodegraph.compute import blockwise
from nodegraph.data import Camera, Image, TransferFunction, Volume
from nodegraph.data.buffer import Buffer
from nodegraph.data.chunks import ChunkedArray
from nodegraph.data.space import centred
from nodegraph.engine import Engine
from nodegraph.errors import Cancelled, ProcessError
from nodegraph.network import Network
from tests.support.calls import call

pytestmark = pytest.mark.slow

SIZE = (16, 13)
TF = TransferFunction(
    [
        (0.0, (0.1, 0.2, 0.9), 0.0),
        (0.45, (0.9, 0.3, 0.1), 0.0),
        (0.7, (0.2, 0.9, 0.1), 0.2),
        (1.0, (0.9, 0.8, 0.6), 0.5),
    ]
)


def scene(seed):
    """A random volume with empty parts anywhere in the world, sheared at times, and a camera in or before it."""
    rng = np.random.default_rng(seed)
    dims = tuple(int(n) for n in rng.choice([1, 6, 9, 13, 17], 3))
    data = rng.random(dims[::-1]).astype(np.float32)
    # Three of eight octants are empty.
    z, y, x = (n // 2 for n in data.shape)
    for octant in rng.permutation(8)[:3]:
        data[[slice(z), slice(z, None)][octant & 1], [slice(y), slice(y, None)][octant >> 1 & 1],
             [slice(x), slice(x, None)][octant >> 2]] *= 0.3  # fmt: skip
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.5, 2.0, 3)
    if seed % 3 == 0:
        matrix[:3, :3] = np.diag(rng.choice([-1.0, 1.0, 2.0], 3))
    if seed % 4 == 0:
        matrix[0, 1] += 0.5
    volume = Volume(data, matrix)
    size = float(np.linalg.norm(volume.corners[7] - volume.corners[0]))
    away = rng.normal(size=3)
    away *= rng.choice([0.05, 0.6, 3.0]) * size / np.linalg.norm(away)
    camera = Camera(
        volume.centre + away, volume.centre, np.cross(away, rng.normal(size=3)),
        "orthographic" if seed % 2 else "perspective", field_of_view=float(rng.choice([20.0, 60.0])), height=0.7 * size,
    )  # fmt: skip
    return volume, camera


@pytest.fixture
def blocks_of(monkeypatch):
    """Call with a size: from then on every volume is rendered in blocks of that many cells. None: in one piece."""

    def choose(cells):
        monkeypatch.setattr(blockwise, "is_needed", lambda volume, device: cells is not None)
        monkeypatch.setattr(blockwise, "block_size", lambda volume, reach, device: cells)

    return choose


def both(device, blocks_of, volume, camera, cells, **params):
    params = {"lit": False, "termination": 1.0, "volume": volume, "camera": camera, "transfer_function": TF} | params
    pictures = []
    for side in (None, cells):
        blocks_of(side)
        pictures.append(call("render.raycast", device, SIZE, **params))
    return pictures


def depth_difference(a, b):
    """Greatest difference where both see something; pixels where only one does count as inf."""
    seen = np.isfinite(a.depth)
    assert np.array_equal(seen, np.isfinite(b.depth))
    return float(np.abs(a.depth[seen] - b.depth[seen]).max(initial=0.0))


def roundings(device, lit=False):
    """What may differ: colour (absolute) and depth (mm)."""
    return (1e-12, 1e-9) if device.name == "cl64" else (5e-5 if lit else 1e-5, 1e-2)


def compare(device, pictures, lit=False):
    whole, blocks = pictures
    color, depth = roundings(device, lit)
    assert whole.color.max() > 0.05
    assert np.abs(whole.color - blocks.color).max() < color
    assert depth_difference(whole, blocks) < depth


@pytest.mark.parametrize("seed", range(4))
def test_composite_in_blocks_is_the_picture_in_one_piece(device, blocks_of, seed):
    """Eye inside and outside, perspective and orthographic, along the axes and not, sheared, one voxel thin."""
    volume, camera = scene(seed)
    compare(device, both(device, blocks_of, volume, camera, (4, 8)[seed % 2], step=(0.3, 0.8, 1.7)[seed % 3]))


@pytest.mark.parametrize("seed", [1, 2, 3, 8])
def test_rays_that_begin_their_steps_elsewhere_are_cut_there_in_blocks(device, blocks_of, seed):
    volume, camera = scene(seed)
    given = {"integrator": "gauss2" if seed % 2 else "midpoint", "step": 1.5, "quality": "interactive/2"}
    compare(device, both(device, blocks_of, volume, camera, (8, 4)[seed % 2], **given), lit=True)


@pytest.mark.parametrize("step", [0.5, 2.0])
def test_coarse_pictures_of_an_eye_between_blocks(gl, blocks_of, step):
    """Steps do not begin behind it, in a block that would be laid behind its own."""
    volume = Volume(np.random.default_rng(5).random((24, 24, 24)).astype(np.float32), np.eye(4))
    for eye in ((7.95, 12.0, 12.0), (8.05, 12.0, 12.0), (-0.45, 12.0, 12.0)):
        camera = Camera(eye, (20.0, 12.5, 11.0), (0.0, 0.0, 1.0), field_of_view=60.0)
        compare(gl, both(gl, blocks_of, volume, camera, 8, step=step, quality="interactive/4"), lit=True)


@pytest.mark.parametrize(
    "params", [{"lit": True}, {"mode": "maximum"}, {"mode": "iso", "iso_value": 0.6}], ids=["lit", "maximum", "iso"]
)
def test_light_and_other_modes_in_blocks_are_the_picture_in_one_piece(device, blocks_of, params):
    volume, camera = scene(2)
    compare(device, both(device, blocks_of, volume, camera, 8, **params), lit=params.get("lit", True))


@pytest.mark.parametrize("integrator", ["trapezoid", "preintegrated", "gauss3", "adaptive", "cellwise"])
def test_every_integrator_can_be_carried(gl, blocks_of, integrator):
    volume, camera = scene(4)
    compare(gl, both(gl, blocks_of, volume, camera, 8, integrator=integrator), lit=True)


@pytest.mark.parametrize(
    "params",
    [
        {"mode": "first_hit", "lit": True},
        {"lit": True, "gradients": "precomputed"},
        {"skip": False},
        {"skip": False, "mode": "maximum"},
        {"depth_opacity": 0.0},
        {"step": 6.0, "integrator": "trapezoid"},
        {"quality": "interactive/4", "step": 2.0},
    ],
    ids=str,
)
def test_whatever_else_is_set_blocks_change_nothing(gl, blocks_of, params):
    volume, camera = scene(7)
    compare(gl, both(gl, blocks_of, volume, camera, 8, **params), lit=True)


@pytest.mark.parametrize("integrator", ["midpoint", "preintegrated", "gauss2", "adaptive", "cellwise"])
def test_blocks_leave_out_what_is_faint_by_groups_of_eight_voxels(gl, blocks_of, integrator):
    """Of 16 faint voxels before 8 that are not only the first group: the plane at 16 belongs to the second, too."""
    data = np.full((5, 24, 5), 0.2, np.float32)
    data[:, 16:] = 1.0
    tf = TransferFunction([(0.0, (1, 1, 1), 0.0), (0.2, (1, 1, 1), 0.1), (1.0, (1, 1, 1), 0.4)])
    camera = Camera(eye=(0, -50, 0), target=(0, 0, 0), projection="orthographic", height=2.0)
    volume = Volume(data, centred((5, 24, 5), [1.0] * 3))
    blocks_of(8)
    whole, less = (
        call("render.raycast", gl, (3, 3), volume=volume, camera=camera, transfer_function=tf, lit=False,
             step=0.25, termination=1.0, integrator=integrator, skip_opacity=x).color[..., 3]
        for x in (0.0, 0.11)
    )  # fmt: skip
    missing = (np.log1p(-less) - np.log1p(-whole)) / -np.log(0.9)
    assert np.abs(missing - 8.5).max() < 0.25


def test_a_bound_gradient_and_an_interval_are_those_of_the_whole(gl, blocks_of):
    volume, camera = scene(6)
    along = np.stack(np.gradient(volume.data)[::-1], axis=-1).astype(np.float32)
    distance = float(np.linalg.norm(volume.centre - camera.eye))
    interval = Image(np.full((SIZE[1], SIZE[0], 2), (0.9 * distance, 1.1 * distance + 3.0), np.float32))
    given = {"gradient": volume.with_data(along), "interval": interval, "lit": True}
    compare(gl, both(gl, blocks_of, volume, camera, 4, **given), lit=True)


@pytest.mark.parametrize("dtype", ["i2", "u1", "i4", "f8"])
def test_numbers_far_from_0_are_stored_as_those_of_the_whole(gl, blocks_of, dtype):
    volume, camera = scene(1)
    at = {"i2": -30000.0, "u1": 0.0, "i4": 1e9, "f8": 1e9}[dtype]
    scaled = Volume((at + 200.0 * volume.data).astype(dtype), volume.index_to_world)
    keys = [(at + 200.0 * key.value, key.color, key.opacity) for key in TF.keys]
    compare(gl, both(gl, blocks_of, scaled, camera, 4, transfer_function=TransferFunction(keys)))


def test_rays_that_end_early_differ_by_no_more_than_they_leave_out(device, blocks_of):
    volume, camera = scene(4)
    whole, blocks = both(device, blocks_of, volume, camera, 4, termination=0.9)
    assert np.abs(whole.color - blocks.color).max() <= 0.1


def chunked(volume, read):
    """The volume as chunks of 4^3 of a file; ``read`` collects the boxes that were asked for."""

    def fetch(box):
        read.append(tuple((s.start, s.stop) for s in box))
        return volume.data[box]

    array = ChunkedArray(volume.buffer.shape, volume.dtype, (4, 4, 4), fetch, kept_bytes=0)
    return Volume(Buffer.in_chunks(array), volume.index_to_world)


def test_what_cannot_be_seen_is_not_read(gl, blocks_of):
    """A wall, and behind it as much again: blocks without a visible brick, and blocks behind what is opaque."""
    data = np.zeros((5, 120, 5), np.float32)
    data[:, 4:9] = data[:, 40:] = 1.0
    camera = Camera(eye=(0.0, -100.0, 0.0), target=(0.0, 0.0, 0.0), projection="orthographic", height=3.0)
    opaque = TransferFunction([(0.0, (1, 1, 1), 0.0), (0.5, (1, 1, 1), 0.0), (1.0, (1, 1, 1), 0.999999)])
    volume, read = Volume(data), []
    blocks_of(4)
    image = call(
        "render.raycast", gl, (8, 8), volume=chunked(volume, read), camera=camera, transfer_function=opaque, lit=False
    )  # fmt: skip
    assert image.color[..., 3].min() > 0.998
    of_blocks = [box for box in read if box[1] != (0, 120)]  # the ranges of bricks take all of it, once
    planes = {y for box in of_blocks for y in range(*box[1])}
    assert not planes & set(range(19, 31)), "nothing can be seen there"
    assert max(planes) < 80, "all pixels were opaque before that"


def test_a_scene_of_nothing_is_a_picture_of_nothing(gl, blocks_of):
    blocks_of(4)
    for mode in ("composite", "maximum"):
        away = Camera(eye=(0.0, -100.0, 0.0), target=(0.0, -200.0, 0.0))
        image = call("render.raycast", gl, SIZE, volume=Volume(np.ones((5, 5, 5), "f4")), camera=away, mode=mode)
        assert not image.color.any()
        assert np.isinf(image.depth).all()


@pytest.fixture
def network(tmp_path):
    """A file of 2.2 MB and a ray-caster."""
    rng = np.random.default_rng(5)
    data = np.zeros((100, 110, 100), np.int16)
    data[20:40, 30:80, 10:60] = rng.integers(0, 1000, (20, 50, 50))
    data[70:80, 10:30] = 700
    np.save(tmp_path / "v.npy", data)
    made = Network()
    made.add("source.volume", "volume", path=str(tmp_path / "v.npy"))
    function = TransferFunction([(0.0, (1, 1, 1), 0.0), (1000.0, (1, 0.5, 0.2), 0.2)])
    camera = Camera(eye=(90.0, -200.0, 60.0), target=(0, 0, 0), field_of_view=40.0)
    made.add("render.raycast", "raycast", transfer_function=function, camera=camera, termination=1.0)
    made.connect("volume.volume", "raycast.volume")
    return made


@pytest.mark.parametrize("form", ["memory map", "chunks"])
def test_a_small_budget_is_kept_and_shows_the_same_picture(network, tmp_path, form):
    size = (40, 30)
    if form == "chunks":
        import zarr

        zarr.create_array(tmp_path / "v.zarr", data=np.load(tmp_path / "v.npy"), chunks=(16, 16, 16))
        network["volume"].path = str(tmp_path / "v.zarr")
    with Engine("gl", disk=False) as engine:
        whole = engine.evaluate(network, "raycast.image", size=size).values["raycast", "image"].color
    budget, told = 1_200_000, []
    with Engine("gl", disk=False, cache_bytes=budget // 2, device_bytes=budget // 2) as engine:
        memory = []

        def watch(event):
            if event.kind == "progress" and event.path == "raycast":
                told.append(event.fraction)
                memory.append(engine.devices.opened[0].memory.budget.used)

        report = engine.evaluate(network, "raycast.image", size=size, on_event=watch)
        blocks = report.values["raycast", "image"].color
    assert np.abs(whole - blocks).max() < 5e-5
    assert len(told) > 2
    assert told == sorted(told), "one way from 0 to 1, not once for each block"
    assert max(memory) <= budget < 2_200_000


def test_cancel_ends_between_blocks(network):
    with Engine("gl", disk=False, cache_bytes=600_000, device_bytes=600_000) as engine:
        evaluation = engine.submit(
            network, "raycast.image", size=(40, 30),
            on_event=lambda e: evaluation.cancel() if e.kind == "progress" and e.path == "raycast" else None,
        )  # fmt: skip
        with pytest.raises(Cancelled):
            evaluation.result(30).raise_first()
        assert engine.evaluate(network, "raycast.image", size=(40, 30)).ok


def test_a_step_that_reaches_too_far_is_refused_with_the_cure(network):
    network["raycast"].integrator = "trapezoid"
    network["raycast"].step = 1000.0
    with Engine("gl", disk=False, cache_bytes=600_000, device_bytes=600_000) as engine:
        report = engine.evaluate(network, "raycast.image", size=(8, 8))
    with pytest.raises(ProcessError, match="do not fit its memory; raise the budget, or use a shorter step or the"):
        report.raise_first()
