"""Every error that nodegraph raises on purpose.

A message is one sentence that names the place first and then the cure, for example
``render/raycast.step: 9.0 voxel is outside 0.05..4.0 voxel``. ``exit_code`` is what the command
line returns for it: 2 for input that a user can mend, 1 for a processor that failed.
"""

from __future__ import annotations

import difflib
import os
from collections.abc import Iterable, Sequence


class GraphError(Exception):
    """Root of all errors of this package."""

    exit_code = 2


class WorkspaceError(GraphError):
    """A workspace file that cannot be read. ``pointer`` is the JSON pointer of the place."""

    def __init__(self, message: str, *, file: str = "", pointer: str = "") -> None:
        place = ": ".join(part for part in (file, pointer) if part)
        super().__init__(f"{place}: {message}" if place else message)
        self.file = file
        self.pointer = pointer


class UnknownProcessor(GraphError):
    """A processor id that no folder and no entry point offers."""

    def __init__(self, id: str, known: Iterable[str] = (), reason: str = "") -> None:
        message = f"{id}: no such processor"
        if reason:
            message = f"{id}: this processor is unavailable: {reason}"
        else:
            message += f"{near_miss(id, known)}; the folder of a plug-in is named in NODEGRAPH_PATH"
        super().__init__(message)
        self.id = id


class ParameterError(GraphError, ValueError):
    """A parameter value that its declaration refuses."""


class PortError(GraphError, TypeError):
    """A connection or an input value that a port refuses."""


class MutedError(PortError):
    """A wire that leads to a muted node which has nothing to hand on."""


class CycleError(GraphError):
    """A connection that would close a cycle. ``path`` lists its nodes in order."""

    def __init__(self, path: Sequence[str]) -> None:
        super().__init__(f"{' -> '.join(path)}: this connection would close a cycle")
        self.path = tuple(path)


class CommandError(GraphError):
    """An edit of a network that makes no sense: a name that is taken, a node that is not there."""


class ProcessError(GraphError, RuntimeError):
    """A processor failed. ``stage`` is load, check, needs, build or process.

    ``file`` is the processor's own: of an error that nobody meant for users, its line there is named.
    """

    exit_code = 1

    def __init__(self, node: str, stage: str, cause: BaseException, file: str = "") -> None:
        text = one_sentence(cause)
        if not isinstance(cause, GraphError):
            line = line_in(file, cause)
            text = f"{node}: {text}" + (f" ({os.path.basename(file)}, line {line})" if line else "")
        super().__init__(text if text.startswith((f"{node}.", f"{node}:")) else f"{node}: {text}")
        self.node = node
        self.stage = stage
        self.__cause__ = cause
        # What a processor says of its input is for the user to mend; what its needs() answers is not.
        if isinstance(cause, GraphError) and stage != "needs":
            self.exit_code = cause.exit_code


class ShaderError(GraphError):
    """A kernel that lies outside the language or does not compile. ``line`` counts from 1."""

    exit_code = 1

    def __init__(self, message: str, *, file: str = "", line: int = 0, excerpt: str = "") -> None:
        place = f"{file}:{line}: " if file else ""
        excerpt = excerpt.strip() if len(excerpt.strip()) <= 160 else f"{excerpt.strip()[:160]}..."
        super().__init__(f"{place}{message}" + (f"\n    {excerpt}" if excerpt else ""))
        self.file = file
        self.line = line
        self.excerpt = excerpt


class DeviceError(GraphError):
    """A device that is missing or failed. The message says what is missing and how to get it."""

    exit_code = 1


class DeviceMissing(DeviceError):
    """A device that was asked for by name and is not on this machine."""

    exit_code = 2


class FormatError(GraphError):
    """A data file that cannot be read or written. ``field`` names the header field or offset."""

    def __init__(self, message: str, *, file: str = "", field: str = "") -> None:
        place = ": ".join(part for part in (file, field) if part)
        super().__init__(f"{place}: {message}" if place else message)
        self.file = file
        self.field = field


class Cancelled(GraphError):
    """The evaluation was cancelled; nothing of it was kept."""

    exit_code = 130

    def __init__(self, message: str = "cancelled") -> None:
        super().__init__(message)


def near_miss(name: str, known: Iterable[str]) -> str:
    """Return `` (did you mean 'x'?)`` for the closest known name, or an empty string."""
    by_text = {text.casefold(): text for text in known}
    close = difflib.get_close_matches(name.casefold(), list(by_text), n=1, cutoff=0.5)
    return f" (did you mean {by_text[close[0]]!r}?)" if close else ""


def near_miss_or_all(name: str, known: Iterable[str]) -> str:
    """Return what `near_miss` returns, or `` (there is x, y)`` where nothing is close."""
    known = tuple(known)
    return near_miss(name, known) or (f" (there is {', '.join(known)})" if known else "")


def one_sentence(error: BaseException) -> str:
    """What an error says; one that nobody meant for users on one line, with its class."""
    if isinstance(error, GraphError):
        return str(error)
    try:
        text = " ".join(str(error).split())
    except Exception:  # how a plug-in's own error becomes text may fail, too
        text = ""
    return f"{type(error).__name__}: {text or 'no message'}"


def line_in(file: str, error: BaseException) -> int:
    """The line of a source file at which an error came up; 0 where it did not pass there."""
    line, trace = 0, error.__traceback__
    while file and trace is not None:
        if trace.tb_frame.f_code.co_filename == file:
            line = trace.tb_lineno
        trace = trace.tb_next
    return line
