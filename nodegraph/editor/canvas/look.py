"""Colours, fonts and measures of the canvas. Colours follow the palette of the application, light or dark."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QFont, QPainter, QPainterPath, QPalette, QPixmap, QPolygonF, QTransform

GRID = 20.0
"""Distance of the grid's points, and what positions snap to while Ctrl is held."""
ROW = 20.0
HEADER = 40.0
FOOTER = 20.0
PORT = 5.0
RADIUS = 6.0
MARGIN = 10.0


@dataclass(frozen=True, slots=True)
class Look:
    """What the canvas is painted with."""

    dark: bool
    background: QColor
    grid: QColor
    node: QColor
    header: QColor
    border: QColor
    text: QColor
    dim: QColor
    accent: QColor
    clean: QColor
    dirty: QColor
    blocked: QColor
    running: QColor
    failed: QColor

    @classmethod
    def of(cls, palette: QPalette) -> Look:
        """The look that goes with a palette."""
        dark = palette.color(QPalette.ColorRole.Window).lightness() < 128
        accent = palette.color(QPalette.ColorRole.Highlight)
        if dark:
            names = ("#1b1d21", "#2a2d33", "#2c3037", "#363b44", "#4a505b", "#e6e8eb", "#9aa1ac")
            states = ("#5fb878", "#8b929d", "#e0a83e", "#5aa9e6", "#ef6a62")
        else:
            names = ("#f2f3f5", "#dcdee2", "#ffffff", "#f0f1f4", "#c3c7cf", "#1d2025", "#666d78")
            states = ("#2f8f4e", "#848b96", "#b07a10", "#1f78c1", "#c9352c")
        background, grid, node, header, border, text, dim = map(QColor, names)
        clean, dirty, blocked, running, failed = map(QColor, states)
        return cls(
            dark, background, grid, node, header, border, text, dim, accent, clean, dirty, blocked, running, failed
        )

    def state(self, name: str) -> QColor:
        """The colour of a state of a node."""
        known = {"clean": self.clean, "blocked": self.blocked, "running": self.running, "failed": self.failed}
        return known.get(name, self.dirty)

    def wire(self, color: str) -> QColor:
        """A port's colour so that it stands out from the background."""
        shown = QColor(color)
        return shown if self.dark else shown.darker(118)


def font(size: float, *, bold: bool = False) -> QFont:
    """The application's font at a size in pixels of the scene."""
    made = QFont()
    made.setPixelSize(round(size))
    made.setBold(bold)
    return made


def port_path(shape: str, radius: float = PORT) -> QPainterPath:
    """The outline of a plug around the origin: circle, square, diamond, triangle or ring."""
    path = QPainterPath()
    r = radius
    if shape == "square":
        path.addRect(QRectF(-r * 0.9, -r * 0.9, 1.8 * r, 1.8 * r))
    elif shape == "diamond":
        path.addPolygon(
            QPolygonF([QPointF(0, -1.25 * r), QPointF(1.25 * r, 0), QPointF(0, 1.25 * r), QPointF(-1.25 * r, 0)])
        )
        path.closeSubpath()
    elif shape == "triangle":
        path.addPolygon(QPolygonF([QPointF(-0.9 * r, -1.15 * r), QPointF(1.25 * r, 0), QPointF(-0.9 * r, 1.15 * r)]))
        path.closeSubpath()
    else:
        path.addEllipse(QPointF(0, 0), r, r)
    if shape == "ring":
        path.addEllipse(QPointF(0, 0), r * 0.45, r * 0.45)
    return path


def dotted(color: QColor, step: float, zoom: float) -> QBrush:
    """A brush for the scene with a dot at every ``step``, two pixels wide at a zoom."""
    side = max(2, round(step * zoom))
    tile = QPixmap(side, side)
    tile.fill(Qt.GlobalColor.transparent)
    painter = QPainter(tile)
    painter.fillRect(0, 0, 2, 2, color)
    painter.end()
    brush = QBrush(tile)
    brush.setTransform(QTransform.fromScale(step / side, step / side))
    return brush


def wire_path(
    start: QPointF, end: QPointF, *, before: Sequence[QPointF] = (), after: Sequence[QPointF] = ()
) -> QPainterPath:
    """The curve of a wire from an output to an input, or of a piece of it between bends.

    ``before`` and ``after`` are the stops of the wire on both sides of the piece: at a bend the curve runs along the
    line between the bend's neighbours, at a port to the right.
    """
    way = end - start
    if not before and not after:
        reach = max(30.0, min(140.0, abs(way.x()) * 0.5))
        if way.x() < 0:
            reach = min(140.0, 40.0 - way.x() * 0.35)
        leave, arrive = QPointF(reach, 0), QPointF(reach, 0)
    else:
        length = math.hypot(way.x(), way.y())
        leave = _along(before[-1], end, length) if before else QPointF(min(140.0, 0.4 * length), 0)
        arrive = _along(start, after[0], length) if after else QPointF(min(140.0, 0.4 * length), 0)
    path = QPainterPath(start)
    path.cubicTo(start + leave, end - arrive, end)
    return path


def _along(start: QPointF, end: QPointF, length: float) -> QPointF:
    """A third of ``length`` in the direction from one point to another."""
    way = end - start
    return way * (length / 3.0 / max(1.0, math.hypot(way.x(), way.y())))
