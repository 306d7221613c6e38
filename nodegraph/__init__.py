"""A node-graph framework for volume visualisation.

    import nodegraph
    net = nodegraph.load("workspaces/first_light.json")
    net["raycast"].step = 0.5
    image = net.run("view")

Declarations of processors come with this import (``Processor``, ``Input``, ``Output``, parameter kinds,
conditions); what is heavier loads when it is first named: ``nodegraph.load``, ``nodegraph.run``,
``nodegraph.Network``, ``nodegraph.Engine``, ``nodegraph.processors.filter.GaussianBlur``.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from nodegraph.params import (
    Bool,
    Box,
    Camera,
    Choice,
    Color,
    File,
    Float,
    Folder,
    Int,
    Interval,
    Light,
    Matrix,
    Parameter,
    Plane,
    Seed,
    Text,
    TransferFunction,
    TransferFunction2D,
    Vector,
)
from nodegraph.ports import Condition, Input, Output, PortType, channels, has_components, has_depth, has_ids, min_dims
from nodegraph.processor import Processor

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.network import Network
    from nodegraph.scripting import engine, load, run

#: Public names that load on first use, and the module that has them.
_LAZY = {
    "Engine": "nodegraph.engine",
    "GraphError": "nodegraph.errors",
    "Network": "nodegraph.network",
    "engine": "nodegraph.scripting",
    "load": "nodegraph.scripting",
    "run": "nodegraph.scripting",
    "processors": "nodegraph.registry",
}

_MODULES = ("compute", "data", "errors", "formats", "registry", "testing")

__version__ = "0.1.0"

__all__ = [
    "Bool",
    "Box",
    "Camera",
    "Choice",
    "Color",
    "Condition",
    "Engine",
    "File",
    "Float",
    "Folder",
    "GraphError",
    "Input",
    "Int",
    "Interval",
    "Light",
    "Matrix",
    "Network",
    "Output",
    "Parameter",
    "Plane",
    "PortType",
    "Processor",
    "Seed",
    "Text",
    "TransferFunction",
    "TransferFunction2D",
    "Vector",
    "channels",
    "engine",
    "has_components",
    "has_depth",
    "has_ids",
    "load",
    "min_dims",
    "processors",
    "run",
]


class _Package(ModuleType):
    """Keeps ``nodegraph.engine`` the function: importing nodegraph/engine.py would put the module in its place."""

    def __setattr__(self, name: str, value: Any) -> None:
        if name != "engine":
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __getattr__(name: str) -> Any:
    import importlib

    if name in _LAZY:
        return getattr(importlib.import_module(_LAZY[name]), name)
    if name in _MODULES:
        return importlib.import_module(f"nodegraph.{name}")
    raise AttributeError(f"module 'nodegraph' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*__all__, *_MODULES, "__version__"})
