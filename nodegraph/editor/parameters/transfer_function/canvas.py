"""The plot of a transfer function that the user works on."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial

from PySide6.QtCore import QEvent, QPoint, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QContextMenuEvent, QKeyEvent, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QMenu, QWidget

from nodegraph.editor.parameters.field import pace, wheel_steps
from nodegraph.editor.parameters.function_board import ZOOM
from nodegraph.editor.parameters.transfer_function import grips, keys, snap
from nodegraph.editor.parameters.transfer_function.axes import height, opacity, opacity_ticks
from nodegraph.editor.parameters.transfer_function.bells import Shape
from nodegraph.editor.parameters.transfer_function.board import Board
from nodegraph.editor.parameters.transfer_function.grips import Grip, Move
from nodegraph.editor.parameters.transfer_function.snap import Catch
from nodegraph.errors import ParameterError

GAP = 1.0  #: pixels that neighbouring keys keep while one is dragged, so that no step comes about by chance
BELL_WIDTH = 1.0 / 16.0  #: of the values that are seen
BAND = 8.0  #: pixels on either side of the mouse that the views are asked to show
FACTORS = (0.1, 0.5, 2.0, 10.0)


class Canvas(Board):
    """Keys and bells are dragged; a double click adds a key; the wheel zooms; a drag beside them moves the values.

    ``edited(shape)`` is what the user wants; ``began``, ``ended``, ``cancelled`` enclose a drag; ``stepped(shape)`` is
    one step of an arrow key. ``color_wanted(point)``: what is chosen was double-clicked. ``pointed(band)``: the views
    are to show which parts have these values, None: nothing any more. ``refused(text)``: why something was not done.
    """

    pointed = Signal(object)
    refused = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.snaps = True
        self.pointing = False  # whether hovering shows in the views what has these values
        self.other_values: Callable[[], Iterable[float]] = tuple  # keys of other functions of the document
        self._move: Move | None = None
        self._grip = QPointF()
        self._catches: list[Catch] = []
        self._pan: QPointF | None = None
        self._rubber: QPointF | None = None
        self._mouse: QPointF | None = None
        self._space = False

    # -- the mouse ----------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        point, modifiers = event.position(), event.modifiers()
        if event.button() is Qt.MouseButton.LeftButton:
            grip = self.plot.grip_at(point)
            if grip is not None and modifiers & Qt.KeyboardModifier.ControlModifier:
                self.choose(self.plot.chosen ^ {grip})
            elif grip is not None:
                self._hold(grip, point)
            elif modifiers & Qt.KeyboardModifier.ShiftModifier:
                self._rubber = point
            else:
                self.choose([])
                self._pan = point
                self.setCursor(Qt.CursorShape.ClosedHandCursor)
        elif event.button() is Qt.MouseButton.MiddleButton:
            self._pan = point
        elif event.button() is Qt.MouseButton.RightButton:
            grip = self.plot.grip_at(point)
            if grip is None or grip not in self.plot.chosen:
                self.choose([grip] if grip is not None and grip.kind in ("key", "bell") else [])

    def _hold(self, grip: Grip, point: QPointF) -> None:
        if grip.kind in ("key", "bell") and grip not in self.plot.chosen:
            self.choose([grip])
        gap = self.plot.axis.span / max(1.0, self.plot.area.width()) * GAP
        self._move = Move(self.shape, self.plot.chosen, grip, gap, self.plot.scale)
        self._grip = self.plot.at(grip) - point
        self._catches = self._values_to_catch() if self.snaps else []
        self.began.emit()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        point = self._mouse = event.position()
        if self._move is not None:
            self._drag(point + self._grip, event.modifiers())
        elif self._rubber is not None:
            self.plot.rubber = QRectF(self._rubber, point).normalized()
            self.choose(self.plot.grips_in(self.plot.rubber))
        elif self._pan is not None:
            self.pan(point.x() - self._pan.x())
            self._pan = point
        else:
            self.plot.hovered = self.plot.grip_at(point)
            over = self.plot.hovered is not None
            self.setCursor(Qt.CursorShape.PointingHandCursor if over else Qt.CursorShape.ArrowCursor)
            self._point()
        self.read(point, self._move.held if self._move is not None else None)
        self.update()

    def _drag(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        move = self._move
        if move is None:
            return
        value, up = self.plot.rounded(point.x()), self.plot.opacity(point.y())
        start_value, start_up = grips.position(move.shape, move.held)
        across: Catch | None = None
        above: Catch | None = None
        if self.snaps and not modifiers & Qt.KeyboardModifier.AltModifier:
            across = snap.nearest(value, self._catches, snap.REACH * self.plot.axis.span / self.plot.area.width())
            above = self._caught_height(point.y(), move)
        if modifiers & Qt.KeyboardModifier.ShiftModifier:  # along the axis that the mouse went farther
            start = QPointF(self.plot.x(start_value), self.plot.y(start_up))
            if abs(point.x() - start.x()) > abs(point.y() - start.y()):
                up, above = start_up, None
            else:
                value, across = start_value, None
        value = across.place if across is not None else value
        up = above.place if above is not None else up
        self.plot.guides = (across, above if move.held.kind in ("key", "bell") else None)
        self.offer(partial(move.to, value, up))

    def _values_to_catch(self) -> list[Catch]:
        """Values that a drag catches on, the rarer kinds first."""
        move, plot = self._move, self.plot
        assert move is not None
        still = grips.every(self.shape) - move.grips - {move.held}
        found = [Catch(grips.position(self.shape, grip)[0], "key" if grip.kind == "key" else "bell") for grip in still]
        found += [Catch(value, "key of another function") for value in self.other_values()]
        if plot.histogram is not None:
            found += [Catch(value, "peak") for value in snap.peaks(plot.histogram)]
        return found + [Catch(value, "") for value in plot.axis.ticks(max(2, int(plot.area.width() // 40)))]

    def _caught_height(self, y: float, move: Move) -> Catch | None:
        """The opacity that a drag catches on, by its height on the screen."""
        still = grips.every(move.shape) - move.grips - {move.held}
        ups = [(grips.position(move.shape, grip)[1], "same opacity") for grip in sorted(still)]
        ups += [(up, "") for up in opacity_ticks(self.plot.scale)]
        caught = snap.nearest(y, [Catch(self.plot.y(up), str(place)) for place, (up, _) in enumerate(ups)], snap.REACH)
        return Catch(*ups[int(caught.what)]) if caught is not None else None

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._move is not None and event.button() is Qt.MouseButton.LeftButton:
            self._let_go()
            self.ended.emit()
        self._pan = self._rubber = self.plot.rubber = None
        self.read(event.position())
        self.unsetCursor()
        self.update()

    def hideEvent(self, event: QEvent) -> None:
        """What was held is let go; whoever hides the plot ends the gesture."""
        self._let_go()
        self._pan = self._rubber = self.plot.rubber = self._mouse = None

    def _let_go(self) -> None:
        self._move = None
        self.plot.guides = (None, None)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() is not Qt.MouseButton.LeftButton:
            return
        point = event.position()
        grip = self.plot.grip_at(point)
        if grip is not None and grip.kind in ("key", "bell"):
            self.choose([grip])
            self.ask_color()
        elif grip is None:
            self.add_key(self.plot.rounded(point.x()), self.plot.opacity(point.y()))

    def wheelEvent(self, event: QWheelEvent) -> None:
        if not self.hasFocus():
            event.ignore()  # the panel scrolls
            return
        if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            self.pan(wheel_steps(event) * 40.0)
        else:
            self.zoom(ZOOM ** wheel_steps(event), event.position().x())
        event.accept()

    def leaveEvent(self, event: QEvent) -> None:
        self.readout = ""
        self.plot.hovered = self._mouse = None
        self._space = False
        self._point()
        self.update()

    # -- which parts have these values ------------------------------------------------------------------------------

    def set_pointing(self, on: bool) -> None:
        """Whether hovering shows in the views what has the values under the mouse; the space bar always does."""
        self.pointing = on
        self._point()

    def _point(self) -> None:
        area, mouse = self.plot.area, self._mouse
        band = None
        if mouse is not None and (self.pointing or self._space) and area.left() <= mouse.x() <= area.right():
            band = (self.plot.value(mouse.x() - BAND), self.plot.value(mouse.x() + BAND))
        if band != self.plot.band:
            self.show_band(band)
            self.pointed.emit(band)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            self._space = False
            self._point()
        else:
            super().keyReleaseEvent(event)

    def focusOutEvent(self, event: QEvent) -> None:
        self._space = False
        self._point()
        self.update()

    # -- edits --------------------------------------------------------------------------------------------------

    def offer(self, make: Callable[[], Shape], step: bool = False) -> bool:
        """Report the shape that ``make`` makes, or why there is none."""
        try:
            shape = make()
        except ParameterError as error:
            self.refused.emit(str(error))
            return False
        (self.stepped if step else self.edited).emit(shape)
        return True

    def add_key(self, value: float, up: float | None = None) -> None:
        """Add a key, on the curve unless an opacity is given, and choose it."""
        added = keys.insert(self.shape.base, value, up)
        if added is not None:
            self.edited.emit(self.shape.with_base(added[0]))
            self.choose([grips.key(added[1])])

    def add_bell(self, value: float | None = None) -> None:
        """Add a bell at a value, or in the middle, in a colour unlike those that are there, and choose it."""
        axis, place = self.plot.axis, len(self.shape.bells)
        center = axis.rounded(axis.value(0.5) if value is None else value, round(self.plot.area.width()))
        width = float(f"{axis.span * BELL_WIDTH:.2g}")
        self.edited.emit(self.shape.with_bell(place, grips.new_bell(center, width, 0.5, grips.fresh_color(place))))
        self.choose([grips.bell(place)])

    def delete(self) -> None:
        """Delete what is chosen."""
        gone = self.plot.chosen
        if gone:
            self.choose([])
            self.edited.emit(grips.remove(self.shape, gone))

    def toggle_step(self) -> None:
        """Make two keys at one value of the chosen one, or one of two."""
        place, base = self.selected, self.shape.base
        if place is None:
            return
        other = keys.partner(base, place)
        if other is None:
            self.edited.emit(self.shape.with_base(keys.make_step(base, place)))
            self.choose([grips.key(place + 1)])
        else:
            self.edited.emit(self.shape.with_base(keys.join_step(base, place)))
            self.choose([grips.key(min(place, other))])

    def change(self, tool: str, factor: float = 1.0) -> None:
        """Do one of the tools of `grips.change` to what is chosen, or to everything."""
        which = sorted(self.plot.chosen if len(self.plot.chosen) > 1 else grips.every(self.shape))
        if which:
            self.offer(partial(grips.change, self.shape, which, tool, factor))

    def ask_color(self) -> None:
        """Ask for the colour of what is chosen."""
        if self.plot.chosen:
            self.color_wanted.emit(self.mapToGlobal(self.plot.at(min(self.plot.chosen)).toPoint() + QPoint(12, 12)))

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        if event.reason() is QContextMenuEvent.Reason.Mouse and not self.plot.area.contains(QPointF(event.pos())):
            event.ignore()  # the parameter's own menu
            return
        self.menu(self.plot.value(event.pos().x())).popup(event.globalPos())

    def menu(self, value: float | None = None) -> QMenu:
        """What can be done here. It deletes itself when it closes. value: where a new key or bell goes."""
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        place = self.selected
        if value is None:
            value = self.plot.axis.value(0.5)
        value = self.plot.axis.rounded(value, round(self.plot.area.width()))
        menu.addAction("Add a key\tDouble-click", partial(self.add_key, value))
        menu.addAction("Add a bell\tB", partial(self.add_bell, value))
        menu.addSeparator()
        menu.addAction("Colour …\tC", self.ask_color).setEnabled(bool(self.plot.chosen))
        joined = place is not None and keys.partner(self.shape.base, place) is not None
        words = "Join the step" if joined else "Split into a step"
        menu.addAction(words, self.toggle_step).setEnabled(place is not None)
        menu.addAction("Delete\tDel", self.delete).setEnabled(bool(self.plot.chosen))
        menu.addAction("Choose all\tCtrl+A", self.choose_all)
        menu.addSeparator()
        several = len(self.plot.chosen) > 1
        menu.addAction("Mirror left and right", partial(self.change, "mirror"))
        menu.addAction("Turn upside down", partial(self.change, "turn_over"))
        menu.addAction("Reverse the colours", partial(self.change, "reverse_colors"))
        denser = menu.addMenu("Density of what is chosen" if several else "Density of everything")
        for factor in FACTORS:
            denser.addAction(f"× {factor:g}", partial(self.change, "thicker", factor))
        menu.addSeparator()
        catching = menu.addAction("Drags catch on keys, peaks and round numbers")
        catching.setCheckable(True)
        catching.setChecked(self.snaps)
        catching.toggled.connect(partial(setattr, self, "snaps"))
        return menu

    # -- the keyboard -------------------------------------------------------------------------------------------

    def keys(self) -> dict[Qt.Key, Callable[[], object]]:
        return super().keys() | {Qt.Key.Key_B: self.add_bell}

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key, control = Qt.Key(event.key()), bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        if key == Qt.Key.Key_Space:
            self._space = True
            self._point()
        elif key == Qt.Key.Key_A and control:
            self.choose_all()
        else:
            super().keyPressEvent(event)

    def let_go(self) -> bool:
        held = self._move is not None
        self._let_go()
        return held

    def has_choice(self) -> bool:
        return bool(self.plot.chosen)

    def nudge(self, sideways: int, upwards: int, modifiers: Qt.KeyboardModifier) -> None:
        """Move what is chosen by a pixel, or by a hundredth of the axis upwards, at the pace of the modifiers."""
        size = pace(modifiers)
        held = min(self.plot.chosen)
        value, up = grips.position(self.shape, held)
        pixel, width = self.plot.axis.span / max(1.0, self.plot.area.width()), self.plot.area.width()
        if sideways:
            value = self.plot.axis.rounded(value + sideways * pixel * size, max(1, round(width / min(1.0, size))))
        if upwards:
            up = opacity(float(height(up, self.plot.scale)) + upwards * 0.01 * size, self.plot.scale)
            up = float(f"{up:.3g}")
        move = Move(self.shape, self.plot.chosen, held, pixel * GAP, self.plot.scale)
        self.offer(partial(move.to, value, up), step=True)
