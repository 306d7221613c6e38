"""Accessors of fields in OpenCL C: packed buffers, interpolated by hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .module import FieldSlot
from .printing import FieldRef
from .storage_types import Storage

if TYPE_CHECKING:
    from .print_opencl import _OpenclPrinter

_C_TYPES = {
    "u1": "uchar", "i1": "char", "u2": "ushort", "i2": "short", "u4": "uint", "i4": "int", "f4": "float", "f8": "double"
}  # fmt: skip
_INT = {1: "int", 2: "int2", 3: "int3"}
_REAL = {1: "real", 2: "real2", 3: "real3"}


def parameter(storage: Storage, slot: FieldSlot) -> str:
    """Return the kernel parameter of a field's buffer."""
    if storage.element not in _C_TYPES:
        raise ValueError(f"{slot.field}: OpenCL has no buffers of {storage.element}")
    return f"__global const {_C_TYPES[storage.element]} *restrict {slot.sampler}"


def accessor_text(printer: _OpenclPrinter, name: str, ref: FieldRef) -> str:
    """Return the accessor ``name`` (sample3, fetch3, size3, ...) of one field, or the choice between elements."""
    n = printer.axes(ref)
    verb = name.rstrip("uv")[:-1]
    kind = printer.kind(ref)
    result = _INT[n] if verb == "size" else {"field3": "real", "field3u": "uint", "field2u": "uint"}.get(kind, "real4")
    place = {"sample": f"{_REAL[n]} p", "fetch": f"{_INT[n]} p", "size": ""}[verb]
    parameters = [*printer.context_parameters, *(["int i"] if ref.index else []), *([place] if place else [])]
    head = f"static {result} {ref.stem}_{name}({', '.join(parameters)})"
    if ref.index:
        return f"{head} {{\n{_choice(printer, name, ref, bool(place))}}}"
    slot = next(s for s in printer.slots if s.sampler == ref.stem)
    sizes = [f"ints[{slot.size_offset + axis}]" for axis in range(n)]
    if verb == "size":
        size = sizes[0] if n == 1 else f"({_INT[n]})({', '.join(sizes)})"
        return f"{head} {{ return {size}; }}"
    body = _fetch if verb == "fetch" else _sample
    return f"{head} {{\n{body(printer, ref, slot, sizes)}}}"


def _choice(printer: _OpenclPrinter, name: str, ref: FieldRef, placed: bool) -> str:
    text = ""
    count = printer.count(ref)
    args = ", ".join([*printer.context_arguments, *(["p"] if placed else [])])
    for element in range(count):
        own = printer.use_accessor(name, FieldRef(ref.number, element))
        test = f"if (i <= {element}) " if element < count - 1 else ""
        text += f"    {test}return {own}({args});\n"
    return text


def _components(printer: _OpenclPrinter, ref: FieldRef) -> int:
    return 1 if printer.kind(ref) == "field3" else printer.storage(ref).components


def _texel(storage: Storage, buffer: str, at: str, n: int) -> str:
    """Return one component of a voxel as a real, or all ``n`` of them as a vector."""
    if n == 1:
        step = f" * {storage.components}" if storage.components > 1 else ""
        return f"(real){buffer}[({at}){step}]"
    # As one vector and not one by one: PoCL's ray-caster takes half as long.
    return f"TO_REAL{n}(vload{n}({at}, {buffer}))"


def _finished(printer: _OpenclPrinter, ref: FieldRef, slot: FieldSlot, value: str, n: int) -> str:
    """Apply the mapping and fill absent components with 0."""
    if slot.mapping_offset >= 0:
        value = f"{value} * reals[{slot.mapping_offset}] + reals[{slot.mapping_offset + 1}]"
    if printer.kind(ref) == "field3" or n == 4:
        return value
    return f"(real4)({value}{', 0' * (4 - n)})"


def _fetch(printer: _OpenclPrinter, ref: FieldRef, slot: FieldSlot, sizes: list[str]) -> str:
    storage, axes = slot.storage, len(sizes)
    integer = "size_t" if storage.large else "int"
    names = ["p"] if axes == 1 else [f"p.{'xyz'[axis]}" for axis in range(axes)]
    text = "".join(
        f"    const {integer} {'xyz'[axis]} = clamp({own}, 0, {size} - 1);\n"
        for axis, (own, size) in enumerate(zip(names, sizes, strict=True))
    )
    at = "x"
    if axes > 1:
        at = f"{'y' if axes == 2 else f'(z * {sizes[1]} + y)'} * {sizes[0]} + x"
    if printer.kind(ref).endswith("u"):
        step = f" * {storage.components}" if storage.components > 1 else ""
        return f"{text}    return (uint){slot.sampler}[({at}){step}];\n"
    n = _components(printer, ref)
    value = _finished(printer, ref, slot, f"({_texel(storage, slot.sampler, 'at', n)})", n)
    return f"{text}    const {integer} at = {at};\n    return {value};\n"


def _sample(printer: _OpenclPrinter, ref: FieldRef, slot: FieldSlot, sizes: list[str]) -> str:
    """Clamp once per coordinate; ``p > 0 ? p : 0`` takes NaN to 0 and is one instruction."""
    storage, axes = slot.storage, len(sizes)
    integer = "size_t" if storage.large else "int"
    n = _components(printer, ref)
    text = ""
    for axis, size in enumerate(sizes):
        letter = "xyz"[axis]
        own = "p" if axes == 1 else f"p.{letter}"
        text += f"    const int n{letter} = {size} - 1;\n"
        text += f"    real {letter} = {own} > 0 ? {own} : 0;\n"
        text += f"    {letter} = {letter} < (real)n{letter} ? {letter} : (real)n{letter};\n"
        text += f"    const int i{letter} = (int){letter};\n"
        text += f"    const real t{letter} = {letter} - (real)i{letter};\n"
    strides = ["1", "(nx + 1)", f"({integer})(nx + 1) * (ny + 1)"][:axes]
    start = {
        1: "ix",
        2: f"({integer})iy * (nx + 1) + ix",
        3: f"(({integer})iz * (ny + 1) + iy) * (nx + 1) + ix",
    }[axes]
    text += f"    const {integer} o0 = {start};\n"
    offsets = ["o0"]
    for axis, stride in enumerate(strides):
        letter = "xyz"[axis]
        text += f"    const {integer} d{letter} = i{letter} < n{letter} ? {stride} : 0;\n"
        offsets += [f"{offset} + d{letter}" for offset in offsets]
    values = []
    for corner, offset in enumerate(offsets):
        text += f"    const real{n if n > 1 else ''} v{corner} = {_texel(storage, slot.sampler, offset, n)};\n"
        values.append(f"v{corner}")
    for axis in range(axes):
        letter = "xyz"[axis]
        mixed = []
        for i, (a, b) in enumerate(zip(values[::2], values[1::2], strict=True)):
            name = f"{letter}{i}"
            text += f"    const real{n if n > 1 else ''} {name} = {a} + ({b} - {a}) * t{letter};\n"
            mixed.append(name)
        values = mixed
    return f"{text}    return {_finished(printer, ref, slot, values[0], n)};\n"
