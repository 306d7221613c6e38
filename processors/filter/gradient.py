"""Compute the gradient of a volume."""

import numpy as np

from nodegraph import Choice, Input, Output, Processor
from nodegraph.data import Mapping, Volume
from nodegraph.ports import has_components

METHODS = ("central", "forward", "sobel")


class Gradient(Processor):
    """Give the gradient in world space and its length, four components: x, y, z and magnitude, per mm.

    *central* differences span two voxels and are exact on quadratic fields; *forward* ones span one voxel and lie
    half a voxel off; *sobel* is the central difference averaged over 3x3 neighbours with the weights 6, 3 and 2.
    At the border the missing neighbour is left out and the distance halved. Along an axis of one voxel the
    gradient is 0. Where a difference needs a voxel that is not finite, no component is a number.
    Source: Orhun 2004, OR-14, OR-15, OR-18, OR-22.
    """

    volume = Input(Volume, doc="Scalar field.", accepts=[has_components(1)])
    gradient = Output(Volume, doc="Same grid, (x, y, z, magnitude) per mm, in the precision of the device.")

    method = Choice(*METHODS, doc="Which differences are taken.")

    def process(self, volume, method, *, device):
        data = device.run(
            "filter/gradient",
            volume.dims,
            defines={"METHOD": METHODS.index(method)},
            volume=volume.less(volume.origin),
            to_world=volume.world_to_index[:3, :3].T,
        )
        unit = f"{volume.mapping.unit}/mm" if volume.mapping.unit else "1/mm"
        return Volume(data, np.asarray(volume.index_to_world), Mapping(unit=unit))
