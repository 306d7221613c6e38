"""Which processors there are to choose from, and which fit a port."""

from __future__ import annotations

from nodegraph import registry
from nodegraph.editor.canvas.choosers import Choice
from nodegraph.editor.canvas.faces import spaced
from nodegraph.errors import GraphError
from nodegraph.network import Network
from nodegraph.ports import connects
from nodegraph.processor import Processor


def _classes(network: Network) -> list[type[Processor]]:
    """All processors that load here."""
    found: list[type[Processor]] = []
    for id in registry.ids():
        try:
            found.append(network.find(id))
        except GraphError:
            continue  # the palette shows what does not load, and why
    return found


def _choice(cls: type[Processor], port: str = "") -> Choice:
    doc = (cls.__doc__ or "").strip().split("\n")[0]
    where = cls.category().replace(".", " / ")
    return f"{cls.id}.{port}" if port else cls.id, spaced(cls.__name__), f"{where}: {doc}" if where else doc


def all_processors(network: Network) -> list[Choice]:
    """Every processor."""
    return [_choice(cls) for cls in _classes(network)]


def accepting(network: Network, given: type) -> list[Choice]:
    """Processors with an input that takes a value of a type; the key is ``id.input``."""
    found: list[Choice] = []
    for cls in _classes(network):
        name = next((name for name, port in cls.inputs.items() if connects(given, port.type)), None)
        if name is not None:
            found.append(_choice(cls, name))
    return found


def giving(network: Network, wanted: type) -> list[Choice]:
    """Processors with an output that suits an input of a type; the key is ``id.output``."""
    found: list[Choice] = []
    for cls in _classes(network):
        name = next((name for name, port in cls.outputs.items() if connects(port.type, wanted)), None)
        if name is not None:
            found.append(_choice(cls, name))
    return found
