"""Image operations against numpy, on each device."""

import math

import numpy as np
import pytest

from nodegraph.data import Image
from tests.support.calls import call


def picture(rng, w=13, h=9, depth=True):
    alpha = rng.random((h, w, 1))
    color = np.concatenate([rng.random((h, w, 3)) * alpha, alpha], axis=2).astype(np.float32)
    z = np.where(rng.random((h, w)) < 0.2, np.inf, 100 + 50 * rng.random((h, w))).astype(np.float32)
    return Image(color, z if depth else None)


@pytest.mark.parametrize("pattern", ["solid", "vertical", "radial"])
def test_background_is_over_and_opaque(device, rng, pattern):
    image = picture(rng)
    top, bottom = np.array([0.2, 0.4, 0.6]), np.array([0.9, 0.1, 0.3])
    out = call("image.background", device, image=image, pattern=pattern, color=tuple(top), second_color=tuple(bottom))
    h, w = 9, 13
    y, x = np.mgrid[:h, :w] + 0.5
    if pattern == "solid":
        share = np.zeros((h, w))
    elif pattern == "vertical":
        share = y / h
    else:
        s = np.clip(np.hypot(x - w / 2, y - h / 2) / min(w, h) / 0.8, 0, 1)
        share = s * s * (3 - 2 * s)
    back = top * (1 - share[..., None]) + bottom * share[..., None]
    expected = image.color[..., :3] + (1 - image.color[..., 3:]) * back
    assert np.abs(out.color[..., :3] - expected).max() < 1e-6
    assert np.all(out.color[..., 3] == 1)
    assert out.depth is image.depth


@pytest.mark.parametrize("mode", ["over", "nearest", "add", "multiply", "mix"])
def test_compose(device, rng, mode):
    a, b = picture(rng), picture(rng)
    out = call("image.compose", device, front=a, back=b, mode=mode, weight=0.3)
    fa, fb = a.color.astype(float), b.color.astype(float)

    def over(p, q):
        return p + (1 - p[..., 3:]) * q

    expected = {
        "over": over(fa, fb),
        "nearest": np.where((a.depth <= b.depth)[..., None], over(fa, fb), over(fb, fa)),
        "add": np.minimum(fa + fb, 1),
        "multiply": fa * fb + fa * (1 - fb[..., 3:]) + fb * (1 - fa[..., 3:]),
        "mix": 0.3 * fa + 0.7 * fb,
    }[mode]
    assert np.abs(out.color - expected).max() < 1e-6
    assert np.array_equal(out.depth, np.minimum(a.depth, b.depth))


def test_compose_refuses_other_sizes(device, rng):
    from nodegraph.errors import PortError

    with pytest.raises(PortError, match="13x9"):
        call("image.compose", device, front=picture(rng), back=picture(rng, 5, 5))


def test_difference_shows_and_measures(device, rng):
    a, b = picture(rng), picture(rng)
    out = call("image.difference", device, image=a, reference=b, gain=2.0)
    error = np.abs(a.color.astype(float) - b.color)
    expected = np.maximum(error[..., :3], error[..., 3:]) * 2
    assert np.abs(out.difference.color[..., :3] - expected).max() < 1e-6
    row = out.measures.rows()[0]
    assert row["maximum"] == pytest.approx(error.max())
    assert row["rmse"] == pytest.approx(math.sqrt((error**2).mean()))
    assert row["psnr"] == pytest.approx(-20 * math.log10(row["rmse"]))
    same = call("image.difference", device, image=a, reference=a).measures.rows()[0]
    assert same["maximum"] == 0
    assert same["psnr"] == math.inf


def test_depth_darkening_of_a_step_edge_follows_the_error_function(device):
    """Checks: Lindemann 2014, T42: behind the edge the loss is jump * (1 - Phi(x / sigma)) / range, in front none."""
    w, h, jump = 80, 40, 20.0
    depth = np.full((h, w), 500.0, np.float32)
    depth[:, w // 2 :] += jump
    color = np.ones((h, w, 4), np.float32)
    out = call(
        "image.depth_darkening", device, image=Image(color, depth), sigma=10.0, range=40.0, strength=0.8
    ).color  # 10 % of 40 pixels: sigma 4
    x = np.arange(w // 2) + 0.5
    tail = np.array([0.5 * math.erfc(v / 4 / math.sqrt(2)) for v in x])
    expected = 1 - 0.8 * jump / 40.0 * tail
    got = out[h // 2, w // 2 :, 0]
    assert np.abs(got - expected)[:20].max() < 2e-3
    assert np.allclose(out[:, : w // 2, :3], 1.0)
    assert np.all(out[..., 3] == 1)


def test_depth_darkening_leaves_what_is_empty_alone(device, rng):
    image = picture(rng, 30, 20)
    empty = np.isinf(image.depth)
    out = call("image.depth_darkening", device, image=image, sigma=8.0)
    assert np.array_equal(out.color[empty], image.color[empty])
    nowhere = Image(image.color, np.full((20, 30), np.inf, np.float32))
    assert np.array_equal(call("image.depth_darkening", device, image=nowhere).color, image.color)


def test_pictures_that_are_not_finite_have_measures_that_are_not_a_number(gl):
    endless = Image(np.full((3, 4, 4), np.inf, np.float32))
    measures = call("image.difference", gl, image=endless, reference=endless).measures
    assert np.isnan(measures["rmse"][0])
