"""The command line: ``nodegraph COMMAND ...``, one file for each command.

A command's file offers ``configure(parser)`` and ``run(arguments) -> exit code``, and is imported only when it is the
one that was asked for. Exit codes: 0 fine, 1 a processor failed, 2 bad input, 130 interrupted, 143 terminated. A
mistake of the user is one sentence on the error stream; anything else is a mistake of ours and shows its traceback.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import signal
import sys
import threading
from collections.abc import Sequence

from nodegraph.errors import GraphError, near_miss

COMMANDS = {
    "edit": "open the visual editor",
    "run": "run a workspace and write its pictures",
    "sweep": "run a workspace once for every value of some parameters",
    "batch": "run a workspace once for each of many data files",
    "animate": "render the pictures of an animation, or a film",
    "measure": "vary settings and tell what each costs and how wrong it is",
    "tune": "find the cheapest settings under an error, or the most accurate within a time",
    "explain": "print what a run would do, and why",
    "why": "say what made a node dirty or kept it clean",
    "info": "describe a data file or a workspace",
    "convert": "read a data file and write it in another format",
    "check": "list devices, drivers and limits, and what is missing",
    "list": "list the processors",
    "new": "write a working processor with a test",
    "docs": "write the pages of the processors",
}

INTERRUPTED = 130
TERMINATED = 143


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    from nodegraph.cli.terminal import own_output

    if arguments is None:
        signal.signal(signal.SIGTERM, _terminate)
    with own_output():
        # A tuple, since `list` names a command here as soon as that one was imported.
        code = _guarded(tuple(sys.argv[1:] if arguments is None else arguments))
    busy = any(thread.name == "nodegraph-engine" for thread in threading.enumerate())
    if arguments is None and busy and code in (INTERRUPTED, TERMINATED):
        _leave(code)
    return code


class _Terminated(KeyboardInterrupt):
    """SIGTERM, as a queue of a cluster sends it: ends things as Ctrl-C does."""


def _terminate(*_: object) -> None:
    raise _Terminated


def _leave(code: int) -> None:
    """End the program without waiting for a library call that cannot be stopped, and without a half file."""
    atomic = sys.modules.get("nodegraph.formats.atomic")
    if atomic is not None:
        atomic.remove_parts()
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            with contextlib.suppress(OSError):
                stream.flush()
    os._exit(code)


def _guarded(arguments: tuple[str, ...]) -> int:
    """Run one command; its mistakes become one sentence, and one JSON document where that was asked for."""
    try:
        return _dispatch(arguments)
    except GraphError as error:
        return _refuse(str(error), error.exit_code, arguments)
    except KeyboardInterrupt as error:
        terminated = isinstance(error, _Terminated)
        return _refuse(
            "terminated" if terminated else "interrupted", TERMINATED if terminated else INTERRUPTED, arguments
        )
    except BrokenPipeError:
        return 0  # the reader of our output went away, as `| head` does
    except OSError as error:
        # A disk that is full, a folder that may not be written: the system's sentence names the cure.
        if error.errno is None:
            raise
        place = f"{error.filename}: " if error.filename else ""
        return _refuse(f"{place}{(error.strerror or str(error)).lower()}", 2, arguments)


def _refuse(message: str, code: int, arguments: tuple[str, ...]) -> int:
    from nodegraph.cli.terminal import answer, say

    say(message)
    if "--json" in arguments:
        import json

        with contextlib.suppress(OSError):
            answer(json.dumps({"ok": False, "exit_code": code, "error": message}, indent=1))
    return code


def _dispatch(arguments: tuple[str, ...]) -> int:
    from nodegraph.cli.arguments import Parser, UsageError
    from nodegraph.cli.terminal import answer

    if not arguments or arguments[0] in ("-h", "--help", "help"):
        answer(_overview())
        return 0
    if arguments[0] in ("-V", "--version"):
        import nodegraph

        answer(f"nodegraph {nodegraph.__version__}")
        return 0
    name = arguments[0]
    if name not in COMMANDS:
        raise UsageError(f"{name}: no such command{near_miss(name, COMMANDS)}; nodegraph --help lists them")
    command = importlib.import_module(f"nodegraph.cli.{name}")
    parser = Parser(prog=f"nodegraph {name}", description=command.__doc__)
    command.configure(parser)
    code: int = command.run(parser.parse_args(arguments[1:]))
    return code


def _overview() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:{width}}  {text}" for name, text in COMMANDS.items()]
    return "\n".join(
        [
            "usage: nodegraph COMMAND ...",
            "",
            *lines,
            "",
            "nodegraph COMMAND --help tells more; --version tells the version.",
        ]
    )
