"""OME-Zarr, also a bare Zarr array: a folder of chunks, read block by block. Needs zarr-python.

Nothing is read but the metadata until somebody asks for voxels, and then only the chunks that hold them. A file may
hold one image at several resolutions (``level`` 0 is the finest), several times and several channels. Zarr 2 and 3,
OME-Zarr 0.1 to 0.5: axes by name and type, scale and translation of the level and of the image, units of length. Where
the file names anatomical orientations the axes are turned to LPS; else x, y and z are taken for L, P and S.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nodegraph.data import Buffer, Volume
from nodegraph.data.buffer import Array
from nodegraph.data.chunks import ROOM_SHARE, ChunkedArray, free_bytes
from nodegraph.data.space import centred
from nodegraph.errors import FormatError, near_miss
from nodegraph.formats import raw

suffixes = (".zarr",)
folders = True
"""A file of this format is a folder."""

METRES = {
    "angstrom": 1e-10, "nanometer": 1e-9, "micrometer": 1e-6, "millimeter": 1e-3, "centimeter": 1e-2, "decimeter": 0.1,
    "meter": 1.0, "picometer": 1e-12, "femtometer": 1e-15, "kilometer": 1e3, "inch": 0.0254, "foot": 0.3048,
    "nm": 1e-9, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "micron": 1e-6, "mm": 1e-3, "cm": 1e-2, "m": 1.0,
}  # fmt: skip

DIRECTIONS = {
    "right-to-left": (1, 0, 0), "left-to-right": (-1, 0, 0),
    "anterior-to-posterior": (0, 1, 0), "posterior-to-anterior": (0, -1, 0),
    "inferior-to-superior": (0, 0, 1), "superior-to-inferior": (0, 0, -1),
}  # fmt: skip


class Image(NamedTuple):
    """What the metadata says of one resolution: its array, and what its axes are."""

    array: Any
    space: tuple[int | None, int | None, int | None]  # stored axes of x, y and z; None where there is one plane alone
    channel: int | None
    time: int | None
    index_to_world: Array
    levels: tuple[str, ...]
    version: str


def read(path: Path, *, time: int = 0, level: int = 0) -> Volume:
    """Return one time step of one resolution, all its channels side by side. Its data is read when it is needed."""
    path = Path(path)
    image = _open(path, level)
    shape = image.array.shape
    time = raw.pick_time(time, 1 if image.time is None else shape[image.time], path)
    stored = image.array.dtype
    dtype = np.dtype(np.uint8) if stored.kind == "b" else stored.newbyteorder("=")
    if dtype.kind not in "iuf":
        raw.usable(np.empty(0, dtype), path, "data_type")
    axes = [*reversed(image.space), *([] if image.channel is None else [image.channel])]
    channels = 1 if image.channel is None else shape[image.channel]
    axes = axes if channels > 1 else axes[:3]
    present = [axis for axis in axes if axis is not None]

    def block(box: tuple[slice, ...]) -> Array:
        index: list[Any] = [0] * len(shape)
        if image.time is not None:
            index[image.time] = time
        for axis, part in zip(axes, box, strict=True):
            if axis is not None:
                index[axis] = part
        try:
            found = np.asarray(image.array[tuple(index)])
        except MemoryError:
            raise
        except Exception as error:
            raise FormatError(f"a chunk cannot be read: {error}", file=str(path), field=image.array.path) from None
        order = sorted(present)
        found = found.transpose([order.index(axis) for axis in present])
        return found.reshape([s.stop - s.start for s in box]).astype(dtype, copy=False)

    sizes = [1 if axis is None else shape[axis] for axis in axes]
    chunks = [1 if axis is None else image.array.chunks[axis] for axis in axes]
    room, nbytes = free_bytes(), raw.count_bytes(image.array.chunks, dtype)
    if room is not None and nbytes > ROOM_SHARE * room:
        raise FormatError(
            f"a chunk of {nbytes / 2**30:.3g} GiB does not fit into memory; write the file with smaller chunks",
            file=str(path),
            field="chunks",
        )
    buffer = Buffer.in_chunks(ChunkedArray(sizes, dtype, chunks, block, place=str(path)))
    return raw.make_volume(path, buffer, image.index_to_world)


def info(path: Path) -> dict[str, Any]:
    """What the metadata says of the finest resolution, and how many there are."""
    path = Path(path)
    image = _open(path, 0)
    shape = image.array.shape
    return {
        "kind": "Volume",
        "format": image.version,
        "size": [1 if axis is None else shape[axis] for axis in image.space],
        "type": image.array.dtype.name,
        "components": 1 if image.channel is None else shape[image.channel],
        "times": 1 if image.time is None else shape[image.time],
        "levels": len(image.levels),
        "chunks": [1 if axis is None else image.array.chunks[axis] for axis in image.space],
        "spacing": raw.spacing_of(image.index_to_world),
        "index_to_world": image.index_to_world.tolist(),
    }


def _open(path: Path, level: int) -> Image:
    try:
        import zarr
    except ImportError:
        raise FormatError("OME-Zarr needs zarr-python; pip install 'nodegraph[zarr]'", file=str(path)) from None
    try:
        node = zarr.open(str(path), mode="r")
    except Exception as error:
        raise FormatError(f"no Zarr array or group can be opened here: {error}", file=str(path)) from None
    if isinstance(node, zarr.Array):
        _require_level(path, level, ("",))
        image = _describe(path, node, {}, [], ("",), f"Zarr {node.metadata.zarr_format}")
        # It says nothing of its place: it lies where an array of numpy's lies, about the origin.
        dims = [1 if axis is None else node.shape[axis] for axis in image.space]
        return image._replace(index_to_world=centred(dims))
    attributes: dict[str, Any] = dict(node.attrs)
    ome = attributes.get("ome", attributes)
    scales = ome.get("multiscales") if isinstance(ome, Mapping) else None
    if not isinstance(scales, list) or not scales or not isinstance(scales[0], Mapping):
        names = sorted(name for name, _ in node.members())
        raise FormatError(
            f"this group has no image (no multiscales){'; it holds ' + ', '.join(names[:8]) if names else ''}",
            file=str(path),
            field="multiscales",
        )
    scale = scales[0]
    datasets: Any = scale.get("datasets")
    described = isinstance(datasets, list) and all(isinstance(d, Mapping) for d in datasets)
    if not described or not all(isinstance(d.get("path"), str) for d in datasets):
        raise FormatError("expected a list of datasets with paths", file=str(path), field="multiscales.datasets")
    levels = tuple(d["path"] for d in datasets)
    _require_level(path, level, levels)
    name = levels[level]
    try:
        array = node[name]
    except Exception:
        raise FormatError(f"there is no array {name!r}", file=str(path), field="multiscales.datasets") from None
    if not isinstance(array, zarr.Array):
        raise FormatError(f"{name!r} is no array", file=str(path), field="multiscales.datasets")
    version = ome.get("version", scale.get("version", "0.1"))
    steps = [datasets[level].get("coordinateTransformations"), scale.get("coordinateTransformations")]
    return _describe(path, array, scale, steps, levels, f"OME-Zarr {version}")


def _require_level(path: Path, level: int, levels: tuple[str, ...]) -> None:
    if not 0 <= level < len(levels):
        raise FormatError(f"{level} is outside 0..{len(levels) - 1}", file=str(path), field="level")


def _describe(
    path: Path, array: Any, scale: Mapping[str, Any], steps: Sequence[Any], levels: tuple[str, ...], version: str
) -> Image:
    """Find out what the axes of an array are, and where its voxels lie."""
    rank = len(array.shape)
    axes = _axes(path, scale.get("axes"), rank)
    kinds = [axis.get("type") or {"t": "time", "c": "channel"}.get(axis["name"], "space") for axis in axes]
    space = [i for i, kind in enumerate(kinds) if kind == "space"]
    if not 2 <= len(space) <= 3:
        raise FormatError(f"expected 2 or 3 axes of space, got {len(space)}", file=str(path), field="axes")
    if all(axes[i]["name"] in ("x", "y", "z") for i in space) and len({axes[i]["name"] for i in space}) == len(space):
        space.sort(key=lambda i: axes[i]["name"])
    else:
        space.reverse()
    for i, kind in enumerate(kinds):
        known = kind == "space" or (kind in ("time", "channel") and kinds.count(kind) == 1)
        if not known and array.shape[i] > 1:
            raise FormatError(
                f"the axis {axes[i]['name']!r} is of type {kind!r}; known are one of time, one of channels, and space",
                file=str(path),
                field="axes",
            )
    factor, shift = np.ones(rank), np.zeros(rank)
    for step in steps:
        if step is not None and not isinstance(step, list):
            raise FormatError(
                f"expected a list of transformations, got {step!r}", file=str(path), field="coordinateTransformations"
            )
        for transform in step or ():
            by, to = _transform(path, transform, rank)
            factor, shift = factor * by, shift * by + to
    matrix = np.eye(4)
    for column, i in enumerate(space):
        length = _millimetres(path, axes[i].get("unit"))
        direction = np.array(_direction(axes[i], column), np.float64)
        matrix[:3, column] = direction * factor[i] * length
        matrix[:3, 3] += direction * shift[i] * length
    x, y, z = (*space, None)[:3]
    find = {kind: i for i, kind in enumerate(kinds) if kind != "space"}
    return Image(array, (x, y, z), find.get("channel"), find.get("time"), matrix, levels, version)


def _axes(path: Path, axes: Any, rank: int) -> list[dict[str, Any]]:
    """The axes as dictionaries with a name. Versions before 0.3 have none: always t, c, z, y, x."""
    if axes is None:
        if rank not in (3, 4, 5):
            raise FormatError(f"expected 3 to 5 axes, got {rank}", file=str(path), field="shape")
        # Of four axes the last holds components, as in a file of numpy.
        axes = {3: ["z", "y", "x"], 4: ["z", "y", "x", "c"], 5: ["t", "c", "z", "y", "x"]}[rank]
    listed = axes if isinstance(axes, list) else []
    named = [
        {"name": axis} if isinstance(axis, str) else dict(axis) if isinstance(axis, Mapping) else {} for axis in listed
    ]
    if len(named) != rank or not all(isinstance(axis.get("name"), str) for axis in named):
        raise FormatError(f"expected {rank} axes with names, got {axes!r}", file=str(path), field="axes")
    return named


def _transform(path: Path, transform: Any, rank: int) -> tuple[Array, Array]:
    """Scale and translation of one coordinate transformation."""
    kind = transform.get("type") if isinstance(transform, Mapping) else None
    if kind == "identity":
        return np.ones(rank), np.zeros(rank)
    if kind not in ("scale", "translation"):
        hint = near_miss(str(kind), ("scale", "translation", "identity"))
        raise FormatError(
            f"transformations are scale and translation, got {kind!r}{hint}",
            file=str(path),
            field="coordinateTransformations",
        )
    values = transform.get(kind)
    good = isinstance(values, list) and len(values) == rank
    if not good or not all(isinstance(v, (int, float)) and _fits(v) for v in values):
        raise FormatError(f"expected {rank} numbers, got {values!r}", file=str(path), field=f"{kind}")
    numbers = np.array(values, np.float64)
    return (numbers, np.zeros(rank)) if kind == "scale" else (np.ones(rank), numbers)


def _fits(number: float) -> bool:
    """Whether it is finite in double precision, which an integer in JSON need not be."""
    return abs(number) <= sys.float_info.max


def _millimetres(path: Path, unit: Any) -> float:
    """Millimetres of a unit; without one, numbers are taken for millimetres."""
    if unit is None:
        return 1.0
    if not isinstance(unit, str) or unit not in METRES:
        raise FormatError(
            f"unknown unit of length {unit!r}{near_miss(str(unit), METRES)}", file=str(path), field="unit"
        )
    return METRES[unit] * 1e3


def _direction(axis: Mapping[str, Any], column: int) -> tuple[int, int, int]:
    """Where an axis points in LPS."""
    told = axis.get("orientation", axis.get("anatomicalOrientation"))
    value = told.get("value") if isinstance(told, Mapping) else told
    x, y, z = (int(column == i) for i in range(3))
    return DIRECTIONS.get(str(value), (x, y, z))
