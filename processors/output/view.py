"""Show a picture."""

from nodegraph import Camera, Input, Int, Output, Processor
from nodegraph.data import Image


class View(Processor):
    """Show a picture: a window of the editor, a file of a headless run.

    Its width and height are asked of everything upstream, unless the caller asks for another size. Its camera is
    what a viewer turns; link it with the cameras upstream. The camera does not change the picture by itself.
    """

    image = Input(Image, doc="What is shown.")
    shown = Output(Image, doc="The same picture.")

    width = Int(1024, min=1, max=65536, soft_max=4096, unit="pixel", doc="Width when nobody asks for another.")
    height = Int(1024, min=1, max=65536, soft_max=4096, unit="pixel", doc="Height when nobody asks for another.")
    camera = Camera(doc="What the viewer turns.")

    def process(self, image, width, height, camera):
        return image
