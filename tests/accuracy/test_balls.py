"""Balls: a Gaussian one, whose line integrals are error functions, and a sphere of known depth and normal."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nodegraph.data import Camera, Image, Light, TransferFunction, Volume
from tests.support import closed_forms as forms
from tests.support.calls import call
from tests.support.integrators import cut_error, each, line_error, params, rounding

SIZE = (15, 13)
CAMERA = Camera(eye=(60.0, -150.0, 40.0), target=(1.0, -2.0, 0.5), field_of_view=14.0)
FLAT = CAMERA.with_(projection="orthographic", height=38.0)
WIDTH, CENTRE = 5.0, np.array([1.0, -2.0, 0.5])
VOXELS = 40  # of 1 mm
WHITE = (1.0, 1.0, 1.0)


def grid(n):
    """World coordinates x, y, z of the voxel centres of a cube of n voxels of 1 mm about the origin."""
    at = np.arange(n) - (n - 1) / 2
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    return x, y, z


def gaussian():
    x, y, z = grid(VOXELS)
    r2 = (x - CENTRE[0]) ** 2 + (y - CENTRE[1]) ** 2 + (z - CENTRE[2]) ** 2
    return Volume(np.exp(-r2 / (2 * WIDTH**2)).astype(np.float32))


GAUSSIAN = gaussian()


@each
@pytest.mark.parametrize("cut", [False, True], ids=["whole", "cut behind the middle"])
def test_optical_depth_of_a_gaussian_ball(device, integrator, cut):
    """An X-ray picture: the opacity of composite mode, read as tau = -log(1 - alpha), is e w sqrt(2 pi) exp(-off^2 /
    2 w^2) (Phi(b / w) - Phi(a / w)), between a and b mm of the point that is closest to the middle.

    The bound is that of trilinear interpolation, h^2 / 8 (|f_xx| + |f_yy| + |f_zz|), whose integral along the ray is
    h^2 / 8 sqrt(2 pi) / w exp(-off^2 / 2 w^2) (4 + off^2 / w^2); and the rule's, for a slope that goes from 0 to
    exp(-1/2) / w and back, twice, and as much again at the kinks of the interpolation.
    """
    extinction, step = 0.08, 0.8
    function = TransferFunction([(0.0, WHITE, 0.0), (1.0, WHITE, -math.expm1(-extinction))])
    origins, directions, _ = forms.rays(CAMERA, SIZE)
    along, off = forms.closest(origins, directions, CENTRE)
    entry, exit = forms.box_interval(origins, directions, np.full(3, -20.0), np.full(3, 20.0))
    more = {}
    if cut:
        exit = np.minimum(exit, along + 2.0)
        more["interval"] = Image(np.stack([np.maximum(entry, 0.0), np.maximum(exit, 0.0)], -1).astype(device.real))
    image = call(
        "render.raycast", device, SIZE, volume=GAUSSIAN, camera=CAMERA, transfer_function=function,
        **params(integrator, step, **more),
    )  # fmt: skip
    tau = np.where(exit > entry, forms.gaussian_optical_depth(extinction, WIDTH, off, entry - along, exit - along), 0.0)
    assert tau.max() > 0.6
    q = (off / WIDTH) ** 2
    interpolation = extinction / 8 * math.sqrt(2 * math.pi) / WIDTH * np.exp(-q / 2) * (4 + q)
    steepest = extinction * math.exp(-0.5) / WIDTH
    bound = interpolation + line_error(integrator, step, 8 * steepest) + cut_error(integrator, step, steepest)
    # The half voxel around the outermost centres repeats their values, below 2e-3; intervals are 1e-6 wider.
    bound = bound + extinction * (2e-3 + 4e-4) + rounding(device, 3.0)
    got = -np.log1p(-image.color[..., 3].astype(np.float64))
    assert (np.abs(got - tau) <= bound).all()
    assert np.abs(bound).max() < 0.05 * tau.max()


def test_greatest_value_of_a_gaussian_ball(device):
    """The greatest value of a ray is exp(-off^2 / 2 w^2), where it is closest to the middle. Interpolation takes up to
    h^2 / 8 * 3 / w^2 from it, and the nearest sample, half a step s away, (s / 2)^2 / (2 w^2)."""
    function = TransferFunction([(0.0, (0.0, 0.0, 0.0), 0.5), (1.0, WHITE, 0.5)])
    origins, directions, _ = forms.rays(CAMERA, SIZE)
    along, off = forms.closest(origins, directions, CENTRE)
    entry, exit = forms.box_interval(origins, directions, np.full(3, -20.0), np.full(3, 20.0))
    through = (entry < along) & (along < exit)
    assert through.mean() > 0.8
    expected = np.exp(-(off**2) / (2 * WIDTH**2))
    for step in (0.5, 2.0):
        image = call(
            "render.raycast", device, SIZE, volume=GAUSSIAN, camera=CAMERA, transfer_function=function,
            mode="maximum", step=step,
        )  # fmt: skip
        got, hidden = image.color[through][:, 0] / 0.5, image.color[through][:, 3]
        bound = 3 / (8 * WIDTH**2) + step**2 / (8 * WIDTH**2) + rounding(device)
        assert np.abs(got - expected[through]).max() <= bound
        assert np.abs(hidden - 0.5).max() <= rounding(device)


RADIUS = 14.0


def sphere():
    """The distance to a sphere, positive inside. Seen from its middle it bends across only: |f_xx| + ... = 2 / r."""
    x, y, z = grid(36)
    return Volume((RADIUS - np.sqrt(x * x + y * y + z * z)).astype(np.float32))


SPHERE = sphere()


@pytest.mark.parametrize("mode", ["iso", "first_hit"])
@pytest.mark.parametrize("camera", [CAMERA, FLAT], ids=["perspective", "orthographic"])
def test_depth_of_a_sphere(device, camera, mode):
    """The first root of |o + t d|^2 = R^2, times the cosine to the axis of view. Interpolation moves the surface by at
    most h^2 / 8 * 2 / r, which the slant of the ray stretches by one over the cosine of incidence.

    Checks: Schlosser 2009, T21."""
    camera = camera.with_(target=(0.0, 0.0, 0.0))
    per_value = 0.05
    function = TransferFunction([(0.0, WHITE, 0.0), (10.0, WHITE, -math.expm1(-10 * per_value))])
    image = call(
        "render.raycast", device, SIZE, volume=SPHERE, camera=camera, mode=mode, iso_value=2.0, lit=False, step=0.8,
        hit_extinction=2.0 * per_value, transfer_function=function,
    )  # fmt: skip
    radius = RADIUS - 2.0
    origins, directions, cosine = forms.rays(camera, SIZE)
    entry = forms.ball_entry(origins, directions, (0, 0, 0), radius)
    normal = (origins + directions * entry[..., None]) / radius
    incidence = -(normal * directions).sum(axis=-1)
    sure = incidence > 0.3
    assert 0.2 < sure.mean() < 0.9
    moved = 2 / (8 * (radius - 1.0))
    # Ten halvings of a step, and a straight line in what is left.
    bound = (moved / np.where(sure, incidence, 1.0) + 0.8 / 1024) * cosine + rounding(device, 200.0)
    with np.errstate(invalid="ignore"):
        assert (np.abs(image.depth - entry * cosine) <= bound)[sure].all()
    _, off = forms.closest(origins, directions, (0, 0, 0))
    assert np.isinf(image.depth[off > radius + moved]).all()
    assert np.isfinite(image.depth[off < radius - 2 * moved]).all()


@pytest.mark.parametrize("camera", [CAMERA, FLAT], ids=["perspective", "orthographic"])
def test_normal_of_a_sphere_from_three_lamps(device, camera):
    """Under lamps l_1, l_2, l_3 a matt white surface shows l_i . n; the three pictures together are L n, so n = L^-1 I.

    Central differences over h of f = R - r err by h^2 / 6 f_iii (|f_iii| <= 1.16 / r^2), and the interpolation by
    h^2 / 8 of the change of (f_xx, f_yy, f_zz), at most 3.5 / r^2: sqrt(3) (1.16 / 6 + 3.5 / 8) h^2 / r^2 in all. The
    point itself is off by h^2 / (4 r cosine) at most, across the normal by its share of sine, over r.
    """
    camera = camera.with_(target=(0.0, 0.0, 0.0))
    lamps = np.array([[0.6, 0.0, 1.0], [-0.3, 0.5, 1.0], [-0.3, -0.5, 1.0]])
    lamps /= np.linalg.norm(lamps, axis=1, keepdims=True)
    shown = [
        call(
            "render.raycast", device, SIZE, volume=SPHERE, camera=camera, mode="iso", iso_value=2.0, step=0.5, lit=True,
            light=Light("directional", "eye", tuple(lamp)), iso_color=WHITE, ambient=0.0, diffuse=1.0, specular=0.0,
        ).color[..., 0]
        for lamp in lamps
    ]  # fmt: skip
    radius = RADIUS - 2.0
    origins, directions, _ = forms.rays(camera, SIZE)
    entry = forms.ball_entry(origins, directions, (0, 0, 0), radius)
    normal = (origins + directions * entry[..., None]) / radius
    right, up, forward = forms.axes(camera)
    expected = np.stack([normal @ right, normal @ up, -(normal @ forward)], axis=-1)
    incidence = -(normal * directions).sum(axis=-1)
    sure = (incidence > 0.4) & ((expected @ lamps.T) > 0.1).all(axis=-1)
    assert sure.mean() > 0.15
    got = np.stack(shown, axis=-1).astype(np.float64) @ np.linalg.inv(lamps).T
    slant = np.sqrt(1 - np.minimum(incidence, 1.0) ** 2) / np.where(sure, incidence, 1.0)
    bound = math.sqrt(3) * (1.16 / 6 + 3.5 / 8) / (radius - 1) ** 2 + slant / (4 * radius**2) + rounding(device, 30.0)
    assert (np.linalg.norm(got - expected, axis=-1) <= bound)[sure].all()
    assert np.abs(np.linalg.norm(got, axis=-1) - 1)[sure].max() <= rounding(device, 30.0)
