"""The laws of screen-space ambient occlusion, on each device. Its closed forms: tests/accuracy/test_screen_space.py."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph.data import Camera, Image
from nodegraph.errors import PortError
from tests.support.calls import call
from tests.support.closed_forms import plane_depth, step_edge_occlusion

SIZE = (40, 32)
FLAT = Camera(projection="orthographic", height=32.0)  # a millimetre per pixel
WIDE = Camera(field_of_view=50.0)


def picture(depth, color=(1.0, 1.0, 1.0, 1.0)):
    h, w = depth.shape
    return Image(np.broadcast_to(np.float32(color), (h, w, 4)).copy(), depth)


def edge(jump, size=SIZE, at=None):
    """Near on the left, ``jump`` mm deeper on the right of column ``at``."""
    depth = np.full((size[1], size[0]), 500.0, np.float32)
    depth[:, size[0] // 2 if at is None else at :] += jump
    return depth


def occlusion(device, image, camera=FLAT, **params):
    return call("image.ssao", device, image=image, camera=camera, **params).occlusion.color[..., 0]


@pytest.mark.parametrize("sampling", ["hashed", "every_pixel"])
@pytest.mark.parametrize("camera", [FLAT, WIDE], ids=["orthographic", "perspective"])
def test_a_plane_is_open_however_it_lies(device, camera, sampling):
    """The half ball before a plane holds nothing. Checks: Lindemann 2014, T43."""
    for normal in ((0.0, 0.0, 1.0), (0.5, -0.2, 0.8), (-0.3, 0.4, 0.87)):
        image = picture(plane_depth(camera, SIZE, normal, 300.0).astype(np.float32))
        assert image.depth.min() > 50
        # Normals come from differences of depths that single precision holds to 2e-5 mm, over 0.2 to 2 mm.
        assert occlusion(device, image, camera, sampling=sampling).max() < 1e-3


def test_the_whole_ball_forgives_a_plane_as_well(device):
    """Rays in opposite pairs hide one whole chord between the two of them."""
    image = picture(plane_depth(FLAT, SIZE, (0.3, -0.4, 0.87), 300.0).astype(np.float32))
    for sampling in ("hashed", "every_pixel"):
        assert occlusion(device, image, method="sphere", sampling=sampling, thickness=50.0).max() < 1e-4


def test_a_distant_thing_in_front_casts_no_halo(device):
    """What lies more than radius + thickness before a plane cannot reach into the ball of its points."""
    near = occlusion(device, picture(edge(25.0)), radius=8.0, thickness=20.0)
    far = occlusion(device, picture(edge(29.0)), radius=8.0, thickness=20.0)
    assert near.max() > 0.05
    assert far.max() == 0.0


def test_the_empty_neither_hides_nor_takes_shade(device):
    """Checks: Lindemann 2014, T43, background."""
    depth = np.full((32, 40), np.inf, np.float32)
    depth[:, 20:] = 500.0
    depth[5, 30] = np.nan
    image = picture(depth, (0.2, 0.4, 0.6, 0.8))
    out = call("image.ssao", device, image=image, camera=FLAT)
    assert out.occlusion.color.max() == 0.0
    assert np.array_equal(out.shaded.color, image.color)


def test_the_shade_is_physical(device):
    """Twice the pixels, or a scene and a radius of other units, show the same shade."""
    coarse = occlusion(device, picture(edge(6.0)), radius=8.0, sampling="every_pixel")
    fine = occlusion(device, picture(edge(6.0, (80, 64))), radius=8.0, sampling="every_pixel")
    middle = (fine[::2, ::2] + fine[1::2, ::2] + fine[::2, 1::2] + fine[1::2, 1::2]) / 4
    assert np.abs(middle - coarse).max() < 0.01
    scaled = occlusion(
        device, picture(edge(6.0) * np.float32(0.25)), FLAT.with_(height=8.0), radius=2.0, thickness=5.0,
        sampling="every_pixel",
    )  # fmt: skip
    assert np.abs(scaled - coarse).max() < 1e-5


def test_more_samples_come_closer_to_every_pixel(device):
    """The spread of a spiral of n points about the exact share falls about as n^(-3/4); as a mean there is no bias."""
    image = picture(edge(6.0))
    exact = occlusion(device, image, sampling="every_pixel")
    errors = [occlusion(device, image, samples=n) - exact for n in (16, 64, 256, 1024)]
    spread = [float(np.sqrt((e * e).mean())) for e in errors]
    assert spread == sorted(spread, reverse=True)
    assert spread[1] < 0.02
    assert spread[3] < 0.25 * spread[1]
    assert abs(float(errors[3].mean())) < 1e-3


def test_the_same_pixels_are_looked_at_on_every_device_and_in_every_run(gl, cl, cl64):
    image = picture(edge(6.0))
    first = occlusion(gl, image)
    assert np.array_equal(first, occlusion(gl, image))
    for other in (cl, cl64):
        # A point that falls between two pixels may go to either: one in 64 of the sum.
        error = np.abs(first - occlusion(other, image))
        assert np.percentile(error, 98) < 1e-5
        assert error.max() < 0.05


def test_strength_scales_the_loss_and_alpha_stays(device):
    image = picture(edge(6.0), (0.2, 0.3, 0.4, 0.5))
    out = call("image.ssao", device, image=image, camera=FLAT, strength=0.5, bleed=0.0)
    expected = image.color[..., :3] * (1 - 0.5 * out.occlusion.color)
    assert out.occlusion.color.max() > 0.2
    assert np.abs(out.shaded.color[..., :3] - expected).max() < 1e-6
    assert np.array_equal(out.shaded.color[..., 3], image.color[..., 3])
    assert out.shaded.depth is image.depth


def test_the_occluder_lends_its_colour(device):
    """Only a red wall hides points of the white floor: what comes back is red. Grey stays grey."""
    image = picture(edge(6.0))
    color = image.color.copy()
    color[:, :20, 1:3] = 0.0
    params = {"camera": FLAT, "strength": 1.0, "bleed": 0.5, "sampling": "every_pixel"}
    out = call("image.ssao", device, image=Image(color, image.depth), **params)
    floor, share = out.shaded.color[:, 20:], out.occlusion.color[:, 20:, 0]
    assert np.abs(floor[..., 0] - (1 - 0.5 * share)).max() < 1e-6
    assert np.abs(floor[..., 1] - (1 - share)).max() < 1e-6
    grey = call("image.ssao", device, image=picture(edge(6.0), (0.5, 0.5, 0.5, 1.0)), **params).shaded.color
    assert np.array_equal(grey[..., 0], grey[..., 2])
    assert np.abs(grey[:, 20:, 0] - 0.5 * (1 - 0.5 * share)).max() < 1e-6


def test_a_radius_below_a_pixel_changes_nothing_and_one_beyond_the_picture_is_fine(device):
    image = picture(edge(6.0))
    assert occlusion(device, image, radius=0.01).max() == 0.0
    huge = occlusion(device, image, radius=1e4)
    assert np.isfinite(huge).all()
    inside = occlusion(device, picture(edge(6.0) - 490.0), WIDE, radius=50.0)  # the eye is in the ball
    assert np.isfinite(inside).all()
    assert inside.max() <= 1.0


def test_a_single_pixel_and_one_row(device):
    assert occlusion(device, picture(np.full((1, 1), 5.0, np.float32))).item() == 0.0
    row = occlusion(device, picture(edge(6.0)[:1]), FLAT.with_(height=1.0), sampling="every_pixel", radius=8.0)
    # Of a row of rays, all through the middle of the ball: chords beyond the edge, instead of caps.
    assert row[0, :20].max() == 0.0
    assert row[0, 20] > row[0, 24] > 0.0


def test_a_picture_without_depth_is_refused():
    from nodegraph import registry

    port = registry.find("image.ssao").inputs["image"]
    with pytest.raises(PortError, match="depth"):
        port.check(Image(np.ones((4, 4, 4), np.float32)), "image")


def test_the_share_beside_an_edge(gl):
    """See tests/accuracy for all of it; here that the default settings stay within the noise of 64 samples."""
    got = occlusion(gl, picture(edge(12.0)), radius=10.0, thickness=30.0)[8:24, 20:].mean(axis=0)
    assert np.abs(got - step_edge_occlusion(np.arange(20) + 0.5, 12.0, 10.0, 30.0)).max() < 0.02
