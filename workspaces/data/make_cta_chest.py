"""How cta_chest.nii.gz was made from the original of 10.5 MB.

Needs SciPy; run: python workspaces/data/make_cta_chest.py ORIGINAL

The grid, its place and its type are those of the original. Numbers change like this:

- at -500 HU and above (everything but air and the inside of the lungs): rounded to even numbers, so by at most 1 HU,
  where the noise of the scan is about 20 HU;
- below -500 HU but beside a voxel of -500 HU or more (26 neighbours): rounded to multiples of 16 HU, so that every cell
  that a surface passes through keeps its corners;
- the rest, air and the inside of the lungs: -1000 HU.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy import ndimage

from nodegraph import formats
from nodegraph.data import Volume


def reduce(original: np.ndarray) -> np.ndarray:
    """Stored numbers that compress better, see above."""
    dense = original >= -500
    beside = ndimage.binary_dilation(dense, np.ones((3, 3, 3), bool))
    fine = np.round(original / 2.0) * 2.0
    coarse = np.round(original / 16.0) * 16.0
    return np.where(dense, fine, np.where(beside, coarse, -1000)).astype(np.int16)


if __name__ == "__main__":
    volume = formats.read(sys.argv[1])
    assert isinstance(volume, Volume)
    formats.write(volume.with_data(reduce(volume.data)), Path(__file__).parent / "cta_chest.nii.gz")
