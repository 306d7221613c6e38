"""Histograms of the volume that a node reads, made off the window's thread."""

from __future__ import annotations

import itertools
import math
import weakref
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal
from shiboken6 import isValid

from nodegraph.data import Volume
from nodegraph.data.volume import SLAB_BYTES
from nodegraph.errors import GraphError
from nodegraph.flat import Source
from nodegraph.offers import in_patches
from nodegraph.params import Box
from nodegraph.subjects import upstream

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.flat import Flat

BINS = 512
KEPT = 8  #: histograms of one volume and its parts
Crop = tuple[tuple[float, ...], tuple[float, ...]]
"""The low and the high corner of a part of a volume, as fractions of its x, y and z."""
AGAIN_MS = 300
"""After this time one looks again whether a drag is over."""


@dataclass(frozen=True, eq=False)
class Histogram:
    """How often real values occur. counts: (bins,) over low..high, ends included; unit: of the values.

    ids: of labels: which there are in all of the volume, and how often; empty where the values are no labels.
    """

    counts: NDArray[np.int64]
    low: float
    high: float
    unit: str = ""
    ids: Mapping[int, int] = field(default_factory=dict)

    def usual(self, outliers: float = 1e-4) -> tuple[float, float]:
        """The range without the rarest values at either end."""
        total = int(self.counts.sum())
        if not total:
            return self.low, self.high
        share = np.cumsum(self.counts) / total
        width = (self.high - self.low) / len(self.counts)
        first = int(np.searchsorted(share, outliers, side="right"))
        last = int(np.searchsorted(share, 1.0 - outliers, side="left"))
        return self.low + first * width, self.low + (last + 1) * width


def count(volume: Volume, crop: Crop | None = None, bins: int = BINS) -> Histogram:
    """Count the finite real values of a volume (the first of several components), or of a part of it, slab by slab."""
    scale, offset, unit = volume.mapping
    given = volume = volume.component(0)
    bins, edges = stored_bins(volume, bins)
    if crop is not None:
        volume = volume.part(*voxels(crop, volume.dims))  # the bins stay those of the whole
    whole = volume.dtype.kind in "iu"
    counts = np.zeros(bins, np.int64)
    edged = there = 0
    for _, slab in volume.buffer.slabs():
        layer = slab[len(slab) // 2]
        edged += int(((layer[:, 1:] != layer[:, :-1]) & (layer[:, 1:] != 0)).sum())
        there += int((layer != 0).sum())
        flat = slab.reshape(-1)
        # Small pieces: numpy holds the interpreter while it counts, and the window wants to draw.
        for start in range(0, len(flat), SLAB_BYTES // 16):
            piece = flat[start : start + SLAB_BYTES // 16]
            if not whole:
                piece = piece[np.isfinite(piece)]
            counts += np.histogram(piece, bins=bins, range=edges)[0]
    ends = (edges[0] * scale + offset, edges[1] * scale + offset)
    ids: Mapping[int, int] = {}
    if crop is not None and whole:
        ids = count(given).ids
    elif whole and edges[1] - edges[0] == bins and (scale, offset) == (1.0, 0.0) and in_patches(edged, there):
        ids = {round(edges[0] + 0.5) + int(place): int(counts[place]) for place in np.flatnonzero(counts)}
    return Histogram(counts[::-1] if scale < 0 else counts, min(ends), max(ends), unit, ids)


def stored_bins(volume: Volume, bins: int) -> tuple[int, tuple[float, float]]:
    """How many bins, at most ``bins``, and over which stored numbers, for the values of a volume of one component."""
    scale, offset, _ = volume.mapping
    low, high = volume.range
    first, last = sorted(((low - offset) / scale, (high - offset) / scale))
    if volume.dtype.kind in "iu":
        # One bin for each stored number, or for so many of them: bins that cut between numbers would show a comb.
        first, last = round(first), round(last)
        each = max(1, -(-(last - first + 1) // bins))
        bins = -(-(last - first + 1) // each)
        return bins, (first - 0.5, first - 0.5 + bins * each)
    return bins, (first, last) if last > first else (first - 0.5, first + 0.5)


def voxels(crop: Crop, dims: tuple[int, int, int]) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """First and end voxel (x, y, z) of a part, given as fractions; at least one voxel each way."""
    sides = []
    for low, high, n in zip(*crop, dims, strict=True):
        first = min(n - 1, max(0, math.floor(low * n + 0.5)))
        sides.append((first, min(n, max(first + 1, math.floor(high * n + 0.5)))))
    return tuple(first for first, _ in sides), tuple(end for _, end in sides)


def crop_of(flat: Flat, path: str) -> Crop | None:
    """The part of the data that a node above another one leaves, as fractions; None for all of it.

    It is the nearest parameter upstream that is shown as a box and has no unit.
    """
    for node in upstream(flat, path):
        for name, declared in node.processor.params.items() if node.processor is not None else ():
            if isinstance(declared, Box) and declared.handle == "box" and not declared.unit:
                value = node.values.get(name)
                return None if value is None else (tuple(value[0]), tuple(value[1]))
    return None


def volume_source(flat: Flat, path: str) -> Source | None:
    """The nearest output upstream of a node that gives a volume: what it reads itself first, then further up."""
    for node in upstream(flat, path):
        for name in node.processor.inputs if node.processor is not None else ():
            for source in node.sources.get(name, ()):
                giver = flat.nodes.get(source[0])
                declared = giver.processor.outputs.get(source[1]) if giver and giver.processor else None
                if declared is not None and issubclass(declared.type, Volume):
                    return source
    return None


class HistogramOf(QObject):
    """Keeps the histogram of what one node reads. ``found`` brings it, or None where there is no volume.

    ``make`` makes it of a volume and the crop, if there is one.
    """

    found = Signal(object)

    _known: weakref.WeakKeyDictionary[Any, dict[object, Any]] = weakref.WeakKeyDictionary()  # by the data
    _numbers = itertools.count()

    def __init__(
        self,
        session: Session,
        path: str,
        parent: QObject | None = None,
        make: Callable[[Volume, Crop | None], Any] = count,
    ) -> None:
        super().__init__(parent)
        self.session = session
        self.path = path
        self.make = make
        self.histogram: Any = None
        self.cropped = True  # whether to count what a crop leaves alone
        self._buffer: weakref.ref[Any] | None = None  # of what is shown or being counted
        self._kind: object = None  # which histogram, of which part of it and where
        self._key: object = None  # of everything upstream, when it was asked for
        self._stopped = False
        self._again = QTimer(self, singleShot=True, interval=AGAIN_MS)
        self._again.timeout.connect(self.look)
        self._channel = ("histogram", next(self._numbers))
        session.changed.connect(self.look)
        session.answered.connect(self._answered)

    def look(self, *_: Any) -> None:
        """Look at what the node reads now, if anything upstream of it has changed; the engine keeps what it knows."""
        if self._stopped:
            return
        source = self._source()
        if source is None:
            self._key = None
            self._show(None, None)
            return
        flat = self.session.network.flatten()
        above = ((node.path, node.revision) for node in upstream(flat, source[0]))
        key = (source, self.crop() if self.cropped else None, *above)
        if key == self._key:
            return
        if self.session.in_gesture:
            self._again.start()  # while somebody drags, pictures go first
            return
        self._key = key
        self.session.ask(source[0], None, "final", self._channel)

    def resume(self) -> None:
        """Look again after `stop`."""
        if self._stopped:
            self._stopped = False
            self.look()

    def set_cropped(self, on: bool) -> None:
        """Count what a crop leaves alone, or everything."""
        self.cropped = on
        self.look()

    def stop(self) -> None:
        """Ask for nothing until `resume`."""
        self._stopped = True
        self._again.stop()
        self._key = None
        self.session.unwatch(self._channel)

    def _source(self) -> Source | None:
        try:
            return volume_source(self.session.network.flatten(), self._leaf())
        except GraphError:
            return None

    def _leaf(self) -> str:
        """The plain node: of a group, the first one inside that reads a volume is found by its own wires."""
        node = self.session.network.node(self.path)
        return next((leaf.path for leaf in node.leaves() if _reads_volume(leaf)), node.path)

    def _answered(self, channel: object, report: Any) -> None:
        source = self._source() if channel == self._channel else None
        value = report.values.get(source) if source is not None else None
        if isinstance(value, Volume):
            self._count(value)

    def crop(self) -> Crop | None:
        """What a crop in the network leaves of the data."""
        try:
            return crop_of(self.session.network.flatten(), self._leaf())
        except GraphError:
            return None

    def _count(self, volume: Volume) -> None:
        buffer, part = volume.buffer, self.crop() if self.cropped else None
        kind = (self.make, part, volume.mapping, volume.index_to_world.tobytes())
        if self._is_wanted(buffer, kind):
            return
        self._buffer, self._kind = weakref.ref(buffer), kind
        known = self._known.get(buffer, {}).get(kind)
        if known is not None:
            self._show(buffer, known)
            return
        self.session.work(partial(self.make, volume, part), partial(self._take, buffer, kind))

    def _take(self, buffer: Any, kind: object, histogram: Any) -> None:
        """The histogram of some data, or None where it could not be made: a device was lost, a file is gone."""
        if histogram is not None:
            kept = self._known.setdefault(buffer, {})
            while len(kept) >= KEPT:
                del kept[next(iter(kept))]
            kept[kind] = histogram
        if not isValid(self):
            return  # the widget went while somebody counted
        if self._is_wanted(buffer, kind):
            self._show(buffer, histogram)

    def _is_wanted(self, buffer: Any, kind: object) -> bool:
        return self._buffer is not None and self._buffer() is buffer and self._kind == kind

    def _show(self, buffer: Any, histogram: Any) -> None:
        self._buffer = weakref.ref(buffer) if buffer is not None else None
        if histogram is not self.histogram or histogram is None:
            self.histogram = histogram
            self.found.emit(histogram)


def _reads_volume(leaf: Any) -> bool:
    return leaf.processor is not None and any(issubclass(port.type, Volume) for port in leaf.processor.inputs.values())
