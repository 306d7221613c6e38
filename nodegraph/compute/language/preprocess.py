"""Directives: object-like ``#define`` and ``#if``; the result is a list of tokens with their lines.

A define holds one number, one bool, the name of another define, or nothing. What the host defines wins over the
file's own ``#define``, so that a file gives defaults simply by defining them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass

from nodegraph.errors import ShaderError, near_miss
from nodegraph.shaders import Source

from .lexer import LexicalError, Token, scan

_DIRECTIVE = re.compile(r"\s*#\s*(\w*)\s*(.*)$", re.DOTALL)
_DECLARED = re.compile(r"\b(?:uniform\s+\w+|field[123][uv]?)\s+(\w+)")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z", re.ASCII)
_MAX_DEPTH = 60


@dataclass(frozen=True)
class Prepared:
    """A kernel as tokens. ``comments`` holds the trailing ``//`` comment of each line, ``absent`` what #if cut away."""

    tokens: list[Token]
    comments: dict[int, str]
    absent: frozenset[str]
    doc: str


@dataclass
class _Condition:
    line: int
    active: bool
    taken: bool
    parent: bool
    otherwise: bool = False


def prepare(source: Source, defines: Mapping[str, int | float | bool] | None = None) -> Prepared:
    """Run the directives of ``source`` and return its tokens. Raises ShaderError."""
    return _Preprocessor(source, dict(defines or {})).run()


class _Preprocessor:
    def __init__(self, source: Source, host: dict[str, int | float | bool]) -> None:
        self.source = source
        self.host = {name: self.host_tokens(name, value) for name, value in host.items()}
        self.defines: dict[str, list[Token]] = dict(self.host)
        self.conditions: list[_Condition] = []
        self.tokens: list[Token] = []
        self.absent: set[str] = set()
        self.mentioned: set[str] = set()

    def host_tokens(self, name: str, value: object) -> list[Token]:
        """Return the tokens of a value that the host defines."""
        if not _NAME.match(name):
            raise ShaderError(f"{self.source.files[0]}: {name!r} is no name for a define")
        if isinstance(value, bool):
            return [Token("bool", "true" if value else "false", 0)]
        if isinstance(value, int) and -0x80000000 < value <= 0x7FFFFFFF:
            number = Token("int", str(abs(value)), 0)
        elif isinstance(value, float) and math.isfinite(value):
            number = Token("float", repr(abs(value)), 0)
        else:
            raise ShaderError(f"{self.source.files[0]}: the define {name} is {value!r}, not a finite number or a bool")
        if math.copysign(1.0, value) > 0:
            return [number]
        return [Token("op", "(", 0), Token("op", "-", 0), number, Token("op", ")", 0)]

    def run(self) -> Prepared:
        lines, comments, doc = _split_comments(self.source)
        for line, text in enumerate(lines, 1):
            directive = _DIRECTIVE.match(text)
            if directive:
                self.directive(line, directive[1], directive[2].strip())
            elif self.active():
                self.tokens += self.expand(self.scan(text, line), line)
            else:
                self.mentioned.update(re.findall(r"\w+", text))
                self.absent.update(_DECLARED.findall(text))
        if self.conditions:
            raise self.source.error(self.conditions[-1].line, "this #if has no #endif")
        for name in self.host:
            if name not in self.mentioned:
                hint = near_miss(name, self.mentioned)
                raise ShaderError(f"{self.source.files[0]}: nothing here depends on the define {name}{hint}")
        self.tokens.append(Token("end", "", len(lines)))
        return Prepared(self.tokens, comments, frozenset(self.absent), doc)

    def active(self) -> bool:
        return not self.conditions or self.conditions[-1].active

    def scan(self, text: str, line: int) -> list[Token]:
        try:
            return scan(text, line)
        except LexicalError as error:
            raise self.source.error(line, str(error)) from None

    def expand(self, tokens: list[Token], line: int, seen: frozenset[str] = frozenset()) -> list[Token]:
        """Replace names of defines by their tokens; ``seen`` stops a define that mentions itself."""
        result = []
        for token in tokens:
            if token.kind == "name":
                self.mentioned.add(token.text)
            if token.kind == "name" and token.text in self.defines and token.text not in seen:
                if len(seen) > _MAX_DEPTH:
                    raise self.source.error(line, f"the define {token.text} leads through too many others")
                value = self.defines[token.text]
                if not value:
                    raise self.source.error(line, f"the define {token.text} has no value: it is only for #ifdef")
                result += self.expand(value, line, seen | {token.text})
            else:
                result.append(token._replace(line=line))
        return result

    def directive(self, line: int, name: str, rest: str) -> None:
        if name in ("if", "ifdef", "ifndef"):
            parent = self.active()
            value = parent and self.condition(line, name, rest)
            self.mentioned.update(re.findall(r"\w+", rest))
            self.conditions.append(_Condition(line, value, value, parent))
        elif name in ("elif", "else", "endif"):
            if not self.conditions:
                raise self.source.error(line, f"#{name} without an #if before it")
            top = self.conditions[-1]
            if name == "endif":
                self.conditions.pop()
                return
            if top.otherwise:
                raise self.source.error(line, f"#{name} after #else")
            self.mentioned.update(re.findall(r"\w+", rest))
            top.otherwise = name == "else"
            top.active = top.parent and not top.taken and (name == "else" or self.condition(line, "if", rest))
            top.taken = top.taken or top.active
        elif name == "define":
            if self.active():
                self.define(line, rest)
            self.mentioned.update(re.findall(r"\w+", rest))
        elif self.active():
            raise self.source.error(line, _REFUSED.get(name, f"#{name} is no directive of the language"))

    def define(self, line: int, rest: str) -> None:
        match = re.match(r"([A-Za-z_]\w*)(\()?\s*(.*)$", rest, re.DOTALL | re.ASCII)
        if not match:
            raise self.source.error(line, "write #define NAME value")
        name, parenthesis, value = match.groups()
        if parenthesis:
            raise self.source.error(line, "a define with arguments is not in the language: write a function")
        if name == "defined" or "__" in name:
            raise self.source.error(line, f"{name} is a reserved name")
        tokens = self.scan(value, line)
        plain = tokens[1:] if tokens and tokens[0].text in ("-", "+") else tokens
        number = len(plain) == 1 and plain[0].kind in ("int", "uint", "float", "bool", "name")
        if tokens and not (number and (plain is tokens or plain[0].kind not in ("bool", "name"))):
            raise self.source.error(line, "a define holds one number or bool: for anything else write a const")
        if name in self.host:
            return
        if name in self.defines and [t[:2] for t in self.defines[name]] != [t[:2] for t in _wrapped(tokens)]:
            raise self.source.error(line, f"{name} is defined twice with different values: guard the second by #ifndef")
        self.defines[name] = _wrapped(tokens)

    def condition(self, line: int, name: str, rest: str) -> bool:
        if name == "if":
            return bool(_Arithmetic(self, self.scan(rest, line), line).value())
        if not _NAME.match(rest):
            raise self.source.error(line, f"write #{name} NAME")
        return (rest in self.defines) == (name == "ifdef")


_REFUSED = {
    "version": "leave #version out: the translator writes it",
    "extension": "extensions are not in the language",
    "undef": "#undef is not in the language: use another name",
    "include": 'write #include "common/name.glsl"; it is only resolved in files',
    "error": "#error was reached: this combination of defines is refused by the kernel",
}


def _wrapped(tokens: list[Token]) -> list[Token]:
    """Put a signed number into parentheses, so that it stays one operand wherever it is used."""
    if len(tokens) < 2:
        return tokens
    return [Token("op", "(", 0), *tokens, Token("op", ")", 0)]


class _Arithmetic:
    """The integer expression of an ``#if``."""

    _LEVELS = (("||",), ("&&",), ("==", "!="), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/", "%"))

    def __init__(self, owner: _Preprocessor, tokens: list[Token], line: int) -> None:
        self.owner = owner
        self.line = line
        self.at = 0
        self.depth = 0
        self.tokens = [*self.expand(tokens), Token("end", "", line)]

    def expand(self, tokens: list[Token]) -> list[Token]:
        """Expand defines, but not the operand of ``defined``."""
        result: list[Token] = []
        for index, token in enumerate(tokens):
            before = [t.text for t in tokens[max(index - 2, 0) : index]]
            operand = before[-1:] == ["defined"] or before == ["defined", "("]
            result += [token] if operand else self.owner.expand([token], self.line)
        return result

    def value(self) -> int:
        if self.tokens[0].kind == "end":
            raise self.fail("write a condition after #if")
        value = self.binary(0)
        if self.tokens[self.at].kind != "end":
            raise self.fail(f"{self.tokens[self.at].text!r} does not belong here")
        return value

    def fail(self, message: str) -> ShaderError:
        return self.owner.source.error(self.line, message)

    def binary(self, level: int) -> int:
        if level == len(self._LEVELS):
            return self.unary()
        left = self.binary(level + 1)
        while self.tokens[self.at].text in self._LEVELS[level]:
            operator = self.tokens[self.at].text
            self.at += 1
            left = self.apply(operator, left, self.binary(level + 1))
        return left

    def apply(self, operator: str, a: int, b: int) -> int:
        if operator in ("/", "%"):
            if b == 0:
                raise self.fail("division by zero in #if")
            quotient = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
            return quotient if operator == "/" else a - quotient * b
        table = {
            "||": int(bool(a or b)), "&&": int(bool(a and b)), "==": int(a == b), "!=": int(a != b), "<": int(a < b),
            ">": int(a > b), "<=": int(a <= b), ">=": int(a >= b), "+": a + b, "-": a - b, "*": a * b,
        }  # fmt: skip
        return max(-(2**62), min(table[operator], 2**62))

    def unary(self) -> int:
        token = self.tokens[self.at]
        self.at += 1
        self.depth += 1
        if self.depth > _MAX_DEPTH:
            raise self.fail("this #if is nested too deeply")
        try:
            return self.operand(token)
        finally:
            self.depth -= 1

    def operand(self, token: Token) -> int:
        if token.text in ("!", "-", "+"):
            value = self.unary()
            return int(not value) if token.text == "!" else -value if token.text == "-" else value
        if token.text == "(":
            value = self.binary(0)
            self.expect(")")
            return value
        if token.text == "defined":
            parenthesis = self.tokens[self.at].text == "("
            self.at += parenthesis
            name = self.tokens[self.at]
            if name.kind != "name":
                raise self.fail("write defined(NAME)")
            self.at += 1
            if parenthesis:
                self.expect(")")
            return int(name.text in self.owner.defines)
        if token.kind in ("int", "uint"):
            return int(token.text, 0)
        if token.kind == "bool":
            return int(token.text == "true")
        if token.kind == "name":
            hint = near_miss(token.text, self.owner.defines)
            raise self.fail(
                f"{token.text} is not defined here{hint}: give a default by #ifndef, or ask defined({token.text})"
            )
        if token.kind == "float":
            raise self.fail("#if compares integers, and this is a float")
        raise self.fail(
            "this #if is not complete" if token.kind == "end" else f"{token.text!r} does not belong into #if"
        )

    def expect(self, text: str) -> None:
        if self.tokens[self.at].text != text:
            raise self.fail(f"{text!r} is missing in this #if")
        self.at += 1


def _split_comments(source: Source) -> tuple[list[str], dict[int, str], str]:
    """Return the lines without comments, the trailing comments by line, and the comment that opens the main file."""
    lines: list[str] = []
    trailing: dict[int, str] = {}
    opening: list[str] = []
    opened = 0  # line of the block comment that is open, 0 when none is
    at_top = True
    for number, text in enumerate(source.lines, 1):
        code, comment, at = "", "", 0
        commented = bool(opened)
        while at < len(text):
            if opened:
                end = text.find("*/", at)
                comment += text[at : end if end >= 0 else len(text)]
                if end < 0:
                    break
                at, opened = end + 2, 0
                code += " "
            elif text.startswith("//", at):
                commented = True
                trailing[number] = text[at + 2 :].strip()
                comment += text[at + 2 :]
                break
            elif text.startswith("/*", at):
                commented = True
                at, opened = at + 2, number
            else:
                code += text[at]
                at += 1
        lines.append(code)
        own_file = not source.places or number > len(source.places) or source.places[number - 1][0] == 0
        if own_file and at_top:
            at_top = not code.strip() and (commented or not opening)
            if at_top and commented:
                opening.append(comment.strip().removeprefix("* ").rstrip("*").strip())
    if opened:
        raise source.error(opened, "this comment is never closed by */")
    return lines, trailing, "\n".join(opening).strip()
