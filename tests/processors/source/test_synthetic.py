"""Formulas against closed forms, and the laws that all of them keep."""

import numpy as np
import pytest

from nodegraph import registry
from nodegraph.data import Volume
from nodegraph.data.space import transform_points
from nodegraph.errors import ParameterError

SYNTHETIC = registry.find("source.synthetic")
KINDS = SYNTHETIC.params["kind"].choices


def make(kind, voxels=(20, 16, 12), **values):
    reported = []
    arguments = {**SYNTHETIC.defaults(), "kind": kind, "voxels": voxels, **values}
    volume = SYNTHETIC().process(**arguments, progress=lambda fraction, text="": reported.append(fraction))
    assert reported[-1] == 1.0
    assert reported == sorted(reported)
    return volume


def places(volume, extent=100.0):
    """p of every voxel, (z, y, x, 3), from the place of the voxels in the world."""
    z, y, x = np.meshgrid(*(np.arange(n) for n in volume.data.shape), indexing="ij")
    return transform_points(volume.index_to_world, np.stack([x, y, z], -1)) / (extent / 2)


EXACT = {
    "sphere": lambda p: np.maximum(1 - np.linalg.norm(p, axis=-1), 0),
    "gaussian_ball": lambda p: np.exp(-(p**2).sum(-1) / (2 * 0.35**2)),
    "cube": lambda p: 1 - np.abs(p).max(-1),
    "torus": lambda p: np.maximum(1 - np.hypot(np.hypot(p[..., 0], p[..., 1]) - 0.6, p[..., 2]) / 0.4, 0),
    "shells": lambda p: 0.5 + 0.5 * np.cos(12 * np.pi * np.linalg.norm(p, axis=-1)),
    "checker": lambda p: np.floor((p + 1) * 3).sum(-1) % 2,
    "linear": lambda p: 0.5 + 0.5 * p[..., 0],
    "constant": lambda p: np.full(p.shape[:-1], 0.5),
    "marschner_lobb": lambda p: (
        (
            1
            - np.sin(np.pi * p[..., 2] / 2)
            + 0.25 * (1 + np.cos(2 * np.pi * 6 * np.cos(np.pi * np.hypot(p[..., 0], p[..., 1]) / 2)))
        )
        / (2 * (1 + 0.25))
    ),
}


@pytest.mark.parametrize("kind", EXACT)
def test_formulas(kind):
    volume = make(kind)
    assert np.abs(volume.data - EXACT[kind](places(volume))).max() < 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_float32_in_0_to_1_whatever_the_shape(kind):
    for voxels in ((20, 16, 12), (1, 1, 1), (5, 1, 300)):
        volume = make(kind, voxels)
        assert isinstance(volume, Volume)
        assert volume.data.dtype == np.float32
        assert volume.dims == voxels
        assert 0.0 <= volume.data.min() <= volume.data.max() <= 1.0
        assert np.array_equal(volume.data, make(kind, voxels).data)


def test_the_physical_size_does_not_depend_on_the_resolution():
    for voxels in ((10, 20, 40), (7, 7, 7), (1, 1, 1)):
        volume = make("sphere", voxels, extent=(100.0, 50.0, 25.0))
        assert np.allclose(volume.corners.max(axis=0), (50.0, 25.0, 12.5))
        assert np.allclose(volume.corners.min(axis=0), (-50.0, -25.0, -12.5))


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"checker"}))
def test_another_resolution_samples_the_same_field(kind):
    """Voxel i of n and voxel 3 i + 1 of 3 n lie at the same place."""
    coarse, fine = make(kind, (8, 9, 10)), make(kind, (24, 27, 30))
    assert np.abs(fine.data[1::3, 1::3, 1::3] - coarse.data).max() < 1e-6


def test_slabs_leave_no_seam():
    volume = make("marschner_lobb", (300, 300, 7))
    assert np.abs(volume.data - EXACT["marschner_lobb"](places(volume))).max() < 1e-6


def test_linear_rises_along_its_direction():
    volume = make("linear", direction=(0.0, 3.0, 4.0))
    dz, dy, dx = (np.diff(volume.data.astype(np.float64), axis=axis).mean() for axis in range(3))
    assert dx == pytest.approx(0.0, abs=1e-7)
    assert (dy * 16) / (dz * 12) == pytest.approx(3 / 4, rel=1e-4)
    with pytest.raises(ParameterError, match="direction"):
        make("linear", direction=(0.0, 0.0, 0.0))


def test_noise_depends_on_its_seed_alone():
    a = make("noise", (32, 32, 32), frequency=8, seed=1).data
    b = make("noise", (32, 32, 32), frequency=8, seed=2).data
    assert not np.array_equal(a, b)
    assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 0.1
    assert a.mean() == pytest.approx(0.5, abs=0.05)


def test_lattice_values_are_uniform_and_never_change():
    """Integers only, so that a shader and every machine find the same; three values are written down."""
    import sys

    lattice_value = sys.modules[SYNTHETIC.__module__].lattice_value
    i, j, k = np.meshgrid(*(np.arange(24, dtype=np.uint32),) * 3, indexing="ij")
    values = lattice_value(i, j, k, 0)
    counts = np.histogram(values, 16, (0, 1))[0]
    expected = values.size / 16
    assert ((counts - expected) ** 2 / expected).sum() < 40, "chi squared of 15 degrees of freedom"
    for axis in range(3):
        ahead, behind = np.delete(values, 0, axis), np.delete(values, -1, axis)
        assert abs(np.corrcoef(ahead.ravel(), behind.ravel())[0, 1]) < 0.04

    def twin(i, j, k, seed):
        """The same in Python's integers."""
        mask = 0xFFFFFFFF
        x, y, z = ((v * 1664525 + 1013904223) & mask for v in (i, j, k))
        x = (x + seed * 2654435761) & mask
        x = (x + y * z) & mask
        y = (y + z * x) & mask
        z = (z + x * y) & mask
        x, y, z = x ^ x >> 16, y ^ y >> 16, z ^ z >> 16
        return ((x + y * z) & mask) / 4294967295

    for at in ((0, 0, 0, 0), (1, 2, 3, 4), (1024, 7, 99, 2**32 - 1)):
        assert lattice_value(*(np.uint32(v) for v in at)) == twin(*at)


def test_too_many_voxels():
    with pytest.raises(ParameterError, match="voxels"):
        make("constant", (65536, 65536, 65536))
