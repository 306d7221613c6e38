"""Grids and worlds of unusual shape, size and place. The picture belongs to the scene, not to its units."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np

from nodegraph.data import Camera, Light, TransferFunction, Volume
from nodegraph.data.space import affine, centred
from tests.extremes.case import AHEAD, PLAIN, case, matter, ones, relative, render, slab, worst
from tests.support import raycast_twin as twin

SHAPES = "Voxels and grids"
WORLDS = "Sizes and places in the world"
SIZE = (12, 10)

RAMP = TransferFunction([(0.0, (0.1, 0.2, 0.9), 0.02), (1.0, (0.9, 0.8, 0.6), 0.4)])
PHONG = {"ambient": 0.2, "diffuse": 0.7, "specular": 0.3, "shininess": 12.0}


@cache
def noise(dims: tuple[int, int, int]) -> np.ndarray:
    return np.random.default_rng(11).random(dims[::-1]).astype(np.float32)


@cache
def pictured(volume: Volume, tf: TransferFunction, camera: Camera, size: tuple[int, int], step: float) -> np.ndarray:
    """The colours of numpy, made once for all devices where the volume is the same object. ``step`` in mm."""
    return np.asarray(twin.composite(volume, tf, camera, size, step)[0])


@cache
def noisy(dims: tuple[int, int, int], spacing: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Volume:
    return Volume(noise(dims), centred(dims, spacing))


def against_twin(
    volume: Volume, camera: Camera, step: float, device: Any, size: tuple[int, int] = SIZE, **params: Any
) -> float:
    """Greatest difference from the ray-caster in numpy, with samples where the law puts them. ``step`` in voxels."""
    least = float(volume.spacing.min())
    tf = params.pop("transfer_function", RAMP)
    expected = pictured(volume, tf, camera, size, step * least)
    assert expected[..., 3].max() > 0.1, "the scene shows nothing"
    image = render(device, size, volume=volume, camera=camera, transfer_function=tf, step=step, **params)
    return worst(image.color, expected)


# -- shapes -----------------------------------------------------------------------------------------------------------


def spacing_error(spacing: tuple[float, float, float], step: float, device: Any, **params: Any) -> float:
    """Noise of 6 x 5 x 4 voxels, along a line that runs through cells of all three axes."""
    along = np.array([0.7, 1.0, 0.5]) * spacing
    length = 6 * float(np.linalg.norm(along))
    camera = Camera(
        eye=-along / np.linalg.norm(along) * length, target=(0, 0, 0), up=(1, 1, 0), projection="orthographic",
        height=3.0 * min(spacing),
    )  # fmt: skip
    tf = TransferFunction(RAMP.keys, length / 6)
    return against_twin(noisy((6, 5, 4), spacing), camera, step, device, transfer_function=tf, **params)


for spacing, step in (((1.0, 0.02, 20.0), 100.0), ((1.0, 1e-3, 1.0), 200.0), ((1e3, 1.0, 1.0), 50.0)):
    told = " : ".join(f"{s:g}" for s in spacing)
    case(
        SHAPES, f"spacing {told}", "the picture of the ray-caster in numpy, at a slant", single=1e-4, double=2e-5,
        integrators=PLAIN,
    )(partial(spacing_error, spacing, step))  # fmt: skip


def along_error(axis: int, device: Any, **params: Any) -> float:
    """Voxels 1000 times as long along one axis, seen along it: as much matter as there is length."""
    spacing = np.ones(3)
    spacing[axis] = 1e3
    away = np.zeros(3)
    away[axis] = -1e5
    up = (0, 1, 0) if axis == 2 else (0, 0, 1)
    camera = Camera(eye=away, target=(0, 0, 0), up=up, projection="orthographic", height=1.0)
    image = render(device, (3, 2), volume=ones((4, 4, 4), centred((4, 4, 4), spacing)), camera=camera, step=100.0,
                   transfer_function=matter(0.5, 2e3), **params)  # fmt: skip
    return worst(image.color, slab(0.75))


for axis, name in enumerate("xyz"):
    case(
        SHAPES, f"voxels 1000 times as long along {name}", "seen along it, the closed form of its length",
        single=1e-5, double=1e-9, integrators=None,
    )(partial(along_error, axis))  # fmt: skip


def few_voxels_error(dims: tuple[int, int, int], device: Any, **params: Any) -> float:
    camera = Camera(eye=(3.0, -10.0, 4.0), target=(0, 0, 0), field_of_view=14.0)
    tf = TransferFunction(RAMP.keys, 0.25)
    return against_twin(noisy(dims), camera, 0.1, device, transfer_function=tf, **params)


for dims in ((1, 1, 1), (1, 4, 4), (4, 1, 4), (4, 4, 1), (2, 2, 2)):
    case(
        SHAPES, f"{' x '.join(map(str, dims))} voxels", "each fills its spacing: the picture of the one in numpy",
        single=5e-5, double=2e-5, integrators=PLAIN,
    )(partial(few_voxels_error, dims))  # fmt: skip


def one_voxel_error(device: Any, **params: Any) -> float:
    volume = ones((1, 1, 1), centred((1, 1, 1), (4.0, 4.0, 4.0)))
    image = render(device, (3, 3), volume=volume, camera=AHEAD, transfer_function=matter(0.5, 2.0), step=0.1, **params)
    return worst(image.color, slab(0.75))


case(
    SHAPES, "one voxel, straight on", "as thick as its spacing", single=5e-6, double=1e-9, integrators=None,
)(one_voxel_error)  # fmt: skip


# -- worlds -----------------------------------------------------------------------------------------------------------


def scene(scale: float = 1.0, offset: Any = (0.0, 0.0, 0.0), lit: bool = False) -> dict[str, Any]:
    """A blob, its camera and its lamp, all lengths times ``scale`` and all places moved by ``offset`` mm."""
    n = 12
    at = (np.arange(n) - (n - 1) / 2) / n
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    data = np.exp(-((x - 0.1) ** 2 + y**2 + 1.5 * z**2) / 0.08).astype(np.float32)
    offset = np.asarray(offset, np.float64)
    grid = affine((1, 1, 1), offset) @ np.diag([scale, scale, scale, 1.0]) @ centred((n, n, n))
    values: dict[str, Any] = {
        "volume": Volume(data, grid),
        "camera": Camera(
            eye=np.array([9.0, -40.0, 12.0]) * scale + offset, target=offset, field_of_view=20.0, height=12.0 * scale
        ),
        "transfer_function": TransferFunction(RAMP.keys, scale),
    }
    if lit:
        lamp = Light("point", "world", np.array([20.0, -30.0, 25.0]) * scale + offset)
        values |= {"lit": True, "light": lamp, **PHONG}
    return values


@cache
def expected(lit: bool, step: float) -> tuple[np.ndarray, np.ndarray]:
    """The picture and its depth in numpy, at the origin of the world and in millimetres."""
    plain = scene(lit=lit)
    shade = twin.phong(plain["volume"], plain["camera"], plain["light"], **PHONG) if lit else None
    return twin.composite(plain["volume"], plain["transfer_function"], plain["camera"], SIZE, step, shade)


def world_error(scale: float, offset: float, lit: bool, device: Any, **params: Any) -> float:
    found = render(device, SIZE, step=0.5, **scene(scale, np.array([1.0, -2.0, 0.5]) * offset, lit), **params)
    return worst(found.color, expected(lit, 0.5)[0])


def depth_error(scale: float, offset: float, device: Any, **params: Any) -> float:
    """Relative to a voxel, where both see something."""
    found = render(device, SIZE, step=0.5, **scene(scale, np.array([1.0, -2.0, 0.5]) * offset), **params)
    depth = expected(False, 0.5)[1]
    assert np.array_equal(np.isfinite(found.depth), np.isfinite(depth))
    both = np.isfinite(depth)
    return worst(found.depth[both] / scale, depth[both])


PLACES = (
    ("a volume 1 m wide", 1000.0 / 12, 0.0, "the picture"),
    ("a volume 1 nm wide", 1e-6 / 12, 0.0, "the picture"),
    ("1e6 mm from the origin", 1.0, 1e6, "rays start near the volume, in double precision: the picture"),
    ("1e12 mm from the origin", 1.0, 1e12, "but for what double precision loses of such a place, the picture"),
)
for told, scale, offset, happens in PLACES:
    far = offset > 1e9
    for lit in (False, True):
        case(
            WORLDS, f"{told}{', lit by a near lamp' if lit else ''}", f"{happens} of the ray-caster in numpy",
            single=2e-3 if far else 1e-3 if lit else 1e-4, double=2e-3 if far else 5e-5, integrators=PLAIN,
        )(partial(world_error, scale, offset, lit))  # fmt: skip
    case(
        WORLDS, f"{told}, depth", "the depth of the ray-caster in numpy", single=2e-3, double=2e-3, unit="voxel",
        integrators=PLAIN,
    )(partial(depth_error, scale, offset))  # fmt: skip


def slab_of_size(scale: float, device: Any, **params: Any) -> float:
    """A slab of 10 voxels of any size, by every integrator."""
    grid = centred((4, 10, 4), [scale] * 3)
    camera = AHEAD.with_(eye=(0, -50 * scale, 0), height=scale)
    image = render(device, (2, 2), volume=ones((4, 10, 4), grid), camera=camera, step=0.37,
                   transfer_function=matter(0.1, scale), **params)  # fmt: skip
    return relative(image.color, slab(1 - 0.9**10))


for told, width in (("1e-6 mm", 1e-6), ("1e-12 mm", 1e-12), ("1e9 mm", 1e9)):
    case(
        WORLDS, f"voxels of {told}", "the closed form of a slab of 10 of them", single=1e-5, double=1e-9,
        unit="relative", integrators=None,
    )(partial(slab_of_size, width))  # fmt: skip
