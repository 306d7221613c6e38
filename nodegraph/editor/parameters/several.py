"""Vector, Interval, Matrix, Box: several numbers in a row or a table."""

from __future__ import annotations

import math
from typing import Any

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QWheelEvent
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QSizePolicy, QVBoxLayout, QWidget

from nodegraph.editor.parameters.field import Field, is_shortcut, pace, wheel_steps
from nodegraph.editor.parameters.look import GAP, ROW_HEIGHT, accent, caption, ink
from nodegraph.editor.parameters.numbers import NumberEntry, Scale, stepped
from nodegraph.editor.parameters.simple import Switch
from nodegraph.params import Box, Float, Interval, Matrix, Vector


class Numbers(Field):
    """A field made of number entries, each for one place of a tuple."""

    def __init__(self, declaration: Any, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.entries: list[NumberEntry] = []
        self.values: list[Any] = []

    def make_entry(self, name: str, unit: str = "", integer: bool = False) -> NumberEntry:
        """The entry of the next number; ``name`` is what a screen reader says."""
        entry = NumberEntry(unit, integer)
        entry.setAccessibleName(name)
        index = len(self.entries)
        entry.entered.connect(lambda value: self._replace(index, value))
        entry.stepped.connect(lambda notches: self._step(index, notches))
        entry.misread.connect(self.refused)
        entry.installEventFilter(self)
        self.entries.append(entry)
        return entry

    def show_numbers(self, values: Any) -> None:
        self.values = list(values)
        for entry, value in zip(self.entries, self.values, strict=True):
            entry.show_number(value)

    def shape(self, values: list[Any]) -> Any:
        """The parameter's value from its numbers."""
        return tuple(values)

    def limits(self) -> Any:
        """The declaration whose limits hold for each number."""
        return self.declaration

    def _replace(self, index: int, value: Any) -> None:
        self.edited.emit(self.shape([*self.values[:index], value, *self.values[index + 1 :]]))

    def _step(self, index: int, notches: float) -> None:
        moved = stepped(self.limits(), self.values[index], notches)
        self.step_to(self.shape([*self.values[:index], moved, *self.values[index + 1 :]]))

    def eventFilter(self, watched: Any, event: QEvent) -> bool:
        if is_shortcut(event) or event.type() == QEvent.Type.FocusOut:
            self.settle()
        return super().eventFilter(watched, event)


class VectorField(Numbers):
    """Two to four numbers side by side."""

    def __init__(self, declaration: Vector, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        for axis in "xyzw"[: declaration.count]:
            layout.addWidget(self.make_entry(f"{declaration.name} {axis}", integer=declaration.integer))
        if declaration.unit:
            layout.addWidget(caption(declaration.unit))
        self.setFocusProxy(self.entries[0])

    def show_value(self, value: Any) -> None:
        self.show_numbers(value)


class Range(QWidget):
    """A groove with two handles; the part between them can be dragged as a whole."""

    moved = Signal(float, float)
    stepped = Signal(int, float)
    pressed = Signal()
    released = Signal()
    escaped = Signal()

    def __init__(self, scale: Scale, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.scale = scale
        self.low, self.high = scale.low, scale.high
        self.chosen = 0  # the handle that arrow keys move
        self._held: int | None = None  # 0, 1: a handle, 2: what lies between
        self._grip = 0.0
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)

    def sizeHint(self) -> QSize:
        return QSize(120, 20)

    def set_range(self, low: float, high: float) -> None:
        self.low, self.high = low, high
        self.update()

    def _groove(self) -> QRectF:
        return QRectF(7.0, self.height() / 2 - 2.0, self.width() - 14.0, 4.0)

    def _x(self, value: float) -> float:
        groove = self._groove()
        return groove.left() + self.scale.place(value) * groove.width()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        palette, groove = self.palette(), self._groove()
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ink(palette, 0.18))
        painter.drawRoundedRect(groove, 2, 2)
        color = accent(palette, self.isEnabled())
        painter.setBrush(color)
        low, high = self._x(self.low), self._x(self.high)
        painter.drawRect(QRectF(low, groove.top(), high - low, groove.height()))
        for index, x in enumerate((low, high)):
            focused = self.hasFocus() and index == self.chosen
            painter.setPen(QPen(ink(palette) if focused else palette.window().color(), 2.0))
            painter.drawEllipse(QPointF(x, groove.center().y()), 5.5, 5.5)

    def _place(self, x: float) -> float:
        groove = self._groove()
        return (x - groove.left()) / max(1.0, groove.width())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() is not Qt.MouseButton.LeftButton:
            super().mousePressEvent(event)
            return
        x, low, high = event.position().x(), self._x(self.low), self._x(self.high)
        if low + 8 < x < high - 8:
            self._held = 2
        else:
            nearer_low = abs(x - low) < abs(x - high) or (low == high and x < low)
            self._held = self.chosen = 0 if nearer_low else 1
        self._grip = self._place(x) - self.scale.place(self.low)
        self.pressed.emit()
        if self._held != 2:
            self.mouseMoveEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._held is None:
            return
        place = self._place(event.position().x())
        if self._held == 0:
            self.moved.emit(min(self.scale.value(place), self.high), self.high)
        elif self._held == 1:
            self.moved.emit(self.low, max(self.scale.value(place), self.low))
        else:
            width = self.scale.place(self.high) - self.scale.place(self.low)
            start = min(max(0.0, place - self._grip), 1.0 - width)
            self.moved.emit(self.scale.value(start), self.scale.value(start + width))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._held is not None and event.button() is Qt.MouseButton.LeftButton:
            self._held = None
            self.released.emit()

    def wheelEvent(self, event: QWheelEvent) -> None:
        # As on a slider: who scrolls the panel must not change what was passed on the way.
        if self.hasFocus() and self._held is None:
            self.stepped.emit(self.chosen, wheel_steps(event) * pace(event.modifiers()))
            event.accept()
        else:
            event.ignore()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key = event.key()
        if key in (Qt.Key.Key_Right, Qt.Key.Key_Up):
            self.stepped.emit(self.chosen, pace(event.modifiers()))
        elif key in (Qt.Key.Key_Left, Qt.Key.Key_Down):
            self.stepped.emit(self.chosen, -pace(event.modifiers()))
        elif key == Qt.Key.Key_Space:
            self.chosen = 1 - self.chosen
            self.update()
        elif key == Qt.Key.Key_Escape and self._held is not None:
            self._held = None
            self.escaped.emit()
        else:
            super().keyPressEvent(event)


class IntervalField(Numbers):
    """Low and high, with a slider of two handles where the soft range has both ends."""

    def __init__(self, declaration: Interval, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(2)
        self.range: Range | None = None
        low, high = declaration.soft_min, declaration.soft_max
        if low is not None and high is not None and math.isfinite(low) and math.isfinite(high) and low < high:
            self.range = Range(Scale(low, high))
            self.range.moved.connect(lambda a, b: self.edited.emit((a, b)))
            self.range.pressed.connect(self.began)
            self.range.released.connect(self.ended)
            self.range.escaped.connect(self.cancelled)
            self.range.stepped.connect(self._step)
            outer.addWidget(self.range)
        line = QHBoxLayout()
        line.setSpacing(GAP)
        line.addWidget(self.make_entry(f"{declaration.name} low", declaration.unit))
        line.addWidget(caption("to"))
        line.addWidget(self.make_entry(f"{declaration.name} high", declaration.unit))
        outer.addLayout(line)
        self.setFocusProxy(self.entries[0])

    def show_value(self, value: Any) -> None:
        self.show_numbers(value)
        if self.range is not None:
            self.range.set_range(*value)

    def _step(self, index: int, notches: float) -> None:
        moved = stepped(self.limits(), self.values[index], notches)
        low, high = self.values
        self.step_to((min(moved, high), high) if index == 0 else (low, max(moved, low)))


_FREE = Float(0.0, doc="A number without limits.")


class MatrixField(Numbers):
    """Four rows of four."""

    wide = True

    def __init__(self, declaration: Matrix, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        for row in range(4):
            for column in range(4):
                layout.addWidget(self.make_entry(f"{declaration.name} row {row + 1}, column {column + 1}"), row, column)
        self.setFocusProxy(self.entries[0])

    def limits(self) -> Any:
        return _FREE

    def show_value(self, value: Any) -> None:
        self.show_numbers([number for row in value for number in row])

    def shape(self, values: list[Any]) -> Any:
        return tuple(tuple(values[start : start + 4]) for start in range(0, 16, 4))


class BoxField(Numbers):
    """Everything, or a box by its low and high corner."""

    def __init__(self, declaration: Box, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self._last: Any = ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setHorizontalSpacing(4)
        layout.setVerticalSpacing(4)
        self.limited = Switch()
        self.limited.setAccessibleName(f"{declaration.name}: a part only")
        self.limited.setToolTip("Off: everything. On: what lies in the box.")
        self.limited.clicked.connect(lambda on: self.edited.emit(self._last if on else None))
        self._caption = caption()
        layout.addWidget(self.limited, 0, 0)
        layout.addWidget(self._caption, 0, 1, 1, 3)
        self._corners: list[QWidget] = []
        for row, corner in enumerate(("from", "to"), 1):
            name = caption(corner)
            layout.addWidget(name, row, 0)
            self._corners.append(name)
            for column, axis in enumerate("xyz", 1):
                entry = self.make_entry(f"{declaration.name} {corner} {axis}")
                self._corners.append(entry)
                layout.addWidget(entry, row, column)
        for column in (1, 2, 3):
            layout.setColumnStretch(column, 1)
        layout.setRowMinimumHeight(0, ROW_HEIGHT)
        self.setFocusProxy(self.limited)

    def limits(self) -> Any:
        return _FREE

    def show_value(self, value: Any) -> None:
        self.limited.setChecked(value is not None)
        unit = f", {self.declaration.unit}" if self.declaration.unit else ""
        self._caption.setText("everything" if value is None else f"x, y, z{unit}")
        for widget in self._corners:
            widget.setVisible(value is not None)
        if value is not None:
            self._last = value
            self.show_numbers([number for corner in value for number in corner])

    def shape(self, values: list[Any]) -> Any:
        return (tuple(values[:3]), tuple(values[3:]))
