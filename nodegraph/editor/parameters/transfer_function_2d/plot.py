"""What the editor of two-dimensional transfer functions looks like: joint histogram, areas, axes, handles."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QImage, QPainter, QPalette, QPen, QPolygonF

from nodegraph.data import TransferFunction2D
from nodegraph.data.image import srgb_encode
from nodegraph.editor.parameters.color import to_qcolor
from nodegraph.editor.parameters.look import accent, ink
from nodegraph.editor.parameters.transfer_function.axes import ValueAxis
from nodegraph.editor.parameters.transfer_function.plot import draw_values
from nodegraph.editor.parameters.transfer_function_2d import areas
from nodegraph.editor.parameters.transfer_function_2d.joint import JointHistogram

LEFT, RIGHT, TOP, BOTTOM = 40.0, 10.0, 10.0, 22.0
HANDLE = 4.0  #: half the edge of a handle
CELL = 3  #: pixels of the plot for each sample of the colours


class Plot:
    """Draws onto a widget of some size; also says what of it lies under a point."""

    def __init__(self) -> None:
        self.values, self.gradients = ValueAxis(), ValueAxis()
        self.histogram: JointHistogram | None = None
        self.histogram_scale = "logarithmic"
        self.function = TransferFunction2D()
        self.selected: int | None = None
        self.hovered: int | None = None
        self.area = QRectF()
        self._background: tuple[object, QImage] | None = None
        self._colors: tuple[object, QImage] | None = None

    def resize(self, width: float, height: float) -> None:
        self.area = QRectF(LEFT, TOP, max(1.0, width - LEFT - RIGHT), max(1.0, height - TOP - BOTTOM))

    # -- places -------------------------------------------------------------------------------------------------

    def at(self, point: areas.Point) -> QPointF:
        """Where a value and a magnitude lie."""
        across, up = float(self.values.place(point[0])), float(self.gradients.place(point[1]))
        return QPointF(self.area.left() + across * self.area.width(), self.area.bottom() - up * self.area.height())

    def point(self, at: QPointF) -> areas.Point:
        """The value and the magnitude at a place; no magnitude is below 0."""
        value = self.values.value((at.x() - self.area.left()) / self.area.width())
        gradient = self.gradients.value((self.area.bottom() - at.y()) / self.area.height())
        return value, max(0.0, gradient)

    def pixel(self) -> areas.Point:
        """The difference of values and of magnitudes that a pixel is."""
        return self.values.span / self.area.width(), self.gradients.span / self.area.height()

    def rounded(self, point: areas.Point) -> areas.Point:
        """A point without the digits that pixels cannot tell apart."""
        width, height = round(self.area.width()), round(self.area.height())
        return self.values.rounded(point[0], width), self.gradients.rounded(point[1], height)

    def handle_at(self, at: QPointF, reach: float = 8.0) -> str | None:
        """The handle of the selected area that is nearest to a place, if one is near."""
        if self.selected is None:
            return None
        found, best = None, reach
        for name, point in areas.handles(self.function.areas[self.selected]).items():
            distance = (self.at(point) - at).manhattanLength()
            # Corners come first: of a small area they lie over the sides.
            if distance < best:
                found, best = name, distance
        return found

    def area_at(self, at: QPointF) -> int | None:
        """The area under a place: the selected one, else the last, which is drawn on top."""
        point = self.point(at)
        under = [i for i, area in enumerate(self.function.areas) if areas.contains(area, point)]
        return self.selected if self.selected in under else under[-1] if under else None

    # -- drawing ------------------------------------------------------------------------------------------------

    def draw(self, painter: QPainter, palette: QPalette, enabled: bool) -> None:
        """Draw all of it."""
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.fillRect(self.area, palette.base())
        painter.save()
        painter.setClipRect(self.area)
        self._draw_histogram(painter, palette)
        self._draw_grid(painter, palette)
        if self.function.areas:
            self._draw_colors(painter)
        self._draw_outlines(painter, palette)
        painter.restore()
        painter.setPen(QPen(ink(palette, 0.25), 1.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(self.area)
        self._draw_numbers(painter, palette)
        if enabled and self.selected is not None:
            painter.save()
            painter.setClipRect(self.area.adjusted(-HANDLE - 2, -HANDLE - 2, HANDLE + 2, HANDLE + 2))
            self._draw_handles(painter, palette)
            painter.restore()

    def _ticks(self) -> list[float]:
        return [tick for tick in self.gradients.ticks(max(2, int(self.area.height() // 34))) if tick >= 0.0]

    def _draw_grid(self, painter: QPainter, palette: QPalette) -> None:
        painter.setPen(QPen(ink(palette, 0.1), 1.0))
        for tick in self._ticks():
            y = self.at((self.values.low, tick)).y()
            painter.drawLine(QPointF(self.area.left(), y), QPointF(self.area.right(), y))

    def _draw_histogram(self, painter: QPainter, palette: QPalette) -> None:
        histogram = self.histogram
        if histogram is None or not histogram.counts.any():
            return
        color = ink(palette, 1.0)
        key = (id(histogram), self.histogram_scale, color.rgb())
        if self._background is None or self._background[0] != key:
            counts = histogram.counts[::-1].astype(np.float64)
            if self.histogram_scale == "logarithmic":
                shares = np.log1p(counts) / np.log1p(counts.max())
            else:
                # The air around a patient is most of a volume; the rest is to be seen beside it.
                shares = np.minimum(counts / max(np.sort(counts, axis=None)[-min(counts.size, 64)], 1.0), 1.0)
            pixels = np.empty((counts.shape[0], counts.shape[1], 4), np.uint8)
            pixels[..., :3] = (color.red(), color.green(), color.blue())
            pixels[..., 3] = np.rint(225.0 * shares**1.15)
            self._background = key, _image(pixels)
        corner, end = self.at((histogram.low, histogram.top)), self.at((histogram.high, 0.0))
        painter.drawImage(QRectF(corner, end), self._background[1])

    def _draw_colors(self, painter: QPainter) -> None:
        columns, rows = (max(1, round(n / CELL)) for n in (self.area.width(), self.area.height()))
        ends = (self.values.low, self.values.high, self.gradients.low, self.gradients.high)
        key = (self.function, ends, columns, rows)
        if self._colors is None or self._colors[0] != key:
            values = self.values.low + self.values.span * (np.arange(columns) + 0.5) / columns
            gradients = self.gradients.high - self.gradients.span * (np.arange(rows) + 0.5) / rows
            matter = self.function.evaluate(values[None, :], gradients[:, None])
            opacity = -np.expm1(-matter[..., 3] * self.function.reference_length)
            pixels = np.empty((rows, columns, 4), np.uint8)
            pixels[..., :3] = np.rint(srgb_encode(np.clip(matter[..., :3], 0.0, 1.0)) * 255.0)
            # The fourth root shows what is thin as well: opacities per millimetre are small.
            pixels[..., 3] = np.rint(150.0 * opacity**0.25)
            self._colors = key, _image(pixels)
        painter.drawImage(self.area, self._colors[1])

    def _draw_outlines(self, painter: QPainter, palette: QPalette) -> None:
        painter.setBrush(Qt.BrushStyle.NoBrush)
        for place, area in enumerate(self.function.areas):
            chosen, hovered = place == self.selected, place == self.hovered
            color = accent(palette) if chosen else ink(palette, 0.9 if hovered else 0.6)
            for turn, line in enumerate(areas.outlines(area)):
                style = Qt.PenStyle.DashLine if turn else Qt.PenStyle.SolidLine
                polygon = QPolygonF([self.at(point) for point in line])
                painter.setPen(QPen(palette.base().color(), 3.4 if not turn else 0.0))
                if not turn:
                    painter.drawPolygon(polygon)
                painter.setPen(QPen(color, 1.8 if (chosen or hovered) and not turn else 1.2, style))
                painter.drawPolygon(polygon)

    def _draw_numbers(self, painter: QPainter, palette: QPalette) -> None:
        font = painter.font()
        font.setPointSizeF(max(7.0, font.pointSizeF() * 0.8))
        painter.setFont(font)
        unit = self.histogram.unit if self.histogram is not None else ""
        draw_values(painter, palette, self.values, self.area, self.area.bottom(), unit)
        painter.setPen(ink(palette, 0.7))
        flags = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        for tick in self._ticks():
            y = self.at((self.values.low, tick)).y()
            painter.drawText(QRectF(0.0, y - 7.0, LEFT - 5.0, 14.0), flags, f"{tick:.4g}")
        name = f"gradient, {self.histogram.unit_per_mm}" if self.histogram is not None else "gradient"
        flags = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop
        painter.drawText(self.area.adjusted(6.0, 3.0, -6.0, 0.0), flags, name)

    def _draw_handles(self, painter: QPainter, palette: QPalette) -> None:
        area = self.function.areas[self.selected or 0]
        for point in areas.handles(area).values():
            at = self.at(point)
            box = QRectF(at.x() - HANDLE, at.y() - HANDLE, 2 * HANDLE, 2 * HANDLE)
            painter.setPen(QPen(palette.base().color(), 3.4))
            painter.setBrush(to_qcolor(area.color))
            painter.drawRoundedRect(box, 1.5, 1.5)
            painter.setPen(QPen(accent(palette), 1.5))
            painter.drawRoundedRect(box, 1.5, 1.5)


def _image(pixels: np.ndarray) -> QImage:
    """A picture of its own of bytes (rows, columns, 4): red, green, blue, alpha."""
    rows, columns = pixels.shape[:2]
    return QImage(pixels.data, columns, rows, 4 * columns, QImage.Format.Format_RGBA8888).copy()
