"""The header of NRRD: what each axis means, where the voxels lie, where the data is.

Source: teem.sourceforge.net/nrrd/format.html.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nodegraph.data.space import Matrix
from nodegraph.errors import FormatError

HEADER_LIMIT = 1 << 20

TYPES = {
    "u1": "uchar, unsigned char, uint8, uint8_t", "i1": "signed char, int8, int8_t",
    "u2": "ushort, unsigned short, unsigned short int, uint16, uint16_t",
    "i2": "short, short int, signed short, signed short int, int16, int16_t",
    "u4": "uint, unsigned int, uint32, uint32_t", "i4": "int, signed int, int32, int32_t",
    "u8": "ulonglong, unsigned long long, unsigned long long int, uint64, uint64_t",
    "i8": "longlong, long long, long long int, signed long long, signed long long int, int64, int64_t",
    "f4": "float", "f8": "double",
}  # fmt: skip
CODE_OF = {name: code for code, names in TYPES.items() for name in names.split(", ")}

ENCODINGS = {
    "raw": "raw", "gzip": "gzip", "gz": "gzip", "bzip2": "bzip2", "bz2": "bzip2",
    "ascii": "text", "text": "text", "txt": "text",
}  # fmt: skip

SPACES = {
    "left-posterior-superior": (1, 1, 1), "lps": (1, 1, 1),
    "right-anterior-superior": (-1, -1, 1), "ras": (-1, -1, 1),
    "left-anterior-superior": (1, -1, 1), "las": (1, -1, 1),
    "scanner-xyz": (1, 1, 1), "3d-right-handed": (1, 1, 1), "3d-left-handed": (1, 1, 1),
}  # fmt: skip
"""Signs that take a space of the file to LPS. Spaces that are not anatomical are taken as they are."""

UNITS = {"": 1.0, "mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 1e-3, "µm": 1e-3, "μm": 1e-3, "micron": 1e-3, "nm": 1e-6}
SPATIAL_KINDS = ("domain", "space")


class Header(NamedTuple):
    """What a header says, checked. Axes are numbered as in the file, fastest first."""

    dtype: np.dtype[Any]
    encoding: str  #: raw, gzip, bzip2 or text
    sizes: tuple[int, ...]
    spatial: tuple[int, ...]  #: one to three axes
    time: int | None
    component: int | None
    index_to_world: Matrix  #: LPS, mm
    space: str  #: as the file calls it; "" where it has none
    unit: str  #: of the values
    data_file: Path
    data_offset: int  #: where data begins before anything is skipped
    line_skip: int
    byte_skip: int

    @property
    def dims(self) -> tuple[int, int, int]:
        """Voxels (x, y, z)."""
        x, y, z = [self.sizes[axis] for axis in self.spatial] + [1] * (3 - len(self.spatial))
        return x, y, z


def parse(path: Path, fourth_axis: str) -> Header:
    """Read and check the header of a .nrrd or .nhdr file."""
    import nrrd

    lines, end = _lines(path)
    try:
        fields = nrrd.read_header(lines)
    except Exception as error:  # the parser lets errors of many kinds through
        raise FormatError(f"the header cannot be read: {error}", file=str(path)) from None
    for needed in ("type", "dimension", "sizes", "encoding"):
        if needed not in fields:
            raise FormatError("the header lacks this field", file=str(path), field=needed)
    encoding = ENCODINGS.get(str(fields["encoding"]).lower())
    if encoding is None:
        raise FormatError(
            f"{fields['encoding']!r} is not read; convert to raw or gzip", file=str(path), field="encoding"
        )
    sizes = tuple(int(n) for n in fields["sizes"])
    if fields["dimension"] != len(sizes) or not sizes or min(sizes) < 1:
        raise FormatError(
            f"{fields['dimension']} axes with {sizes} samples make no volume", file=str(path), field="sizes"
        )
    kinds = _per_axis(fields, "kinds", len(sizes), path) or [""] * len(sizes)
    directions = _directions(fields, len(sizes), path)
    spatial, time, component = _axes(kinds, directions, len(sizes), fourth_axis, path)
    matrix = _place(fields, sizes, spatial, directions, path)
    data_file, offset = _data_file(fields, path, end)
    return Header(
        dtype=_dtype(fields, encoding, path),
        encoding=encoding,
        sizes=sizes,
        spatial=spatial,
        time=time,
        component=component,
        index_to_world=matrix,
        space=str(fields.get("space", "")),
        unit=str(fields.get("sample units", "")).strip('"'),
        data_file=data_file,
        data_offset=offset,
        line_skip=int(fields.get("line skip", fields.get("lineskip", 0))),
        byte_skip=int(fields.get("byte skip", fields.get("byteskip", 0))),
    )


def _lines(path: Path) -> tuple[list[bytes], int]:
    """The lines of the header, and where the data begins. A header ends with an empty line, or with the file."""
    with open(path, "rb") as file:
        block = file.read(HEADER_LIMIT)
    if not block.startswith(b"NRRD000"):
        raise FormatError("this is no NRRD file; it must begin with NRRD000", file=str(path), field="magic")
    ends = [(at, len(mark)) for mark in (b"\n\n", b"\r\n\r\n") if (at := block.find(mark)) >= 0]
    if not ends:
        if len(block) == HEADER_LIMIT:
            raise FormatError("the header does not end within 1 MiB", file=str(path))
        return block.splitlines(), len(block)
    at, width = min(ends)
    return block[:at].splitlines(), at + width


def _dtype(fields: Any, encoding: str, path: Path) -> np.dtype[Any]:
    name = str(fields["type"])
    if name not in CODE_OF:
        raise FormatError(f"{name!r} is not read; convert to integers or float", file=str(path), field="type")
    dtype = np.dtype(CODE_OF[name])
    if encoding == "text" or dtype.itemsize == 1:
        return dtype
    endian = str(fields.get("endian", "")).lower()
    if endian not in ("little", "big"):
        raise FormatError(f"expected little or big, got {endian!r}", file=str(path), field="endian")
    return dtype.newbyteorder("<" if endian == "little" else ">")


def _per_axis(fields: Any, name: str, count: int, path: Path) -> list[Any] | None:
    """The entries of a field that has one for each axis."""
    if name not in fields:
        return None
    entries = list(fields[name])
    if len(entries) != count:
        raise FormatError(f"{len(entries)} entries for {count} axes", file=str(path), field=name)
    return entries


def _directions(fields: Any, count: int, path: Path) -> list[Any] | None:
    """One vector per axis, world units, or None for an axis that is not spatial."""
    rows = _per_axis(fields, "space directions", count, path)
    if rows is None:
        return None
    vectors = [None if row is None or np.isnan(row).all() else np.asarray(row, np.float64) for row in rows]
    for vector in vectors:
        if vector is not None and (vector.shape != (3,) or not np.isfinite(vector).all() or not vector.any()):
            raise FormatError(
                f"expected three finite numbers that are not all 0, got {vector}",
                file=str(path),
                field="space directions",
            )
    return vectors


def _axes(
    kinds: list[str], directions: list[Any] | None, count: int, fourth_axis: str, path: Path
) -> tuple[tuple[int, ...], int | None, int | None]:
    """Which axes are spatial, which one is time, which one holds components."""
    if "complex" in kinds:
        raise FormatError("complex numbers; store their magnitude instead", file=str(path), field="kinds")
    if directions is not None:
        spatial = [axis for axis in range(count) if directions[axis] is not None]
    else:
        spatial = [axis for axis in range(count) if kinds[axis].lower() in (*SPATIAL_KINDS, "", "???", "none")]
    time: int | None = None
    component: int | None = None
    others = [axis for axis in range(count) if axis not in spatial]
    if len(spatial) == 4 and not others:  # four axes of which the header does not say anything more
        others = [spatial.pop()]
        if fourth_axis == "auto":
            fourth_axis = "time"
    for axis in others:
        is_time = kinds[axis].lower() == "time" if fourth_axis == "auto" else fourth_axis == "time" and len(others) == 1
        if is_time or (len(others) == 2 and kinds[axis].lower() == "time"):
            time = axis
        elif component is None:
            component = axis
        else:
            raise FormatError("more than one axis of components; split the file", file=str(path), field="kinds")
    if not 1 <= len(spatial) <= 3:
        raise FormatError(f"{len(spatial)} spatial axes; a volume has three", file=str(path), field="kinds")
    return tuple(spatial), time, component


@np.errstate(over="ignore", invalid="ignore")
def _place(
    fields: Any, sizes: tuple[int, ...], spatial: tuple[int, ...], directions: list[Any] | None, path: Path
) -> Matrix:
    """Index to LPS mm. Axes beyond those of the file are 1 mm thick."""
    matrix = np.eye(4)
    if directions is None:
        spacings, mins = _spacings(fields, sizes, path)
        for i, axis in enumerate(spatial):
            matrix[i, i], matrix[i, 3] = spacings[axis], mins[axis]
        return matrix
    name = str(fields.get("space", "")).lower()
    if name and name not in SPACES:
        raise FormatError(f"{name!r} is not read; convert to left-posterior-superior", file=str(path), field="space")
    factors = np.asarray(SPACES.get(name, (1, 1, 1)), np.float64)
    units = list(fields.get("space units", ()))
    if units and len(units) != 3:
        raise FormatError(f"{len(units)} entries for 3 axes", file=str(path), field="space units")
    factors = factors * [_millimetres(unit) for unit in units or [""] * 3]
    for i, axis in enumerate(spatial):
        matrix[:3, i] = directions[axis]
    if len(spatial) == 2:
        normal = np.cross(matrix[:3, 0], matrix[:3, 1])
        matrix[:3, 2] = normal / max(float(np.linalg.norm(normal)), 1e-300)
    origin = np.asarray(fields.get("space origin", (0.0, 0.0, 0.0)), np.float64)
    if origin.shape != (3,) or not np.isfinite(origin).all():
        raise FormatError(f"expected three finite numbers, got {origin}", file=str(path), field="space origin")
    matrix[:3, 3] = origin
    matrix[:3] *= factors[:, None]
    axes = matrix[:3, :3] / np.linalg.norm(matrix[:3, :3], axis=0)
    if abs(np.linalg.det(axes)) < 1e-9:
        raise FormatError("the axes of the voxels lie in one plane", file=str(path), field="space directions")
    return matrix


def _spacings(fields: Any, sizes: tuple[int, ...], path: Path) -> tuple[list[float], list[float]]:
    """Spacing and first centre along each axis, mm, of a file without space directions."""
    count = len(sizes)
    units = [_millimetres(u) for u in _per_axis(fields, "units", count, path) or [""] * count]
    low = _numbers(fields, "axis mins", "axismins", count, path)
    high = _numbers(fields, "axis maxs", "axismaxs", count, path)
    given = _numbers(fields, "spacings", "spacings", count, path)
    centers = _per_axis(fields, "centerings", count, path) or ["cell"] * count
    spacings, mins = [], []
    for axis in range(count):
        cells = sizes[axis] if centers[axis] != "node" else max(1, sizes[axis] - 1)
        spacing = given[axis]
        if math.isnan(spacing):
            spacing = (high[axis] - low[axis]) / cells
        if math.isnan(spacing):
            spacing = 1.0
        if not math.isfinite(spacing) or spacing <= 0.0:
            raise FormatError(f"expected lengths above 0, got {spacing:g}", file=str(path), field="spacings")
        first = low[axis] if math.isfinite(low[axis]) else 0.0
        if math.isfinite(low[axis]) and centers[axis] != "node":
            first += spacing / 2
        spacings.append(spacing * units[axis])
        mins.append(first * units[axis])
    return spacings, mins


def _numbers(fields: Any, name: str, alias: str, count: int, path: Path) -> list[float]:
    entries = _per_axis(fields, name, count, path) or _per_axis(fields, alias, count, path)
    return [math.nan] * count if entries is None else [float(x) for x in entries]


def _millimetres(unit: Any) -> float:
    """Millimetres in a unit; what is no unit of length ("pixel", "unknown") counts as one."""
    return UNITS.get(str(unit).strip('"').strip(), 1.0)


def _data_file(fields: Any, path: Path, end: int) -> tuple[Path, int]:
    """Where the data lies: behind the header, or in a file that must not leave the header's folder."""
    name = fields.get("data file", fields.get("datafile"))
    if name is None:
        return path, end
    name = str(name)
    if name.split()[0].upper() == "LIST" or "%" in name:
        raise FormatError("data in several files; join them into one .nrrd file", file=str(path), field="data file")
    folder = path.resolve().parent
    other = (folder / name).resolve()
    if not other.is_relative_to(folder):
        raise FormatError(
            f"{name!r} lies outside the folder of the header; move it there", file=str(path), field="data file"
        )
    if not other.is_file():
        raise FormatError(f"there is no file {name!r} beside the header", file=str(path), field="data file")
    return other, 0
