"""Two pictures in one place: beside each other, one drawn over the other, or one alone."""

from __future__ import annotations

from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QKeyEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from nodegraph.editor.views.shown import VIEWPORT

GRIP = 8
KEY_STEP = 0.02


class Curtain(QWidget):
    """Two pictures beside each other, or the one drawn over the other as far as the grip is pulled."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.mode = "side"
        self.split = 0.5
        self.note = ""
        self.names = ("A", "B")
        self._pictures: tuple[QImage | None, QImage | None] = (None, None)
        self.setMinimumSize(96, 64)
        self.setMouseTracking(True)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)

    def show_pictures(self, mode: str, a: QImage | None, b: QImage | None) -> None:
        """Show two pictures in a mode of `CompareView`."""
        self.mode, self._pictures = mode, (a, b)
        self.setCursor(Qt.CursorShape.SplitHCursor if mode == "wipe" else Qt.CursorShape.ArrowCursor)
        self.update()

    def show_note(self, note: str) -> None:
        """Say something where there is no picture; nothing where the note is empty."""
        if note != self.note:
            self.note = note
            self.update()

    def pull(self, split: float) -> None:
        """Draw the curtain to a share of the width."""
        self.split = min(max(split, 0.0), 1.0)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.fillRect(self.rect(), QColor(VIEWPORT))
        whole = QRectF(self.rect())
        a, b = self._pictures
        if self.mode == "side":
            half = whole.width() / 2
            self._draw(painter, a, QRectF(0, 0, half - 1, whole.height()), "A")
            self._draw(painter, b, QRectF(half + 1, 0, half - 1, whole.height()), "B")
        elif self.mode == "wipe":
            place = whole.width() * self.split
            painter.setClipRect(QRectF(0, 0, place, whole.height()))
            self._draw(painter, a, whole, "A")
            painter.setClipRect(QRectF(place, 0, whole.width() - place, whole.height()))
            self._draw(painter, b, whole, "B", right=True)
            painter.setClipping(False)
            painter.setPen(QColor(255, 255, 255, 200))
            painter.drawLine(QLineF(place, 0, place, whole.height()))
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setBrush(QColor(255, 255, 255, 230))
            painter.setPen(QColor(0, 0, 0, 120))
            painter.drawEllipse(QPointF(place, whole.height() / 2), GRIP, GRIP)
        else:
            self._draw(painter, a, whole, "")
        if self.note:
            painter.setPen(QColor(200, 204, 210))
            right = whole.adjusted(whole.width() / 2, 0, 0, 0) if self.mode == "side" and a is not None else whole
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(right.adjusted(24, 24, -24, -24), flags, self.note)

    def _draw(self, painter: QPainter, picture: QImage | None, room: QRectF, letter: str, right: bool = False) -> None:
        if picture is not None and not picture.isNull():
            scale = min(room.width() / picture.width(), room.height() / picture.height())
            size = (picture.width() * scale, picture.height() * scale)
            corner = room.center() - QPointF(size[0] / 2, size[1] / 2)
            painter.drawImage(QRectF(corner.x(), corner.y(), *size), picture)
        if letter:
            tag = QRectF(room.right() - 30 if right else room.left() + 8, room.top() + 8, 22, 22)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(0, 0, 0, 150))
            painter.drawRoundedRect(tag, 4, 4)
            painter.setPen(QColor(255, 255, 255))
            painter.drawText(tag, Qt.AlignmentFlag.AlignCenter, letter)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._pull(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        self._pull(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        step = {Qt.Key.Key_Left: -KEY_STEP, Qt.Key.Key_Right: KEY_STEP}.get(Qt.Key(event.key()))
        if self.mode == "wipe" and step is not None:
            self.pull(self.split + step)
        else:
            super().keyPressEvent(event)

    def _pull(self, event: QMouseEvent) -> None:
        if self.mode == "wipe" and event.buttons() & Qt.MouseButton.LeftButton:
            self.pull(event.position().x() / max(self.width(), 1))
