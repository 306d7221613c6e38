"""NIfTI-1 and NIfTI-2, one file, plain or gzipped: .nii, .nii.gz.

Uncompressed data is mapped; compressed data is unpacked once. The stored numbers stay as they are, the scaling of the
header becomes the mapping of the volume. A fourth axis is time unless the header's intent or the caller says that it
holds components; a fifth axis holds components. RGB24 and RGBA32 are read as 3 or 4 components of uint8.
"""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any, cast

import numpy as np

from nodegraph.data import Labels, Mapping, Value, Volume
from nodegraph.data.buffer import Array
from nodegraph.errors import FormatError
from nodegraph.formats import raw
from nodegraph.formats.atomic import replacing
from nodegraph.formats.nifti_header import LABEL, Header, build, parse

suffixes = (".nii", ".nii.gz")
GZIP = b"\x1f\x8b"


def read(path: Path, *, time: int = 0, fourth_axis: str = "auto") -> Volume:
    """Return one time step as a volume, all its components side by side."""
    path = Path(path)
    header, packed = _header(path, fourth_axis)
    time = raw.pick_time(time, header.times, path)
    array = _unpacked(path, header, time) if packed else _mapped(path, header, time)
    array = raw.usable(array, path, "datatype")
    if header.colours > 1:
        array = array[0]
    elif header.components == 1:
        array = array[0]
    else:
        array = np.moveaxis(array, 0, -1)
    return raw.make_volume(path, array, header.index_to_world, header.mapping)


def info(path: Path) -> dict[str, Any]:
    """What the header says."""
    path = Path(path)
    header, packed = _header(path, "auto")
    return {
        "kind": "Volume",
        "format": f"NIfTI-{header.version}{', gzip' if packed else ''}",
        "size": list(header.dims),
        "type": header.dtype.name,
        "components": header.components * header.colours,
        "times": header.times,
        "spacing": raw.spacing_of(header.index_to_world),
        "index_to_world": header.index_to_world.tolist(),
        "orientation": header.orientation,
        "scale": header.mapping.scale,
        "offset": header.mapping.offset,
        "labels": header.intent == LABEL,
    }


def write(value: Value, path: Path) -> None:
    """Write a volume or labels; a name that ends in .gz is compressed. The unit of the values has no place here."""
    path = Path(path)
    grid = raw.expect_grid(value, path, "NIfTI")
    data = raw.usable(grid.data, path, "datatype")
    if data.dtype == np.float16:
        data = data.astype(np.float32)
    mapping = grid.mapping if isinstance(grid, Volume) else Mapping()
    components = data.shape[3] if data.ndim == 4 else 1
    intent = LABEL if isinstance(grid, Labels) else 0
    header = build(data.dtype, grid.dims, components, grid.index_to_world, mapping, intent)
    with replacing(path) as part, open(part, "wb") as file:
        if path.name.lower().endswith(".gz"):
            with gzip.GzipFile("", "wb", 6, file, mtime=0) as stream:
                _write(cast(Any, stream), header, data)
        else:
            _write(file, header, data)


def _write(stream: Any, header: bytes, data: Array) -> None:
    stream.write(header)
    for component in np.moveaxis(data, 3, 0) if data.ndim == 4 else (data,):
        raw.write_array(stream, component)


def _header(path: Path, fourth_axis: str) -> tuple[Header, bool]:
    """The checked header, and whether the file is gzipped, which its first bytes say better than its name."""
    if fourth_axis not in ("auto", "time", "components"):
        raise FormatError(
            f"expected auto, time or components, got {fourth_axis!r}", file=str(path), field="fourth_axis"
        )
    with open(path, "rb") as file:
        packed = file.read(2) == GZIP
        file.seek(0)
        if packed:
            with gzip.GzipFile(fileobj=file) as stream:
                block = raw.take(stream, 540, path)
        else:
            block = file.read(540)
    return parse(block, path, fourth_axis), packed


def _shape(header: Header) -> tuple[int, ...]:
    """Shape of the stored data, slowest axis first."""
    x, y, z = header.dims
    return (header.components, header.times, z, y, x, *((header.colours,) if header.colours > 1 else ()))


def _mapped(path: Path, header: Header, time: int) -> Array:
    array: Array = raw.map_array(path, header.offset, header.dtype, _shape(header), "dim")[:, time]
    return array


def _unpacked(path: Path, header: Header, time: int) -> Array:
    """(components, z, y, x[, colour]) of one time step; what lies between is passed over."""
    components, times, *frame = _shape(header)
    frame_bytes = raw.count_bytes(frame, header.dtype)
    raw.check_packed(header.offset + components * times * frame_bytes, path.stat().st_size, path, "dim")
    result = raw.allocate((components, *frame), header.dtype, path)
    with open(path, "rb") as file, gzip.GzipFile(fileobj=file) as stream:
        raw.skip(stream, header.offset + time * frame_bytes, path)
        for c in range(components):
            if c:
                raw.skip(stream, (times - 1) * frame_bytes, path)
            raw.unpack(stream, result[c], path)
        if time == times - 1:
            raw.finish(stream, path)
    return result
