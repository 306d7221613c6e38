"""How what lies over a picture is drawn: thin lines with a dark seam, so that they are seen on black and on white."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPen, QPolygonF

MARK = QColor("#ffd166")
"""Of the cross-hair, and of what is marked."""
MEASURE = QColor("#5cc8ff")
SEAM = QColor(0, 0, 0, 130)
PLATE = QColor(16, 18, 22, 205)
"""Behind text."""
TEXT = QColor("#f2f4f7")
PADDING = 5.0


def line(
    painter: QPainter, points: Sequence[QPointF], color: QColor, *, closed: bool = False, faint: bool = False
) -> None:
    """A line through places. faint: for what lies elsewhere than the picture shows; dashed and pale."""
    shape = QPolygonF(list(points))
    draw = painter.drawPolygon if closed else painter.drawPolyline
    painter.setBrush(Qt.BrushStyle.NoBrush)
    ink = QColor(color)
    if faint:
        ink.setAlphaF(0.7)
    painter.setPen(QPen(SEAM, 3.0, Qt.PenStyle.SolidLine, Qt.PenCapStyle.FlatCap, Qt.PenJoinStyle.RoundJoin))
    draw(shape)
    style = Qt.PenStyle.DashLine if faint else Qt.PenStyle.SolidLine
    painter.setPen(QPen(ink, 1.3, style, Qt.PenCapStyle.FlatCap, Qt.PenJoinStyle.RoundJoin))
    draw(shape)


def dot(painter: QPainter, at: QPointF, color: QColor, *, large: bool = False) -> None:
    """A point that can be taken hold of."""
    painter.setPen(QPen(SEAM, 1.0))
    painter.setBrush(color)
    radius = 5.0 if large else 3.2
    painter.drawEllipse(at, radius, radius)


def plate(
    painter: QPainter,
    at: QPointF,
    rows: Sequence[str],
    room: QRectF,
    color: QColor,
    taken: Sequence[QRectF] = (),
) -> QRectF:
    """Rows of text on a dark plate beside a place, kept inside the room and, if it can be, off what is taken.

    Returns what it covers.
    """
    metrics = QFontMetricsF(painter.font())
    width = max(metrics.horizontalAdvance(row) for row in rows) + 2 * PADDING + 3
    height = metrics.lineSpacing() * len(rows) + 2 * PADDING - metrics.leading()
    corners = [
        (x, y)
        for y in (at.y() - height - 10, at.y() + 10, at.y() - height / 2)
        for x in (at.x() + 10, at.x() - width - 10, at.x() - width / 2)
    ]
    boxes = [
        QRectF(
            min(max(x, room.left() + 2), room.right() - width - 2),
            min(max(y, room.top() + 2), room.bottom() - height - 2),
            width,
            height,
        )
        for x, y in corners
    ]
    box = next((one for one in boxes if not any(one.intersects(other) for other in taken)), boxes[0])
    x, y = box.x(), box.y()
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(PLATE)
    painter.drawRoundedRect(box, 4, 4)
    painter.setBrush(color)
    painter.drawRoundedRect(QRectF(x, y + 3, 2.5, height - 6), 1.2, 1.2)
    painter.setPen(TEXT)
    for place, row in enumerate(rows):
        top = y + PADDING + place * metrics.lineSpacing()
        painter.drawText(QRectF(x + PADDING + 3, top, width, metrics.lineSpacing()), row)
    return box
