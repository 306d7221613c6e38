"""Find where rays enter and leave a proxy geometry."""

import numpy as np

from nodegraph import Camera, Input, Output, Processor
from nodegraph.data import Image, Mesh
from nodegraph.errors import PortError
from nodegraph.ports import Condition, channels

MOST_PLANES = 64

few_planes = Condition(lambda mesh: len(mesh.planes()) <= MOST_PLANES, f"must have at most {MOST_PLANES} planes")
convex = Condition(lambda mesh: mesh.is_convex(), "must be convex and face outwards")


class EntryExitPoints(Processor):
    """Give the distances at which the ray of each pixel enters and leaves a convex region.

    The region is intersected analytically, as planes, so this needs no rasteriser, has no resolution, and is right
    with the eye inside. Distances are along the ray in mm from the eye (orthographic: from the plane of the eye),
    two channels; both are 0 where the ray misses. Behind an opaque pixel of ``front`` no ray goes on.
    Source: Lindemann 2014, section 1.1 (entry-exit points).
    """

    geometry = Input(Mesh, doc="Closed convex mesh.", accepts=[convex, few_planes])
    front = Input(
        Image,
        required=False,
        accepts=[channels(4)],
        doc="A picture with depth, same size, which hides what is behind it.",
    )
    interval = Output(Image, doc="Entry and exit distances, mm, two channels.")

    camera = Camera(doc="Where the eye is.")

    def process(self, geometry, front, camera, *, size, device):
        # Single precision has no digits left far from the origin, nor far from the eye. So rays start just before the
        # geometry, and the planes are moved in double precision: to the middle of what is seen from afar, else to the
        # eye.
        start, around = start_before(geometry, camera)
        planes = geometry.planes()
        planes[:, 3] += planes[:, :3] @ around
        padded = np.zeros((MOST_PLANES, 4))
        padded[: len(planes)] = planes
        near = np.eye(4)
        near[:3, 3] = -around
        rays = camera.rays(size, near, start)
        hidden = {}
        if front is not None and front.depth_buffer is not None:
            if front.size != size:
                raise PortError(f"front: expected {size[0]}x{size[1]} pixels, got {front.size[0]}x{front.size[1]}")
            hidden = {"front": front.color_buffer, "front_depth": front.depth_buffer, "defines": {"FRONT": True}}
        return Image(
            device.run("render/entry_exit_points", size, camera=rays, planes=padded, count=len(planes), **hidden)
        )


def start_before(geometry, camera):
    """Where rays may start, mm from the eye (orthographic: from its plane), and a point of the world near by."""
    eye = np.asarray(camera.eye)
    if not len(geometry.vertices):
        return 0.0, eye
    middle = (geometry.vertices.min(axis=0) + geometry.vertices.max(axis=0)) / 2
    radius = float(np.linalg.norm(geometry.vertices - middle, axis=1).max())
    view = middle - eye
    away = float(view @ camera.basis[2]) if camera.orthographic else float(np.linalg.norm(view))
    # From as near as the geometry is wide, the distance from the eye itself has digits enough.
    return (away - radius, middle) if away > 3.0 * radius else (0.0, eye)
