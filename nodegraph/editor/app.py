"""Starting the editor."""

from __future__ import annotations

import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QByteArray, Qt, QTimer
from PySide6.QtWidgets import QApplication

from nodegraph.editor import theme
from nodegraph.editor.offers import is_workspace
from nodegraph.editor.recovery import lost_documents
from nodegraph.editor.session import Session
from nodegraph.editor.settings import Settings
from nodegraph.editor.window import Window
from nodegraph.engine import Engine


def application() -> QApplication:
    """The program's one QApplication, made on first use."""
    app = QApplication.instance()
    if not isinstance(app, QApplication):
        app = QApplication(sys.argv[:1])
        app.setApplicationName("nodegraph")
        app.setDesktopFileName("nodegraph")
    return app


def open_window(files: Sequence[Path] = (), device: str = "auto", settings: Settings | None = None) -> Window:
    """Make the window and show it: with a workspace or data files, or with the page that offers some."""
    app = application()
    settings = settings if settings is not None else Settings()
    chosen = settings.get("theme", "system")
    theme.apply(app, chosen if chosen in theme.THEMES else "system")
    window = Window(Session(engine=Engine(device)), settings)
    window.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    geometry = settings.get("geometry")
    if isinstance(geometry, str):
        window.restoreGeometry(QByteArray.fromBase64(geometry.encode()))
    window.show()
    if not any(is_workspace(file) for file in files):
        window.show_welcome()
    window.open_files(list(files))
    window.offer(lost_documents())
    return window


def run(files: Sequence[Path] = (), device: str = "auto") -> int:
    """Run the editor until its window closes."""
    app = application()
    window = open_window(files, device)
    # Python hears Ctrl-C only when it is awake.
    signal.signal(signal.SIGINT, lambda *_: window.close())
    awake = QTimer()
    awake.timeout.connect(lambda: None)
    awake.start(200)
    return int(app.exec())


__all__ = ["application", "open_window", "run"]
