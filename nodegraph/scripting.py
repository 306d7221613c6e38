"""The short forms for scripts and notebooks: load a workspace, run a view, run one processor on arrays."""

from __future__ import annotations

import itertools
import os
import threading
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from nodegraph.data import Image
from nodegraph.engine import Engine
from nodegraph.errors import GraphError
from nodegraph.flat import Flat, FlatNode
from nodegraph.processor import Processor, bind
from nodegraph.report import Observer, Report
from nodegraph.requests import default_sinks, sink_size

if TYPE_CHECKING:
    from pathlib import Path

    from nodegraph.network import Network

NOTEBOOK_PIXELS = 512

_lock = threading.Lock()
_engines: dict[str, Engine] = {}
_revisions = itertools.count(1)

if hasattr(os, "register_at_fork"):
    # The thread of an engine does not follow into a forked process; there, a new one is made.
    os.register_at_fork(after_in_child=_engines.clear)


def engine(device: str = "auto") -> Engine:
    """The engine of this process for a device: "auto", "gl", "cl" or "cl64". Made on first use."""
    with _lock:
        found = _engines.get(device)
        if found is None or found.closed:
            found = _engines[device] = Engine(device)
        return found


def load(path: str | Path) -> Network:
    """Read a workspace file. Runs no code of it and writes nothing. Raises WorkspaceError naming the place."""
    from nodegraph import workspace

    return workspace.load(path)


def run_network(
    network: Network,
    sinks: Iterable[str] | str | None = None,
    *,
    size: tuple[int, int] | None = None,
    quality: str = "final",
    device: str = "auto",
    on_event: Observer | None = None,
) -> Any:
    """What one sink shows, or a dict of what several show; without sinks, of all views and effects.

    A sink with one output gives its value, one with several gives a dict of them. Raises the first error.
    """
    report = engine(device).evaluate(network, sinks, size=size, quality=quality, on_event=on_event)
    report.raise_first()
    if isinstance(sinks, str):
        return _shown(report, sinks)
    return {sink: _shown(report, sink) for sink in report.shown}


def _shown(report: Report, sink: str) -> Any:
    values = report.shown[sink]
    return next(iter(values.values())) if len(values) == 1 else dict(values) if values else None


def run(
    processor: type[Processor] | str,
    /,
    *,
    size: Any = None,
    device: Any = "auto",
    quality: Any = "final",
    **values: Any,
) -> Any:
    """Run one processor: ``run(GaussianBlur, volume=array, sigma=2.0)``.

    The processor is a class or an id. Inputs and parameters are given by name; arrays are accepted where a port's
    type can be made of one. ``size``, ``device`` and ``quality`` mean what they mean everywhere, unless the processor
    declares them itself. Returns the value of the output, or a named tuple of several. Raises PortError,
    ParameterError, or ProcessError for what goes wrong inside.
    """
    if isinstance(processor, str):
        from nodegraph import registry

        processor = registry.find(processor)
    services: dict[str, Any] = {"size": size, "device": device, "quality": quality}
    usual: dict[str, Any] = {"size": None, "device": "auto", "quality": "final"}
    for name in list(services):
        if name in processor.inputs or name in processor.params:
            if services[name] is not usual[name]:
                values[name] = services[name]
            services[name] = usual[name]
    flat, given = _alone(processor, values)
    path = next(path for path in flat.nodes if path not in given)
    report = engine(services["device"]).evaluate(
        flat, path, size=services["size"], quality=services["quality"], given=given
    )
    report.raise_first()
    outputs = report.shown[path]
    if not processor.outputs:
        return None
    if len(processor.outputs) == 1:
        return next(iter(outputs.values()))
    return processor.Outputs(**outputs)


def _alone(processor: type[Processor], values: dict[str, Any]) -> tuple[Flat, dict[str, Any]]:
    """A snapshot of a network that does not exist: the processor, and a node for every value that it is given."""
    path = processor.id.rpartition(".")[2]
    inputs, params = bind(processor, values, path)
    given: dict[str, Any] = {}
    nodes: dict[str, FlatNode] = {}
    sources: dict[str, tuple[tuple[str, str], ...]] = {}
    for name, port in processor.inputs.items():
        ones = inputs[name] if port.many else () if inputs[name] is None else (inputs[name],)
        places = []
        for i, value in enumerate(ones):
            place = f"given/{name}/{i}"
            given[place] = value
            nodes[place] = FlatNode(place, "given", None, {}, {}, {}, None, next(_revisions))
            places.append((place, "value"))
        sources[name] = tuple(places)
    shown = {name: params[name] for name in processor.visible(params)}
    nodes[path] = FlatNode(path, processor.id, processor, sources, {}, shown, None, next(_revisions))
    return Flat(nodes, {}, frozenset(), 0, 0), given


def picture_of(network: Network) -> Image | None:
    """The first picture that a network shows, at most 512 pixels wide and high; None where it shows none."""
    flat = network.flatten()
    for sink in default_sinks(flat):
        node = flat.nodes[sink]
        if node.processor is None or node.processor.effect:
            continue
        width, height = sink_size(flat, sink)
        scale = min(1.0, NOTEBOOK_PIXELS / max(width, height, 1))
        small = (max(1, round(width * scale)), max(1, round(height * scale)))
        found = run_network(network, sink, size=small)
        pictures = [
            value for value in (found.values() if isinstance(found, dict) else [found]) if isinstance(value, Image)
        ]
        if pictures:
            return pictures[0]
    return None


def notebook_png(network: Network) -> bytes | None:
    """What a network shows of itself in a notebook: its picture as PNG, or None where there is nothing to see."""
    try:
        image = picture_of(network)
    except GraphError:
        # An unfinished network is normal while somebody types it; its text form is shown instead.
        return None
    return None if image is None else image._repr_png_()
