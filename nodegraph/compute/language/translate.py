"""Source text to checked module."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

from nodegraph.errors import ShaderError
from nodegraph.shaders import Source

from .check import check
from .module import Module
from .parser import parse
from .preprocess import prepare

Defines = Mapping[str, int | float | bool]


def compile(source: Source | str, defines: Defines | None = None) -> Module:
    """Parse and check a kernel; ``defines`` win over the file's own. Any text gives a Module or a ShaderError."""
    if isinstance(source, str):
        source = Source.of(source)
    pairs = tuple((name, type(value).__name__, value) for name, value in sorted((defines or {}).items()))
    return _compile(source, pairs)


@lru_cache(maxsize=256)
def _compile(source: Source, defines: tuple[tuple[str, str, int | float | bool], ...]) -> Module:
    """Compile once per text; the type's name keeps 1, 1.0 and True apart as keys."""
    try:
        prepared = prepare(source, {name: value for name, _, value in defines})
        return check(parse(prepared.tokens, source), source, prepared)
    except RecursionError:
        raise ShaderError(
            "this kernel is nested too deeply: use variables and functions", file=source.files[0]
        ) from None
