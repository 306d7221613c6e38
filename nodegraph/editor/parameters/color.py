"""Colours: the field of a Color, and the picker that it and the transfer-function editor open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np
from PySide6.QtCore import QPoint, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QLinearGradient, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QAbstractButton, QFrame, QGridLayout, QHBoxLayout, QLabel, QSizePolicy, QWidget

from nodegraph.data.image import srgb_encode
from nodegraph.editor.parameters.field import Field
from nodegraph.editor.parameters.look import GAP, ROW_HEIGHT, accent, ink
from nodegraph.editor.parameters.numbers import NumberEntry
from nodegraph.editor.parameters.simple import LineEntry
from nodegraph.errors import ParameterError
from nodegraph.params import Color


def to_qcolor(linear: Sequence[float]) -> QColor:
    """The screen's colour of linear light, with alpha where there are four numbers; what is too bright is clipped."""
    red, green, blue = (float(part) for part in srgb_encode(np.clip(np.asarray(linear[:3], np.float64), 0.0, 1.0)))
    return QColor.fromRgbF(red, green, blue, float(linear[3]) if len(linear) > 3 else 1.0)


def to_linear(color: QColor) -> tuple[float, float, float]:
    """Linear light of a colour of the screen (IEC 61966-2-1), to five digits: what a picker can tell apart."""
    parts = (color.redF(), color.greenF(), color.blueF())
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    red, green, blue = (round(min(1.0, max(0.0, part)), 5) for part in linear)
    return red, green, blue


def draw_checks(painter: QPainter, rect: QRectF, size: float = 5.0) -> None:
    """What shines through transparent colours."""
    painter.fillRect(rect, QColor("#ffffff"))
    rows, columns = int(rect.height() / size) + 1, int(rect.width() / size) + 1
    for row in range(rows):
        for column in range(row % 2, columns, 2):
            cell = QRectF(rect.left() + column * size, rect.top() + row * size, size, size)
            painter.fillRect(cell.intersected(rect), QColor("#c4c4c4"))


class Swatch(QAbstractButton):
    """A button that shows a colour, with its transparency in the right half."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.color = QColor(Qt.GlobalColor.white)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setToolTip("Choose a colour")

    def sizeHint(self) -> QSize:
        return QSize(48, ROW_HEIGHT)

    def set_color(self, color: QColor) -> None:
        self.color = color
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        rect = QRectF(self.rect()).adjusted(1.5, 3.5, -1.5, -3.5)
        opaque = QColor(self.color)
        opaque.setAlpha(255)
        if not self.isEnabled():
            painter.setOpacity(0.45)
        if self.color.alpha() < 255:
            draw_checks(painter, rect)
            painter.fillRect(rect, self.color)
            painter.fillRect(QRectF(rect.left(), rect.top(), rect.width() / 2, rect.height()), opaque)
        else:
            painter.fillRect(rect, opaque)
        painter.setPen(QPen(accent(self.palette()) if self.hasFocus() else ink(self.palette(), 0.35), 1.5))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRoundedRect(rect, 3, 3)


class _Plane(QWidget):
    """An area in which a point is dragged; both coordinates run 0..1."""

    moved = Signal(float, float)
    pressed = Signal()
    released = Signal()

    def __init__(self, width: int, height: int, name: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFixedSize(width, height)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(name)
        self.at = QPointF()
        self.hue = 0.0

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.pressed.emit()
        self.mouseMoveEvent(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        x = event.position().x() / max(1, self.width() - 1)
        y = event.position().y() / max(1, self.height() - 1)
        self.moved.emit(min(1.0, max(0.0, x)), min(1.0, max(0.0, y)))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self.released.emit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        shift = {
            Qt.Key.Key_Left: (-0.02, 0.0), Qt.Key.Key_Right: (0.02, 0.0),
            Qt.Key.Key_Up: (0.0, -0.02), Qt.Key.Key_Down: (0.0, 0.02),
        }.get(Qt.Key(event.key()))  # fmt: skip
        if shift is None:
            super().keyPressEvent(event)
            return
        self.moved.emit(min(1.0, max(0.0, self.at.x() + shift[0])), min(1.0, max(0.0, self.at.y() + shift[1])))

    def _frame(self, painter: QPainter) -> None:
        painter.setBrush(Qt.BrushStyle.NoBrush)
        focused = self.hasFocus()
        painter.setPen(QPen(accent(self.palette()) if focused else ink(self.palette(), 0.35), 1.5 if focused else 1.0))
        painter.drawRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5))

    def _mark(self, painter: QPainter, x: float, y: float) -> None:
        painter.setPen(QPen(Qt.GlobalColor.black, 3.0))
        painter.drawEllipse(QPointF(x, y), 5, 5)
        painter.setPen(QPen(Qt.GlobalColor.white, 1.6))
        painter.drawEllipse(QPointF(x, y), 5, 5)


class _Square(_Plane):
    """Saturation to the right, brightness upwards, at one hue."""

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        across = QLinearGradient(0, 0, self.width(), 0)
        across.setColorAt(0, QColor(Qt.GlobalColor.white))
        across.setColorAt(1, QColor.fromHsvF(self.hue, 1, 1))
        painter.fillRect(self.rect(), across)
        down = QLinearGradient(0, 0, 0, self.height())
        down.setColorAt(0, QColor(0, 0, 0, 0))
        down.setColorAt(1, QColor(Qt.GlobalColor.black))
        painter.fillRect(self.rect(), down)
        self._frame(painter)
        self._mark(painter, self.at.x() * (self.width() - 1), self.at.y() * (self.height() - 1))


class _Hues(_Plane):
    """All hues from left to right."""

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        rainbow = QLinearGradient(0, 0, self.width(), 0)
        for i in range(7):
            rainbow.setColorAt(i / 6, QColor.fromHsvF(min(i / 6, 0.9999), 1, 1))
        painter.fillRect(self.rect(), rainbow)
        self._frame(painter)
        self._mark(painter, self.at.x() * (self.width() - 1), self.height() / 2)


class ColorPicker(QFrame):
    """A popup: brightness and saturation, hue, alpha where there is one, and the colour as text."""

    picked = Signal(object)  # linear numbers, 3 or 4
    pressed = Signal()
    released = Signal()

    def __init__(self, linear: Sequence[float], parent: QWidget | None = None) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self.alpha: float | None = float(linear[3]) if len(linear) > 3 else None
        color = to_qcolor(linear)
        self._hue, self._saturation, self._brightness = max(0.0, color.hueF()), color.hsvSaturationF(), color.valueF()
        self.square = _Square(196, 128, "Saturation and brightness")
        self.hues = _Hues(196, 16, "Hue")
        self.hex = LineEntry()
        self.hex.setAccessibleName("Colour as #rrggbb")
        self.before, self.now = QLabel(), QLabel()
        layout = QGridLayout(self)
        layout.setContentsMargins(10, 10, 10, 10)
        layout.setSpacing(8)
        layout.addWidget(self.square, 0, 0, 1, 3)
        layout.addWidget(self.hues, 1, 0, 1, 3)
        for column, patch in enumerate((self.before, self.now)):
            patch.setFixedSize(28, ROW_HEIGHT)
            layout.addWidget(patch, 2, column)
        self.before.setToolTip("before")
        self.now.setToolTip("now")
        self.before.setStyleSheet(f"background: {color.name()}; border-radius: 3px")
        layout.addWidget(self.hex, 2, 2)
        self.opacity = NumberEntry()
        if self.alpha is not None:
            layout.addWidget(QLabel("Alpha"), 3, 0, 1, 2)
            layout.addWidget(self.opacity, 3, 2)
            self.opacity.entered.connect(self._set_alpha)
        self.square.moved.connect(self._set_tone)
        self.hues.moved.connect(self._set_hue)
        for area in (self.square, self.hues):
            area.pressed.connect(self.pressed)
            area.released.connect(self.released)
        self.hex.entered.connect(self._set_hex)
        self._show()

    @property
    def color(self) -> QColor:
        return QColor.fromHsvF(min(self._hue, 0.9999), self._saturation, self._brightness)

    def show_below(self, widget: QWidget) -> None:
        """Open under a widget, on the screen as a whole."""
        self.adjustSize()
        corner = widget.mapToGlobal(QPoint(0, widget.height() + 2))
        self.show_at(corner)

    def show_at(self, corner: QPoint) -> None:
        screen = self.screen().availableGeometry()
        corner.setX(max(screen.left(), min(corner.x(), screen.right() - self.width())))
        corner.setY(max(screen.top(), min(corner.y(), screen.bottom() - self.height())))
        self.move(corner)
        self.show()
        self.square.setFocus()

    def _show(self) -> None:
        self.square.hue = min(self._hue, 0.9999)
        self.square.at = QPointF(self._saturation, 1.0 - self._brightness)
        self.hues.at = QPointF(self._hue, 0.5)
        self.square.update()
        self.hues.update()
        self.hex.show_text(self.color.name())
        self.now.setStyleSheet(f"background: {self.color.name()}; border-radius: 3px")
        if self.alpha is not None:
            self.opacity.show_number(self.alpha)

    def _tell(self) -> None:
        self._show()
        linear: tuple[float, ...] = to_linear(self.color)
        self.picked.emit(linear if self.alpha is None else (*linear, self.alpha))

    def _set_tone(self, x: float, y: float) -> None:
        self._saturation, self._brightness = x, 1.0 - y
        self._tell()

    def _set_hue(self, x: float, y: float) -> None:
        self._hue = x
        self._tell()

    def _set_alpha(self, value: float) -> None:
        self.alpha = min(1.0, max(0.0, float(value)))
        self._tell()

    def _set_hex(self, text: str) -> None:
        color = QColor(text if text.startswith("#") or not _is_hex(text) else f"#{text}")
        if not color.isValid():
            self.hex.setText(self.color.name())
            return
        if color.hueF() >= 0.0:
            self._hue = color.hueF()
        self._saturation, self._brightness = color.hsvSaturationF(), color.valueF()
        self._tell()


class ColorField(Field):
    """A swatch that opens the picker, and the colour as the text that other programs write."""

    def __init__(self, declaration: Color, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.value: tuple[float, ...] = declaration.default
        self.picker: ColorPicker | None = None
        self.swatch = Swatch()
        self.swatch.clicked.connect(self.pick)
        self.hex = LineEntry()
        self.hex.setFixedWidth(92)
        self.hex.entered.connect(self._typed)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GAP)
        layout.addWidget(self.swatch, 1)
        layout.addWidget(self.hex)
        self.setFocusProxy(self.swatch)

    def show_value(self, value: Any) -> None:
        self.value = value
        color = to_qcolor(value)
        self.swatch.set_color(color)
        opaque = len(value) < 4
        self.hex.show_text(color.name() if opaque else f"{color.name()}{round(color.alphaF() * 255):02x}")
        bright = max(value[:3]) > 1.0
        self.hex.setToolTip(
            "linear " + ", ".join(f"{part:.4g}" for part in value) + (", brighter than white" if bright else "")
        )

    def pick(self) -> None:
        """Open the picker."""
        open_picker(self, self.value, self.edited.emit).show_below(self.swatch)

    def _typed(self, text: str) -> None:
        text = text.strip()
        try:
            value = self.declaration.check(f"#{text}" if _is_hex(text) else text, self.declaration.name or "colour")
        except ParameterError as error:
            self.refused.emit(str(error))
            self.show_value(self.value)
            return
        self.edited.emit(value)


def open_picker(owner: Any, color: Sequence[float], picked: Callable[[Any], object]) -> ColorPicker:
    """A picker at work for a widget with ``began``, ``ended`` and ``picker``, which is None again when it closes."""
    picker = owner.picker = ColorPicker(color, owner)
    picker.picked.connect(picked)
    picker.pressed.connect(owner.began)
    picker.released.connect(owner.ended)
    picker.destroyed.connect(partial(setattr, owner, "picker", None))
    picker.adjustSize()
    return picker


def _is_hex(text: str) -> bool:
    return len(text) in (6, 8) and all(sign in "0123456789abcdefABCDEF" for sign in text)
