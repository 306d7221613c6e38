"""Cut one line of a kernel into tokens."""

from __future__ import annotations

import re
from typing import NamedTuple


class Token(NamedTuple):
    """``kind`` is name, int, uint, float, bool, op or end; ``line`` counts in the joined text, from 1."""

    kind: str
    text: str
    line: int


class LexicalError(Exception):
    """Text that is no token; the message says why."""


_TOKEN = re.compile(
    r"""(?P<space>\s+)
      | (?P<name>[A-Za-z_][A-Za-z0-9_]*)
      | (?P<float>(?:\d+\.\d*|\.\d+)(?:[eE][+-]?\d+)?[fF]?|\d+[eE][+-]?\d+[fF]?)
      | (?P<uint>(?:0[xX][0-9a-fA-F]+|\d+)[uU])
      | (?P<int>0[xX][0-9a-fA-F]+|\d+)
      | (?P<op><<=|>>=|\+\+|--|<<|>>|<=|>=|==|!=|&&|\|\||\^\^|\+=|-=|\*=|/=|%=|&=|\|=|\^=|[-+*/%<>=!~&|^?:;,.(){}\[\]])
    """,
    re.VERBOSE | re.ASCII,
)


def scan(text: str, line: int) -> list[Token]:
    """Return the tokens of one line without comments. Raises LexicalError."""
    tokens: list[Token] = []
    at = 0
    while at < len(text):
        match = _TOKEN.match(text, at)
        if match is None:
            raise LexicalError(f"{text[at]!r} is no character of the language")
        kind, piece = str(match.lastgroup), match.group()
        at = match.end()
        if kind == "space":
            continue
        if kind in ("float", "int", "uint"):
            after = re.match(r"\w*", text[at:])
            if after and after.group():
                raise LexicalError(f"{piece + after.group()!r} is no number: write 1, 1u, 0x1fu, 1.0 or 1.0e-3")
            piece = _number(kind, piece)
        elif piece in ("true", "false"):
            kind = "bool"
        tokens.append(Token(kind, piece, line))
    return tokens


def _number(kind: str, piece: str) -> str:
    """Check the range of a literal and return it without its suffix."""
    if kind == "float":
        piece = piece.rstrip("fF")
        if len(piece) > 400 or float(piece) == float("inf"):
            raise LexicalError("this number is too large for a float")
        return piece
    piece = piece.rstrip("uU")
    if re.match(r"0\d", piece):
        raise LexicalError(f"{piece!r} is octal: write it in decimal or as 0x...")
    if len(piece) > 20 or int(piece, 0) > 0xFFFFFFFF:
        raise LexicalError(f"{piece} does not fit into 32 bits")
    if kind == "int" and int(piece, 0) > 0x7FFFFFFF:
        raise LexicalError(f"{piece} is above the largest int: write {piece}u")
    return piece
