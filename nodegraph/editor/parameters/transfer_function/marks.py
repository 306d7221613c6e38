"""What lies on top of the plot: grips, the parts that a curve is made of, what a drag caught on, the range shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPalette, QPen, QPolygonF

from nodegraph.editor.parameters.color import to_qcolor
from nodegraph.editor.parameters.look import accent, blend, ink
from nodegraph.editor.parameters.transfer_function import grips, keys
from nodegraph.editor.parameters.transfer_function.axes import height
from nodegraph.editor.parameters.transfer_function.grips import Grip

if TYPE_CHECKING:
    from nodegraph.editor.parameters.transfer_function.plot import Plot

KEY = 5.5  #: radius of a key
FLANK = 3.5
BAND = "#ffb000"
"""The colour of values that the views are asked to show; it stands out in light and dark, and for the colour-blind."""


def draw_grips(plot: Plot, painter: QPainter, palette: QPalette) -> None:
    """Keys as discs, halves of steps as half discs where they meet, bells as diamonds with two flanks."""
    if len(plot.chosen) == 1:
        at = plot.at(next(iter(plot.chosen)))
        painter.setPen(QPen(accent(palette), 1.0, Qt.PenStyle.DashLine))
        painter.drawLine(QPointF(at.x(), plot.area.top()), QPointF(at.x(), plot.area.bottom()))
    for place in range(len(plot.shape.base.keys)):
        other = keys.partner(plot.shape.base, place)
        half = 0.0
        if other is not None and abs(plot.at(grips.key(place)).y() - plot.at(grips.key(other)).y()) < KEY:
            half = -1.0 if other > place else 1.0
        _draw_grip(plot, painter, palette, grips.key(place), half)
    for place in range(len(plot.shape.bells)):
        if grips.bell(place) in plot.chosen:
            _draw_flanks(plot, painter, palette, place)
        _draw_grip(plot, painter, palette, grips.bell(place))


def _draw_grip(plot: Plot, painter: QPainter, palette: QPalette, grip: Grip, half: float = 0.0) -> None:
    outline = _outline(plot.at(grip), grip.kind, half)
    chosen, hovered = grip in plot.chosen, grip == plot.hovered
    painter.setBrush(to_qcolor(grips.color(plot.shape, grip)))
    painter.setPen(QPen(palette.base().color(), 4.0))
    painter.drawPath(outline)
    ring = accent(palette) if chosen else ink(palette, 1.0 if hovered else 0.75)
    painter.setPen(QPen(ring, 2.2 if chosen or hovered else 1.5))
    painter.drawPath(outline)


def _outline(at: QPointF, kind: str, half: float) -> QPainterPath:
    path = QPainterPath()
    if kind == "bell":
        side = KEY * 1.3
        steps = ((0.0, -side), (side, 0.0), (0.0, side), (-side, 0.0), (0.0, -side))
        path.addPolygon(QPolygonF([at + QPointF(x, y) for x, y in steps]))
    elif half:
        box = QRectF(at.x() - KEY, at.y() - KEY, 2 * KEY, 2 * KEY)
        path.moveTo(at.x(), at.y() + half * KEY)
        path.arcTo(box, -90.0 * half, 180.0)
        path.closeSubpath()
    else:
        path.addEllipse(at, KEY, KEY)
    return path


def _draw_flanks(plot: Plot, painter: QPainter, palette: QPalette, place: int) -> None:
    left, right = plot.at(Grip("left", place)), plot.at(Grip("right", place))
    painter.setPen(QPen(accent(palette), 1.0, Qt.PenStyle.DashLine))
    painter.drawLine(left, right)
    for grip, at in ((Grip("left", place), left), (Grip("right", place), right)):
        painter.setBrush(palette.base().color())
        painter.setPen(QPen(accent(palette), 2.2 if plot.hovered == grip else 1.5))
        painter.drawRect(QRectF(at.x() - FLANK, at.y() - FLANK, 2 * FLANK, 2 * FLANK))


def draw_parts(plot: Plot, painter: QPainter, palette: QPalette) -> None:
    """Where there are bells: the keys' own curve and each bell by itself, thin."""
    shape = plot.shape
    if not shape.bells:
        return
    values = plot.axis.low + plot.axis.span * np.linspace(0.0, 1.0, max(2, round(plot.area.width() / 2)))
    curves: list[tuple[np.ndarray, QColor]] = []
    if shape.base.keys:
        curves.append((keys.opacity_at(shape.base, values), ink(palette, 0.5)))
    length = shape.base.reference_length
    for bell in shape.bells:
        peak = float(shape.base.extinction(bell.opacity))
        up = -np.expm1(-length * peak * np.exp(-0.5 * ((values - bell.center) / bell.width) ** 2))
        curves.append((up, blend(to_qcolor(bell.color), palette.windowText().color(), 0.35)))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    for opacities, color in curves:
        painter.setPen(QPen(color, 1.0, Qt.PenStyle.DashLine))
        xs = plot.area.left() + plot.axis.place(values) * plot.area.width()
        ys = plot.area.bottom() - height(opacities, plot.scale) * plot.area.height()
        painter.drawPolyline([QPointF(x, y) for x, y in zip(xs.tolist(), ys.tolist(), strict=True)])


def draw_guides(plot: Plot, painter: QPainter, palette: QPalette) -> None:
    """Lines through what a drag has caught on."""
    painter.setPen(QPen(accent(palette), 1.0))
    across, up = plot.guides
    if across is not None:
        x = plot.x(across.place)
        painter.drawLine(QPointF(x, plot.area.top()), QPointF(x, plot.area.bottom()))
    if up is not None:
        y = plot.y(up.place)
        painter.drawLine(QPointF(plot.area.left(), y), QPointF(plot.area.right(), y))


def draw_band(plot: Plot, painter: QPainter, palette: QPalette, band: tuple[float, float]) -> None:
    """The range of values that the views show."""
    left, right = plot.x(band[0]), plot.x(band[1])
    fill = QColor(BAND)
    fill.setAlpha(70)
    painter.fillRect(QRectF(left, plot.area.top(), right - left, plot.area.height()), fill)
    painter.setPen(QPen(QColor(BAND), 1.5))
    for x in (left, right):
        painter.drawLine(QPointF(x, plot.area.top()), QPointF(x, plot.area.bottom()))


def draw_rubber(painter: QPainter, palette: QPalette, area: QRectF) -> None:
    """The rectangle that a drag chooses with."""
    fill = accent(palette)
    fill.setAlpha(40)
    painter.setPen(QPen(accent(palette), 1.0))
    painter.setBrush(fill)
    painter.drawRect(area)
