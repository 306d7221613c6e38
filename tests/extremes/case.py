"""An extreme as data: what it is, what happens, how far a device is off, and how far it may be.

The tests assert the bounds, and the page docs/extremes.md tells the errors, both from the same list. An error is a
number made from a closed form, or from a ray-caster in numpy and double precision, that shares no line with kernels.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from nodegraph import registry
from nodegraph.data import Camera, Image, TransferFunction, Volume
from nodegraph.errors import DeviceError
from tests.support.calls import call

PLAIN = ("midpoint",)  #: what there is where a ray-caster offers no choice
REFUSED = "ends loops after"  #: said by a driver's device that cannot count so far

Bound = float | Mapping[str, float]


@dataclass(frozen=True)
class Case:
    """One extreme. ``error(device, **params)`` measures it; ``params`` is empty or names the integrator.

    ``single`` and ``double`` bound the error in the two precisions, for all integrators or by name with "" for the
    others. ``unit`` says what the error is of. A ``counted`` case may be too long for a device whose driver ends loops.
    """

    topic: str
    extreme: str
    happens: str
    error: Callable[..., float]
    single: Bound
    double: Bound
    unit: str
    integrators: tuple[str, ...]
    counted: bool

    def __str__(self) -> str:
        return f"{self.topic}: {self.extreme}".replace(" ", "_")

    def runs(self) -> list[dict[str, str]]:
        """Parameters of each run: one without any, or one for each integrator."""
        return [{"integrator": name} for name in self.integrators] or [{}]

    def bound(self, device: Any, params: Mapping[str, str]) -> float:
        """The most that the error may be."""
        bound = self.single if device.real == np.float32 else self.double
        if isinstance(bound, Mapping):
            return bound.get(params.get("integrator", "midpoint"), bound.get("", 0.0))
        return bound

    def measure(self, device: Any, params: Mapping[str, str]) -> float | None:
        """The error; None where the device refuses in the sentence that it has for this. Other errors are raised."""
        try:
            return float(self.error(device, **params))
        except DeviceError as error:
            if self.counted and device.limits.get("turns") is not None and REFUSED in str(error):
                return None
            raise


CASES: list[Case] = []


def case(
    topic: str,
    extreme: str,
    happens: str,
    *,
    single: Bound,
    double: Bound,
    unit: str = "RGBA",
    integrators: tuple[str, ...] | None = (),
    counted: bool = False,
) -> Callable[[Callable[..., float]], Callable[..., float]]:
    """Put a function into the list. ``integrators`` None means all that the ray-caster offers; those that it has
    not are left out, and with them the case that is about no others.
    """

    def put(error: Callable[..., float]) -> Callable[..., float]:
        there = offered()
        swept = there if integrators is None else tuple(name for name in integrators if name in there)
        if swept or not integrators or integrators == PLAIN:
            CASES.append(Case(topic, extreme, happens, error, single, double, unit, swept, counted))
        return error

    return put


def offered() -> tuple[str, ...]:
    """The integrators of the ray-caster as it is; none where it has no such parameter."""
    parameter = registry.find("render.raycast").params.get("integrator")
    return () if parameter is None else tuple(parameter.choices)


# -- scenes -----------------------------------------------------------------------------------------------------------

#: Looks along +y from before the origin; every ray of a picture less than the volume high crosses all of it.
AHEAD = Camera(eye=(0.0, -50.0, 0.0), target=(0.0, 0.0, 0.0), projection="orthographic", height=1.0)
COLOR = (0.8, 0.4, 0.1)


def matter(opacity: float, reference_length: float = 1.0, low: float = 0.0, high: float = 1.0) -> TransferFunction:
    """The same colour and opacity for every value."""
    return TransferFunction([(low, COLOR, opacity), (high, COLOR, opacity)], reference_length)


def ones(dims: tuple[int, int, int], index_to_world: Any = None) -> Volume:
    """A volume whose every value is 1. ``dims`` is (x, y, z)."""
    return Volume(np.ones(dims[::-1], np.float32), index_to_world)


def render(device: Any, size: tuple[int, int], **values: Any) -> Image:
    """A picture without light and with nothing left out, unless told otherwise."""
    function = values.get("transfer_function")
    if "integrator" in values and function is not None and len({key[1:] for key in function.keys}) <= 1:
        # A table over pairs of values needs no rows where all are the same: most of these cases are done in no time.
        values.setdefault("pair_table_size", registry.find("render.raycast").params["pair_table_size"].min)
    image = call("render.raycast", device, size, **{"lit": False, "termination": 1.0, **values})
    assert isinstance(image, Image)
    return image


def slab(alpha: float) -> np.ndarray:
    """Premultiplied RGBA of a homogeneous slab that hides ``alpha`` (Rezk-Salama 2001, R01)."""
    return alpha * np.array([*COLOR, 1.0])


def worst(found: Any, expected: Any) -> float:
    """Greatest absolute difference; inf where anything that was found is not finite."""
    found = np.asarray(found, np.float64)
    return float(np.abs(found - expected).max()) if np.isfinite(found).all() else float("inf")


def relative(found: Any, expected: Any) -> float:
    """Greatest difference relative to what is expected, which is not 0 anywhere."""
    return worst(np.asarray(found, np.float64) / expected, 1.0)
