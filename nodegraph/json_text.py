"""JSON as workspaces have it: read strictly, written so that people and version control can read it.

Reading refuses what JSON leaves open and what would cost without end: duplicate keys, NaN and Infinity as numbers,
numbers beyond double precision, deep nesting, huge files. Writing puts on one line what fits there.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from typing import Any, NoReturn

from nodegraph.errors import WorkspaceError

LARGEST = 32 * 1024 * 1024
"""Characters of a workspace. The biggest sensible ones have some hundred thousand."""
DEEPEST = 200
"""Levels of nesting; a group inside a group costs two."""
_LISTS = ("nodes", "variables")
WIDTH = 112
"""Columns that an array or object may reach before it is broken up."""


class _Repeating(dict[str, Any]):
    """An object in which ``key`` came twice; found again by `_check`, which knows where it stands."""

    key = ""


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) == len(pairs):
        return found
    marked = _Repeating(found)
    seen: set[str] = set()
    for key, _ in pairs:
        if key in seen:
            marked.key = key
        seen.add(key)
    return marked


def parse(text: str, file: str = "") -> Any:
    """Return the value of a JSON text. Raises WorkspaceError with line and column, or with a JSON pointer."""

    def constant(word: str) -> NoReturn:
        raise WorkspaceError(f"{word} is no JSON number; write it as the string {_WORDS[word]!r}", file=file)

    if len(text) > LARGEST:
        raise WorkspaceError(f"{len(text)} characters; a workspace has at most {LARGEST}", file=file)
    try:
        value = json.loads(text, object_pairs_hook=_object, parse_constant=constant)
    except json.JSONDecodeError as error:
        place = f"line {error.lineno}, column {error.colno}"
        raise WorkspaceError(f"{place}: this is not JSON: {error.msg}", file=file) from None
    except RecursionError:
        raise WorkspaceError(f"nested more than {DEEPEST} levels deep", file=file) from None
    except ValueError:
        raise WorkspaceError(
            "a number cannot be read: it has thousands of digits; write a smaller one", file=file
        ) from None
    _check(value, file)
    return value


_WORDS = {"NaN": "nan", "Infinity": "inf", "-Infinity": "-inf"}


def _check(value: Any, file: str) -> None:
    stack: list[tuple[Any, str, int]] = [(value, "", 0)]
    while stack:
        one, at, depth = stack.pop()
        if depth > DEEPEST:
            raise WorkspaceError(f"nested more than {DEEPEST} levels deep", file=file, pointer=at[:80])
        if isinstance(one, dict):
            if isinstance(one, _Repeating):
                raise WorkspaceError(f"the key {one.key!r} comes twice; remove one", file=file, pointer=at or "/")
            stack += [(inner, pointer(at, key), depth + 1) for key, inner in one.items()]
        elif isinstance(one, list):
            stack += [(inner, f"{at}/{i}", depth + 1) for i, inner in enumerate(one)]
        elif isinstance(one, float) and not math.isfinite(one):
            raise WorkspaceError("this number is too large; write infinity as the string 'inf'", file=file, pointer=at)


def pointer(at: str, key: str) -> str:
    """The JSON pointer (RFC 6901) of a member of the object at ``at``."""
    return f"{at}/{key.replace('~', '~0').replace('/', '~1')}"


def write(value: Any) -> str:
    """Return a JSON text with a final newline. The whole, all lists of nodes and variables, and each node of the top
    level always stand broken up, so that a line of a difference says what it belongs to."""
    return "".join(_write(value, 0, 0)) + "\n"


def _write(value: Any, level: int, column: int, within: str = "", broken: bool = True) -> Iterator[str]:
    """Pieces of text for a value that begins at ``column``.

    ``level`` is its nesting, ``within`` the key of the object that holds it.
    """
    if not isinstance(value, dict | list) or not value:
        yield _short(value)
        return
    if not broken or isinstance(value, list):
        line = _short(value)
        if column + len(line) <= WIDTH:
            yield line
            return
    indent = "  " * (level + 1)
    if isinstance(value, dict):
        yield "{"
        for i, (key, inner) in enumerate(value.items()):
            head = f"{indent}{_short(key)}: "
            yield f"{',' if i else ''}\n{head}"
            opened = level == 0 or key in _LISTS or (level == 1 and within == "nodes")
            yield from _write(inner, level + 1, len(head), key, opened)
        yield f"\n{indent[2:]}}}"
    elif any(isinstance(inner, dict | list) for inner in value):
        yield "["
        for i, inner in enumerate(value):
            yield f"{',' if i else ''}\n{indent}"
            yield from _write(inner, level + 1, len(indent), broken=False)
        yield f"\n{indent[2:]}]"
    else:
        yield f"[\n{indent}"
        yield from _fill([_short(inner) for inner in value], indent)
        yield f"\n{indent[2:]}]"


def _fill(words: list[str], indent: str) -> Iterator[str]:
    """Numbers and strings of a long array, as many to a line as fit."""
    column = len(indent)
    for i, word in enumerate(words):
        if i:
            if column + 2 + len(word) > WIDTH:
                yield f",\n{indent}"
                column = len(indent)
            else:
                yield ", "
                column += 2
        yield word
        column += len(word)


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    # Half of a surrogate pair is legal in JSON but has no UTF-8; it is written as the escape that it came from.
    return text if text.isascii() or _encodes(text) else json.dumps(value, allow_nan=False)


def _encodes(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
