"""Halve the resolution of a volume."""

import numpy as np

from nodegraph import Choice, Input, Int, Output, Processor
from nodegraph.data import Volume
from nodegraph.data.space import affine

WEIGHTS = {"box": (0.5, 0.5), "binomial": (0.125, 0.375, 0.375, 0.125)}


class Reduce(Processor):
    """Give a volume of half the voxels along each axis, a quarter, an eighth: less memory, and fewer bricks and steps.

    Each new voxel is a mean over the old ones around its middle: *box* over the two along each axis that it covers;
    *binomial* over four, weighted 1, 3, 3, 1, which keeps less of what the new grid cannot hold. The volume stays where
    it is; where an axis has an odd number of voxels, its last one counts twice, and an axis of one voxel is left alone.
    Whole numbers stay whole, rounded once. Voxels that are not finite take no part.

    The error: between voxels the reduced field differs from the field by at most the range of the voxels that were
    averaged there, and half a stored unit; it is 0 on fields that are affine, away from the border.
    Source: Orhun 2004, OR-05.
    """

    volume = Input(Volume, doc="Any field.")
    reduced = Output(Volume, doc="The same field on fewer voxels, in the same type.")

    halvings = Int(1, min=0, max=12, soft_max=4, quality="lower", reference=0, doc="How often. 0 changes nothing.")
    method = Choice(*WEIGHTS, doc="Which mean is taken.")

    def process(self, volume, halvings, method, *, progress):
        data, matrix = volume.data, volume.index_to_world
        for i in range(halvings):
            counts = np.array(data.shape[:3])
            if counts.max() == 1:
                break
            # (z, y, x) to (x, y, z); the middle of the first pair is half a voxel from the first voxel.
            factor = np.where(counts > 1, 2.0, 1.0)[::-1]
            matrix = matrix @ affine(factor.tolist(), ((factor - 1.0) / 2.0).tolist())
            data = halved(data, WEIGHTS[method])
            progress((i + 1) / halvings)
        if volume.dtype.kind in "iu":
            data = np.rint(data)
        return Volume(data.astype(volume.dtype, copy=False), matrix, volume.mapping)


def halved(data, weights):
    """Means over voxels (z, y, x, ...) at half the resolution, in float32, or float64 where that is needed.

    One plane at a time, so no temporary array is as large as the volume.
    """
    real = (
        np.float64 if data.dtype.itemsize > 4 or (data.dtype.kind in "iu" and data.dtype.itemsize > 2) else np.float32
    )
    shape = [n // 2 + n % 2 for n in data.shape[:3]] + list(data.shape[3:])
    out = np.empty(shape, real)
    for k in range(shape[0]):
        rows = places(data.shape[0], weights)[k]
        near = data[rows].astype(real)
        finite = np.isfinite(near)
        if finite.all():
            out[k] = _mean(near, weights)
        else:
            weight = _mean(finite.astype(real), weights)
            with np.errstate(invalid="ignore", divide="ignore"):
                out[k] = np.where(weight > 0.0, _mean(np.where(finite, near, real(0.0)), weights) / weight, np.nan)
    return out


def places(n, weights):
    """Which of n voxels each new one is made of, (new, weights); beyond the ends the last one repeats."""
    if n == 1:
        return np.zeros((1, len(weights)), int)
    first = 1 - len(weights) // 2
    return np.clip(2 * np.arange(n // 2 + n % 2)[:, None] + first + np.arange(len(weights)), 0, n - 1)


def _mean(near, weights):
    """Weighted mean along the first axis, which holds one plane per weight, then at half resolution along two more."""
    plane = np.tensordot(np.asarray(weights, near.dtype), near, 1)
    for axis in (0, 1):
        rows = places(plane.shape[axis], weights)
        plane = sum(near.dtype.type(w) * np.take(plane, rows[:, i], axis) for i, w in enumerate(weights))
    return plane
