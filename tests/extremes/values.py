"""Voxels that are no numbers, and number types at their ends.

The policy: a voxel that is not finite makes the cells around it transparent, infinite ones as well as those that are
not a number. Every rule that leaves out what is empty may then go by the least and the greatest finite value.
"""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np

from nodegraph.data import Camera, Light, Mapping, TransferFunction, Volume
from nodegraph.shaders import Source
from tests.extremes.case import AHEAD, COLOR, PLAIN, case, matter, render, slab, worst
from tests.extremes.space import PHONG, SIZE, against_twin, noise
from tests.support import raycast_twin as twin

SPOILED = "Voxels that are not finite"
TYPES = "Number types"
NOT_FINITE = {"nan": np.nan, "inf": np.inf, "-inf": -np.inf}

CAMERA = Camera(eye=(6.0, -30.0, 9.0), target=(0, 0, 0), field_of_view=20.0)


def column(bad: float, at: int = 2) -> Volume:
    """Nine slices of 3 x 3 voxels along y, the seventh the greatest; the middle of the third is bad, or of another."""
    values = np.array([0.1, 0.1, 0.1, 0.1, 0.1, 0.2, 0.75, 0.2, 0.1], np.float32)
    data = np.broadcast_to(values[None, :, None], (3, 9, 3)).copy()
    data[1, at, 1] = bad
    return Volume(data)


def transparent_error(bad: float, at: int, device: Any, **params: Any) -> float:
    """Two of the nine millimetres are transparent; beside the border the last half millimetre may be, too."""
    image = render(
        device, (2, 2), volume=column(bad, at), camera=AHEAD.with_(eye=(0, -49.5, 0)), step=0.125,
        transfer_function=matter(0.2), **params,
    )  # fmt: skip
    lengths = (7.0, 6.5) if at in (1, 7) else (7.0,)
    return min(worst(image.color, slab(1 - 0.8**length)) for length in lengths)


# Two ends of transparent cells, at each of which half a segment may go to the wrong side.
ENDS = -np.log(0.8) * 2 * 0.125 * 0.8**7

for name, bad in NOT_FINITE.items():
    for at, told, happens in (
        (2, "", "the cells around it are transparent, and nothing else is"),
        (1, " beside the first voxel", "the cells around it are transparent, and what lies before them may be"),
        (7, " beside the last voxel", "the cells around it are transparent, and what lies behind them may be"),
    ):
        case(
            SPOILED, f"{name}{told}, composite", happens, integrators=None,
            single={"midpoint": 5e-6, "cellwise": 5e-6, "": ENDS},
            double={"midpoint": 1e-9, "cellwise": 1e-7, "": ENDS},
        )(partial(transparent_error, bad, at))  # fmt: skip


def twin_error(bad: float, device: Any, **params: Any) -> float:
    """Noise with five bad voxels, seen at a slant, beside numpy's picture of voxels that are no number."""
    data = noise((8, 7, 9)).copy()
    for z, y, x in ((4, 3, 3), (4, 3, 4), (2, 4, 5), (6, 2, 2), (3, 5, 6)):
        data[z, y, x] = bad
    expected = twin.composite(Volume(np.where(np.isfinite(data), data, np.nan)), RAMP, CAMERA, SIZE, 0.5)[0]
    image = render(device, SIZE, volume=Volume(data), camera=CAMERA, transfer_function=RAMP, step=0.5, **params)
    return worst(image.color, expected)


RAMP = TransferFunction([(0.0, (0.1, 0.2, 0.9), 0.02), (1.0, (0.9, 0.8, 0.6), 0.4)])
for name, bad in NOT_FINITE.items():
    case(
        SPOILED, f"{name} among noise", "the picture of the ray-caster in numpy without these cells", single=1e-5,
        double=1e-6, integrators=PLAIN,
    )(partial(twin_error, bad))  # fmt: skip


def maximum_error(bad: float, device: Any) -> float:
    """The greatest finite sample: 0.75, less what half a step beside its voxel may lose."""
    tf = TransferFunction([(0.0, (0, 0, 0), 0.0), (1.0, (1, 1, 1), 0.75)])
    step = 0.125
    image = render(device, (2, 2), volume=column(bad), camera=AHEAD, step=step, mode="maximum", transfer_function=tf)
    most, least = -np.expm1(-tf.evaluate([0.75, 0.75 - 0.55 * step / 2])[:, 3])
    return max(0.0, worst(image.color[..., 3], (most + least) / 2) - (most - least) / 2)


def surface_error(bad: float, mode: str, device: Any) -> float:
    """The value 1/2 is first reached between the sixth and the seventh slice."""
    tf = TransferFunction([(0.0, COLOR, 0.0), (1.0, COLOR, 0.75)])
    image = render(device, (2, 2), volume=column(bad), camera=AHEAD, step=0.25, mode=mode, transfer_function=tf,
                   iso_value=0.5, hit_extinction=float(tf.evaluate(0.5)[3]))  # fmt: skip
    return worst(image.depth, 50.0 - 4.0 + 5 + 0.3 / 0.55)


def lit_error(bad: float, device: Any, **params: Any) -> float:
    """Everywhere else the values are the same, so that there is no gradient: ambient and diffuse light alone."""
    data = np.ones((3, 9, 3), np.float32)
    data[1, 3, 1] = bad
    lamp = Light("directional", "eye", (0.2, 0.3, 1.0))
    image = render(device, (2, 2), volume=Volume(data), camera=AHEAD.with_(eye=(0, -49.5, 0)), step=0.25,
                   transfer_function=matter(0.2), lit=True, light=lamp, **PHONG, **params)  # fmt: skip
    expected = slab(1 - 0.8**7)
    expected[:3] *= PHONG["ambient"] + PHONG["diffuse"]
    return worst(image.color, expected)


def all_error(bad: float, device: Any) -> float:
    volume = Volume(np.full((4, 5, 6), bad, np.float32))
    shown = [render(device, (4, 4), volume=volume, camera=CAMERA, mode=mode, transfer_function=matter(0.5)).color
             for mode in ("composite", "maximum", "first_hit", "iso")]  # fmt: skip
    return max(worst(color, 0.0) for color in shown)


for name, bad in NOT_FINITE.items():
    case(SPOILED, f"{name}, maximum", "the greatest finite sample", single=1e-5, double=1e-6)(
        partial(maximum_error, bad)
    )
    for mode in ("first_hit", "iso"):
        case(
            SPOILED, f"{name} before the surface, {mode}", "the surface behind it is found", single=1e-3, double=1e-3,
            unit="mm",
        )(partial(surface_error, bad, mode))  # fmt: skip
    case(
        SPOILED, f"{name} under shading", "light that falls from all around where no gradient can be taken",
        single=1e-5, double=1e-9, integrators=PLAIN,
    )(partial(lit_error, bad))  # fmt: skip
    case(SPOILED, f"{name} in every voxel", "nothing is seen, in any mode", single=0, double=0)(partial(all_error, bad))


# -- types ------------------------------------------------------------------------------------------------------------

FULL = (
    *(np.iinfo(name) for name in ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8")), np.finfo("f2"),
)  # fmt: skip


@cache
def stretched(dtype: str, low: float, high: float) -> np.ndarray:
    """Noise from the least to the greatest number of a type, both of them in it."""
    share = noise((8, 7, 9)).astype(np.longdouble)
    share = (share - share.min()) / (share.max() - share.min())
    values = low + share * (np.longdouble(high) - low)
    return (np.rint(values) if np.dtype(dtype).kind in "iu" else values).astype(dtype)


def type_error(dtype: str, low: float, high: float, device: Any, **params: Any) -> float:
    volume = Volume(stretched(dtype, low, high))
    tf = keyed(float(low), float(high))
    image = render(device, SIZE, volume=volume, camera=CAMERA, transfer_function=tf, step=0.5, **params)
    return worst(image.color, of_differences(dtype, low, high))


@cache
def of_differences(dtype: str, low: float, high: float) -> np.ndarray:
    """Numpy gets the values less the least one, which is exact, and a transfer function of these differences."""
    volume = Volume((stretched(dtype, low, high).astype(np.longdouble) - low).astype(np.float64))
    spread = float(np.longdouble(high) - low)
    return np.asarray(twin.composite(volume, keyed(0.0, spread), CAMERA, SIZE, 0.5)[0])


def keyed(low: float, high: float) -> TransferFunction:
    """The ramp over other values."""
    (_, *first), (_, *second) = RAMP.keys
    return TransferFunction([(low, *first), (high, *second)])


for info in FULL:
    low, high = info.min, info.max
    case(
        TYPES, f"{info.dtype}, all of {float(low):g}..{float(high):g}", "the picture of the ray-caster in numpy",
        single=2e-5, double=1e-6, integrators=PLAIN,
    )(partial(type_error, str(info.dtype), low, high))  # fmt: skip
NEAR = (
    ("uint32 above 2^24", "u4", 2**31, 2**31 + 3000, 2e-5, 1e-9),
    ("int64 near 2^53", "i8", 2**53 - 4096, 2**53, 2e-4, 2e-4),  # a value between two voxels has half a unit at best
    ("float64 at 1e9, a range of 1", "f8", 1e9, 1e9 + 1, 2e-5, 1e-6),
    ("float64 at -1e9, a range of 0.001", "f8", -1e9, -1e9 + 1e-3, 2e-4, 2e-4),  # 1e-7 is half a unit at 1e9
    ("float32 up to 1e37", "f4", -1e37, 1e37, 2e-5, 1e-9),
    ("float32 below 1e-30", "f4", 0.0, 1e-30, 2e-5, 1e-9),
)
for told, dtype, low, high, single, double in NEAR:
    case(
        TYPES, told, "the picture of the ray-caster in numpy", single=single, double=double, integrators=PLAIN,
    )(partial(type_error, dtype, low, high))  # fmt: skip


@case(
    TYPES, "int16 with a scale of -1e-6 and an offset of 1e6", "real values are made in double precision",
    single=5e-5, double=1e-6, integrators=PLAIN,
)  # fmt: skip
def mapped(device: Any, **params: Any) -> float:
    volume = Volume(stretched("i2", -32768, 32767), mapping=Mapping(-1e-6, 1e6))
    return against_twin(volume, CAMERA, 0.5, device, transfer_function=keyed(*volume.range), **params)


IDS = Source.of("field3u labels; uint voxel(ivec3 at) { return fetch3u(labels, at); }", "ids.glsl")


@case(TYPES, "label ids above 2^24", "every bit of an id reaches a kernel", single=0, double=0, unit="ids")
def label_ids(device: Any) -> float:
    ids = np.array([[[0, 1, 2**24, 2**24 + 1, 2**31 - 1, 2**31, 2**32 - 2, 2**32 - 1]]], np.uint32)
    found = device.run(IDS, (8, 1, 1), labels=ids).array
    return float((np.asarray(found).reshape(ids.shape) != ids).sum())


@case(
    TYPES, "neighbouring ids above 2^24 as a volume", "nearest shows each by its own colour", single=1e-6, double=1e-9
)
def neighbouring_ids(device: Any) -> float:
    from nodegraph.data import Plane
    from tests.support.calls import call

    first = 2**31 + 1
    data = np.array([first, first + 1, first + 1, first], np.uint32)[None, None, :]
    tf = TransferFunction(
        [
            (first, (1, 0, 0), 0.5),
            (first + 0.5, (1, 0, 0), 0.5),
            (first + 0.5, (0, 0, 1), 0.5),
            (first + 1, (0, 0, 1), 0.5),
        ]
    )
    shown = call("render.slice", device, (4, 1), volume=Volume(data), plane=Plane((0, 0, 0), (0, 0, 1)), height=1.0,
                 interpolation="nearest", coloring="transfer_function", transfer_function=tf).color  # fmt: skip
    red, blue = [0.5, 0, 0, 0.5], [0, 0, 0.5, 0.5]
    return worst(shown, [[red, blue, blue, red]])
