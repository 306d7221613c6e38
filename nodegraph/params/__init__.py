"""Parameters of processors, one class per kind.

    sigma = Float(1.0, min=0.0, soft_max=10.0, unit="mm", doc="Standard deviation.")

Each is a descriptor: on the class it is the declaration itself, on an instance it is refused, so that a value can reach
``process`` only as an argument.
"""

from nodegraph.params.geometry import Box, Color, Matrix
from nodegraph.params.kinds import kind, kinds, stand_in
from nodegraph.params.numbers import Bool, Bounded, Float, Int, Interval, Seed, Vector
from nodegraph.params.parameter import HANDLES, Parameter
from nodegraph.params.text import Choice, File, Folder, Text
from nodegraph.params.values import Camera, Light, Plane, TransferFunction, TransferFunction2D

__all__ = [
    "HANDLES",
    "Bool",
    "Bounded",
    "Box",
    "Camera",
    "Choice",
    "Color",
    "File",
    "Float",
    "Folder",
    "Int",
    "Interval",
    "Light",
    "Matrix",
    "Parameter",
    "Plane",
    "Seed",
    "Text",
    "TransferFunction",
    "TransferFunction2D",
    "Vector",
    "kind",
    "kinds",
    "stand_in",
]
