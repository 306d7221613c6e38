"""Where points of the world are seen in a view, and the reverse, for whatever is drawn over its picture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from nodegraph.data import Camera, Plane
from nodegraph.data.space import Vector
from nodegraph.editor.views import navigation as nav


@dataclass(frozen=True, slots=True)
class Sight:
    """How a view looks at the world: through a camera, or at a plane of which it shows ``height`` mm.

    size: of the picture area, logical pixels. Places are in these pixels, from the upper left.
    """

    size: nav.Size
    camera: Camera | None = None
    plane: Plane | None = None
    height: float = 0.0

    def seen(self, point: Iterable[float]) -> nav.Point | None:
        """The place where a point (world, mm) is seen; None behind the eye. On a cut, where it lies when projected."""
        point = np.asarray(tuple(point), np.float64)
        if self.camera is not None:
            away = float((point - self.camera.eye) @ self.camera.basis[2])
            if not self.camera.orthographic and away < 1e-6:
                return None
            return nav.seen_at(self.camera, self.size, point)
        assert self.plane is not None
        return nav.seen_on_plane(self.plane, self.height, self.size, point)

    def off(self, point: Iterable[float]) -> float:
        """Distance of a point from the plane of a cut, mm, positive towards the viewer; 0 where there is a camera."""
        if self.plane is None:
            return 0.0
        return float((np.asarray(tuple(point)) - self.plane.origin) @ self.plane.unit_normal)

    def world(self, at: nav.Point) -> Vector:
        """The point under a place: on the plane of a cut, or in the plane of the camera's focus."""
        if self.camera is not None:
            return nav.on_focus(self.camera, self.size, at)
        assert self.plane is not None
        return nav.on_plane(self.plane, self.height, self.size, at)
