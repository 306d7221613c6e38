"""Arrays that lie in chunks somewhere else, in a file or behind a network, and are read block by block.

A chunk is what has to be read and unpacked as a whole. Blocks that a renderer asks for overlap by a plane, and without
a memory of chunks each plane would cost a layer of them; so the chunks that were read last are kept, up to a bound.
"""

from __future__ import annotations

import functools
import itertools
import math
import os
import sys
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from nodegraph.errors import FormatError

Array = NDArray[Any]
Box = tuple[slice, ...]

KEPT_BYTES = 256 << 20
"""Bytes of unpacked chunks that one array keeps: a layer of 64 planes of 1024 x 1024 numbers of 16 bits, twice."""

PIECE_BYTES = 16 << 20
"""Bytes that a file is asked for at once: readers hold all chunks of a request, packed and unpacked."""

TRIM_BYTES = 1 << 30
"""After so many bytes that were read, free memory goes back to the system."""

ROOM_SHARE = 0.8
"""The share of the free memory that a whole array may take when somebody asks for all of it."""


class ChunkedArray:
    """An array of known shape and type, of which any block can be read: ``read(box)`` with a slice for each axis.

    ``chunks`` is the shape of a chunk, ``place`` what to call the array in errors. ``read`` must return the same data
    each time and may be called on several threads.
    """

    def __init__(
        self,
        shape: Sequence[int],
        dtype: DTypeLike,
        chunks: Sequence[int],
        read: Callable[[Box], Array],
        *,
        place: str = "",
        kept_bytes: int = KEPT_BYTES,
    ) -> None:
        self.shape = tuple(int(n) for n in shape)
        self.dtype = np.dtype(dtype)
        self.chunks = tuple(max(1, min(int(c), n)) for c, n in zip(chunks, self.shape, strict=True))
        self.place = place
        self.kept_bytes = kept_bytes
        self._read = read
        self._lock = threading.Lock()
        self._kept: OrderedDict[tuple[int, ...], Array] = OrderedDict()
        self._bytes = 0
        self._since_trim = 0

    @property
    def nbytes(self) -> int:
        """Bytes of the whole array, unpacked."""
        return math.prod(self.shape) * self.dtype.itemsize

    @property
    def resident(self) -> int:
        """Bytes of the chunks that are kept now."""
        return self._bytes

    def keep_at_most(self, nbytes: int) -> None:
        """Keep fewer chunks from now on, where more were allowed."""
        with self._lock:
            self.kept_bytes = min(self.kept_bytes, nbytes)
            self._shrink()

    def release(self) -> None:
        """Keep no chunk. What was handed out stays what it is."""
        with self._lock:
            self._kept.clear()
            self._bytes = 0

    def component(self, index: int) -> ChunkedArray:
        """One number of the last axis, for all places, as an array in chunks."""

        def read(box: Box) -> Array:
            array: Array = self._read((*box, slice(index, index + 1)))[..., 0]
            return array

        return ChunkedArray(
            self.shape[:-1], self.dtype, self.chunks[:-1], read, place=self.place, kept_bytes=self.kept_bytes
        )

    def whole(self) -> Array:
        """All of it, or FormatError where it does not fit into the memory that is free."""
        room = free_bytes()
        if room is not None and self.nbytes > ROOM_SHARE * room:
            raise FormatError(
                f"{self.nbytes / 2**30:.3g} GiB do not fit into the {room / 2**30:.3g} GiB of memory that are free; "
                "choose a coarser level, or a processor that reads block by block",
                file=self.place,
            )
        return self._in_pieces(tuple(slice(0, n) for n in self.shape))

    def block(self, low: Sequence[int], high: Sequence[int], keep: bool = True) -> Array:
        """The numbers at low <= index < high, one pair for each axis, within the shape.

        ``keep=False`` is for a pass over the whole array, which would push out what others come back to.
        """
        box = tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))
        firsts = [s.start // c for s, c in zip(box, self.chunks, strict=True)]
        ends = [-(-s.stop // c) for s, c in zip(box, self.chunks, strict=True)]
        touched = math.prod((b - a) * c for a, b, c in zip(firsts, ends, self.chunks, strict=True))
        if not keep or touched * self.dtype.itemsize > self.kept_bytes // 2:
            return self._in_pieces(box)
        out = np.empty([s.stop - s.start for s in box], self.dtype)
        for key, chunk in self._chunks([range(a, b) for a, b in zip(firsts, ends, strict=True)]):
            starts = [k * c for k, c in zip(key, self.chunks, strict=True)]
            from_, into = [], []
            for s, start, n in zip(box, starts, chunk.shape, strict=True):
                a, b = max(s.start, start), min(s.stop, start + n)
                from_.append(slice(a - start, b - start))
                into.append(slice(a - s.start, b - s.start))
            out[tuple(into)] = chunk[tuple(from_)]
        return out

    def _in_pieces(self, box: Box) -> Array:
        pieces = list(self._pieces(box))
        if len(pieces) == 1:
            return self._checked(box)
        out = np.empty([s.stop - s.start for s in box], self.dtype)
        for piece in pieces:
            into = tuple(slice(p.start - s.start, p.stop - s.start) for p, s in zip(piece, box, strict=True))
            out[into] = self._checked(piece)
        return out

    def _pieces(self, box: Box) -> Iterator[Box]:
        """Cut a box at borders of chunks, the slowest axis first, until nothing large is left that can be cut."""
        if math.prod(s.stop - s.start for s in box) * self.dtype.itemsize > PIECE_BYTES:
            for axis, (s, c) in enumerate(zip(box, self.chunks, strict=True)):
                first, last = s.start // c, (s.stop - 1) // c
                if last > first:
                    middle = (first + last + 1) // 2 * c
                    yield from self._pieces((*box[:axis], slice(s.start, middle), *box[axis + 1 :]))
                    yield from self._pieces((*box[:axis], slice(middle, s.stop), *box[axis + 1 :]))
                    return
        yield box

    def _chunks(self, ranges: list[range]) -> Iterator[tuple[tuple[int, ...], Array]]:
        """Yield the chunks of a box of chunk indices; those that are missing are read together where they adjoin."""
        found: dict[tuple[int, ...], Array] = {}
        with self._lock:
            for key in itertools.product(*ranges):
                if key in self._kept:
                    self._kept.move_to_end(key)
                    found[key] = self._kept[key]
        if not found:
            self._fetch(ranges, found)
        else:
            for key in itertools.product(*ranges):
                if key not in found:
                    # A reader unpacks the chunks of one request side by side: ask for a run of them.
                    end = key[-1] + 1
                    while end < ranges[-1].stop and (*key[:-1], end) not in found:
                        end += 1
                    self._fetch([*(range(k, k + 1) for k in key[:-1]), range(key[-1], end)], found)
        yield from found.items()

    def _fetch(self, ranges: list[range], found: dict[tuple[int, ...], Array]) -> None:
        sizes = zip(ranges, self.chunks, self.shape, strict=True)
        box = tuple(slice(r.start * c, min(r.stop * c, n)) for r, c, n in sizes)
        data = self._checked(box)
        for key in itertools.product(*ranges):
            part = tuple(
                slice((k - r.start) * c, (k - r.start + 1) * c)
                for k, r, c in zip(key, ranges, self.chunks, strict=True)
            )
            chunk = data[part].copy()  # not a view that keeps its neighbours in memory
            found[key] = chunk
            with self._lock:
                if key not in self._kept:
                    self._kept[key] = chunk
                    self._bytes += chunk.nbytes
                self._shrink()

    def _shrink(self) -> None:
        while self._bytes > self.kept_bytes:
            self._bytes -= self._kept.popitem(last=False)[1].nbytes

    def _checked(self, box: Box) -> Array:
        array = np.ascontiguousarray(self._read(box))
        if array.shape != tuple(s.stop - s.start for s in box) or array.dtype != self.dtype:
            raise FormatError(f"a block has {array.dtype} {array.shape}, not what was promised", file=self.place)
        self._since_trim += array.nbytes
        if self._since_trim >= TRIM_BYTES:
            self._since_trim = 0
            trim()
        return array


@functools.cache
def _trimmer() -> Callable[[int], int] | None:
    import ctypes

    return getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None


def trim() -> None:
    """Give free memory back to the system, where the C library would keep it.

    Files are unpacked on several threads, and glibc has an arena for each: without this a volume of 2 GB that is read
    frame after frame holds 100 MB more each time. Nothing is done where there is no such call.
    """
    found = _trimmer()
    if found is not None:
        found(0)


def free_bytes() -> int | None:
    """Bytes of memory that can still be taken without swapping, or None where the system does not say."""
    found = []
    try:
        with open("/proc/meminfo", encoding="ascii") as file:
            lines = dict(line.split(":", 1) for line in file)
        found.append(int(lines["MemAvailable"].split()[0]) * 1024)
    except (OSError, KeyError, ValueError):
        try:
            found.append(os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
        except (AttributeError, OSError, ValueError):
            return None
    try:  # a container may have less than its machine
        folder = "/sys/fs/cgroup"
        with open(f"{folder}/memory.max", encoding="ascii") as most, open(f"{folder}/memory.current") as now:
            found.append(max(0, int(most.read()) - int(now.read())))
    except (OSError, ValueError):
        pass
    return min(found)
