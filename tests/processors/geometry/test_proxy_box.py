import numpy as np

from nodegraph.data import Volume
from nodegraph.data.space import affine
from tests.support.calls import call

VOLUME = Volume(np.zeros((4, 6, 8), np.uint8), affine((2.0, 1.0, 0.5), (10.0, 20.0, 30.0)))


def test_the_box_reaches_half_a_voxel_beyond_the_centres():
    mesh = call("geometry.proxy_box", volume=VOLUME)
    assert np.allclose(mesh.vertices.min(axis=0), [9.0, 19.5, 29.75])
    assert np.allclose(mesh.vertices.max(axis=0), [25.0, 25.5, 31.75])
    assert mesh.is_convex()


def test_a_crop_is_in_fractions_along_the_volume_s_axes():
    mesh = call("geometry.proxy_box", volume=VOLUME, crop=((0.25, 0.0, 0.5), (0.5, 1.0, 1.0)))
    assert np.allclose(mesh.vertices.min(axis=0), [13.0, 19.5, 30.75])
    assert np.allclose(mesh.vertices.max(axis=0), [17.0, 25.5, 31.75])


def test_a_mirrored_grid_still_faces_outwards():
    mirrored = Volume(VOLUME.data, np.diag([-1.0, 1.0, 1.0, 1.0]))
    mesh = call("geometry.proxy_box", volume=mirrored)
    planes = mesh.planes()
    middle = mesh.vertices.mean(axis=0)
    assert np.all(planes[:, :3] @ middle + planes[:, 3] < 0)
