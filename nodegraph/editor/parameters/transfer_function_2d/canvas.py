"""The plane of values and gradient magnitudes that the user works on."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QEvent, QPoint, QPointF, Qt, Signal
from PySide6.QtGui import QContextMenuEvent, QMouseEvent, QPainter, QPaintEvent, QWheelEvent
from PySide6.QtWidgets import QMenu, QWidget

from nodegraph.data import Gaussian, TransferFunction2D, Trapezoid
from nodegraph.data.transfer_function_2d import Area
from nodegraph.editor.parameters.field import pace, wheel_steps
from nodegraph.editor.parameters.function_board import ZOOM, FunctionBoard
from nodegraph.editor.parameters.transfer_function_2d import areas
from nodegraph.editor.parameters.transfer_function_2d.joint import JointHistogram
from nodegraph.editor.parameters.transfer_function_2d.plot import Plot

LEAST = 3.0  #: pixels that an area keeps while it is made smaller
COLORS = ((0.9, 0.35, 0.1), (0.1, 0.45, 0.8), (0.85, 0.7, 0.4), (0.2, 0.6, 0.2), (0.6, 0.2, 0.6))  #: of new areas
OPACITY, SOFTNESS = 0.3, 0.4  #: of new areas
_CURSORS = {
    "left": Qt.CursorShape.SizeHorCursor, "right": Qt.CursorShape.SizeHorCursor,
    "bottom": Qt.CursorShape.SizeVerCursor, "top": Qt.CursorShape.SizeVerCursor,
}  # fmt: skip


class Canvas(FunctionBoard):
    """Areas are dragged, and reshaped by their handles; a double click beside them adds one; the wheel zooms.

    ``edited(function)`` is what the user wants; ``began``, ``ended``, ``cancelled`` enclose a drag; ``stepped`` is one
    step of an arrow key. ``chosen(place)`` says which area is selected, None for none. ``color_wanted(point)``: the
    selected area was double-clicked.
    """

    chosen = Signal(object)
    plot: Plot

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("Transfer function over value and gradient magnitude", 210, parent)
        self.plot = Plot()
        self._held: tuple[str, Area, areas.Point] | None = None  # handle, the area as it was, where
        self._pan: QPointF | None = None

    # -- what is shown ------------------------------------------------------------------------------------------

    @property
    def function(self) -> TransferFunction2D:
        return self.plot.function

    @property
    def selected(self) -> int | None:
        """Place of the selected area."""
        return self.plot.selected

    @property
    def area(self) -> Area | None:
        """The selected area."""
        return None if self.selected is None else self.function.areas[self.selected]

    def show_function(self, function: TransferFunction2D) -> None:
        if function == self.plot.function:
            return
        if self.selected is not None and self.selected >= len(function.areas):
            self.select(None)
        self.plot.function = function
        self.plot.hovered = None
        self.update()

    def show_histogram(self, histogram: JointHistogram | None) -> None:
        self.plot.histogram = histogram
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
        """Show all areas and the usual values and magnitudes of the data."""
        values, gradients = ([*ends] for ends in self.function.domain) if self.function.areas else ([], [])
        if self.plot.histogram is not None:
            low, high, top = self.plot.histogram.usual()
            values, gradients = [*values, low, high], [*gradients, top]
        values, gradients = values or [0.0, 1.0], gradients or [1.0]
        self.plot.values.show(min(values), max(values), 0.03)
        self.plot.gradients.show(0.0, 1.06 * max(gradients))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        self.plot.draw(painter, self.palette(), self.isEnabled())
        if self.readout:
            self.draw_readout(painter)
        elif not self.function.areas:
            self.draw_hint(painter, "Double-click to add a rectangle")

    # -- the mouse ----------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        at = event.position()
        if event.button() is Qt.MouseButton.LeftButton:
            handle = self.plot.handle_at(at)
            if handle is None:
                self.select(self.plot.area_at(at))
            area = self.area
            if area is None:
                self._pan = at
                self.setCursor(Qt.CursorShape.ClosedHandCursor)
            else:
                self._held = handle or "", area, self.plot.point(at)
                self.began.emit()
        elif event.button() is Qt.MouseButton.MiddleButton:
            self._pan = at
        elif event.button() is Qt.MouseButton.RightButton:
            self.select(self.plot.area_at(at))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        at = event.position()
        if self._held is not None:
            self._drag(at, event.modifiers())
        elif self._pan is not None:
            (before, low), (after, high) = self.plot.point(self._pan), self.plot.point(at)
            self.plot.values.pan(before - after)
            self.plot.gradients.pan(max(low - high, -self.plot.gradients.low))
            self._pan = at
        else:
            self.plot.hovered = self.plot.area_at(at)
            handle = self.plot.handle_at(at)
            over = Qt.CursorShape.ArrowCursor if self.plot.hovered is None else Qt.CursorShape.SizeAllCursor
            self.setCursor(over if handle is None else _CURSORS.get(handle, Qt.CursorShape.CrossCursor))
        self._read(at)
        self.update()

    def _drag(self, at: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        place = self.selected
        if self._held is None or place is None:
            self._held = None
            return
        handle, before, grip = self._held
        point = self.plot.point(at)
        if handle:
            wide, high = self.plot.pixel()
            area = areas.resized(before, handle, self.plot.rounded(point), (LEAST * wide, LEAST * high))
        else:
            across, along = self.plot.rounded((point[0] - grip[0], point[1] - grip[1]))
            if modifiers & Qt.KeyboardModifier.ShiftModifier:  # along the axis that the mouse went farther
                far = self.plot.at(grip) - at
                across, along = (across, 0.0) if abs(far.x()) > abs(far.y()) else (0.0, along)
            area = areas.moved(before, across, along)
        self.edited.emit(areas.replaced(self.function, place, area))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._held is not None and event.button() is Qt.MouseButton.LeftButton:
            self._held = None
            self.ended.emit()
        self._pan = None
        self.unsetCursor()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() is not Qt.MouseButton.LeftButton:
            return
        at = event.position()
        place = self.plot.area_at(at)
        if place is None:
            self.add_rectangle(self.plot.point(at))
        else:
            self.select(place)
            self.color_wanted.emit(self.mapToGlobal(at.toPoint() + QPoint(12, 12)))

    def wheelEvent(self, event: QWheelEvent) -> None:
        if not self.hasFocus():
            event.ignore()  # the panel scrolls
            return
        value, gradient = self.plot.point(event.position())
        factor = ZOOM ** wheel_steps(event)
        if event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            axis = self.plot.gradients
            axis.zoom(factor, gradient)
            axis.show(max(0.0, axis.low), axis.high)
        else:
            self.plot.values.zoom(factor, value)
        self.update()
        event.accept()

    def leaveEvent(self, event: QEvent) -> None:
        self.readout = ""
        self.plot.hovered = None
        self.update()

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        if self.selected is None:
            event.ignore()  # the parameter's own menu
            return
        self.menu().popup(event.globalPos())

    def menu(self) -> QMenu:
        """What can be done with the selected area. It deletes itself when it closes."""
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        area = self.area
        if area is None:
            return menu
        menu.addAction("Colour …\tC", self.ask_color)
        if isinstance(area, Trapezoid) and area.bottom != area.top:
            menu.addAction("Make it a rectangle", lambda: self.put(areas.straightened(area)))
        menu.addAction("Delete\tDel", self.delete)
        return menu

    def _read(self, at: QPointF) -> None:
        """Say which value and magnitude the mouse is at."""
        if not self.plot.area.contains(at):
            self.readout = ""
            return
        value, gradient = self.plot.rounded(self.plot.point(at))
        histogram = self.plot.histogram
        unit = f" {histogram.unit}" if histogram is not None and histogram.unit else ""
        self.readout = f"{value:.6g}{unit}, {gradient:.6g}{unit}/mm" if unit else f"{value:.6g}, {gradient:.6g}/mm"

    # -- areas --------------------------------------------------------------------------------------------------

    def put(self, area: Area) -> None:
        """Put another area in the place of the selected one."""
        if self.selected is not None:
            self.edited.emit(areas.replaced(self.function, self.selected, area))

    def add_rectangle(self, point: areas.Point | None = None) -> None:
        """Add a rectangle about a point, by default the middle of what is shown, and select it."""
        value, gradient = self._middle() if point is None else point
        wide, high = 0.09 * self.plot.values.span, 0.12 * self.plot.gradients.span
        low, (left, right) = max(0.0, gradient - high), (value - wide, value + wide)
        ends = (self.plot.rounded((left, low)), self.plot.rounded((right, low + 2.0 * high)))
        values, gradients = zip(*ends, strict=True)
        self._add(Trapezoid.rectangle(values, gradients, self._color(), OPACITY, SOFTNESS))

    def add_gaussian(self) -> None:
        """Add a Gaussian in the middle of what is shown, and select it."""
        sigma = self.plot.rounded((0.06 * self.plot.values.span, 0.08 * self.plot.gradients.span))
        self._add(Gaussian(self.plot.rounded(self._middle()), sigma, self._color(), OPACITY))

    def delete(self) -> None:
        """Delete the selected area."""
        if self.selected is not None:
            place = self.selected
            self.select(None)
            self.edited.emit(areas.removed(self.function, place))

    def _add(self, area: Area) -> None:
        place = len(self.function.areas)
        self.edited.emit(areas.added(self.function, area))
        if place < len(self.function.areas):
            self.select(place)

    def _middle(self) -> areas.Point:
        return self.plot.values.value(0.5), self.plot.gradients.value(0.5)

    def _color(self) -> tuple[float, float, float]:
        """A colour that no area has yet, as long as there is one."""
        used = {area.color for area in self.function.areas}
        return next((color for color in COLORS if color not in used), COLORS[len(used) % len(COLORS)])

    # -- the keyboard -------------------------------------------------------------------------------------------

    def keys(self) -> dict[Qt.Key, Callable[[], object]]:
        return super().keys() | {Qt.Key.Key_R: self.add_rectangle, Qt.Key.Key_G: self.add_gaussian}

    def let_go(self) -> bool:
        held, self._held = self._held is not None, None
        return held

    def has_choice(self) -> bool:
        return self.selected is not None

    def step_choice(self, by: int) -> None:
        """Select the next area or the one before; from none, the first or the last."""
        if self.function.areas:
            count = len(self.function.areas)
            self.select((0 if by > 0 else count - 1) if self.selected is None else (self.selected + by) % count)

    def ask_color(self) -> None:
        """Ask for the picker of the selected area's colour."""
        if self.area is not None:
            corner = self.plot.at(next(iter(areas.handles(self.area).values())))
            self.color_wanted.emit(self.mapToGlobal(corner.toPoint()))

    def zoom(self, factor: float) -> None:
        """Show ``1 / factor`` of the values and of the magnitudes."""
        value, _ = self._middle()
        self.plot.values.zoom(factor, value)
        self.plot.gradients.show(self.plot.gradients.low, self.plot.gradients.low + self.plot.gradients.span / factor)
        self.update()

    def nudge(self, sideways: int, upwards: int, modifiers: Qt.KeyboardModifier) -> None:
        """Move the selected area by a pixel; with Alt its right or upper side."""
        place = self.selected
        if place is None:
            return
        area, (wide, high) = self.function.areas[place], self.plot.pixel()
        size = pace(modifiers)
        across, along = sideways * wide * size, upwards * high * size
        if modifiers & Qt.KeyboardModifier.AltModifier:
            handle = "right" if sideways else "top"
            value, gradient = areas.handles(area)[handle]
            area = areas.resized(area, handle, (value + across, gradient + along), (LEAST * wide, LEAST * high))
        else:
            area = areas.moved(area, across, along)
        self.stepped.emit(areas.replaced(self.function, place, area))

    def changeEvent(self, event: Any) -> None:
        super().changeEvent(event)
        self.update()
