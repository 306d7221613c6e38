"""What the transfer-function editor looks like: histogram, curve, colours, axes, keys."""

from __future__ import annotations

from typing import Any

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QImage, QPainter, QPalette, QPen, QPolygonF

from nodegraph.data import TransferFunction
from nodegraph.data.image import srgb_encode
from nodegraph.editor.parameters.look import ink
from nodegraph.editor.parameters.transfer_function import grips, marks
from nodegraph.editor.parameters.transfer_function.axes import ValueAxis, height, opacity, opacity_ticks
from nodegraph.editor.parameters.transfer_function.bells import Shape
from nodegraph.editor.parameters.transfer_function.grips import Grip
from nodegraph.editor.parameters.transfer_function.histogram import Histogram
from nodegraph.editor.parameters.transfer_function.keys import legible, opacity_at
from nodegraph.editor.parameters.transfer_function.snap import Catch

LEFT, RIGHT, TOP, BOTTOM = 44.0, 10.0, 10.0, 34.0
CHOSEN = 3.0  #: pixels that what is chosen is nearer than it looks
STRIP = 10.0  #: height of the colour strip below the plot


class Plot:
    """Draws onto a widget of some size; also says where on it a key lies."""

    def __init__(self) -> None:
        self.axis = ValueAxis()
        self.scale = "linear"
        self.histogram: Histogram | None = None
        self.histogram_scale = "logarithmic"
        self.shape = Shape()
        self.function = TransferFunction()
        self.chosen: frozenset[Grip] = frozenset()
        self.hovered: Grip | None = None
        self.guides: tuple[Catch | None, Catch | None] = (None, None)  # what a drag has caught on: value, opacity
        self.band: tuple[float, float] | None = None  # values that the views are asked to show
        self.rubber: QRectF | None = None
        self.area = QRectF()
        self._drawn: tuple[Any, QImage] | None = None  # the histogram as it was drawn last, and for what

    def show(self, shape: Shape) -> None:
        """Draw this from now on."""
        self.shape, self.function = shape, shape.function
        self.chosen = grips.there(shape, self.chosen)
        self.hovered = None

    def resize(self, width: float, height: float) -> None:
        self.area = QRectF(LEFT, TOP, max(1.0, width - LEFT - RIGHT), max(1.0, height - TOP - BOTTOM))

    # -- places -------------------------------------------------------------------------------------------------

    def x(self, value: float) -> float:
        return self.area.left() + float(self.axis.place(value)) * self.area.width()

    def y(self, opacity: float) -> float:
        return self.area.bottom() - float(height(opacity, self.scale)) * self.area.height()

    def value(self, x: float) -> float:
        return self.axis.value((x - self.area.left()) / self.area.width())

    def opacity(self, y: float) -> float:
        """The opacity at a height of the widget, to three digits."""
        return float(f"{opacity((self.area.bottom() - y) / self.area.height(), self.scale):.3g}")

    def rounded(self, x: float) -> float:
        """The value at a place of the widget, without the digits that a pixel cannot tell apart."""
        return self.axis.rounded(self.value(x), round(self.area.width()))

    def at(self, grip: Grip) -> QPointF:
        """Where a grip lies on the widget."""
        value, up = grips.position(self.shape, grip)
        return QPointF(self.x(value), self.y(up))

    def grip_at(self, point: QPointF, reach: float = 9.0) -> Grip | None:
        """What is under a point: the nearest; of two at one place the one on the point's side, else the one on top.

        Flanks can be held of bells that are chosen.
        """
        held = [grips.key(place) for place in range(len(self.shape.base.keys))]
        held += [grips.bell(place) for place in range(len(self.shape.bells))]
        for place in grips.places(self.chosen, "bell"):
            held += [Grip("left", place), Grip("right", place)]
        best, found = reach, None
        for grip in held:
            spot = self.at(grip)
            distance = float(np.hypot(point.x() - spot.x(), point.y() - spot.y()))
            distance = max(0.0, distance - CHOSEN) if grip in self.chosen else distance
            if distance < best or (distance == best and found is not None and point.x() >= spot.x()):
                best, found = distance, grip
        return found

    def grips_in(self, area: QRectF) -> frozenset[Grip]:
        """Keys and tops of bells that lie in a rectangle of the widget."""
        return frozenset(grip for grip in grips.every(self.shape) if area.contains(self.at(grip)))

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
        if self.band is not None:
            marks.draw_band(self, painter, palette, self.band)
        marks.draw_parts(self, painter, palette)
        marks.draw_guides(self, painter, palette)
        painter.restore()
        painter.setPen(QPen(ink(palette, 0.25), 1.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(self.area)
        if self.function.keys:
            self._draw_strip(painter, palette, colors)
        self._draw_values(painter, palette)
        painter.save()
        painter.setClipRect(self.area.adjusted(-marks.KEY - 2, -marks.KEY - 2, marks.KEY + 2, marks.KEY + 2))
        if enabled:
            marks.draw_grips(self, painter, palette)
        if self.rubber is not None:
            marks.draw_rubber(painter, palette, self.rubber)
        painter.restore()

    def _draw_grid(self, painter: QPainter, palette: QPalette) -> None:
        font = painter.font()
        font.setPointSizeF(max(7.0, font.pointSizeF() * 0.8))
        painter.setFont(font)
        above = self.area.bottom() + 20.0
        for up in opacity_ticks(self.scale):
            y = self.y(up)
            painter.setPen(QPen(ink(palette, 0.1), 1.0))
            painter.drawLine(QPointF(self.area.left(), y), QPointF(self.area.right(), y))
            if above - y < 11.0:
                continue  # it would touch the number below
            above = y
            painter.setPen(ink(palette, 0.7))
            place = QRectF(0.0, y - 7.0, LEFT - 5.0, 14.0)
            painter.drawText(place, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, legible_tick(up))

    def _draw_histogram(self, painter: QPainter, palette: QPalette) -> None:
        histogram = self.histogram
        if histogram is None or not histogram.counts.any():
            return
        color = ink(palette, 0.22)
        size = max(1, round(self.area.width())), max(1, round(self.area.height()))
        wanted = (histogram, self.histogram_scale, self.axis.low, self.axis.high, size, color.rgb())
        if self._drawn is None or self._drawn[0] != wanted:
            self._drawn = wanted, histogram_image(histogram, self.histogram_scale, self.axis, size, color)
        painter.drawImage(self.area, self._drawn[1])

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
        at = np.array([key.value for key in keys])
        inside = (values > low.value) & (values < high.value) & ~np.isin(values, at)
        x = np.concatenate([at, values[inside]])
        ups = np.concatenate([[key.opacity for key in keys], opacities[inside]])
        order = np.argsort(x, kind="stable")  # halves of steps keep their order
        xs = (self.area.left() + self.axis.place(x[order]) * self.area.width()).tolist()
        ys = (self.area.bottom() - height(ups[order], self.scale) * self.area.height()).tolist()
        points = QPolygonF([QPointF(min(self.area.left(), xs[0]), ys[0])])
        for place in zip(xs, ys, strict=True):
            points.append(QPointF(*place))
        points.append(QPointF(max(self.area.right(), xs[-1]), ys[-1]))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(ink(palette, 0.9), 1.4))
        painter.drawPolyline(points)

    def _draw_strip(self, painter: QPainter, palette: QPalette, colors: np.ndarray) -> None:
        strip = QRectF(self.area.left(), self.area.bottom() + 4.0, self.area.width(), STRIP)
        pixels = np.full((1, len(colors), 4), 255, np.uint8)
        pixels[0, :, :3] = colors
        painter.drawImage(strip, QImage(pixels.data, len(colors), 1, 4 * len(colors), QImage.Format.Format_RGBA8888))
        painter.setPen(QPen(ink(palette, 0.25), 1.0))
        painter.drawRect(strip)

    def _draw_values(self, painter: QPainter, palette: QPalette) -> None:
        unit = self.histogram.unit if self.histogram is not None else ""
        draw_values(painter, palette, self.axis, self.area, self.area.bottom() + 4.0 + STRIP, unit)


def draw_values(painter: QPainter, palette: QPalette, axis: ValueAxis, area: QRectF, top: float, unit: str) -> None:
    """The numbers of an axis of values below an area, from ``top`` on, and their unit at its right end."""
    metrics = QFontMetricsF(painter.font())
    room = metrics.horizontalAdvance(unit) + 6.0 if unit else 0.0
    end = area.right() - room
    painter.setPen(ink(palette, 0.7))
    if unit:
        place = QRectF(end, top + 3.0, room, 14.0)
        painter.drawText(place, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, unit)
    for value in axis.ticks(max(2, int(area.width() // 62))):
        x, text = area.left() + float(axis.place(value)) * area.width(), f"{value:.6g}"
        painter.drawLine(QPointF(x, top), QPointF(x, top + 3.0))
        half = metrics.horizontalAdvance(text) / 2
        if x + half <= end:
            painter.drawText(QRectF(x - half - 1, top + 3.0, 2 * half + 2, 14.0), Qt.AlignmentFlag.AlignCenter, text)


def histogram_image(histogram: Histogram, scale: str, axis: ValueAxis, size: tuple[int, int], color: QColor) -> QImage:
    """A histogram over an axis, transparent where there is nothing: of the bins in a column of pixels the highest."""
    counts = histogram.counts.astype(np.float64)
    if scale == "logarithmic":
        heights = np.log1p(counts) / np.log1p(counts.max())
    else:
        # The air around a patient is most of a volume; the rest is to be seen beside it.
        heights = np.minimum(counts / max(np.sort(counts)[-min(len(counts), 4)], 1.0), 1.0)
    width, rows = size
    edges = axis.low + axis.span * np.arange(width + 1) / width
    bins = np.floor((edges - histogram.low) / (histogram.high - histogram.low) * len(counts)).astype(int)
    there = (bins[1:] >= 0) & (bins[:-1] < len(counts))
    first = np.clip(bins[:-1], 0, len(counts) - 1)
    last = np.clip(np.maximum(bins[1:], bins[:-1] + 1), first + 1, len(counts))
    tops = np.maximum.reduceat(np.append(heights, 0.0), np.stack([first, last], axis=1).ravel())[::2] * there
    pixels = np.empty((rows, width, 4), np.uint8)
    pixels[..., :3] = color.red(), color.green(), color.blue()
    level = rows - np.arange(rows) - 1.0
    pixels[..., 3] = np.clip(tops * 0.96 * rows - level[:, None], 0.0, 1.0) * 255.0
    return QImage(pixels.data, width, rows, 4 * width, QImage.Format.Format_RGBA8888).copy()


def legible_tick(opacity: float) -> str:
    """An opacity on the axis: 0.0001 is written in full."""
    return legible(opacity) if opacity >= 0.001 else f"{opacity:.4f}".rstrip("0").rstrip(".") or "0"


def _screen(function: TransferFunction, values: np.ndarray) -> np.ndarray:
    """Colours of a function as bytes of the screen, (n, 3)."""
    linear = np.clip(function.evaluate(values)[:, :3], 0.0, 1.0)
    return np.asarray(np.rint(srgb_encode(linear) * 255.0), np.uint8)
