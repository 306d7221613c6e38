"""Where rays meet a box, on each device."""

import numpy as np
import pytest

from nodegraph.data import Camera, Mesh, Volume
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
