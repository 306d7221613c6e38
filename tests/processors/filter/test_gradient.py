"""Gradient operators on polynomials, on each device. Checks: Orhun 2004, OR-14, OR-15, OR-18."""

import numpy as np
import pytest

from nodegraph.data import Mapping, Volume
from nodegraph.data.space import centred, transform_points
from tests.support.calls import call


def field(f, dims=(9, 8, 7), matrix=None, **kwargs):
    matrix = centred(dims, (0.5, 1.0, 2.0)) if matrix is None else matrix
    z, y, x = np.meshgrid(*(np.arange(n) for n in dims[::-1]), indexing="ij")
    world = transform_points(matrix, np.stack([x, y, z], -1))
    return Volume(f(world).astype(np.float32), matrix, **kwargs), world


@pytest.mark.parametrize("method", ["central", "forward", "sobel"])
def test_affine_fields_are_exact_everywhere(device, method):
    volume, _ = field(lambda p: p @ [3.0, -2.0, 0.5] + 7.0)
    out = call("filter.gradient", device, volume=volume, method=method).data
    expected = [3.0, -2.0, 0.5, np.linalg.norm([3.0, -2.0, 0.5])]
    assert np.abs(out - expected).max() < 2e-5


def test_an_oblique_grid_gives_world_directions(device):
    c, s = np.cos(0.6), np.sin(0.6)
    matrix = np.array([[c, -s, 0, 1], [s, c, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1]]) @ np.diag([0.7, 1.3, 2.0, 1.0])
    volume, _ = field(lambda p: p @ [1.0, 2.0, -1.0], matrix=matrix)
    out = call("filter.gradient", device, volume=volume).data
    assert np.abs(out[..., :3] - [1.0, 2.0, -1.0]).max() < 2e-5


def test_central_differences_are_exact_on_quadratics_inside(device):
    volume, world = field(lambda p: 0.5 * p[..., 0] ** 2 - p[..., 1] * p[..., 1])
    out = call("filter.gradient", device, volume=volume).data[1:-1, 1:-1, 1:-1]
    inner = world[1:-1, 1:-1, 1:-1]
    assert np.abs(out[..., 0] - inner[..., 0]).max() < 2e-4
    assert np.abs(out[..., 1] + 2 * inner[..., 1]).max() < 2e-4


def test_forward_differences_lie_half_a_voxel_off(device):
    volume, world = field(lambda p: 0.5 * p[..., 1] ** 2)
    out = call("filter.gradient", device, volume=volume, method="forward").data
    assert np.abs(out[:, :-1, :, 1] - (world[:, :-1, :, 1] + 0.5)).max() < 1e-4


def test_a_single_slice_has_no_gradient_across(device):
    volume = Volume(np.random.default_rng(3).random((1, 5, 6)).astype(np.float32))
    out = call("filter.gradient", device, volume=volume).data
    assert np.all(out[..., 2] == 0)
    assert np.isfinite(out).all()


def test_real_values_count_and_the_unit_is_per_millimetre(device):
    volume = Volume(np.arange(6, dtype=np.int16)[None, None, :] * np.ones((3, 3, 1), np.int16),
                    mapping=Mapping(10.0, -1024.0, "HU"))  # fmt: skip
    gradient = call("filter.gradient", device, volume=volume)
    assert np.allclose(gradient.data[..., 0], 10.0, atol=1e-4)
    assert gradient.mapping.unit == "HU/mm"
    assert gradient.dtype == (np.float64 if device.name == "cl64" else np.float32)


@pytest.mark.parametrize("scale", [1e-25, 1e30])
def test_the_length_has_the_range_of_the_numbers(device, scale):
    volume, _ = field(lambda p: scale * (p @ [3.0, -2.0, 0.5]))
    out = call("filter.gradient", device, volume=volume).data / scale
    assert np.allclose(out[..., 3], np.linalg.norm([3.0, -2.0, 0.5]), rtol=1e-4)
