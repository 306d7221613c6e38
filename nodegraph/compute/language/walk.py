"""Look through a syntax tree."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeVar

from . import syntax as s

T = TypeVar("T")


def nodes(root: object, kind: type[T], into_loops: bool = True) -> Iterator[T]:
    """All statements and expressions of a kind at and below ``root``; those inside of loops only if so told."""
    if isinstance(root, list):
        for item in root:
            yield from nodes(item, kind, into_loops)
        return
    if not isinstance(root, (s.Stmt, s.Expr)):
        return
    if isinstance(root, kind):
        yield root
    if into_loops or not isinstance(root, (s.For, s.While, s.DoWhile)):
        for part in vars(root).values():
            yield from nodes(part, kind, into_loops)


def jumps_out(stmt: s.Stmt) -> bool:
    """Whether a break or a continue in ``stmt`` would leave a loop around it."""
    return any(True for _ in nodes(stmt, s.Jump, into_loops=False))
