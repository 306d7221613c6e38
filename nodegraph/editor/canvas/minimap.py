"""The whole level in a corner, with what is seen of it. A press or drag moves there."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen, QPixmap
from PySide6.QtWidgets import QWidget

from nodegraph.editor.canvas.view import GraphView

SIZE = QSize(180, 120)


class Minimap(QWidget):
    """Lies on a canvas and hides while everything is seen anyway."""

    def __init__(self, view: GraphView) -> None:
        super().__init__(view)
        self.view = view
        self.wanted = True
        self._area = QRectF()
        self._content = QRectF()
        self._picture: QPixmap | None = None
        # Several things change at once; they are painted together.
        self._soon = QTimer(self, singleShot=True, interval=50)
        self._soon.timeout.connect(self.renew)
        self.resize(SIZE)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setToolTip("The whole network. Press or drag to move there.")
        self.hide()

    def renew_soon(self, *_: object) -> None:
        """Paint anew in a moment."""
        if not self._soon.isActive():
            self._soon.start()

    def renew(self) -> None:
        """Nodes moved, came, went, or stand otherwise: paint them anew."""
        self._picture = None
        self._content = self.view.canvas_scene.content()
        self.refresh()

    def refresh(self) -> None:
        """Show what is seen now."""
        content, seen = self._content, self.view.seen()
        area = content.united(seen)
        if area != self._area:
            self._area = area
            self._picture = None
        needed = self.wanted and not content.isEmpty() and not seen.contains(content)
        room = self.view.width() > 2.5 * SIZE.width() and self.view.height() > 2.5 * SIZE.height()
        self.setVisible(needed and room)
        self.move(self.view.width() - self.width() - 12, self.view.height() - self.height() - 12)
        self.update()

    def _scale(self) -> float:
        return min((self.width() - 12) / self._area.width(), (self.height() - 12) / self._area.height())

    def _origin(self) -> QPointF:
        scale = self._scale()
        return QPointF(
            (self.width() - scale * self._area.width()) / 2 - scale * self._area.left(),
            (self.height() - scale * self._area.height()) / 2 - scale * self._area.top(),
        )

    def _shown(self, rect: QRectF) -> QRectF:
        scale = self._scale()
        return QRectF(self._origin() + rect.topLeft() * scale, rect.size() * scale)

    def paintEvent(self, event: QPaintEvent) -> None:
        if self._area.isEmpty():
            return
        if self._picture is None:
            self._picture = self._paint_nodes()
        painter = QPainter(self)
        painter.drawPixmap(0, 0, self._picture)
        painter.setPen(QPen(self.view.canvas_scene.look.accent, 1.5))
        painter.drawRect(self._shown(self.view.seen()).intersected(QRectF(1, 1, self.width() - 2, self.height() - 2)))

    def _paint_nodes(self) -> QPixmap:
        """Everything but the rectangle that is seen."""
        scene, look = self.view.canvas_scene, self.view.canvas_scene.look
        ratio = self.devicePixelRatioF()
        picture = QPixmap(self.size() * ratio)
        picture.setDevicePixelRatio(ratio)
        picture.fill(Qt.GlobalColor.transparent)
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        ground = QColor(look.header)
        ground.setAlpha(225)
        painter.setPen(QPen(look.border, 1))
        painter.setBrush(ground)
        painter.drawRoundedRect(QRectF(0.5, 0.5, self.width() - 1, self.height() - 1), 5, 5)
        for box in scene.boxes.values():
            tint = QColor(look.dim)
            tint.setAlpha(60)
            painter.fillRect(self._shown(box.rect_in_scene()), tint)
        for item in scene.nodes.values():
            state = item.status.state
            color = look.accent if item.isSelected() else look.dim if state in ("clean", "dirty") else look.state(state)
            painter.fillRect(self._shown(item.body_in_scene()), color)
        painter.end()
        return picture

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._go(event.position())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._go(event.position())

    def _go(self, here: QPointF) -> None:
        if not self._area.isEmpty():
            self.view.centerOn((here - self._origin()) / self._scale())
            self.view.moved.emit()
