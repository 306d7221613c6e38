"""The line at the bottom that says what happens, and the banner at the top that asks."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QMainWindow,
    QProgressBar,
    QPushButton,
    QStatusBar,
    QToolBar,
)

from nodegraph.editor.profile import seconds_text
from nodegraph.editor.session import Message, Session
from nodegraph.report import Report

SOON = 250
"""Milliseconds before running work is spoken of: what is quick would only flicker."""


class Status(QStatusBar):
    """What runs and how far it is; else how long the last evaluation took. On the right, the device."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.text = QLabel("Ready")
        self.bar = QProgressBar()
        self.bar.setFixedSize(140, 6)
        self.bar.setTextVisible(False)
        self.bar.setRange(0, 1000)
        self.bar.hide()
        self.device = QLabel()
        self.addWidget(self.text, 1)
        self.addPermanentWidget(self.bar)
        self.addPermanentWidget(self.device)
        self.setSizeGripEnabled(False)
        self._running = ""
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.setInterval(SOON)
        self._soon.timeout.connect(self._speak)
        session.started.connect(self._start)
        session.progressed.connect(self._progress)
        session.answered.connect(self._answered)
        session.message.connect(self._hear)
        session.replaced.connect(lambda: self._end(Report()))

    def _start(self, path: str) -> None:
        self._running = path
        self.bar.setValue(0)
        if self.bar.isVisible():
            self._speak()
        elif not self._soon.isActive():
            self._soon.start()

    def _answered(self, channel: object, report: Report) -> None:
        if self.session.watches(channel):
            self._end(report)

    def _progress(self, path: str, fraction: float, text: str) -> None:
        if path == self._running:
            self.bar.setValue(round(fraction * 1000))
            if self.bar.isVisible() and text:
                self.text.setText(f"{path}: {text}")

    def _speak(self) -> None:
        self.bar.show()
        self.text.setText(f"Computing {self._running} ...")

    def _end(self, report: Report) -> None:
        self._soon.stop()
        self.bar.hide()
        total = sum(report.timings.get(path, 0.0) for path in report.states)
        if report.errors:
            count = len(report.errors)
            self.text.setText(f"{count} node{'s' * (count > 1)} cannot run, see Messages")
        else:
            self.text.setText(f"Computed in {seconds_text(total)}" if total else "Ready")
        device = self.session.engine.device_in_use
        if device is not None:
            self.device.setText(device["name"])
            self.device.setToolTip(f"{device['description']}: {device['reason']}")

    def _hear(self, message: Message) -> None:
        if message.level == "info":
            self.text.setText(message.text)


class Banner(QToolBar):
    """A question over the whole window that stops nobody."""

    def __init__(self, window: QMainWindow) -> None:
        super().__init__("Banner", window)
        self.setObjectName("banner")
        self.setMovable(False)
        self.frame = QFrame()
        self.frame.setObjectName("banner")
        self.row = QHBoxLayout(self.frame)
        self.row.setContentsMargins(10, 4, 6, 4)
        self.row.setSpacing(8)
        self.text = QLabel()
        self.row.addWidget(self.text, 1)
        self.addWidget(self.frame)
        self.buttons: dict[str, QPushButton] = {}
        window.addToolBarBreak()
        window.addToolBar(self)
        self.toggleViewAction().setEnabled(False)
        self.hide()

    def offer(self, text: str, answers: Mapping[str, Callable[[], object]]) -> None:
        """Ask; an answer takes the banner away."""
        for button in self.buttons.values():
            button.deleteLater()
        self.buttons.clear()
        self.text.setText(text)
        for words, act in answers.items():
            button = self.buttons[words] = QPushButton(words)
            button.clicked.connect(lambda _=False, act=act: self._answer(act))
            self.row.addWidget(button)
        self.show()

    def _answer(self, act: Callable[[], object]) -> None:
        self.hide()
        act()
