"""Where presets come from: the user's own files, those that come with the program, and installed packages.

A preset is a JSON object with ``name``, ``kind`` (of parameter) and ``value``, encoded as in a workspace; a file holds
one, or a list of them. An entry point ``nodegraph.presets`` gives the same, or a function without arguments that does.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from nodegraph import plugins
from nodegraph.editor.settings import config_folder

FOLDER = Path(__file__).parents[1] / "presets"
"""Those that come with the program."""


def own_folder() -> Path:
    """Where presets lie that the user saved."""
    return config_folder() / "presets"


def own_file(*words: str) -> Path:
    """The file of a preset of the user's own, named by some words."""
    safe = (re.sub(r"[^A-Za-z0-9_-]+", "_", word).strip("_") for word in words)
    return own_folder() / f"{'-'.join(word for word in safe if word) or 'preset'}.json"


def write(described: Any, file: Path) -> None:
    """Write presets as JSON; the file is whole at any time. Raises OSError."""
    file.parent.mkdir(parents=True, exist_ok=True)
    beside = file.with_name(f"{file.name}.tmp")
    beside.write_text(json.dumps(described, indent=1), encoding="utf-8")
    os.replace(beside, file)


def described(refused: dict[str, str]) -> Iterator[tuple[str, Any, Path | None]]:
    """Everything that is offered: where it comes from, what should be a preset, and its file if it is the user's own.

    What cannot be read is put into ``refused`` with the reason.
    """
    own = sorted(own_folder().glob("*.json"))
    for file in (*own, *sorted(FOLDER.glob("*.json"))):
        try:
            listed = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError) as error:
            refused[file.name] = str(error)
            continue
        for one in listed if isinstance(listed, list) else [listed]:
            name = one.get("name", "") if isinstance(one, dict) else ""
            yield f"{file.name}/{name}", one, file if file in own else None
    for plugin in plugins.discover("nodegraph.presets"):
        if plugin.reason:
            refused[plugin.name] = plugin.reason
            continue
        try:
            offered = plugin.object() if callable(plugin.object) else plugin.object
        except Exception as error:
            refused[plugin.name] = plugins.explain_failure(error)
            continue
        for one in offered if isinstance(offered, (list, tuple)) else [offered]:
            yield plugin.name, one, None
