"""Lay uniforms out: one leaf per plain value, with its OpenGL name and its place in OpenCL's parameter blocks."""

from __future__ import annotations

from collections.abc import Sequence

from . import syntax as s
from .module import Leaf
from .names import mangle
from .types import Array, Matrix, Numeric, Struct, Type, components


def sizes(type: Type) -> tuple[int, int]:
    """Return how many (reals, ints) a value occupies in the two blocks."""
    if isinstance(type, Array):
        reals, ints = sizes(type.element)
        return reals * type.count, ints * type.count
    if isinstance(type, Struct):
        parts = [sizes(part) for _, part in type.members]
        return sum(reals for reals, _ in parts), sum(ints for _, ints in parts)
    assert isinstance(type, Numeric | Matrix)
    return (components(type), 0) if block(type) == "real" else (0, components(type))


def block(type: Numeric | Matrix) -> str:
    """Return the block that a plain value lies in."""
    return "real" if isinstance(type, Matrix) or type.base == "float" else "int"


def leaves(uniforms: Sequence[s.Symbol], reals: int = 0, ints: int = 0) -> tuple[Leaf, ...]:
    """Return the leaves of all uniforms in order; the blocks are filled from ``reals`` and ``ints`` on."""
    found: list[Leaf] = []
    at = {"real": reals, "int": ints}

    def walk(type: Type, path: tuple[str | int, ...], name: str) -> None:
        if isinstance(type, Struct):
            for member, part in type.members:
                walk(part, (*path, member), f"{name}.{mangle('m', member)}")
        elif isinstance(type, Array) and isinstance(type.element, Struct):
            for i in range(type.count):
                walk(type.element, (*path, i), f"{name}[{i}]")
        else:
            element = type.element if isinstance(type, Array) else type
            assert isinstance(element, Numeric | Matrix)
            count = type.count if isinstance(type, Array) else 0
            leaf = Leaf(path, element, count, name, block(element), at[block(element)])
            at[leaf.block] += leaf.length
            found.append(leaf)

    for symbol in uniforms:
        walk(symbol.type, (symbol.name,), symbol.printed)
    return tuple(found)
