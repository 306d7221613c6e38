"""Starting the editor."""

from __future__ import annotations

import faulthandler
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QByteArray, Qt, QTimer
from PySide6.QtWidgets import QApplication

from nodegraph.editor import theme
from nodegraph.editor.offers import is_workspace
from nodegraph.editor.recovering import offer, recover
from nodegraph.editor.recovery import lost_documents
from nodegraph.editor.session import Session
from nodegraph.editor.settings import Settings
from nodegraph.editor.shader_editor.copying import use_own_folder
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


def open_window(
    files: Sequence[Path] = (), device: str = "auto", settings: Settings | None = None, *, after: int | None = None
) -> Window:
    """Make the window and show it: with a workspace or data files, or with the page that offers some.

    ``after``: the number of the process that crashed; what it had open is open again.
    """
    app = application()
    use_own_folder()
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
    crashed = lost_documents(process=after) if after is not None else []
    for lost in crashed[:1]:
        recover(window, lost)
    offer(window, lost_documents())
    return window


def run(files: Sequence[Path] = (), device: str = "auto", *, after: int | None = None) -> int:
    """Run the editor until its window closes."""
    faulthandler.enable()  # where native code crashes, the terminal shows what Python was doing
    app = application()
    window = open_window(files, device, after=after)
    # Who ends it from outside is not asked anything; what was not saved lies aside.
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    # Python hears Ctrl-C only when it is awake.
    signal.signal(signal.SIGINT, lambda *_: window.close())
    awake = QTimer()
    awake.timeout.connect(lambda: None)
    awake.start(200)
    return int(app.exec())


__all__ = ["application", "open_window", "run"]
