"""Where rays meet a box, on each device."""

import numpy as np
import pytest

from nodegraph.data import Camera, Image, Mesh, TransferFunction, Volume
from nodegraph.data.mesh import box
from nodegraph.errors import PortError
from tests.support.calls import call

CUBE = box(Volume(np.zeros((10, 10, 10), np.uint8)).corners)


def test_a_cube_seen_straight_on(device):
    camera = Camera(eye=(0, -100, 0), target=(0, 0, 0), projection="orthographic", height=20.0)
    interval = call("render.entry_exit_points", device, (20, 20), geometry=CUBE, camera=camera).color
    assert np.allclose(interval[10, 10], [95, 105])
    assert not interval[0, 0].any()
    assert (interval[..., 1] > 0).sum() == 100


def test_a_cube_in_perspective_follows_the_slabs(device):
    camera = Camera(eye=(20, -40, 15), target=(0, 0, 0), field_of_view=30)
    size = (16, 12)
    interval = call("render.entry_exit_points", device, size, geometry=CUBE, camera=camera).color
    for y in range(size[1]):
        for x in range(size[0]):
            origin, direction = camera.ray(size, x, y)
            a, b = (-5 - origin) / direction, (5 - origin) / direction
            entry, exit = np.minimum(a, b).max(), np.maximum(a, b).min()
            expected = (entry, exit) if exit > entry else (0, 0)
            assert interval[y, x] == pytest.approx(expected, abs=2e-4)


def test_inside_the_cube_rays_begin_at_the_eye(device):
    camera = Camera(eye=(0, 0, 0), target=(0, 1, 0))
    interval = call("render.entry_exit_points", device, (5, 5), geometry=CUBE, camera=camera).color
    assert np.allclose(interval[2, 2], [0, 5])


def test_far_from_the_origin_distances_keep_their_digits(device):
    offset = np.array([1e6, -1e6, 1e6])
    far = Mesh(CUBE.vertices + offset, CUBE.triangles)
    camera = Camera(eye=(20, -40, 15), target=(0, 0, 0))
    moved = camera.with_(eye=camera.eye + offset, target=camera.target + offset)
    a = call("render.entry_exit_points", device, (16, 16), geometry=CUBE, camera=camera).color
    b = call("render.entry_exit_points", device, (16, 16), geometry=far, camera=moved).color
    assert np.abs(a - b).max() < 1e-4


def test_a_mesh_that_is_not_convex_is_refused():
    import nodegraph

    dented = np.concatenate([CUBE.vertices, [[0, 0, 0]]])
    triangles = np.concatenate([CUBE.triangles, [[0, 1, 8]]])
    with pytest.raises(PortError, match="convex"):
        nodegraph.run(
            nodegraph.processors.render.EntryExitPoints, geometry=Mesh(dented, triangles), size=(4, 4), device="cl"
        )


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_no_ray_goes_on_behind_an_opaque_picture(device, projection):
    lens = {"height": 24.0} if projection == "orthographic" else {"field_of_view": 15.0}
    camera = Camera(eye=(30, -80, 20), target=(0, 0, 0), projection=projection, **lens)
    size = (24, 18)
    view = {"geometry": CUBE, "camera": camera}
    whole = call("render.entry_exit_points", device, size, **view).color
    color = np.zeros((18, 24, 4), np.float32)
    color[:, :12] = (0.5, 0.4, 0.3, 1.0)
    color[:, 12:14] = (0.5, 0.4, 0.3, 0.99)  # what shines through hides nothing
    depth = np.full((18, 24), np.linalg.norm(camera.eye), np.float32)  # a plane through the middle of the cube
    depth[:7, :10] = np.nan
    cut = call("render.entry_exit_points", device, size, front=Image(color, depth), **view).color
    assert np.array_equal(cut[:, 12:], whole[:, 12:])
    assert np.array_equal(cut[:7, :10], whole[:7, :10])
    for y, x in ((9, 10), (10, 9), (7, 11), (12, 1)):
        _, direction = camera.ray(size, x, y)
        stop = depth[y, x] / (direction @ camera.basis[2])
        entry, exit = whole[y, x]
        expected = (entry, min(exit, stop)) if stop > entry else (0.0, 0.0)
        assert np.allclose(cut[y, x], expected, atol=1e-3), (y, x)
    assert (cut[:, :12, 1] < whole[:, :12, 1]).any()


def test_what_lies_behind_an_opaque_layer_is_not_cast_and_not_missed(device):
    """The picture over the rest is the same with and without the rays behind it; those are transparent then."""
    rng = np.random.default_rng(3)
    volume = Volume(rng.random((10, 10, 10)).astype(np.float32))
    camera = Camera(eye=(30, -80, 20), target=(0, 0, 0), field_of_view=10.0)
    size = (20, 16)
    function = TransferFunction([(0.0, (1, 1, 1), 0.1), (1.0, (0.2, 0.5, 1), 0.3)])
    color = np.zeros((16, 20, 4), np.float32)
    color[:, :10] = (0.1, 0.2, 0.3, 1.0)
    front = Image(color, np.full((16, 20), 60.0, np.float32))  # before the cube

    def cast(**more):
        view = {"geometry": CUBE, "camera": camera}
        interval = call("render.entry_exit_points", device, size, **view, **more)
        return call(
            "render.raycast", device, size, volume=volume, camera=camera, transfer_function=function, interval=interval
        )

    without, behind = cast(), cast(front=front)
    assert without.color[:, :10].any()
    assert not behind.color[:, :10].any()
    composed = [call("image.compose", device, size, front=front, back=back).color for back in (without, behind)]
    assert np.array_equal(*composed)


def test_a_front_of_another_size_is_refused(device):
    front = Image(np.zeros((4, 4, 4), np.float32), np.zeros((4, 4), np.float32))
    with pytest.raises(PortError, match="front: expected 8x8 pixels, got 4x4"):
        call("render.entry_exit_points", device, (8, 8), geometry=CUBE, camera=Camera(eye=(0, -100, 0)), front=front)
