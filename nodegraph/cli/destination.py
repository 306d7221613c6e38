"""Where the pictures of a run go: ``OUT/<node>.png``, or one file."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from nodegraph.cli.arguments import UsageError

SUFFIXES = (".png", ".exr")
OTHER_PICTURES = (".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".gif", ".webp", ".ppm", ".tga", ".hdr")


class Destination:
    """OUT of a command line. Raises UsageError where nothing can be written, and for one file of several views."""

    def __init__(self, out: str, views: Sequence[str]) -> None:
        self.path = Path(out)
        suffix = self.path.suffix.lower()
        self.is_file = suffix in SUFFIXES and not self.path.is_dir()
        if suffix in OTHER_PICTURES and not self.path.is_dir():
            raise UsageError(f"--out {out}: pictures are written as .png or .exr, not {suffix}")
        require_room(out, self.path.parent if self.is_file else self.path)
        if self.is_file and len(views) != 1:
            listed = f"{len(views)} views ({', '.join(views)})" if views else "no view"
            raise UsageError(
                f"--out {out}: a file needs exactly one view, and there are {listed}; name one with --view"
            )

    def file_for(self, name: str) -> Path:
        """The file of one picture. Groups join with points: ``finish.view.png``."""
        return self.path if self.is_file else self.path / f"{name.replace('/', '.')}.png"


def require_room(out: str, folder: Path) -> None:
    """Refuse a folder in which nothing can be written now, and not after an hour of rendering. Raises UsageError."""
    folder = Path(os.path.realpath(folder))
    while not os.path.lexists(folder):
        folder = folder.parent
    if not folder.is_dir():
        raise UsageError(f"--out {out}: {folder} is no folder; choose another place")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"--out {out}: the folder {folder} cannot be written to; choose one of yours")
