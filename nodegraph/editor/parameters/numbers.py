"""Float, Int and Seed: a slider over the soft range, and an entry that takes what lies beyond it."""

from __future__ import annotations

import math
import random
from typing import Any

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QMouseEvent, QPainter, QPaintEvent, QPen, QWheelEvent
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QSizePolicy, QToolButton, QWidget

from nodegraph import expressions
from nodegraph.editor.parameters.field import Field, is_shortcut, pace, wheel_steps
from nodegraph.editor.parameters.look import GAP, ROW_HEIGHT, accent, icon, ink
from nodegraph.errors import ParameterError
from nodegraph.params import Bounded

WIDE_RANGE = 100.0
"""From this ratio of its positive ends on, a slider is logarithmic."""


class Scale:
    """Where a value lies on a slider, 0..1: linear, or logarithmic over several powers of ten."""

    def __init__(self, low: float, high: float) -> None:
        self.low, self.high = low, high
        self.logarithmic = low > 0.0 and high / low >= WIDE_RANGE

    def place(self, value: float) -> float:
        """0..1; what lies beyond an end is at the end."""
        if not value > self.low:
            return 0.0
        if value >= self.high:
            return 1.0
        if self.logarithmic:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def value(self, place: float) -> float:
        """The value at a place, with no more digits than a pixel can tell apart."""
        if place <= 0.0:
            return self.low
        if place >= 1.0:
            return self.high
        if self.logarithmic:
            return float(f"{self.low * (self.high / self.low) ** place:.3g}")
        digits = 3 - math.floor(math.log10(self.high - self.low))
        return round(self.low + place * (self.high - self.low), max(0, digits))


class Slider(QWidget):
    """A groove with a handle; the filled part ends at the value. A value beyond an end shows as an open handle."""

    moved = Signal(float)  # value, while the user drags
    stepped = Signal(float)  # notches of the wheel or arrow keys
    pressed = Signal()
    released = Signal()
    escaped = Signal()

    def __init__(self, scale: Scale, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.scale = scale
        self.value = scale.low
        self._dragging = False
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setMinimumWidth(48)

    def sizeHint(self) -> QSize:
        return QSize(90, ROW_HEIGHT)

    def set_value(self, value: float) -> None:
        if value != self.value:
            self.value = value
            self.update()

    def _groove(self) -> QRectF:
        return QRectF(7.0, self.height() / 2 - 2.0, self.width() - 14.0, 4.0)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        palette, groove = self.palette(), self._groove()
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ink(palette, 0.18))
        painter.drawRoundedRect(groove, 2, 2)
        x = groove.left() + self.scale.place(self.value) * groove.width()
        color = accent(palette, self.isEnabled())
        painter.setBrush(color)
        painter.drawRoundedRect(QRectF(groove.left(), groove.top(), x - groove.left(), groove.height()), 2, 2)
        beyond = not self.scale.low <= self.value <= self.scale.high
        painter.setPen(QPen(color if beyond or self.hasFocus() else palette.window().color(), 2.0))
        painter.setBrush(palette.window().color() if beyond else color)
        painter.drawEllipse(QPointF(x, groove.center().y()), 5.5, 5.5)
        if self.hasFocus() and not beyond:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            ring = accent(palette)
            ring.setAlpha(90)
            painter.setPen(QPen(ring, 2.0))
            painter.drawEllipse(QPointF(x, groove.center().y()), 6.5, 6.5)

    def _move(self, x: float) -> None:
        groove = self._groove()
        self.moved.emit(self.scale.value((x - groove.left()) / max(1.0, groove.width())))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() is not Qt.MouseButton.LeftButton:
            super().mousePressEvent(event)
            return
        self._dragging = True
        self.pressed.emit()
        self._move(event.position().x())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._dragging:
            self._move(event.position().x())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._dragging and event.button() is Qt.MouseButton.LeftButton:
            self._dragging = False
            self.released.emit()

    def wheelEvent(self, event: QWheelEvent) -> None:
        # Without the focus the wheel scrolls the panel: who reads on must not change what was passed on the way.
        if self.hasFocus() and not self._dragging:
            self.stepped.emit(wheel_steps(event) * pace(event.modifiers()))
            event.accept()
        else:
            event.ignore()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key = event.key()
        if key in (Qt.Key.Key_Right, Qt.Key.Key_Up):
            self.stepped.emit(pace(event.modifiers()))
        elif key in (Qt.Key.Key_Left, Qt.Key.Key_Down):
            self.stepped.emit(-pace(event.modifiers()))
        elif key in (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown):
            self.stepped.emit(10.0 if key == Qt.Key.Key_PageUp else -10.0)
        elif key == Qt.Key.Key_Escape and self._dragging:
            self._dragging = False
            self.escaped.emit()
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.update()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.update()


class NumberEntry(QLineEdit):
    """A number that can be typed, also as a sum ("3/8"), with its unit behind it while nobody types."""

    entered = Signal(object)  # a float, or an int where the number is whole
    stepped = Signal(float)
    misread = Signal(str)

    def __init__(self, unit: str = "", integer: bool = False, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.unit = unit
        self.integer = integer
        self.value: Any = 0.0
        self.setFixedHeight(ROW_HEIGHT)
        self.setMinimumWidth(40)
        self.setAlignment(Qt.AlignmentFlag.AlignRight)
        self.setTextMargins(2, 0, 2, 0)
        self.setContextMenuPolicy(Qt.ContextMenuPolicy.NoContextMenu)  # that of the parameter opens
        self.editingFinished.connect(self._read)
        self.show_number(0.0)

    def show_number(self, value: Any) -> None:
        """Show a number in full while somebody types, rounded and with its unit otherwise."""
        self.value = value
        if self.hasFocus() and not self.isReadOnly():
            if not self.isModified():
                self._write(repr(value))
        else:
            self._write(short(value) + (f" {self.unit}" if self.unit else ""))

    def _write(self, text: str) -> None:
        if text != self.text():
            self.setText(text)
            self.setCursorPosition(0)

    def _read(self) -> None:
        if not self.isModified():
            return
        self.setModified(False)
        text = self.text().strip().removesuffix(self.unit).strip()
        try:
            value = typed(text, self.integer)
        except ParameterError:
            self.misread.emit(f"{text!r} is no number")
            self.show_number(self.value)
            return
        self.entered.emit(value)

    def focusInEvent(self, event: QFocusEvent) -> None:
        super().focusInEvent(event)
        self.show_number(self.value)
        self.selectAll()

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        self.show_number(self.value)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Up, Qt.Key.Key_Down) and not self.isReadOnly():
            self._read()
            self.stepped.emit(pace(event.modifiers()) * (1 if event.key() == Qt.Key.Key_Up else -1))
        elif event.key() == Qt.Key.Key_Escape and self.isModified():
            self.setModified(False)
            self.show_number(self.value)
        else:
            super().keyPressEvent(event)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.hasFocus() and not self.isReadOnly():
            self.stepped.emit(wheel_steps(event) * pace(event.modifiers()))
            event.accept()
        else:
            event.ignore()


class NumberField(Field):
    """A Float or an Int: slider where the soft range has both ends, entry always."""

    def __init__(self, declaration: Bounded, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.integer = declaration.integer
        self.value: Any = declaration.default
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GAP)
        self.slider: Slider | None = None
        low, high = declaration.soft_min, declaration.soft_max
        if low is not None and high is not None and math.isfinite(low) and math.isfinite(high) and low < high:
            self.slider = Slider(Scale(low, high))
            self.slider.moved.connect(self._slid)
            self.slider.pressed.connect(self.began)
            self.slider.released.connect(self.ended)
            self.slider.escaped.connect(self.cancelled)
            self.slider.stepped.connect(self._step)
            self.slider.installEventFilter(self)
            layout.addWidget(self.slider, 1)
        self.entry = NumberEntry(declaration.unit, self.integer)
        if self.slider is not None:
            self.entry.setFixedWidth(92)
        self.entry.entered.connect(self.edited)
        self.entry.stepped.connect(self._step)
        self.entry.misread.connect(self.refused)
        self.entry.installEventFilter(self)
        layout.addWidget(self.entry, 0 if self.slider is not None else 1)
        self.setFocusProxy(self.slider or self.entry)

    def show_value(self, value: Any) -> None:
        self.value = value
        self.entry.show_number(value)
        if self.slider is not None:
            self.slider.set_value(float(value))

    def eventFilter(self, watched: Any, event: QEvent) -> bool:
        if is_shortcut(event) or event.type() == QEvent.Type.FocusOut:
            self.settle()
        return super().eventFilter(watched, event)

    def _slid(self, value: float) -> None:
        self.edited.emit(round(value) if self.integer else value)

    def _step(self, notches: float) -> None:
        self.step_to(stepped(self.declaration, self.value, notches))


class SeedField(NumberField):
    """A Seed: an entry, and a die that throws another."""

    def __init__(self, declaration: Bounded, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        if self.slider is not None:  # four thousand million places are no use on a slider
            self.slider.hide()
            self.setFocusProxy(self.entry)
            self.entry.setMinimumWidth(40)
            self.entry.setMaximumWidth(16777215)
        self.die = QToolButton()
        self.die.setIcon(icon("die", ink(self.palette(), 0.8)))
        self.die.setFixedSize(ROW_HEIGHT, ROW_HEIGHT)
        self.die.setAutoRaise(True)
        self.die.setToolTip("Throw another seed")
        self.die.setAccessibleName("Throw another seed")
        self.die.clicked.connect(lambda: self.edited.emit(random.randrange(2**32)))
        box = self.layout()
        assert box is not None
        box.addWidget(self.die)


def short(value: Any) -> str:
    """A number as a person reads it: at most five significant digits, whole numbers in full."""
    if isinstance(value, int):
        return str(value)
    return f"{value:.5g}".replace("e+0", "e").replace("e-0", "e-").replace("e+", "e")


def typed(text: str, integer: bool = False) -> Any:
    """The number that somebody typed: "1e-3", or a sum such as "3/8". Raises ParameterError."""
    try:
        value: Any = float(text.replace(",", ".") if text.count(",") == 1 and "(" not in text else text)
    except ValueError:
        expression = expressions.parse(text, "")
        if expression.names:
            raise ParameterError(f"{text!r} is no number") from None
        value = expression.evaluate({}, "")
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ParameterError(f"{text!r} is no number")
    return int(value) if integer and math.isfinite(value) and float(value).is_integer() else value


def stepped(declaration: Any, value: Any, notches: float) -> Any:
    """The value that lies some notches of the wheel away, within the hard limits."""
    if declaration.integer:
        whole = round(notches) or int(math.copysign(1, notches))
        moved: Any = value + whole
    elif not math.isfinite(value):
        return value
    else:
        low, high = declaration.soft_min, declaration.soft_max
        if low is not None and high is not None and math.isfinite(high - low) and low < high:
            scale = Scale(low, high)
            if scale.logarithmic and value > 0.0:
                return _within(declaration, float(f"{value * (high / low) ** (notches / 100.0):.6g}"))
            size = (high - low) / 100.0
        else:
            size = 10.0 ** (math.floor(math.log10(abs(value))) - 1) if value else 0.1
        # Sums of steps such as 0.1 collect digits that nobody typed.
        moved = float(f"{value + notches * size:.10g}")
    return _within(declaration, moved)


def _within(declaration: Any, value: Any) -> Any:
    if declaration.min is not None:
        value = max(declaration.min, value)
    if declaration.max is not None:
        value = min(declaration.max, value)
    return int(value) if declaration.integer else float(value)
