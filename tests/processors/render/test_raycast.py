"""The ray-caster against closed forms, against numpy, and against its own laws, on each device."""

import numpy as np
import pytest

from nodegraph.data import Camera, Light, Mapping, TransferFunction, Volume
from nodegraph.data.space import affine, centred
from tests.support import raycast_twin as twin
from tests.support.calls import call

SIZE = (24, 20)
RAMP = TransferFunction([(0.0, (0.1, 0.2, 0.9), 0.0), (0.3, (0.9, 0.3, 0.1), 0.0), (1.0, (0.9, 0.8, 0.6), 0.4)])


def render(device, volume, camera, tf=RAMP, size=SIZE, **params):
    params = {"lit": False, "termination": 1.0} | params
    return call("render.raycast", device, size, volume=volume, camera=camera, transfer_function=tf, **params)


def blob(n=24, spacing=1.0, center=(0.0, 0.0, 0.0), width=0.18, dtype=np.float32):
    """A band-limited ball: exp(-r^2 / 2 w^2) in a cube of 48 mm, sampled at n^3 voxels."""
    at = ((np.arange(n) + 0.5) / n - 0.5) * 48.0
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    r2 = (x - center[0]) ** 2 + (y - center[1]) ** 2 + 1.7 * (z - center[2]) ** 2
    data = np.exp(-r2 / (2 * (48.0 * width) ** 2)).astype(dtype)
    return Volume(data, centred((n, n, n), [48.0 / n * spacing] * 3))


def rotation(angles):
    matrix = np.eye(4)
    for axis, angle in enumerate(angles):
        c, s = np.cos(angle), np.sin(angle)
        turn = np.eye(4)
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        turn[i, i], turn[i, j], turn[j, i], turn[j, j] = c, -s, s, c
        matrix = turn @ matrix
    return matrix


CAMERA = Camera(eye=(30.0, -150.0, 40.0), target=(0, 0, 0), field_of_view=24.0)
FLAT = Camera(eye=(0.0, -150.0, 0.0), target=(0, 0, 0), projection="orthographic", height=40.0)


def test_homogeneous_slab_is_one_minus_exp_of_minus_tau(device):
    """Checks: Rezk-Salama 2001, R01: a constant extinction over 10 mm, whatever the step."""
    volume = Volume(np.ones((10, 10, 10), np.float32))
    tf = TransferFunction([(0.0, (1.0, 0.5, 0.25), 0.0), (1.0, (1.0, 0.5, 0.25), 0.2)])
    expected = 1 - np.exp(np.log(1 - 0.2) * 10.0)
    camera = FLAT.with_(height=8.0)
    for step in (0.1, 0.37, 1.0, 7.0):
        color = render(device, volume, camera, tf, step=step).color
        assert np.abs(color[..., 3] - expected).max() < 2e-6
        assert np.abs(color[..., :3] - expected * np.array([1.0, 0.5, 0.25])).max() < 2e-6


def test_two_slabs_hide_each_other_in_order(device):
    """Emission and absorption do not commute: seen from the other side, the other colour wins."""
    data = np.zeros((4, 8, 4), np.float32)
    data[:, :4] = 1.0
    data[:, 4:] = 3.0
    volume = Volume(data)
    keys = [(0, (1, 0, 0), 0.3), (2, (1, 0, 0), 0.3), (2, (0, 0, 1), 0.5), (4, (0, 0, 1), 0.5)]
    tf = TransferFunction(keys)
    red, blue = 1 - 0.7**4, 1 - 0.5**4
    for eye, front, back, r, b in ((-150, red, blue, 0, 2), (150, blue, red, 2, 0)):
        camera = FLAT.with_(eye=(0.0, eye, 0.0), height=3.0)
        color = render(device, volume, camera, tf, size=(5, 5), step=0.01).color[2, 2]
        assert color[r] == pytest.approx(front, abs=4e-3)
        assert color[b] == pytest.approx((1 - front) * back, abs=4e-3)
        assert color[3] == pytest.approx(1 - (1 - red) * (1 - blue), abs=1e-3)


@pytest.mark.parametrize("camera", [CAMERA, FLAT], ids=["perspective", "orthographic"])
def test_composite_equals_the_numpy_ray_caster(device, camera, rng):
    data = rng.random((9, 11, 13)).astype(np.float32)
    volume = Volume(data, rotation((0.3, -0.2, 0.5)) @ centred((13, 11, 9), (1.5, 2.0, 2.5)))
    expected, depth = twin.composite(volume, RAMP, camera, SIZE, 0.5 * 1.5)
    image = render(device, volume, camera, step=0.5)
    # The kernel classifies by a table: the difference left is the table's, at the key inside the ramp.
    assert np.abs(image.color - expected).max() < 3e-4
    both = np.isfinite(depth) & np.isfinite(image.depth)
    assert np.mean(np.isfinite(depth) != np.isfinite(image.depth)) < 0.01
    assert np.median(np.abs(image.depth[both] - depth[both])) < 1e-2


@pytest.mark.parametrize("camera", [CAMERA, FLAT], ids=["perspective", "orthographic"])
@pytest.mark.parametrize("light", [Light(), Light("point", "world", (20, -60, 40))], ids=["directional", "point"])
@pytest.mark.parametrize("specular", [0.3, 0.0])
@pytest.mark.parametrize("gradients", ["on_the_fly", "precomputed"])
def test_phong_equals_the_numpy_ray_caster(device, camera, light, specular, gradients):
    volume = blob(16)
    phong = {"ambient": 0.2, "diffuse": 0.7, "specular": specular, "shininess": 12.0}
    shade = twin.phong(volume, camera, light, **phong)
    expected, _ = twin.composite(volume, RAMP, camera, SIZE, 1.5, shade)
    image = render(device, volume, camera, step=0.5, lit=True, light=light, gradients=gradients, **phong)
    assert np.abs(image.color - expected).max() < 2e-3
    assert np.abs(image.color - expected).mean() < 5e-5


def test_maximum_equals_the_numpy_ray_caster_and_the_gaussian(device):
    volume = blob(32)
    best = twin.maximum(volume, CAMERA, SIZE, 0.75)
    tf = TransferFunction([(0.0, (0.0, 0.0, 0.0), 0.5), (1.0, (1.0, 1.0, 1.0), 0.5)])
    image = render(device, volume, CAMERA, tf, mode="maximum", step=0.5)
    shown = np.where(np.isfinite(best), best, 0.0) * 0.5
    assert np.abs(image.color[..., 0] - shown).max() < 1e-5
    assert np.all((image.color[..., 3] == 0) == ~np.isfinite(best))


def test_iso_surface_of_a_ball_lies_where_it_should(device):
    """Sphere: depth from the closed form; the field is its distance, so interpolation is nearly exact."""
    n, radius = 40, 14.0
    at = np.arange(n) - (n - 1) / 2
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    volume = Volume((radius - np.sqrt(x * x + y * y + z * z)).astype(np.float32))
    size = (31, 31)
    image = render(device, volume, FLAT, size=size, mode="iso", iso_value=0.0, step=1.0)
    ys, xs = np.mgrid[: size[1], : size[0]]
    u = (xs + 0.5) / size[0] * 40 - 20
    v = 20 - (ys + 0.5) / size[1] * 40
    r2 = u * u + v * v
    inside = r2 < (radius - 0.5) ** 2
    expected = 150.0 - np.sqrt(np.maximum(radius**2 - r2, 0))
    assert np.abs(image.depth - expected)[inside & (r2 < 10**2)].max() < 0.03  # cells of a curved field: 1 / (4 R)
    assert np.all(np.isinf(image.depth[r2 > (radius + 0.5) ** 2]))
    assert np.all(image.color[..., 3] == np.isfinite(image.depth))


def test_iso_shading_follows_the_normal_of_the_ball(device):
    n, radius = 40, 14.0
    at = np.arange(n) - (n - 1) / 2
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    volume = Volume((radius - np.sqrt(x * x + y * y + z * z)).astype(np.float32))
    light = Light("directional", "eye", (0.0, 0.0, 1.0))
    image = render(
        device, volume, FLAT, size=(31, 31), mode="iso", iso_value=0.0, iso_color=(1, 1, 1), lit=True, light=light,
        ambient=0.0, diffuse=1.0, specular=0.0,
    )  # fmt: skip
    ys, xs = np.mgrid[:31, :31]
    r2 = ((xs + 0.5) / 31 * 40 - 20) ** 2 + (20 - (ys + 0.5) / 31 * 40) ** 2
    inner = r2 < 12**2
    assert np.abs(image.color[..., 0] - np.sqrt(np.maximum(1 - r2 / radius**2, 0)))[inner].max() < 0.02


def test_first_hit_stops_at_the_extinction_asked_for(device):
    at = np.arange(20, dtype=np.float32)
    volume = Volume(np.broadcast_to(at[None, :, None], (8, 20, 8)).copy())
    tf = TransferFunction([(0.0, (0, 1, 0), 0.0), (19.0, (0, 1, 0), 0.9)])
    threshold = float(tf.extinction(0.9)) * 10 / 19  # reached at index y = 10, 0.5 mm behind the grid's middle
    image = render(device, volume, FLAT.with_(height=6.0), tf, mode="first_hit", hit_extinction=threshold, step=0.9)
    assert np.abs(image.depth - 150.5).max() < 2e-3
    assert np.allclose(image.color, [0, 1, 0, 1], atol=1e-6)


def test_turning_volume_and_camera_together_changes_nothing(device):
    volume = blob(20, center=(5, -3, 4))
    turn = rotation((0.7, -1.1, 0.4))
    turn[:3, 3] = (300.0, -200.0, 100.0)
    turned = Volume(volume.data, turn @ volume.index_to_world)
    move = [turn[:3, :3] @ np.array(p) + turn[:3, 3] for p in (CAMERA.eye, CAMERA.target)]
    camera = CAMERA.with_(eye=move[0], target=move[1], up=turn[:3, :3] @ np.array(CAMERA.up))
    a = render(device, volume, CAMERA, lit=True).color
    b = render(device, turned, camera, lit=True).color
    assert np.abs(a - b).max() <= 3 / 255
    assert a[..., 3].max() > 0.5


def test_expressing_the_spacing_anew_changes_nothing(device):
    """A band-limited field sampled at twice the voxels of half the spacing is the same field."""
    coarse, fine = blob(32), blob(64)
    a = render(device, coarse, CAMERA, lit=True, step=0.5).color
    b = render(device, fine, CAMERA, lit=True, step=1.0).color
    assert np.abs(a - b).max() <= 3 / 255


def test_halving_the_step_changes_little_on_a_smooth_volume(device):
    volume = blob(32)
    tf = TransferFunction([(0.0, (0.1, 0.2, 0.9), 0.0), (1.0, (0.9, 0.8, 0.6), 0.4)])
    a = render(device, volume, CAMERA, tf, lit=True, step=0.5).color
    b = render(device, volume, CAMERA, tf, lit=True, step=0.25).color
    assert np.abs(a - b).max() <= 3 / 255


@pytest.mark.parametrize("mode", ["composite", "maximum", "first_hit", "iso"])
def test_cropping_what_is_empty_moves_no_sample(device, mode):
    """Law: the lattice is the eye's. A proxy around the visible part changes nothing beyond rounding."""
    volume = blob(24, width=0.08)
    params = {"mode": mode, "iso_value": 0.5, "hit_extinction": 0.1, "lit": mode != "maximum"}
    whole = render(device, volume, CAMERA, **params)
    proxy = call("geometry.proxy_box", volume=volume, crop=((0.15, 0.15, 0.15), (0.85, 0.85, 0.85)))
    interval = call("render.entry_exit_points", device, SIZE, geometry=proxy, camera=CAMERA)
    cropped = render(device, volume, CAMERA, interval=interval, **params)
    shown = whole.color[..., 3] > 0 if mode != "maximum" else cropped.color[..., 3] > 0.05
    assert shown.any()
    assert np.abs(whole.color - cropped.color)[shown].max() <= 1e-6
    if mode != "maximum":
        assert not cropped.color[~shown].any()


def test_a_bound_gradient_equals_the_one_on_the_fly(device):
    volume = blob(24)
    gradient = call("filter.gradient", device, volume=volume)
    a = render(device, volume, CAMERA, lit=True, specular=0.0)
    b = render(device, volume, CAMERA, lit=True, specular=0.0, gradient=gradient)
    # Differences of interpolated values are the interpolated differences, but for the border voxels.
    assert np.abs(a.color - b.color).max() < 2e-3


def test_early_termination_keeps_its_bound(device):
    volume = blob(24)
    full = render(device, volume, CAMERA).color
    for threshold in (0.7, 0.9, 0.99):
        early = render(device, volume, CAMERA, termination=threshold).color
        assert 0 < np.abs(early - full).max() <= 1 - threshold + 1e-6


def test_voxels_that_are_not_a_number_are_transparent(device):
    data = np.full((6, 6, 6), np.nan, np.float32)
    data[2:4, 2:4, 2:4] = 1.0
    for mode in ("composite", "maximum", "first_hit", "iso"):
        image = render(device, Volume(data), FLAT.with_(height=8.0), mode=mode)
        assert np.isfinite(image.color).all()
        assert image.color[0, 0, 3] == 0


def test_one_voxel_and_one_slice_have_the_thickness_of_their_spacing(device):
    tf = TransferFunction([(0.0, (1, 1, 1), 0.0), (1.0, (1, 1, 1), 0.5)], reference_length=2.0)
    one = Volume(np.ones((1, 1, 1), np.uint8), centred((1, 1, 1), (4.0, 4.0, 4.0)))
    image = render(device, one, FLAT.with_(height=3.0), tf)
    assert np.abs(image.color[..., 3] - 0.75).max() < 1e-6


def test_the_eye_may_be_inside(device):
    volume = Volume(np.ones((20, 20, 20), np.float32))
    tf = TransferFunction([(0.0, (1, 1, 1), 0.0), (1.0, (1, 1, 1), 0.1)])
    camera = Camera(eye=(0, 0, 0), target=(0, 1, 0), projection="orthographic", height=4.0)
    assert np.abs(render(device, volume, camera, tf).color[..., 3] - (1 - 0.9**10)).max() < 1e-6


def test_stored_integers_with_a_mapping_render_like_real_values(device):
    real = blob(16)
    stored = Volume(np.round(real.data * 2000 - 1000).astype(np.int16), real.index_to_world, Mapping(1 / 2000, 0.5))
    a = render(device, real, CAMERA, lit=True).color
    b = render(device, stored, CAMERA, lit=True).color
    assert np.abs(a - b).max() < 0.02
    assert np.abs(a - b).mean() < 1e-3


def test_devices_agree(gl, cl, cl64):
    """99.9 percentile at most 2e-3, mean at most 2e-5, silhouettes within a pixel; float against double likewise."""
    volume = blob(32)
    for mode in ("composite", "maximum", "first_hit", "iso"):
        images = [
            render(d, volume, CAMERA, mode=mode, size=(96, 96), lit=mode != "maximum", hit_extinction=0.1)
            for d in (gl, cl, cl64)
        ]
        for other in images[1:]:
            error = np.abs(images[0].color - other.color)
            assert error.mean() <= 2e-5, mode
            assert np.percentile(error.max(axis=-1), 99.9) <= 2e-3, mode


def test_far_from_the_origin_the_picture_is_the_same(device):
    """Rays start at the eye, in double precision: 10 km away from the origin nothing moves."""
    volume = blob(20)
    offset = np.array([1e7, -2e7, 5e6])
    far = Volume(volume.data, affine((1, 1, 1), offset) @ volume.index_to_world)
    camera = CAMERA.with_(eye=CAMERA.eye + offset, target=CAMERA.target + offset)
    a, b = render(device, volume, CAMERA, lit=True), render(device, far, camera, lit=True)
    assert np.abs(a.color - b.color).max() < 1e-3
