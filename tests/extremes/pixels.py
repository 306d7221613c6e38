"""Operations on pictures: unusual sizes, depths and colours, against numpy."""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import numpy as np

from nodegraph.data import Image
from tests.extremes.case import case, relative, worst
from tests.support.calls import call

DARKENING = "Depth darkening"
COMPOSE = "Compose"
DIFFERENCE = "Difference"


def picture(size: tuple[int, int], depth: Any = None, seed: int = 3) -> Image:
    """Premultiplied noise."""
    color = np.random.default_rng(seed).random((size[1], size[0], 4)).astype(np.float32)
    color[..., :3] *= color[..., 3:]
    return Image(color, None if depth is None else np.full((size[1], size[0]), depth, np.float32))


# -- depth darkening --------------------------------------------------------------------------------------------------


def darkened(image: Image, sigma: float, range: float, strength: float) -> np.ndarray:
    """The same in numpy: rows, then columns, over the pixels that show something, as far as 3 sigma or the picture."""
    from scipy import ndimage

    assert image.depth is not None
    color, depth = image.color.astype(np.float64), image.depth.astype(np.float64)
    pixels = sigma / 100 * image.size[1]
    radius = min(math.ceil(3 * pixels), max(image.size))
    weights = np.exp(-0.5 * (np.arange(-radius, radius + 1) / pixels) ** 2)
    shown = np.isfinite(depth)

    def sums(values: np.ndarray) -> np.ndarray:
        rows = ndimage.convolve1d(values, weights, axis=1, mode="constant")
        return np.asarray(ndimage.convolve1d(rows, weights, axis=0, mode="constant"))

    with np.errstate(invalid="ignore", divide="ignore"):
        difference = sums(np.where(shown, depth, 0.0)) / sums(shown.astype(np.float64)) - depth
    dark = strength * np.clip(difference / range, -1.0, 0.0)
    color[..., :3] *= np.where(shown, 1 + dark, 1)[..., None]
    return color


def darkening_error(image: Image, sigma: float, range: float, device: Any) -> float:
    found = call("image.depth_darkening", device, image=image, sigma=sigma, range=range, strength=0.8).color
    return worst(found, darkened(image, sigma, range, 0.8))


def edge(size: tuple[int, int], near: float, jump: float) -> Image:
    """Two halves of different depth, one above the other, and a hole in the upper one."""
    image = picture(size, near)
    depth = np.array(image.depth)
    depth[size[1] // 2 :] += jump
    depth[: size[1] // 4, : size[0] // 3] = np.inf
    return Image(image.color, depth)


DEPTHS = (
    ("a Gaussian as wide as the picture", edge((24, 30), 500.0, 20.0), 20.0, 40.0),
    ("a Gaussian narrower than a pixel", edge((24, 30), 500.0, 20.0), 0.01, 40.0),
    ("an edge of 320 mm 1e9 mm away", edge((24, 30), 1e9, 320.0), 8.0, 640.0),
    ("depths and their range in nanometres", edge((24, 30), 5e-4, 2e-5), 8.0, 4e-5),
    ("a jump of 1e5 mm", edge((24, 30), 500.0, 1e5), 8.0, 40.0),
    ("one pixel", picture((1, 1), 5.0), 20.0, 40.0),
    ("16384 x 1 pixels", edge((16384, 1), 500.0, 20.0), 20.0, 40.0),
    ("1 x 2048 pixels and a Gaussian of 409", edge((1, 2048), 500.0, 20.0), 20.0, 40.0),
    ("nothing seen", picture((8, 6), np.inf), 8.0, 40.0),
    ("a depth that is not a number", picture((8, 6), np.nan), 8.0, 40.0),
)
for told, image, sigma, range_ in DEPTHS:
    case(DARKENING, told, "numpy's two passes", single=2e-3 if "jump" in told else 1e-5, double=1e-9)(
        partial(darkening_error, image, sigma, range_)
    )

# -- compose ----------------------------------------------------------------------------------------------------------


def nearest_error(front: float, back: float, device: Any) -> float:
    """Which lies in front is told by depth; a depth that is no number is as far as one that is not there."""
    a, b = picture((5, 4), front, 1), picture((5, 4), back, 2)
    out = call("image.compose", device, front=a, back=b, mode="nearest")
    za, zb = np.nan_to_num([front, back], nan=np.inf, posinf=np.inf)
    x, y = (a.color, b.color) if za <= zb else (b.color, a.color)
    depth = 0.0 if np.array_equal(out.depth, np.full((4, 5), min(za, zb), np.float32)) else np.inf
    return max(worst(out.color, x.astype(np.float64) + (1.0 - x[..., 3:].astype(np.float64)) * y), depth)


for front, back in ((1e9, 1e9), (np.inf, 1e30), (np.inf, np.inf), (np.nan, 5.0), (5.0, np.nan), (np.nan, np.nan)):
    case(COMPOSE, f"nearest of depths {front:g} and {back:g} mm", "the nearer over the other, the front where they tie",
         single=2e-7, double=1e-12)(partial(nearest_error, front, back))  # fmt: skip


def over_error(size: tuple[int, int], brightness: float, device: Any) -> float:
    a, b = picture(size, None, 1), picture(size, None, 2)
    bright = Image(b.color * np.array([brightness, brightness, brightness, 1], np.float32))
    out = call("image.compose", device, front=a, back=bright, mode="over").color
    expected = a.color.astype(np.float64) + (1 - a.color[..., 3:].astype(np.float64)) * bright.color
    return relative(out, expected) if out.shape == expected.shape else float("inf")


for size, brightness in (((1, 1), 1.0), ((16384, 1), 1.0), ((5, 4), 1e6)):
    told = f"{size[0]} x {size[1]} pixels" + (f", {brightness:g} times as bright" if brightness > 1 else "")
    case(COMPOSE, f"{told}, over", "Porter and Duff's formula", single=1e-6, double=1e-9, unit="relative")(
        partial(over_error, size, brightness)
    )


def single_pixel_error(mode: str, bad: float, device: Any) -> float:
    """One bad pixel of colour stays one."""
    color = np.array(picture((5, 4)).color)
    color[2, 3] = bad
    front, back = Image(color), picture((5, 4), None, 2)
    out = np.array(call("image.compose", device, front=front, back=back, mode=mode).color)
    good = np.array(call("image.compose", device, front=picture((5, 4)), back=back, mode=mode).color)
    out[2, 3] = good[2, 3] = 0.0
    return worst(out, good)


for mode in ("over", "mix"):
    case(COMPOSE, f"one pixel that is nan, {mode}", "the others do not know", single=0, double=0)(
        partial(single_pixel_error, mode, np.nan)
    )

# -- difference -------------------------------------------------------------------------------------------------------


@case(DIFFERENCE, "16384 x 1 pixels that differ by 2^-20", "the difference to its last digit", single=0, double=0,
      unit="relative")  # fmt: skip
def faint_difference(device: Any) -> float:
    a = np.full((1, 16384, 4), 0.5, np.float32)
    row = call("image.difference", device, image=Image(a), reference=Image(a + np.float32(2.0**-20))).measures.rows()[0]
    return relative([row["maximum"], row["mean"], row["rmse"]], 2.0**-20)


@case(DIFFERENCE, "a picture and itself", "a root mean square of 0, an infinite ratio", single=0, double=0)
def no_difference(device: Any) -> float:
    row = call("image.difference", device, image=picture((1, 1)), reference=picture((1, 1))).measures.rows()[0]
    return 0.0 if row["rmse"] == 0.0 and row["psnr"] == math.inf else math.inf


@case(DIFFERENCE, "brightness 1e6, gain 1000", "the difference, amplified", single=1e-6, double=1e-9, unit="relative")
def great_difference(device: Any) -> float:
    a, b = np.full((2, 2, 4), 1e6, np.float32), np.full((2, 2, 4), 2e6, np.float32)
    out = call("image.difference", device, image=Image(a), reference=Image(b), gain=1000.0)
    return relative(out.difference.color[..., :3], 1e9)
