"""Write a picture to a file."""

from __future__ import annotations

from nodegraph import Bool, Choice, Color, File, Input, Int, Processor
from nodegraph.data import Image
from nodegraph.errors import ParameterError


class ImageFile(Processor):
    """Write a picture to a PNG or OpenEXR file, or to any format that a plug-in brings.

    A PNG is for looking at: sRGB, 8 or 16 bits, clipped to what a screen shows. An EXR is for computing: linear, not
    clipped, with depth and ids where the picture has them. Both carry the workspace that made them and may stand
    wherever a workspace is expected. The file appears whole or not at all; an older one is replaced.
    """

    effect = True

    image = Input(Image, doc="What is written.")

    path = File(write=True, suffixes=(".png", ".exr"), doc="The file. A relative path is relative to the workspace.")
    width = Int(1024, min=1, max=65536, soft_max=4096, unit="pixel", doc="Width when nobody asks for another.")
    height = Int(1024, min=1, max=65536, soft_max=4096, unit="pixel", doc="Height when nobody asks for another.")
    background = Choice(
        "transparent", "color", doc="Keep the transparency, or put the picture over a colour. Only for PNG."
    )
    color = Color((0.0, 0.0, 0.0), visible_if={"background": "color"}, doc="The colour behind the picture.")
    bits = Choice("8", "16", doc="Bits per channel of a PNG.")
    half = Bool(False, doc="Store the colour of an EXR in 16 bits instead of 32.")

    def process(self, image, path, width, height, background, color, bits, half, *, workspace):
        from nodegraph import formats

        if not path:
            raise ParameterError("path: no file is named; name one, for example picture.png")
        options = {}
        if path.lower().endswith(".png"):
            behind = color if background == "color" else None
            options = {"bits": int(bits), "background": behind, "workspace": workspace(path)}
        elif path.lower().endswith(".exr"):
            options = {"half": half, "workspace": workspace(path)}
        formats.write(image, path, **options)
