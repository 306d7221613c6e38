"""Darken what lies behind edges."""

import math

import numpy as np

from nodegraph import Float, Input, Output, Processor
from nodegraph.data import Image
from nodegraph.ports import channels, has_depth
from nodegraph.requests import coarseness


class DepthDarkening(Processor):
    """Darken pixels that lie deeper than their surroundings, as if the nearer parts shaded them.

    The depth is smoothed with a Gaussian G over the pixels that show something; where the smoothed depth is less
    than the pixel's own, D, the colour loses the share ``strength * (D - G * D) / range``, at most ``strength``.
    (The source subtracts that from the colour itself, which shifts hues where a channel reaches 0; on white
    the two are the same.) Depth is linear, in mm, so the effect does not depend on clipping planes. Pixels that
    show nothing neither cast nor take a shade.

    Source: Lindemann 2014, L32 (after Luft, Colditz and Deussen 2006).
    """

    image = Input(Image, doc="Picture with depth.", accepts=[channels(4), has_depth()])
    darkened = Output(Image, doc="Same picture, darker behind edges.")

    sigma = Float(
        1.5, min=0.01, max=20.0, soft_max=5.0, unit="%", doc="Width of the Gaussian, percent of the picture's height."
    )
    range = Float(40.0, min=1e-6, soft_max=200.0, unit="mm", doc="Difference in depth that darkens by the strength.")
    strength = Float(0.6, min=0.0, max=1.0, doc="The most that a pixel loses.")

    def process(self, image, sigma, range, strength, *, quality, device):
        pixels = sigma / 100.0 * image.size[1]
        depth = image.depth
        finite = depth[np.isfinite(depth)]
        common = {
            "depth": image.depth_buffer,
            "sigma": pixels,
            "radius": min(math.ceil(3.0 * pixels), max(image.size)),
            "reference": float(np.median(finite)) if finite.size else 0.0,
            "stride": stride(pixels, coarseness(quality)),
        }
        rows = device.run("image/depth_darkening", image.size, defines={"PASS": 0}, **common)
        color = device.run(
            "image/depth_darkening",
            image.size,
            defines={"PASS": 1},
            rows=rows,
            image=image.color_buffer,
            range=range,
            strength=strength,
            **common,
        )
        return image.with_color(color)


def stride(sigma, n):
    """Which of the pixels under a Gaussian of width ``sigma`` pixels count, every one or every so many-th.

    About one n-th of them, but at least one for each sigma: there, its sums over a grid are still those over all.
    """
    return max(1, min(n, math.floor(sigma)))
