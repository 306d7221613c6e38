"""The two axes of the plot: values from left to right, opacity upwards."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

LEAST = 1e-4
"""The smallest opacity that the logarithmic scale tells from the rest; below it, the scale is linear down to 0."""
FOOT = 0.1
"""The part of the logarithmic scale that the values from 0 to `LEAST` take."""
POWER = 0.25
SCALES = ("linear", "power", "logarithmic")
_TICKS = {
    "linear": (0.0, 0.25, 0.5, 0.75, 1.0),
    "power": (0.0, 1e-4, 1e-3, 0.01, 0.1, 0.5, 1.0),
    "logarithmic": (0.0, 1e-4, 1e-3, 0.01, 0.1, 1.0),
}


def height(opacity: Any, scale: str) -> Any:
    """Where an opacity lies on the axis, 0 at the bottom and 1 at the top."""
    o = np.clip(np.asarray(opacity, np.float64), 0.0, 1.0)
    if scale == "linear":
        return o
    if scale == "power":
        return o**POWER
    decades = -math.log10(LEAST)
    upper = FOOT + (1.0 - FOOT) * (1.0 + np.log10(np.maximum(o, LEAST)) / decades)
    return np.where(o < LEAST, o / LEAST * FOOT, upper)


def opacity(height: float, scale: str) -> float:
    """The opacity at a height of the axis; the inverse of `height`."""
    h = min(1.0, max(0.0, height))
    if scale == "linear":
        return h
    if scale == "power":
        return float(h ** (1.0 / POWER))
    if h < FOOT:
        return h / FOOT * LEAST
    return float(LEAST ** (1.0 - (h - FOOT) / (1.0 - FOOT)))


def opacity_ticks(scale: str) -> tuple[float, ...]:
    """Opacities that are marked on the axis."""
    return _TICKS[scale]


class ValueAxis:
    """The values that the plot shows, ``low`` at its left edge and ``high`` at its right."""

    def __init__(self, low: float = 0.0, high: float = 1.0) -> None:
        self.low, self.high = low, high

    @property
    def span(self) -> float:
        return self.high - self.low

    def show(self, low: float, high: float, margin: float = 0.0) -> None:
        """Show a range, with a margin as a part of it on either side."""
        if not (math.isfinite(low) and math.isfinite(high)):
            return
        least = 1e-9 * max(1.0, abs(low), abs(high))
        if high - low < least:
            low, high = low - max(0.5, abs(low) * 0.05), high + max(0.5, abs(high) * 0.05)
        room = (high - low) * margin
        self.low, self.high = low - room, high + room

    def zoom(self, factor: float, about: float) -> None:
        """Show ``1 / factor`` of the range; the value ``about`` stays where it is."""
        self.show(about - (about - self.low) / factor, about + (self.high - about) / factor)

    def pan(self, by: float) -> None:
        """Move the range by a difference of values."""
        self.show(self.low + by, self.high + by)

    def place(self, value: Any) -> Any:
        """0 at the left edge, 1 at the right."""
        return (np.asarray(value, np.float64) - self.low) / self.span

    def value(self, place: float) -> float:
        """The value at a place."""
        return self.low + place * self.span

    def rounded(self, value: float, pixels: int) -> float:
        """A value without the digits that a pixel cannot tell apart."""
        step = self.span / max(1, pixels)
        digits = -math.floor(math.log10(step)) if step > 0.0 else 0
        return round(value, digits) if digits > 0 else float(round(value, digits))

    def ticks(self, most: int) -> list[float]:
        """Round values in the range, at most so many."""
        rough = self.span / max(1, most)
        power = 10.0 ** math.floor(math.log10(rough))
        step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= rough * (1 - 1e-9))
        first = math.ceil(self.low / step - 1e-9)
        last = math.floor(self.high / step + 1e-9)
        return [round(n * step, 12) for n in range(first, last + 1)]
