"""A widget that shows a picture, fitted or zoomed, and says which of its pixels the cursor is over."""

from __future__ import annotations

import math
from collections.abc import Callable

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QImage, QMouseEvent, QPainter, QPaintEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from nodegraph.editor.views.shown import VIEWPORT

STEP = 1.2
"""How much a notch of the wheel zooms."""


class PictureArea(QWidget):
    """Shows a picture.

    zooming: whether the wheel zooms to the cursor and a drag pans; without it the mouse is left to somebody else.
    `hovered` sends (column, row) of the pixel under the cursor, or None outside. ``note``: a sentence in its middle.
    overlays: what draws over the picture, in the widget's own pixels.
    """

    hovered = Signal(object)
    moved = Signal()

    def __init__(self, parent: QWidget | None = None, *, zooming: bool = True) -> None:
        super().__init__(parent)
        self.zooming = zooming
        self.picture: QImage | None = None
        self.note = ""
        self.overlays: list[Callable[[QPainter], object]] = []
        self._scale = 0.0  # 0: fitted
        self._middle = QPointF()  # the point of the picture in the middle, in its pixels
        self._grabbed: QPointF | None = None
        self.setMouseTracking(True)
        self.setMinimumSize(64, 48)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)

    def sizeHint(self) -> QSize:
        return QSize(480, 360)

    # -- what it shows --------------------------------------------------------------------------------------------

    def show_picture(self, picture: QImage | None) -> None:
        """Show a picture, or nothing. Zoom and place stay where its size stays."""
        if picture is not None and (self.picture is None or picture.size() != self.picture.size()):
            self._middle = QPointF(picture.width() / 2, picture.height() / 2)
        self.picture = picture
        self.update()

    def show_note(self, note: str) -> None:
        """Say something over the picture, which is dimmed then; nothing where the note is empty."""
        if note != self.note:
            self.note = note
            self.update()

    def fit(self) -> None:
        """Show all of the picture, as large as there is room."""
        self._scale = 0.0
        if self.picture is not None:
            self._middle = QPointF(self.picture.width() / 2, self.picture.height() / 2)
        self._moved()

    def actual_size(self) -> None:
        """Show one pixel of the picture as one pixel of the screen."""
        self._scale = 1.0 / self.devicePixelRatioF()
        self._moved()

    @property
    def scale(self) -> float:
        """Size of a pixel of the picture in the widget's pixels."""
        if self._scale:
            return self._scale
        if self.picture is None or self.picture.isNull():
            return 1.0
        return min(self.width() / self.picture.width(), self.height() / self.picture.height())

    def zoom(self, factor: float, at: QPointF) -> None:
        """Enlarge by a factor; the point of the picture at a place of the widget stays there."""
        fixed = self.to_picture(at)
        self._scale = min(max(self.scale * factor, 1 / 64), 64.0)
        offset = at - QPointF(self.width() / 2, self.height() / 2)
        self._middle = fixed - offset / self._scale
        self._moved()

    def place(self, scale: float, middle: QPointF) -> None:
        """Show the same part as another area does."""
        self._scale, self._middle = scale, QPointF(middle)
        self.update()

    @property
    def placed(self) -> tuple[float, QPointF]:
        """What `place` takes."""
        return self._scale, QPointF(self._middle)

    # -- places ---------------------------------------------------------------------------------------------------

    def target(self) -> QRectF:
        """The rectangle of the widget that the picture covers."""
        if self.picture is None:
            return QRectF()
        scale = self.scale
        middle = self._middle if self._scale else QPointF(self.picture.width() / 2, self.picture.height() / 2)
        corner = QPointF(self.width() / 2, self.height() / 2) - middle * scale
        return QRectF(corner.x(), corner.y(), self.picture.width() * scale, self.picture.height() * scale)

    def to_picture(self, at: QPointF) -> QPointF:
        """A place of the widget in pixels of the picture."""
        return (at - self.target().topLeft()) / self.scale

    def pixel_at(self, at: QPointF) -> tuple[int, int] | None:
        """Column and row of the pixel under a place of the widget, or None outside of the picture."""
        if self.picture is None:
            return None
        place = self.to_picture(at)
        column, row = math.floor(place.x()), math.floor(place.y())
        inside = 0 <= column < self.picture.width() and 0 <= row < self.picture.height()
        return (column, row) if inside else None

    # -- events ---------------------------------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(VIEWPORT))
        if self.picture is not None:
            scale = self.scale * self.devicePixelRatioF()
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform, scale < 2.0 and scale != 1.0)
            painter.drawImage(self.target(), self.picture)
            for overlay in self.overlays:
                painter.save()
                overlay(painter)
                painter.restore()
        if self.note:
            self._paint_note(painter)

    def _paint_note(self, painter: QPainter) -> None:
        painter.fillRect(self.rect(), QColor(0, 0, 0, 120) if self.picture is not None else Qt.GlobalColor.transparent)
        painter.setPen(QColor(240, 240, 240) if self.picture is not None else QColor(150, 156, 165))
        room = self.rect().adjusted(24, 24, -24, -24)
        painter.drawText(room, Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, self.note)

    def resizeEvent(self, event: QResizeEvent) -> None:
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if not self.zooming:
            event.ignore()
        elif event.button() in (Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton):
            self._grabbed = event.position()
            self.setCursor(Qt.CursorShape.ClosedHandCursor)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._grabbed is not None:
            scale = self.scale
            if not self._scale:
                self._scale = scale
            self._middle -= (event.position() - self._grabbed) / scale
            self._grabbed = event.position()
            self._moved()
        self.hovered.emit(self.pixel_at(event.position()))
        if not self.zooming:
            event.ignore()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._grabbed = None
        self.unsetCursor()
        if not self.zooming:
            event.ignore()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if self.zooming:
            self.fit()
        else:
            event.ignore()

    def wheelEvent(self, event: QWheelEvent) -> None:
        if not self.zooming:
            event.ignore()
            return
        self.zoom(STEP ** (event.angleDelta().y() / 120.0), event.position())
        self.hovered.emit(self.pixel_at(event.position()))

    def leaveEvent(self, event: object) -> None:
        self.hovered.emit(None)

    def _moved(self) -> None:
        self.update()
        self.moved.emit()
