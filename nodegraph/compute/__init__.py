"""Devices that run kernels, and the memory they own. Nothing here is loaded before it is used."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nodegraph.compute.device import Device
    from nodegraph.compute.devices import Devices
    from nodegraph.compute.memory import Budget, Memory
    from nodegraph.compute.survey import survey

__all__ = ["Budget", "Device", "Devices", "Memory", "survey"]

_PLACES = {"Budget": "memory", "Memory": "memory", "Device": "device", "Devices": "devices", "survey": "survey"}


def __getattr__(name: str) -> Any:
    if name in _PLACES:
        found = getattr(importlib.import_module(f"{__name__}.{_PLACES[name]}"), name)
        globals()[name] = found
        return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
