"""Combine two pictures."""

import numpy as np

from nodegraph import Choice, Float, Input, Output, Processor
from nodegraph.data import Image
from nodegraph.errors import PortError
from nodegraph.ports import channels

MODES = ("over", "nearest", "add", "multiply", "mix")


class Compose(Processor):
    """Make one picture of two of the same size, pixel by pixel, on linear premultiplied colours.

    *over* lays the front over the back (Porter and Duff 1984); *nearest* does so with whichever lies nearer at the
    pixel, by depth; *add*; *multiply*, where both are; *mix* by a weight. Depth is the nearer of the two; a
    picture without depth counts as infinitely far, and so does a depth that is not a number.
    """

    front = Input(Image, doc="Linear premultiplied RGBA.", accepts=[channels(4)])
    back = Input(Image, doc="Linear premultiplied RGBA, same size.", accepts=[channels(4)])
    composed = Output(Image, doc="Linear premultiplied RGBA with depth.")

    mode = Choice(*MODES, doc="How the two are combined.")
    weight = Float(0.5, min=0.0, max=1.0, visible_if={"mode": "mix"}, doc="Share of the front.")

    def process(self, front, back, mode, weight, *, device):
        if front.size != back.size:
            raise PortError(f"back: expected {front.size[0]}x{front.size[1]} pixels like the front, got "
                            f"{back.size[0]}x{back.size[1]}")  # fmt: skip
        nowhere = np.full((front.size[1], front.size[0]), np.inf, np.float32)
        result = device.run(
            "image/compose",
            front.size,
            defines={"MODE": MODES.index(mode)},
            front=front.color_buffer,
            back=back.color_buffer,
            front_depth=nowhere if front.depth_buffer is None else front.depth_buffer,
            back_depth=nowhere if back.depth_buffer is None else back.depth_buffer,
            weight=weight,
        )
        return Image(result.color, result.depth)
