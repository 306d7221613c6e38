"""Transfer functions with corners and without, along a ray on which the value rises by 1 in each mm.

Where a key lies between two samples, what a rule of integration does not see is at most the extinction times the step,
seen through what lies in front of it and behind it: that is the bound of the rules that know nothing of keys.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from nodegraph.data import TransferFunction, Volume
from tests.extremes.case import AHEAD, COLOR, PLAIN, case, matter, ones, render, slab, worst

TOPIC = "Transfer functions"
N = 16
ROW = (N - 1) / 2047  #: values from one row of a table to the next, where keys lie at both ends of the values

KEYED = ("cellwise",)


def rising() -> Volume:
    """Values 0..15 along y; before the first and behind the last voxel centre half a millimetre of the same."""
    return Volume(np.broadcast_to(np.arange(N, dtype=np.float32)[None, :, None], (3, N, 3)).copy())


def along(device: Any, tf: TransferFunction, step: float, **params: Any) -> np.ndarray:
    return np.asarray(render(device, (2, 2), volume=rising(), camera=AHEAD, transfer_function=tf, step=step,
                             **params).color)  # fmt: skip


def keys(*points: tuple[float, float], length: float = 1.0) -> TransferFunction:
    """Keys (value, opacity) of one colour."""
    return TransferFunction([(value, COLOR, opacity) for value, opacity in points], length)


def hidden(tau: float) -> np.ndarray:
    return slab(-np.expm1(-tau))


# A step at 7.3 from nothing to 0.2 per mm: behind it lie 7.7 mm and the last half voxel.
RISE = -np.log(1 - 0.2)
BEHIND = 8.2
STEP = 0.5
MISSED = RISE * (STEP / 2 + ROW) * float(np.exp(-RISE * BEHIND))


def step_inside(device: Any, **params: Any) -> float:
    tf = keys((0, 0), (7.3, 0), (7.3, 0.2), (15, 0.2))
    return worst(along(device, tf, STEP, **params), hidden(RISE * BEHIND))


case(TOPIC, "a step, cut at keys", "found exactly", single=2e-6, double=1e-7, integrators=KEYED)(step_inside)
case(
    TOPIC, "a step, by samples and tables", "off by at most half a step of it", single=MISSED, double=MISSED,
    integrators=("midpoint", "trapezoid", "preintegrated", "gauss2", "gauss3", "adaptive"),
)(step_inside)  # fmt: skip


@case(
    TOPIC, "two keys at one value and no other", "a step from the one to the other", integrators=None,
    single={"cellwise": 2e-6, "": MISSED}, double={"cellwise": 1e-7, "": MISSED},
)  # fmt: skip
def lone_step(device: Any, **params: Any) -> float:
    return worst(along(device, keys((7.3, 0), (7.3, 0.2)), STEP, **params), hidden(RISE * BEHIND))


@case(
    TOPIC, "two keys one rounding apart", "a step as well", integrators=PLAIN, single=MISSED, double=MISSED,
)  # fmt: skip
def nearly_a_step(device: Any, **params: Any) -> float:
    tf = keys((7.3, 0), (float(np.nextafter(7.3, 8)), 0.2))
    return worst(along(device, tf, STEP, **params), hidden(RISE * BEHIND))


# A spike of 0.1 mm at 7.32, whose optical depth is 0.7, among steps of 1 mm.
SPIKE = keys((0, 0), (7.27, 0), (7.32, 1 - np.exp(-0.7)), (7.37, 0), (15, 0), length=0.05)


@case(
    TOPIC, "a spike narrower than the step", "found where rays are cut at keys", single=5e-6, double=1e-7,
    integrators=KEYED,
)  # fmt: skip
def spike_by_keys(device: Any, **params: Any) -> float:
    return worst(along(device, SPIKE, 1.0, **params), hidden(0.7))


@case(
    TOPIC, "a spike narrower than the step, pre-integrated", "found in the table over both ends of a step",
    single=0.02, double=0.02, integrators=("preintegrated",),
)  # fmt: skip
def spike_by_table(device: Any, **params: Any) -> float:
    return worst(along(device, SPIKE, 1.0, **params), hidden(0.7))


@case(
    TOPIC, "a spike narrower than the step, by samples", "missed, or taken for as wide as a step: never worse",
    single=0.51, double=0.51, integrators=("midpoint", "trapezoid", "gauss2", "gauss3", "adaptive"),
)  # fmt: skip
def spike_by_samples(device: Any, **params: Any) -> float:
    return worst(along(device, SPIKE, 1.0, **params), hidden(0.7))


@case(
    TOPIC, "a spike narrower than the step, by samples nearer to each other than it is wide", "found",
    single=0.005, double=0.005, integrators=PLAIN,
)  # fmt: skip
def spike_by_many_samples(device: Any, **params: Any) -> float:
    return worst(along(device, SPIKE, 0.01, **params), hidden(0.7))


@case(
    TOPIC, "a box narrower than a row of a table", "found where no table is read", single=3e-4, double=1e-7,
    integrators=KEYED,
)  # fmt: skip
def narrow_box(device: Any, **params: Any) -> float:
    width = 0.0005
    tf = keys((0, 0), (7.32, 0), (7.32, 0.5), (7.32 + width, 0.5), (7.32 + width, 0), (15, 0), length=width)
    return worst(along(device, tf, 1.0, **params), hidden(np.log(2.0)))


@case(
    TOPIC, "301 keys, a saw", "the mean of its teeth where rays are cut at keys", single=2e-5, double=1e-6,
    integrators=KEYED,
)  # fmt: skip
def saw(device: Any, **params: Any) -> float:
    tf = keys(*((15 * i / 300, 0.2 if i % 2 else 0.0) for i in range(301)))
    return worst(along(device, tf, 1.0, **params), hidden(RISE / 2 * 15))


@case(
    TOPIC, "301 keys, a saw across 300 cells", "the same: no driver may end the loops over cells and keys unheard",
    single=2e-5, double=1e-6, integrators=KEYED, counted=True,
)  # fmt: skip
def long_saw(device: Any, **params: Any) -> float:
    """A value that rises by a twentieth in each of 300 cells, so that every cell meets one key."""
    data = np.broadcast_to((np.arange(301, dtype=np.float32) / 20)[None, :, None], (2, 301, 2)).copy()
    tf = keys(*((15 * i / 300, 0.02 if i % 2 else 0.0) for i in range(301)))
    image = render(device, (2, 2), volume=Volume(data), camera=AHEAD.with_(eye=(0, -300, 0)), transfer_function=tf,
                   step=1.0, **params)  # fmt: skip
    return worst(image.color, hidden(-np.log(1 - 0.02) / 2 * 300))


@case(TOPIC, "a saw of 301 keys, by fine samples", "the mean of its teeth", single=2e-3, double=2e-3, integrators=PLAIN)
def saw_by_samples(device: Any, **params: Any) -> float:
    tf = keys(*((15 * i / 300, 0.2 if i % 2 else 0.0) for i in range(301)))
    return worst(along(device, tf, 0.01, **params), hidden(RISE / 2 * 15))


@case(TOPIC, "no keys", "nothing is seen, in any mode", single=0, double=0, integrators=None)
def empty(device: Any, **params: Any) -> float:
    modes = (
        ("composite", "maximum", "first_hit") if params.get("integrator", "midpoint") == "midpoint" else ("composite",)
    )
    shown = [along(device, TransferFunction(), 1.0, mode=mode, **params) for mode in modes]
    return max(worst(color, 0.0) for color in shown)


def single_key(value: float, device: Any, **params: Any) -> float:
    """What a key says holds for every value, before it and behind it."""
    return worst(along(device, keys((value, 0.1)), 0.5, **params), hidden(-np.log(0.9) * N))


for value in (7.3, -1e30, 1e30):
    case(
        TOPIC, f"one key, at {value:g}", "its colour and opacity for every value", single=5e-6, double=1e-9,
        integrators=None,
    )(partial(single_key, value))  # fmt: skip


@case(
    TOPIC, "keys at -1e30 and 1e30", "every usual value lies halfway", single=5e-6, double=1e-9, integrators=None,
)  # fmt: skip
def far_keys(device: Any, **params: Any) -> float:
    tf = keys((-1e30, 0.0), (1e30, 0.2))
    return worst(along(device, tf, 0.5, **params), hidden(RISE / 2 * N))


def reexpressed(length: float, device: Any, **params: Any) -> float:
    """0.02 per mm, in the words of another length."""
    tf = matter(-np.expm1(-0.02 * length), length)
    image = render(device, (2, 2), volume=ones((3, 10, 3)), camera=AHEAD, transfer_function=tf, **params)
    return worst(image.color, hidden(0.2))


for length in (1e-9, 500.0):
    case(
        TOPIC, f"opacities per {length:g} mm", "the same matter in other words is the same picture",
        single=5e-6, double=1e-6, integrators=None,
    )(partial(reexpressed, length))  # fmt: skip
