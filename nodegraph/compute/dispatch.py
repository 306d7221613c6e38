"""The parts of one dispatch: programs, what they read and write, results that lie on a device, and build errors."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from nodegraph import shaders
from nodegraph.compute.language import Layout
from nodegraph.compute.memory import Entry
from nodegraph.compute.storage import Placement
from nodegraph.compute.strips import Pace
from nodegraph.data.buffer import Array
from nodegraph.errors import DeviceError, ShaderError

if TYPE_CHECKING:
    from nodegraph.compute.device import Device

Size = tuple[int, int, int]


@dataclass
class Program:
    """A built program and what the device found out about it; ``handle`` is the device's own."""

    handle: Any
    layout: Layout
    text: str = ""
    warm: bool = False
    pace: Pace = field(default_factory=Pace)


@dataclass
class Slot:
    """One field of a dispatch: the copy on the device and how it lies there."""

    entry: Entry
    placement: Placement


@dataclass
class Job:
    """All that one dispatch needs: ``size`` is (x, y, z), z 1 for pixels; ``values`` are flat, one array per leaf."""

    program: Program
    volume: bool
    size: Size
    values: list[Array]
    slots: list[Slot]
    targets: list[Any]


@dataclass(frozen=True)
class FieldRead:
    """A field as one run read it: bytes of its copy on the device, 0 where the host's memory was read in place."""

    name: str
    bytes: int
    uploaded: bool


@dataclass(frozen=True)
class KernelRun:
    """What a run of a kernel was: the variant, what it read and wrote, and how long it took.

    ``size`` is (w, h) pixels or (x, y, z) voxels; ``text`` is the translated program; ``outputs`` holds (name, bytes).
    ``seconds`` are all of `Device.run`, with what had to be uploaded and, where ``built``, compiled. Equal runs may be
    told as one with a ``count``.
    """

    kernel: str
    device: str
    size: tuple[int, ...]
    source: shaders.Source
    defines: Mapping[str, int | float | bool]
    text: str
    fields: tuple[FieldRead, ...]
    outputs: tuple[tuple[str, int], ...]
    seconds: float
    built: bool
    count: int = 1

    @property
    def variant(self) -> tuple[str, str, tuple[int, ...], str]:
        """What equal runs have in common."""
        return self.kernel, self.device, self.size, self.text

    @property
    def work(self) -> str:
        """How many pixels or voxels: ``64x48 pixels``."""
        return f"{'x'.join(map(str, self.size))} {'pixels' if len(self.size) == 2 else 'voxels'}"


def merged(runs: Iterable[KernelRun]) -> list[KernelRun]:
    """Equal runs as one each: a volume that is lit slice by slice is one line and not five hundred."""
    found: dict[tuple[str, str, tuple[int, ...], str], KernelRun] = {}
    for run in runs:
        first = found.get(run.variant)
        if first is not None:
            run = replace(first, count=first.count + run.count, seconds=first.seconds + run.seconds)
        found[run.variant] = run
    return list(found.values())


class Resident:
    """The only copy of a device-born buffer, until it is saved to the host.

    It does not refer to the buffer, so that the buffer may die; the buffer refers to it through ``fetch``.
    """

    def __init__(self, device: Device, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
        self.device = device
        self.shape = shape
        self.dtype = dtype
        self.entry: Entry | None = None
        self.host: Array | None = None

    def save(self) -> None:
        """Copy to the host. Device's thread only."""
        if self.host is None:
            assert self.entry is not None
            if not self.entry.live:
                raise DeviceError(f"{self.device.name}: the device was closed before this result was read from it")
            self.host = self.device.read(self.entry, self.shape, self.dtype)

    def saved(self) -> bool:
        """True when nothing would be lost with the device's copy."""
        return self.host is not None

    def fetch(self) -> Array:
        """Return the data on the host, from any thread."""
        if self.host is None:
            self.device.on_own_thread(self.save)
        assert self.host is not None
        return self.host


class BuildFailure(Exception):
    """A driver's compiler refused a program; the argument is its log. `file` and `line` are what it pointed at."""

    def __init__(self, message: str, file: str = "", line: int = 0) -> None:
        super().__init__(message)
        self.file = file
        self.line = line


def located(failure: BuildFailure, files: tuple[str, ...], source: shaders.Source) -> ShaderError:
    """Turn a driver's message into an error at the author's file and line."""
    name = failure.file
    if name.isdigit() and int(name) < len(files):
        name = files[int(name)]
    excerpt = ""
    if name in source.files:
        place = (source.files.index(name), failure.line)
        if place in source.places:
            excerpt = source.lines[source.places.index(place)]
    return ShaderError(f"the driver refuses this kernel: {failure}", file=name, line=failure.line, excerpt=excerpt)
