"""Lamps."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from nodegraph.data.camera import Camera
from nodegraph.data.numbers import fields, number, numbers
from nodegraph.data.space import normalize
from nodegraph.data.value import Parts, Value
from nodegraph.errors import ParameterError

KINDS = ("directional", "point")
FRAMES = ("eye", "world")


class Light(Value):
    """A lamp far away (``directional``) or near (``point``), fixed to the eye or to the world.

    ``position`` is where the light comes from: a direction towards the lamp, or its position in mm. In the
    ``eye`` frame x is right, y up and z backwards, seen by the viewer. ``color`` is linear RGB.
    """

    kind: ClassVar[str] = "Light"
    type: str
    frame: str
    position: tuple[float, float, float]
    color: tuple[float, float, float]
    intensity: float

    def __init__(
        self,
        type: str = "directional",
        frame: str = "eye",
        position: Any = (-0.5, 0.7, 1.0),
        color: Any = (1.0, 1.0, 1.0),
        intensity: float = 1.0,
        *,
        where: str = "light",
    ) -> None:
        self._set(
            type=type,
            frame=frame,
            position=numbers(position, 3, f"{where}.position"),
            color=numbers(color, 3, f"{where}.color"),
            intensity=number(intensity, f"{where}.intensity"),
        )
        if type not in KINDS:
            raise ParameterError(f"{where}.type: expected one of {', '.join(KINDS)}, got {type!r}")
        if frame not in FRAMES:
            raise ParameterError(f"{where}.frame: expected one of {', '.join(FRAMES)}, got {frame!r}")
        if type == "directional" and not any(self.position):
            raise ParameterError(f"{where}.position: a directional light needs a direction other than 0 0 0")
        if self.intensity < 0.0 or min(self.color) < 0.0:
            raise ParameterError(f"{where}: expected a colour and an intensity of at least 0")

    def in_eye_space(self, camera: Camera) -> dict[str, Any]:
        """What a kernel's ``uniform Light light`` needs, in the eye space of ``camera``."""
        position = np.asarray(self.position)
        if self.frame == "world":
            to_world = camera.eye_to_world
            rotation = to_world[:3, :3].T
            position = rotation @ (position - to_world[:3, 3] if self.type == "point" else position)
        if self.type == "directional":
            position = normalize(position)
        return {
            "position": position,
            "color": np.asarray(self.color) * self.intensity,
            "directional": self.type == "directional",
        }

    def to_json(self) -> dict[str, Any]:
        return {
            "type": self.type,
            "frame": self.frame,
            "position": list(self.position),
            "color": list(self.color),
            "intensity": self.intensity,
        }

    @classmethod
    def from_json(cls, json: Any, where: str = "light") -> Light:
        return cls(**fields(json, ("type", "frame", "position", "color", "intensity"), where), where=where)

    def summary(self) -> str:
        return f"{self.type}, {self.frame} frame, from ({', '.join(f'{v:g}' for v in self.position)})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Light) and self.to_json() == other.to_json()

    def __hash__(self) -> int:
        return hash((self.type, self.frame, self.position, self.color, self.intensity))

    def to_parts(self) -> Parts:
        return self.to_json(), {}

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: Any) -> Light:
        return cls.from_json(meta)
