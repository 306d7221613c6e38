"""How handles are drawn: lines that are dim where the picture hides them, grips, and a label."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen

from nodegraph.data.space import Vector
from nodegraph.editor.views.handles_geometry import Lens
from nodegraph.editor.views.handles_shapes import Grip, Line

# Over pictures, which are surrounded by the same dark grey in both themes.
STROKE = QColor("#4fb3ff")
LIT = QColor("#ffb52e")
SHADE = QColor(0, 0, 0, 130)
PAPER = QColor(18, 20, 24, 225)
INK = QColor("#f2f4f7")
DIMMED = 0.30
FAINT = 0.55
PIECES = 32
"""Parts of a line that are dimmed on their own."""

Hides = Callable[[Vector, Vector], Any]
"""Which of some places (..., 2) of the area at depths (...), mm, lie behind what the picture shows."""


def paint_lines(painter: QPainter, lens: Lens, lines: Sequence[Line], lit: str, hides: Hides) -> None:
    """Draw lines; those of the grip that is lit stand out."""
    if not lines:
        return
    a, b, there = lens.clipped(np.array([line.a for line in lines]), np.array([line.b for line in lines]))
    lines = [line for line, seen in zip(lines, there, strict=True) if seen]
    steps = np.linspace(0.0, 1.0, PIECES + 1)[:, None]
    places, depths = lens.places(a[there][:, None] + steps * (b - a)[there][:, None])
    hidden = hides((places[:, 1:] + places[:, :-1]) / 2, (depths[:, 1:] + depths[:, :-1]) / 2)
    for line, line_places, line_hidden in zip(lines, places, hidden, strict=True):
        ends = [0, *(np.flatnonzero(line_hidden[1:] != line_hidden[:-1]) + 1).tolist(), PIECES]
        for first, last in itertools.pairwise(ends):
            _paint_line(
                painter,
                QPointF(*line_places[first].tolist()),
                QPointF(*line_places[last].tolist()),
                line.faint,
                bool(lit) and line.grip == lit,
                bool(line_hidden[first]),
            )


def _paint_line(painter: QPainter, a: QPointF, b: QPointF, faint: bool, lit: bool, hidden: bool) -> None:
    opacity = (FAINT if faint and not lit else 1.0) * (DIMMED if hidden else 1.0)
    if opacity == 1.0:
        painter.setPen(QPen(SHADE, 3.4))
        painter.drawLine(a, b)
    stroke = QColor(LIT if lit else STROKE)
    stroke.setAlphaF(opacity)
    painter.setPen(QPen(stroke, 2.4 if lit else 1.5, Qt.PenStyle.DashLine if faint else Qt.PenStyle.SolidLine))
    painter.drawLine(a, b)


def paint_grip(painter: QPainter, at: QPointF, grip: Grip, lit: bool, hidden: bool) -> None:
    """Draw one grip."""
    radius = 6.0 if lit else 5.0
    fill, edge = QColor(LIT if lit else INK), QColor(LIT if lit else STROKE)
    area = QRectF(at.x() - radius, at.y() - radius, 2 * radius, 2 * radius)
    draw = painter.drawRect if grip.sign == "square" else painter.drawEllipse
    painter.setBrush(Qt.BrushStyle.NoBrush)
    if hidden and not lit:
        fill.setAlphaF(0.25)
        edge.setAlphaF(0.55)
    else:
        painter.setPen(QPen(SHADE, 4.0))
        draw(area)
    painter.setPen(QPen(edge, 2.0))
    if grip.sign != "ring":
        painter.setBrush(fill)
    draw(area)
    if grip.sign == "ring":
        painter.setBrush(fill)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.drawEllipse(at, 1.8, 1.8)
    elif grip.sign == "lamp":
        for turn in np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False):
            ray = QPointF(float(np.cos(turn)), float(np.sin(turn)))
            painter.drawLine(at + ray * (radius + 3.0), at + ray * (radius + 6.5))


def paint_label(painter: QPainter, at: QPointF, text: str, room: QRectF) -> None:
    """Write something beside a place, inside of the room."""
    box = QRectF(painter.fontMetrics().boundingRect(text)).adjusted(-8, -4, 8, 4)
    box.moveTopLeft(at + QPointF(14.0, -box.height() - 8.0))
    box.moveLeft(max(min(box.left(), room.right() - box.width() - 4.0), 4.0))
    box.moveTop(max(min(box.top(), room.bottom() - box.height() - 4.0), 4.0))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(PAPER)
    painter.drawRoundedRect(box, 4, 4)
    painter.setPen(INK)
    painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)
