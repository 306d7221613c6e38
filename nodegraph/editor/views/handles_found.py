"""Which parameters of the selected nodes have a handle in a view, and where in the world it stands."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from nodegraph.animation import shared_place
from nodegraph.data import Camera, Light, Plane
from nodegraph.data.space import Matrix
from nodegraph.editor.parameters.place import Place, nearest_volume, shown_parameters
from nodegraph.editor.views.handles_shapes import BoxShape, PlaneShape, Shape
from nodegraph.editor.views.handles_sources import CameraShape, LightShape
from nodegraph.errors import GraphError
from nodegraph.params import Parameter
from nodegraph.subjects import subject_of

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

MOST_NODES = 8
"""Nodes of a selection whose handles are shown."""
SPACES = ("", "voxel", "mm")
"""Units of boxes that are understood: parts of the volume along its axes, its voxels, the world."""


@dataclass(frozen=True, slots=True, eq=False)
class Handle:
    """The handle of a parameter. locked: a wire or an expression decides, so it is only looked at."""

    place: Place
    shape: Shape
    locked: bool


def handles_of(session: Session, view: str, cameras: tuple[str, ...], camera: Camera) -> list[Handle]:
    """The handles of the selected nodes in a view.

    cameras: parameters that move with the view itself; they have no handle in it. camera: their value.
    """
    network = session.network
    seen = {shared_place(network, target) for target in cameras}
    found = []
    for path in session.selection[:MOST_NODES]:
        for place in _places(session, path):
            try:
                where = shared_place(network, place.target)
                if where in seen:
                    continue
                seen.add(where)
                shape = _shape(session, view, place, camera)
            except GraphError:
                continue  # the panel says what is wrong with it
            if shape is not None:
                found.append(Handle(place, shape, place.tie().locked))
    return found


def _places(session: Session, path: str) -> list[Place]:
    """The parameters of a node that a view can move; of a view, the camera that its picture is taken with."""
    node = session.network.node(path)
    if node.processor is not None and node.processor.id == "output.view":
        try:
            targets = subject_of(session.network, path).cameras[:1]
        except GraphError:
            targets = ()
        return [Place(session, *target.rsplit(".", 1)) for target in targets]
    places = [Place(session, path, name) for name in shown_parameters(session, path)]
    return [place for place in places if place.declared.handle in ("box", "plane", "light", "camera")]


def _shape(session: Session, view: str, place: Place, camera: Camera) -> Shape | None:
    value, declared = place.value(), place.declared
    if declared.handle == "box":
        return _box(place, value, declared)
    if isinstance(value, Plane):
        volume = place.volume() or nearest_volume(session, view)
        return PlaneShape(value, np.asarray(volume.corners) if volume is not None else np.empty((0, 3)))
    if isinstance(value, Light):
        return LightShape(value, camera)
    return CameraShape(value) if isinstance(value, Camera) else None


def _box(place: Place, value: Any, declared: Parameter) -> Shape | None:
    """A box in the space that its unit names. None where the volume that it is a part of is not known yet."""
    if declared.unit not in SPACES:
        return None
    volume = place.volume()
    if declared.unit == "mm":
        if volume is None and value is None:
            return None
        whole = (volume.corners.min(axis=0), volume.corners.max(axis=0)) if volume is not None else value
        return BoxShape(value, np.eye(4), whole, "mm")
    if volume is None:
        return None
    dims = np.asarray(volume.dims, np.float64)
    if declared.unit == "voxel":
        return BoxShape(value, volume.index_to_world, (np.full(3, -0.5), dims - 0.5), "voxel")
    fractions: Matrix = np.diag([*dims, 1.0])
    fractions[:3, 3] = -0.5
    return BoxShape(value, volume.index_to_world @ fractions, (np.zeros(3), np.ones(3)), bounded=True)
