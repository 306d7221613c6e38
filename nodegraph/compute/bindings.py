"""From what a processor binds by name to the numbers and buffers that a kernel declares."""

from __future__ import annotations

import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nodegraph.compute.language import FieldDecl, Layout, Leaf, Matrix, Module, Numeric, Struct, Uniform
from nodegraph.data.buffer import Array, Buffer
from nodegraph.errors import ParameterError, near_miss

RESERVED = ("kernel", "size", "defines", "check", "progress", "work", "turns")
"""Names of the arguments of `Device.run`: no uniform can be bound under these."""

NAMED_OUTPUTS = {
    "float": Numeric("float"),
    "vec2": Numeric("float", 2),
    "vec4": Numeric("float", 4),
    "int": Numeric("int"),
    "uint": Numeric("uint"),
}
"""What a kernel or a shader may return for each pixel."""

_MISSING = object()
_LIMITS = {"int": (-(2**31), 2**31 - 1), "uint": (0, 2**32 - 1)}
_tables: weakref.WeakKeyDictionary[Any, Buffer] = weakref.WeakKeyDictionary()


@dataclass(frozen=True)
class FieldSource:
    """What one field, or one element of a field array, reads: a buffer and the value mapping of its volume."""

    buffer: Buffer
    mapping: tuple[float, float] = (1.0, 0.0)


def check_names(module: Module, bindings: Mapping[str, Any], kernel: str) -> None:
    """Raise ParameterError for a binding that the kernel does not declare and for one that it lacks."""
    declarations: list[Uniform | FieldDecl] = [*module.uniforms, *module.fields]
    declared = {declaration.name: declaration for declaration in declarations}
    for name in declared:
        if name in RESERVED:
            raise ParameterError(f"{kernel}.{name}: this name belongs to an argument of run(); rename the uniform")
    for name in bindings:
        if name not in declared and name not in module.absent:
            raise ParameterError(
                f"{kernel}.{name}: the kernel declares no such uniform or field{near_miss(name, declared)}"
            )
    for name, declaration in declared.items():
        if not declaration.used or bindings.get(name) is not None:
            continue
        if name in bindings:
            raise ParameterError(f"{kernel}.{name}: None was bound; the kernel reads it, so give it a value")
        if isinstance(declaration, FieldDecl) or declaration.default is None:
            near = near_miss(name, [b for b in bindings if b not in declared])
            raise ParameterError(f"{kernel}.{name}: the kernel reads it and nothing is bound to it{near}")


def leaf_values(module: Module, layout: Layout, bindings: Mapping[str, Any], kernel: str, real: Any) -> list[Array]:
    """Return the numbers of every leaf of a layout, in its order: float64 or int64, flat.

    ParameterError for what does not fit its type, a real beyond the range of the device's ``real`` included.
    """
    uniforms = {uniform.name: uniform for uniform in module.uniforms}
    values = []
    for leaf in layout.leaves:
        uniform = uniforms[str(leaf.path[0])]
        value = bindings.get(uniform.name, uniform.default)
        values.append(_numbers(leaf, _descend(value, leaf, uniform, kernel), kernel))
    # All at once: asked leaf by leaf this took as long as all the rest.
    if values and _beyond(np.concatenate(values), real).any():
        for leaf, numbers in zip(layout.leaves, values, strict=True):
            found = numbers[_beyond(numbers, real)]
            if found.size:
                raise ParameterError(f"{_place(kernel, leaf)}: {found[0]:g} is beyond single precision")
    return values


def _beyond(numbers: Array, real: Any) -> Array:
    """Where finite numbers pass what a device computes in. Whole numbers of 32 bits never do."""
    flags: Array = (np.abs(numbers) > float(np.finfo(real).max)) & np.isfinite(numbers)
    return flags


def _descend(value: Any, leaf: Leaf, uniform: Uniform, kernel: str) -> Any:
    """Follow the path of a leaf into mappings, objects and sequences."""
    if isinstance(uniform.type, Struct) and uniform.count and not isinstance(value, Sequence):
        raise ParameterError(f"{kernel}.{uniform.name}: expected a sequence of {uniform.count} {uniform.type}")
    place = f"{kernel}.{uniform.name}"
    for depth, step in enumerate(leaf.path[1:]):
        if isinstance(step, int):
            if depth == 0 and len(value) != uniform.count:
                raise ParameterError(f"{place}: expected {uniform.count} values of {uniform.type}, got {len(value)}")
            value = value[step]
            place += f"[{step}]"
            continue
        if isinstance(value, Mapping):
            found = value.get(step, _MISSING)
        else:
            found = getattr(value, step, _MISSING)
        if found is _MISSING or found is None:
            known = list(value) if isinstance(value, Mapping) else [n for n in dir(value) if not n.startswith("_")]
            raise ParameterError(
                f"{place}.{step}: {type(value).__name__} has no such member{near_miss(step, map(str, known))}"
            )
        value = found
        place += f".{step}"
    return value


def _numbers(leaf: Leaf, value: Any, kernel: str) -> Array:
    """Check one leaf against its type and return its numbers, matrices column by column."""
    kind = leaf.type
    base = "float" if isinstance(kind, Matrix) else kind.base
    if type(value) in (float, int, bool) and isinstance(kind, Numeric) and kind.n == 1 and not leaf.count:
        # Nearly all uniforms are plain numbers; this path costs a fifth of the general one.
        array = np.array([value])  # of objects for an int beyond 64 bits, which is refused below
    else:
        try:
            array = np.asarray(value)
        except ValueError:
            array = np.asarray(None)
        expected = (kind.n, kind.n) if isinstance(kind, Matrix) else (kind.n,) if kind.n > 1 else ()
        if leaf.count:
            expected = (leaf.count, *expected)
        if array.shape != expected or array.dtype.kind not in "biuf":
            raise ParameterError(f"{_place(kernel, leaf)}: expected {_describe(leaf)}, got {_shown(value)}")
        if isinstance(kind, Matrix):
            array = np.swapaxes(array, -1, -2)
        array = array.reshape(-1)
    if base == "float":
        if array.dtype.kind == "b":
            raise ParameterError(f"{_place(kernel, leaf)}: expected {_describe(leaf)}, got {_shown(value)}")
        return np.asarray(array, np.float64)
    if base == "bool":
        if array.dtype.kind == "f":
            raise ParameterError(f"{_place(kernel, leaf)}: expected {_describe(leaf)}, got {_shown(value)}")
        return np.asarray(array != 0, np.int64)
    whole = np.asarray(array, np.int64) if array.dtype.kind in "biu" else None
    low, high = _LIMITS[base]
    if whole is None or array.dtype.kind == "b" or (whole < low).any() or (whole > high).any():
        raise ParameterError(f"{_place(kernel, leaf)}: expected {_describe(leaf)}, got {_shown(value)}")
    return whole


def _place(kernel: str, leaf: Leaf) -> str:
    text = f"{kernel}.{leaf.path[0]}"
    for step in leaf.path[1:]:
        text += f"[{step}]" if isinstance(step, int) else f".{step}"
    return text


def _describe(leaf: Leaf) -> str:
    kind = leaf.type
    if isinstance(kind, Matrix):
        text = f"{kind} ({kind.n}x{kind.n} numbers, rows first)"
    elif kind.n == 1:
        text = {"float": "a number", "int": "an int", "uint": "an int from 0", "bool": "a bool"}[kind.base]
    else:
        text = f"{kind} ({kind.n} {'ints' if kind.base in ('int', 'uint') else kind.base + 's'})"
    return f"{leaf.count} times {text}" if leaf.count else text


def _shown(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"an array {value.shape} of {value.dtype}"
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def field_sources(field: FieldDecl, value: Any, kernel: str) -> tuple[FieldSource, ...]:
    """Return what a field reads: one source, or ``count`` of them for a field array."""
    place = f"{kernel}.{field.name}"
    if not field.count:
        return (_source(field.kind, value, place),)
    if not isinstance(value, Sequence) or len(value) != field.count:
        got = f"{len(value)} values" if isinstance(value, Sequence) else type(value).__name__
        raise ParameterError(f"{place}: expected a sequence of {field.count} volumes, got {got}")
    return tuple(_source(field.kind, item, f"{place}[{i}]") for i, item in enumerate(value))


def _source(kind: str, value: Any, place: str) -> FieldSource:
    from nodegraph.data.image import Image
    from nodegraph.data.transfer_function import TransferFunction
    from nodegraph.data.volume import Labels, Volume

    if isinstance(value, Buffer):
        return FieldSource(value)
    if isinstance(value, np.ndarray):
        return FieldSource(Buffer(value))
    if isinstance(value, Volume) and kind in ("field3", "field3v"):
        return FieldSource(value.buffer, (value.mapping.scale, value.mapping.offset))
    if isinstance(value, Labels) and kind == "field3u":
        return FieldSource(value.buffer)
    if isinstance(value, Image) and kind == "field2":
        return FieldSource(value.color_buffer)
    if isinstance(value, Image) and kind == "field2u" and value.ids_buffer is not None:
        return FieldSource(value.ids_buffer)
    if isinstance(value, TransferFunction) and kind == "field1":
        # Functions with equal keys share one table, and so one copy on the device.
        table = _tables.get(value)
        if table is None:
            table = _tables[value] = Buffer(value.table())
        return FieldSource(table)
    expected = {
        "field3": "a scalar Volume",
        "field3v": "a Volume",
        "field3u": "Labels",
        "field2": "an Image",
        "field2u": "an Image with ids",
        "field1": "a TransferFunction",
    }[kind]
    raise ParameterError(f"{place}: expected {expected}, a Buffer or an array, got {type(value).__name__}")
