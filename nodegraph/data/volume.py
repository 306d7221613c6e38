"""Scalar and vector fields on regular grids, and label fields."""

from __future__ import annotations

import math
from collections.abc import Mapping as MappingType
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.buffer import Array, Buffer, as_buffer
from nodegraph.data.space import Matrix, centred, check_affine, invert, transform_points
from nodegraph.data.value import Parts, Value
from nodegraph.errors import PortError

if TYPE_CHECKING:
    from nodegraph.data.camera import Camera

SLAB_BYTES = 1 << 22


class Mapping(NamedTuple):
    """How stored numbers become real ones: ``real = stored * scale + offset``, in ``unit``."""

    scale: float = 1.0
    offset: float = 0.0
    unit: str = ""


class Grid(Value):
    """A field of voxels and where it lies: what Volume and Labels share.

    Data is (z, y, x) or (z, y, x, c) in its own dtype, C order preferred; ``index_to_world`` takes voxel
    indices (x, y, z), centres at integers, to millimetres in LPS.
    """

    buffer: Buffer
    index_to_world: Matrix
    world_to_index: Matrix

    def _place(self, data: Array | Buffer, index_to_world: Any, copy: bool) -> None:
        if copy and not isinstance(data, Buffer):
            data = np.array(data)
        buffer = as_buffer(data)
        if not buffer.dtype.isnative:  # no device reads it, and numpy is slow with it
            buffer = Buffer(buffer.array.astype(buffer.dtype.newbyteorder("=")))
        if len(buffer.shape) not in (3, 4):
            raise PortError(f"{type(self).__name__}: expected data (z, y, x) or (z, y, x, c), got shape {buffer.shape}")
        if 0 in buffer.shape:
            raise PortError(f"{type(self).__name__}: the data is empty, its shape is {buffer.shape}")
        matrix = centred(buffer.shape[2::-1]) if index_to_world is None else index_to_world
        matrix = check_affine(matrix)
        self._set(buffer=buffer, index_to_world=matrix, world_to_index=check_affine(invert(matrix)))

    @property
    def data(self) -> Array:
        """Stored numbers, read-only, (z, y, x) or (z, y, x, c)."""
        return self.buffer.array

    @property
    def buffers(self) -> tuple[Buffer, ...]:
        return (self.buffer,)

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of the stored numbers."""
        return self.buffer.dtype

    @property
    def dims(self) -> tuple[int, int, int]:
        """Number of voxels (x, y, z)."""
        z, y, x = self.buffer.shape[:3]
        return x, y, z

    @property
    def spacing(self) -> NDArray[np.float64]:
        """Distance of neighbouring voxel centres (x, y, z), mm."""
        lengths: NDArray[np.float64] = np.linalg.norm(self.index_to_world[:3, :3], axis=0)
        return lengths

    @property
    def corners(self) -> NDArray[np.float64]:
        """The eight outer corners of the grid (8, 3), world mm: half a voxel beyond the outermost centres."""
        low, high = np.full(3, -0.5), np.asarray(self.dims) - 0.5
        picks = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
        return transform_points(self.index_to_world, np.where(picks, high, low))

    @property
    def centre(self) -> NDArray[np.float64]:
        """Middle of the grid, world mm."""
        return transform_points(self.index_to_world, (np.asarray(self.dims) - 1) / 2)

    def distance_from(self, camera: Camera) -> float:
        """Least distance, mm, of the sphere about this grid from the eye (orthographic: from its plane); 0 inside."""
        view = self.centre - np.asarray(camera.eye)
        radius = float(np.linalg.norm(self.corners - self.centre, axis=1).max())
        away = float(view @ camera.basis[2]) if camera.orthographic else float(np.linalg.norm(view))
        return max(0.0, away - radius)

    def _block(self, low: Any, high: Any) -> tuple[Buffer, Matrix]:
        """Data and index-to-world matrix of the voxels low <= (x, y, z) < high."""
        first, end = (tuple(int(n) for n in corner) for corner in (low, high))
        if not all(0 <= a < b <= n for a, b, n in zip(first, end, self.dims, strict=True)):
            raise PortError(f"{self.kind}.part: voxels {first} to {end} are no block of a grid of {self.dims}")
        matrix = self.index_to_world.copy()
        matrix[:3, 3] = transform_points(matrix, first)
        return Buffer(self.buffer.part(first[::-1], end[::-1])), matrix

    def is_same_grid(self, other: Grid) -> bool:
        """True when both have the same voxels, within a thousandth of the least spacing."""
        if self.dims != other.dims:
            return False
        return bool(np.abs(self.corners - other.corners).max() <= 1e-3 * self.spacing.min())

    def _size_text(self) -> str:
        size = "x".join(map(str, self.dims))
        spacing = "x".join(f"{s:.4g}" for s in self.spacing)
        return f"{size} {self.dtype}, {spacing} mm"


class Volume(Grid):
    """A field of real numbers on a regular grid: one component (z, y, x) or several (z, y, x, c).

    ``Volume(array)`` is a read-only view; ``copy=True`` protects from the owner of the array. Without
    ``index_to_world`` voxels are 1 mm wide and the grid is centred at the origin of the world.
    """

    kind: ClassVar[str] = "Volume"
    mapping: Mapping

    def __init__(
        self,
        data: Array | Buffer,
        index_to_world: Any = None,
        mapping: Mapping | tuple[float, float, str] = Mapping(),  # noqa: B008 (an immutable tuple)
        *,
        copy: bool = False,
    ) -> None:
        self._place(data, index_to_world, copy)
        if self.dtype.kind not in "iuf":
            raise PortError(f"Volume: expected integers or reals, got {self.dtype}")
        mapping = Mapping(float(mapping[0]), float(mapping[1]), str(mapping[2]))
        if not (math.isfinite(mapping.scale) and math.isfinite(mapping.offset)) or mapping.scale == 0.0:
            raise PortError(f"Volume: expected a finite mapping with a scale other than 0, got {mapping[:2]}")
        self._set(mapping=mapping, _range=None)

    def with_data(self, data: Array | Buffer, mapping: Mapping | None = None) -> Volume:
        """Return other data on the same grid. Real arrays take ``Mapping(unit=same)`` unless told otherwise.

        Data of the same dtype keeps the mapping, since it is taken for the same kind of stored numbers.
        """
        buffer = as_buffer(data)
        if buffer.shape[:3] != self.buffer.shape[:3]:
            raise PortError(f"Volume.with_data: expected the grid {self.buffer.shape[:3]}, got {buffer.shape[:3]}")
        if mapping is None:
            same = buffer.dtype == self.dtype or self.mapping[:2] == (1.0, 0.0)
            mapping = self.mapping if same else Mapping(unit=self.mapping.unit)
        return Volume(buffer, self.index_to_world, mapping)

    def part(self, low: Any, high: Any) -> Volume:
        """The voxels low <= (x, y, z) < high as a volume of its own, in the same place of the world.

        A view of an array; of a volume that lies in chunks only what is named is read.
        """
        return Volume(*self._block(low, high), self.mapping)

    def component(self, index: int) -> Volume:
        """One of several components (z, y, x); of a volume that lies in chunks nothing is read for it."""
        return self if len(self.buffer.shape) == 3 else self.with_data(self.buffer.component(index))

    @property
    def components(self) -> int:
        """Numbers per voxel."""
        return 1 if len(self.buffer.shape) == 3 else self.buffer.shape[3]

    def less(self, value: float) -> Volume:
        """The same field minus a constant, by its mapping alone.

        A kernel gets real values in the precision of its device. It binds ``volume.less(volume.origin)``, and what
        the values are compared with less the same, so that values that lie close together far from 0 keep their digits.
        """
        if value == 0.0:
            return self
        mapping = self.mapping._replace(offset=self.mapping.offset - value)
        return Volume(self.buffer, self.index_to_world, mapping)

    @property
    def origin(self) -> float:
        """The real value nearest to 0 where all values lie farther from 0 than from each other, else 0.

        Cheap: numbers that single precision holds as they are, and those that a device made, are not looked at.
        """
        kind, size = self.dtype.kind, self.dtype.itemsize
        if not self.buffer.on_host or (kind == "f" and size <= 4 and self.mapping.offset == 0.0):
            return 0.0
        if kind in "iu" and size <= 2:
            limits = np.iinfo(self.dtype)
            low, high = sorted(float(n) * self.mapping.scale + self.mapping.offset for n in (limits.min, limits.max))
        else:
            low, high = self.range
        spread = high - low
        return low if low > spread else high if -high > spread else 0.0

    def real(self, dtype: Any = np.float32) -> Array:
        """Real values in ``dtype``: stored * scale + offset. No copy when they are stored that way already."""
        data = self.data
        if self.mapping[:2] == (1.0, 0.0):
            return data.astype(dtype, copy=False)
        out = np.empty(data.shape, dtype)
        for slab in slabs(data):
            # In double to the end: scale and offset may nearly cancel, and then single precision has no digits left.
            part = np.multiply(data[slab], self.mapping.scale, dtype=np.float64)
            part += self.mapping.offset
            out[slab] = part
        return out

    @property
    def range(self) -> tuple[float, float]:
        """Least and greatest finite real value; (0, 0) where no voxel is finite. Computed once, slab by slab."""
        if self._range is None:
            low, high = math.inf, -math.inf
            for _, part in self.buffer.slabs():
                if part.dtype.kind == "f":
                    part = part[np.isfinite(part)]
                if part.size:
                    low, high = min(low, float(part.min())), max(high, float(part.max()))
            if low > high:
                low = high = 0.0
                real = (0.0, 0.0)
            else:
                ends = (low * self.mapping.scale + self.mapping.offset, high * self.mapping.scale + self.mapping.offset)
                real = (min(ends), max(ends))
            self._set(_range=real)
        found: tuple[float, float] = self._range  # type: ignore[assignment]
        return found

    _range: tuple[float, float] | None

    def summary(self) -> str:
        text = self._size_text()
        if self.components > 1:
            text += f", {self.components} components"
        if self._range is not None:
            text += f", {self._range[0]:.6g}..{self._range[1]:.6g} {self.mapping.unit}".rstrip()
        return text

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.data, dtype=dtype, copy=copy)

    def to_parts(self) -> Parts:
        meta = {"index_to_world": self.index_to_world.tolist(), "mapping": list(self.mapping)}
        return meta, {"data": self.data}

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: dict[str, Array]) -> Volume:
        return cls(arrays["data"], meta["index_to_world"], tuple(meta["mapping"]))


class Labels(Grid):
    """Ids on a regular grid: unsigned integers up to 32 bits (z, y, x), 0 for nothing, with names for some.

    Ids are never interpolated. Signed data without negative values is accepted and viewed as unsigned.
    """

    kind: ClassVar[str] = "Labels"
    names: MappingType[int, str]

    def __init__(
        self,
        data: Array | Buffer,
        index_to_world: Any = None,
        names: MappingType[int, str] | None = None,
        *,
        copy: bool = False,
    ) -> None:
        buffer = as_buffer(np.array(data) if copy and not isinstance(data, Buffer) else data)
        if buffer.dtype.kind not in "iu" or len(buffer.shape) != 3:
            raise PortError(f"Labels: expected integers (z, y, x), got {buffer.dtype} {buffer.shape}")
        if buffer.dtype.kind == "i" or buffer.dtype.itemsize > 4:
            array = buffer.array
            low, high = (int(array.min()), int(array.max())) if array.size else (0, 0)
            if low < 0 or high > 0xFFFFFFFF:
                raise PortError(f"Labels: expected ids in 0..4294967295, got {low}..{high}")
            size = min(array.dtype.itemsize, 4)
            unsigned = np.dtype(f"u{size}")
            buffer = Buffer(array.view(unsigned) if array.dtype.itemsize == size else array.astype(unsigned))
        self._place(buffer, index_to_world, False)
        self._set(names=MappingProxyType({int(id): str(name) for id, name in (names or {}).items()}))

    def part(self, low: Any, high: Any) -> Labels:
        """The voxels low <= (x, y, z) < high as labels of their own, in the same place of the world."""
        return Labels(*self._block(low, high), self.names)

    def summary(self) -> str:
        named = f", {len(self.names)} named" if self.names else ""
        return self._size_text() + named

    def to_parts(self) -> Parts:
        names = {str(key): name for key, name in self.names.items()}
        return {"index_to_world": self.index_to_world.tolist(), "names": names}, {"data": self.data}

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: dict[str, Array]) -> Labels:
        names = {int(key): name for key, name in meta["names"].items()}
        return cls(arrays["data"], meta["index_to_world"], names)


def slabs(data: Array) -> list[slice]:
    """Slices along the first axis of about 4 MB each, so that no temporary array is as large as a volume."""
    per_slice = max(1, data.nbytes // max(1, data.shape[0]))
    step = max(1, SLAB_BYTES // per_slice)
    return [slice(start, start + step) for start in range(0, data.shape[0], step)]
