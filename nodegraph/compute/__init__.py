"""Devices that run kernels, and the memory they own. Nothing heavy is loaded before it is used."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

# Not put off as the others are: the function bears the name of its module, and the import system would put the
# module in its place if that came later.
from nodegraph.compute.survey import survey

if TYPE_CHECKING:
    from nodegraph.compute.device import Device
    from nodegraph.compute.devices import Devices
    from nodegraph.compute.memory import Budget, Memory

__all__ = ["Budget", "Device", "Devices", "Memory", "survey"]

_PLACES = {"Budget": "memory", "Memory": "memory", "Device": "device", "Devices": "devices"}


def __getattr__(name: str) -> Any:
    if name in _PLACES:
        found = getattr(importlib.import_module(f"{__name__}.{_PLACES[name]}"), name)
        globals()[name] = found
        return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
