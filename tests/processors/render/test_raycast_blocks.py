"""A volume that does not fit, rendered block by block, against the same volume in one piece, on each device."""

import numpy as np
import pytest

from nodegraph.compute import blockwise
from nodegraph.data import Camera, TransferFunction, Volume
from tests.support.calls import call

SIZE = (22, 19)
TF = TransferFunction(
    [
        (0.0, (0.1, 0.2, 0.9), 0.0),
        (0.45, (0.9, 0.3, 0.1), 0.0),
        (0.7, (0.2, 0.9, 0.1), 0.2),
        (1.0, (0.9, 0.8, 0.6), 0.5),
    ]
)


def scene(seed):
    """A random volume with empty parts anywhere in the world, sheared at times, and a camera in or before it."""
    rng = np.random.default_rng(seed)
    dims = tuple(int(n) for n in rng.choice([1, 6, 9, 13, 17, 21], 3))
    data = rng.random(dims[::-1]).astype(np.float32)
    # Three of eight octants are empty.
    z, y, x = (n // 2 for n in data.shape)
    for octant in rng.permutation(8)[:3]:
        data[[slice(z), slice(z, None)][octant & 1], [slice(y), slice(y, None)][octant >> 1 & 1],
             [slice(x), slice(x, None)][octant >> 2]] *= 0.3  # fmt: skip
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.5, 2.0, 3)
    if seed % 3 == 0:
        matrix[:3, :3] = np.diag(rng.choice([-1.0, 1.0, 2.0], 3))
    if seed % 4 == 0:
        matrix[0, 1] += 0.5
    volume = Volume(data, matrix)
    size = float(np.linalg.norm(volume.corners[7] - volume.corners[0]))
    away = rng.normal(size=3)
    away *= rng.choice([0.05, 0.6, 3.0]) * size / np.linalg.norm(away)
    camera = Camera(
        volume.centre + away, volume.centre, np.cross(away, rng.normal(size=3)),
        "orthographic" if seed % 2 else "perspective", field_of_view=float(rng.choice([20.0, 60.0])), height=0.7 * size,
    )  # fmt: skip
    return volume, camera


@pytest.fixture
def blocks_of(monkeypatch):
    """Call with a size: from then on every volume is rendered in blocks of that many cells. None: in one piece."""

    def choose(cells):
        monkeypatch.setattr(blockwise, "is_needed", lambda volume, device: cells is not None)
        monkeypatch.setattr(blockwise, "block_size", lambda volume, reach, device: cells)

    return choose


def both(device, blocks_of, volume, camera, cells, **params):
    params = {"lit": False, "termination": 1.0, "volume": volume, "camera": camera, "transfer_function": TF} | params
    pictures = []
    for side in (None, cells):
        blocks_of(side)
        pictures.append(call("render.raycast", device, SIZE, **params))
    return pictures


def depth_difference(a, b):
    """Greatest difference where both see something; pixels where only one does count as inf."""
    seen = np.isfinite(a.depth)
    assert np.array_equal(seen, np.isfinite(b.depth))
    return float(np.abs(a.depth[seen] - b.depth[seen]).max(initial=0.0))


@pytest.mark.parametrize("seed", range(6))
def test_composite_in_blocks_is_the_picture_in_one_piece(device, blocks_of, seed):
    volume, camera = scene(seed)
    whole, blocks = both(device, blocks_of, volume, camera, (4, 8)[seed % 2], step=(0.3, 0.8)[seed % 2])
    assert whole.color.max() > 0.05
    assert np.abs(whole.color - blocks.color).max() < 2e-6
    assert depth_difference(whole, blocks) < 1e-3
