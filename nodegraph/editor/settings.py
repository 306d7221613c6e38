"""What the editor remembers between sessions: recent files, the theme, the size of its window."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

RECENT = 12


def config_folder() -> Path:
    """Where settings lie: NODEGRAPH_CONFIG, or the user's folder for configuration."""
    named = os.environ.get("NODEGRAPH_CONFIG")
    if named:
        return Path(named)
    import platformdirs

    return Path(platformdirs.user_config_dir("nodegraph", appauthor=False))


class Settings:
    """A small JSON file, read once and written at every change. One that cannot be read or written is done without."""

    def __init__(self, folder: Path | None = None) -> None:
        self.file = (folder if folder is not None else config_folder()) / "editor.json"
        self._values: dict[str, Any] = {}
        try:
            found = json.loads(self.file.read_text(encoding="utf-8"))
            self._values = found if isinstance(found, dict) else {}
        except (OSError, ValueError):
            pass  # the first start, or a file that somebody damaged: begin anew

    def get(self, key: str, default: Any = None) -> Any:
        return self._values.get(key, default)

    def set(self, key: str, value: Any) -> None:
        """Remember a value."""
        if self._values.get(key) == value:
            return
        self._values[key] = value
        beside = self.file.with_suffix(".tmp")
        # Where the home may not be written, settings hold until the editor is closed.
        with suppress(OSError):
            self.file.parent.mkdir(parents=True, exist_ok=True)
            beside.write_text(json.dumps(self._values, indent=1), encoding="utf-8")
            os.replace(beside, self.file)

    @property
    def recent(self) -> list[Path]:
        """Files that were opened or saved, the latest first, as far as they are still there."""
        named = self._values.get("recent", [])
        return [Path(name) for name in named if isinstance(name, str) and os.path.isfile(name)]

    def add_recent(self, path: Path) -> None:
        """Put a file in front."""
        text = str(path)
        others = [str(one) for one in self.recent if str(one) != text]
        self.set("recent", [text, *others][:RECENT])
