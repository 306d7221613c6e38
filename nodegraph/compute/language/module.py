"""What the translator says about a kernel: its declarations (``Module``) and how a device binds them (``Layout``)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from .storage_types import Storage
from .types import Matrix, Numeric, Struct, components

if TYPE_CHECKING:
    from .syntax import Program

#: A default is a number, a bool, or a tuple of these (vectors).
Value = float | int | bool | tuple[float | int | bool, ...]


@dataclass(frozen=True)
class Uniform:
    """A uniform of a kernel.

    ``type`` is the element type of an array; ``count`` is its length, 0 when it is no array. A struct uniform has a
    ``Struct`` as its type and takes a mapping; an array of structs a sequence of mappings. ``default`` is used when
    nothing is bound (None: it must be bound if ``used``). ``used`` tells whether this variant can read it.
    """

    name: str
    type: Numeric | Matrix | Struct
    count: int
    default: Value | None
    doc: str
    line: int
    used: bool


@dataclass(frozen=True)
class FieldDecl:
    """A field of a kernel. ``kind`` is field3, field3v, field3u, field2, field2u or field1; ``count`` as in Uniform."""

    name: str
    kind: str
    count: int
    doc: str
    line: int
    used: bool


@dataclass(frozen=True)
class OutputDecl:
    """One output: float, vec2, vec4, int or uint. ``name`` is "" when the entry returns a plain value."""

    name: str
    type: Numeric


@dataclass(frozen=True)
class Module:
    """A checked kernel. ``program`` is the typed syntax tree, which only the printers read."""

    entry: str
    uniforms: tuple[Uniform, ...]
    fields: tuple[FieldDecl, ...]
    outputs: tuple[OutputDecl, ...]
    #: Text of the comment that opens the kernel's own file, markers removed.
    doc: str
    #: Uniforms and fields that only other variants declare (in parts cut out by #if): binding them is no error.
    absent: frozenset[str]
    #: Files in the order of their numbers: the file that a driver's message calls 1 is ``files[1]``.
    files: tuple[str, ...]
    program: Program = field(repr=False, compare=False)


@dataclass(frozen=True)
class Leaf:
    """One plain value (or array of plain values) inside a uniform.

    ``path`` leads to it from the bindings: ``("camera", "eye")``, ``("lights", 2, "direction")``, ``("planes",)``.
    OpenGL: write it to the active uniform ``name`` (array leaves: without ``[0]``); a driver drops uniforms that it
    finds unused, so a missing name is not an error. OpenCL: convert it to the block's type and write ``length`` numbers
    at ``offset`` of block "real" or "int"; matrices column by column, vectors x first, arrays element after element, no
    padding anywhere; bool as 0 or 1; uint by its bits.
    """

    path: tuple[str | int, ...]
    type: Numeric | Matrix
    count: int
    name: str
    block: str
    offset: int

    @property
    def length(self) -> int:
        """How many numbers the leaf holds in its block."""
        return components(self.type) * max(self.count, 1)


@dataclass(frozen=True)
class FieldSlot:
    """One field, or one element of a field array, as the printed program wants it.

    OpenGL: bind a texture (2-D for field1, of height 1; 2-D; 3-D) to the sampler uniform ``sampler``; write the size in
    texels, x first, to ``size`` (int, ivec2 or ivec3), its inverse to ``inverse`` (float, vec2 or vec3) unless that
    name is "", and (scale, offset, scale * unorm) to the vec3 ``mapping`` unless that is "". Units are free to choose.
    A name that the driver does not list was dropped as unused.
    OpenCL: kernel argument number ``argument`` is the buffer; write the size, x first, as 1 to 3 ints at
    ``size_offset`` of block "int", and (scale, offset) at ``mapping_offset`` of block "real" unless that is -1.
    """

    field: str
    element: int
    storage: Storage
    sampler: str = ""
    size: str = ""
    inverse: str = ""
    mapping: str = ""
    argument: int = -1
    size_offset: int = -1
    mapping_offset: int = -1


@dataclass(frozen=True)
class Layout:
    """How to bind and run a printed program.

    **OpenGL fragment** (``stage`` "fragment"): output i of ``outputs`` is colour target i (float R32F, vec2 RG32F, vec4
    RGBA32F, int R32I, uint R32UI). The caller brings a vertex shader that covers the target; strips are cut by
    scissor, since the entry's argument comes from gl_FragCoord. A voxel entry reads the
    slice z from the int uniform ``slice``.
    **OpenGL compute** (voxel entries): output i is the image unit i, formats as above; groups of ``group`` threads;
    ``origin`` and ``extent`` (ivec3 uniforms) are the first voxel of this dispatch and the size of the whole result.
    **OpenCL**: the kernel is ``kernel``. Arguments in this order, all listed in ``arguments``: one buffer per output
    (rows of the whole result, x fastest, components interleaved, float or double as printed, int, uint), one buffer
    per field slot, the block of reals, the block of ints (never empty: at least one element each), then the ints
    width, height and depth of the whole result (depth is 1 for pixels). Work items are (x, y) or (x, y, z) by
    ``get_global_id``, so strips are global offsets; a work item outside the result does nothing, so sizes may be
    rounded up.
    Only fields that the variant uses have slots, only uniforms that it uses have leaves.
    """

    stage: str
    outputs: tuple[OutputDecl, ...]
    leaves: tuple[Leaf, ...]
    slots: tuple[FieldSlot, ...]
    #: Files by their number in the driver's messages.
    files: tuple[str, ...]
    slice: str = ""
    origin: str = ""
    extent: str = ""
    group: tuple[int, int, int] = (1, 1, 1)
    kernel: str = ""
    arguments: tuple[str, ...] = ()
    reals: int = 0
    ints: int = 0
