"""Running a piece of Python in a fresh interpreter."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from typing import Any


def child(code: str, *arguments: str) -> Any:
    """Run ``code`` with ``sys.argv[1:]`` as given and return the JSON in the last line that it prints."""
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, env=environment())
    if done.returncode != 0:
        raise SystemExit(f"a measured program failed:\n{done.stdout}\n{done.stderr}")
    return json.loads(done.stdout.strip().splitlines()[-1])


def run(command: Sequence[str]) -> None:
    """Run a command to its end; what it prints is dropped."""
    done = subprocess.run(command, capture_output=True, text=True, env=environment())
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)} failed:\n{done.stdout}\n{done.stderr}")


def environment() -> dict[str, str]:
    """The environment without what would make two runs differ, or every run compile all modules again."""
    return {
        name: value
        for name, value in os.environ.items()
        if not name.startswith("NODEGRAPH_") and name != "PYTHONDONTWRITEBYTECODE"
    }
