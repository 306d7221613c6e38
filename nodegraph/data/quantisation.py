"""Volumes in fewer bits: which types hold their values, how far off they are then, and which is narrow enough.

Values are laid over the range of a type, or over -1..1 where it is a real one, and a mapping takes them back.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from nodegraph.data.volume import Mapping, Volume

TYPES = ("uint8", "float16", "uint16", "float32")
"""From the one that loses most to the one that loses least."""

COUNTED = {"uint8": 2**8 - 1, "uint16": 2**16 - 1, "float32": 2**24}
"""How far apart whole numbers may lie that a type keeps as they are."""


def bound(volume: Volume, storage: str) -> float:
    """What a real value may lose in one of `TYPES`, in the volume's unit; inf where it cannot hold a voxel."""
    low, high = volume.range
    spread = high - low
    # Real values are known to a unit in the last place of double precision, and no better.
    known = float(np.spacing(max(abs(low), abs(high)))) if spread else 0.0
    if storage == "float16":
        # Values lie in -1..1, where half floats are at most 2^-11 apart.
        return spread / 2**13 + known
    if counts(volume, storage):
        return 0.0
    if storage == "float32":
        return spread / 2**26 + known
    return spread / COUNTED[storage] / 2.0 + known if is_finite(volume) else math.inf


def counts(volume: Volume, storage: str) -> bool:
    """Whether these are whole numbers that lie so near to each other that a type can count them."""
    low, high = volume.range
    whole = volume.dtype.kind in "iu" and storage in COUNTED
    return whole and round((high - low) / abs(volume.mapping.scale)) <= COUNTED[storage]


def is_finite(volume: Volume) -> bool:
    """Whether all voxels are finite numbers."""
    return volume.dtype.kind != "f" or all(bool(np.isfinite(part).all()) for _, part in volume.buffer.slabs())


def stored(volume: Volume, storage: str) -> Volume:
    """The volume in one of `TYPES`, with the mapping that takes it back. Slab by slab; chunks are not kept."""
    low, high = volume.range
    scale, offset, unit = volume.mapping
    counted = counts(volume, storage)
    if counted:
        size, start = abs(scale), low
    elif storage in ("float16", "float32"):
        size, start = (high - low) / 2.0, low + (high - low) / 2.0
    else:
        size, start = (high - low) / COUNTED[storage], low
    size = size or 1.0
    out = np.empty(volume.buffer.shape, storage)
    for first, part in volume.buffer.slabs():
        scaled = (part.astype(np.float64) * scale + offset - start) / size
        out[first : first + len(part)] = np.rint(scaled) if counted or out.dtype.kind == "u" else scaled
    return volume.with_data(out, Mapping(size, start, unit))


def narrowest(volume: Volume, max_error: float, nbytes: Callable[[str], int]) -> str | None:
    """The type that takes the fewest bytes among those in which no value is off by more than ``max_error``.

    ``nbytes`` says what the volume takes in a type, where it lies then. Of two that take as much it is the one that
    loses less. None where no type takes less than the volume's own.
    """
    spread = volume.range[1] - volume.range[0]
    limits = np.finfo(np.float32)
    if spread and not float(limits.tiny) <= spread / COUNTED["uint16"] <= spread <= float(limits.max):
        return None  # kernels read the mapping in single precision
    own = nbytes(str(volume.dtype))
    fitting = [
        (nbytes(name), error, -TYPES.index(name), name)
        for name in TYPES
        if nbytes(name) < own and (error := bound(volume, name)) <= max_error
    ]
    return min(fitting)[-1] if fitting else None
