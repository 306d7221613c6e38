"""A plot on which a transfer function is worked with mouse and keyboard: what the editors of all such share."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Protocol

from PySide6.QtCore import QPoint, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QFontMetricsF, QKeyEvent, QPainter, QResizeEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

ZOOM = 1.2  #: for each notch of the wheel


class OnBoard(Protocol):
    """What is drawn: ``area`` is the part of the widget that shows values."""

    @property
    def area(self) -> QRectF: ...
    def resize(self, width: float, height: float) -> None: ...


class FunctionBoard(QWidget):
    """Offers what the user wants, and changes nothing itself.

    ``edited(value)`` is what is wanted; ``began``, ``ended``, ``cancelled`` enclose a drag; ``stepped(value)`` is one
    step of an arrow key. ``color_wanted(point)``: what is chosen was double-clicked. ``readout`` is told over the plot.
    """

    edited = Signal(object)
    stepped = Signal(object)
    began = Signal()
    ended = Signal()
    cancelled = Signal()
    color_wanted = Signal(QPoint)

    plot: OnBoard

    def __init__(self, name: str, height: int, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.readout = ""
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumHeight(height)
        self.setAccessibleName(name)

    def sizeHint(self) -> QSize:
        return QSize(320, self.minimumHeight() + 20)

    def resizeEvent(self, event: QResizeEvent) -> None:
        self.plot.resize(self.width(), self.height())

    def draw_readout(self, painter: QPainter, aside: bool = False) -> None:
        """Tell the readout in a corner of the plot: the right one, or the left where the mouse is at the right."""
        area = self.plot.area
        chip = QFontMetricsF(painter.font()).boundingRect(self.readout).adjusted(-5.0, -2.0, 5.0, 2.0)
        if aside:
            chip.moveTopLeft(area.topLeft() + QPointF(4.0, 4.0))
        else:
            chip.moveTopRight(area.topRight() + QPointF(-4.0, 4.0))
        back = self.palette().base().color()
        back.setAlpha(215)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(back)
        painter.drawRoundedRect(chip, 4.0, 4.0)
        painter.setPen(self.palette().text().color())
        painter.drawText(chip, Qt.AlignmentFlag.AlignCenter, self.readout)

    def draw_hint(self, painter: QPainter, text: str) -> None:
        """Say over an empty plot how to begin."""
        painter.setPen(self.palette().placeholderText().color())
        painter.drawText(self.plot.area, Qt.AlignmentFlag.AlignCenter, text)

    # -- the keyboard -------------------------------------------------------------------------------------------

    def keys(self) -> dict[Qt.Key, Callable[[], object]]:
        """What keys without Ctrl do; a board adds its own."""
        return {
            Qt.Key.Key_Delete: self.delete,
            Qt.Key.Key_Backspace: self.delete,
            Qt.Key.Key_PageDown: partial(self.step_choice, 1),
            Qt.Key.Key_PageUp: partial(self.step_choice, -1),
            Qt.Key.Key_Home: self.fit,
            Qt.Key.Key_Plus: partial(self.zoom, ZOOM),
            Qt.Key.Key_Minus: partial(self.zoom, 1.0 / ZOOM),
            Qt.Key.Key_C: self.ask_color,
        }

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Esc lets go; arrows move what is chosen, or choose where nothing is; then `keys`."""
        key, control = Qt.Key(event.key()), bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        sideways = {Qt.Key.Key_Left: -1, Qt.Key.Key_Right: 1}.get(key, 0)
        upwards = {Qt.Key.Key_Down: -1, Qt.Key.Key_Up: 1}.get(key, 0)
        act = None if control else self.keys().get(key)
        if key == Qt.Key.Key_Escape and self.let_go():
            self.cancelled.emit()
        elif (sideways or upwards) and self.has_choice():
            self.nudge(sideways, upwards, event.modifiers())
        elif sideways:
            self.step_choice(sideways)
        elif act is not None:
            act()
        else:
            super().keyPressEvent(event)

    # -- what a board is ----------------------------------------------------------------------------------------

    def let_go(self) -> bool:
        """Drop what the mouse holds; whether it held something."""
        raise TypeError(f"{type(self).__name__}.let_go: every board says what a drag holds")

    def has_choice(self) -> bool:
        """Whether something is chosen."""
        raise TypeError(f"{type(self).__name__}.has_choice: every board says what is chosen")

    def nudge(self, sideways: int, upwards: int, modifiers: Qt.KeyboardModifier) -> None:
        """Move what is chosen by a small step."""
        raise TypeError(f"{type(self).__name__}.nudge: every board says what moves")

    def delete(self) -> None:
        """Take away what is chosen."""
        raise TypeError(f"{type(self).__name__}.delete: every board says what goes")

    def step_choice(self, by: int) -> None:
        """Choose the next thing, or the one before."""
        raise TypeError(f"{type(self).__name__}.step_choice: every board says what is next")

    def fit(self) -> None:
        """Show everything."""
        raise TypeError(f"{type(self).__name__}.fit: every board says what there is")

    def zoom(self, factor: float) -> None:
        """Show ``1 / factor`` of what is seen."""
        raise TypeError(f"{type(self).__name__}.zoom: every board says what is seen")

    def ask_color(self) -> None:
        """Ask for the picker of what is chosen."""
        raise TypeError(f"{type(self).__name__}.ask_color: every board says what has a colour")
