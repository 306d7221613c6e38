"""Bool, Choice, Text; and the JSON form for kinds that plug-ins bring without a widget."""

from __future__ import annotations

import json
from typing import Any

from PySide6.QtCore import QEvent, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent, QPen, QWheelEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QHBoxLayout,
    QLineEdit,
    QPlainTextEdit,
    QWidget,
)

from nodegraph.editor.parameters.field import Field, is_shortcut, wheel_steps
from nodegraph.editor.parameters.look import ROW_HEIGHT, accent, blend, ink
from nodegraph.errors import ParameterError
from nodegraph.params import Choice, Parameter, Text


class Switch(QAbstractButton):
    """On or off: a knob in a slot."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setCheckable(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setFixedSize(self.sizeHint())

    def sizeHint(self) -> QSize:
        return QSize(38, ROW_HEIGHT)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        palette, on, enabled = self.palette(), self.isChecked(), self.isEnabled()
        slot = QRectF(2.0, (self.height() - 18) / 2, 34.0, 18.0)
        off = ink(palette, 0.25 if enabled else 0.12)
        painter.setPen(QPen(accent(palette), 1.5) if self.hasFocus() else Qt.PenStyle.NoPen)
        painter.setBrush(accent(palette, enabled) if on else off)
        painter.drawRoundedRect(slot, 9, 9)
        painter.setPen(Qt.PenStyle.NoPen)
        knob = palette.base().color() if enabled else blend(palette.base().color(), palette.window().color(), 0.5)
        painter.setBrush(Qt.GlobalColor.white if on and enabled else knob)
        painter.drawEllipse(QRectF(slot.right() - 16 if on else slot.left() + 2, slot.top() + 2, 14, 14))


class BoolField(Field):
    """A switch."""

    def __init__(self, declaration: Parameter, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self.switch = Switch()
        self.switch.clicked.connect(lambda on: self.edited.emit(on))
        layout.addWidget(self.switch)
        layout.addStretch(1)
        self.setFocusProxy(self.switch)

    def show_value(self, value: Any) -> None:
        self.switch.setChecked(value)


class Options(QComboBox):
    """A drop-down list that the wheel turns only while it has the focus. Arrow keys step as well."""

    stepped = Signal(int)  # entries down the list

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setFixedHeight(ROW_HEIGHT)
        self.setMinimumContentsLength(6)
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.hasFocus():
            self.stepped.emit(-round(wheel_steps(event)) or (-1 if wheel_steps(event) > 0 else 1))
            event.accept()
        else:
            event.ignore()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        plain = not event.modifiers() & Qt.KeyboardModifier.AltModifier  # with Alt the list opens
        if plain and event.key() in (Qt.Key.Key_Up, Qt.Key.Key_Down):
            self.stepped.emit(1 if event.key() == Qt.Key.Key_Down else -1)
        else:
            super().keyPressEvent(event)


class ChoiceField(Field):
    """A list of words, written as a person would."""

    def __init__(self, declaration: Choice, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self.options = Options()
        for word in declaration.choices:
            self.options.addItem(word.replace("_", " "), word)
        self.options.activated.connect(lambda index: self.edited.emit(self.options.itemData(index)))
        self.options.stepped.connect(self._step)
        self.options.installEventFilter(self)
        layout.addWidget(self.options)
        self.setFocusProxy(self.options)

    def show_value(self, value: Any) -> None:
        self.options.setCurrentIndex(self.options.findData(value))

    def _step(self, entries: int) -> None:
        place = min(max(self.options.currentIndex() + entries, 0), self.options.count() - 1)
        if place != self.options.currentIndex():
            self.step_to(self.options.itemData(place))

    def eventFilter(self, watched: Any, event: QEvent) -> bool:
        if is_shortcut(event) or event.type() == QEvent.Type.FocusOut:
            self.settle()
        return super().eventFilter(watched, event)


class LineEntry(QLineEdit):
    """A line of text that is handed on when Enter is pressed or the focus leaves; Escape takes it back."""

    entered = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFixedHeight(ROW_HEIGHT)
        self.setTextMargins(3, 0, 3, 0)
        self.shown = ""
        self.editingFinished.connect(self._finish)

    def show_text(self, text: str) -> None:
        self.shown = text
        if text != self.text() and not (self.hasFocus() and self.isModified()):
            self.setText(text)

    def _finish(self) -> None:
        if self.isModified():
            self.setModified(False)
            self.entered.emit(self.text())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape and self.isModified():
            self.setModified(False)
            self.show_text(self.shown)
        else:
            super().keyPressEvent(event)


class Lines(QPlainTextEdit):
    """Several lines of text, handed on when the focus leaves or with Ctrl-Enter."""

    entered = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setTabChangesFocus(True)
        self.setFixedHeight(3 * ROW_HEIGHT)

    def show_text(self, text: str) -> None:
        if text != self.toPlainText() and not (self.hasFocus() and self.document().isModified()):
            self.setPlainText(text)
            self.document().setModified(False)

    def _finish(self) -> None:
        if self.document().isModified():
            self.document().setModified(False)
            self.entered.emit(self.toPlainText())

    def focusOutEvent(self, event: Any) -> None:
        super().focusOutEvent(event)
        self._finish()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        enter = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        if enter and event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self._finish()
        else:
            super().keyPressEvent(event)


class TextField(Field):
    """A line of text, or several."""

    def __init__(self, declaration: Text, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self.entry: LineEntry | Lines = Lines() if declaration.multiline else LineEntry()
        self.entry.entered.connect(self.edited.emit)
        layout.addWidget(self.entry)
        self.setFocusProxy(self.entry)

    def show_value(self, value: Any) -> None:
        self.entry.show_text(value)


class JsonField(Field):
    """The JSON form of a value: for kinds of parameters that nobody has made a widget for."""

    def __init__(self, declaration: Parameter, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self.entry = LineEntry()
        self.entry.entered.connect(self._read)
        layout.addWidget(self.entry)
        self.setFocusProxy(self.entry)
        self.value: Any = declaration.default

    def show_value(self, value: Any) -> None:
        self.value = value
        self.entry.show_text(json.dumps(self.declaration.encode(value)))

    def _read(self, text: str) -> None:
        try:
            value = self.declaration.decode(json.loads(text), self.declaration.name or self.declaration.kind)
        except json.JSONDecodeError as error:
            self.refused.emit(f"no JSON: {error}")
            return
        except ParameterError as error:
            self.refused.emit(str(error))
            return
        self.edited.emit(value)
