"""Color, Matrix and Box: numbers with a shape of their own."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, ClassVar

from nodegraph.errors import ParameterError
from nodegraph.params.numbers import _Tuple
from nodegraph.params.parameter import Parameter, as_float

_HEX = re.compile(r"#(?:[0-9a-fA-F]{6}|[0-9a-fA-F]{8})")
_IDENTITY = tuple(tuple(float(row == column) for column in range(4)) for row in range(4))


class Color(_Tuple):
    """A colour: linear light, red green blue and, when the default has four numbers, alpha (not premultiplied).

    Components lie in 0..1; ``max=None`` allows brighter ones. As text, ``"#ff8000"`` or ``"#ff8000cc"`` is taken as
    sRGB, the way every colour picker writes it, and turned into linear light (IEC 61966-2-1).
    """

    def __init__(
        self, default: Sequence[float] | str = (1.0, 1.0, 1.0), *, max: float | None = 1.0, **common: Any
    ) -> None:
        if isinstance(default, str):
            default = _from_hex(default, f"default of {self.kind}")
        if len(default) not in (3, 4):
            raise TypeError(f"{self.kind}: a colour has 3 or 4 numbers, the default has {len(default)}")
        super().__init__(default, min=0.0, max=max, **common)

    def check(self, value: Any, where: str) -> tuple[float, ...]:
        if isinstance(value, str):
            value = _from_hex(value, where)
        if hasattr(value, "tolist"):
            value = value.tolist()
        if self.count == 4 and isinstance(value, Sequence) and len(value) == 3:
            value = (*value, 1.0)
        return self.numbers(value, where, f"{self.count} numbers or '#rrggbb'")

    def schema(self) -> dict[str, Any]:
        return {"anyOf": [super().schema(), {"type": "string", "pattern": f"^{_HEX.pattern}$"}]}

    def _limits(self) -> dict[str, Any]:
        return {"components": self.count, **super()._limits()}


class Matrix(Parameter):
    """A 4x4 matrix of finite numbers, rows of a tuple of tuples; it multiplies column vectors. Default: identity."""

    value_type: ClassVar[type] = tuple

    def __init__(self, default: Any = _IDENTITY, **common: Any) -> None:
        super().__init__(default, **common)

    def check(self, value: Any, where: str) -> tuple[tuple[float, ...], ...]:
        rows = value.tolist() if hasattr(value, "tolist") else value
        return _table(self, rows, (4, 4), where, "a 4x4 matrix")

    def encode(self, value: tuple[tuple[float, ...], ...]) -> list[list[float]]:
        return [list(row) for row in value]

    def schema(self) -> dict[str, Any]:
        row = {"type": "array", "items": {"type": "number"}, "minItems": 4, "maxItems": 4}
        return {"type": "array", "items": row, "minItems": 4, "maxItems": 4}


class Box(Parameter):
    """An axis-aligned box ((x, y, z) low, (x, y, z) high), or None for everything.

    The declaration says the space: by default millimetres in the world.
    """

    value_type: ClassVar[type] = tuple

    def __init__(self, default: Any = None, *, unit: str = "mm", **common: Any) -> None:
        super().__init__(default, unit=unit, **common)

    def check(self, value: Any, where: str) -> tuple[tuple[float, ...], ...] | None:
        if value is None:
            return None
        corners = value.tolist() if hasattr(value, "tolist") else value
        low, high = _table(self, corners, (2, 3), where, "((x, y, z), (x, y, z)) or null for everything")
        for axis, a, b in zip("xyz", low, high, strict=True):
            if a > b:
                raise ParameterError(f"{where}: along {axis} the box ends at {b!r}, before its start at {a!r}")
        return low, high

    def encode(self, value: tuple[tuple[float, ...], ...] | None) -> list[list[float]] | None:
        return None if value is None else [list(corner) for corner in value]

    def schema(self) -> dict[str, Any]:
        corner = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}
        return {"anyOf": [{"type": "null"}, {"type": "array", "items": corner, "minItems": 2, "maxItems": 2}]}


def _table(parameter: Parameter, rows: Any, shape: tuple[int, int], where: str, expected: str) -> tuple[Any, ...]:
    if not isinstance(rows, (list, tuple)) or len(rows) != shape[0]:
        parameter._refuse(where, rows, expected)
    table = []
    for row in rows:
        row = row.tolist() if hasattr(row, "tolist") else row
        if not isinstance(row, (list, tuple)) or len(row) != shape[1]:
            parameter._refuse(where, rows, expected)
        numbers = [as_float(number) for number in row]
        if any(number is None or number - number != 0.0 for number in numbers):
            parameter._refuse(where, rows, f"{expected} of finite numbers")
        table.append(tuple(numbers))
    return tuple(table)


def _from_hex(text: str, where: str) -> tuple[float, ...]:
    if not _HEX.fullmatch(text):
        raise ParameterError(f"{where}: {text!r} is no colour; write '#rrggbb', '#rrggbbaa' or a list of numbers")
    parts = [int(text[i : i + 2], 16) / 255.0 for i in range(1, len(text), 2)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts[:3]]
    return (*linear, *parts[3:])
