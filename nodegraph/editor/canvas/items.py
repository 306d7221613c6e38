"""Frames and notes as they are painted."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPen
from PySide6.QtWidgets import QGraphicsItem, QStyleOptionGraphicsItem, QWidget

from nodegraph.editor.canvas.look import RADIUS, Look, font

GRIP = 16.0
"""Side of the corner by which a frame or a note is resized."""
TITLE = 26.0


class BoxItem(QGraphicsItem):
    """A frame with a title around nodes, or a note. ``key`` names it among those of its level."""

    def __init__(self, kind: str, key: str, look: Look) -> None:
        super().__init__()
        self.kind = kind  # "frames" or "notes", as in the document
        self.key = key
        self.look = look
        self.text = ""
        self.color = ""
        self._rect = QRectF(0, 0, 200, 120)
        self.setFlag(QGraphicsItem.GraphicsItemFlag.ItemIsSelectable)
        self.setZValue(-10 if kind == "frames" else 2)

    def show_value(self, value: dict[str, Any]) -> None:
        """Show what the document says: text, rect (x, y, width, height) and perhaps a colour."""
        rect = as_rect(value.get("rect"))
        self.prepareGeometryChange()
        self.setPos(rect.topLeft())
        self._rect = QRectF(0, 0, rect.width(), rect.height())
        self.text = str(value.get("text", ""))
        self.color = str(value.get("color", ""))
        self.update()

    def show_rect(self, rect: QRectF) -> None:
        """Stand elsewhere while it is dragged."""
        self.prepareGeometryChange()
        self.setPos(rect.topLeft())
        self._rect = QRectF(0, 0, rect.width(), rect.height())

    def rect_in_scene(self) -> QRectF:
        return self._rect.translated(self.pos())

    def is_grip(self, point: QPointF) -> bool:
        """Whether a point of the scene lies in the corner that resizes."""
        corner = self.rect_in_scene().bottomRight()
        return QRectF(corner.x() - GRIP, corner.y() - GRIP, GRIP, GRIP).contains(point)

    def boundingRect(self) -> QRectF:
        return self._rect.adjusted(-2, -2, 2, 2)

    def shape(self) -> QPainterPath:
        """A frame is taken by its title, its border and its corner, so that a rubber band can start inside."""
        path = QPainterPath()
        if self.kind == "notes":
            path.addRect(self._rect)
            return path
        path.addRect(QRectF(0, 0, self._rect.width(), TITLE))
        path.addRect(QRectF(self._rect.width() - GRIP, self._rect.height() - GRIP, GRIP, GRIP))
        return path

    def title_rect(self) -> QRectF:
        """Where the text is edited, in its own coordinates."""
        return QRectF(6, 2, self._rect.width() - 12, TITLE - 3) if self.kind == "frames" else self._rect

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        look = self.look
        tint = QColor(self.color) if QColor.isValidColorName(self.color) else QColor(look.dim)
        fill = QColor(tint)
        border = QPen(look.accent if self.isSelected() else tint, 1.5 if self.isSelected() else 1.0)
        zoom = option.levelOfDetailFromTransform(painter.worldTransform())
        if self.kind == "frames":
            fill.setAlpha(30)
            painter.setPen(border)
            painter.setBrush(fill)
            painter.drawRoundedRect(self._rect, RADIUS + 2, RADIUS + 2)
            # A frame's title is what is read from far away, so it grows while one zooms out.
            size = min(13 / max(zoom, 0.05), 40.0) if zoom < 1 else 13.0
            painter.setFont(font(size, bold=True))
            painter.setPen(look.text)
            box = QRectF(10, 0, self._rect.width() - 20, max(TITLE, size * 1.5))
            painter.drawText(box, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, self.text)
        else:
            paper = QColor("#4a4530" if look.dark else "#fff6cf")
            painter.setPen(border if self.isSelected() else QPen(paper.darker(120), 1))
            painter.setBrush(paper)
            painter.drawRoundedRect(self._rect, 3, 3)
            if zoom > 0.3:
                painter.setFont(font(12))
                painter.setPen(look.text)
                painter.drawText(
                    self._rect.adjusted(8, 6, -8, -6),
                    Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap,
                    self.text,
                )
        corner = self._rect.bottomRight()
        painter.setPen(QPen(look.dim, 1))
        for away in (5, 9):
            painter.drawLine(corner - QPointF(away, 3), corner - QPointF(3, away))


def as_rect(value: Any) -> QRectF:
    """A rectangle as it is stored, or a default where what is stored is none."""
    if isinstance(value, (list, tuple)) and len(value) == 4 and all(isinstance(v, (int, float)) for v in value):
        x, y, width, height = map(float, value)
        return QRectF(x, y, max(60.0, width), max(40.0, height))
    return QRectF(0, 0, 200, 120)


def rect_json(rect: QRectF) -> list[float]:
    """A rectangle as it is stored."""
    return [round(rect.x()), round(rect.y()), round(rect.width()), round(rect.height())]
