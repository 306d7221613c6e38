"""Oriented planes in world space."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from nodegraph.data.numbers import fields, numbers
from nodegraph.data.space import Vector, normalize
from nodegraph.data.value import Parts, Value
from nodegraph.errors import ParameterError


class Plane(Value):
    """The plane through ``origin`` (world mm) that is perpendicular to ``normal``; the normal is made a unit vector."""

    kind: ClassVar[str] = "Plane"
    origin: tuple[float, float, float]
    normal: tuple[float, float, float]

    def __init__(self, origin: Any = (0.0, 0.0, 0.0), normal: Any = (0.0, 0.0, 1.0), *, where: str = "plane") -> None:
        direction = numbers(normal, 3, f"{where}.normal")
        if not any(direction):
            raise ParameterError(f"{where}.normal: expected a direction other than 0 0 0")
        self._set(origin=numbers(origin, 3, f"{where}.origin"), normal=direction)

    @property
    def unit_normal(self) -> Vector:
        return normalize(self.normal)

    @property
    def axes(self) -> tuple[Vector, Vector]:
        """Unit vectors (right, up) in the plane: up is the world's z as far as possible, else the world's -y."""
        normal = self.unit_normal
        reference = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.999 else np.array([0.0, -1.0, 0.0])
        right = normalize(np.cross(reference, normal))
        return right, np.cross(normal, right)

    def to_json(self) -> dict[str, Any]:
        return {"origin": list(self.origin), "normal": list(self.normal)}

    @classmethod
    def from_json(cls, json: Any, where: str = "plane") -> Plane:
        return cls(**fields(json, ("origin", "normal"), where), where=where)

    def summary(self) -> str:
        return f"through ({', '.join(f'{v:g}' for v in self.origin)}) mm, normal {self.normal}"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Plane) and self.to_json() == other.to_json()

    def __hash__(self) -> int:
        return hash((self.origin, self.normal))

    def to_parts(self) -> Parts:
        return self.to_json(), {}

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: Any) -> Plane:
        return cls.from_json(meta)
