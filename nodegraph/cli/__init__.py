"""The command line: ``nodegraph COMMAND ...``, one file for each command.

A command's file offers ``configure(parser)`` and ``run(arguments) -> exit code``, and is imported only when it is the
one that was asked for. Exit codes: 0 fine, 1 a processor failed, 2 bad input, 130 interrupted. A mistake of the user is
one sentence on the error stream; anything else is a mistake of ours and shows its traceback.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Sequence

from nodegraph.errors import GraphError, near_miss

COMMANDS = {
    "run": "run a workspace and write its pictures",
    "sweep": "run a workspace once for every value of some parameters",
    "batch": "run a workspace once for each of many data files",
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


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    try:
        # A tuple, since `list` names a command here as soon as that one was imported.
        code = _dispatch(tuple(sys.argv[1:] if arguments is None else arguments))
        sys.stdout.flush()
        return code
    except GraphError as error:
        print(f"nodegraph: {error}", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("nodegraph: interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of our output went away, as `| head` does. Python would complain again when it closes stdout.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        # A disk that is full, a folder that may not be written: the system's sentence names the cure.
        if error.errno is None:
            raise
        place = f"{error.filename}: " if error.filename else ""
        print(f"nodegraph: {place}{(error.strerror or str(error)).lower()}", file=sys.stderr)
        return 2


def _dispatch(arguments: tuple[str, ...]) -> int:
    from nodegraph.cli.arguments import Parser, UsageError

    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(_overview())
        return 0
    if arguments[0] in ("-V", "--version"):
        import nodegraph

        print(f"nodegraph {nodegraph.__version__}")
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
