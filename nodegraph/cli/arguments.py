"""What the commands' arguments have in common: sizes, assignments, ranges of values."""

from __future__ import annotations

import argparse
import re
from dataclasses import dataclass
from typing import NoReturn

from nodegraph.cli.terminal import answer
from nodegraph.errors import GraphError

DEVICES = ("auto", "gl", "cl", "cl64")
MAX_SIDE = 32768


class UsageError(GraphError):
    """A command line that makes no sense."""


class Parser(argparse.ArgumentParser):
    """A parser that answers a mistake with one sentence instead of the whole usage text."""

    def __init__(self, **options: object) -> None:
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False, **options)  # type: ignore[arg-type]

    def print_help(self, file: object = None) -> None:
        """Print the whole help on the standard output, which belongs to answers."""
        answer(self.format_help().rstrip())

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message}; see {self.prog} --help")


@dataclass(frozen=True)
class Assignment:
    """``place=text`` as typed. ``place`` is ``node.param``, ``group/node.param``, or the name of a variable."""

    place: str
    text: str


def assignment(text: str) -> Assignment:
    """Parse ``node.param=value``."""
    place, equals, value = text.partition("=")
    place = place.strip()
    if not equals or not place:
        raise argparse.ArgumentTypeError(f"{text!r} is not of the form node.param=value")
    return Assignment(place, value)


def size(text: str) -> tuple[int, int]:
    """Parse ``WIDTHxHEIGHT`` in pixels."""
    found = re.fullmatch(r"(\d+)\s*[xX*]\s*(\d+)", text.strip())
    if found is None:
        raise argparse.ArgumentTypeError(f"{text!r} is not a size such as 1280x720")
    width, height = int(found[1]), int(found[2])
    if not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise argparse.ArgumentTypeError(f"{text!r}: each side must be 1 to {MAX_SIDE} pixels")
    return width, height


def values(text: str) -> tuple[str, ...]:
    """Parse the values of a sweep: ``a..b:n`` (n evenly spaced, both ends included) or a list ``a,b,c``.

    Numbers come back as the shortest text that reads back as the same number; they name folders.
    """
    found = re.fullmatch(r"(.+)\.\.(.+):(\d+)", text.strip())
    if found is None:
        listed = tuple(part.strip() for part in text.split(",") if part.strip())
        if not listed or ".." in text:
            raise argparse.ArgumentTypeError(f"{text!r} is neither a range such as 0.5..2:4 nor a list such as 1,2,5")
        return listed
    try:
        first, last = float(found[1]), float(found[2])
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r}: the ends of a range are numbers") from None
    count = int(found[3])
    if not 1 <= count <= 100_000:
        raise argparse.ArgumentTypeError(f"{text!r}: the number of values must be 1 to 100000")
    if count == 1:
        return (_short(first),)
    # Weighted ends rather than first + i * step: the last value is exactly the one that was asked for.
    return tuple(_short((first * (count - 1 - i) + last * i) / (count - 1)) for i in range(count))


def _short(number: float) -> str:
    rounded = float(f"{number:.12g}")
    return str(int(rounded)) if rounded.is_integer() and abs(rounded) < 1e15 else repr(rounded)


def variation(text: str) -> tuple[str, tuple[str, ...]]:
    """Parse ``node.param=a..b:n`` or ``node.param=a,b,c``."""
    typed = assignment(text)
    return typed.place, values(typed.text)


def add_run_options(parser: argparse.ArgumentParser) -> None:
    """Add what every command that runs workspaces takes."""
    parser.add_argument(
        "--set", action="append", default=[], type=assignment, metavar="NODE.PARAM=VALUE", help="set a parameter"
    )
    parser.add_argument(
        "--view", action="append", default=[], metavar="NODE", help="run only this view or effect (may be repeated)"
    )
    parser.add_argument("--size", type=size, metavar="WxH", help="size of the pictures in pixels")
    parser.add_argument("--device", default="auto", choices=DEVICES, help="where kernels run (default: auto)")
