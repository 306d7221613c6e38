"""Memory that nobody uses any more, kept for the next result of the same size.

Pictures of a camera that moves are all alike. A system hands out fresh memory page by page, on first touch, which may
take longer than what is then done with it (measured in docs/decisions/0003).
"""

from __future__ import annotations

import ctypes
import weakref
from collections import deque
from collections.abc import Callable, Hashable
from typing import Any

import numpy as np

from nodegraph.data.buffer import Array

KEPT_ARRAYS = 4
KEPT_OBJECTS = 16
LEAST_BYTES = 1 << 18
"""Smaller arrays come out of memory that the process keeps anyway."""
HOST_BYTES = 128 << 20
"""Of arrays that are kept at most, a quarter of it for each."""
ALIGNMENT = 128
"""Bytes: the widest OpenCL vector, double16."""

Owned = tuple[Any, int, Callable[[], None]]
"""A device object, its bytes, and how to free it."""


class HostSpares:
    """Arrays on the host. Each comes back by itself when the last view of it has died, on whatever thread that is."""

    def __init__(self) -> None:
        # Its methods cannot be interrupted, and at its length it lets go of the oldest: no lock, which a finalizer,
        # that may run in the middle of anything, could not take.
        self._free: deque[Array] = deque(maxlen=KEPT_ARRAYS)
        self._most = HOST_BYTES

    @property
    def nbytes(self) -> int:
        """Bytes that are kept."""
        return sum(block.nbytes for block in tuple(self._free))

    def empty(self, nbytes: int) -> Array:
        """Return bytes that hold anything, and start at a multiple of 128."""
        size = nbytes + ALIGNMENT
        if nbytes < LEAST_BYTES or KEPT_ARRAYS * size > self._most:
            return _aligned(np.empty(size, np.uint8), nbytes)
        block = self._found(size)
        if block is None:
            block = np.empty(size, np.uint8)
        # An array that is a view refers to the object at its root alone, so that has to be one which can be watched.
        root = (ctypes.c_char * size).from_address(block.ctypes.data)
        weakref.finalize(root, self._came_back, block).atexit = False
        return _aligned(np.frombuffer(memoryview(root), np.uint8), nbytes)

    def bound(self, most: int) -> None:
        """Keep at most so many bytes from now on; 0: nothing, whatever comes back."""
        self._most = min(HOST_BYTES, most)
        self._free.clear()

    def clear(self) -> None:
        """Let go of what is kept."""
        self._free.clear()

    def _came_back(self, block: Array) -> None:
        if KEPT_ARRAYS * block.nbytes <= self._most:
            self._free.append(block)

    def _found(self, size: int) -> Array | None:
        for _ in range(len(self._free)):
            try:
                block = self._free.popleft()
            except IndexError:
                return None
            if block.nbytes == size:
                return block
            self._free.append(block)
        return None


def _aligned(raw: Array, nbytes: int) -> Array:
    start = -raw.ctypes.data % ALIGNMENT
    return raw[start : start + nbytes]


class ObjectSpares:
    """Objects on a device by their form, the oldest go first. Device's thread only."""

    def __init__(self) -> None:
        self._free: deque[tuple[Hashable, Owned]] = deque()
        self.nbytes = 0

    def keep(self, form: Hashable, spare: Owned, limit: int) -> None:
        """Keep an object, or free it where it is large: at most ``limit`` bytes are kept, none takes over a quarter."""
        _, nbytes, release = spare
        if nbytes > limit // 4:
            release()
            return
        self._free.append((form, spare))
        self.nbytes += nbytes
        while self.nbytes > limit or len(self._free) > KEPT_OBJECTS:
            self._free_first()

    def take(self, form: Hashable) -> Owned | None:
        """Hand out an object of a form, or None."""
        for i, (its, spare) in enumerate(self._free):
            if its == form:
                del self._free[i]
                self.nbytes -= spare[1]
                return spare
        return None

    def clear(self) -> None:
        """Free all."""
        while self._free:
            self._free_first()

    def _free_first(self) -> None:
        _, (_, nbytes, release) = self._free.popleft()
        self.nbytes -= nbytes
        release()
