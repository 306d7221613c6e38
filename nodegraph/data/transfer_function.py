"""From values to colour and extinction."""

from __future__ import annotations

import functools
import math
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.numbers import fields, number, numbers
from nodegraph.data.value import Parts, Value
from nodegraph.errors import ParameterError

MAX_OPACITY = 1.0 - 2.0**-24
"""What an opacity of 1 stands for: the most that single precision tells from 1. Its optical depth is 16.6."""


class Key(NamedTuple):
    """A corner of the piecewise-linear function: ``value`` in the volume's unit, linear RGB, opacity 0..1."""

    value: float
    color: tuple[float, float, float]
    opacity: float


class TransferFunction(Value):
    """Keys between which colour and extinction are linear in the value; beyond the ends they stay constant.

    An opacity is what ``reference_length`` mm of the material hide. It is notation: what is interpolated, shown
    and marched is the extinction per mm, ``-log(1 - opacity) / reference_length``, so re-expressing the keys for
    another reference length changes no picture. Two keys at one value make a step (left, then right). Without
    keys everything is transparent. Source: Rezk-Salama 2001, R01; Lindemann 2014, L01.
    """

    kind: ClassVar[str] = "TransferFunction"
    keys: tuple[Key, ...]
    reference_length: float

    def __init__(self, keys: Any = (), reference_length: float = 1.0, *, where: str = "transfer_function") -> None:
        if isinstance(keys, (str, bytes, dict)) or not hasattr(keys, "__iter__"):
            raise ParameterError(f"{where}.keys: expected a list of [value, [r, g, b], opacity], got {keys!r}")
        checked = tuple(_key(key, f"{where}.keys[{i}]") for i, key in enumerate(keys))
        length = number(reference_length, f"{where}.reference_length")
        if not length > 0.0:
            raise ParameterError(f"{where}.reference_length: expected a length above 0 mm, got {length:g}")
        for i in range(1, len(checked)):
            if checked[i].value < checked[i - 1].value:
                raise ParameterError(
                    f"{where}.keys[{i}]: values must ascend, {checked[i].value:g} comes after {checked[i - 1].value:g}"
                )
            if i > 1 and checked[i].value == checked[i - 2].value:
                raise ParameterError(
                    f"{where}.keys[{i}]: at most two keys may share a value (left and right of a step)"
                )
        self._set(keys=checked, reference_length=length)

    @property
    def domain(self) -> tuple[float, float]:
        """Values of the first and the last key; (0, 1) without keys."""
        return (self.keys[0].value, self.keys[-1].value) if self.keys else (0.0, 1.0)

    @property
    def is_step(self) -> bool:
        """True when some two keys share a value."""
        return any(a.value == b.value for a, b in zip(self.keys, self.keys[1:], strict=False))

    def extinction(self, opacity: Any) -> NDArray[np.float64]:
        """Extinction per mm of an opacity per reference length."""
        return -np.log1p(-np.minimum(np.asarray(opacity, np.float64), MAX_OPACITY)) / self.reference_length

    def evaluate(self, values: Any) -> NDArray[np.float64]:
        """Linear RGB and extinction per mm, (..., 4), exactly. NaN is transparent black; at a step its right side."""
        v = np.asarray(values, np.float64)
        out = np.zeros((*v.shape, 4))
        if not self.keys:
            return out
        at = np.array([key.value for key in self.keys])
        rows = np.array([[*key.color, float(self.extinction(key.opacity))] for key in self.keys])
        right = np.searchsorted(at, v, side="right")
        left = np.clip(right - 1, 0, len(at) - 1)
        right = np.minimum(right, len(at) - 1)
        width = at[right] - at[left]
        with np.errstate(invalid="ignore"):
            weight = np.where(width > 0.0, (v - at[left]) / np.where(width > 0.0, width, 1.0), 0.0)
        weight = np.clip(weight, 0.0, 1.0)[..., None]
        out[...] = rows[left] * (1.0 - weight) + rows[right] * weight
        out[np.isnan(v)] = 0.0
        return out

    def table(self, size: int = 1024) -> NDArray[np.float64]:
        """Samples of `evaluate` at ``size`` equal steps over the domain, (size, 4), ends included; read-only.

        Linear interpolation of this table differs from the function only in the cells that hold a key. Equal functions
        share one table, so that a picture that changes by its light or camera alone classifies nothing anew.
        """
        return _table(self, size)

    def lookup(self, size: int, less: float = 0.0) -> tuple[float, float]:
        """(scale, offset) that takes a value, less a constant, to the index space of a table of ``size`` rows."""
        low, high = self._span(size)
        if not high > low:
            return 0.0, 0.0
        scale = (size - 1) / (high - low)
        return scale, (less - low) * scale

    def _span(self, size: int) -> tuple[float, float]:
        """What a table covers: the domain; around a lone step, cells as narrow as single precision can tell apart."""
        low, high = self.domain
        if len(self.keys) == 2 and low == high:
            reach = size * 0.5e-6 * max(1.0, abs(low))
            return low - reach, low + reach
        return low, high

    def to_json(self) -> dict[str, Any]:
        keys = [[key.value, list(key.color), key.opacity] for key in self.keys]
        return {"keys": keys, "reference_length": self.reference_length}

    @classmethod
    def from_json(cls, json: Any, where: str = "transfer_function") -> TransferFunction:
        return cls(**fields(json, ("keys", "reference_length"), where), where=where)

    def summary(self) -> str:
        low, high = self.domain
        return f"{len(self.keys)} keys over {low:g}..{high:g}, opacity per {self.reference_length:g} mm"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, TransferFunction):
            return False
        return (self.keys, self.reference_length) == (other.keys, other.reference_length)

    def __hash__(self) -> int:
        return hash((self.keys, self.reference_length))

    def to_parts(self) -> Parts:
        return self.to_json(), {}

    @classmethod
    def from_parts(cls, meta: dict[str, Any], arrays: Any) -> TransferFunction:
        return cls.from_json(meta)


@functools.lru_cache(maxsize=32)
def _table(function: TransferFunction, size: int) -> NDArray[np.float64]:
    """See `TransferFunction.table`."""
    low, high = function._span(size)
    if not function.keys:
        result = np.zeros((max(size, 2), 4))
    elif size < 2 or not high > low:
        result = np.repeat(function.evaluate([high]), max(size, 2), axis=0)
    else:
        result = function.evaluate(low + (high - low) * (np.arange(size) / (size - 1)))
        result[0] = [*function.keys[0].color, float(function.extinction(function.keys[0].opacity))]
    result.flags.writeable = False
    return result


def _key(key: Any, where: str) -> Key:
    if isinstance(key, (str, bytes, dict)) or not hasattr(key, "__len__") or len(key) != 3:
        raise ParameterError(f"{where}: expected [value, [r, g, b], opacity], got {key!r}")
    value = number(key[0], f"{where}.value")
    red, green, blue = numbers(key[1], 3, f"{where}.color")
    opacity = number(key[2], f"{where}.opacity")
    if min(red, green, blue) < 0.0:
        raise ParameterError(f"{where}.color: expected linear RGB of at least 0, got {(red, green, blue)}")
    if not 0.0 <= opacity <= 1.0 or math.isnan(opacity):
        raise ParameterError(f"{where}.opacity: {opacity:g} is outside 0..1")
    return Key(value, (red, green, blue), opacity)
