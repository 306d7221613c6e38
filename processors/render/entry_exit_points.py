"""Find where rays enter and leave a proxy geometry."""

import numpy as np

from nodegraph import Camera, Input, Output, Processor
from nodegraph.data import Image, Mesh
from nodegraph.ports import Condition

MOST_PLANES = 64

few_planes = Condition(lambda mesh: len(mesh.planes()) <= MOST_PLANES, f"must have at most {MOST_PLANES} planes")
convex = Condition(lambda mesh: mesh.is_convex(), "must be convex and face outwards")


class EntryExitPoints(Processor):
    """Give the distances at which the ray of each pixel enters and leaves a convex region.

    The region is intersected analytically, as planes, so this needs no rasteriser, has no resolution, and is right
    with the eye inside. Distances are along the ray in mm from the eye (orthographic: from the plane of the eye),
    two channels; both are 0 where the ray misses. Source: Lindemann 2014, section 1.1 (entry-exit points).
    """

    geometry = Input(Mesh, doc="Closed convex mesh.", accepts=[convex, few_planes])
    interval = Output(Image, doc="Entry and exit distances, mm, two channels.")

    camera = Camera(doc="Where the eye is.")

    def process(self, geometry, camera, *, size, device):
        # The planes are moved to the eye in double precision: far from the origin, single precision has no digits left.
        eye = np.asarray(camera.eye)
        planes = geometry.planes()
        planes[:, 3] += planes[:, :3] @ eye
        padded = np.zeros((MOST_PLANES, 4))
        padded[: len(planes)] = planes
        to_eye = np.eye(4)
        to_eye[:3, 3] = -eye
        return Image(
            device.run(
                "render/entry_exit_points", size, camera=camera.rays(size, to_eye), planes=padded, count=len(planes)
            )
        )
