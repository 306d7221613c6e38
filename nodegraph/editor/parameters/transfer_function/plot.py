"""What the transfer-function editor looks like: histogram, curve, colours, axes, keys."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QFontMetricsF, QImage, QPainter, QPainterPath, QPalette, QPen, QPolygonF

from nodegraph.data import TransferFunction
from nodegraph.data.image import srgb_encode
from nodegraph.editor.parameters.color import to_qcolor
from nodegraph.editor.parameters.look import accent, ink
from nodegraph.editor.parameters.transfer_function.axes import ValueAxis, height, opacity_ticks
from nodegraph.editor.parameters.transfer_function.histogram import Histogram
from nodegraph.editor.parameters.transfer_function.keys import legible, opacity_at

LEFT, RIGHT, TOP, BOTTOM = 40.0, 10.0, 10.0, 34.0
STRIP = 10.0  #: height of the colour strip below the plot
KEY = 5.5  #: radius of a key


class Plot:
    """Draws onto a widget of some size; also says where on it a key lies."""

    def __init__(self) -> None:
        self.axis = ValueAxis()
        self.scale = "linear"
        self.histogram: Histogram | None = None
        self.histogram_scale = "logarithmic"
        self.function = TransferFunction()
        self.selected: int | None = None
        self.hovered: int | None = None
        self.area = QRectF()

    def resize(self, width: float, height: float) -> None:
        self.area = QRectF(LEFT, TOP, max(1.0, width - LEFT - RIGHT), max(1.0, height - TOP - BOTTOM))

    # -- places -------------------------------------------------------------------------------------------------

    def x(self, value: float) -> float:
        return self.area.left() + float(self.axis.place(value)) * self.area.width()

    def y(self, opacity: float) -> float:
        return self.area.bottom() - float(height(opacity, self.scale)) * self.area.height()

    def value(self, x: float) -> float:
        return self.axis.value((x - self.area.left()) / self.area.width())

    def key_at(self, point: QPointF, reach: float = 9.0) -> int | None:
        """The key under a point: the nearest; of two at one place the one on the point's side, else the one on top."""
        best, found = reach, None
        for place, key in enumerate(self.function.keys):
            x, y = self.x(key.value), self.y(key.opacity)
            distance = float(np.hypot(point.x() - x, point.y() - y))
            if distance < best or (distance == best and found is not None and point.x() >= x):
                best, found = distance, place
        return found

    # -- drawing ------------------------------------------------------------------------------------------------

    def draw(self, painter: QPainter, palette: QPalette, enabled: bool) -> None:
        """Draw all of it."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.area, palette.base())
        self._draw_grid(painter, palette)
        painter.save()
        painter.setClipRect(self.area)
        self._draw_histogram(painter, palette)
        if self.function.keys:
            values = self._columns()
            colors, opacities = _screen(self.function, values), opacity_at(self.function, values)
            self._draw_fill(painter, colors, opacities)
            self._draw_curve(painter, palette, values, opacities)
        painter.restore()
        painter.setPen(QPen(ink(palette, 0.25), 1.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(self.area)
        if self.function.keys:
            self._draw_strip(painter, palette, colors)
        self._draw_values(painter, palette)
        painter.save()
        painter.setClipRect(self.area.adjusted(-KEY - 2, -KEY - 2, KEY + 2, KEY + 2))
        if enabled:
            self._draw_keys(painter, palette)
        painter.restore()

    def _draw_grid(self, painter: QPainter, palette: QPalette) -> None:
        font = painter.font()
        font.setPointSizeF(max(7.0, font.pointSizeF() * 0.8))
        painter.setFont(font)
        above = self.area.bottom() + 20.0
        for opacity in opacity_ticks(self.scale):
            y = self.y(opacity)
            painter.setPen(QPen(ink(palette, 0.1), 1.0))
            painter.drawLine(QPointF(self.area.left(), y), QPointF(self.area.right(), y))
            if above - y < 11.0:
                continue  # it would touch the number below
            above = y
            painter.setPen(ink(palette, 0.7))
            place = QRectF(0.0, y - 7.0, LEFT - 5.0, 14.0)
            painter.drawText(place, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, legible_tick(opacity))

    def _draw_histogram(self, painter: QPainter, palette: QPalette) -> None:
        histogram = self.histogram
        if histogram is None or not histogram.counts.any():
            return
        counts = histogram.counts.astype(np.float64)
        if self.histogram_scale == "logarithmic":
            heights = np.log1p(counts) / np.log1p(counts.max())
        else:
            # The air around a patient is most of a volume; the rest is to be seen beside it.
            heights = np.minimum(counts / max(np.sort(counts)[-min(len(counts), 4)], 1.0), 1.0)
        edges = np.linspace(histogram.low, histogram.high, len(counts) + 1)
        xs = self.area.left() + self.axis.place(edges) * self.area.width()
        bottom, tall = self.area.bottom(), self.area.height() * 0.96
        seen = np.flatnonzero((xs[1:] >= self.area.left()) & (xs[:-1] <= self.area.right()))
        if not len(seen):
            return
        shape = QPolygonF([QPointF(float(xs[seen[0]]), bottom)])
        for i in seen:
            y = bottom - float(heights[i]) * tall
            shape.append(QPointF(float(xs[i]), y))
            shape.append(QPointF(float(xs[i + 1]), y))
        shape.append(QPointF(float(xs[seen[-1] + 1]), bottom))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ink(palette, 0.22))
        painter.drawPolygon(shape)

    def _columns(self) -> np.ndarray:
        """The value in the middle of each pixel of the plot's width."""
        count = max(1, round(self.area.width()))
        return np.asarray(self.axis.low + self.axis.span * (np.arange(count) + 0.5) / count)

    def _draw_fill(self, painter: QPainter, colors: np.ndarray, opacities: np.ndarray) -> None:
        tops = height(opacities, self.scale)
        rows = max(1, round(self.area.height()))
        pixels = np.zeros((rows, len(colors), 4), np.uint8)
        pixels[..., :3] = colors
        level = 1.0 - (np.arange(rows) + 0.5) / rows
        pixels[..., 3] = np.where(level[:, None] < tops[None, :], 150, 0)
        image = QImage(pixels.data, len(colors), rows, 4 * len(colors), QImage.Format.Format_RGBA8888)
        painter.drawImage(self.area, image)

    def _draw_curve(self, painter: QPainter, palette: QPalette, values: np.ndarray, opacities: np.ndarray) -> None:
        keys = self.function.keys
        low, high = keys[0], keys[-1]
        # The keys themselves, left and right of steps, among the samples: corners stay corners.
        corners = [(key.value, place, key.opacity) for place, key in enumerate(keys)]
        inside = (values > low.value) & (values < high.value)
        for key in keys:
            inside &= values != key.value
        samples = [(float(v), -1, float(o)) for v, o in zip(values[inside], opacities[inside], strict=True)]
        points = sorted([*corners, *samples])
        path = QPainterPath(QPointF(self.area.left(), self.y(low.opacity)))
        if low.value < self.axis.low:
            path = QPainterPath(QPointF(self.x(low.value), self.y(low.opacity)))
        for value, _, opacity in points:
            path.lineTo(self.x(value), self.y(opacity))
        path.lineTo(max(self.area.right(), self.x(high.value)), self.y(high.opacity))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(ink(palette, 0.9), 1.4))
        painter.drawPath(path)

    def _draw_strip(self, painter: QPainter, palette: QPalette, colors: np.ndarray) -> None:
        strip = QRectF(self.area.left(), self.area.bottom() + 4.0, self.area.width(), STRIP)
        pixels = np.full((1, len(colors), 4), 255, np.uint8)
        pixels[0, :, :3] = colors
        painter.drawImage(strip, QImage(pixels.data, len(colors), 1, 4 * len(colors), QImage.Format.Format_RGBA8888))
        painter.setPen(QPen(ink(palette, 0.25), 1.0))
        painter.drawRect(strip)

    def _draw_values(self, painter: QPainter, palette: QPalette) -> None:
        top = self.area.bottom() + 4.0 + STRIP
        metrics = QFontMetricsF(painter.font())
        unit = self.histogram.unit if self.histogram is not None else ""
        room = metrics.horizontalAdvance(unit) + 6.0 if unit else 0.0
        end = self.area.right() - room
        painter.setPen(ink(palette, 0.7))
        if unit:
            place = QRectF(end, top + 3.0, room, 14.0)
            painter.drawText(place, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, unit)
        for value in self.axis.ticks(max(2, int(self.area.width() // 62))):
            x, text = self.x(value), f"{value:.6g}"
            painter.drawLine(QPointF(x, top), QPointF(x, top + 3.0))
            half = metrics.horizontalAdvance(text) / 2
            if x + half > end:
                continue
            painter.drawText(QRectF(x - half - 1, top + 3.0, 2 * half + 2, 14.0), Qt.AlignmentFlag.AlignCenter, text)

    def _draw_keys(self, painter: QPainter, palette: QPalette) -> None:
        for place, key in enumerate(self.function.keys):
            at = QPointF(self.x(key.value), self.y(key.opacity))
            chosen = place == self.selected
            if chosen:
                painter.setPen(QPen(accent(palette), 1.0, Qt.PenStyle.DashLine))
                painter.drawLine(QPointF(at.x(), self.area.top()), QPointF(at.x(), self.area.bottom()))
            painter.setBrush(to_qcolor(key.color))
            painter.setPen(QPen(palette.base().color(), 4.0))
            painter.drawEllipse(at, KEY, KEY)
            ring = accent(palette) if chosen else ink(palette, 1.0 if place == self.hovered else 0.75)
            painter.setPen(QPen(ring, 2.2 if chosen or place == self.hovered else 1.5))
            painter.drawEllipse(at, KEY, KEY)


def legible_tick(opacity: float) -> str:
    """An opacity on the axis: 0.0001 is written in full."""
    return legible(opacity) if opacity >= 0.001 else f"{opacity:.4f}".rstrip("0").rstrip(".") or "0"


def _screen(function: TransferFunction, values: np.ndarray) -> np.ndarray:
    """Colours of a function as bytes of the screen, (n, 3)."""
    linear = np.clip(function.evaluate(values)[:, :3], 0.0, 1.0)
    return np.asarray(np.rint(srgb_encode(linear) * 255.0), np.uint8)
