"""What the arguments of ``process`` may be called, checked when a processor class is made."""

from __future__ import annotations

import re
from collections.abc import Collection
from types import FunctionType
from typing import Any

from nodegraph.errors import near_miss

#: What comes from outside the network, as keyword-only arguments.
SERVICES = ("size", "quality", "wanted", "device", "gl", "progress", "memo", "workspace", "explain")

_VARARGS, _VARKEYWORDS, _GENERATOR = 0x04, 0x08, 0x20
_COROUTINES = 0x80 | 0x200  # coroutine, async generator


def check_signature(
    owner: str, process: Any, inputs: Collection[str], params: Collection[str], outputs: Collection[str]
) -> tuple[str, ...]:
    """Return the services that ``process`` names. Raises TypeError, naming the argument, where it takes anything else
    than exactly the declared inputs and parameters, in any order, and services after a ``*``.

    A function that was generated states its names in an attribute ``argument_names``: (positional, keyword-only).
    """
    where = f"{owner}.process"
    if process is None:
        raise TypeError(f"{where}: define process(self, ...), which returns the outputs")
    if not isinstance(process, FunctionType):
        raise TypeError(f"{where}: must be a plain method, not a {type(process).__name__}")
    positional, keywords = _names(where, process)
    declared = [*inputs, *params]
    if not declared and not outputs:
        raise TypeError(f"{owner}: nothing is declared; add Input, Output and parameters as class attributes")
    for name in positional:
        if name in declared:
            continue
        if name in outputs:
            raise TypeError(f"{where}: {name} is an output; return it instead of taking it")
        if name in SERVICES:
            raise TypeError(f"{where}: {name} comes from outside; put it after a *: process(self, ..., *, {name})")
        raise TypeError(f"{where}: {name} is no declared input or parameter{near_miss(name, declared)}")
    for name in keywords:
        if name in declared:
            raise TypeError(f"{where}: {name} is declared; put it before the *")
        if name not in SERVICES:
            raise TypeError(f"{where}: {name} is no service{near_miss(name, SERVICES)}: {', '.join(SERVICES)}")
    for name in declared:
        if name not in positional:
            kind = "input" if name in inputs else "parameter"
            raise TypeError(f"{where}: the {kind} {name} is declared but process() does not take it")
    return keywords


def is_generator(process: Any) -> bool:
    """Whether calling it gives a generator."""
    return bool(process.__code__.co_flags & _GENERATOR)


def snake(name: str) -> str:
    """CamelCase as snake_case: GaussianBlur, gaussian_blur; RGBToHSV, rgb_to_hsv; Slice3D, slice3d."""
    name = re.sub(r"(?<=[A-Z])(?=[A-Z][a-z])|(?<=[a-z0-9])(?=[A-Z][a-z]|[A-Z]{2,}$|[A-Z]{2,}[A-Z][a-z])", "_", name)
    return name.lower()


def camel(stem: str) -> str:
    """snake_case as CamelCase: gaussian_blur, GaussianBlur."""
    return "".join(part[:1].upper() + part[1:] for part in stem.split("_"))


def _names(where: str, process: FunctionType) -> tuple[tuple[str, ...], tuple[str, ...]]:
    stated = getattr(process, "argument_names", None)
    if stated is not None:
        positional, keywords = stated
        return tuple(positional), tuple(keywords)
    function = process
    while hasattr(function, "__wrapped__"):
        function = function.__wrapped__
    code = function.__code__
    if code.co_flags & _COROUTINES:
        raise TypeError(f"{where}: must not be async; yield where it may be interrupted")
    if code.co_flags & (_VARARGS | _VARKEYWORDS):
        raise TypeError(f"{where}: name every argument; *args and **kwargs hide what is used")
    if code.co_argcount == 0:
        raise TypeError(f"{where}: the first argument is self")
    if function.__defaults__:
        raise TypeError(f"{where}: arguments have no defaults here; the declarations hold them")
    names = code.co_varnames
    first_keyword = code.co_argcount
    return names[1:first_keyword], names[first_keyword : first_keyword + code.co_kwonlyargcount]
