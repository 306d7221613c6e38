"""Values that are known before a kernel runs: sizes of arrays, defaults of uniforms, constant indices."""

from __future__ import annotations

import operator
from collections.abc import Callable

from . import syntax as s
from .types import Numeric

Scalar = float | int | bool

_COMPARE: dict[str, Callable[[Scalar, Scalar], bool]] = {
    "<": operator.lt, ">": operator.gt, "<=": operator.le, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip


def wrap(value: Scalar, base: str) -> Scalar | None:
    """Bring a value into the range of its type; None for a float that is not finite."""
    if base == "bool":
        return bool(value)
    if base == "float":
        number = float(value)
        return number if abs(number) < float("inf") else None
    if isinstance(value, float) and not abs(value) < 2.0**32:
        return None
    bits = int(value) & 0xFFFFFFFF
    return bits - 0x100000000 if base == "int" and bits >= 0x80000000 else bits


def unary(op: str, value: s.Constant, type: Numeric) -> s.Constant | None:
    """Fold ``op value``; vectors only under a sign."""
    if isinstance(value, tuple):
        signed = [wrap(-part if op == "-" else part, type.base) for part in value]
        known = tuple(part for part in signed if part is not None)
        return known if op in ("+", "-") and len(known) == len(value) else None
    if op == "!":
        return not value
    if op == "~":
        return wrap(~int(value), type.base)
    return wrap(-value if op == "-" else value, type.base)


def binary(op: str, a: s.Constant, b: s.Constant, operand: Numeric) -> s.Constant | None:
    """Fold ``a op b`` for scalars of the type ``operand``; None when there is no value."""
    if isinstance(a, tuple) or isinstance(b, tuple):
        return None
    if op in _COMPARE:
        return _COMPARE[op](a, b)
    if op in ("&&", "||", "^^"):
        return {"&&": bool(a and b), "||": bool(a or b), "^^": bool(a) != bool(b)}[op]
    if op in ("/", "%"):
        return None if b == 0 else wrap(_divide(op, a, b, operand.base), operand.base)
    if op in ("<<", ">>") and not 0 <= b < 32:
        return None
    if op in ("+", "-", "*"):
        arithmetic: dict[str, Callable[[Scalar, Scalar], Scalar]] = {
            "+": operator.add, "-": operator.sub, "*": operator.mul
        }  # fmt: skip
        return wrap(arithmetic[op](a, b), operand.base)
    bits: dict[str, Callable[[int, int], int]] = {
        "&": operator.and_, "|": operator.or_, "^": operator.xor, "<<": operator.lshift, ">>": operator.rshift
    }  # fmt: skip
    return wrap(bits[op](int(a), int(b)), operand.base)


def _divide(op: str, a: Scalar, b: Scalar, base: str) -> Scalar:
    if base == "float":
        return a / b
    quotient = abs(int(a)) // abs(int(b)) * (1 if (a < 0) == (b < 0) else -1)
    return quotient if op == "/" else int(a) - quotient * int(b)


def construct(type: Numeric, args: list[s.Expr]) -> s.Constant | None:
    """Fold a constructor of a scalar or vector from folded arguments."""
    parts: list[Scalar] = []
    for arg in args:
        if arg.constant is None:
            return None
        parts += arg.constant if isinstance(arg.constant, tuple) else [arg.constant]
    if len(parts) == 1:
        parts *= type.n
    values = tuple(value for part in parts[: type.n] if (value := wrap(part, type.base)) is not None)
    if len(values) < type.n:
        return None
    return values[0] if type.n == 1 else values
