"""Edits of the keys of a transfer function. Each returns a new function; two keys at one value are a step."""

from __future__ import annotations

from collections.abc import Collection, Mapping

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
    return shift(function, {place: opacity}, value - function.keys[place].value, gap)


def shift(function: TransferFunction, opacities: Mapping[int, float], by: float, gap: float = 0.0) -> TransferFunction:
    """Move several keys by the same difference of values, and give each its opacity.

    They stay in order: the move ends ``gap`` before a key that is not moved. The other half of a step comes along.
    """
    keys = list(function.keys)
    moved = set(opacities)
    moved |= {other for place in opacities if (other := partner(function, place)) is not None}
    least, most = -np.inf, np.inf
    for place in moved:
        if place > 0 and place - 1 not in moved:
            room = keys[place].value - keys[place - 1].value
            least = max(least, min(gap, room / 2) - room)
        if place + 1 < len(keys) and place + 1 not in moved:
            room = keys[place + 1].value - keys[place].value
            most = min(most, room - min(gap, room / 2))
    by = float(min(max(by, least), most))
    for place in moved:
        keys[place] = keys[place]._replace(value=_between(keys, moved, place, keys[place].value + by))
    for place, opacity in opacities.items():
        keys[place] = keys[place]._replace(opacity=min(1.0, max(0.0, float(opacity))))
    return _with(function, keys)


def _between(keys: list[Key], moved: set[int], place: int, value: float) -> float:
    """A value strictly between the neighbours that do not move, whatever rounding made of it."""
    if place > 0 and place - 1 not in moved:
        value = max(value, float(np.nextafter(keys[place - 1].value, np.inf)))
    if place + 1 < len(keys) and place + 1 not in moved:
        value = min(value, float(np.nextafter(keys[place + 1].value, -np.inf)))
    return value


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


def painted(function: TransferFunction, colors: TransferFunction) -> TransferFunction:
    """A function with the colours of another, and its own opacities; keys are added where the colours bend."""
    ends = function.domain
    values = {key.value for key in function.keys}
    made = [key._replace(color=color_at(colors, key.value)) for key in function.keys]
    for value in sorted({key.value for key in colors.keys} - values):
        if ends[0] < value < ends[1]:
            made.append(Key(value, color_at(colors, value), float(opacity_at(function, [value])[0])))
    return _with(function, sorted(made, key=lambda key: key.value))  # halves of steps keep their order


def color_at(function: TransferFunction, value: float) -> tuple[float, float, float]:
    """Linear RGB at a value, to five digits."""
    red, green, blue = (round(float(part), 5) for part in function.evaluate([value])[0, :3])
    return red, green, blue


def legible(opacity: float) -> str:
    """An opacity as text, also a tiny one."""
    if opacity >= MAX_OPACITY:
        return "1"
    return f"{opacity:.4f}".rstrip("0").rstrip(".") if opacity >= 0.001 or opacity == 0.0 else f"{opacity:.2g}"


def mirror(function: TransferFunction, places: Collection[int], ends: float | None = None) -> TransferFunction:
    """Turn the keys from the first to the last place left side right.

    ends: sum of the two values that change places, by default those of the first and the last key.
    """
    first, last = min(places), max(places)
    keys = list(function.keys)
    whole = keys[first].value + keys[last].value if ends is None else ends
    turned = [key._replace(value=whole - key.value) for key in keys[first : last + 1]]
    return _with(function, [*keys[:first], *reversed(turned), *keys[last + 1 :]])


def turn_over(function: TransferFunction, places: Collection[int]) -> TransferFunction:
    """Make what is opaque transparent: each opacity becomes the greatest and the least of them less itself."""
    keys = list(function.keys)
    ends = max(keys[place].opacity for place in places) + min(keys[place].opacity for place in places)
    for place in places:
        keys[place] = keys[place]._replace(opacity=min(1.0, max(0.0, ends - keys[place].opacity)))
    return _with(function, keys)


def reverse_colors(function: TransferFunction, places: Collection[int]) -> TransferFunction:
    """Let keys exchange their colours, the first with the last, and leave values and opacities alone."""
    keys, order = list(function.keys), sorted(places)
    for place, other in zip(order, reversed(order), strict=True):
        keys[place] = keys[place]._replace(color=function.keys[other].color)
    return _with(function, keys)


def thicker(function: TransferFunction, places: Collection[int], factor: float) -> TransferFunction:
    """Multiply the extinction of keys, as if the material were so many times as dense."""
    keys = list(function.keys)
    for place in places:
        keys[place] = keys[place]._replace(opacity=dense(keys[place].opacity, factor))
    return _with(function, keys)


def dense(opacity: float, factor: float) -> float:
    """The opacity of so many times as much of a material, to four digits of what it hides or lets through."""
    if opacity >= 1.0 and factor >= 1.0:
        return 1.0
    through = (1.0 - min(opacity, MAX_OPACITY)) ** factor
    return float(f"{1.0 - through:.4g}") if through > 0.5 else 1.0 - float(f"{through:.4g}")


def _with(function: TransferFunction, keys: list[Key]) -> TransferFunction:
    return TransferFunction(keys, function.reference_length)
