"""What filters and slices make of polynomials, which can be written down, on each device where they run on one."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.data import Plane, TransferFunction, Volume
from nodegraph.data.space import centred, transform_points
from tests.support.calls import call
from tests.support.integrators import rounding

SPACING = np.array([0.5, 1.0, 2.0])
DIMS = (10, 9, 8)
INSIDE = (slice(1, -1),) * 3


def field(f, dims=DIMS, spacing=SPACING, dtype=np.float64):
    """A volume of f(x, y, z) at the world positions of its voxels, and these positions, (z, y, x) each."""
    matrix = centred(dims, spacing)
    z, y, x = np.meshgrid(*(np.arange(n) for n in dims[::-1]), indexing="ij")
    world = transform_points(matrix, np.stack([x, y, z], -1))
    x, y, z = np.moveaxis(world, -1, 0)
    return Volume(f(x, y, z).astype(dtype), matrix), (x, y, z)


def gradient(device, volume, method="central"):
    return call("filter.gradient", device, volume=volume, method=method).data.astype(np.float64)


def close(got, expected, device):
    """Rounding of a difference of values up to the greatest, over the least distance."""
    size = max(1.0, float(np.abs(expected).max()))
    return np.abs(got - expected).max() <= rounding(device, 100.0 * size)


def test_central_differences_are_exact_on_every_quadratic(device):
    """((x + h)^2 - (x - h)^2) / 2 h = 2 x, and mixed terms are linear along each axis. Checks: Orhun 2004, OR-14."""
    volume, (x, y, z) = field(lambda x, y, z: x * x - 2 * y * y + 0.5 * z * z + 3 * x * y - y * z + 0.2 * x * z + x - 4)
    got = gradient(device, volume)[INSIDE]
    exact = np.stack([2 * x + 3 * y + 0.2 * z + 1, -4 * y + 3 * x - z, z - y + 0.2 * x], -1)[INSIDE]
    assert close(got[..., :3], exact, device)
    assert close(got[..., 3], np.linalg.norm(exact, axis=-1), device)


def test_central_differences_err_by_h_squared_on_cubics(device):
    """((x + h)^3 - (x - h)^3) / 2 h = 3 x^2 + h^2: h^2 / 6 times the third derivative, which is 6, for each axis."""
    volume, (x, y, z) = field(lambda x, y, z: x**3 + y**3 + z**3)
    got = gradient(device, volume)[INSIDE]
    exact = np.stack([3 * x * x, 3 * y * y, 3 * z * z], -1)[INSIDE]
    assert close(got[..., :3] - exact, np.broadcast_to(SPACING**2, exact.shape), device)


def test_forward_differences_err_by_half_a_voxel_of_the_second_derivative(device):
    """((x + h)^2 - x^2) / h = 2 x + h."""
    volume, (x, y, z) = field(lambda x, y, z: x * x + y * y + z * z)
    got = gradient(device, volume, "forward")[INSIDE]
    exact = 2 * np.stack([x, y, z], -1)[INSIDE]
    assert close(got[..., :3] - exact, np.broadcast_to(SPACING, exact.shape), device)


def test_sobel_averages_the_derivative_across(device):
    """Of x y^2 the derivative by x is y^2; its mean over y - h, y, y + h and z, with weights 6, 3, 2 in the plane that
    sum to 26, is y^2 + (2 (3 + 2 * 2) / 26) h^2 = y^2 + 7/13 h^2. On x^3 it errs as the central difference does.

    Checks: Orhun 2004, OR-18."""
    volume, (_, y, _) = field(lambda x, y, z: x * y * y)
    got = gradient(device, volume, "sobel")[INSIDE][..., 0]
    assert close(got - (y * y)[INSIDE], np.full(got.shape, 7 / 13 * SPACING[1] ** 2), device)
    volume, (x, _, _) = field(lambda x, y, z: x**3)
    got = gradient(device, volume, "sobel")[INSIDE][..., 0]
    assert close(got - (3 * x * x)[INSIDE], np.full(got.shape, SPACING[0] ** 2), device)


@pytest.mark.parametrize("sigma", [0.6, 1.1, 2.0])
def test_a_gaussian_adds_its_moments_to_polynomials(sigma):
    """G * x^2 = x^2 + sigma^2, G * x^3 = x^3 + 3 sigma^2 x, G * x y = x y, where sigma is that of the weights.

    Weights at whole voxels, cut off at 4 sigma, have a variance that differs from sigma^2: by terms of order
    exp(-2 pi^2 sigma^2 / h^2) for the sampling, and 2 (4 phi(4) + Phi(-4)) = 1.2e-3 for the cut (phi is the density).
    Cut at the next half voxel, up to a whole one nearer: the bound is for 3.5 sigma. Single precision inside.
    """
    spacing = (0.5, 0.5, 0.5)
    volume, (x, y, _) = field(lambda x, y, z: x * x + x * y, (48, 48, 1), spacing)
    got = call("filter.gaussian_blur", volume=volume, sigma=sigma).data
    far = int(np.ceil(4 * sigma / 0.5)) + 1
    inner = (slice(None), slice(far, -far), slice(far, -far))
    cut = 2 * (3.5 * np.exp(-(3.5**2) / 2) / np.sqrt(2 * np.pi) + 2.4e-4)
    sampling = 8 * (np.pi * sigma / 0.5) ** 2 * np.exp(-2 * np.pi**2 * (sigma / 0.5) ** 2)
    bound = sigma**2 * (cut + sampling)
    assert np.abs(got - (x * x + x * y + sigma**2))[inner].max() <= bound + 300 * 2.0**-22
    volume, (x, _, _) = field(lambda x, y, z: x**3, (48, 4, 4), spacing)
    got = call("filter.gaussian_blur", volume=volume, sigma=sigma).data
    inner = (slice(None), slice(None), slice(far, -far))
    error = np.abs(got - (x**3 + 3 * sigma**2 * x))[inner]
    assert error.max() <= 3 * 12.0 * bound + 1800 * 2.0**-22


@pytest.mark.parametrize("normal", [(0, 0, 1), (0.3, -0.5, 0.8), (-0.7, 0.1, -0.4)])
def test_a_slice_of_an_affine_field_is_affine(device, normal):
    """Trilinear interpolation reproduces a + g . p, so a pixel at p = origin + u right + v up shows exactly that, as
    grey of the window or as 1 - exp(-e thickness) of an extinction that is linear in it. Checks: Orhun 2004, OR-10."""
    size, height = (21, 15), 6.0
    weights = np.array([2.0, -1.0, 3.0])
    volume, _ = field(lambda x, y, z: weights[0] * x + weights[1] * y + weights[2] * z + 5.0, (16, 12, 8),
                      (0.9, 1.3, 2.0))  # fmt: skip
    plane = Plane((0.3, -0.2, 0.4), normal)
    right, up = (np.asarray(axis) for axis in plane.axes)
    unit = np.asarray(normal) / np.linalg.norm(normal)
    assert np.allclose([right @ up, right @ unit, up @ unit, right @ right, up @ up], [0, 0, 0, 1, 1])
    y, x = np.mgrid[: size[1], : size[0]] + 0.5
    pixel = height / size[1]
    p = np.array(plane.origin) + ((x - size[0] / 2)[..., None] * right - (y - size[1] / 2)[..., None] * up) * pixel
    value = p @ weights + 5.0
    low, high = -30.0, 40.0
    grey = call("render.slice", device, size, volume=volume, plane=plane, height=height, window=(low, high)).color
    assert np.abs(grey[..., 1] - (value - low) / (high - low)).max() <= rounding(device)
    function = TransferFunction([(low, (1, 0.5, 0.2), 0.0), (high, (1, 0.5, 0.2), 0.9)], reference_length=3.0)
    shown = call(
        "render.slice", device, size, volume=volume, plane=plane, height=height, coloring="transfer_function",
        transfer_function=function,
    ).color  # fmt: skip
    alpha = -np.expm1(np.log(0.1) * (value - low) / (high - low))
    assert np.abs(shown - alpha[..., None] * [1, 0.5, 0.2, 1]).max() <= rounding(device)
