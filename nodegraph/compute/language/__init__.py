"""The kernel translator: one source in a subset of GLSL, printed as GLSL and as OpenCL C.

Text in, text out: this package imports the standard library only and touches no device.
"""

from __future__ import annotations

from .fields_glsl import is_line
from .module import FieldDecl, FieldSlot, Layout, Leaf, Module, OutputDecl, Uniform
from .print_glsl import print_glsl
from .print_opencl import print_opencl
from .storage_types import Storage
from .switches import Switch, switches
from .translate import compile
from .types import Array, Field, Matrix, Numeric, Struct, Type

__all__ = [
    "Array",
    "Field",
    "FieldDecl",
    "FieldSlot",
    "Layout",
    "Leaf",
    "Matrix",
    "Module",
    "Numeric",
    "OutputDecl",
    "Storage",
    "Struct",
    "Switch",
    "Type",
    "Uniform",
    "compile",
    "is_line",
    "print_glsl",
    "print_opencl",
    "switches",
]
