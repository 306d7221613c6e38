"""Put a picture over a background."""

from nodegraph import Choice, Color, Input, Output, Processor
from nodegraph.data import Image
from nodegraph.ports import channels

PATTERNS = ("solid", "vertical", "radial")


class Background(Processor):
    """Lay a picture over one colour, or over two that blend, and make it opaque. Colours are linear."""

    image = Input(Image, doc="Linear premultiplied RGBA.", accepts=[channels(4)])
    composed = Output(Image, doc="Opaque; depth and ids as before.")

    pattern = Choice(*PATTERNS, doc="One colour, a blend from top to bottom, or from the middle outwards.")
    color = Color((0.02, 0.024, 0.03), doc="The colour; at the top, or in the middle.")
    second_color = Color(
        (0.0, 0.0, 0.0), visible_if={"pattern": ("vertical", "radial")}, doc="The colour at the bottom, or outside."
    )

    def process(self, image, pattern, color, second_color, *, device):
        return image.with_color(
            device.run(
                "image/background",
                image.size,
                defines={"PATTERN": PATTERNS.index(pattern)},
                image=image.color_buffer,
                color=color,
                second_color=second_color,
            )
        )
