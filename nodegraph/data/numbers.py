"""Reading numbers out of JSON: inf and nan are strings there, since JSON has none."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from nodegraph.errors import ParameterError

SPECIAL = {"inf": math.inf, "-inf": -math.inf, "nan": math.nan}


def number(value: Any, where: str, *, finite: bool = True) -> float:
    """Return ``value`` as a float, or raise ParameterError that starts with ``where``."""
    if isinstance(value, str) and value in SPECIAL:
        value = SPECIAL[value]
    if isinstance(value, bool) or not (isinstance(value, (int, float)) or hasattr(value, "__float__")):
        raise ParameterError(f"{where}: expected a number, got {value!r}")
    try:
        result = float(value)
    except (OverflowError, TypeError, ValueError):
        raise ParameterError(f"{where}: expected a number, got {value!r}") from None
    if finite and not math.isfinite(result):
        raise ParameterError(f"{where}: expected a finite number, got {result}")
    return result


def numbers(value: Any, count: int, where: str, *, finite: bool = True) -> tuple[float, ...]:
    """Return ``count`` floats, or raise ParameterError that starts with ``where``."""
    if isinstance(value, (str, bytes, dict)) or not isinstance(value, Iterable):
        raise ParameterError(f"{where}: expected {count} numbers, got {value!r}")
    items = tuple(value)
    if len(items) != count:
        raise ParameterError(f"{where}: expected {count} numbers, got {len(items)}")
    return tuple(number(item, f"{where}[{i}]", finite=finite) for i, item in enumerate(items))


def plain(value: float) -> float | str:
    """The JSON form of a float: inf and nan become strings."""
    if math.isfinite(value):
        return value
    return "nan" if math.isnan(value) else "inf" if value > 0 else "-inf"


def fields(json: Any, allowed: Iterable[str], where: str) -> dict[str, Any]:
    """Return ``json`` if it is an object with known keys only, or raise ParameterError."""
    from nodegraph.errors import near_miss_or_all

    known = tuple(allowed)
    if not isinstance(json, dict):
        raise ParameterError(f"{where}: expected an object with {', '.join(known)}, got {json!r}")
    for key in json:
        if key not in known:
            raise ParameterError(f"{where}: unknown key {key!r}{near_miss_or_all(str(key), known)}")
    return json
