"""Accessors of fields in GLSL: hardware interpolation where it is exact, else fetches mixed by hand."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .module import FieldSlot
from .printing import FieldRef
from .storage_types import Storage

if TYPE_CHECKING:
    from .print_glsl import _GlslPrinter

_SHAPE = {1: "2D", 2: "2D", 3: "3D"}


def is_line(storage: Storage, n: int) -> bool:
    """True for a table of floats: a texture of one axis, of which two texels are mixed and not four.

    Tables of other elements are textures one texel high.
    """
    return n == 1 and storage.element == "f4" and not storage.sampler


_SIZE = {1: "int", 2: "ivec2", 3: "ivec3"}
_PLACE = {1: "float", 2: "vec2", 3: "vec3"}


def declarations(printer: _GlslPrinter, slots: tuple[FieldSlot, ...]) -> list[str]:
    """Return the uniforms that belong to the fields."""
    text = []
    axes = {symbol.name: printer.axes(FieldRef(i, 0)) for i, symbol in enumerate(printer.fields)}
    for slot in slots:
        n = axes[slot.field]
        shape = "1D" if is_line(slot.storage, n) else _SHAPE[n]
        text.append(f"uniform {slot.storage.sampler}sampler{shape} {slot.sampler};")
        text.append(f"uniform {_SIZE[n]} {slot.size};")
        if slot.inverse:
            text.append(f"uniform {_PLACE[n]} {slot.inverse};")
        if slot.mapping:
            text.append(f"uniform vec3 {slot.mapping};")
    return text


def accessor_text(printer: _GlslPrinter, name: str, ref: FieldRef) -> str:
    """Return the accessor ``name`` (sample3, fetch3, size3, ...) of one field, or the choice between elements."""
    n = printer.axes(ref)
    verb = name.rstrip("uv")[:-1]
    result = _result(printer, ref, verb, n)
    place = {"sample": f"{_PLACE[n]} p", "fetch": f"{_SIZE[n]} p", "size": ""}[verb]
    if ref.index:
        return _choice(printer, name, ref, result, place)
    head = f"{result} {ref.stem}_{name}({place})"
    if verb == "size":
        return f"{head} {{ return {ref.stem}_size; }}"
    if verb == "fetch":
        texel = _fetch(printer, ref, n, _clamped("p", ref, n))
        return f"{head} {{\n    return {_fetched(printer, ref, texel, exact=True)};\n}}"
    storage = printer.storage(ref)
    if storage.filtered and not storage.sampler:
        coordinate = f"(p + 0.5) * {ref.stem}_inverse"
        if n == 1 and not is_line(storage, n):
            coordinate = f"vec2({coordinate}, 0.5)"
        guard = "    p = p > 0.0 ? p : 0.0;\n" if n == 1 else ""
        sampled = f"textureLod({ref.stem}, {coordinate}, 0.0)"
        return f"{head} {{\n{guard}    return {_fetched(printer, ref, sampled, exact=False)};\n}}"
    return f"{head} {{\n{_by_hand(printer, ref, n)}}}"


def _result(printer: _GlslPrinter, ref: FieldRef, verb: str, n: int) -> str:
    if verb == "size":
        return _SIZE[n]
    return {"field3": "float", "field3u": "uint", "field2u": "uint"}.get(printer.kind(ref), "vec4")


def _choice(printer: _GlslPrinter, name: str, ref: FieldRef, result: str, place: str) -> str:
    """Choose an element at run time: GLSL 3.30 indexes samplers by constants only."""
    text = [f"{result} {ref.stem}_{name}(int i{', ' + place if place else ''}) {{"]
    count = printer.count(ref)
    for element in range(count):
        own = printer.use_accessor(name, FieldRef(ref.number, element))
        test = f"if (i <= {element}) " if element < count - 1 else ""
        text.append(f"    {test}return {own}({'p' if place else ''});")
    return "\n".join([*text, "}"])


def _clamped(p: str, ref: FieldRef, n: int) -> str:
    return f"clamp({p}, {_SIZE[n]}(0), {ref.stem}_size - 1)"


def _fetch(printer: _GlslPrinter, ref: FieldRef, n: int, place: str) -> str:
    place = f"ivec2({place}, 0)" if n == 1 and not is_line(printer.storage(ref), n) else place
    return f"texelFetch({ref.stem}, {place}, 0)"


def _fetched(printer: _GlslPrinter, ref: FieldRef, texel: str, exact: bool) -> str:
    """Return the value of the language for a texel: its components, as real values."""
    storage, kind = printer.storage(ref), printer.kind(ref)
    if kind.endswith("u"):
        return f"uint({texel}.r * {storage.unorm!r} + 0.5)" if storage.unorm else f"uint({texel}.r)"
    n = 1 if kind == "field3" else storage.components
    value = f"{texel}.{'rgba'[:n]}"
    if storage.sampler:
        value = f"{'float' if n == 1 else f'vec{n}'}({value})"
    if storage.mapped:
        if storage.unorm and exact:
            value = f"floor({value} * {storage.unorm!r} + 0.5)"
        scale = "z" if storage.unorm and not exact else "x"
        value = f"({value} * {ref.stem}_mapping.{scale} + {ref.stem}_mapping.y)"
    if kind == "field3" or n == 4:
        return value
    return f"vec4({value}{', 0.0' * (4 - n)})"


def _by_hand(printer: _GlslPrinter, ref: FieldRef, n: int) -> str:
    """Return the body of an interpolation from 2, 4 or 8 fetches. Not ``clamp`` for p: NaN must become 0."""
    storage, kind = printer.storage(ref), printer.kind(ref)
    count = 1 if kind == "field3" else storage.components
    value = "float" if count == 1 else f"vec{count}"
    corners = []
    for corner in range(2**n):
        parts = [f"{'ab'[corner >> axis & 1]}.{'xyz'[axis]}" for axis in range(n)]
        place = "ab"[corner] if n == 1 else f"{_SIZE[n]}({', '.join(parts)})"
        texel = f"{_fetch(printer, ref, n, place)}.{'rgba'[:count]}"
        corners.append(f"{value}({texel})" if storage.sampler else texel)
    for axis in range(n):
        t = "t" if n == 1 else f"t.{'xyz'[axis]}"
        corners = [f"mix({a}, {b}, {t})" for a, b in zip(corners[::2], corners[1::2], strict=True)]
    text = [f"    {_SIZE[n]} last = {ref.stem}_size - 1;"]
    for axis in range(n):
        own, last = ("p", "last") if n == 1 else (f"p.{'xyz'[axis]}", f"last.{'xyz'[axis]}")
        text.append(f"    {own} = {own} > 0.0 ? min({own}, float({last})) : 0.0;")
    text.append(f"    {_SIZE[n]} a = {_SIZE[n]}(p);")
    text.append(f"    {_SIZE[n]} b = min(a + 1, last);")
    text.append(f"    {_PLACE[n]} t = p - {_PLACE[n]}(a);")
    text.append(f"    {value} c = {corners[0]};")
    result = "c"
    if storage.mapped:
        result = f"(c * {ref.stem}_mapping.{'z' if storage.unorm else 'x'} + {ref.stem}_mapping.y)"
    if kind != "field3" and count < 4:
        result = f"vec4({result}{', 0.0' * (4 - count)})"
    return "\n".join([*text, f"    return {result};\n"])
