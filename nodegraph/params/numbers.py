"""Numbers: Float, Int, Seed, Bool, Interval, Vector."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any, ClassVar

from nodegraph.errors import ParameterError
from nodegraph.params.parameter import Parameter, as_float, json_float


class Bounded(Parameter):
    """A parameter made of numbers with limits.

    ``min`` and ``max`` are hard: a value outside them is refused. ``soft_min`` and ``soft_max`` are where a slider
    ends; values beyond them may still be typed. A range of None is open. ``quality`` is "lower" or "higher": the
    direction in which results become more accurate and dearer.
    """

    integer: bool = False

    def __init__(
        self,
        default: Any,
        *,
        min: float | None = None,
        max: float | None = None,
        soft_min: float | None = None,
        soft_max: float | None = None,
        finite: bool = True,
        nan: bool = False,
        **common: Any,
    ) -> None:
        self.min, self.max = min, max
        self.soft_min = min if soft_min is None else soft_min
        self.soft_max = max if soft_max is None else soft_max
        self.finite, self.nan = finite, nan
        self.unit = common.get("unit", "")
        ends = [end for end in (min, self.soft_min, self.soft_max, max) if end is not None]
        if ends != sorted(ends):
            raise TypeError(f"{self.kind}: limits must ascend: min, soft_min, soft_max, max; got {ends}")
        super().__init__(default, **common)

    def number(self, value: Any, where: str) -> Any:
        """Check one number: its type, its finiteness, its range."""
        number = as_float(value)
        if number is None:
            self._refuse(where, value, "a whole number" if self.integer else "a number")
        if math.isnan(number) and not self.nan:
            raise ParameterError(f"{where}: nan is not allowed here")
        if math.isinf(number) and self.finite:
            raise ParameterError(f"{where}: {number} is not allowed here, the value must be finite")
        if self.integer:
            if not number.is_integer():
                self._refuse(where, value, "a whole number")
            number = int(value)  # from the value itself: a float holds integers up to 2**53 only
        if (self.min is not None and number < self.min) or (self.max is not None and number > self.max):
            raise ParameterError(f"{where}: {self._text(number)} is {self._range_text()}")
        return number

    def _check_quality(self, quality: Any) -> None:
        if quality not in (None, "lower", "higher"):
            raise TypeError(f"{self.kind}: quality is 'lower' or 'higher', whichever is more accurate; not {quality!r}")

    def _is_ascending(self, values: tuple[Any, ...]) -> bool:
        pairs = list(itertools.pairwise(values))
        rising, falling = all(a < b for a, b in pairs), all(a > b for a, b in pairs)
        return {"higher": rising, "lower": falling}.get(self.quality, rising or falling)

    def _text(self, number: float) -> str:
        return f"{number!r} {self.unit}".rstrip()

    def _range_text(self) -> str:
        if self.max is None:
            return f"below {self._text(self.min)}" if self.min is not None else "fine"
        if self.min is None:
            return f"above {self._text(self.max)}"
        return f"outside {self.min!r}..{self._text(self.max)}"

    def _limits(self) -> dict[str, Any]:
        told = {"min": self.min, "max": self.max}
        told["soft_min"] = None if self.soft_min == self.min else self.soft_min
        told["soft_max"] = None if self.soft_max == self.max else self.soft_max
        return {name: json_float(end) for name, end in told.items() if end is not None}

    def _number_schema(self) -> dict[str, Any]:
        schema: dict[str, Any] = {"type": "integer" if self.integer else "number"}
        if self.min is not None and math.isfinite(self.min):
            schema["minimum"] = self.min
        if self.max is not None and math.isfinite(self.max):
            schema["maximum"] = self.max
        words = [] if self.finite else ["inf", "-inf"]
        words += ["nan"] if self.nan else []
        return {"anyOf": [schema, {"enum": words}]} if words else schema

    def schema(self) -> dict[str, Any]:
        return self._number_schema()


class Float(Bounded):
    """A real number. inf is refused unless ``finite=False``, nan unless ``nan=True``."""

    value_type: ClassVar[type] = float
    has_reference: ClassVar[bool] = True

    def check(self, value: Any, where: str) -> float:
        number: float = self.number(value, where)
        return number

    def encode(self, value: float) -> float | str:
        return json_float(value)


class Int(Bounded):
    """A whole number. 2.0 is taken for 2; 1.5 is refused."""

    value_type: ClassVar[type] = int
    has_reference: ClassVar[bool] = True
    integer = True

    def check(self, value: Any, where: str) -> int:
        number: int = self.number(value, where)
        return number


class Seed(Int):
    """Where pseudo-random numbers start: 0..2**32 - 1. The same seed gives the same result, everywhere."""

    def __init__(self, default: int = 0, **common: Any) -> None:
        super().__init__(default, min=0, max=0xFFFFFFFF, **common)


class Bool(Parameter):
    """On or off. ``quality`` is "on" or "off", whichever is more accurate."""

    value_type: ClassVar[type] = bool
    has_reference: ClassVar[bool] = True
    schema_type = "boolean"

    def check(self, value: Any, where: str) -> bool:
        if isinstance(value, bool) or type(value).__name__ in ("bool", "bool_"):
            return bool(value)
        self._refuse(where, value, "true or false")

    def _check_quality(self, quality: Any) -> None:
        if quality not in (None, "on", "off"):
            raise TypeError(f"{self.kind}: quality is 'on' or 'off', whichever is more accurate; not {quality!r}")


class _Tuple(Bounded):
    """Several numbers of fixed count, kept as a tuple."""

    value_type: ClassVar[type] = tuple
    count: int

    def __init__(self, default: Sequence[float], **common: Any) -> None:
        self.count = len(default)
        super().__init__(default, **common)

    def numbers(self, value: Any, where: str, expected: str) -> tuple[Any, ...]:
        """Check each number of a sequence of the right length."""
        if hasattr(value, "tolist"):
            value = value.tolist()
        if isinstance(value, (str, bytes)) or not isinstance(value, Sequence) or len(value) != self.count:
            self._refuse(where, value, expected)
        return tuple(self.number(part, f"{where}[{i}]") for i, part in enumerate(value))

    def encode(self, value: tuple[float, ...]) -> list[Any]:
        return [json_float(number) for number in value]

    def schema(self) -> dict[str, Any]:
        return {"type": "array", "items": self._number_schema(), "minItems": self.count, "maxItems": self.count}


class Vector(_Tuple):
    """Two to four numbers, as many as the default has: positions (mm), directions, sizes.

    ``integer=True`` takes whole numbers only, for example a number of voxels (x, y, z). Limits hold for each.
    """

    def __init__(self, default: Sequence[float], *, integer: bool = False, **common: Any) -> None:
        if not 2 <= len(default) <= 4:
            raise TypeError(f"{self.kind}: a vector has 2 to 4 numbers, the default has {len(default)}")
        self.integer = integer
        super().__init__(default, **common)

    def check(self, value: Any, where: str) -> tuple[Any, ...]:
        return self.numbers(value, where, f"{self.count} {'whole ' if self.integer else ''}numbers")

    def _limits(self) -> dict[str, Any]:
        told = super()._limits()
        return {"integer": True, **told} if self.integer else told


class Interval(_Tuple):
    """A range (low, high) with low <= high, for example a window of intensities."""

    def __init__(self, default: Sequence[float], **common: Any) -> None:
        if len(default) != 2:
            raise TypeError(f"{self.kind}: the default is (low, high)")
        super().__init__(default, **common)

    def check(self, value: Any, where: str) -> tuple[float, float]:
        low, high = self.numbers(value, where, "(low, high)")
        if low > high:
            raise ParameterError(f"{where}: {low!r} is above {high!r}; give (low, high)")
        return low, high
