"""Expressions of derived variables: ``coarse / 2``, ``clamp(frame * 3.6, 0, 360)``.

Parsed by hand and evaluated on a tree, never by Python's ``eval``: a workspace is data. Arithmetic on numbers, a fixed
list of functions, ``pi``, and names of variables. A lone name may stand for a value of any kind (a camera that follows
another). Whole numbers stay whole under ``+ - * // %``; ``/`` and ``**`` give real numbers.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from nodegraph.errors import ParameterError, near_miss

LONGEST = 500
"""Characters of an expression; longer text is refused before it is read."""
DEEPEST = 50
"""Nesting of parentheses, calls and signs; the parser is recursive."""


def _round(x: float) -> int:
    """Round half away from zero, as people do (Python rounds half to even)."""
    return int(math.copysign(math.floor(abs(x) + 0.5), x))


FUNCTIONS: dict[str, tuple[int, int, Callable[..., float]]] = {
    # name: (fewest arguments, most arguments, function)
    "abs": (1, 1, abs),
    "acos": (1, 1, math.acos),
    "asin": (1, 1, math.asin),
    "atan": (1, 1, math.atan),
    "atan2": (2, 2, math.atan2),
    "ceil": (1, 1, math.ceil),
    "clamp": (3, 3, lambda x, low, high: min(max(x, low), high)),
    "cos": (1, 1, math.cos),
    "degrees": (1, 1, math.degrees),
    "exp": (1, 1, math.exp),
    "floor": (1, 1, math.floor),
    "log": (1, 1, math.log),
    "log10": (1, 1, math.log10),
    "log2": (1, 1, math.log2),
    "max": (1, 16, lambda *values: max(values)),
    "min": (1, 16, lambda *values: min(values)),
    "mix": (3, 3, lambda a, b, t: a + (b - a) * t),
    "radians": (1, 1, math.radians),
    "round": (1, 1, _round),
    "sign": (1, 1, lambda x: (x > 0) - (x < 0)),
    "sin": (1, 1, math.sin),
    "sqrt": (1, 1, math.sqrt),
    "tan": (1, 1, math.tan),
}
CONSTANTS: dict[str, float] = {"pi": math.pi}
RESERVED = frozenset(FUNCTIONS) | frozenset(CONSTANTS)
"""Names that no variable may bear, because an expression could not reach it."""

_OPERATORS: dict[str, tuple[int, Callable[[Any, Any], float]]] = {
    # operator: (how tightly it binds, function)
    "+": (1, lambda a, b: a + b),
    "-": (1, lambda a, b: a - b),
    "*": (2, lambda a, b: a * b),
    "/": (2, lambda a, b: a / b),
    "//": (2, lambda a, b: a // b),
    "%": (2, lambda a, b: a % b),
    "**": (4, lambda a, b: math.pow(a, b)),  # not a ** b: 9 ** 9 ** 9 of whole numbers would never end
}
_SIGN_BINDS = 3  # between * and **, so that -x ** 2 is -(x ** 2)
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[A-Za-z_][A-Za-z0-9_]*)"
    r"|(?P<mark>\*\*|//|[-+*/%(),])|(?P<end>$))"
)


@dataclass(frozen=True, slots=True)
class Number:
    value: float


@dataclass(frozen=True, slots=True)
class Name:
    name: str


@dataclass(frozen=True, slots=True)
class Call:
    """An operator, a sign or a named function applied to operands."""

    name: str
    function: Callable[..., float]
    operands: tuple[Tree, ...]


Tree = Number | Name | Call


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed expression: its text, the variables it names (in order of appearance), and its tree."""

    text: str
    names: tuple[str, ...]
    tree: Tree

    def evaluate(self, values: Mapping[str, Any], where: str) -> Any:
        """Return the value with variables taken from ``values``. Raises ParameterError beginning with ``where``."""
        if isinstance(self.tree, Name) and self.tree.name not in CONSTANTS:
            return values[self.tree.name]
        try:
            result = _evaluate(self.tree, values, where)
        except ZeroDivisionError:
            raise ParameterError(f"{where}: {self.text!r} divides by zero") from None
        except OverflowError:
            raise ParameterError(f"{where}: {self.text!r} is too large for a number") from None
        except ValueError as error:
            if isinstance(error, ParameterError):
                raise
            raise ParameterError(f"{where}: {self.text!r} has no value here: {error}") from None
        return result

    def renamed(self, names: Mapping[str, str]) -> str:
        """Return the text with variables renamed; spacing is kept."""

        def swap(match: re.Match[str]) -> str:
            return names.get(match[0], match[0])

        # A name directly after a digit or point is the exponent of a number (2e5), not a variable.
        return re.sub(r"(?<![A-Za-z0-9_.])[A-Za-z_][A-Za-z0-9_]*", swap, self.text)


def parse(text: str, where: str) -> Expression:
    """Parse an expression. Raises ParameterError that begins with ``where`` and names the column."""
    if len(text) > LONGEST:
        raise ParameterError(f"{where}: this expression has {len(text)} characters; at most {LONGEST} are read")
    parser = _Parser(text, where)
    tree = parser.binary(0, 0)
    if parser.token:
        raise parser.error("expected an operator")
    return Expression(text, tuple(parser.names), tree)


def _evaluate(tree: Tree, values: Mapping[str, Any], where: str) -> float:
    if isinstance(tree, Number):
        return tree.value
    if isinstance(tree, Name):
        if tree.name in CONSTANTS:
            return CONSTANTS[tree.name]
        value = values[tree.name]
        if not isinstance(value, int | float):
            raise ParameterError(
                f"{where}: {tree.name} is no number, so it cannot be calculated with; it may only stand alone"
            )
        return value
    operands = []
    for operand in tree.operands:  # a plain loop: one Python frame per level, so LONGEST stays far from its limit
        operands.append(_evaluate(operand, values, where))
    return tree.function(*operands)


class _Parser:
    """Precedence climbing over a stream of tokens; ``token`` is the next one, empty at the end."""

    def __init__(self, text: str, where: str) -> None:
        self.text = text
        self.where = where
        self.names: dict[str, None] = {}
        self.column = 0
        self.position = 0
        self.kind = self.token = ""
        self.advance()

    def advance(self) -> None:
        match = _TOKEN.match(self.text, self.position)
        if match is None or match.lastgroup is None:
            self.column = len(self.text) - len(self.text[self.position :].lstrip()) + 1
            self.token = self.text[self.column - 1]
            raise self.error("unexpected character")
        self.kind, self.token = match.lastgroup, match[match.lastgroup]
        self.column, self.position = match.start(match.lastgroup) + 1, match.end()

    def error(self, what: str) -> ParameterError:
        found = f"found {self.token!r}" if self.token else "found the end"
        return ParameterError(f"{self.where}: {self.text!r}, column {self.column}: {what}, {found}")

    def expect(self, mark: str) -> None:
        if self.token != mark:
            raise self.error(f"expected {mark!r}")
        self.advance()

    def binary(self, binds: int, depth: int) -> Tree:
        """Parse operators that bind tighter than ``binds``."""
        left = self.operand(depth)
        while self.token in _OPERATORS:
            symbol = self.token
            level, function = _OPERATORS[symbol]
            if level <= binds:
                break
            self.advance()
            # ** groups to the right, so its right side may hold another of the same level.
            right = self.binary(level - 1 if symbol == "**" else level, depth + 1 if symbol == "**" else depth)
            left = Call(symbol, function, (left, right))
        return left

    def operand(self, depth: int) -> Tree:
        if depth > DEEPEST:
            raise self.error(f"more than {DEEPEST} levels of nesting")
        kind, token = self.kind, self.token
        if kind == "number":
            self.advance()
            return Number(int(token) if token.isdigit() else float(token))
        if kind == "name":
            self.advance()
            return self.call(token, depth) if self.token == "(" else self.variable(token)
        if token == "(":
            self.advance()
            inner = self.binary(0, depth + 1)
            self.expect(")")
            return inner
        if token and token in "+-":
            self.advance()
            inner = self.binary(_SIGN_BINDS, depth + 1)
            return inner if token == "+" else Call("-", lambda x: -x, (inner,))
        raise self.error("expected a value")

    def variable(self, name: str) -> Tree:
        if name in FUNCTIONS:
            raise self.error(f"{name} is a function; expected '('")
        if name not in CONSTANTS:
            self.names[name] = None
        return Name(name)

    def call(self, name: str, depth: int) -> Tree:
        if name not in FUNCTIONS:
            raise ParameterError(f"{self.where}: {self.text!r}: no function {name!r}{near_miss(name, FUNCTIONS)}")
        self.advance()
        operands = [self.binary(0, depth + 1)]
        while self.token == ",":
            self.advance()
            operands.append(self.binary(0, depth + 1))
        self.expect(")")
        fewest, most, function = FUNCTIONS[name]
        if not fewest <= len(operands) <= most:
            takes = str(fewest) if fewest == most else f"{fewest} to {most}"
            raise ParameterError(f"{self.where}: {self.text!r}: {name} takes {takes} arguments, not {len(operands)}")
        return Call(name, function, tuple(operands))
