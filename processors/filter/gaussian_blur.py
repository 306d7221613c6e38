"""Smooth a volume with a Gaussian."""

import numpy as np

from nodegraph import Choice, Float, Input, Output, Processor
from nodegraph.data import Mapping, Volume


class GaussianBlur(Processor):
    """Replace every voxel by the Gaussian-weighted mean of its surroundings.

    The width is physical, so anisotropic voxels are treated fairly. Borders repeat the edge. Voxels that are not
    finite take no part: the mean is over the others, and where there are none the result is not a number.
    Components are smoothed one by one. Values that lie close together far from 0 keep their digits: what they have in
    common is the offset of the result.
    """

    volume = Input(Volume, doc="Any field.")
    smoothed = Output(Volume, doc="Same grid, in the precision asked for.")

    sigma = Float(1.0, min=0.0, soft_max=10.0, unit="mm", doc="Standard deviation.")
    reach = Float(
        4.0, min=1.0, max=10.0, unit="sigma", quality="higher", reference=8.0,
        doc="Where the Gaussian is cut off. At 4 it leaves out 6e-5 of its weight along each axis.",
    )  # fmt: skip
    precision = Choice(
        "single", "double", quality=("single", "double"), reference="double", doc="Of the numbers that come out."
    )

    def process(self, volume, sigma, reach, precision):
        level = volume.origin
        real = np.float64 if precision == "double" else np.float32
        values = volume.less(level).real(real)
        mapping = Mapping(offset=level, unit=volume.mapping.unit)
        # (x, y, z) mm to (z, y, x) voxels; from a million on, a Gaussian is flat over any volume.
        width = (np.minimum(sigma, 1e6 * volume.spacing) / volume.spacing)[::-1]
        finite = np.isfinite(values)
        if finite.all():
            return volume.with_data(blur(values, width, reach), mapping)
        total = blur(np.where(finite, values, real(0)), width, reach)
        weight = blur(finite.astype(real), width, reach)
        with np.errstate(invalid="ignore", divide="ignore"):
            mean = np.where(weight > 1e-6, total / weight, real(np.nan))
        return volume.with_data(mean, mapping)


def blur(values, width, reach):
    """Gaussian of ``width`` (z, y, x) voxels over the first three axes of an array of reals, edges repeated."""
    from scipy import ndimage

    width = (*width, *[0.0] * (values.ndim - 3))
    # Beyond its own length an axis holds nothing new; a longer kernel would only cost memory and time.
    radius = [min(int(reach * w + 0.5), 4 * n) for w, n in zip(width, values.shape, strict=True)]
    return ndimage.gaussian_filter(values, width, mode="nearest", radius=radius, output=values.dtype)
