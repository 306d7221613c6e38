"""The values that a knob may take, from the fastest to the most accurate, and how a reference refines it."""

from __future__ import annotations

from typing import Any

from nodegraph.params import Bool, Bounded, Choice, Parameter

COARSER, FINER = 5, 6
"""How many factors of two a ladder reaches from the present value."""
PARTS = 10
"""Rungs of a narrow range: its length halved this often."""


def ladder(parameter: Parameter, value: Any, low: float | None = None, high: float | None = None) -> tuple[Any, ...]:
    """Values from the fastest to the most accurate; ``value`` is one of them.

    Switches and choices: all that ``quality`` names. Numbers: factors of two about ``value``, up to where a slider
    ends; in a range that is narrower than two octaves or ends at the value 0, steps that halve towards the accurate
    end (0.5, 0.75, 0.875, ... 1 for the opacity at which a ray ends).
    """
    quality = parameter.quality
    if isinstance(parameter, Bool):
        return (False, True) if quality == "on" else (True, False)
    if isinstance(parameter, Choice):
        return quality if value in quality else (value, *quality)
    if not isinstance(parameter, Bounded) or not isinstance(value, (int, float)):
        return (value,)
    integer = isinstance(value, int)
    found = {value}
    # Where a slider ends, there is nothing that anybody wants; the hard limits hold in any case.
    start, end = _tighter(parameter.soft_min, low, max), _tighter(parameter.soft_max, high, min)
    if start is not None and end is not None and (value == 0 or (start > 0 and end < 4 * start and not integer)):
        accurate, fast = (start, end) if quality == "lower" else (end, start)
        found |= {accurate + (fast - accurate) * 0.5**k for k in range(PARTS)} | {accurate}
    else:
        reach = (-FINER, COARSER) if quality == "lower" else (-COARSER, FINER)
        found |= {value * 2.0**k for k in range(reach[0], reach[1] + 1)}
    rounded = {int(number) if integer else float(number) for number in found}
    inside = {
        number
        for number in rounded
        if number == value or ((start is None or number >= start) and (end is None or number <= end))
    }
    return tuple(sorted(inside, reverse=quality == "lower"))


def refined(parameter: Parameter, value: Any, low: float | None = None, high: float | None = None) -> Any:
    """The value of the next round of a reference where nothing is declared: halved or doubled, within the hard limits.

    Switches and choices take their most accurate value at once. What cannot be refined any more comes back as it is.
    """
    quality = parameter.quality
    if isinstance(parameter, Bool):
        return quality == "on"
    if isinstance(parameter, Choice):
        return quality[-1]
    if not isinstance(parameter, Bounded) or not isinstance(value, (int, float)):
        return value
    if isinstance(value, int):
        number: float = value // 2 if quality == "lower" else max(2 * value, 1)
    else:
        number = value / 2 if quality == "lower" else value * 2
    if low is not None:
        number = max(number, low)
    if high is not None:
        number = min(number, high)
    return int(number) if isinstance(value, int) else float(number)


def _tighter(one: float | None, other: float | None, choose: Any) -> float | None:
    ends = [end for end in (one, other) if end is not None]
    return choose(ends) if ends else None
