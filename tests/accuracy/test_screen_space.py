"""Shades made of depth alone, at step edges, corners and grooves, on each device."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.data import Camera, Image
from tests.support import closed_forms as forms
from tests.support.calls import call
from tests.support.integrators import rounding

LOW = (48, 24)
FLAT = Camera(projection="orthographic", height=24.0)  # of LOW, a millimetre per pixel


def white(depth, device):
    """A white picture of a depth, mm."""
    return Image(np.ones((*depth.shape, 4), device.real), np.asarray(depth, device.real))


def darkened(device, depth, jump):
    """G * D - D of a depth, read from the darkening of white: share = (D - G * D) / range, at full strength."""
    out = call(
        "image.depth_darkening", device, image=white(depth, device), sigma=10.0, range=4 * jump, strength=1.0
    ).color  # 10 % of 40 pixels: sigma 4
    return (out[..., 0].astype(np.float64) - 1) * 4 * jump


def test_depth_darkening_of_a_step_edge(device):
    """A Gaussian blur of a step is the normal distribution, so behind the edge the difference is -jump (1 - Phi(x /
    sigma)), and above zero before it, where nothing is darkened. Values for a jump of 0.6 and sigma 4: at 0+, 1,
    2 and 4 pixels -0.3000, -0.2408, -0.1851, -0.0952; pixel centres lie between those.

    The sum over pixels differs from the integral by the cut of the Gaussian at 3 sigma, 1 - 2 Phi(-3), by which it is
    normalised, and by 1 / (24 sigma^2) of the change per pixel. Checks: Lindemann 2014, T42.
    """
    assert np.allclose(forms.step_edge_blur([0, 1, 2, 4], 0.6, 4.0), [-0.3, -0.2408, -0.1851, -0.0952], atol=5e-5)
    depth = np.full((40, 48), 0.2)
    depth[:, 24:] = 0.8
    got = darkened(device, depth, 0.6)
    x = np.arange(24) + 0.5
    bound = 0.6 * (2 * float(forms.phi(-3.0)) + 1 / (24 * 16)) + rounding(device)
    assert np.abs(got[:, 24:] - forms.step_edge_blur(x, 0.6, 4.0))[:, :12].max() <= bound
    assert np.abs(got[:, :24]).max() <= rounding(device)
    assert got[20, 24] < -0.25


def test_depth_darkening_of_a_corner(device):
    """Within a quarter of the picture that lies deeper the share of the Gaussian is a product of two distributions."""
    depth = np.full((40, 48), 100.0)
    depth[20:, 24:] += 8.0
    got = darkened(device, depth, 8.0)
    x, y = np.arange(10) + 0.5, np.arange(8)[:, None] + 0.5
    bound = 8.0 * 2 * (2 * float(forms.phi(-3.0)) + 1 / (24 * 16)) + rounding(device, 100.0)
    assert np.abs(got[20:28, 24:34] - forms.corner_blur(x, y, 8.0, 4.0)).max() <= bound


@pytest.mark.parametrize("method", ["hemisphere", "sphere"])
@pytest.mark.parametrize(
    ("jump", "thickness"), [(3.0, 50.0), (8.0, 50.0), (30.0, 50.0), (12.0, 7.0)],
    ids=["low step", "step of the radius", "high step", "thin step"],
)  # fmt: skip
def test_ambient_occlusion_of_a_step_edge(device, method, jump, thickness):
    """Hidden is what of the half ball before a point lies beyond the edge, at its depth: an integral of segments of
    discs; for a step higher than the radius half a cap, (1 - q)^2 (2 + q) / 4 with q = x / R. Of the whole ball as much
    more is hidden than the half that a plane hides, so both methods agree.

    The edge lies between pixels. What is left is the sum over columns in place of the integral over a disc of area pi
    R^2 pixels: at most the columns on its rim, 2 pi R, each of a chord below sqrt(2 R), over the half ball, 2/3 pi R^3;
    they balance like 2 pi R numbers of either sign, so sqrt(2 pi R). Checks: Lindemann 2014, T43.
    """
    radius = 8.0
    depth = np.full((LOW[1], LOW[0]), 500.0)
    depth[:, 24:] += jump
    got = call(
        "image.ssao", device, image=white(depth, device), camera=FLAT, radius=radius, thickness=thickness,
        method=method, sampling="every_pixel",
    ).occlusion.color[..., 0]  # fmt: skip
    x = np.arange(24) + 0.5
    expected = forms.step_edge_occlusion(x, jump, radius, thickness)
    if jump > radius and thickness > jump:
        assert np.allclose(expected, forms.cap_share(x, radius) / 2, atol=1e-4)
    bound = np.sqrt(2 * np.pi * radius) * np.sqrt(2 * radius) / (2 / 3 * np.pi * radius**3) / 2
    if method == "sphere" and jump + radius > thickness:
        # Behind the thin plate there is light again: less than half the ball may be hidden.
        beyond = _seen_beyond(x, jump, radius, thickness)
        expected = np.maximum(expected - beyond, 0.0)
    assert bound < 0.02
    assert np.abs(got[8:16, 24:] - expected).max() <= bound
    assert got[:, :24].max() <= rounding(device)
    assert (expected.max() > 0.01) == (thickness > jump or method == "hemisphere")


def _seen_beyond(x, jump, radius, thickness):
    """Share of the far half of the ball, beyond the edge, that lies more than ``thickness`` behind the nearer plane."""
    # The far half ball mirrored is the near one: what a plate reaching from 0 to its back edge leaves of half a cap.
    back = max(thickness - jump, 0.0)
    hidden = forms.step_edge_occlusion(x, back, radius, 1e9) if back > 0 else 0.0
    return forms.cap_share(x, radius) / 2 - hidden


@pytest.mark.parametrize("camera", [FLAT, Camera(eye=(0, -90, 0), field_of_view=15.0)], ids=["parallel", "central"])
def test_ambient_occlusion_in_a_groove(device, camera):
    """Two planes that meet at a right angle, open towards the viewer. At distance s from the bottom, along the own
    plane, the other plane cuts off a cap of the ball at distance s, and half of that is before the own plane:
    (1 - q)^2 (2 + q) / 4 with q = s / R, in parallel and in central projection. Checks: Lindemann 2014, T43.
    """
    radius, bottom = 9.0, 90.0
    across, _ = forms.film(camera, LOW)
    # Planes x = -+(bottom - depth): 45 degrees to either side. Central: x = across * depth.
    depth = bottom - np.abs(across) if camera.projection == "orthographic" else bottom / (1 + np.abs(across))
    got = call(
        "image.ssao", device, image=white(depth, device), camera=camera, radius=radius, thickness=100.0,
        sampling="every_pixel",
    ).occlusion.color[..., 0]  # fmt: skip
    along = (bottom - depth) * np.sqrt(2)
    expected = forms.cap_share(along, radius) / 2
    # Columns are a pixel wide and the surface falls by as much across them: half a pixel of s, where the share changes
    # by at most 3 / (4 R) per mm.
    bound = 0.5 * np.sqrt(2) * 0.75 / radius
    middle = got[8:16, 12:36]
    assert np.abs(middle - expected[8:16, 12:36]).max() <= bound
    assert abs(float((middle - expected[8:16, 12:36]).mean())) <= 0.01
    assert middle.max() > 0.4


def test_ambient_occlusion_in_a_groove_beside_the_axis(device):
    """The same groove near the eye and aside of the axis of a wide view, where rays spread by a sixth within the ball:
    parts of a ball do not depend on who looks, as long as each ray counts with its solid angle and its distance."""
    size, radius = (64, 40), 9.0
    camera = Camera(eye=(0, -36, 0), field_of_view=60.0)
    across, upwards = forms.film(camera, size)
    towards = np.stack([across, upwards, -np.ones(across.shape)], axis=-1)  # eye space, one mm deep
    bottom = np.array([0.35, 0.0, -1.0]) * 36.0
    open_way = -bottom / np.linalg.norm(bottom)
    aside = np.array([-open_way[2], 0.0, open_way[0]])
    normals = (open_way + aside) / np.sqrt(2), (open_way - aside) / np.sqrt(2)
    depth = np.min([(n @ bottom) / (towards @ n) for n in normals], axis=0)
    got = call(
        "image.ssao", device, image=white(depth, device), camera=camera, radius=radius, thickness=100.0,
        sampling="every_pixel",
    ).occlusion.color[..., 0]  # fmt: skip
    from_bottom = towards * depth[..., None] - bottom
    along = np.abs(from_bottom @ aside) * np.sqrt(2)
    expected = forms.cap_share(along, radius) / 2
    pixel = (across[0, 1] - across[0, 0]) * 36.0
    inner = (slice(16, 24), slice(34, 52))
    assert (along[inner] < radius).mean() > 0.5
    # Half a pixel of s at most, as above, and in the mean a tenth of it.
    bound = 0.5 * np.sqrt(2) * pixel * 0.75 / radius
    assert np.abs(got - expected)[inner].max() <= bound
    assert abs(float((got - expected)[inner].mean())) <= 0.1 * bound
