"""Open the visual editor, with a workspace, a picture that carries one, or nothing."""

from __future__ import annotations

import argparse
from pathlib import Path

from nodegraph.errors import CommandError


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", nargs="?", help="workspace or picture")
    parser.add_argument("--device", choices=("auto", "gl", "cl", "cl64"), default="auto", help="what renders")


def run(arguments: argparse.Namespace) -> int:
    file = Path(arguments.file) if arguments.file else None
    if file is not None and not file.is_file():
        raise CommandError(f"{file}: there is no such file; nodegraph edit without one begins anew")
    try:
        from nodegraph.editor import app
    except ImportError as error:
        raise CommandError(f"edit: the editor needs PySide6 ({error}); pip install 'nodegraph[editor]'") from None
    return app.run(file, arguments.device)
