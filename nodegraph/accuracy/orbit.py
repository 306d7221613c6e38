"""Cameras around a scene: those that a setting is tuned on, and those that it is tried on afterwards."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from nodegraph import links
from nodegraph.accuracy.settings import WIRED, Settings, parameters_above
from nodegraph.data import Camera
from nodegraph.data.space import Matrix, normalize
from nodegraph.network import split

if TYPE_CHECKING:
    from nodegraph.network import Network

GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
MOST_ELEVATION = 50.0


def turns(number: int) -> tuple[float, float]:
    """Azimuth and elevation, degrees, of the camera with this number; 0 is the given one, no two are alike.

    Azimuths follow the golden ratio and elevations the van der Corput sequence, so any run of numbers goes all around.
    """
    if number == 0:
        return 0.0, 0.0
    return 360.0 * math.fmod(number * GOLDEN, 1.0), MOST_ELEVATION * (2.0 * _van_der_corput(number) - 1.0)


def turned(camera: Camera, azimuth: float, elevation: float) -> Camera:
    """The camera moved about its target: first about its up, then about its right; degrees. Its distance stays."""
    right, _, _ = camera.basis
    up = normalize(np.asarray(camera.up))
    rotation = _rotation(up, azimuth) @ _rotation(right, -elevation)
    eye = np.asarray(camera.target) + rotation @ np.subtract(camera.eye, camera.target)
    return camera.with_(eye=eye.tolist(), up=(rotation @ np.asarray(camera.up)).tolist())


class Orbit:
    """All cameras above a view, turned together. ``fixed`` says why the view cannot be turned, if it cannot."""

    def __init__(self, network: Network, view: str) -> None:
        self._cameras: dict[str, Camera] = {}
        self.fixed = ""
        seen: set[tuple[int, str]] = set()
        for place, parameter, value in parameters_above(network, view):
            if not issubclass(parameter.value_type, Camera) or value is None:
                continue
            if value is WIRED:
                self.fixed = f"{place}: a wire decides the camera, so only the given view is looked at"
                continue
            scoped = _variable(network, place)
            if scoped not in seen or scoped is None:
                self._cameras[place] = value
            if scoped is not None:
                seen.add(scoped)
        if not self._cameras and not self.fixed:
            self.fixed = "no camera is above this view, so there is only one to look at"

    @property
    def places(self) -> tuple[str, ...]:
        """The parameters that are set; each stands for all that share its variable."""
        return tuple(self._cameras)

    def settings(self, number: int) -> Settings:
        """What to set for the camera with this number; nothing for 0, the given one."""
        if number == 0 or self.fixed:
            return {}
        azimuth, elevation = turns(number)
        found: Settings = {}
        for place, camera in self._cameras.items():
            found[place] = turned(camera, azimuth, elevation)
        return found


def _variable(network: Network, place: str) -> tuple[int, str] | None:
    path, name = split(place)
    link: Any = links.link_of(network.root.node(path), name)
    if link is None:
        return None
    scoped = links.lookup(link[0].parent, link[2])
    return (id(scoped[0]), scoped[1]) if scoped is not None else None


def _van_der_corput(number: int) -> float:
    """The digits of a number in base 2, mirrored at the point: 1/2, 1/4, 3/4, 1/8, ..."""
    result, weight = 0.0, 0.5
    while number:
        result += weight * (number & 1)
        number >>= 1
        weight /= 2
    return result


def _rotation(axis: Any, degrees: float) -> Matrix:
    """Right-handed rotation about a unit axis (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = math.radians(degrees)
    matrix: Matrix = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return matrix
