"""Text and what is written as text: Text, Choice, File, Folder."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, ClassVar

from nodegraph.errors import ParameterError, near_miss
from nodegraph.params.parameter import Parameter


class Text(Parameter):
    """Plain text; ``multiline=True`` where line breaks make sense."""

    value_type: ClassVar[type] = str
    schema_type = "string"

    def __init__(self, default: str = "", *, multiline: bool = False, **common: Any) -> None:
        self.multiline = multiline
        super().__init__(default, **common)

    def check(self, value: Any, where: str) -> str:
        if not isinstance(value, str):
            self._refuse(where, value, "text")
        if not self.multiline and ("\n" in value or "\r" in value):
            raise ParameterError(f"{where}: the text must stay on one line")
        return str(value)

    def _limits(self) -> dict[str, Any]:
        return {"multiline": True} if self.multiline else {}


class Choice(Parameter):
    """One of a fixed list of words: ``Choice("composite", "maximum", doc=...)``; the first is the default.

    ``quality`` lists choices from the fastest to the most accurate.
    """

    value_type: ClassVar[type] = str
    has_reference: ClassVar[bool] = True

    def __init__(self, *choices: str, default: str | None = None, **common: Any) -> None:
        if len(choices) < 2 or len(set(choices)) < len(choices) or not all(isinstance(c, str) and c for c in choices):
            raise TypeError(f"{self.kind}: give two or more different words, for example Choice('linear', 'nearest')")
        self.choices = choices
        super().__init__(choices[0] if default is None else default, **common)

    def check(self, value: Any, where: str) -> str:
        if isinstance(value, str) and value in self.choices:
            return str(value)
        listed = ", ".join(self.choices)
        raise ParameterError(f"{where}: {value!r} is none of {listed}{near_miss(str(value), self.choices)}")

    def schema(self) -> dict[str, Any]:
        return {"enum": list(self.choices)}

    def _limits(self) -> dict[str, Any]:
        return {"choices": list(self.choices)}

    def _check_quality(self, quality: Any) -> None:
        if quality is None:
            return
        if not isinstance(quality, tuple) or len(set(quality)) < 2 or not set(quality) <= set(self.choices):
            raise TypeError(f"{self.kind}: quality lists choices from fastest to most accurate, not {quality!r}")

    def _is_ascending(self, values: tuple[Any, ...]) -> bool:
        ranked = [self.quality.index(value) for value in values if value in (self.quality or ())]
        return super()._is_ascending(values) and ranked == sorted(ranked)


class _Path(Parameter):
    """A path, kept as text exactly as it was given; "" while none is chosen.

    What a relative path is relative to is the business of the workspace that holds it. ``write=True`` marks a path
    that is written to, so that the state of the file there does not count as an input.
    """

    value_type: ClassVar[type] = str
    schema_type = "string"

    def __init__(self, default: str | os.PathLike[str] = "", *, write: bool = False, **common: Any) -> None:
        self.write = write
        super().__init__(default, **common)

    def check(self, value: Any, where: str) -> str:
        path = os.fspath(value) if isinstance(value, os.PathLike) else value
        if not isinstance(path, str):
            self._refuse(where, value, "a path")
        if "\0" in path:
            raise ParameterError(f"{where}: a path holds no NUL character")
        return str(path)

    def _limits(self) -> dict[str, Any]:
        return {"write": True} if self.write else {}


class File(_Path):
    """A file. ``suffixes=(".nii", ".nii.gz")`` is what a file dialog offers; other names are not refused."""

    def __init__(self, default: str | os.PathLike[str] = "", *, suffixes: Sequence[str] = (), **common: Any) -> None:
        self.suffixes = (suffixes,) if isinstance(suffixes, str) else tuple(suffixes)
        if not all(suffix.startswith(".") for suffix in self.suffixes):
            raise TypeError(f"{self.kind}: suffixes begin with a dot, got {self.suffixes}")
        super().__init__(default, **common)

    def _limits(self) -> dict[str, Any]:
        told = super()._limits()
        return {"suffixes": list(self.suffixes), **told} if self.suffixes else told


class Folder(_Path):
    """A folder."""
