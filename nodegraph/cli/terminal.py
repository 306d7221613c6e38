"""The two streams of a command: answers on the standard output, everything else on the error stream.

Plug-ins and drivers print what they like. So that a program can read the answers, the standard output belongs to
`answer` alone while a command runs, and what anybody else prints there goes to the error stream.
"""

from __future__ import annotations

import contextlib
import os
import sys
import time
from collections.abc import Iterator
from typing import TextIO

_answers: TextIO | None = None


@contextlib.contextmanager
def own_output() -> Iterator[None]:
    """Keep the standard output for `answer`; what Python or C prints there meanwhile goes to the error stream.

    A stream that is closed counts as one that nobody reads.
    """
    global _answers
    before = sys.stdout, sys.stderr
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        out = sys.stdout or nowhere
        sys.stdout = sys.stderr = sys.stderr or nowhere
        _answers = _keep(out)
        try:
            yield
        finally:
            if _answers is not out:
                os.dup2(_answers.fileno(), 1)
                with contextlib.suppress(OSError):  # what could not be written is said already
                    _answers.close()
            (sys.stdout, sys.stderr), _answers = before, None


def _keep(out: TextIO) -> TextIO:
    """Another stream to where ``out`` leads, if that is the standard output, which then leads to the error stream."""
    out.flush()
    try:
        if out.fileno() != 1:
            return out
        errors = sys.stderr.fileno()
    except (OSError, ValueError):  # a stream that is no file, as in tests
        return out
    # Names of files come out byte by byte as they are; what another encoding cannot hold is escaped.
    told = "surrogateescape" if out.encoding.lower() in ("utf-8", "utf8") else "backslashreplace"
    kept = open(os.dup(1), "w", encoding=out.encoding, errors=told)
    os.dup2(errors, 1)
    return kept


def answer(text: str) -> None:
    """Print what the command was asked for."""
    try:
        print(text, file=_answers or sys.stdout, flush=True)
    except OSError as error:
        raise OSError(error.errno, error.strerror, "standard output") from None


class Progress:
    """A line of progress on a terminal; silent when the stream is a pipe or a file.

    Use it as a context: the line is wiped at the end, whatever happens.
    """

    def __init__(self, stream: TextIO | None = None, *, every: float = 0.05) -> None:
        self._stream = stream if stream is not None else sys.stderr
        self._every = every
        self._last = 0.0
        self._shown = False
        self.visible = self._stream.isatty() and os.environ.get("TERM") != "dumb"

    def show(self, text: str, fraction: float | None = None) -> None:
        """Show ``text`` and, where it is known, the fraction done (0..1). Calls in quick succession are dropped."""
        now = time.monotonic()
        if not self.visible or now - self._last < self._every:
            return
        self._last = now
        self._shown = True
        share = f" {100 * min(max(fraction, 0.0), 1.0):3.0f} %" if fraction is not None else ""
        # Wiping first keeps the rest of a longer line from staying behind.
        self._stream.write(f"\r\x1b[K{text[:72]}{share}")
        self._stream.flush()

    def wipe(self) -> None:
        """Remove the line."""
        if self._shown:
            self._stream.write("\r\x1b[K")
            self._stream.flush()
            self._shown = False

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        self.wipe()


def say(text: str) -> None:
    """Tell the user something beside the output of the command."""
    with contextlib.suppress(OSError):  # nobody can be told of an error stream that is full
        print(f"nodegraph: {text}", file=sys.stderr)
