"""A strip over the lower edge of a picture that says what is computed for it, and how far that is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QObject, QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPalette
from PySide6.QtWidgets import QWidget

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

SOON = 250
"""Milliseconds before running work is spoken of: what is quick would only flicker."""
HEIGHT, BAR = 24, 3


class ProgressStrip(QWidget):
    """Lies on its parent, and lets the mouse through to it; hidden while nothing takes long for its channel."""

    def __init__(self, session: Session, channel: object, parent: QWidget) -> None:
        super().__init__(parent)
        self.session = session
        self.text = ""
        self.fraction = 0.0
        self._channel, self._area = channel, parent
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self._soon = QTimer(self, singleShot=True, interval=SOON)
        self._soon.timeout.connect(self._appear)
        for signal in (session.started, session.progressed, session.states_changed, session.answered):
            signal.connect(self._look)
        parent.installEventFilter(self)
        self.hide()

    def _look(self, *_: object) -> None:
        running = self.session.running(self._channel)
        if running is None:
            self._soon.stop()
            self.hide()
            return
        told = [running.path]
        if running.fraction > 0.0:
            told.append(f"{running.fraction:.0%}")
        if running.text:
            told.append(running.text)
        text = "  ·  ".join(told)
        if (text, running.fraction) != (self.text, self.fraction):
            self.text, self.fraction = text, running.fraction
            self.setAccessibleName(text)
            self.update()
        if self.isHidden() and not self._soon.isActive():
            self._soon.start()

    def _appear(self) -> None:
        self._settle()
        self.show()
        self.raise_()

    def _settle(self) -> None:
        room = self._area.rect()
        self.setGeometry(0, room.height() - HEIGHT, room.width(), HEIGHT)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.Resize:
            self._settle()
        return False

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(0, 0, 0, 130))
        painter.setPen(QColor(235, 235, 235))
        line = QRectF(self.rect()).adjusted(8, 0, -8, -BAR)
        text = self.fontMetrics().elidedText(self.text, Qt.TextElideMode.ElideRight, int(line.width()))
        painter.drawText(line, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, text)
        done = QRectF(0, self.height() - BAR, self.width() * min(max(self.fraction, 0.0), 1.0), BAR)
        painter.fillRect(done, self.palette().color(QPalette.ColorRole.Highlight))
