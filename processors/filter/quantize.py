"""Store a volume in fewer bits."""

import numpy as np

from nodegraph import Choice, Float, Input, Output, Processor
from nodegraph.data import Mapping, Volume
from nodegraph.data.volume import slabs
from nodegraph.errors import PortError

TYPES = ("uint8", "float16", "uint16")
SMALLEST_FIRST = ("uint8", "uint16", "float16")
"""What *automatic* tries: of the two that take as much, the one that loses less."""


class Quantize(Processor):
    """Keep the values of a volume in 8 or 16 bits: half or a quarter of the memory, and of what a ray has to fetch.

    Values are laid over the range of the type, so the error is at most that share of the volume's own range R:

    - *uint8*: R / 510, *uint16*: R / 131070; 0 for whole numbers whose range the type can count. Voxels that are not
      finite cannot be held.
    - *float16*: R / 8192. Voxels that are not finite stay what they are.
    - *automatic*: the smallest whose error is at most ``max_error``, else the volume as it is.

    Which it is, and its bound, is told by `nodegraph explain --scene`.
    """

    volume = Input(Volume, doc="Any field.")
    quantized = Output(Volume, doc="Same grid; the values are scaled back by its mapping.")

    storage = Choice(
        "automatic", "unchanged", *TYPES, quality=(*TYPES, "unchanged"), doc="Type of the numbers that are stored."
    )
    max_error = Float(
        0.0, min=0.0, soft_max=1.0, quality="lower", reference=0.0, visible_if={"storage": "automatic"},
        doc="What a value may lose, in the volume's unit.",
    )  # fmt: skip

    def process(self, volume, storage, max_error, *, explain):
        if storage == "automatic":
            fitting = [name for name in SMALLEST_FIRST if is_smaller(volume, name) and bound(volume, name) <= max_error]
            storage = (fitting or ["unchanged"])[0]
        if storage == "unchanged":
            explain(f"kept as {volume.dtype}")
            return volume
        error = bound(volume, storage)
        if error == np.inf:
            raise PortError(
                f"volume: {storage} cannot hold voxels that are not finite; store them as float16 or unchanged"
            )
        explain(f"stored as {storage}: off by at most {error:.3g} {volume.mapping.unit}".rstrip())
        return stored(volume, storage)


def is_smaller(volume, storage):
    """Whether a type takes fewer bytes than the volume does."""
    return np.dtype(storage).itemsize < volume.dtype.itemsize


def bound(volume, storage):
    """What a real value may lose in a type; inf where it cannot hold a voxel."""
    low, high = volume.range
    if storage == "float16":
        # Values lie in -1..1, where half floats are at most 2^-11 apart.
        return (high - low) / 2**13
    if not is_finite(volume):
        return np.inf
    steps = int(np.iinfo(storage).max)
    return 0.0 if counts_up_to(volume, steps) else (high - low) / steps / 2.0


def counts_up_to(volume, steps):
    """Whether these are whole numbers that lie at most so many apart."""
    low, high = volume.range
    return volume.dtype.kind in "iu" and round((high - low) / abs(volume.mapping.scale)) <= steps


def is_finite(volume):
    """Whether all voxels are finite numbers."""
    return volume.dtype.kind != "f" or all(bool(np.isfinite(part).all()) for _, part in volume.buffer.slabs())


def stored(volume, storage):
    """The volume in a type, with the mapping that takes it back. Slab by slab."""
    low, high = volume.range
    scale, offset, unit = volume.mapping
    if storage == "float16":
        size, start = (high - low) / 2.0, (high + low) / 2.0
    elif counts_up_to(volume, steps := int(np.iinfo(storage).max)):
        size, start = abs(scale), low
    else:
        size, start = (high - low) / steps, low
    size = size or 1.0
    out = np.empty(volume.data.shape, storage)
    for slab in slabs(volume.data):
        values = volume.data[slab].astype(np.float64) * scale + offset
        scaled = (values - start) / size
        out[slab] = scaled if storage == "float16" else np.rint(scaled)
    return volume.with_data(out, Mapping(size, start, unit))
