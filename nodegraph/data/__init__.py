"""Immutable values that travel on wires. Numpy only."""

from nodegraph.data.buffer import Buffer, as_buffer
from nodegraph.data.camera import Camera
from nodegraph.data.image import Image
from nodegraph.data.light import Light
from nodegraph.data.mesh import Mesh
from nodegraph.data.plane import Plane
from nodegraph.data.table import Table
from nodegraph.data.transfer_function import Key, TransferFunction
from nodegraph.data.transfer_function_2d import Gaussian, TransferFunction2D, Trapezoid
from nodegraph.data.value import Value
from nodegraph.data.volume import Grid, Labels, Mapping, Volume

__all__ = [
    "Buffer", "Camera", "Gaussian", "Grid", "Image", "Key", "Labels", "Light", "Mapping", "Mesh", "Plane", "Table",
    "TransferFunction", "TransferFunction2D", "Trapezoid", "Value", "Volume", "as_buffer",
]  # fmt: skip
