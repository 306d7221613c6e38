"""Store a volume in fewer bits."""

import math

import numpy as np

from nodegraph import Choice, Float, Input, Output, Processor
from nodegraph.data import Volume
from nodegraph.data.quantisation import TYPES, bound, narrowest, stored
from nodegraph.errors import PortError


class Quantize(Processor):
    """Keep the values of a volume in fewer bits: less memory, and less that a ray has to fetch.

    Values are laid over the range of the type, so the error is at most that share of the volume's own range R:

    - *uint8*: R / 510, *uint16*: R / 131070; 0 for whole numbers whose range the type can count. Voxels that are not
      finite cannot be held.
    - *float16*: R / 8192, *float32*: R / 67108864; 0 for whole numbers up to 2^24 apart. Voxels that are not finite
      stay what they are.
    - *automatic*: the smallest whose error is at most ``max_error``, else the volume as it is.

    Which it is, and its bound, is told by `nodegraph explain --scene`. A ray-caster does the same for itself alone, by
    its ``value_error``.
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
            storage = narrowest(volume, max_error, lambda name: np.dtype(name).itemsize) or "unchanged"
        if storage == "unchanged":
            explain(f"kept as {volume.dtype}")
            return volume
        error = bound(volume, storage)
        if error == math.inf:
            raise PortError(
                f"volume: {storage} cannot hold voxels that are not finite; store them as float16 or unchanged"
            )
        explain(f"stored as {storage}: off by at most {error:.3g} {volume.mapping.unit}".rstrip())
        return stored(volume, storage)
