"""What a person who waits sees: one line that is drawn over itself, on a terminal only."""

from __future__ import annotations

import os
import sys
import time
from typing import TextIO


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
    print(f"nodegraph: {text}", file=sys.stderr)
