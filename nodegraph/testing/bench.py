"""Calls a processor as the engine would, without a network, a cache or a thread: what it returns is its own doing."""

from __future__ import annotations

import atexit
import functools
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from nodegraph.errors import GraphError
from nodegraph.processor import Processor, bind

if TYPE_CHECKING:
    from nodegraph.compute import Devices

SIZE = (8, 6)  #: width and height of the pictures that are asked for


class Bench:
    """A place to call processors: opens the device that ``device`` names when a processor first asks for it.

    It belongs to the thread that uses it. ``devices`` lets it share devices that are open already.
    """

    def __init__(self, devices: Devices | None = None, device: str = "auto") -> None:
        self._devices = devices
        self._owned = devices is None
        self._device = device

    def call(
        self,
        processor: type[Processor],
        values: Mapping[str, Any],
        *,
        size: tuple[int, int] = SIZE,
        quality: str = "final",
        wanted: Collection[str] | None = None,
    ) -> dict[str, Any]:
        """Return the outputs by name. Inputs and parameters are checked as everywhere; missing ones are defaults.

        Raises what the declarations or ``process`` raise.
        """
        inputs, params = bind(processor, values)
        asked = frozenset(processor.outputs if wanted is None else wanted)
        services = {"size": size, "quality": quality, "wanted": asked, "progress": _progress, "memo": _memo}
        services["explain"] = lambda text: None
        services["workspace"] = lambda path: ""
        if "device" in processor.services:
            from nodegraph.services import DeviceService, Progress

            silent = Progress(lambda: None, _progress)
            services["device"] = DeviceService(self._open(self._device), processor, processor.id, lambda: None, silent)
        if "gl" in processor.services:
            from nodegraph.services import open_raster

            services["gl"] = open_raster(self._open("gl"), processor.id)
        named = {name: services[name] for name in processor.services}
        returned = processor().process(**inputs, **params, **named)
        if processor.generator:
            steps, returned = returned, None
            for step in steps:
                returned = returned if step is None else step
        return processor.pack(returned, asked)

    def outcome(self, processor: type[Processor], values: Mapping[str, Any], **how: Any) -> dict[str, Any] | GraphError:
        """What `call` returns, or the error of ours that it raises."""
        try:
            return self.call(processor, values, **how)
        except GraphError as error:
            return error

    def close(self) -> None:
        """Close the devices that were opened here."""
        if self._owned and self._devices is not None:
            self._devices.close()
            self._devices = None

    def _open(self, name: str) -> Any:
        if self._devices is None:
            from nodegraph.compute import Devices

            self._devices = Devices()
        return self._devices.choose(name).device


@functools.cache
def default_bench() -> Bench:
    """The bench of this process, on the device that "auto" chooses."""
    bench = Bench()
    atexit.register(bench.close)
    return bench


def _progress(fraction: float, text: str = "") -> None:
    """Nobody is watching."""


def _memo(function: Any, *arguments: Any, disk: bool = False) -> Any:
    """Computes every time, so that nothing is carried from one call to the next."""
    return function(*arguments)
