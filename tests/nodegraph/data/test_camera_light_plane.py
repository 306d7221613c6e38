"""What looks, what shines, what cuts."""

import numpy as np
import pytest

from nodegraph.data import Camera, Light, Plane
from nodegraph.data.space import affine, invert, transform_points
from nodegraph.errors import ParameterError


def test_the_basis_is_right_handed_and_looks_at_the_target():
    camera = Camera((10, -20, 30), (1, 2, 3), (0, 0, 1))
    right, up, forward = camera.basis
    assert np.allclose(np.cross(right, up), -forward)
    assert np.allclose(np.array([right, up, forward]) @ np.array([right, up, forward]).T, np.eye(3))
    origin, direction = camera.ray((3, 3), 1, 1)
    distance = np.linalg.norm(np.subtract(camera.target, origin))
    assert np.allclose(origin + distance * direction, camera.target)
    assert up[2] > 0


def test_pixels_go_right_and_down():
    camera = Camera((0, -100, 0), (0, 0, 0), (0, 0, 1), field_of_view=90.0)
    _, middle = camera.ray((200, 100), 99.5, 49.5)
    _, right = camera.ray((200, 100), 199.5, 49.5)
    _, top = camera.ray((200, 100), 99.5, -0.5)
    assert np.allclose(middle, (0, 1, 0))
    assert right[0] > 0.7, "x grows to the right"
    assert np.allclose(top, np.array([0, 1, 1]) / np.sqrt(2)), "row 0 is on top; the field of view is vertical"


def test_orthographic_rays_are_parallel_and_cover_the_height():
    camera = Camera((0, -100, 0), (0, 0, 0), (0, 0, 1), "orthographic", height=50.0)
    low, a = camera.ray((4, 2), 0, 2 - 0.5)
    high, b = camera.ray((4, 2), 0, -0.5)
    assert np.array_equal(a, b)
    assert high[2] - low[2] == pytest.approx(50.0)


def test_rays_in_index_space_meet_the_same_voxels(rng):
    matrix = affine((0.5, 1.0, 2.0), (1e6, -1e6, 5.0))
    camera = Camera((1e6, -1e6 - 300, 10), (1e6, -1e6, 5))
    to_index = invert(matrix)
    here, there = camera.rays((10, 10)), camera.rays((10, 10), to_index)
    world = here["eye"] + 123.0 * here["forward"]
    index = there["eye"] + 123.0 * there["forward"]
    assert np.allclose(transform_points(to_index, world), index, atol=1e-6)


def test_eye_to_world_takes_the_eye_axes_to_the_basis():
    camera = Camera((1, 2, 3), (4, 6, 9), (0, 1, 0))
    matrix = camera.eye_to_world
    assert np.allclose(transform_points(matrix, (0, 0, 0)), camera.eye)
    assert np.allclose(matrix[:3, :3] @ (0, 0, -1), camera.basis[2])
    assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"eye": (0, 0, 0)}, "eye lies at the target"),
        ({"up": (0, 1, 0)}, "up is parallel"),
        ({"up": (0, 0, 0)}, "up is parallel"),
        ({"projection": "fisheye"}, r"camera\.projection: expected one of perspective, orthographic"),
        ({"field_of_view": 180.0}, r"camera\.field_of_view: 180 is outside"),
        ({"height": 0.0}, r"camera\.height"),
        ({"eye": (0, "inf", 0)}, r"camera\.eye\[1\]: expected a finite"),
        ({"eye": (0, 1)}, r"camera\.eye: expected 3 numbers, got 2"),
        ({"height": True}, r"camera\.height: expected a number"),
    ],
)
def test_cameras_that_look_nowhere_are_refused(changes, message):
    with pytest.raises(ParameterError, match=message):
        Camera(**changes)


def test_a_light_on_the_eye_turns_with_it_and_one_in_the_world_does_not():
    front, side = Camera((0, -100, 0)), Camera((100, 0, 0))
    headlight = Light("directional", "eye", (0, 0, 1))
    assert np.array_equal(headlight.in_eye_space(front)["position"], headlight.in_eye_space(side)["position"])
    sun = Light("directional", "world", (0, -2, 0))
    assert np.allclose(sun.in_eye_space(front)["position"], (0, 0, 1)), "from behind the viewer"
    assert np.allclose(sun.in_eye_space(side)["position"], (-1, 0, 0)), "from the viewer's left"
    lamp = Light("point", "world", (0, -90, 0), (1, 0.5, 0), 2.0)
    seen = lamp.in_eye_space(front)
    assert np.allclose(seen["position"], (0, 0, -10)), "10 mm before the eye"
    assert np.allclose(seen["color"], (2, 1, 0))


@pytest.mark.parametrize(
    "arguments",
    [{"type": "area"}, {"frame": "head"}, {"position": (0, 0, 0)}, {"intensity": -1.0}, {"color": (1, 1, -1)}],
)
def test_lights_that_cannot_be_are_refused(arguments):
    with pytest.raises(ParameterError, match="light"):
        Light(**arguments)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 0, -2), (1, 2, 3), (1, 0, 0), (1e-5, 0, 1)])
def test_the_axes_of_a_plane_lie_in_it(normal):
    plane = Plane((1, 2, 3), normal)
    right, up = plane.axes
    frame = np.array([right, up, plane.unit_normal])
    assert np.allclose(frame @ frame.T, np.eye(3))
    assert np.linalg.det(frame) == pytest.approx(1.0)
    with pytest.raises(ParameterError, match=r"plane\.normal"):
        Plane(normal=(0, 0, 0))
