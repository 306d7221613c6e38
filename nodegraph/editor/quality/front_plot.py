"""Error against time of the settings that were tried; the front is a line through what is worth choosing."""

from __future__ import annotations

import math
from collections.abc import Sequence

from PySide6.QtCore import QLineF, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPainterPath, QPaintEvent, QPalette, QPen
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from nodegraph.editor.quality.measuring import Proposal

LEFT, RIGHT, TOP, BOTTOM = 58, 14, 10, 34
REACH = 12.0
"""How far from a point, in pixels, the mouse still means it."""


class FrontPlot(QWidget):
    """Two logarithmic axes. `chosen` sends the place of a setting on the front that was clicked."""

    chosen = Signal(int)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.proposal: Proposal | None = None
        self.selected = -1
        self._axes = (Axis(()), Axis(()))
        self.setMinimumSize(180, 56)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)
        self.setMouseTracking(True)

    def sizeHint(self) -> QSize:
        return QSize(320, 120)

    def show_proposal(self, proposal: Proposal | None) -> None:
        """Show a search, or nothing."""
        self.proposal = proposal
        self.selected = -1
        if proposal is not None:
            points = [*proposal.others, proposal.before, *((one.seconds, one.error) for one in proposal.choices)]
            asked = proposal.tuned
            times = [1e3 * seconds for seconds, _ in points] + ([asked.budget_ms] if asked.budget_ms else [])
            wrong = [error for _, error in points] + ([asked.max_error] if asked.max_error else [])
            self._axes = (Axis(times), Axis(wrong))
        self.update()

    def select(self, place: int) -> None:
        """Mark one of the choices; -1 marks none."""
        if place != self.selected:
            self.selected = place
            self.update()

    # -- places ---------------------------------------------------------------------------------------------------

    def place_of(self, seconds: float, error: float) -> QPointF:
        """Where a time and an error lie in the widget."""
        room = self._room()
        across, up = self._axes
        return QPointF(
            room.left() + across.share(1e3 * seconds) * room.width(), room.bottom() - up.share(error) * room.height()
        )

    def _room(self) -> QRectF:
        return QRectF(self.rect()).adjusted(LEFT, TOP, -RIGHT, -BOTTOM)

    def _nearest(self, at: QPointF) -> int:
        """The choice that a place of the widget means, or -1."""
        found = [
            (math.hypot(apart.x(), apart.y()), i)
            for i, one in enumerate(self.proposal.choices if self.proposal is not None else ())
            for apart in [self.place_of(one.seconds, one.error) - at]
        ]
        distance, place = min(found, default=(math.inf, -1))
        return place if distance <= REACH else -1

    # -- events ---------------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        place = self._nearest(event.position())
        if event.button() == Qt.MouseButton.LeftButton and place >= 0:
            self.chosen.emit(place)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        place = self._nearest(event.position())
        self.setCursor(Qt.CursorShape.PointingHandCursor if place >= 0 else Qt.CursorShape.ArrowCursor)
        if place >= 0 and self.proposal is not None:
            one = self.proposal.choices[place]
            text = f"{1e3 * one.seconds:.3g} ms, {self.proposal.tuned.figure} {one.error:.2g}\n{one.told}"
            QToolTip.showText(event.globalPosition().toPoint(), text, self)
        else:
            QToolTip.hideText()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        palette = self.palette()
        dim, line = palette.color(QPalette.ColorRole.PlaceholderText), palette.color(QPalette.ColorRole.Mid)
        painter.fillRect(self.rect(), palette.color(QPalette.ColorRole.Base))
        if self.proposal is None:
            painter.setPen(dim)
            told = "Error against time of what is tried appears here"
            room = self.rect().adjusted(16, 8, -16, -8)
            painter.drawText(room, Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, told)
            return
        self._paint_axes(painter, dim, line)
        self._paint_points(painter, self.proposal, palette.color(QPalette.ColorRole.Highlight), dim)

    def _paint_axes(self, painter: QPainter, dim: QColor, line: QColor) -> None:
        room = self._room()
        across, up = self._axes
        small = painter.font()
        small.setPointSizeF(max(small.pointSizeF() * 0.85, 7.0))
        painter.setFont(small)
        flags = Qt.AlignmentFlag
        for value in across.ticks(int(room.width() / 48)):
            x = room.left() + across.share(value) * room.width()
            painter.setPen(QPen(line, 1))
            painter.drawLine(QLineF(x, room.top(), x, room.bottom()))
            painter.setPen(dim)
            painter.drawText(
                QRectF(x - 30, room.bottom() + 2, 60, 14), flags.AlignHCenter | flags.AlignTop, f"{value:g}"
            )
        for value in up.ticks(int(room.height() / 22)):
            y = room.bottom() - up.share(value) * room.height()
            painter.setPen(QPen(line, 1))
            painter.drawLine(QLineF(room.left(), y, room.right(), y))
            painter.setPen(dim)
            painter.drawText(QRectF(0, y - 8, LEFT - 6, 16), flags.AlignRight | flags.AlignVCenter, f"{value:g}")
        assert self.proposal is not None
        painter.setPen(dim)
        under = QRectF(room.left(), room.bottom() + 16, room.width(), 16)
        figure = self.proposal.tuned.figure
        painter.drawText(under, flags.AlignHCenter | flags.AlignVCenter, f"{figure} error against milliseconds")

    def _paint_points(self, painter: QPainter, proposal: Proposal, accent: QColor, dim: QColor) -> None:
        room, asked = self._room(), proposal.tuned
        painter.setPen(QPen(dim, 1, Qt.PenStyle.DashLine))
        if asked.max_error:
            y = self.place_of(0.0, asked.max_error).y()
            painter.drawLine(QLineF(room.left(), y, room.right(), y))
        if asked.budget_ms:
            x = self.place_of(asked.budget_ms / 1e3, 0.0).x()
            painter.drawLine(QLineF(x, room.top(), x, room.bottom()))
        faint = QColor(dim)
        faint.setAlphaF(0.55)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(faint)
        for one in proposal.others:
            painter.drawEllipse(self.place_of(*one), 2.5, 2.5)
        places = [self.place_of(one.seconds, one.error) for one in proposal.choices]
        path = QPainterPath()
        for i, at in enumerate(places):
            path.lineTo(at) if i else path.moveTo(at)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(accent, 1.5))
        painter.drawPath(path)
        painter.setBrush(accent)
        painter.setPen(Qt.PenStyle.NoPen)
        for at in places:
            painter.drawEllipse(at, 4, 4)
        text = self.palette().color(QPalette.ColorRole.Text)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        if 0 <= self.selected < len(places):
            painter.setPen(QPen(text, 2))
            painter.drawEllipse(places[self.selected], 7, 7)
        now = self.place_of(*proposal.before)
        painter.setPen(QPen(text, 1.5))
        painter.drawLine(now - QPointF(5, 5), now + QPointF(5, 5))
        painter.drawLine(now - QPointF(5, -5), now + QPointF(5, -5))
        side = Qt.AlignmentFlag.AlignRight if now.x() > room.right() - 40 else Qt.AlignmentFlag.AlignLeft
        beside = QRectF(now.x() - 48 if side == Qt.AlignmentFlag.AlignRight else now.x() + 8, now.y() - 18, 40, 16)
        painter.drawText(beside, side | Qt.AlignmentFlag.AlignVCenter, "now")


class Axis:
    """A logarithmic axis around some values; 0 and what is not finite lie at its ends."""

    def __init__(self, values: Sequence[float]) -> None:
        known = [value for value in values if math.isfinite(value) and value > 0.0] or [1.0]
        low, high = math.log10(min(known)), math.log10(max(known))
        edge = max(0.08 * (high - low), 0.15)
        self.low, self.high = low - edge, high + edge

    def share(self, value: float) -> float:
        """Where a value lies, 0 at the low end to 1 at the high one."""
        if not value > 0.0:
            return 0.0
        return min(max((math.log10(value) - self.low) / (self.high - self.low), 0.0), 1.0)

    def ticks(self, most: int) -> list[float]:
        """Round numbers on the axis, about as many as there is room for."""
        decades = range(math.floor(self.low), math.ceil(self.high) + 1)
        for factors in ((1, 2, 5), (1, 3), (1,)):
            found = [factor * 10.0**decade for decade in decades for factor in factors]
            found = [value for value in found if self.low <= math.log10(value) <= self.high]
            if len(found) <= max(most, 2):
                return found
        every = max(1, math.ceil(len(found) / max(most, 2)))
        return found[::every]
