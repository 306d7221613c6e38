"""The histogram of the volume that a node reads, made off the window's thread."""

from __future__ import annotations

import itertools
import weakref
from dataclasses import dataclass
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
from nodegraph.subjects import upstream

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.flat import Flat

BINS = 512
AGAIN_MS = 300
"""After this time one looks again whether a drag is over."""


@dataclass(frozen=True)
class Histogram:
    """How often real values occur. counts: (bins,) over low..high, ends included; unit: of the values."""

    counts: NDArray[np.int64]
    low: float
    high: float
    unit: str = ""

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


def count(volume: Volume, bins: int = BINS) -> Histogram:
    """Count the finite real values of a volume (the first of several components), slab by slab."""
    scale, offset, unit = volume.mapping
    volume = volume.component(0)
    low, high = volume.range
    whole = volume.dtype.kind in "iu"
    if whole:
        # One bin for each stored number, or for so many of them: bins that cut between numbers would show a comb.
        stored = sorted(((low - offset) / scale, (high - offset) / scale))
        first, last = round(stored[0]), round(stored[1])
        each = max(1, -(-(last - first + 1) // bins))
        bins = -(-(last - first + 1) // each)
        edges = (first - 0.5, first - 0.5 + bins * each)
    else:
        edges = ((low - offset) / scale, (high - offset) / scale)
        edges = (min(edges), max(edges))
        if not edges[1] > edges[0]:
            edges = (edges[0] - 0.5, edges[0] + 0.5)
    counts = np.zeros(bins, np.int64)
    for _, slab in volume.buffer.slabs():
        flat = slab.reshape(-1)
        # Small pieces: numpy holds the interpreter while it counts, and the window wants to draw.
        for start in range(0, len(flat), SLAB_BYTES // 16):
            piece = flat[start : start + SLAB_BYTES // 16]
            if not whole:
                piece = piece[np.isfinite(piece)]
            counts += np.histogram(piece, bins=bins, range=edges)[0]
    ends = (edges[0] * scale + offset, edges[1] * scale + offset)
    return Histogram(counts[::-1] if scale < 0 else counts, min(ends), max(ends), unit)


def volume_source(flat: Flat, path: str) -> Source | None:
    """The nearest output upstream of a node that gives a volume: what it reads itself first, then further up."""
    seen, level = {path}, [path]
    while level:
        above: list[str] = []
        for here in level:
            node = flat.nodes.get(here)
            if node is None or node.processor is None:
                continue
            for name in node.processor.inputs:
                for source in node.sources.get(name, ()):
                    giver = flat.nodes.get(source[0])
                    declared = giver.processor.outputs.get(source[1]) if giver and giver.processor else None
                    if declared is not None and issubclass(declared.type, Volume):
                        return source
                    if source[0] not in seen:
                        seen.add(source[0])
                        above.append(source[0])
        level = above
    return None


class HistogramOf(QObject):
    """Keeps the histogram of what one node reads. ``found`` brings it, or None where there is no volume."""

    found = Signal(object)

    _known: weakref.WeakKeyDictionary[Any, Histogram] = weakref.WeakKeyDictionary()  # by the buffer of the data
    _numbers = itertools.count()

    def __init__(self, session: Session, path: str, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.path = path
        self.histogram: Histogram | None = None
        self._buffer: weakref.ref[Any] | None = None  # of what is shown or being counted
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
        above = upstream(self.session.network.flatten(), source[0])
        key = (source, *((node.path, node.revision) for node in above))
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

    def _count(self, volume: Volume) -> None:
        buffer = volume.buffer
        if self._buffer is not None and self._buffer() is buffer:
            return
        self._buffer = weakref.ref(buffer)
        known = self._known.get(buffer)
        if known is not None:
            self._show(buffer, known)
            return

        self.session.work(partial(count, volume), partial(self._take, buffer))

    def _take(self, buffer: Any, histogram: Histogram | None) -> None:
        """The histogram of some data, or None where it could not be made: a device was lost, a file is gone."""
        if histogram is not None:
            self._known[buffer] = histogram
        if not isValid(self):
            return  # the widget went while somebody counted
        if self._buffer is not None and self._buffer() is buffer:
            self._show(buffer, histogram)

    def _show(self, buffer: Any, histogram: Histogram | None) -> None:
        self._buffer = weakref.ref(buffer) if buffer is not None else None
        if histogram is not self.histogram or histogram is None:
            self.histogram = histogram
            self.found.emit(histogram)


def _reads_volume(leaf: Any) -> bool:
    return leaf.processor is not None and any(issubclass(port.type, Volume) for port in leaf.processor.inputs.values())
