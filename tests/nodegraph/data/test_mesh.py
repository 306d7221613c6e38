"""Meshes: their planes, whether they are closed and convex."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from nodegraph.data import Mesh, Volume
from nodegraph.data.mesh import BOX_TRIANGLES, box
from nodegraph.data.space import affine
from nodegraph.errors import PortError

CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float)


def hull(points):
    """The convex hull of points, facing outwards."""
    found = ConvexHull(points)
    triangles = found.simplices.copy()
    for triangle, equation in zip(triangles, found.equations, strict=True):
        a, b, c = points[triangle]
        if np.cross(b - a, c - a) @ equation[:3] < 0:
            triangle[:] = triangle[::-1]
    return Mesh(points, triangles)


@pytest.mark.parametrize("offset", [0.0, 1e6])
def test_a_box_has_six_planes_and_is_convex(rng, offset):
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    mesh = box(CORNERS * [1.0, 20.0, 300.0] @ q.T + offset)
    planes = mesh.planes()
    assert planes.shape == (6, 4)
    assert np.allclose(np.linalg.norm(planes[:, :3], axis=1), 1.0)
    centre = mesh.vertices.mean(axis=0)
    assert (planes[:, :3] @ centre + planes[:, 3] < 0).all(), "facing outwards, whatever the handedness"
    assert mesh.is_closed()
    assert mesh.is_convex()


def test_points_inside_all_planes_are_the_points_inside(rng):
    mesh = hull(rng.normal(size=(40, 3)))
    assert mesh.is_convex()
    planes = mesh.planes()
    points = rng.normal(size=(500, 3))
    inside = (points @ planes[:, :3].T + planes[:, 3] <= 0).all(axis=1)
    equations = ConvexHull(mesh.vertices).equations
    assert np.array_equal(inside, (points @ equations[:, :3].T + equations[:, 3] <= 0).all(axis=1))
    assert inside.any()
    assert not inside.all()


def test_a_dent_makes_it_concave():
    vertices = np.vstack([CORNERS, [[0.5, 0.5, 0.8]]])
    top = [[4, 5, 6], [5, 7, 6]]
    sides = [t for t in BOX_TRIANGLES.tolist() if t not in top]
    dented = Mesh(vertices, [*sides, [4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]])
    assert dented.is_closed()
    assert not dented.is_convex()


def test_inside_out_is_not_convex():
    assert not Mesh(CORNERS, BOX_TRIANGLES[:, ::-1]).is_convex()


def test_an_open_mesh_is_not_the_intersection_of_its_planes():
    assert not Mesh(CORNERS, BOX_TRIANGLES[:-1]).is_convex()
    assert not Mesh(CORNERS[:3], [[0, 1, 2]]).is_convex()
    assert not Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)).is_convex()
    assert not Mesh(np.zeros((8, 3)), BOX_TRIANGLES).is_convex(), "a box without any size"


def test_vertices_at_one_place_count_as_one():
    apart = CORNERS[BOX_TRIANGLES.reshape(-1)]
    mesh = Mesh(apart, np.arange(36).reshape(12, 3))
    assert mesh.is_closed()
    assert mesh.is_convex()


def test_the_box_of_a_thin_volume_is_convex():
    corners = Volume(np.zeros((1, 1, 1), np.uint8), affine((1e-3, 1.0, 1000.0), (1e6, 0, 0))).corners
    mesh = box(corners)
    assert mesh.is_convex()
    assert len(mesh.planes()) == 6


def test_many_faces_are_not_compared_one_by_one_in_python(rng):
    points = rng.normal(size=(500, 3))
    mesh = hull(points / np.linalg.norm(points, axis=1)[:, None])
    assert len(mesh.planes()) == len(mesh.triangles)
    assert mesh.is_convex()


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        ([[0, 0]], [[0, 0, 0]], "vertices"),
        ([[0, 0, np.nan]], [[0, 0, 0]], "finite"),
        ([[0, 0, 0]], [[0, 0]], "triangles"),
        ([[0, 0, 0]], [[0, 0, 1]], "index 1 is outside 0..0"),
        ([[0, 0, 0]], [[0, 0, -1]], "from -1"),
        ([[0, 0, 0]], [[0.0, 0.0, 0.5]], "indices"),
    ],
)
def test_what_is_no_mesh_is_refused(vertices, triangles, message):
    with pytest.raises(PortError, match=message):
        Mesh(vertices, triangles)
