"""What a kernel can be told to leave out: its switches, what each stands for, and which of them a variant depends on.

A switch is a default that the host may override, with a comment that documents it::

    #ifndef LIT
    #define LIT 0           // Phong illumination
    #endif

The comment may name the values: ``0 composite, 1 maximum`` or ``1: a volume is bound; 0: computed on the fly``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from nodegraph.errors import ShaderError
from nodegraph.shaders import Source

from .module import Module
from .print_glsl import print_glsl
from .storage_types import Storage
from .translate import compile

_GUARD = re.compile(r"\s*#\s*ifndef\s+(\w+)\s*(?://.*)?$")
_DEFAULT = re.compile(r"\s*#\s*define\s+(\w+)\s+(\S+)\s*(?://\s*(.*))?$")
_NUMBERED = re.compile(r"(?:^|[,;]\s+)(-?\d+):?\s+")

Number = int | float | bool


@dataclass(frozen=True)
class Switch:
    """One switch as a variant has it.

    ``matters`` is False where no value that is known of it changes the variant: which way to take gradients, say, in
    one without illumination.
    """

    name: str
    value: Number
    doc: str
    file: str
    matters: bool

    @property
    def held(self) -> bool:
        """True when the variant holds the feature; a value 0 that the comment names is a choice, and held."""
        return self.matters and (bool(self.value) or 0 in _named(self.doc))

    @property
    def meaning(self) -> str:
        """What the value stands for; of a feature that is left out, what it would be."""
        named = _named(self.doc)
        if isinstance(self.value, float) and not self.value.is_integer():
            return self.doc
        return named.get(int(self.value)) or named.get(1) or self.doc

    def __str__(self) -> str:
        shown = int(self.value) if isinstance(self.value, bool) else self.value
        return f"{self.name} {shown}: {self.meaning}" if self.meaning else f"{self.name} {shown}"


def switches(source: Source, defines: Mapping[str, Number] | None = None) -> tuple[Switch, ...]:
    """The switches of a kernel in the order of its text, for the variant of these defines.

    Asking compiles the variants next to this one, so it is for explanations and not for every run. Raises ShaderError
    where the variant itself does not compile.
    """
    given = dict(defines or {})
    variant = _text(compile(source, given))
    found = []
    for line, name, default, doc in _declared(source):
        value = given.get(name, default)
        others = [other for other in (0, 1, *_named(doc)) if other != value]
        matters = any(_differs(source, {**given, name: other}, variant) for other in dict.fromkeys(others))
        found.append(Switch(name, value, doc, source.place(line)[0], matters))
    return tuple(found)


def _declared(source: Source) -> list[tuple[int, str, Number, str]]:
    """(line, name, default, comment) of each guarded default; those that are no numbers are no switches."""
    found: list[tuple[int, str, Number, str]] = []
    for number, (first, second) in enumerate(zip(source.lines, source.lines[1:], strict=False), 1):
        guard, default = _GUARD.match(first), _DEFAULT.match(second)
        if guard is None or default is None or guard[1] != default[1]:
            continue
        value = _number(default[2])
        if value is not None and all(guard[1] != name for _, name, _, _ in found):
            found.append((number, guard[1], value, (default[3] or "").strip()))
    return found


def _number(text: str) -> Number | None:
    if text in ("true", "false"):
        return text == "true"
    try:
        return int(text, 0)
    except ValueError:
        pass
    try:
        return float(text)
    except ValueError:
        return None


def _named(doc: str) -> dict[int, str]:
    """What a comment says about single values; empty where it says something about the switch as a whole."""
    if not _NUMBERED.match(doc):
        return {}
    parts = _NUMBERED.split(doc)
    return {int(value): text.strip() for value, text in zip(parts[1::2], parts[2::2], strict=True)}


def _differs(source: Source, defines: Mapping[str, Number], variant: str) -> bool:
    try:
        return _text(compile(source, dict(defines))) != variant
    except ShaderError:
        return True  # the kernel refuses that combination, so it does look at the switch


def _text(module: Module) -> str:
    """The variant printed for plain storage, without its line numbers: equal text is an equal program."""
    plain = {
        field.name: (Storage("u4" if field.kind.endswith("u") else "f4", 4 if field.kind == "field3v" else 1),)
        * max(field.count, 1)
        for field in module.fields
    }
    text, _ = print_glsl(module, plain)
    return "\n".join(line for line in text.splitlines() if not line.startswith("#line"))
