"""Where a picture is taken from."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.numbers import fields, number, numbers
from nodegraph.data.space import Matrix, Vector, frozen, normalize
from nodegraph.data.value import Parts, Value
from nodegraph.errors import ParameterError

PROJECTIONS = ("perspective", "orthographic")


class Camera(Value):
    """Eye, target and up in world mm; perspective with a vertical field of view, or orthographic with a height.

    Eye space is right-handed: x to the right, y up, z backwards, origin at the eye, mm. There are no clipping
    planes: rays start at the eye (orthographic: at the plane of the eye). ``field_of_view`` is vertical, in
    degrees; ``height`` is what an orthographic picture covers from bottom to top, mm. Raises ParameterError
    for a camera that looks nowhere: eye at the target, or up along the view.
    """

    kind: ClassVar[str] = "Camera"
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    up: tuple[float, float, float]
    projection: str
    field_of_view: float
    height: float

    def __init__(
        self,
        eye: Any = (0.0, -600.0, 0.0),
        target: Any = (0.0, 0.0, 0.0),
        up: Any = (0.0, 0.0, 1.0),
        projection: str = "perspective",
        field_of_view: float = 30.0,
        height: float = 300.0,
        *,
        where: str = "camera",
    ) -> None:
        self._set(
            eye=numbers(eye, 3, f"{where}.eye"),
            target=numbers(target, 3, f"{where}.target"),
            up=numbers(up, 3, f"{where}.up"),
            projection=projection,
            field_of_view=number(field_of_view, f"{where}.field_of_view"),
            height=number(height, f"{where}.height"),
        )
        if projection not in PROJECTIONS:
            raise ParameterError(f"{where}.projection: expected one of {', '.join(PROJECTIONS)}, got {projection!r}")
        if not 0.0 < self.field_of_view < 180.0:
            raise ParameterError(f"{where}.field_of_view: {self.field_of_view:g} is outside 0..180 degrees")
        if not self.height > 0.0:
            raise ParameterError(f"{where}.height: expected a height above 0 mm, got {self.height:g}")
        view = np.subtract(self.target, self.eye)
        if not float(view @ view) > 0.0:
            raise ParameterError(f"{where}: the eye lies at the target; move one of them")
        if np.linalg.norm(np.cross(normalize(view), normalize(self.up))) < 1e-9:
            raise ParameterError(f"{where}: up is parallel to the view (or zero); choose another up")
        forward = normalize(view)
        right = normalize(np.cross(forward, normalize(self.up)))
        self._set(_basis=tuple(frozen(axis) for axis in (right, np.cross(right, forward), forward)))

    _basis: tuple[Vector, Vector, Vector]

    @property
    def basis(self) -> tuple[Vector, Vector, Vector]:
        """Unit vectors (right, up, forward) in world space."""
        return self._basis

    @property
    def orthographic(self) -> bool:
        return self.projection == "orthographic"

    @property
    def eye_to_world(self) -> Matrix:
        """4x4, eye space (x right, y up, z backwards) to world."""
        right, up, forward = self._basis
        matrix = np.eye(4)
        matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = right, up, -forward, self.eye
        return matrix

    def rays(self, size: tuple[int, int], world_to_space: Matrix | None = None, start: float = 0.0) -> dict[str, Any]:
        """What a kernel's ``uniform Camera camera`` needs to cast rays in a space, for example index space.

        Distances along rays stay in world mm: directions are unit vectors of world space taken to that space.
        The eye is transformed here in double precision, so a far-away world origin costs no digits; with ``start``
        mm from the eye as the origin of rays, neither does an eye that is far from what it looks at.
        """
        matrix = np.eye(4) if world_to_space is None else np.asarray(world_to_space)
        linear = matrix[:3, :3]
        right, up, forward = self._basis
        half = self.height / 2 if self.orthographic else math.tan(math.radians(self.field_of_view) / 2)
        return {
            "eye": linear @ np.asarray(self.eye) + matrix[:3, 3],
            "base": linear @ (np.asarray(self.eye) + start * forward) + matrix[:3, 3],
            "start": start,
            "right": linear @ right,
            "up": linear @ up,
            "forward": linear @ forward,
            "half_size": (half * size[0] / size[1], half),
            "pixels": (float(size[0]), float(size[1])),
            "orthographic": self.orthographic,
        }

    def ray(self, size: tuple[int, int], x: float, y: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Origin and unit direction, world, of the ray through the middle of pixel (x, y); the kernels' numpy twin."""
        rays = self.rays(size)
        sx = ((x + 0.5) / size[0] * 2 - 1) * rays["half_size"][0]
        sy = (1 - (y + 0.5) / size[1] * 2) * rays["half_size"][1]
        offset = sx * rays["right"] + sy * rays["up"]
        if self.orthographic:
            return rays["eye"] + offset, rays["forward"]
        return rays["eye"], normalize(rays["forward"] + offset)

    def with_(self, **changes: Any) -> Camera:
        """A camera that differs in the named attributes."""
        return Camera(**{**self.to_json(), **changes})

    def to_json(self) -> dict[str, Any]:
        return {
            "eye": list(self.eye),
            "target": list(self.target),
            "up": list(self.up),
            "projection": self.projection,
            "field_of_view": self.field_of_view,
            "height": self.height,
        }

    @classmethod
    def from_json(cls, json: Any, where: str = "camera") -> Camera:
        allowed = ("eye", "target", "up", "projection", "field_of_view", "height")
        return cls(**fields(json, allowed, where), where=where)

    def summary(self) -> str:
        lens = f"{self.height:g} mm high" if self.orthographic else f"{self.field_of_view:g} degrees"
        return f"{self.projection} {lens}, eye ({', '.join(f'{v:g}' for v in self.eye)}) mm"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Camera) and self.to_json() == other.to_json()

    def __hash__(self) -> int:
        return hash((self.eye, self.target, self.up, self.projection, self.field_of_view, self.height))

    def to_parts(self) -> Parts:
        return self.to_json(), {}

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: Any) -> Camera:
        return cls.from_json(meta)
