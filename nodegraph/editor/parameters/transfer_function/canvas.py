"""The plot of a transfer function that the user works on."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QEvent, QPoint, QPointF, QSize, Qt, Signal
from PySide6.QtGui import QContextMenuEvent, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QMenu, QSizePolicy, QWidget

from nodegraph.data import TransferFunction
from nodegraph.editor.parameters.field import pace, wheel_steps
from nodegraph.editor.parameters.transfer_function import keys
from nodegraph.editor.parameters.transfer_function.axes import height, opacity
from nodegraph.editor.parameters.transfer_function.histogram import Histogram
from nodegraph.editor.parameters.transfer_function.plot import Plot

GAP = 1.0  #: pixels that neighbouring keys keep while one is dragged, so that no step comes about by chance
ZOOM = 1.2  #: for each notch of the wheel


class Canvas(QWidget):
    """Keys are dragged; a double click adds one; the wheel zooms; a drag beside the keys moves the range of values.

    ``edited(function)`` is what the user wants; ``began``, ``ended``, ``cancelled`` enclose a drag; ``stepped`` is one
    step of an arrow key. ``chosen(place)`` says which key is selected, None for none. ``color_wanted(point)``: the
    selected key was double-clicked.
    """

    edited = Signal(object)
    stepped = Signal(object)
    began = Signal()
    ended = Signal()
    cancelled = Signal()
    chosen = Signal(object)
    color_wanted = Signal(QPoint)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.plot = Plot()
        self._held: int | None = None
        self._grip = QPointF()
        self._pan: QPointF | None = None
        self._readout = ""
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumHeight(190)
        self.setAccessibleName("Transfer function")

    def sizeHint(self) -> QSize:
        return QSize(320, 210)

    # -- what is shown ------------------------------------------------------------------------------------------

    @property
    def function(self) -> TransferFunction:
        return self.plot.function

    @property
    def selected(self) -> int | None:
        """Place of the selected key."""
        return self.plot.selected

    def show_function(self, function: TransferFunction) -> None:
        if function == self.plot.function:
            return
        self.plot.function = function
        if self.selected is not None and self.selected >= len(function.keys):
            self.select(None)
        self.update()

    def show_histogram(self, histogram: Histogram | None) -> None:
        self.plot.histogram = histogram
        self.update()

    def set_scale(self, scale: str) -> None:
        """The scale of the opacity: "linear", "power" or "logarithmic"."""
        self.plot.scale = scale
        self.update()

    def set_histogram_scale(self, scale: str) -> None:
        """The scale of the histogram: "linear" or "logarithmic"."""
        self.plot.histogram_scale = scale
        self.update()

    def select(self, place: int | None) -> None:
        if place != self.plot.selected:
            self.plot.selected = place
            self.chosen.emit(place)
            self.update()

    def fit(self) -> None:
        """Show all keys and the usual values of the data."""
        ends = list(self.function.domain) if self.function.keys else []
        if self.plot.histogram is not None:
            ends += self.plot.histogram.usual()
        if not ends:
            ends = [0.0, 1.0]
        self.plot.axis.show(min(ends), max(ends), 0.03)
        self.update()

    def place_of(self, place: int) -> QPointF:
        """Where a key lies on this widget."""
        key = self.function.keys[place]
        return QPointF(self.plot.x(key.value), self.plot.y(key.opacity))

    def resizeEvent(self, event: QResizeEvent) -> None:
        self.plot.resize(self.width(), self.height())

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        self.plot.draw(painter, self.palette(), self.isEnabled())
        area = self.plot.area
        if self._readout:
            painter.setPen(self.palette().text().color())
            corner = area.adjusted(6, 3, -6, 0)
            painter.drawText(corner, Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignRight, self._readout)
        elif not self.function.keys:
            painter.setPen(self.palette().placeholderText().color())
            painter.drawText(area, Qt.AlignmentFlag.AlignCenter, "Double-click to add a key")

    # -- the mouse ----------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        point = event.position()
        if event.button() is Qt.MouseButton.LeftButton:
            place = self.plot.key_at(point)
            self.select(place)
            if place is None:
                self._pan = point
                self.setCursor(Qt.CursorShape.ClosedHandCursor)
            else:
                self._held = place
                self._grip = self.place_of(place) - point
                self.began.emit()
        elif event.button() is Qt.MouseButton.MiddleButton:
            self._pan = point
        elif event.button() is Qt.MouseButton.RightButton:
            self.select(self.plot.key_at(point))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        point = event.position()
        if self._held is not None:
            self._drag(point + self._grip, event.modifiers())
        elif self._pan is not None:
            self.plot.axis.pan(self.plot.value(self._pan.x()) - self.plot.value(point.x()))
            self._pan = point
        else:
            self.plot.hovered = self.plot.key_at(point)
            over = self.plot.hovered is not None
            self.setCursor(Qt.CursorShape.PointingHandCursor if over else Qt.CursorShape.ArrowCursor)
        self._read(point)
        self.update()

    def _drag(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        place, area = self._held, self.plot.area
        if place is None or place >= len(self.function.keys):
            self._held = None
            return
        key = self.function.keys[place]
        value = self.plot.axis.rounded(self.plot.value(point.x()), round(area.width()))
        up = opacity((area.bottom() - point.y()) / area.height(), self.plot.scale)
        up = float(f"{up:.3g}")
        if modifiers & Qt.KeyboardModifier.ShiftModifier:  # along the axis that the mouse went farther
            start = self.place_of(place)
            if abs(point.x() - start.x()) > abs(point.y() - start.y()):
                up = key.opacity
            else:
                value = key.value
        gap = self.plot.axis.span / max(1.0, area.width()) * GAP
        self.edited.emit(keys.move(self.function, place, value, up, gap))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._held is not None and event.button() is Qt.MouseButton.LeftButton:
            self._held = None
            self.ended.emit()
        self._pan = None
        self.unsetCursor()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() is not Qt.MouseButton.LeftButton:
            return
        point = event.position()
        place = self.plot.key_at(point)
        if place is not None:
            self.select(place)
            self.color_wanted.emit(self.mapToGlobal(self.place_of(place).toPoint() + QPoint(12, 12)))
            return
        area = self.plot.area
        value = self.plot.axis.rounded(self.plot.value(point.x()), round(area.width()))
        up = float(f"{opacity((area.bottom() - point.y()) / area.height(), self.plot.scale):.3g}")
        added = keys.insert(self.function, value, up)
        if added is not None:
            function, place = added
            self.edited.emit(function)
            self.select(place if place < len(self.function.keys) else None)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if not self.hasFocus():
            event.ignore()  # the panel scrolls
            return
        self.plot.axis.zoom(ZOOM ** wheel_steps(event), self.plot.value(event.position().x()))
        self.update()
        event.accept()

    def leaveEvent(self, event: QEvent) -> None:
        self._readout = ""
        self.plot.hovered = None
        self.update()

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        if self.selected is None:
            event.ignore()  # the parameter's own menu
            return
        self.menu().popup(event.globalPos())

    def menu(self) -> QMenu:
        """What can be done with the selected key. It deletes itself when it closes."""
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        place = self.selected
        if place is None:
            return menu
        menu.addAction("Colour …", lambda: self.color_wanted.emit(self.mapToGlobal(self.place_of(place).toPoint())))
        if keys.partner(self.function, place) is None:
            menu.addAction("Make a step", self.toggle_step)
        else:
            menu.addAction("Join the step", self.toggle_step)
        menu.addAction("Delete", self.delete)
        return menu

    def _read(self, point: QPointF) -> None:
        """Say which value and opacity the mouse is at, or those of the key that it holds."""
        unit = f" {self.plot.histogram.unit}" if self.plot.histogram is not None else ""
        place = self._held if self._held is not None else self.plot.hovered
        if place is not None and place < len(self.function.keys):
            key = self.function.keys[place]
            self._readout = f"{key.value:.6g}{unit}, {keys.legible(key.opacity)}"
        elif self.plot.area.contains(point):
            value = self.plot.axis.rounded(self.plot.value(point.x()), round(self.plot.area.width()))
            self._readout = f"{value:.6g}{unit}"
        else:
            self._readout = ""

    # -- keys ---------------------------------------------------------------------------------------------------

    def delete(self) -> None:
        """Delete the selected key."""
        if self.selected is not None:
            place = self.selected
            self.select(None)
            self.edited.emit(keys.remove(self.function, place))

    def toggle_step(self) -> None:
        """Make two keys at one value of the selected one, or one of two."""
        place = self.selected
        if place is None:
            return
        if keys.partner(self.function, place) is None:
            self.edited.emit(keys.make_step(self.function, place))
        else:
            first = min(place, keys.partner(self.function, place) or 0)
            function = keys.join_step(self.function, place)
            self.select(first)
            self.edited.emit(function)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key, place = event.key(), self.selected
        control = bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        sideways = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}.get(Qt.Key(key), 0)
        upwards = {Qt.Key.Key_Down: -1, Qt.Key.Key_Up: 1}.get(Qt.Key(key), 0)
        if key == Qt.Key.Key_Escape and self._held is not None:
            self._held = None
            self.cancelled.emit()
        elif key in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace) and place is not None:
            self.delete()
        elif sideways and (control or place is None) and self.function.keys:
            last = len(self.function.keys) - 1
            self.select(min(last, max(0, place + sideways)) if place is not None else 0 if sideways > 0 else last)
        elif (sideways or upwards) and place is not None:
            self._nudge(place, sideways, upwards, pace(event.modifiers() & ~Qt.KeyboardModifier.ControlModifier))
        elif key == Qt.Key.Key_Home:
            self.fit()
        else:
            super().keyPressEvent(event)

    def _nudge(self, place: int, sideways: int, upwards: int, size: float) -> None:
        old, pixel = self.function.keys[place], self.plot.axis.span / max(1.0, self.plot.area.width())
        value = old.value
        if sideways:
            value = self.plot.axis.rounded(old.value + sideways * pixel * size, round(self.plot.area.width() / size))
        up = old.opacity
        if upwards:
            up = opacity(float(height(old.opacity, self.plot.scale)) + upwards * 0.01 * size, self.plot.scale)
            up = float(f"{up:.3g}")
        self.stepped.emit(keys.move(self.function, place, value, up, pixel * GAP))

    def changeEvent(self, event: Any) -> None:
        super().changeEvent(event)
        self.update()
