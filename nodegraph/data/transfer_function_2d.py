"""From value and gradient magnitude to colour and extinction."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.numbers import fields, number, numbers
from nodegraph.data.transfer_function import MAX_OPACITY
from nodegraph.data.value import Parts, Value
from nodegraph.errors import ParameterError, near_miss_or_all

Floats = NDArray[np.float64]
Pair = tuple[float, float]

ENDS = 3.0
"""Standard deviations at which a Gaussian ends."""

NARROWEST = 1e-12
"""Width of what is spread over a table, as a share of the greatest value; what is narrower lies in its first cells."""
LEAST = 1e-30
"""The same, in values and magnitudes: one over it is a number in single precision."""

_FLOOR = math.exp(-0.5 * ENDS**2)


class Trapezoid(NamedTuple):
    """The values ``bottom`` at the magnitude ``gradients[0]``, ``top`` at ``gradients[1]``, and those between.

    From the edges inwards, over the share ``softness`` of half the width and half the height, extinction grows
    linearly; over both, by the product. 0 is a hard edge, 1 a tent. An edge at magnitude 0 is hard.
    """

    bottom: Pair
    top: Pair
    gradients: Pair
    softness: float
    color: tuple[float, float, float]
    opacity: float

    @property
    def shape(self) -> str:
        """Its name in JSON."""
        return "trapezoid"

    @classmethod
    def rectangle(
        cls, values: Pair, gradients: Pair, color: tuple[float, float, float], opacity: float, softness: float = 0.0
    ) -> Trapezoid:
        """The same values at all its magnitudes."""
        return cls(values, values, gradients, softness, color, opacity)

    @property
    def bounds(self) -> tuple[Pair, Pair]:
        """Least and greatest value, least and greatest magnitude."""
        return (min(self.bottom[0], self.top[0]), max(self.bottom[1], self.top[1])), self.gradients

    def weight(self, values: Floats, gradients: Floats) -> Floats:
        """The share of its extinction, 0..1."""
        least, greatest = self.gradients
        up = (gradients - least) / (greatest - least)
        low = self.bottom[0] + (self.top[0] - self.bottom[0]) * up
        high = self.bottom[1] + (self.top[1] - self.bottom[1]) * up
        below = gradients - least if least > 0.0 else np.where(gradients >= 0.0, np.inf, -1.0)
        across = _ramp(np.minimum(values - low, high - values), 0.5 * (high - low) * self.softness)
        along = _ramp(np.minimum(below, greatest - gradients), 0.5 * (greatest - least) * self.softness)
        return across * along

    def to_json(self) -> dict[str, Any]:
        return {
            "shape": self.shape, "bottom": list(self.bottom), "top": list(self.top), "gradients": list(self.gradients),
            "softness": self.softness, "color": list(self.color), "opacity": self.opacity,
        }  # fmt: skip


class Gaussian(NamedTuple):
    """Extinction falls from ``center``, a value and a magnitude, with the standard deviations ``sigma``.

    It is a Gaussian less what it has at three standard deviations, and nothing beyond.
    """

    center: Pair
    sigma: Pair
    color: tuple[float, float, float]
    opacity: float

    @property
    def shape(self) -> str:
        """Its name in JSON."""
        return "gaussian"

    @property
    def bounds(self) -> tuple[Pair, Pair]:
        """Least and greatest value, least and greatest magnitude; none is below 0."""
        (value, gradient), (wide, high) = self.center, self.sigma
        return (
            (value - ENDS * wide, value + ENDS * wide),
            (max(0.0, gradient - ENDS * high), gradient + ENDS * high),
        )

    def weight(self, values: Floats, gradients: Floats) -> Floats:
        """The share of its extinction, 0..1."""
        x, y = (values - self.center[0]) / self.sigma[0], (gradients - self.center[1]) / self.sigma[1]
        with np.errstate(over="ignore", under="ignore"):
            fallen = np.exp(-0.5 * (x * x + y * y))
        result: Floats = np.maximum(fallen - _FLOOR, 0.0) / (1.0 - _FLOOR)
        return result

    def to_json(self) -> dict[str, Any]:
        return {
            "shape": self.shape, "center": list(self.center), "sigma": list(self.sigma),
            "color": list(self.color), "opacity": self.opacity,
        }  # fmt: skip


Area = Trapezoid | Gaussian
_SHAPES: dict[str, type[Area]] = {"trapezoid": Trapezoid, "gaussian": Gaussian}


class TransferFunction2D(Value):
    """Areas over (value, gradient magnitude), each with a colour and an opacity; nothing is seen outside of them.

    Values are real values, magnitudes value units per mm. As in `TransferFunction` an opacity is what
    ``reference_length`` mm hide: notation for an extinction. Where areas overlap extinctions add, and the colour is
    the mean with the extinctions as weights, whatever the order of the areas.
    Source: Rezk-Salama 2001, T06; Schlosser 2009, A09; Orhun 2004, OR-26.
    """

    kind: ClassVar[str] = "TransferFunction2D"
    areas: tuple[Area, ...]
    reference_length: float

    def __init__(self, areas: Any = (), reference_length: float = 1.0, *, where: str = "transfer_function") -> None:
        if isinstance(areas, (str, bytes, dict)) or not isinstance(areas, Iterable):
            raise ParameterError(f"{where}.areas: expected a list of trapezoids and Gaussians, got {areas!r}")
        checked = tuple(_area(area, f"{where}.areas[{i}]") for i, area in enumerate(areas))
        length = number(reference_length, f"{where}.reference_length")
        if not length > 0.0:
            raise ParameterError(f"{where}.reference_length: expected a length above 0 mm, got {length:g}")
        self._set(areas=checked, reference_length=length)

    @property
    def domain(self) -> tuple[Pair, Pair]:
        """Least and greatest value, least and greatest magnitude of what may be seen; 0..1 without areas."""
        if not self.areas:
            return (0.0, 1.0), (0.0, 1.0)
        each = np.array([area.bounds for area in self.areas])
        low, high = each[..., 0].min(axis=0).tolist(), each[..., 1].max(axis=0).tolist()
        return (low[0], high[0]), (low[1], high[1])

    def extinction(self, opacity: float) -> float:
        """Extinction per mm of an opacity per reference length."""
        return -math.log1p(-min(opacity, MAX_OPACITY)) / self.reference_length

    def emission(self, values: Any, gradients: Any) -> Floats:
        """Colour times extinction, and extinction per mm, (..., 4), exactly; of values and magnitudes (...).

        What is not finite is nothing.
        """
        v, g = np.broadcast_arrays(np.asarray(values, np.float64), np.asarray(gradients, np.float64))
        finite = np.isfinite(v) & np.isfinite(g)
        v, g = np.where(finite, v, 0.0), np.where(finite, g, 0.0)
        out = np.zeros((*v.shape, 4))
        for area in self.areas:
            share = area.weight(v, g)[..., None] * self.extinction(area.opacity)
            out += share * np.array([*area.color, 1.0])
        out[~finite] = 0.0
        return out

    def evaluate(self, values: Any, gradients: Any) -> Floats:
        """Linear RGB and extinction per mm, (..., 4), exactly; black where nothing is seen."""
        out = self.emission(values, gradients)
        seen = out[..., 3:] > 0.0
        out[..., :3] = np.where(seen, out[..., :3] / np.where(seen, out[..., 3:], 1.0), 0.0)
        return out

    def table(self, columns: int = 256, rows: int = 256) -> Floats:
        """`emission` on a grid over the domain, (rows, columns, 4): rows up the magnitude, columns up the value.

        Read-only. An empty cell surrounds the domain, but below magnitude 0, where nothing is. Equal functions share
        one table. Raises ParameterError for fewer than 4 columns or rows.
        """
        return _table(self, columns, rows)

    def greatest(self, columns: int = 256, rows: int = 256) -> Floats:
        """The table over values alone, with the greatest extinction of all magnitudes: (columns, 4), no colours.

        For `nodegraph.data.bricks.visible_bricks`: where it has nothing, the table has nothing.
        """
        result = np.zeros((columns, 4))
        result[:, 3] = self.table(columns, rows)[..., 3].max(axis=0)
        return result

    def lookup(self, columns: int, rows: int, less: float = 0.0) -> tuple[float, float, float, float]:
        """(scale, offset) from a value, less a constant, to a column of the table, and from a magnitude to a row."""
        if not self.areas:
            return 0.0, 0.0, 0.0, 0.0
        (low, high), (least, greatest) = self.domain
        first = 1.0 if least > 0.0 else 0.0
        across = (columns - 3) / max(high - low, NARROWEST * max(abs(low), abs(high)), LEAST)
        along = (rows - 2 - first) / max(greatest - least, NARROWEST * greatest, LEAST)
        return across, (less - low) * across + 1.0, along, first - least * along

    def to_json(self) -> dict[str, Any]:
        return {"areas": [area.to_json() for area in self.areas], "reference_length": self.reference_length}

    @classmethod
    def from_json(cls, json: Any, where: str = "transfer_function") -> TransferFunction2D:
        return cls(**fields(json, ("areas", "reference_length"), where), where=where)

    def summary(self) -> str:
        (low, high), (least, greatest) = self.domain
        count = f"{len(self.areas)} area" + ("" if len(self.areas) == 1 else "s")
        return (
            f"{count} over {low:g}..{high:g} x {least:g}..{greatest:g} per mm, opacity per {self.reference_length:g} mm"
        )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TransferFunction2D) and self.to_json() == other.to_json()

    def __hash__(self) -> int:
        return hash((self.areas, self.reference_length))

    def to_parts(self) -> Parts:
        return self.to_json(), {}

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: Any) -> TransferFunction2D:
        return cls.from_json(meta)


@functools.lru_cache(maxsize=8)
def _table(function: TransferFunction2D, columns: int, rows: int) -> Floats:
    """See `TransferFunction2D.table`."""
    if min(columns, rows) < 4:
        raise ParameterError(f"table: expected at least 4 columns and rows, got {columns} x {rows}")
    result = np.zeros((rows, columns, 4))
    if function.areas:
        (low, high), (least, greatest) = function.domain
        first = 1 if least > 0.0 else 0
        values, gradients = np.linspace(low, high, columns - 2), np.linspace(least, greatest, rows - 1 - first)
        result[first:-1, 1:-1] = function.emission(values[None, :], gradients[:, None])
    result.flags.writeable = False
    return result


def _ramp(inside: Floats, width: Any) -> Floats:
    """0 outside, 1 from ``width`` on inside."""
    soft = np.clip(inside / np.where(width > 0.0, width, 1.0), 0.0, 1.0)
    result: Floats = np.where(width > 0.0, soft, inside >= 0.0)
    return result


def _area(area: Any, where: str) -> Area:
    """An area, checked: of one, or of its JSON. Raises ParameterError."""
    json = {"shape": area.shape, **area._asdict()} if isinstance(area, (Trapezoid, Gaussian)) else area
    if not isinstance(json, dict):
        raise ParameterError(f"{where}: expected an object that describes a trapezoid or a gaussian, got {json!r}")
    shape = json.get("shape")
    if shape not in _SHAPES:
        raise ParameterError(f"{where}.shape: got {shape!r}{near_miss_or_all(str(shape), _SHAPES)}")
    kind = _SHAPES[shape]
    fields(json, ("shape", *kind._fields), where)
    missing = next((name for name in kind._fields if name not in json and name != "softness"), None)
    if missing is not None:
        raise ParameterError(f"{where}.{missing}: a {shape} needs one")
    red, green, blue = numbers(json["color"], 3, f"{where}.color")
    if min(red, green, blue) < 0.0:
        raise ParameterError(f"{where}.color: expected linear RGB of at least 0, got {(red, green, blue)}")
    opacity = number(json["opacity"], f"{where}.opacity")
    if not 0.0 <= opacity <= 1.0:
        raise ParameterError(f"{where}.opacity: {opacity:g} is outside 0..1")
    if kind is Gaussian:
        center, sigma = (_pair(json[name], f"{where}.{name}") for name in ("center", "sigma"))
        if center[1] < 0.0:
            raise ParameterError(f"{where}.center: a gradient magnitude is at least 0, got {center[1]:g}")
        if not min(sigma) > 0.0:
            raise ParameterError(f"{where}.sigma: expected two widths above 0, got {sigma[0]:g} and {sigma[1]:g}")
        return Gaussian(center, sigma, (red, green, blue), opacity)
    bottom, top, gradients = (_pair(json[name], f"{where}.{name}") for name in ("bottom", "top", "gradients"))
    softness = number(json.get("softness", 0.0), f"{where}.softness")
    if not 0.0 <= softness <= 1.0:
        raise ParameterError(f"{where}.softness: {softness:g} is outside 0..1")
    for name, (low, high) in (("bottom", bottom), ("top", top)):
        if low > high:
            raise ParameterError(f"{where}.{name}: the least value comes first, {low:g} is above {high:g}")
    if not (bottom[0] < bottom[1] or top[0] < top[1]):
        raise ParameterError(f"{where}: bottom and top are single values; one of them needs a width")
    if not 0.0 <= gradients[0] < gradients[1]:
        raise ParameterError(
            f"{where}.gradients: expected two magnitudes of at least 0, the least first, "
            f"got {gradients[0]:g} and {gradients[1]:g}"
        )
    return Trapezoid(bottom, top, gradients, softness, (red, green, blue), opacity)


def _pair(value: Any, where: str) -> Pair:
    first, second = numbers(value, 2, where)
    return first, second
