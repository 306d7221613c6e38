"""How a field lies in device memory: what the printers must know and the devices must provide.

``nodegraph.compute.storage.choose`` makes a ``Storage``; ``print_glsl`` and ``print_opencl`` read it.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Storage:
    """The storage of one volume, label volume, image or table.

    A stored number becomes a real value as ``real = stored * scale + offset``, where

    - on OpenCL ``stored`` is the element of the buffer, whatever its type;
    - on OpenGL ``stored`` is what ``texelFetch`` returns, times ``unorm`` when ``unorm`` is not 0.

    Scale and offset apply after interpolation. The absent components of a vector are 0, not ``offset``.
    """

    #: Type of one number in device memory, as a numpy code without byte order: u1 i1 u2 i2 u4 i4 f4 f8, and f2 on
    #: OpenGL only. OpenCL: a tightly packed buffer of these, x fastest, components interleaved.
    #: OpenGL: the texture's internal format (u1 R8, u2 R16, f2 R16F, f4 R32F when read through a float sampler).
    element: str
    #: Numbers per voxel, pixel or table entry, 1 to 4.
    components: int = 1
    scale: float = 1.0
    offset: float = 0.0
    #: OpenGL: may the texture unit interpolate? Then min and mag filter are LINEAR, else NEAREST. Wrap: CLAMP_TO_EDGE.
    #: Integer textures are never filtered. OpenCL ignores it.
    filtered: bool = False
    #: OpenGL, normalised textures: the stored number that the unit returns as 1.0 (else 0). uint16 in R16: 65535.
    #: uint8 in R8, and uint8 as ``value * 257`` in R16: 255 both times (stored is the uint8 value), so that an
    #: int8 volume shifted by 128 has unorm 255 and an offset lower by 128 * scale.
    unorm: float = 0.0
    #: What is lost by storing it like this, in words; "" when nothing is.
    loss: str = ""
    #: OpenCL: more than 2**31 - 1 numbers, so that offsets need 64 bits.
    large: bool = False

    @property
    def mapped(self) -> bool:
        """Does the accessor apply scale, offset and unorm? (Then the layout asks for them.)"""
        return self.scale != 1.0 or self.offset != 0.0 or self.unorm != 0.0

    @property
    def sampler(self) -> str:
        """First letters of the GLSL sampler type: "" for floats and normalised integers, "u" or "i" for integers."""
        return "" if self.unorm or self.element[0] == "f" else self.element[0]

    @property
    def variant(self) -> tuple[str, int, bool, bool, float, bool]:
        """What of a storage changes the printed text; scale and offset are uniforms and do not."""
        return (self.element, self.components, self.mapped, self.filtered, self.unorm, self.large)
