"""Darken hollows and the feet of edges, by depth alone."""

import math
from typing import NamedTuple

import numpy as np

from nodegraph import Camera, Choice, Float, Input, Int, Output, Processor
from nodegraph.data import Image
from nodegraph.ports import channels, has_depth
from nodegraph.requests import coarseness

METHODS = ("hemisphere", "sphere")
SAMPLING = ("hashed", "every_pixel")
MOST_SAMPLES = 4096


class Occluded(NamedTuple):
    shaded: Image
    occlusion: Image


class Ssao(Processor):
    """Screen-space ambient occlusion: darken a point by the share of its surroundings that lies behind what is seen.

    The surroundings are the ball of ``radius`` about the point. A part of it counts as hidden when it lies behind the
    visible surface of its own pixel, by ``thickness`` at most: so a distant thing in front casts no halo. The ball is
    cut into the rays of the pixels it covers, and along each ray the hidden length is computed exactly; what is left to
    sampling is which pixels are looked at. Pixels that show nothing hide nothing and take no shade; what lies beyond
    the border of the picture is left out of the count. Everything is in mm, so a picture of twice the size, or of a
    scene expressed anew, shows the same shade.

    - *hemisphere*: the half of the ball in front of the surface, whose normal comes from neighbouring depths. A plane
      is not darkened, however it lies.
    - *sphere*: the whole ball, of which a plane hides one half; what is hidden beyond that half, doubled. It needs no
      normal, so it suits rough surfaces such as masks of voxels.

    The colour loses the share ``strength * occlusion``; a part of that, ``bleed``, comes back in the mean colour of
    what occludes. Depth alone decides: nothing transparent takes part, and nothing outside the picture.

    Source: Lindemann 2014, L33 (after Mittring 2007, in the ray-wise form of Loos and Sloan 2010).
    """

    image = Input(Image, doc="Picture with depth.", accepts=[channels(4), has_depth()])
    shaded = Output(Image, doc="Same picture, darker in hollows.")
    occlusion = Output(Image, doc="One channel, 0 open to 1 hidden, before the strength.")

    camera = Camera(doc="The camera that took the picture.")
    radius = Float(10.0, min=1e-6, soft_max=100.0, unit="mm", doc="Of the surroundings that count.")
    thickness = Float(
        20.0, min=0.0, soft_max=200.0, unit="mm", doc="How far matter is taken to reach behind a visible surface."
    )
    strength = Float(0.8, min=0.0, max=1.0, doc="Share of its light that a wholly hidden point loses.")
    bleed = Float(0.2, min=0.0, max=1.0, doc="Share of the lost light that comes back in the colour of the occluders.")
    method = Choice(*METHODS, doc="Which surroundings count.")
    sampling = Choice(
        *SAMPLING, quality=SAMPLING,
        doc="Some pixels of the surroundings, chosen by a hash of the pixel's place, or all of them.",
    )  # fmt: skip
    samples = Int(
        64, min=2, max=MOST_SAMPLES, soft_max=256, quality="higher", visible_if={"sampling": "hashed"},
        doc="Pixels looked at, in opposite pairs.",
    )  # fmt: skip

    def process(self, image, camera, radius, thickness, strength, bleed, method, sampling, samples, *, quality, device):
        turns = samples
        if sampling == "every_pixel":
            turns = pixels_within(radius, camera, image)
        n = coarseness(quality)
        if n > 1:
            # A coarse picture is a grainy one: fewer pixels are looked at, and no edge is blurred.
            sampling, turns = "hashed", fewer(turns, n)
            samples = turns
        result = device.run(
            "image/ssao",
            image.size,
            defines={"METHOD": METHODS.index(method), "EVERY_PIXEL": sampling == "every_pixel"},
            work=turns / 64.0,
            turns=turns,
            image=image.color_buffer,
            depth=image.depth_buffer,
            camera=camera.rays(image.size),
            radius=radius,
            thickness=thickness,
            strength=strength,
            bleed=bleed,
            samples=samples,
        )
        return Occluded(image.with_color(result.color), Image(result.occlusion))


def fewer(looked_at, n):
    """How many pixels to look at where about one n-th of the work is wanted: two opposite pairs at least.

    Fewer save nothing that could be felt, beside what each pixel costs by itself.
    """
    return max(4, 2 * round(min(looked_at / n, MOST_SAMPLES) / 2))


def pixels_within(radius, camera, image):
    """The most pixels that a ball of ``radius`` mm about a visible point can cover in this picture."""
    width, height = image.size
    rays = camera.rays(image.size)
    reach = radius / rays["half_size"][1] * height / 2.0
    if not camera.orthographic:
        seen = image.depth[np.isfinite(image.depth)]
        nearest = float(seen.min()) - radius if seen.size else math.inf
        # A point of the ball is off the middle by radius in both the plane and the depth.
        reach = reach * (1.0 + math.hypot(*rays["half_size"])) / nearest if nearest > 0.0 else math.inf
    side = 2.0 * min(reach, max(width, height)) + 3.0
    return min(side, width) * min(side, height)
