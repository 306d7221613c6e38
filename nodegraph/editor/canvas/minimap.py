"""The whole level in a corner, with what is seen of it. A press or drag moves there."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPen
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
        self.resize(SIZE)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setToolTip("The whole network. Press or drag to move there.")
        self.hide()

    def refresh(self) -> None:
        """Show what is there and what is seen now."""
        content = self.view.canvas_scene.content()
        seen = self.view.seen()
        self._area = content.united(seen) if content.isValid() else seen
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

    def paintEvent(self, event: QPaintEvent) -> None:
        scene, painter = self.view.canvas_scene, QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        look = scene.look
        ground = QColor(look.header)
        ground.setAlpha(225)
        painter.setPen(QPen(look.border, 1))
        painter.setBrush(ground)
        painter.drawRoundedRect(QRectF(0.5, 0.5, self.width() - 1, self.height() - 1), 5, 5)
        if self._area.isEmpty():
            return
        scale, origin = self._scale(), self._origin()

        def shown(rect: QRectF) -> QRectF:
            return QRectF(origin + rect.topLeft() * scale, rect.size() * scale)

        for box in scene.boxes.values():
            tint = QColor(look.dim)
            tint.setAlpha(60)
            painter.fillRect(shown(box.rect_in_scene()), tint)
        for item in scene.nodes.values():
            state = item.status.state
            color = look.accent if item.isSelected() else look.dim if state in ("clean", "dirty") else look.state(state)
            painter.fillRect(shown(item.body_in_scene()), color)
        painter.setPen(QPen(look.accent, 1.5))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(shown(self.view.seen()).intersected(QRectF(1, 1, self.width() - 2, self.height() - 2)))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._go(event.position())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._go(event.position())

    def _go(self, here: QPointF) -> None:
        if not self._area.isEmpty():
            self.view.centerOn((here - self._origin()) / self._scale())
            self.view.moved.emit()
