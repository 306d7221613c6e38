"""Runs the editor in a process of its own and brings it back when native code takes it down.

This process only waits: it loads no Qt and no engine. The editor leaves behind what it has to (see recovery), and is
started again with the number of the process that crashed. Two crashes in a row, soon after the start, end it: the
next start by hand offers the document.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from nodegraph.editor.settings import config_folder

COMMAND = [sys.executable, "-m", "nodegraph"]
SOON = 20.0
"""Seconds after its start within which a crash counts as one of starting."""
_FAULTS = ("SIGSEGV", "SIGABRT", "SIGBUS", "SIGILL", "SIGFPE", "SIGTRAP", "SIGSYS")


def run(files: Sequence[str], device: str) -> int:
    """Run ``nodegraph edit`` until it ends in order; returns what it returned."""
    what = ["--", *files]
    early = 0
    while True:
        started = time.monotonic()
        editor = subprocess.Popen([*COMMAND, "edit", "--unguarded", "--device", device, *what])
        code = _wait(editor)
        if not crashed(code):
            return code if code >= 0 else 128 - code
        if not any(recovery_folder().glob(f"{editor.pid}-*")):
            return 1  # no window had come up, so there is nothing to bring back; Qt has said why
        early = early + 1 if time.monotonic() - started < SOON else 0
        if early > 1:
            print("nodegraph edit: it crashed twice in a row; start it again to recover what was open", file=sys.stderr)
            return 1
        print("nodegraph edit: it crashed and comes back with what was open", file=sys.stderr)
        what = ["--after", str(editor.pid)]


def recovery_folder() -> Path:
    """Where editors leave behind what was open, in files that begin with the number of their process."""
    return config_folder() / "recovery"


def crashed(code: int) -> bool:
    """Whether a process ended by a fault of native code; whoever is asked to end, or killed, did not crash."""
    if os.name == "nt":
        return (code & 0xFFFFFFFF) >= 0xC0000000 and (code & 0xFFFFFFFF) != 0xC000013A  # Ctrl-C
    return -code in {getattr(signal, name) for name in _FAULTS if hasattr(signal, name)}


def _wait(editor: subprocess.Popen[bytes]) -> int:
    """Wait, and hand on the wish to end. Ctrl-C reaches the editor by itself."""
    handed_on = {signal.SIGTERM, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else [])}
    before = {one: signal.signal(one, lambda number, _frame: editor.send_signal(number)) for one in handed_on}
    before[signal.SIGINT] = signal.signal(signal.SIGINT, lambda *_: None)
    try:
        return editor.wait()
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
