"""From bytes in a file to an array, and back: what the volume formats share.

A header is a claim. It is held against the size of the file before memory is taken for it, and compressed data is
never unpacked beyond what the header promised.
"""

from __future__ import annotations

import math
import os
import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import numpy as np

from nodegraph.data.buffer import Array
from nodegraph.data.volume import Grid, Labels, Volume, slabs
from nodegraph.errors import FormatError, PortError

CHUNK = 1 << 18

DEFLATE_RATIO = 1032
"""Deflate packs no more than 1032 bytes into one (a match of 258 bytes in two bits)."""


class Readable(Protocol):
    """Anything that hands out decompressed bytes in order."""

    def read(self, size: int, /) -> bytes: ...


def count_bytes(shape: Sequence[int], dtype: np.dtype[Any]) -> int:
    """Bytes of an array, in Python's integers: what a header promises may not fit into 64 bits."""
    return math.prod(int(n) for n in shape) * dtype.itemsize


def map_array(path: str | Path, offset: int, dtype: np.dtype[Any], shape: Sequence[int], field: str = "sizes") -> Array:
    """The array that lies uncompressed at ``offset``, mapped read-only: nothing is read before it is needed."""
    wanted, there = count_bytes(shape, dtype), os.path.getsize(path) - offset
    if wanted > there:
        raise FormatError(
            f"the header promises {wanted} bytes of data, the file has {max(there, 0)}; it is cut short",
            file=str(path),
            field=field,
        )
    return np.memmap(path, dtype, "r", offset, tuple(int(n) for n in shape)).view(np.ndarray)


def check_packed(wanted: int, packed: int, path: str | Path, field: str = "sizes") -> None:
    """Refuse a header that promises more than ``packed`` bytes of deflate data can hold."""
    if wanted > packed * DEFLATE_RATIO:
        raise FormatError(
            f"the header promises {wanted} bytes, which {packed} compressed bytes cannot hold; the header is wrong",
            file=str(path),
            field=field,
        )


def unpack(stream: Readable, into: Array, path: str | Path) -> None:
    """Fill a C-contiguous array from a decompressing stream, and take not a byte more."""
    flat = into.reshape(-1).view(np.uint8)
    done, wanted = 0, flat.size
    while done < wanted:
        piece = _read(stream, min(CHUNK, wanted - done), path)
        if not piece:
            raise FormatError(
                f"the data ends after {done} of {wanted} bytes; the file is cut short", file=str(path), field="data"
            )
        flat[done : done + len(piece)] = np.frombuffer(piece, np.uint8)
        done += len(piece)


def take(stream: Readable, count: int, path: str | Path) -> bytes:
    """The next ``count`` bytes, or fewer at the end of the data."""
    return _read(stream, count, path)


def skip(stream: Readable, count: int, path: str | Path) -> None:
    """Pass over so many bytes of a stream that cannot seek."""
    while count > 0:
        piece = _read(stream, min(CHUNK, count), path)
        if not piece:
            raise FormatError(
                "the data ends before its first byte; the file is cut short", file=str(path), field="data"
            )
        count -= len(piece)


def finish(stream: Readable, path: str | Path) -> None:
    """Ask for one more byte: at the end of the data this makes the decompressor verify its checksum."""
    _read(stream, 1, path)


def _read(stream: Readable, size: int, path: str | Path) -> bytes:
    try:
        return stream.read(size)
    except (OSError, EOFError, zlib.error) as error:
        raise FormatError(f"the compressed data is damaged: {error}", file=str(path), field="data") from None


def allocate(shape: Sequence[int], dtype: np.dtype[Any], path: str | Path) -> Array:
    """An array to be filled; FormatError where memory does not suffice."""
    try:
        return np.empty(tuple(shape), dtype)
    except (MemoryError, ValueError):
        size = count_bytes(shape, dtype) / 2**30
        raise FormatError(f"{size:.1f} GiB do not fit into memory; crop the file first", file=str(path)) from None


def usable(array: Array, path: str | Path, field: str = "type") -> Array:
    """The array in a type that volumes may have, in the byte order of this machine; a view where possible.

    Booleans are viewed as uint8; 64-bit integers are stored in 32 bits where the values allow it.
    """
    if array.dtype.kind == "b":
        return array.view(np.uint8)
    if array.dtype.kind == "c":
        raise FormatError("complex numbers; store their magnitude or their parts instead", file=str(path), field=field)
    if array.dtype.kind not in "iuf" or array.dtype.itemsize > 8:
        raise FormatError(
            f"numbers of type {array.dtype}; store integers up to 32 bits or reals of 16, 32 or 64 bits instead",
            file=str(path),
            field=field,
        )
    if array.dtype.kind in "iu" and array.dtype.itemsize == 8:
        return _narrow(array, path, field)
    if not array.dtype.isnative:
        native = array.dtype.newbyteorder("=")
        if array.flags.writeable and array.flags.c_contiguous:
            return array.byteswap(inplace=True).view(native)
        return array.astype(native)
    return array


def _narrow(array: Array, path: str | Path, field: str) -> Array:
    """64-bit integers as int32 or uint32, slab by slab."""
    low = min((int(array[s].min()) for s in slabs(array)), default=0)
    high = max((int(array[s].max()) for s in slabs(array)), default=0)
    for dtype in (np.dtype(np.int32), np.dtype(np.uint32)):
        if np.iinfo(dtype).min <= low and high <= np.iinfo(dtype).max:
            result = allocate(array.shape, dtype, path)
            for s in slabs(array):
                result[s] = array[s]
            return result
    raise FormatError(
        f"64-bit integers {low}..{high} do not fit into 32 bits; store them as float64 or subtract an offset",
        file=str(path),
        field=field,
    )


def to_labels(volume: Volume, path: str | Path) -> Labels:
    """Ids out of stored numbers; reals are accepted where they are whole numbers, which some programs write."""
    data = volume.data
    if volume.components != 1:
        raise FormatError(f"labels have one id per voxel, this file has {volume.components} numbers", file=str(path))
    if volume.mapping[:2] != (1.0, 0.0):
        raise FormatError("ids cannot be scaled, and this file has a scale; write it without one", file=str(path))
    try:
        if data.dtype.kind != "f":
            return Labels(data, volume.index_to_world)
        ids = allocate(data.shape, np.dtype(np.uint32), path)
        for s in slabs(data):
            part = data[s]
            if not ((part >= 0) & (part <= 0xFFFFFFFF)).all() or not (part == np.floor(part)).all():
                raise FormatError("labels are whole numbers of at least 0, this file holds others", file=str(path))
            ids[s] = part
        return Labels(ids, volume.index_to_world)
    except PortError as error:
        raise FormatError(str(error), file=str(path)) from None


@np.errstate(over="ignore", invalid="ignore")
def spacing_of(matrix: Array) -> list[float]:
    """Spacing (x, y, z) of an index-to-world matrix, which may be damaged."""
    return [float(length) for length in np.linalg.norm(matrix[:3, :3], axis=0)]


def make_volume(path: str | Path, *arguments: Any) -> Volume:
    """A Volume of what was read; what it refuses is an error of the file."""
    try:
        return Volume(*arguments)
    except PortError as error:
        raise FormatError(str(error), file=str(path)) from None


def write_array(stream: BinaryIO, array: Array) -> None:
    """Write an array in C order, slab by slab, so that no copy as large as a volume is made."""
    for piece in pieces(array):
        stream.write(piece.data.cast("B"))


def pieces(array: Array) -> Iterator[Array]:
    """C-contiguous parts of an array, of a few MB each, in order."""
    for s in slabs(array):
        yield np.ascontiguousarray(array[s])


def pick_time(time: int, times: int, path: str | Path) -> int:
    """The index of a time step that is there."""
    if not 0 <= time < times:
        raise FormatError(f"step {time} is outside 0..{times - 1}", file=str(path), field="time")
    return time


def expect_grid(value: Any, path: str | Path, name: str) -> Grid:
    """The value, if it is a volume or labels; FormatError otherwise."""
    if not isinstance(value, Grid):
        kind = getattr(value, "kind", type(value).__name__)
        raise FormatError(f"{name} holds volumes and labels, this is {kind}; choose another suffix", file=str(path))
    return value
