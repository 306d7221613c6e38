"""Find kernel files, join their includes, and remember where every line came from.

A kernel is named without its suffix, as ``render/raycast``, and looked up in a list of folders (roots); the first
that has it wins. ``#include "common/light.glsl"`` is looked up in the same roots; every file is joined once.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path, PurePosixPath

from nodegraph.errors import ShaderError, near_miss

SUFFIX = ".glsl"

_INCLUDE = re.compile(r'\s*#\s*include\b\s*(?:"([^"]*)")?\s*(?://.*)?$')
_CONDITION = re.compile(r"\s*#\s*(if|ifdef|ifndef|endif)\b")


@dataclass(frozen=True)
class Source:
    """The text of a kernel after includes.

    ``files`` are the short names (``render/raycast.glsl``) of all files in it, ``paths`` where they lie ("" for text
    that came from no file); ``places`` gives for every line of ``text`` its (file number, line number from 1).
    """

    text: str
    files: tuple[str, ...]
    paths: tuple[str, ...]
    places: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, text: str, name: str = "kernel.glsl") -> Source:
        """Return a source from a text that includes nothing."""
        lines = text.splitlines()
        return cls("\n".join(lines), (name,), ("",), tuple((0, line) for line in range(1, len(lines) + 1)))

    @cached_property
    def digest(self) -> str:
        """Digest of the joined text: equal exactly when the text is."""
        return hashlib.blake2b(self.text.encode("utf-8", "surrogatepass"), digest_size=16).hexdigest()

    @cached_property
    def lines(self) -> tuple[str, ...]:
        """The joined text, line by line."""
        return tuple(self.text.split("\n"))

    def place(self, line: int) -> tuple[str, int]:
        """Return the file and its line for a line (from 1) of the joined text."""
        if not self.places:
            return self.files[0], 1
        number, own = self.places[min(max(line, 1), len(self.places)) - 1]
        return self.files[number], own

    def error(self, line: int, message: str) -> ShaderError:
        """Return an error that points at a line (from 1) of the joined text."""
        file, own = self.place(line)
        excerpt = self.lines[line - 1] if 1 <= line <= len(self.lines) else ""
        return ShaderError(message, file=file, line=own, excerpt=excerpt)


def find(name: str, roots: Iterable[Path | str]) -> Path | None:
    """Return the file of the kernel ``name`` (with or without suffix) in the first root that has it, else None."""
    short = _short(name)
    for root in roots:
        path = Path(root) / short
        if path.is_file():
            return path
    return None


def names(roots: Iterable[Path | str]) -> list[str]:
    """Return the names, without suffix, of every kernel file below the roots."""
    found = {
        path.relative_to(root).with_suffix("").as_posix()
        for root in map(Path, roots)
        if root.is_dir()
        for path in root.rglob(f"*{SUFFIX}")
    }
    return sorted(found)


def load(name: str, roots: Sequence[Path | str]) -> Source:
    """Read the kernel ``name`` and everything that it includes. Raises ShaderError."""
    path = find(name, roots)
    if path is None:
        raise ShaderError(f"{name}: there is no such shader file{near_miss(name, names(roots))}")
    return load_file(path, roots, _short(name))


def load_file(path: Path | str, roots: Sequence[Path | str] = (), short: str = "") -> Source:
    """Read one file, wherever it lies, and what it includes; ``short`` is its name in messages."""
    joined = _Joined(roots)
    joined.add(Path(path), short or Path(path).name)
    return Source("\n".join(joined.lines), tuple(joined.files), tuple(joined.paths), tuple(joined.places))


class _Joined:
    """The text that grows while files are joined."""

    def __init__(self, roots: Sequence[Path | str]) -> None:
        self.roots = roots
        self.files: list[str] = []
        self.paths: list[str] = []
        self.lines: list[str] = []
        self.places: list[tuple[int, int]] = []

    def add(self, path: Path, short: str) -> None:
        number = len(self.files)
        self.files.append(short)
        self.paths.append(str(path))
        try:
            text = path.read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ShaderError(f"{short}: this shader file cannot be read as UTF-8 text: {error}") from None
        in_comment, conditions = False, 0
        for own, line in enumerate(text.splitlines(), 1):
            code, in_comment = _without_comments(line, in_comment)
            include = _INCLUDE.match(code)
            if include:
                if conditions:
                    raise ShaderError(
                        "#include inside #if is not in the language: include at the top and use #if around the calls",
                        file=short,
                        line=own,
                        excerpt=line,
                    )
                self.include(include[1], short, own, line)
                line = ""
            condition = _CONDITION.match(code)
            if condition:
                conditions += -1 if condition[1] == "endif" else 1
            self.lines.append(line)
            self.places.append((number, own))
        if in_comment:
            raise ShaderError("a comment is opened by /* and never closed", file=short, line=len(text.splitlines()))

    def include(self, target: str | None, file: str, line: int, excerpt: str) -> None:
        try:
            short = _short(target or "")
        except ShaderError:
            raise ShaderError(
                'write #include "common/name.glsl", below a shader folder', file=file, line=line, excerpt=excerpt
            ) from None
        if short in self.files:
            return
        path = find(short, self.roots)
        if path is None:
            known = near_miss(short, (name + SUFFIX for name in names(self.roots)))
            raise ShaderError(f'cannot find the include "{short}"{known}', file=file, line=line, excerpt=excerpt)
        if len(self.files) > 200:
            raise ShaderError("more than 200 files are included", file=file, line=line, excerpt=excerpt)
        self.add(path, short)


def _short(name: str) -> str:
    """Return the file name below a root; refuse names that could leave it."""
    pure = PurePosixPath(name)
    if not name or "\\" in name or ":" in name or "\0" in name or pure.is_absolute() or ".." in pure.parts:
        raise ShaderError(f"{name!r} is no name of a shader file: write it as category/name")
    return str(pure) if pure.suffix == SUFFIX else f"{pure}{SUFFIX}"


def _without_comments(line: str, in_comment: bool) -> tuple[str, bool]:
    """Return the line with comments blanked, and whether a block comment is open at its end."""
    kept, at = "", 0
    while at < len(line):
        if in_comment:
            end = line.find("*/", at)
            if end < 0:
                return kept, True
            at, in_comment = end + 2, False
            kept += " "
        elif line.startswith("//", at):
            break
        elif line.startswith("/*", at):
            at, in_comment = at + 2, True
        else:
            kept += line[at]
            at += 1
    return kept, in_comment


def stamps(paths: Iterable[str]) -> tuple[tuple[int, int], ...]:
    """When the files of a source were last written and how long they are: equal means not to be read again."""
    found = []
    for path in paths:
        try:
            status = os.stat(path)
            found.append((status.st_mtime_ns, status.st_size))
        except OSError:
            found.append((0, 0))
    return tuple(found)
