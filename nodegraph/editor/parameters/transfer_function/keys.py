"""Edits of the keys of a transfer function. Each returns a new function; two keys at one value are a step."""

from __future__ import annotations

import numpy as np

from nodegraph.data.transfer_function import MAX_OPACITY, Key, TransferFunction


def opacity_at(function: TransferFunction, values: object) -> np.ndarray:
    """Opacity per reference length at values, 0..1: what the extinction that is marched amounts to.

    Extinction, not opacity, is linear between keys, so this is no polygon.
    """
    extinction = function.evaluate(values)[..., 3]
    return -np.expm1(-extinction * function.reference_length)


def insert(
    function: TransferFunction, value: float, opacity: float | None = None
) -> tuple[TransferFunction, int] | None:
    """Add a key at a value, with the colour that the function has there, and its opacity unless one is given.

    Returns the function and the key's place, or None where a step leaves no room at this very value.
    """
    if sum(key.value == value for key in function.keys) >= 2:
        return None
    row = function.evaluate([value])[0]
    red, green, blue = (round(float(part), 5) for part in row[:3])
    color = (red, green, blue) if function.keys else (1.0, 1.0, 1.0)
    if opacity is None:
        opacity = float(opacity_at(function, [value])[0])
    place = sum(key.value <= value for key in function.keys)
    key = Key(float(value), color, min(1.0, max(0.0, float(opacity))))
    return _with(function, [*function.keys[:place], key, *function.keys[place:]]), place


def remove(function: TransferFunction, place: int) -> TransferFunction:
    """Take a key away."""
    return _with(function, [*function.keys[:place], *function.keys[place + 1 :]])


def move(function: TransferFunction, place: int, value: float, opacity: float, gap: float = 0.0) -> TransferFunction:
    """Move a key, at most to ``gap`` from its neighbours. Both keys of a step change their value, one its opacity."""
    keys = list(function.keys)
    held = [other for other, key in enumerate(keys) if key.value == keys[place].value]
    low = keys[held[0] - 1].value if held[0] > 0 else -np.inf
    high = keys[held[-1] + 1].value if held[-1] + 1 < len(keys) else np.inf
    gap = min(gap, (high - low) / 2) if np.isfinite(high - low) else gap
    value = float(min(max(value, np.nextafter(low, np.inf), low + gap), np.nextafter(high, -np.inf), high - gap))
    for other in held:
        keys[other] = keys[other]._replace(value=value)
    keys[place] = keys[place]._replace(opacity=min(1.0, max(0.0, float(opacity))))
    return _with(function, keys)


def recolor(function: TransferFunction, place: int, color: tuple[float, float, float]) -> TransferFunction:
    """Give a key another colour, linear RGB."""
    keys = list(function.keys)
    keys[place] = keys[place]._replace(color=color)
    return _with(function, keys)


def partner(function: TransferFunction, place: int) -> int | None:
    """The other key of a step, None for a key that stands alone."""
    for other in (place - 1, place + 1):
        if 0 <= other < len(function.keys) and function.keys[other].value == function.keys[place].value:
            return other
    return None


def make_step(function: TransferFunction, place: int) -> TransferFunction:
    """Make two keys of one, left and right of a step at its value. The left one takes what is left of it, if any."""
    if partner(function, place) is not None:
        return function
    keys = list(function.keys)
    key = keys[place]
    left = keys[place - 1]._replace(value=key.value) if place > 0 else key._replace(opacity=0.0)
    return _with(function, [*keys[:place], left, *keys[place:]])


def join_step(function: TransferFunction, place: int) -> TransferFunction:
    """Make one key of a step: the chosen one stays."""
    other = partner(function, place)
    return function if other is None else remove(function, other)


def fitted(function: TransferFunction, low: float, high: float) -> TransferFunction:
    """A function over 0..1 stretched to a range of values."""
    keys = [key._replace(value=low + (high - low) * key.value) for key in function.keys]
    return _with(function, keys)


def legible(opacity: float) -> str:
    """An opacity as text, also a tiny one."""
    if opacity >= MAX_OPACITY:
        return "1"
    return f"{opacity:.4f}".rstrip("0").rstrip(".") if opacity >= 0.001 or opacity == 0.0 else f"{opacity:.2g}"


def _with(function: TransferFunction, keys: list[Key]) -> TransferFunction:
    return TransferFunction(keys, function.reference_length)
