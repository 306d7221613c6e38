"""NumPy: .npy, and .npz with the place of the voxels beside them.

A .npy array is (z, y, x) or (z, y, x, c), with voxels of 1 mm centred at the world's origin. A .npz archive holds

    data            (z, y, x) or (z, y, x, c)
    index_to_world  4x4, mm LPS; or spacing (x, y, z) mm, with origin (x, y, z) mm where it is known
    scale, offset   real = stored * scale + offset; unit: a string
    label_ids, label_names   for labels

or, instead of data, an image: color (h, w, c) linear premultiplied, with depth and ids where it has them. An archive
with a single array of any name is taken as its data. Uncompressed arrays are mapped, in archives too. Nothing is ever
unpickled.
"""

from __future__ import annotations

import contextlib
import io
import struct
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.lib import format as npy_format

from nodegraph.data import Image, Labels, Mapping, Value, Volume
from nodegraph.data.buffer import Array
from nodegraph.data.space import affine, centred
from nodegraph.errors import FormatError, PortError
from nodegraph.formats import raw
from nodegraph.formats.atomic import replacing

suffixes = (".npy", ".npz")
HEADER_LIMIT = 1 << 16
SMALL = 1 << 20
"""Bytes that anything beside the bulk data may have."""


class Stored(NamedTuple):
    """The header of one array: where its data begins in the (decompressed) stream, and what it is."""

    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    fortran: bool
    offset: int


def read(path: Path, *, time: int = 0) -> Value:
    """Return the volume or image in a file. A fifth axis, in front, is time."""
    path = Path(path)
    if path.suffix.lower() == ".npy":
        with open(path, "rb") as file:
            stored = _stored(file, path)
        return _volume(path, _map(path, stored), {}, time)
    with _open(path) as archive:
        names = _names(archive)
        if "color" in names:
            return _image(path, archive, names)
        return _volume(path, _bulk(path, archive, _main(names, path)), _rest(path, archive, names), time)


def read_labels(path: Path, *, time: int = 0) -> Labels:
    """Return labels, with their names where an archive has them."""
    path = Path(path)
    volume = read(path, time=time)
    if not isinstance(volume, Volume):
        raise FormatError(f"holds {volume.kind}, not labels", file=str(path))
    labels = raw.to_labels(volume, path)
    if path.suffix.lower() == ".npz":
        with _open(path) as archive:
            rest = _rest(path, archive, _names(archive))
        ids, names = rest.get("label_ids"), rest.get("label_names")
        if ids is not None and names is not None:
            if ids.dtype.kind not in "iu" or ids.shape != names.shape or ids.ndim != 1:
                raise FormatError("expected as many ids as names", file=str(path), field="label_names")
            named = dict(zip(ids.tolist(), _texts(path, rest, "label_names"), strict=True))
            return Labels(labels.buffer, labels.index_to_world, named)
    return labels


def info(path: Path) -> dict[str, Any]:
    """What the headers say."""
    path = Path(path)
    if path.suffix.lower() == ".npy":
        with open(path, "rb") as file:
            stored = _stored(file, path)
        rest: dict[str, Array] = {}
    else:
        with _open(path) as archive:
            names = _names(archive)
            with archive.open(names["color"] if "color" in names else _main(names, path)) as stream:
                stored = _stored(stream, path)
            rest = _rest(path, archive, names)
            if "color" in names:
                h, w = stored.shape[:2]
                return {"kind": "Image", "format": "NumPy", "size": [w, h], "type": stored.dtype.name}
    shape = stored.shape
    times, grid = (shape[0], shape[1:4]) if len(shape) == 5 else (1, shape[:3])
    if len(grid) != 3:
        raise FormatError(f"expected (z, y, x), (z, y, x, c) or (t, z, y, x, c), got {shape}", file=str(path))
    matrix = _matrix(path, rest, grid)
    return {
        "kind": "Volume",
        "format": "NumPy",
        "size": list(grid[::-1]),
        "type": stored.dtype.name,
        "components": shape[-1] if len(shape) > 3 else 1,
        "times": times,
        "spacing": raw.spacing_of(matrix),
        "index_to_world": matrix.tolist(),
    }


def write(value: Value, path: Path, *, compress: bool = False) -> None:
    """Write a volume or labels; to .npz also where its voxels lie, or an image. Only .npz may be compressed.

    A .npy file has no place for a mapping, so the real values are written there, as float32.
    """
    path = Path(path)
    if path.suffix.lower() == ".npy":
        grid = raw.expect_grid(value, path, ".npy")
        data = grid.data
        if isinstance(grid, Volume) and grid.mapping[:2] != (1.0, 0.0):
            data = grid.real()
        with replacing(path) as part, open(part, "wb") as file:
            npy_format.write_array(file, data, allow_pickle=False)
        return
    arrays = _arrays(value, path)
    with replacing(path) as part, open(part, "wb") as file:
        (np.savez_compressed if compress else np.savez)(file, allow_pickle=False, **arrays)


def _arrays(value: Value, path: Path) -> dict[str, Any]:
    if isinstance(value, Image):
        extras = {"color": value.color, "depth": value.depth, "ids": value.ids}
        return {name: array for name, array in extras.items() if array is not None}
    grid = raw.expect_grid(value, path, ".npz")
    arrays: dict[str, Any] = {"data": grid.data, "index_to_world": grid.index_to_world}
    if isinstance(grid, Volume):
        arrays |= {"scale": grid.mapping.scale, "offset": grid.mapping.offset, "unit": grid.mapping.unit}
    if isinstance(grid, Labels) and grid.names:
        arrays["label_ids"] = np.array(list(grid.names), np.uint32)
        arrays["label_names"] = np.array(list(grid.names.values()), np.str_)
    return {name: np.asarray(array) for name, array in arrays.items()}


def _volume(path: Path, array: Array, rest: dict[str, Array], time: int) -> Volume:
    times = array.shape[0] if array.ndim == 5 else 1
    time = raw.pick_time(time, times, path)
    if array.ndim == 5:
        array = array[time]
    if array.ndim not in (3, 4):
        raise FormatError(
            f"expected (z, y, x), (z, y, x, c) or (t, z, y, x, c), got {array.shape}", file=str(path), field="shape"
        )
    array = raw.usable(array, path, "dtype")
    matrix = _matrix(path, rest, array.shape[:3])
    unit = _texts(path, rest, "unit")[0] if "unit" in rest else ""
    mapping = Mapping(_number(path, rest, "scale", 1.0), _number(path, rest, "offset", 0.0), unit)
    return raw.make_volume(path, array, matrix, mapping)


def _image(path: Path, archive: zipfile.ZipFile, names: dict[str, zipfile.ZipInfo]) -> Image:
    parts = {name: _bulk(path, archive, names[name]) for name in ("color", "depth", "ids") if name in names}
    try:
        return Image(
            **{name: array if name == "ids" else raw.usable(array, path, name) for name, array in parts.items()}
        )
    except PortError as error:
        raise FormatError(str(error), file=str(path)) from None


def _matrix(path: Path, rest: dict[str, Array], shape: tuple[int, ...]) -> Array:
    matrix = rest.get("index_to_world", rest.get("affine"))
    if matrix is not None:
        if matrix.shape != (4, 4) or matrix.dtype.kind not in "fiu":
            raise FormatError(f"expected 4x4 numbers, got {matrix.shape}", file=str(path), field="index_to_world")
        return matrix.astype(np.float64)
    spacing, origin = (_vector(path, rest, name) for name in ("spacing", "origin"))
    if spacing is None:
        spacing = [1.0, 1.0, 1.0]
    return centred(shape[::-1], spacing) if origin is None else affine(spacing, origin)


def _vector(path: Path, rest: dict[str, Array], name: str) -> list[float] | None:
    if name not in rest:
        return None
    vector = rest[name]
    if vector.shape != (3,) or vector.dtype.kind not in "fiu" or not np.isfinite(vector).all():
        raise FormatError(f"expected three finite numbers (x, y, z), got {vector}", file=str(path), field=name)
    return [float(v) for v in vector]


def _number(path: Path, rest: dict[str, Array], name: str, default: float) -> float:
    if name not in rest:
        return default
    value = rest[name]
    if value.size != 1 or value.dtype.kind not in "fiu":
        raise FormatError(f"expected one number, got {value.shape}", file=str(path), field=name)
    return float(value.reshape(-1)[0])


def _texts(path: Path, rest: dict[str, Array], name: str) -> list[str]:
    try:
        return [str(text) for text in rest[name].reshape(-1)] or [""]
    except (SystemError, ValueError):  # damaged, so that no characters have these numbers
        raise FormatError("expected text", file=str(path), field=name) from None


def _stored(stream: Any, path: Path) -> Stored:
    """Parse the header of one array, having looked first how long it claims to be."""
    begin = stream.tell()
    try:
        front = stream.read(12)
        width = 2 if front[6:7] == b"\x01" else 4
        length = int.from_bytes(front[8 : 8 + width], "little")
        if length > HEADER_LIMIT:
            raise ValueError(f"it claims to be {length} bytes long")
        block = io.BytesIO(front + stream.read(max(0, 8 + width + length - 12)))
        version = npy_format.read_magic(block)
        reader = npy_format.read_array_header_1_0 if version == (1, 0) else npy_format.read_array_header_2_0
        shape, fortran, dtype = reader(block)
    except Exception as error:  # numpy parses the header as Python, and lets errors of many kinds through
        text = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FormatError(f"no NumPy header: {text}", file=str(path), field="header") from None
    if dtype.hasobject:
        raise FormatError("Python objects are never read; store plain numbers", file=str(path), field="dtype")
    if any(n < 0 for n in shape) or 0 in shape:
        raise FormatError(f"the array is empty, its shape is {shape}", file=str(path), field="shape")
    return Stored(tuple(shape), dtype, bool(fortran), begin + block.tell())


def _map(path: Path, stored: Stored) -> Array:
    shape = stored.shape[::-1] if stored.fortran else stored.shape
    array = raw.map_array(path, stored.offset, stored.dtype, shape, "shape")
    return array.T if stored.fortran else array


@contextlib.contextmanager
def _open(path: Path) -> Iterator[zipfile.ZipFile]:
    """An archive; what the library refuses while it is open is an error of the file."""
    try:
        with zipfile.ZipFile(path) as archive:
            yield archive
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, ValueError, OverflowError, EOFError) as error:
        raise FormatError(f"no readable .npz archive: {error}", file=str(path)) from None


def _names(archive: zipfile.ZipFile) -> dict[str, zipfile.ZipInfo]:
    """The arrays of an archive by name. Names are only compared, never used as paths."""
    return {i.filename.removesuffix(".npy"): i for i in archive.infolist() if i.filename.endswith(".npy")}


def _main(names: dict[str, zipfile.ZipInfo], path: Path) -> zipfile.ZipInfo:
    if "data" in names:
        return names["data"]
    if len(names) == 1:
        return next(iter(names.values()))
    listed = ", ".join(sorted(names)[:8]) or "nothing"
    raise FormatError(f"no array is called 'data'; the archive holds {listed}", file=str(path), field="data")


def _rest(path: Path, archive: zipfile.ZipFile, names: dict[str, zipfile.ZipInfo]) -> dict[str, Array]:
    """The small arrays beside the data."""
    known = ("index_to_world", "affine", "spacing", "origin", "scale", "offset", "unit", "label_ids", "label_names")
    found: dict[str, Array] = {}
    for name in known:
        if name in names:
            if names[name].file_size > SMALL:
                raise FormatError(f"{names[name].file_size} bytes are too many", file=str(path), field=name)
            found[name] = _bulk(path, archive, names[name])
    return found


def _bulk(path: Path, archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> Array:
    """One array of an archive: mapped where it is stored, unpacked where it is deflated."""
    if entry.flag_bits & 1:
        raise FormatError("the archive is encrypted", file=str(path))
    if entry.compress_type == zipfile.ZIP_STORED:
        start = _start(path, entry)
        with open(path, "rb") as file:
            file.seek(start)
            stored = _stored(file, path)
        return _map(path, stored)
    if entry.compress_type != zipfile.ZIP_DEFLATED:
        raise FormatError("only deflated archives are read; write it with numpy.savez_compressed", file=str(path))
    with archive.open(entry) as stream:
        stored = _stored(stream, path)
        raw.check_packed(raw.count_bytes(stored.shape, stored.dtype), entry.compress_size, path, "shape")
        shape = stored.shape[::-1] if stored.fortran else stored.shape
        array = raw.allocate(shape, stored.dtype, path)
        raw.unpack(stream, array, path)
        raw.finish(stream, path)
    return array.T if stored.fortran else array


def _start(path: Path, entry: zipfile.ZipInfo) -> int:
    """Where the data of an entry begins: behind its local header, whose name and extra field have their own lengths."""
    with open(path, "rb") as file:
        file.seek(entry.header_offset)
        local = file.read(30)
    if len(local) < 30 or local[:4] != b"PK\x03\x04":
        raise FormatError("the archive is damaged: a local header is missing", file=str(path))
    name, extra = struct.unpack("<HH", local[26:30])
    return entry.header_offset + 30 + int(name) + int(extra)
