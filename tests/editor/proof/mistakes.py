"""What goes wrong where nobody would notice."""

from __future__ import annotations

import sys
import threading
import traceback

from PySide6.QtCore import QtMsgType, qInstallMessageHandler

OURS = ("This plugin does not support", "Mouse event at")
"""What the platform without a screen, and the mouse that these tests move, say of themselves."""


class Mistakes:
    """Everything that is raised where nobody catches it, or that Qt complains of, while this is open."""

    def __init__(self) -> None:
        self.heard: list[str] = []

    def __enter__(self) -> Mistakes:
        self._hook, self._threads = sys.excepthook, threading.excepthook
        sys.excepthook = lambda *error: self.heard.append("".join(traceback.format_exception(*error)))
        threading.excepthook = lambda told: self.heard.append(
            "".join(traceback.format_exception(told.exc_type, told.exc_value, told.exc_traceback))
        )
        self._messages = qInstallMessageHandler(self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        sys.excepthook, threading.excepthook = self._hook, self._threads
        qInstallMessageHandler(self._messages)

    def _hear(self, kind: QtMsgType, _context: object, text: str) -> None:
        if kind in (QtMsgType.QtWarningMsg, QtMsgType.QtCriticalMsg, QtMsgType.QtFatalMsg):
            if not text.startswith(OURS):
                self.heard.append(f"Qt: {text}")
