"""Value and gradient magnitude decide what is seen: extremes of `render.raycast_2d`, against closed forms.

Most are a field that rises along x by the same from voxel to voxel, seen along y: its magnitude is one number, and an
area about that number makes a homogeneous slab of it. A field that rises along the ray passes an area within a length.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from nodegraph.data import Camera, Gaussian, Light, Mapping, TransferFunction2D, Trapezoid, Volume
from nodegraph.data.space import centred
from nodegraph.data.transfer_function import MAX_OPACITY
from tests.extremes.case import AHEAD, COLOR, case, slab, worst
from tests.support.calls import call

TOPIC = "Value and gradient magnitude"
N = 8
BY_AREAS = ("preintegrated", "adaptive", "cellwise")


def picture(device: Any, volume: Volume, function: TransferFunction2D, camera: Camera, **params: Any) -> np.ndarray:
    params = {"lit": False, "termination": 1.0, "step": 1.0} | params
    image = call(
        "render.raycast_2d", device, (3, 2), volume=volume, transfer_function=function, camera=camera, **params
    )
    return np.asarray(image.color)


def sideways(
    device: Any, *, unit: float = 1.0, rise: float = 1.0, start: float = 0.0, opacity: float = 0.2,
    away: float = 0.0, **params: Any,
) -> float:  # fmt: skip
    """8 voxels of ``unit`` mm each, whose values rise by ``rise`` from ``start``; ``away`` mm off the origin."""
    placed = np.array(centred((N, N, N), (unit, unit, unit)))
    placed[:3, 3] += away
    volume = Volume(np.broadcast_to(np.arange(N), (N, N, N)).astype("f4"), placed, Mapping(rise, start))
    magnitude = abs(rise) / unit
    ends = sorted((start - abs(rise), start + N * rise)) if rise > 0 else sorted((start + N * rise, start - rise))
    area = Trapezoid.rectangle((ends[0], ends[1]), (0.5 * magnitude, 1.5 * magnitude), COLOR, opacity, 0.1)
    camera = AHEAD.with_(eye=(away, away - 50.0 * unit, away), target=(away, away, away), height=unit)
    color = picture(device, volume, TransferFunction2D([area], unit), camera, **params)
    return worst(color, slab(1 - (1 - min(opacity, MAX_OPACITY)) ** N))


def put(extreme: str, single: float, double: float, **how: Any) -> None:
    happens = "the closed form of a slab of 8 voxels"
    case(TOPIC, extreme, happens, single=single, double=double, integrators=None)(partial(sideways, **how))


put("steps of 0.001 voxel", 1e-5, 1e-9, step=1e-3)
put("steps of 1e3 voxel", 1e-5, 1e-9, step=1e3)
put("opacity 1e-07 per voxel", 1e-12, 1e-15, opacity=1e-7)
put("opacity 1 per voxel", 1e-6, 1e-12, opacity=1.0)
put("8 nm wide, 1e+06 per mm", 1e-5, 1e-9, unit=1e-6)
put("8 m wide, 0.001 per mm", 1e-5, 1e-9, unit=1e3)
put("rises by 1e+20 from voxel to voxel", 1e-5, 1e-9, rise=1e20)
put("rises by 1e-20 from voxel to voxel", 1e-5, 1e-9, rise=1e-20)
put("falls, and values begin at 1e9", 1e-5, 1e-9, rise=-3.0, start=1e9)
put("1e+06 mm away", 1e-5, 1e-9, away=1e6)


@case(
    TOPIC, "a hard slab of 1/1000 voxel, steps of 1 voxel", "found where it is, by those that ask the areas",
    single=1e-3, double=2e-6, integrators=BY_AREAS,
)  # fmt: skip
def narrow_slab(device: Any, **params: Any) -> float:
    """The value rises by 1 along the ray, so an area 0.001 wide is met for 0.001 mm."""
    area = Trapezoid.rectangle((3.3, 3.301), (0.5, 1.5), COLOR, 0.5)
    params |= {"tolerance": 1e-6} if params["integrator"] == "adaptive" else {}
    return worst(picture(device, along_the_ray(), TransferFunction2D([area], 1e-3), AHEAD, **params), slab(0.5))


@case(
    TOPIC, "a Gaussian of 1/10000 voxel, steps of 1 voxel", "found where it is, by those that ask the areas",
    single=1e-2, double=2e-6, integrators=BY_AREAS,
)  # fmt: skip
def narrow_bell(device: Any, **params: Any) -> float:
    bell = Gaussian((3.3, 1.0), (1e-4, 0.5), COLOR, 0.5)
    params |= {"tolerance": 1e-6} if params["integrator"] == "adaptive" else {}
    floor, share = np.exp(-4.5), 0.9973002039367398  # at three standard deviations, and of the integral within them
    depth = np.log(2.0) * (np.sqrt(2 * np.pi) * share - 6 * floor) / (1 - floor)
    return worst(
        picture(device, along_the_ray(), TransferFunction2D([bell], 1e-4), AHEAD, **params), slab(1 - np.exp(-depth))
    )


@case(
    TOPIC, "no gradient, under light", "an area that reaches down to 0 is seen; ambient and diffuse light, no normal",
    single=1e-5, double=1e-9, integrators=("midpoint", *BY_AREAS),
)  # fmt: skip
def flat_and_lit(device: Any, **params: Any) -> float:
    volume = Volume(np.full((N, N, N), 0.5, np.float32))
    function = TransferFunction2D([Trapezoid.rectangle((0.0, 1.0), (0.0, 1.0), COLOR, 0.2, 0.3)])
    light = {"lit": True, "light": Light(), "ambient": 0.2, "diffuse": 0.5, "specular": 0.3}
    expected = slab(1 - 0.8**N) * [0.7, 0.7, 0.7, 1.0]
    return worst(picture(device, volume, function, AHEAD, **light, **params), expected)


@case(
    TOPIC, "one voxel, one slice, 2 x 2 x 2, a missing and an infinite voxel", "never a NaN, nothing beyond opaque",
    single=1e-6, double=1e-12, integrators=None,
)  # fmt: skip
def thin_and_holed(device: Any, **params: Any) -> float:
    """By how much the least opacity is below 0, or the greatest above 1."""
    function = TransferFunction2D([Trapezoid.rectangle((0.0, 2.0), (0.0, 5.0), COLOR, 0.6)])
    found = [0.0, 1.0]
    for shape in ((1, 1, 1), (1, 5, 5), (5, 1, 5), (2, 2, 2), (5, 5, 5)):
        data = np.ones(shape, np.float32)
        if data.size > 8:
            data[0, 0, 0], data[-1, -1, -1] = np.nan, np.inf
        found += list(picture(device, Volume(data), function, AHEAD.with_(height=4.0), **params)[..., 3].ravel())
    return max(-min(found), max(found) - 1.0) if np.isfinite(found).all() else float("inf")


def along_the_ray() -> Volume:
    return Volume(np.broadcast_to(np.arange(float(N))[None, :, None], (N, N, N)).copy())
