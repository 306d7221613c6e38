"""Rays along what others only cross, eyes in unusual places, odd shapes of pictures, light without a normal."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from nodegraph.data import Camera, Light, TransferFunction, Volume
from nodegraph.data.space import centred
from tests.extremes.case import AHEAD, COLOR, PLAIN, case, matter, ones, render, slab, worst
from tests.extremes.space import PHONG, noise, noisy, pictured
from tests.support import raycast_twin as twin

RAYS = "Rays along axes, edges, corners and faces"
EYES = "Eyes and lenses"
PICTURES = "Shapes of pictures"
LIGHT = "Light"


def crossing_error(volume: Volume, camera: Camera, size: tuple[int, int], device: Any, **params: Any) -> float:
    """The closed form of the length that each ray has inside, for matter that is the same everywhere."""
    _, _, _, entry, exit = twin.bounds(volume, camera, size)
    length = np.maximum(exit - entry, 0.0)
    if length.max() == 0.0:
        raise AssertionError("no ray meets the volume")
    reach = float(np.median(length[length > 0.0]))
    tf = matter(0.5, reach)
    expected = slab(1.0) * -np.expm1(np.log(0.5) / reach * length)[..., None]
    image = render(device, size, volume=volume, camera=camera, transfer_function=tf, step=0.37, **params)
    return worst(image.color, expected)


# -- rays -------------------------------------------------------------------------------------------------------------

RAMP = TransferFunction([(0.0, (0.1, 0.2, 0.9), 0.02), (1.0, (0.9, 0.8, 0.6), 0.4)])


def lattice_error(axis: int, sign: float, device: Any) -> float:
    """Nine by nine rays at -2, -1.5 .. 2 mm through 4^3 voxels of noise: centres, cell faces, and the very border.

    A ray that runs inside the border is kept or refused whole: either is right, and nothing between.
    """
    volume = noisy((4, 4, 4))
    away = np.zeros(3)
    away[axis] = -sign * 20.0
    camera = Camera(eye=away, target=(0, 0, 0), up=(0, 1, 0) if axis == 2 else (0, 0, 1), projection="orthographic",
                    height=4.5)  # fmt: skip
    expected = pictured(volume, RAMP, camera, (9, 9), 0.25)
    found = render(device, (9, 9), volume=volume, camera=camera, transfer_function=RAMP, step=0.25).color
    if not np.isfinite(found).all():
        return float("inf")
    error = np.abs(found - expected).max(axis=-1)
    border = np.ones((9, 9), bool)
    border[1:-1, 1:-1] = False
    kept = pictured(volume, RAMP, camera.with_(height=4.5 * (1 - 1e-9)), (9, 9), 0.25)
    refused = np.abs(found).max(axis=-1)
    error[border] = np.minimum(np.abs(found - kept).max(axis=-1), refused)[border]
    return float(error.max())


for axis, name in enumerate("xyz"):
    for sign, told in ((1.0, ""), (-1.0, "-")):
        case(
            RAYS, f"along {told}{name}, through voxel centres, cell faces and grazing the border",
            "the picture of the ray-caster in numpy; a ray in the border is kept or refused whole",
            single=1e-5, double=1e-9,
        )(partial(lattice_error, axis, sign))  # fmt: skip


def diagonal_error(direction: tuple[float, float, float], orthographic: bool, device: Any, **params: Any) -> float:
    """The middle ray of a picture runs exactly through edges, or corners, of every cell of 6^3 that it meets."""
    along = np.array(direction)
    camera = Camera(eye=-20 * along, target=(0, 0, 0), up=(0.1, 0.2, 1), height=1.0, field_of_view=1.0,
                    projection="orthographic" if orthographic else "perspective")  # fmt: skip
    return crossing_error(ones((6, 6, 6)), camera, (1, 1), device, **params)


DIAGONALS = {"edges": (1.0, 1.0, 0.0), "corners": (1.0, 1.0, 1.0), "corners backwards": (-1.0, -1.0, -1.0),
             "one cell in three": (1.0, -3.0, 0.0), "a voxel in 1e5": (1e-5, 1.0, -1e-5)}  # fmt: skip
for told, direction in DIAGONALS.items():
    for orthographic in (True, False):
        lens = "orthographic" if orthographic else "perspective"
        case(
            RAYS, f"exactly through {told}, {lens}", "the closed form of its length", single=2e-5, double=1e-9,
            integrators=None,
        )(partial(diagonal_error, direction, orthographic))  # fmt: skip


def cell_diagonal_error(device: Any, **params: Any) -> float:
    """Noise along the diagonal of the cube: in each cell the value is a cubic, and its mean follows from two points."""
    n = 5
    data = noise((n, n, n))
    camera = Camera(eye=(-20, -20, -20), target=(0, 0, 0), projection="orthographic", height=1.0)
    tf = TransferFunction([(0.0, COLOR, 0.0), (1.0, COLOR, 0.3)])
    image = render(device, (1, 1), volume=Volume(data), camera=camera, transfer_function=tf, step=0.1, **params)
    from scipy import ndimage

    nodes = np.array([-1, 1]) / np.sqrt(3) / 2 + 0.5
    points = (np.arange(n - 1)[:, None] + nodes).ravel()
    mean = ndimage.map_coordinates(data.astype(np.float64), np.stack([points] * 3), order=1).reshape(-1, 2).mean(axis=1)
    length = np.sqrt(3.0)
    total = (mean.sum() + 0.5 * data[0, 0, 0] + 0.5 * data[-1, -1, -1]) * length
    return worst(image.color, slab(-np.expm1(np.log1p(-0.3) * total)))


case(
    RAYS, "noise along the diagonal of the cube", "the closed form, cubic by cubic", integrators=None,
    single={"cellwise": 5e-6, "": 1e-3}, double={"cellwise": 1e-7, "": 1e-3},
)(cell_diagonal_error)  # fmt: skip


def grazing_error(tilt: float, device: Any, **params: Any) -> float:
    """Rays that run a thousandth of a voxel inside a face, and leave through it when they are tilted."""
    camera = Camera(eye=(-20.0, 0.0, 1.999), target=(0.0, 0.0, 1.999 + 20 * tilt), up=(0, 1, 0),
                    projection="orthographic", height=1e-5)  # fmt: skip
    return crossing_error(ones((4, 4, 4)), camera, (2, 2), device, **params)


for tilt in (0.0, 1e-7, -1e-4):
    case(
        RAYS, f"a thousandth of a voxel inside a face, tilted by {tilt:g}", "the closed form of what is inside",
        single=1e-3, double=1e-9, integrators=None,
    )(partial(grazing_error, tilt))  # fmt: skip

# -- eyes -------------------------------------------------------------------------------------------------------------

CUBE = ones((4, 4, 4))
PLACES = {
    "in the middle, at a corner of cells": (0.0, 0.0, 0.0),
    "at a voxel centre": (0.5, 0.5, 0.5),
    "on the near face": (0.0, -2.0, 0.0),
    "on an edge": (-2.0, -2.0, 0.0),
    "on a corner": (-2.0, -2.0, -2.0),
    "a rounding before the near face": (0.0, float(np.nextafter(-2.0, -3.0)), 0.0),
}
for told, place in PLACES.items():
    for lens in ("perspective", "orthographic"):
        look = Camera(eye=place, target=np.add(place, (0.3, 1.0, 0.2)), projection=lens, field_of_view=50.0, height=0.5)
        case(
            EYES, f"{told}, {lens}", "rays begin at the eye: the closed form of what lies ahead", single=2e-5,
            double=1e-9, integrators=None if lens == "perspective" else PLAIN,
        )(partial(crossing_error, CUBE, look, (6, 5)))  # fmt: skip


@case(EYES, "on the far face, looking away", "nothing lies ahead", single=1e-6, double=1e-12, integrators=None)
def behind(device: Any, **params: Any) -> float:
    found = 0.0
    for y in (2.0, 2.5):
        camera = Camera(eye=(0.1, y, 0.2), target=(0.1, 9.0, 0.2))
        image = render(device, (4, 4), volume=CUBE, camera=camera, transfer_function=matter(0.5), **params)
        found = max(found, worst(image.color, 0.0))
    return found


def far_error(distance: float, lens: str, device: Any, **params: Any) -> float:
    direction = np.array([0.2, -1.0, 0.27]) / np.linalg.norm([0.2, -1.0, 0.27])
    angle = float(np.degrees(2 * np.arctan(1.0 / distance)))
    camera = Camera(eye=direction * distance, target=(0, 0, 0), projection=lens, height=2.0, field_of_view=angle)
    return crossing_error(CUBE, camera, (6, 5), device, **params)


for lens in ("perspective", "orthographic"):
    for distance in (1e6, 1e9):
        case(
            EYES, f"{distance:g} mm away, {lens}", "samples are counted from near the volume", single=1e-4, double=1e-6,
            integrators=PLAIN if distance > 1e8 else None,
        )(partial(far_error, distance, lens))  # fmt: skip


def wide_error(angle: float, device: Any, **params: Any) -> float:
    """From inside a sheet: most rays run to its far rim, those in the middle leave it soon."""
    volume = ones((4, 4, 4), centred((4, 4, 4), (30.0, 2.0, 30.0)))
    camera = Camera(eye=(1.0, -0.5, 2.0), target=(1.0, 5.0, 2.0), field_of_view=angle)
    return crossing_error(volume, camera, (7, 5), device, **params)


for angle in (179.0, 179.99, 179.999999):
    case(
        EYES, f"a field of view of {angle:.9g} degrees", "the closed form of what lies ahead", single=1e-4, double=1e-9,
        integrators=None if angle == 179.99 else PLAIN,
    )(partial(wide_error, angle))  # fmt: skip


def narrow_error(angle: float, device: Any, **params: Any) -> float:
    camera = Camera(eye=(3.0, -40.0, 5.0), target=(0.1, 0.2, 0.3), field_of_view=angle)
    return crossing_error(CUBE, camera, (5, 5), device, **params)


case(
    EYES, "a field of view of 1e-6 degrees", "the closed form of what lies ahead", single=2e-5, double=1e-9,
    integrators=PLAIN,
)(partial(narrow_error, 1e-6))  # fmt: skip

# -- pictures ---------------------------------------------------------------------------------------------------------


def shape_error(size: tuple[int, int], device: Any, **params: Any) -> float:
    wide = max(1.0, size[0] / size[1])
    camera = AHEAD.with_(height=3.0 / wide)
    image = render(device, size, volume=CUBE, camera=camera, transfer_function=matter(0.2), **params)
    if image.size != size:
        return float("inf")
    return worst(image.color, slab(1 - 0.8**4))


for size in ((1, 1), (16384, 1), (1, 16384)):
    case(
        PICTURES, f"{size[0]} x {size[1]} pixels", "every pixel has the closed form of its ray", single=5e-6,
        double=1e-9, integrators=PLAIN,
    )(partial(shape_error, size))  # fmt: skip

# -- light ------------------------------------------------------------------------------------------------------------

LAMPS = {
    "a lamp at infinity": Light("directional", "eye", (0.2, 0.3, 1.0)),
    "a lamp in the middle of the volume": Light("point", "world", (0.0, 0.0, 0.0)),
    "a lamp at the eye": Light("point", "eye", (0.0, 0.0, 0.0)),
}


def flat_error(lamp: Light, volume: Volume, device: Any, **params: Any) -> float:
    """Without a gradient there is no surface: ambient and diffuse light, wherever the lamp is."""
    image = render(device, (3, 3), volume=volume, camera=AHEAD, transfer_function=matter(0.2), lit=True, light=lamp,
                   step=0.25, **PHONG, **params)  # fmt: skip
    expected = slab(1 - 0.8 ** volume.dims[1])
    expected[:3] *= PHONG["ambient"] + PHONG["diffuse"]
    return worst(image.color, expected)


for told, lamp in LAMPS.items():
    case(
        LIGHT, f"no gradient anywhere, {told}", "ambient and diffuse light alone", single=1e-5, double=1e-9,
        integrators=None if lamp is LAMPS["a lamp at infinity"] else PLAIN,
    )(partial(flat_error, lamp, CUBE))  # fmt: skip
case(
    LIGHT, "a single voxel", "it has no gradient: ambient and diffuse light alone", single=1e-5, double=1e-9,
    integrators=PLAIN,
)(partial(flat_error, LAMPS["a lamp at infinity"], ones((1, 1, 1))))  # fmt: skip


@case(
    LIGHT, "the lamp at the very point that is lit", "a finite colour between ambient and all of the light", single=0,
    double=0,
)  # fmt: skip
def lamp_on_surface(device: Any) -> float:
    """The surface of value 0 is the plane y = 0, and the lamp lies in it, where the ray of the one pixel meets it."""
    data = np.broadcast_to(np.linspace(-3.5, 3.5, 8, dtype=np.float32)[None, :, None], (3, 8, 3)).copy()
    lamp = Light("point", "world", (0.0, 0.0, 0.0))
    color = render(device, (1, 1), volume=Volume(data), camera=AHEAD, mode="iso", iso_value=0.0, iso_color=(1, 1, 1),
                   lit=True, light=lamp, **PHONG).color[0, 0]  # fmt: skip
    low, high = PHONG["ambient"], PHONG["ambient"] + PHONG["diffuse"] + PHONG["specular"]
    return max(worst(np.clip(color[:3], low, high), color[:3]), worst(color[3], 1.0))


@case(
    LIGHT, "a shininess of 1e6, a lamp of 1e6", "the gloss of the ray-caster in numpy", single=2e-4, double=1e-6,
    unit="relative",
)  # fmt: skip
def glossy(device: Any) -> float:
    """Straight at a plane with the lamp behind the eye: the mirrored light meets the eye, and all is reflected."""
    data = np.broadcast_to(np.linspace(-3.5, 3.5, 8, dtype=np.float32)[None, :, None], (3, 8, 3)).copy()
    lamp = Light("directional", "eye", (0.0, 0.0, 1.0), intensity=1e6)
    color = render(device, (1, 1), volume=Volume(data), camera=AHEAD, mode="iso", iso_value=0.0, iso_color=(1, 1, 1),
                   lit=True, light=lamp, ambient=0.2, diffuse=0.7, specular=0.3, shininess=1e6).color[0, 0]  # fmt: skip
    return worst(color[:3] / (0.2 + 1e6), 1.0)


def stretched_light_error(spacing: tuple[float, float, float], device: Any, **params: Any) -> float:
    """Normals are those of the world, however long the voxels are."""
    n = 10
    at = (np.arange(n) - (n - 1) / 2) / n
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    volume = Volume(np.exp(-(x**2 + y**2 + z**2) / 0.1).astype(np.float32), centred((n, n, n), spacing))
    along = np.array([0.4, 1.0, 0.6]) * spacing
    length = n * float(np.linalg.norm(along))
    camera = Camera(
        eye=-along / np.linalg.norm(along) * length, target=(0, 0, 0), up=(1, 1, 0), projection="orthographic",
        height=4 * min(spacing),
    )  # fmt: skip
    tf = TransferFunction(RAMP.keys, length / 20)
    lamp = Light("directional", "world", (0.5, -0.7, 0.3))
    step = length / 100 / min(spacing)
    shade = twin.phong(volume, camera, lamp, **PHONG)
    expected = twin.composite(volume, tf, camera, (6, 5), step * min(spacing), shade)[0]
    assert expected[..., 3].max() > 0.1, "the scene shows nothing"
    image = render(device, (6, 5), volume=volume, camera=camera, transfer_function=tf, step=step, lit=True, light=lamp,
                   **PHONG, **params)  # fmt: skip
    return worst(image.color, expected)


for spacing in ((1.0, 0.03, 30.0), (1000.0, 1.0, 1.0)):
    told = " : ".join(f"{s:g}" for s in spacing)
    case(
        LIGHT, f"normals in voxels of {told}", "the picture of the ray-caster in numpy", single=2e-4, double=1e-6,
        integrators=PLAIN,
    )(partial(stretched_light_error, spacing))  # fmt: skip
