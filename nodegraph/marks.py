"""Which nodes run at this moment, in a small file that outlives the process.

Whoever finds the file after a crash knows what native code was at work. Marking costs two copies into mapped memory,
about a microsecond; the system writes them to the file, however the process ends.
"""

from __future__ import annotations

import mmap
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

SLOTS = 32
WIDTH = 1024


class Running(NamedTuple):
    """A node that was at work: its path and the id of its processor."""

    path: str
    type: str


class Marks:
    """The file of one engine. Nodes beyond as many as it has slots for are not marked."""

    def __init__(self, file: Path) -> None:
        self.file = file
        file.parent.mkdir(parents=True, exist_ok=True)
        with open(file, "wb+") as opened:
            opened.write(bytes(SLOTS * WIDTH))
            opened.flush()
            self._map = mmap.mmap(opened.fileno(), SLOTS * WIDTH)
        self._lock = threading.Lock()
        self._free = list(range(SLOTS))

    @contextmanager
    def running(self, path: str, type: str) -> Iterator[None]:
        """Mark a node while its code runs. Any thread."""
        with self._lock:
            slot = self._free.pop() if self._free else -1
        start = slot * WIDTH
        if slot >= 0:
            self._map[start : start + WIDTH] = f"{path}\0{type}".encode()[: WIDTH - 1].ljust(WIDTH, b"\0")
        try:
            yield
        finally:
            if slot >= 0:
                self._map[start : start + 1] = b"\0"
                with self._lock:
                    self._free.append(slot)

    def close(self) -> None:
        """End in order: nothing runs, and no file is left. What still runs goes on unmarked."""
        self.file.unlink(missing_ok=True)


def left_in(file: Path) -> list[Running]:
    """What ran when the process that marked a file ended. A file that is not there says nothing."""
    try:
        data = file.read_bytes()
    except OSError:
        return []
    slots = (data[start : start + WIDTH].decode(errors="replace") for start in range(0, len(data), WIDTH))
    parts = [slot.split("\0") for slot in slots]
    return sorted({Running(path, type) for path, type, *_ in parts if path})
