"""An immutable n-d array that lives on the host, on a device, on both, or in chunks of a file."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from nodegraph.data.chunks import ChunkedArray
from nodegraph.errors import PortError

Array = NDArray[Any]

SLAB_BYTES = 1 << 22


class Buffer:
    """Bulk data behind a value: shape and dtype are always known, the array may still lie on a device.

    A host-born buffer wraps an array as a read-only view without copying it; the caller promises not to
    write to the base. A device-born buffer is given ``fetch``, which the first reader of `array` calls, on
    whatever thread that is. Readers that come at the same moment may each call it: it must return the same
    data each time, and the first answer is kept. Devices keep their copies by the identity of the buffer and
    free them when it dies, so a buffer is never compared or hashed by content.

    A buffer in chunks is read from a file: `part` and `slabs` read what they name and nothing else, `array` reads all
    of it, where memory suffices. What was read may be let go at any time, since it can be read again.
    """

    __slots__ = ("__weakref__", "_array", "_chunked", "_fetch", "_lock", "dtype", "shape")

    def __init__(self, array: Array) -> None:
        view = _frozen(np.asarray(array))
        self._array: Array | None = view
        self._fetch: Callable[[], Array] | None = None
        self._chunked: ChunkedArray | None = None
        self._lock = threading.Lock()
        self.shape: tuple[int, ...] = view.shape
        self.dtype: np.dtype[Any] = view.dtype

    @classmethod
    def on_device(cls, shape: tuple[int, ...], dtype: DTypeLike, fetch: Callable[[], Array]) -> Buffer:
        """Return a buffer whose data lies on a device until somebody reads `array`."""
        self = cls.__new__(cls)
        self._array = None
        self._fetch = fetch
        self._chunked = None
        self._lock = threading.Lock()
        self.shape = tuple(int(n) for n in shape)
        self.dtype = np.dtype(dtype)
        return self

    @classmethod
    def in_chunks(cls, chunked: ChunkedArray) -> Buffer:
        """Return a buffer whose data is read from chunks, block by block."""
        self = cls.on_device(chunked.shape, chunked.dtype, chunked.whole)
        self._chunked = chunked
        return self

    @property
    def array(self) -> Array:
        """The data as a read-only array, brought back from the device, or read from its file, on first use."""
        fetch = self._fetch
        array = self._array
        if array is not None:
            return array
        if self._chunked is not None:
            with self._lock:  # as large as it is, it is read once, however many threads ask for it
                if self._array is None:
                    self._array = _frozen(self._chunked.whole())
                return self._array
        assert fetch is not None
        # Not under the lock: fetch may wait for the device's thread, which may want this very buffer.
        array = fetch()
        if array.shape != self.shape or array.dtype != self.dtype:
            got, promised = f"{array.dtype} {array.shape}", f"{self.dtype} {self.shape}"
            raise PortError(f"device returned {got} where {promised} was promised")
        with self._lock:
            if self._array is None:
                self._array = _frozen(array)
                self._fetch = None
            return self._array

    def part(self, low: Sequence[int], high: Sequence[int]) -> Array:
        """The data at low <= index < high along the first axes, read-only: a view, or what is read for it."""
        return self._part(low, high, keep=True)

    def _part(self, low: Sequence[int], high: Sequence[int], keep: bool) -> Array:
        if self._chunked is None or self._array is not None:
            return self.array[tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))]
        rest = self.shape[len(low) :]
        return _frozen(self._chunked.block((*low, *(0 for _ in rest)), (*high, *rest), keep))

    def component(self, index: int) -> Buffer:
        """One number of the last axis, for all places; nothing is read for it."""
        if self._chunked is None or self._array is not None:
            return Buffer(self.array[..., index])
        return Buffer.in_chunks(self._chunked.component(index))

    def slabs(self, multiple: int = 1) -> Iterator[tuple[int, Array]]:
        """Yield (first index, data) along the first axis: about 4 MB each, or as much as a layer of chunks holds.

        Slabs of an array are a ``multiple`` of that many indices deep, those of chunks as the chunks are.
        """
        count = self.shape[0]
        step = max(1, SLAB_BYTES // max(1, self.nbytes // max(1, count)))
        if self._chunked is not None:
            depth = self._chunked.chunks[0]
            step = max(1, step // depth) * depth
        else:
            step = max(1, step // multiple) * multiple
        for first in range(0, count, step):
            yield first, self._part((first,), (min(first + step, count),), keep=False)

    @property
    def on_host(self) -> bool:
        """True when no device is needed for `array`."""
        return self._array is not None or self._chunked is not None

    @property
    def chunks(self) -> tuple[int, ...] | None:
        """Shape of the chunks in which a file holds the data, or None where it is no such buffer."""
        return None if self._chunked is None else self._chunked.chunks

    @property
    def resident(self) -> int:
        """Bytes that were read of a buffer in chunks and can be let go; 0 for any other."""
        if self._chunked is None:
            return 0
        return self._chunked.resident + (0 if self._array is None else self.nbytes)

    def keep_at_most(self, nbytes: int) -> int:
        """Bytes that may be kept of what is read of a buffer in chunks: at most so many from now on; 0 for others."""
        if self._chunked is None:
            return 0
        self._chunked.keep_at_most(nbytes)
        return self._chunked.kept_bytes

    def release(self) -> None:
        """Let go of what can be read again."""
        if self._chunked is not None:
            self._chunked.release()
            self._array = None

    @property
    def nbytes(self) -> int:
        """Bytes of one copy of the data."""
        return math.prod(self.shape) * self.dtype.itemsize

    def __repr__(self) -> str:
        place = "chunks" if self._chunked is not None else "host" if self.on_host else "device"
        return f"Buffer({'x'.join(map(str, self.shape))} {self.dtype}, {place})"


def _frozen(array: Array) -> Array:
    view = array.view()
    view.flags.writeable = False
    return view


def as_buffer(data: Array | Buffer) -> Buffer:
    """Wrap an array, or pass a buffer through."""
    return data if isinstance(data, Buffer) else Buffer(np.asarray(data))
