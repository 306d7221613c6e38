"""How host data is laid down in device memory: the storage table of docs/devices.md as code.

`choose` picks the form in which a buffer goes to a device. What a kernel must know of it is a ``Storage``
(read by the printers); how the numbers get there is a `Placement`, which converts slab by slab, so that no
second copy of a volume ever stands on the host.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Hashable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from nodegraph.compute.language import Storage
from nodegraph.data.buffer import Array, Buffer
from nodegraph.errors import ParameterError

SLAB_BYTES = 8 << 20
WIDE_BYTES = 64 << 20
"""Bytes up to which 8-bit volumes are widened to 16 bits on OpenGL: R8 textures interpolate with 8-bit weights."""

FIELD_AXES = {"field3": 3, "field3v": 3, "field3u": 3, "field2": 2, "field2u": 2, "field1": 1}

_ranges: weakref.WeakKeyDictionary[Buffer, tuple[float, float]] = weakref.WeakKeyDictionary()


@dataclass(frozen=True)
class Placement:
    """A form of a buffer in device memory: the copy holds ``(raw - shift) * factor`` as ``storage.element``.

    ``texture_components`` is what lies there per voxel: on OpenGL 3 are padded to 4 with zeros, since drivers
    pad (or refuse) RGB textures themselves.
    """

    storage: Storage
    shape: tuple[int, ...]
    texture_components: int
    shift: float = 0.0
    factor: int = 1

    @property
    def key(self) -> Hashable:
        """What tells two copies of one buffer apart; scale and offset are uniforms and do not matter."""
        return (len(self.shape), self.storage.element, self.texture_components, self.shift, self.factor)

    @property
    def dtype(self) -> np.dtype[Any]:
        """Numpy type of what lies in device memory."""
        return np.dtype(self.storage.element)

    @property
    def nbytes(self) -> int:
        """Bytes of the copy."""
        return math.prod(self.shape) * self.texture_components * self.dtype.itemsize

    def is_verbatim(self, array: Array) -> bool:
        """True when the array's own bytes are the copy: a device may use or upload them in place."""
        return (
            array.dtype == self.dtype
            and array.dtype.isnative
            and array.flags.c_contiguous
            and array.flags.aligned
            and self.shift == 0.0
            and self.factor == 1
            and self.texture_components == self.storage.components
        )

    def slabs(self, array: Array) -> Iterator[tuple[int, Array]]:
        """Yield (first index, converted slab (n, ..., c)) along the first axis, at most about 8 MB each."""
        rows = array.reshape((*self.shape, self.storage.components))
        step = max(1, SLAB_BYTES // max(1, self.nbytes // self.shape[0]))
        whole = self.is_verbatim(array)
        for first in range(0, self.shape[0], step):
            part = rows[first : first + step]
            yield first, part if whole else self._convert(part)

    def _convert(self, part: Array) -> Array:
        out = np.zeros((*part.shape[:-1], self.texture_components), self.dtype)
        target = out[..., : part.shape[-1]]
        with np.errstate(over="ignore", invalid="ignore"):
            if self.shift != 0.0 and self.dtype.kind == "f":
                # The difference is taken in double: near 2^40 float32 has no digits left for it.
                wide = np.longdouble if part.dtype.itemsize == 8 and part.dtype.kind in "iu" else np.float64
                np.subtract(part, wide(self.shift), out=target, casting="unsafe", dtype=wide)
            elif self.shift != 0.0 or self.factor != 1:
                native = part.astype(part.dtype.newbyteorder("="), copy=False)
                unsigned = native.view(f"u{part.dtype.itemsize}")
                if self.shift != 0.0:
                    # Taking 2^(n-1) off a signed number is turning over its highest bit.
                    unsigned = unsigned ^ unsigned.dtype.type(1 << (8 * part.dtype.itemsize - 1))
                np.multiply(unsigned, target.dtype.type(self.factor), out=target, dtype=target.dtype)
            else:
                target[...] = part
        return out


def choose(
    buffer: Buffer,
    kind: str,
    api: str,
    *,
    mapping: tuple[float, float] = (1.0, 0.0),
    filtering: bool = False,
    where: str = "field",
) -> Placement:
    """Pick the form of a buffer for a field of ``kind`` on ``api`` (gl, cl or cl64).

    ``mapping`` is the volume's own (scale, offset); ``filtering`` says that the device's texture units interpolate
    with exact weights. ParameterError, starting with ``where``, when shape or type does not fit the field.
    """
    shape, components = _split_shape(buffer, kind, where)
    large = buffer.nbytes // buffer.dtype.itemsize > 2**31 - 1
    if kind.endswith("u"):
        if buffer.dtype.kind != "u" or buffer.dtype.itemsize > 4:
            raise ParameterError(f"{where}: expected uint8, uint16 or uint32 ids, got {buffer.dtype}")
        return Placement(Storage(_code(buffer.dtype), large=large), shape, 1)
    if buffer.dtype.kind not in "iuf":
        raise ParameterError(f"{where}: expected integers or reals, got {buffer.dtype}")

    element, shift, factor, unorm = _element(buffer, kind, api)
    if element == "f4" and buffer.dtype.kind == "f" and buffer.dtype.itemsize > 4 and kind.startswith("field3"):
        _require_single(buffer, shift, where)
    scale, offset = mapping
    storage = Storage(
        element,
        components,
        scale,
        offset + shift * scale,
        filtered=filtering and api == "gl" and element != "u1",
        unorm=unorm,
        loss=_loss(buffer, element, shift),
        large=large,
    )
    padded = 4 if components == 3 and api == "gl" else components
    return Placement(storage, shape, padded, shift, factor)


def _split_shape(buffer: Buffer, kind: str, where: str) -> tuple[tuple[int, ...], int]:
    """Return the grid (z, y, x), (y, x) or (x,) and the number of components."""
    axes = FIELD_AXES[kind]
    names = {3: "(z, y, x", 2: "(y, x", 1: "(n"}[axes]
    shape = buffer.shape
    scalar_only = kind in ("field3", "field3u", "field2u")
    if len(shape) == axes + 1 and shape[-1] == 1 and kind != "field1":
        shape = shape[:-1]
    single = len(shape) == axes
    several = len(shape) == axes + 1 and 1 <= shape[-1] <= 4
    if 0 in shape or not (single or (several and not scalar_only)):
        expected = f"{names})" if scalar_only else f"{names}) or {names}, 1 to 4)"
        raise ParameterError(f"{where}: a {kind} expects data {expected}, got shape {buffer.shape}")
    return (shape, 1) if single else (shape[:-1], shape[-1])


def _element(buffer: Buffer, kind: str, api: str) -> tuple[str, float, int, float]:
    """Return (element, shift, factor, unorm): the row of the storage table."""
    dtype = buffer.dtype
    size = dtype.itemsize
    integer = dtype.kind in "iu"
    if api == "gl" and integer and size <= 2:
        low = -(2.0 ** (8 * size - 1)) if dtype.kind == "i" else 0.0
        if size == 2:
            return "u2", low, 1, 65535.0
        return ("u2", low, 257, 255.0) if 2 * buffer.nbytes <= WIDE_BYTES else ("u1", low, 1, 255.0)
    if dtype.kind == "f" and size == 2:
        return ("f2" if api == "gl" else "f4"), 0.0, 1, 0.0
    if (dtype.kind == "f" and size == 4) or (api != "gl" and integer and size <= 2):
        return _code(dtype), 0.0, 1, 0.0
    if api == "cl64":
        return (_code(dtype) if size == 4 else "f8"), 0.0, 1, 0.0
    # What is left has more digits than float32. A table or a picture is near 0; a volume may lie anywhere.
    return "f4", (_centre(buffer) if kind.startswith("field3") else 0.0), 1, 0.0


def item_bytes(dtype: np.dtype[Any], api: str) -> int:
    """Bytes of a number of a large volume of this type on a device: the storage table, without looking at the data."""
    if dtype.kind in "iu" and dtype.itemsize <= 2:
        return dtype.itemsize
    if dtype.kind == "f" and dtype.itemsize == 2:
        return 2 if api == "gl" else 4
    return 8 if api == "cl64" and dtype.itemsize == 8 else 4


def field_bytes(count: int, dtype: np.dtype[Any], api: str) -> int:
    """Bytes of a scalar volume of ``count`` voxels of this type on a device."""
    widened = api == "gl" and dtype.kind in "iu" and dtype.itemsize == 1 and 2 * count <= WIDE_BYTES
    return count * (2 if widened else item_bytes(dtype, api))


def share_range(part: Buffer, low: float, high: float) -> None:
    """Let a part of a volume be stored as the whole, whose least and greatest stored numbers these are."""
    _ranges[part] = (low, high)


def _code(dtype: np.dtype[Any]) -> str:
    return f"{dtype.kind}{dtype.itemsize}"


def _finite_range(buffer: Buffer) -> tuple[float, float]:
    """Return least and greatest finite number of a buffer, (0, 0) without any; computed once."""
    found = _ranges.get(buffer)
    if found is None:
        low, high = np.inf, -np.inf
        array = buffer.array
        step = max(1, SLAB_BYTES // max(1, array.nbytes // array.shape[0]))
        for first in range(0, array.shape[0], step):
            part = array[first : first + step]
            if part.dtype.kind == "f":
                part = part[np.isfinite(part)]
            if part.size:
                low, high = min(low, float(part.min())), max(high, float(part.max()))
        found = (low, high) if low <= high else (0.0, 0.0)
        _ranges[buffer] = found
    return found


def _centre(buffer: Buffer) -> float:
    """Return the offset about which a volume is stored: the middle of its range, a whole number where it can be."""
    low, high = _finite_range(buffer)
    middle = low + (high - low) / 2
    spread = high - low
    if buffer.dtype.kind in "iu":
        # Small integers need no offset, and without one equal values stay equal to what was written.
        return 0.0 if max(abs(low), abs(high)) <= 2**24 else float(np.floor(middle))
    # Below this, float32 about 0 is as good: no accuracy is gained by moving the data.
    return 0.0 if abs(middle) <= spread else float(middle)


def _require_single(buffer: Buffer, shift: float, where: str) -> None:
    """Raise ParameterError when single precision would make all values infinite, or all of them 0."""
    largest = max(abs(value - shift) for value in _finite_range(buffer))
    limits = np.finfo(np.float32)
    if largest > float(limits.max) or 0.0 < largest < float(limits.tiny):
        raise ParameterError(
            f"{where}: values as {'great' if largest > 1.0 else 'small'} as {largest:g} do not fit into single "
            f"precision; rescale the volume, or use --device cl64"
        )


def _loss(buffer: Buffer, element: str, shift: float) -> str:
    """Say what storing costs, "" when nothing."""
    dtype = buffer.dtype
    if element != "f4" or dtype == np.float32 or (dtype.kind == "f" and dtype.itemsize == 2):
        if element == "f8" and dtype.kind in "iu" and dtype.itemsize == 8:
            return f"{dtype} kept as float64: integers beyond 2^53 are rounded"
        return ""
    if dtype.kind in "iu" and dtype.itemsize <= 2:
        return ""
    low, high = _finite_range(buffer)
    largest = max(abs(low - shift), abs(high - shift))
    if dtype.kind in "iu" and largest <= 2**24:
        return ""
    about = f" about {shift:.9g}" if shift else ""
    return f"{dtype} kept as float32{about}: errors up to {largest * 2.0**-24:.3g} stored units"
