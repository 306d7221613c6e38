"""Smooth a volume with a Gaussian."""

import numpy as np

from nodegraph import Float, Input, Output, Processor
from nodegraph.data import Mapping, Volume


class GaussianBlur(Processor):
    """Replace every voxel by the Gaussian-weighted mean of its surroundings.

    The width is physical, so anisotropic voxels are treated fairly. Borders repeat the edge. Voxels that are not
    finite take no part: the mean is over the others, and where there are none the result is not a number.
    Components are smoothed one by one. Values that lie close together far from 0 keep their digits: what they have in
    common is the offset of the result.
    """

    volume = Input(Volume, doc="Any field.")
    smoothed = Output(Volume, doc="Same grid, float32.")

    sigma = Float(1.0, min=0.0, soft_max=10.0, unit="mm", doc="Standard deviation.")

    def process(self, volume, sigma):
        level = volume.origin
        values = volume.less(level).real(np.float32)
        mapping = Mapping(offset=level, unit=volume.mapping.unit)
        # (x, y, z) mm to (z, y, x) voxels; from a million on, a Gaussian is flat over any volume.
        width = (np.minimum(sigma, 1e6 * volume.spacing) / volume.spacing)[::-1]
        finite = np.isfinite(values)
        if finite.all():
            return volume.with_data(blur(values, width), mapping)
        total = blur(np.where(finite, values, np.float32(0)), width)
        weight = blur(finite.astype(np.float32), width)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.where(weight > 1e-6, total / weight, np.float32(np.nan))
        return volume.with_data(mean, mapping)


def blur(values, width):
    """Gaussian of ``width`` (z, y, x) voxels over the first three axes of a float32 array, edges repeated."""
    from scipy import ndimage

    width = (*width, *[0.0] * (values.ndim - 3))
    # Beyond its own length an axis holds nothing new; a longer kernel would only cost memory and time.
    radius = [min(int(4.0 * w + 0.5), 4 * n) for w, n in zip(width, values.shape, strict=True)]
    return ndimage.gaussian_filter(values, width, mode="nearest", radius=radius, output=np.float32)
