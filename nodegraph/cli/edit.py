"""Open the visual editor, with a workspace, a picture that carries one, data files to begin with, or nothing."""

from __future__ import annotations

import argparse
from pathlib import Path

from nodegraph.errors import CommandError


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("files", metavar="FILE", nargs="*", help="workspace, picture, or volumes")
    parser.add_argument("--device", choices=("auto", "gl", "cl", "cl64"), default="auto", help="what renders")
    parser.add_argument(
        "--unguarded", action="store_true", help="without the process that brings it back after a crash"
    )
    parser.add_argument("--after", type=int, metavar="PROCESS", help=argparse.SUPPRESS)


def run(arguments: argparse.Namespace) -> int:
    files = [Path(file) for file in arguments.files]
    for file in files:
        if not file.exists():
            raise CommandError(f"{file}: there is no such file; nodegraph edit without one begins anew")
    if not arguments.unguarded:
        from nodegraph.editor import guard

        return guard.run([*arguments.files], arguments.device)
    try:
        from nodegraph.editor import app
    except ImportError as error:
        raise CommandError(f"edit: the editor needs PySide6 ({error}); pip install 'nodegraph[editor]'") from None
    return app.run(files, arguments.device, after=arguments.after)
