"""The header of NIfTI-1 and NIfTI-2: its layout, what is checked, and where it puts the voxels.

Positions in the file are RAS; everywhere else in nodegraph they are LPS. The flip is a change of the matrix, made
here and nowhere else; data is never turned. Layout: nifti.nimh.nih.gov, nifti1.h and nifti2.h.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from nodegraph.data import Mapping
from nodegraph.data.space import Matrix
from nodegraph.errors import FormatError


def _layout(text: str) -> np.dtype[Any]:
    """A record type from "name=format" words."""
    return np.dtype([(name, form) for name, form in (word.split("=") for word in text.split())])


NIFTI1 = _layout("""
    sizeof_hdr=i4 data_type=S10 db_name=S18 extents=i4 session_error=i2 regular=S1 dim_info=u1 dim=8i2 intent_p=3f4
    intent_code=i2 datatype=i2 bitpix=i2 slice_start=i2 pixdim=8f4 vox_offset=f4 scl_slope=f4 scl_inter=f4 slice_end=i2
    slice_code=u1 xyzt_units=u1 cal_max=f4 cal_min=f4 slice_duration=f4 toffset=f4 glmax=i4 glmin=i4 descrip=S80
    aux_file=S24 qform_code=i2 sform_code=i2 quatern=3f4 qoffset=3f4 srow=(3,4)f4 intent_name=S16 magic=S4
""")
NIFTI2 = _layout("""
    sizeof_hdr=i4 magic=S8 datatype=i2 bitpix=i2 dim=8i8 intent_p=3f8 pixdim=8f8 vox_offset=i8 scl_slope=f8 scl_inter=f8
    cal_max=f8 cal_min=f8 slice_duration=f8 toffset=f8 slice_start=i8 slice_end=i8 descrip=S80 aux_file=S24
    qform_code=i4 sform_code=i4 quatern=3f8 qoffset=3f8 srow=(3,4)f8 slice_code=i4 xyzt_units=i4 intent_code=i4
    intent_name=S16 dim_info=u1 unused=S15
""")
LAYOUTS = {348: NIFTI1, 540: NIFTI2}

TYPES = {
    2: "u1", 4: "i2", 8: "i4", 16: "f4", 64: "f8", 256: "i1", 512: "u2", 768: "u4", 1024: "i8", 1280: "u8",
    128: "u1", 2304: "u1",
}  # fmt: skip
COLOURS = {128: 3, 2304: 4}
"""RGB24 and RGBA32: so many bytes per voxel, side by side."""
REFUSED = {1: "1-bit", 32: "complex64", 1536: "float128", 1792: "complex128", 2048: "complex256"}

VECTOR, LABEL = 1007, 1002
UNITS = {0: 1.0, 1: 1000.0, 2: 1.0, 3: 0.001}
"""Length units in mm: unknown (taken for mm), metre, millimetre, micrometre."""
RAS_TO_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])


class Header(NamedTuple):
    """What a header says, checked. Axes of the stored data, slowest first: (components, times, z, y, x[, colour])."""

    version: int
    dtype: np.dtype[Any]  #: in the byte order of the file
    dims: tuple[int, int, int]  #: (x, y, z)
    times: int
    components: int
    colours: int  #: numbers per voxel side by side: 3 or 4 for colour, else 1
    offset: int  #: of the data, bytes
    mapping: Mapping
    index_to_world: Matrix  #: LPS, mm
    orientation: str  #: which part of the header gave it: sform, qform, spacing only
    intent: int


def parse(block: bytes, path: Path, fourth_axis: str = "auto") -> Header:
    """Check the first 540 bytes of a file (348 are enough for NIfTI-1)."""
    if len(block) < 4:
        raise FormatError("the file is too short for a NIfTI header", file=str(path))
    order: Literal["<", ">"] = "<" if int.from_bytes(block[:4], "little") in LAYOUTS else ">"
    layout = LAYOUTS.get(int.from_bytes(block[:4], "little" if order == "<" else "big"))
    if layout is None:
        raise FormatError(
            "this is no NIfTI file; the header must begin with 348 or 540", file=str(path), field="sizeof_hdr"
        )
    if len(block) < layout.itemsize:
        raise FormatError(f"the file ends inside its header of {layout.itemsize} bytes", file=str(path))
    fields = np.frombuffer(block, layout.newbyteorder(order), 1)[0]
    magic = bytes(fields["magic"]).rstrip(b"\0")[:3]
    if magic in (b"ni1", b"ni2"):
        raise FormatError("the data lies in another file; convert to a single .nii file", file=str(path), field="magic")
    if magic not in (b"n+1", b"n+2"):
        raise FormatError(f"expected 'n+1' or 'n+2', found {magic!r}", file=str(path), field="magic")

    shape = _shape(fields["dim"], path)
    code = int(fields["datatype"])
    if code not in TYPES:
        kind = REFUSED.get(code, f"unknown (code {code})")
        raise FormatError(
            f"the type {kind} is not read; convert to integers or float32", file=str(path), field="datatype"
        )
    dtype = np.dtype(TYPES[code]).newbyteorder(order)
    x, y, z, times, components = shape
    if fourth_axis == "components" or (fourth_axis == "auto" and int(fields["intent_code"]) == VECTOR):
        if components == 1:
            times, components = 1, times
    colours = COLOURS.get(code, 1)
    if colours > 1 and components > 1:
        raise FormatError("colour cannot have components of its own", file=str(path), field="dim[5]")
    matrix, orientation = _place(fields, (x, y, z), path)
    return Header(
        1 if layout is NIFTI1 else 2, dtype, (x, y, z), times, components, colours, _offset(fields, layout, path),
        _mapping(fields, colours, path), matrix, orientation, int(fields["intent_code"]),
    )  # fmt: skip


def _shape(dim: Any, path: Path) -> tuple[int, int, int, int, int]:
    rank = int(dim[0])
    if not 1 <= rank <= 7:
        raise FormatError(f"{rank} axes; expected 1 to 7", file=str(path), field="dim[0]")
    sizes = [int(n) for n in dim[1 : rank + 1]] + [1] * (7 - rank)
    for axis, size in enumerate(sizes, 1):
        if size < 1:
            raise FormatError(f"an axis has {size} voxels", file=str(path), field=f"dim[{axis}]")
    if max(sizes[5:]) > 1:
        raise FormatError("more than five axes; split the file", file=str(path), field="dim[0]")
    x, y, z, t, c = sizes[:5]
    return x, y, z, t, c


def _offset(fields: Any, layout: np.dtype[Any], path: Path) -> int:
    offset = float(fields["vox_offset"])
    if offset == 0.0:  # some writers leave it out
        return layout.itemsize + 4
    if not math.isfinite(offset) or offset < layout.itemsize or offset != int(offset):
        raise FormatError(f"data cannot begin at byte {offset:g}", file=str(path), field="vox_offset")
    return int(offset)


def _mapping(fields: Any, colours: int, path: Path) -> Mapping:
    slope, inter = float(fields["scl_slope"]), float(fields["scl_inter"])
    if slope == 0.0 or not math.isfinite(slope) or colours > 1:  # the standard's ways to say: no scaling
        return Mapping()
    if not math.isfinite(inter):
        raise FormatError(f"the offset of the values is {inter}", file=str(path), field="scl_inter")
    return Mapping(slope, inter)


@np.errstate(over="ignore", invalid="ignore")
def _place(fields: Any, dims: tuple[int, int, int], path: Path) -> tuple[Matrix, str]:
    """Index to LPS mm: the sform where there is one, else the qform, else the spacing alone (standard, method 1)."""
    pixdim = np.asarray(fields["pixdim"], np.float64)
    spacing = np.abs(pixdim[1:4])
    for axis in range(3):
        if dims[axis] == 1 and not (np.isfinite(spacing[axis]) and spacing[axis] > 0.0):
            spacing[axis] = 1.0  # files of fewer than three axes say nothing of the rest
    matrix = np.eye(4)
    if int(fields["sform_code"]) > 0:
        matrix[:3] = np.asarray(fields["srow"], np.float64)
        orientation, field = "sform", "srow"
        if dims[2] == 1 and np.isfinite(matrix).all() and not matrix[:3, 2].any():
            normal = np.cross(matrix[:3, 0], matrix[:3, 1])
            matrix[:3, 2] = normal / max(float(np.linalg.norm(normal)), 1e-300) * spacing[2]
    elif int(fields["qform_code"]) > 0:
        handed = -1.0 if pixdim[0] < 0.0 else 1.0
        matrix[:3, :3] = _rotation(np.asarray(fields["quatern"], np.float64)) * (spacing * [1.0, 1.0, handed])
        matrix[:3, 3] = np.asarray(fields["qoffset"], np.float64)
        orientation, field = "qform", "quatern, qoffset or pixdim"
    else:
        matrix[:3, :3] = np.diag(spacing)
        orientation, field = "spacing only", "pixdim"
    units = int(fields["xyzt_units"]) & 7
    if units not in UNITS:
        raise FormatError(f"unknown unit of length (code {units})", file=str(path), field="xyzt_units")
    matrix[:3] *= UNITS[units]
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    if not np.isfinite(matrix).all() or (lengths == 0.0).any():
        raise FormatError(
            f"the place of the voxels is not finite or a voxel has no size:\n{matrix[:3]}".replace("\n", " "),
            file=str(path),
            field=field,
        )
    if abs(np.linalg.det(matrix[:3, :3] / lengths)) < 1e-9:
        raise FormatError("the axes of the voxels lie in one plane", file=str(path), field=field)
    return RAS_TO_LPS @ matrix, orientation


def _rotation(quatern: Any) -> Any:
    """Rotation matrix of the unit quaternion (a, b, c, d) of which the header stores b, c, d."""
    b, c, d = quatern
    a = math.sqrt(max(0.0, 1.0 - float(quatern @ quatern)))
    return np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c],
        ]
    )


def _quaternion(rotation: Any) -> Any:
    """(b, c, d) of a rotation matrix, with a >= 0. The largest component is found first, for the sake of digits."""
    r = rotation
    squares = np.array(
        [
            1 + r[0, 0] + r[1, 1] + r[2, 2],
            1 + r[0, 0] - r[1, 1] - r[2, 2],
            1 - r[0, 0] + r[1, 1] - r[2, 2],
            1 - r[0, 0] - r[1, 1] + r[2, 2],
        ]
    )
    # Row i holds 4 * q_i * (a, b, c, d).
    products = np.array(
        [
            [squares[0], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
            [r[2, 1] - r[1, 2], squares[1], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
            [r[0, 2] - r[2, 0], r[0, 1] + r[1, 0], squares[2], r[1, 2] + r[2, 1]],
            [r[1, 0] - r[0, 1], r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], squares[3]],
        ]
    )
    q = products[int(np.argmax(squares))]
    q = q / np.linalg.norm(q)
    return q[1:] if q[0] >= 0.0 else -q[1:]


def build(
    dtype: np.dtype[Any],
    dims: tuple[int, int, int],
    components: int,
    index_to_world: Matrix,
    mapping: Mapping,
    intent: int,
) -> bytes:
    """The header, in the byte order of this machine, with the four bytes that say "no extensions".

    NIfTI-1 where it can say it; NIfTI-2 for axes beyond 32767 and for positions that single precision would move by
    more than 1e-4 voxel.
    """
    matrix = RAS_TO_LPS @ index_to_world
    layout = NIFTI2 if max(dims) > 32767 or components > 32767 or _moved(matrix, dims) > 1e-4 else NIFTI1
    fields = np.zeros((), layout)
    fields["sizeof_hdr"] = layout.itemsize
    fields["magic"] = b"n+1\0" if layout is NIFTI1 else b"n+2\0\r\n\x1a\n"
    fields["dim"] = [5, *dims, 1, components, 1, 1] if components > 1 else [3, *dims, 1, 1, 1, 1]
    fields["datatype"] = {TYPES[c]: c for c in reversed(TYPES) if c not in COLOURS}[dtype.str[1:]]
    fields["bitpix"] = dtype.itemsize * 8
    fields["vox_offset"] = layout.itemsize + 4
    fields["scl_slope"], fields["scl_inter"] = mapping.scale, mapping.offset
    fields["xyzt_units"] = 2
    fields["intent_code"] = VECTOR if components > 1 else intent
    spacing = np.linalg.norm(matrix[:3, :3], axis=0)
    fields["pixdim"] = [1.0, *spacing, 1.0, 1.0, 1.0, 1.0]
    fields["sform_code"] = 1
    fields["srow"] = matrix[:3]
    axes = matrix[:3, :3] / spacing
    if np.abs(axes.T @ axes - np.eye(3)).max() < 1e-6:  # a quaternion cannot say anything else
        handed = -1.0 if np.linalg.det(axes) < 0.0 else 1.0
        fields["pixdim"][0] = handed
        fields["qform_code"] = 1
        fields["quatern"] = _quaternion(axes * [1.0, 1.0, handed])
        fields["qoffset"] = matrix[:3, 3]
    return fields.tobytes() + bytes(4)


def _moved(matrix: Matrix, dims: tuple[int, int, int]) -> float:
    """How far, in voxels, single precision moves the corners of the grid."""
    with np.errstate(over="ignore"):
        error = np.abs(matrix[:3].astype(np.float32).astype(np.float64) - matrix[:3])
    worst = error[:, :3] @ np.asarray(dims, np.float64) + error[:, 3]
    return float((worst / np.linalg.norm(matrix[:3, :3], axis=0).min()).max())
