"""An immutable n-d array that lives on the host, on a device, or on both."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from nodegraph.errors import PortError

Array = NDArray[Any]


class Buffer:
    """Bulk data behind a value: shape and dtype are always known, the array may still lie on a device.

    A host-born buffer wraps an array as a read-only view without copying it; the caller promises not to
    write to the base. A device-born buffer is given ``fetch``, which the first reader of `array` calls, on
    whatever thread that is. Readers that come at the same moment may each call it: it must return the same
    data each time, and the first answer is kept. Devices keep their copies by the identity of the buffer and
    free them when it dies, so a buffer is never compared or hashed by content.
    """

    __slots__ = ("__weakref__", "_array", "_fetch", "_lock", "dtype", "shape")

    def __init__(self, array: Array) -> None:
        view = np.asarray(array).view()
        view.flags.writeable = False
        self._array: Array | None = view
        self._fetch: Callable[[], Array] | None = None
        self._lock = threading.Lock()
        self.shape: tuple[int, ...] = view.shape
        self.dtype: np.dtype[Any] = view.dtype

    @classmethod
    def on_device(cls, shape: tuple[int, ...], dtype: DTypeLike, fetch: Callable[[], Array]) -> Buffer:
        """Return a buffer whose data lies on a device until somebody reads `array`."""
        self = cls.__new__(cls)
        self._array = None
        self._fetch = fetch
        self._lock = threading.Lock()
        self.shape = tuple(int(n) for n in shape)
        self.dtype = np.dtype(dtype)
        return self

    @property
    def array(self) -> Array:
        """The data as a read-only array, brought back from the device on first use."""
        fetch = self._fetch
        if self._array is None:
            assert fetch is not None
            # Not under the lock: fetch may wait for the device's thread, which may want this very buffer.
            array = fetch()
            if array.shape != self.shape or array.dtype != self.dtype:
                got, promised = f"{array.dtype} {array.shape}", f"{self.dtype} {self.shape}"
                raise PortError(f"device returned {got} where {promised} was promised")
            array = array.view()
            array.flags.writeable = False
            with self._lock:
                if self._array is None:
                    self._array = array
                    self._fetch = None
        assert self._array is not None
        return self._array

    @property
    def on_host(self) -> bool:
        """True when `array` costs nothing."""
        return self._array is not None

    @property
    def nbytes(self) -> int:
        """Bytes of one copy of the data."""
        count = 1
        for n in self.shape:
            count *= n
        return count * self.dtype.itemsize

    def __repr__(self) -> str:
        place = "host" if self.on_host else "device"
        return f"Buffer({'x'.join(map(str, self.shape))} {self.dtype}, {place})"


def as_buffer(data: Array | Buffer) -> Buffer:
    """Wrap an array, or pass a buffer through."""
    return data if isinstance(data, Buffer) else Buffer(np.asarray(data))
