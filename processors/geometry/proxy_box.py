"""Make the box of a volume."""

import numpy as np

from nodegraph import Box, Input, Output, Processor
from nodegraph.data import Mesh, Volume
from nodegraph.data.mesh import box
from nodegraph.data.space import transform_points


class ProxyBox(Processor):
    """Give the box that a volume fills, or a part of it, as a closed mesh in world space.

    The box reaches half a voxel beyond the outermost voxel centres. The crop is in fractions of the volume along
    its own axes, so it means the same part of the patient at any resolution.
    """

    volume = Input(Volume, doc="Any grid.")
    geometry = Output(Mesh, doc="Twelve triangles, facing outwards.")

    crop = Box(None, unit="", handle="box", doc="Part of the volume, 0..1 along its x, y and z; none for all of it.")

    def process(self, volume, crop):
        if crop is None:
            return box(volume.corners)
        low, high = np.clip(np.asarray(crop, np.float64), 0.0, 1.0)
        picks = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)])
        fractions = np.where(picks, high, low)
        return box(transform_points(volume.index_to_world, fractions * volume.dims - 0.5))
