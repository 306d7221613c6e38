"""The types of the kernel language.

Types are values: two equal types are the same type. ``str(type)`` is the name that a kernel author writes.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Numeric:
    """A scalar (``n`` is 1) or a vector of 2 to 4 components. ``base`` is float, int, uint or bool."""

    base: str
    n: int = 1

    def __str__(self) -> str:
        if self.n == 1:
            return self.base
        return {"float": "vec", "int": "ivec", "uint": "uvec", "bool": "bvec"}[self.base] + str(self.n)


@dataclass(frozen=True)
class Matrix:
    """A square float matrix of ``n`` columns; opaque in the language except for ``transform``."""

    n: int

    def __str__(self) -> str:
        return f"mat{self.n}"


@dataclass(frozen=True)
class Struct:
    """A structure with its members in order of declaration."""

    name: str
    members: tuple[tuple[str, Type], ...]

    def __str__(self) -> str:
        return self.name

    def member(self, name: str) -> Type | None:
        """Return the type of a member, or None when there is no such member."""
        return dict(self.members).get(name)


@dataclass(frozen=True)
class Array:
    """``count`` values of one type. Arrays of arrays do not exist."""

    element: Numeric | Matrix | Struct
    count: int

    def __str__(self) -> str:
        return f"{self.element}[{self.count}]"


@dataclass(frozen=True)
class Field:
    """A volume, image or table; ``count`` is the length of a field array, 0 for a single field."""

    kind: str
    count: int = 0

    def __str__(self) -> str:
        return f"{self.kind}[{self.count}]" if self.count else self.kind


@dataclass(frozen=True)
class Void:
    """The type of a function that returns nothing."""

    def __str__(self) -> str:
        return "void"


Type = Numeric | Matrix | Struct | Array | Field | Void

FLOAT = Numeric("float")
INT = Numeric("int")
UINT = Numeric("uint")
BOOL = Numeric("bool")
VOID = Void()

#: Every type that has a name of its own, by that name.
NAMED: dict[str, Type] = {
    "void": VOID,
    "mat3": Matrix(3),
    "mat4": Matrix(4),
    **{str(Numeric(base, n)): Numeric(base, n) for base in ("float", "int", "uint", "bool") for n in (1, 2, 3, 4)},
    **{kind: Field(kind) for kind in ("field3", "field3v", "field3u", "field2", "field2u", "field1")},
}

#: Number of index axes of each kind of field.
FIELD_AXES = {"field3": 3, "field3v": 3, "field3u": 3, "field2": 2, "field2u": 2, "field1": 1}


def vector(n: int, base: str = "float") -> Numeric:
    """Return the vector (or, for n = 1, the scalar) of ``n`` components."""
    return Numeric(base, n)


def components(type: Numeric | Matrix) -> int:
    """Return how many scalars a value of this type holds."""
    return type.n if isinstance(type, Numeric) else type.n * type.n
