"""A ray through a slab with a closed form, as a processor without a kernel, for tests of references and of tuning.

Extinction along the ray is SLOPE * x per mm over 0..LENGTH mm, so it hides 1 - exp(-SLOPE LENGTH^2 / 2). Pixel (i, j)
looks through a slab that is `WIDTHS[i]` times as thick, and a camera further to the side sees all of them thicker.
"""

from __future__ import annotations

import time
from collections import Counter
from typing import Any

import numpy as np

from nodegraph import Bool, Camera, Choice, Float, Input, Int, Output, Processor
from nodegraph.data import Camera as Eye
from nodegraph.data import Image, Table, Volume
from nodegraph.errors import UnknownProcessor
from nodegraph.network import Network

LENGTH = 1.0
SLOPE = 2.0
WIDTHS = np.array([0.5, 0.75, 1.0, 1.25])
SECONDS_PER_SAMPLE = 5e-4
SECONDS_EXACT = 300e-3
ran: Counter[str] = Counter()


def thickness(camera: Eye) -> np.ndarray:
    """Length of each pixel's ray in the slab, mm: seen at an angle, a slab is thicker."""
    forward = camera.basis[2]
    return LENGTH * WIDTHS / max(abs(float(forward[1])), 0.2)


def exact(camera: Eye | None = None) -> np.ndarray:
    """The opacity of each pixel, in closed form."""
    length = thickness(camera or Eye())
    return 1.0 - np.exp(-SLOPE * length**2 / 2.0)


def left_sum(camera: Eye, count: int) -> np.ndarray:
    """The opacity that `count` samples at the beginnings of equal pieces make: the optical depth is too small by
    SLOPE length^2 / (2 count)."""
    length = thickness(camera)
    return 1.0 - np.exp(-SLOPE * length**2 / 2.0 * (1.0 - 1.0 / count))


class Slab(Processor):
    """Opacity of a slab whose extinction grows linearly."""

    image = Output(Image, doc="The opacity, grey.")
    step = Float(
        0.25, min=2.0**-16, soft_min=2.0**-7, max=1.0, unit="mm", quality="lower", visible_if={"rule": "left"},
        doc="Length of a piece.",
    )  # fmt: skip
    rule = Choice("left", "exact", quality=("left", "exact"), doc="How a piece is integrated.", reference="left")
    camera = Camera(doc="Where the eye is.")

    def process(self, step: float, rule: str, camera: Any, *, device: Any) -> Any:
        ran["slab"] += 1
        count = max(1, round(1.0 / step))
        time.sleep(SECONDS_EXACT if rule == "exact" else min(SECONDS_PER_SAMPLE * count, 0.1))
        hidden = exact(camera) if rule == "exact" else left_sum(camera, count)
        return Image(np.broadcast_to(hidden[None, :, None], (2, 4, 4)).astype(device.real))


class Noise(Processor):
    """A picture that gets no nearer to anything, at its first pixel."""

    image = Output(Image, doc="Grey.")
    order = Int(1, min=1, max=64, quality="higher", doc="Of no use.")

    def process(self, order: int) -> Any:
        color = np.zeros((2, 4, 4))
        color[0, 0] = order % 3
        return Image(color)


class Root(Processor):
    """The square root of two by Newton's method, as a number, a field and a column."""

    number = Output(float, doc="The root.")
    field = Output(Volume, doc="The root, everywhere.")
    table = Output(Table, doc="The root in a column.")
    iterations = Int(1, min=1, quality="higher", reference=(4, 6, 8), doc="How often.")

    def process(self, iterations: int) -> Any:
        time.sleep(1e-2 * iterations)
        x = 2.0
        for _ in range(iterations):
            x = 0.5 * (x + 2.0 / x)
        return self.Outputs(number=x, field=Volume(np.full((2, 2, 2), x)), table=Table({"root": [x]}))


class Tint(Processor):
    """Pass a picture on; has a switch, a wired number and something that only shows under the switch."""

    image = Input(Image, doc="A picture.")
    tinted = Output(Image, doc="The same.")
    careful = Bool(False, quality="on", doc="Of no effect.")
    rounds = Int(2, min=1, max=8, quality="higher", visible_if={"careful": True}, reference=(2, 4), doc="Of no effect.")
    width = Float(1.0, min=0.0, quality="lower", doc="Of no effect.")

    def process(self, image: Any, careful: bool, rounds: int, width: float) -> Any:
        return image


class Number(Processor):
    """A number on a wire."""

    value = Output(float, doc="One half.")

    def process(self) -> Any:
        return 0.5


KIT = {cls.id: cls for cls in (Slab, Noise, Root, Tint, Number)}


def find(id: str) -> type[Processor]:
    """The processors of this file, then those of the registry."""
    from nodegraph import registry

    if id in KIT:
        return KIT[id]
    try:
        return registry.find(id)
    except UnknownProcessor:
        raise UnknownProcessor(id, KIT) from None


def slab(**params: Any) -> Network:
    """slab -> view of 4 x 2 pixels; both follow the variable ``camera``."""
    net = Network(find)
    net.add(Slab, "slab", **params)
    net.add("output.view", "view", width=4, height=2)
    net.connect("slab.image", "view.image")
    net.link("slab.camera", "camera")
    net.link("view.camera", "camera")
    return net
