"""A Python prompt on the open document: ``net``, ``view`` and ``selection``."""

from __future__ import annotations

import code
import contextlib
import io
import sys
import traceback
from typing import Any

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QFontDatabase, QKeyEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QLineEdit, QPlainTextEdit, QVBoxLayout, QWidget

from nodegraph.editor.session import Session

GREETING = """net, view, selection and session are there; an edit of net is an edit of the document, and can be undone.
For example: net["raycast"].step = 0.5
"""


class _Interpreter(code.InteractiveConsole):
    def showtraceback(self) -> None:
        """A mistake at the prompt is text at the prompt, whoever listens to the program's own mistakes."""
        kind, error, trace = sys.exc_info()
        frames = trace.tb_next if trace is not None else None  # the first frame is the interpreter
        self.write("".join(traceback.format_exception(kind, error, frames)))


class Console(QWidget):
    """What was typed and what it printed, above a line to type. The arrows bring earlier lines back."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.interpreter = _Interpreter()
        self._past: list[str] = []
        self._place = 0
        fixed = QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont)
        self.output = QPlainTextEdit()
        self.output.setReadOnly(True)
        self.output.setFont(fixed)
        self.output.setMaximumBlockCount(5000)
        self.output.document().setDocumentMargin(8)
        self.output.setPlainText(GREETING)
        self.prompt = QLabel(">>>")
        self.prompt.setFont(fixed)
        self.line = QLineEdit()
        self.line.setObjectName("search")
        self.line.setFont(fixed)
        self.line.setAccessibleName("Python")
        self.line.installEventFilter(self)
        self.line.returnPressed.connect(self.enter)
        row = QHBoxLayout()
        row.setContentsMargins(8, 6, 8, 6)
        row.setSpacing(8)
        row.addWidget(self.prompt)
        row.addWidget(self.line)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(self.output, 1)
        layout.addLayout(row)

    def names(self) -> dict[str, Any]:
        """What the prompt knows of the document as it is now."""
        net = self.session.network
        views = [node.path for node in net.walk() if node.type == "output.view"]
        return {
            "net": net,
            "session": self.session,
            "selection": [net[path] for path in self.session.selection],
            "view": net[views[0]] if views else None,
        }

    def enter(self) -> None:
        """Run the line. All that it edits is one undo step."""
        text = self.line.text()
        self.line.clear()
        if text.strip():
            self._past.append(text)
        self._place = len(self._past)
        self.output.appendPlainText(f"{self.prompt.text()} {text}")
        told = io.StringIO()
        self.interpreter.locals |= self.names()
        with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
            try:
                with self.session.gesture("console"):
                    more = self.interpreter.push(text)
            except SystemExit:
                more = False
                self.interpreter.resetbuffer()
                told.write("close the window to leave\n")
        if told.getvalue():
            self.output.appendPlainText(told.getvalue().rstrip("\n"))
        self.prompt.setText("..." if more else ">>>")
        self.output.ensureCursorVisible()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if watched is self.line and isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            step = {Qt.Key.Key_Up: -1, Qt.Key.Key_Down: 1}.get(Qt.Key(event.key()))
            if step is not None and self._past:
                self._place = max(0, min(len(self._past), self._place + step))
                self.line.setText(self._past[self._place] if self._place < len(self._past) else "")
                return True
        return super().eventFilter(watched, event)
