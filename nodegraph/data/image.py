"""Pictures: linear colour with optional depth and ids."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from nodegraph.data.buffer import Array, Buffer, as_buffer
from nodegraph.data.value import Parts, Value
from nodegraph.errors import PortError


class Image(Value):
    """A picture: linear, premultiplied RGBA, with depth and ids where they are known.

    ``color`` is (h, w, c) real with c = 1, 2 or 4, row 0 on top. Four channels are linear premultiplied RGBA;
    two are entry and exit distances along the ray from the eye, mm. ``depth`` (h, w) is the distance from the
    eye along the view axis, mm, of the first visible point, inf where nothing is; ``ids`` (h, w) are uint32.
    """

    kind: ClassVar[str] = "Image"
    _color: Buffer
    _depth: Buffer | None
    _ids: Buffer | None

    def __init__(
        self, color: Array | Buffer, depth: Array | Buffer | None = None, ids: Array | Buffer | None = None
    ) -> None:
        color = as_buffer(color)
        if len(color.shape) == 2:
            color = Buffer(color.array[:, :, None])
        if len(color.shape) != 3 or color.shape[2] not in (1, 2, 4) or color.dtype.kind != "f":
            raise PortError(f"Image: expected reals (h, w, 1, 2 or 4), got {color.dtype} {color.shape}")
        if 0 in color.shape:
            raise PortError(f"Image: the picture is empty, its shape is {color.shape}")
        extras: dict[str, Buffer | None] = {"depth": None, "ids": None}
        for name, data in (("depth", depth), ("ids", ids)):
            if data is not None:
                buffer = as_buffer(data)
                if buffer.shape != color.shape[:2]:
                    raise PortError(f"Image: {name} has shape {buffer.shape}, the picture {color.shape[:2]}")
                if name == "depth" and buffer.dtype.kind != "f":
                    raise PortError(f"Image: expected depth in reals, got {buffer.dtype}")
                if name == "ids" and buffer.dtype != np.uint32:
                    raise PortError(f"Image: expected ids in uint32, got {buffer.dtype}")
                extras[name] = buffer
        self._set(_color=color, _depth=extras["depth"], _ids=extras["ids"])

    @property
    def color(self) -> Array:
        """Read-only (h, w, c)."""
        return self._color.array

    data = color

    @property
    def depth(self) -> Array | None:
        """Read-only (h, w), mm along the view axis, or None."""
        return None if self._depth is None else self._depth.array

    @property
    def ids(self) -> Array | None:
        """Read-only (h, w) uint32, or None."""
        return None if self._ids is None else self._ids.array

    @property
    def color_buffer(self) -> Buffer:
        """Colour without bringing it to the host."""
        return self._color

    @property
    def depth_buffer(self) -> Buffer | None:
        """Depth without bringing it to the host."""
        return self._depth

    @property
    def ids_buffer(self) -> Buffer | None:
        """Ids without bringing them to the host."""
        return self._ids

    @property
    def size(self) -> tuple[int, int]:
        """(width, height) in pixels."""
        return self._color.shape[1], self._color.shape[0]

    @property
    def channels(self) -> int:
        """Numbers per pixel: 1, 2 or 4."""
        return self._color.shape[2]

    @property
    def buffers(self) -> tuple[Buffer, ...]:
        return tuple(b for b in (self._color, self._depth, self._ids) if b is not None)

    def with_color(self, color: Array | Buffer) -> Image:
        """Other colour, the same depth and ids."""
        return Image(color, self._depth, self._ids)

    def over(self, background: tuple[float, float, float]) -> Array:
        """Colour over an opaque linear background, (h, w, 3)."""
        if self.channels != 4:
            raise PortError(f"Image: only RGBA pictures have an alpha, this one has {self.channels} channels")
        color = self.color
        opaque: Array = color[..., :3] + (1.0 - color[..., 3:]) * np.asarray(background, color.dtype)
        return opaque

    def summary(self) -> str:
        width, height = self.size
        extras = "".join(f", {name}" for name, b in (("depth", self._depth), ("ids", self._ids)) if b is not None)
        return f"{width}x{height}, {self.channels} channels {self._color.dtype}{extras}"

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        return np.array(self.color, dtype=dtype, copy=copy)

    def _repr_png_(self) -> bytes | None:
        """What a notebook shows; pairs of distances are no picture."""
        from nodegraph.formats import png

        return png.encode(self) if self.channels != 2 else None

    def to_parts(self) -> Parts:
        names = {"color": self._color, "depth": self._depth, "ids": self._ids}
        return {}, {name: buffer.array for name, buffer in names.items() if buffer is not None}

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: dict[str, Array]) -> Image:
        return cls(arrays["color"], arrays.get("depth"), arrays.get("ids"))


def srgb_encode(linear: Array) -> Array:
    """Linear to sRGB, both 0..1 (IEC 61966-2-1). Used at files and screens only."""
    clipped = np.clip(linear, 0.0, 1.0)
    return np.where(clipped <= 0.0031308, clipped * 12.92, 1.055 * np.power(clipped, 1.0 / 2.4) - 0.055)


def srgb_decode(encoded: Array) -> Array:
    """sRGB to linear, both 0..1 (IEC 61966-2-1)."""
    clipped = np.clip(encoded, 0.0, 1.0)
    return np.where(clipped <= 0.04045, clipped / 12.92, np.power((clipped + 0.055) / 1.055, 2.4))
