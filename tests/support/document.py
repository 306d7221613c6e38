"""Small processors for tests of the document; they declare, and compute nothing."""

from __future__ import annotations

from typing import Any

from nodegraph import (
    Bool,
    Camera,
    Choice,
    File,
    Float,
    Input,
    Int,
    Output,
    Processor,
    Text,
    TransferFunction,
    Vector,
)
from nodegraph.data import Camera as CameraValue
from nodegraph.data import Image, Volume
from nodegraph.errors import UnknownProcessor
from nodegraph.network import Network


class Source(Processor):
    """A volume from a file."""

    volume = Output(Volume, doc="Data.")
    path = File(doc="Where it lies.")

    def process(self, path: str) -> Any:
        return None


class Blur(Processor):
    """Smooth a volume."""

    version = 2
    formerly = ("smooth",)
    volume = Input(Volume, doc="Data.")
    smoothed = Output(Volume, doc="Data.")
    sigma = Float(1.0, min=0.0, max=10.0, unit="mm", doc="Width.")
    iterations = Int(1, min=1, max=20, doc="How often.")
    mode = Choice("nearest", "mirror", doc="Borders.")

    def process(self, volume: Any, sigma: float, iterations: int, mode: str) -> Any:
        return volume

    @staticmethod
    def migrate(params: dict[str, Any], version: int) -> dict[str, Any]:
        """Version 1 had the width as a variance."""
        return {("sigma" if name == "variance" else name): value for name, value in params.items()}


class Raycast(Processor):
    """A picture of a volume."""

    volume = Input(Volume, doc="Data.")
    labels = Input(Volume, required=False, doc="More data.")
    image = Output(Image, doc="Picture.")
    depth = Output(Image, doc="Distance.")
    step = Float(1.0, min=0.05, max=4.0, unit="voxel", doc="Step.")
    quality_limit = Float(0.5, finite=False, nan=True, doc="May be anything.")
    lit = Bool(False, doc="With light.")
    shininess = Float(8.0, min=1.0, visible_if={"lit": True}, doc="Of highlights.")
    camera = Camera(doc="Eye.")
    transfer_function = TransferFunction(doc="Optics.")
    up = Vector((0.0, 0.0, 1.0), doc="Up.")
    title = Text(doc="Text.")

    def process(
        self,
        volume: Any,
        labels: Any,
        step: float,
        quality_limit: float,
        lit: bool,
        shininess: float,
        camera: Any,
        transfer_function: Any,
        up: Any,
        title: str,
    ) -> Any:
        return None


class Compose(Processor):
    """Pictures over each other."""

    images = Input(Image, many=True, doc="From front to back.")
    image = Output(Image, doc="All of them.")
    gain = Float(1.0, min=0.5, max=2.0, doc="Factor.")

    def process(self, images: Any, gain: float) -> Any:
        return images[0]


class Fly(Processor):
    """A camera on a path, and a number."""

    camera = Output(CameraValue, doc="Eye.")
    amount = Output(float, doc="Number.")
    frame = Int(0, doc="Which picture.")

    def process(self, frame: int) -> Any:
        return None


KIT: dict[str, type[Processor]] = {cls.id: cls for cls in (Source, Blur, Raycast, Compose, Fly)}


def find(id: str) -> type[Processor]:
    """The kit's registry."""
    if id == "smooth":
        return Blur
    if id not in KIT:
        raise UnknownProcessor(id, KIT)
    return KIT[id]


def chain() -> Network:
    """ct -> blur -> raycast."""
    net = Network(find)
    net.add("source", "ct")
    net.add("blur", "blur", sigma=2.0)
    net.add("raycast", "raycast")
    net.connect("ct.volume", "blur.volume")
    net.connect("blur.smoothed", "raycast.volume")
    return net
