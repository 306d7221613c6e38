"""NRRD, with the data behind the header (.nrrd) or in another file (.nhdr, read only).

Encodings raw (mapped), gzip, bzip2 and text; any space, units and byte order. An axis of components may come first or
last. Stored numbers are kept as they are; a quantisation range ("old min", "old max") is not applied.
"""

from __future__ import annotations

import bz2
import gzip
import warnings
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from nodegraph.data import Mapping, Value, Volume
from nodegraph.data.buffer import Array
from nodegraph.errors import FormatError
from nodegraph.formats import raw
from nodegraph.formats.atomic import replacing
from nodegraph.formats.nrrd_header import Header, parse

suffixes = (".nrrd", ".nhdr")


def read(path: Path, *, time: int = 0, fourth_axis: str = "auto") -> Volume:
    """Return one time step as a volume, all its components side by side."""
    path = Path(path)
    header = parse(path, fourth_axis)
    times = header.sizes[header.time] if header.time is not None else 1
    time = raw.pick_time(time, times, path)
    array = raw.usable(_stored(path, header), path)
    axes = [len(header.sizes) - 1 - axis for axis in reversed(header.spatial)]  # of the array: slowest first
    index: list[Any] = [slice(None)] * array.ndim
    if header.time is not None:
        index[array.ndim - 1 - header.time] = slice(time, time + 1)
        axes.append(array.ndim - 1 - header.time)
    if header.component is not None:
        axes.append(array.ndim - 1 - header.component)
    part = array[tuple(index)].transpose(axes)
    x, y, z = header.dims
    count = header.sizes[header.component] if header.component is not None else 1
    part = part.reshape((z, y, x, count) if count > 1 else (z, y, x))
    if times > 1 and header.encoding != "raw":
        part = part.copy()  # not a view that keeps all time steps in memory
    return raw.make_volume(path, part, header.index_to_world, Mapping(unit=header.unit))


def info(path: Path) -> dict[str, Any]:
    """What the header says."""
    header = parse(Path(path), "auto")
    return {
        "kind": "Volume",
        "format": f"NRRD, {header.encoding}",
        "size": list(header.dims),
        "type": header.dtype.name,
        "components": 1 if header.component is None else header.sizes[header.component],
        "times": 1 if header.time is None else header.sizes[header.time],
        "spacing": raw.spacing_of(header.index_to_world),
        "index_to_world": header.index_to_world.tolist(),
        "orientation": header.space or "spacing only",
        "unit": header.unit,
    }


def write(value: Value, path: Path, *, compress: bool = True) -> None:
    """Write a volume or labels, gzipped unless ``compress=False``.

    NRRD has no scaling of values: where a volume has one, the real values are written, as float32, or as float64 where
    float32 could not hold the stored numbers.
    """
    path = Path(path)
    grid = raw.expect_grid(value, path, "NRRD")
    if path.suffix.lower() == ".nhdr":
        raise FormatError("detached headers are only read; write .nrrd", file=str(path))
    data, unit = grid.data, ""
    if isinstance(grid, Volume):
        unit = grid.mapping.unit
        if grid.mapping[:2] != (1.0, 0.0):
            data = grid.real(np.float64 if data.dtype.itemsize > 2 and data.dtype != np.float32 else np.float32)
    data = raw.usable(data, path)
    if data.dtype == np.float16:
        data = data.astype(np.float32)
    with replacing(path) as part, open(part, "wb") as file:
        file.write(_header(data, grid.index_to_world, unit, compress).encode())
        if compress:
            with gzip.GzipFile("", "wb", 6, file, mtime=0) as stream:
                for piece in raw.pieces(data):
                    stream.write(piece.data.cast("B"))
        else:
            raw.write_array(file, data)


def _header(data: Array, matrix: Array, unit: str, compress: bool) -> str:
    names = {"u1": "uint8", "i1": "int8", "u2": "uint16", "i2": "int16", "u4": "uint32", "i4": "int32"}
    vectors = [f"({','.join(repr(float(v)) for v in matrix[:3, i])})" for i in range(3)]
    sizes, kinds = [str(n) for n in data.shape[2::-1]], ["domain"] * 3
    if data.ndim == 4:
        sizes, kinds, vectors = [str(data.shape[3]), *sizes], ["vector", *kinds], ["none", *vectors]
    lines = [
        "NRRD0005",
        f"type: {names.get(data.dtype.str[1:], 'float' if data.dtype.itemsize == 4 else 'double')}",
        f"dimension: {len(sizes)}",
        "space: left-posterior-superior",
        f"sizes: {' '.join(sizes)}",
        f"space directions: {' '.join(vectors)}",
        f"kinds: {' '.join(kinds)}",
        f"endian: {'little' if np.little_endian else 'big'}",
        f"encoding: {'gzip' if compress else 'raw'}",
        'space units: "mm" "mm" "mm"',
        f"space origin: ({','.join(repr(float(v)) for v in matrix[:3, 3])})",
    ]
    if unit:
        lines.append(f"sample units: {' '.join(unit.split())}")
    return "\n".join(lines) + "\n\n"


def _stored(path: Path, header: Header) -> Array:
    """The whole array as it is stored, slowest axis first."""
    shape = tuple(reversed(header.sizes))
    file_path = header.data_file
    if header.byte_skip < -1 or header.line_skip < 0 or (header.byte_skip == -1 and header.encoding != "raw"):
        raise FormatError(
            f"cannot skip {header.byte_skip} bytes and {header.line_skip} lines", file=str(path), field="byte skip"
        )
    with open(file_path, "rb") as file:
        file.seek(header.data_offset)
        for _ in range(header.line_skip):
            if not file.readline(1 << 20):
                raise FormatError("the file has fewer lines", file=str(path), field="line skip")
        offset = file.tell()
        if header.encoding == "raw":
            if header.byte_skip == -1:
                offset = max(offset, file_path.stat().st_size - raw.count_bytes(shape, header.dtype))
            else:
                offset += header.byte_skip
            return raw.map_array(file_path, offset, header.dtype, shape)
        if header.encoding == "text":
            file.seek(header.byte_skip, 1)
            return _text(path, file, header.dtype, shape)
        return _packed(path, file, header, shape, file_path.stat().st_size - offset)


def _packed(path: Path, file: BinaryIO, header: Header, shape: tuple[int, ...], there: int) -> Array:
    if header.encoding == "gzip":
        raw.check_packed(raw.count_bytes(shape, header.dtype) + header.byte_skip, there, path)
    array = raw.allocate(shape, header.dtype, path)
    with gzip.GzipFile(fileobj=file) if header.encoding == "gzip" else bz2.BZ2File(file) as stream:
        raw.skip(stream, header.byte_skip, path)
        raw.unpack(stream, array, path)
        raw.finish(stream, path)
    return array


def _text(path: Path, file: BinaryIO, dtype: np.dtype[Any], shape: tuple[int, ...]) -> Array:
    """Numbers in writing: at least a digit and a blank each, so the size of the file bounds their count."""
    start = file.tell()
    there = file.seek(0, 2) - start
    file.seek(start)
    count = raw.count_bytes(shape, np.dtype("u1"))
    if 2 * count - 1 > there:
        raise FormatError(f"the header promises {count} numbers, which {there} characters cannot hold", file=str(path))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            parsed = np.fromstring(
                file.read().replace(b",", b" ").decode("ascii"), np.float64 if dtype.kind == "f" else np.int64, sep=" "
            )
        except (ValueError, DeprecationWarning):
            raise FormatError("the data is not made of numbers", file=str(path), field="data") from None
    if parsed.size < count:
        raise FormatError(f"{parsed.size} numbers, {count} are promised", file=str(path), field="data")
    parsed = parsed[:count]
    if dtype.kind != "f" and (parsed.min() < np.iinfo(dtype).min or parsed.max() > np.iinfo(dtype).max):
        raise FormatError(f"{parsed.min()}..{parsed.max()} do not fit into {dtype}", file=str(path), field="data")
    return parsed.astype(dtype).reshape(shape)
