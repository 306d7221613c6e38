"""A hand on a view: drags, moves and notches of the wheel as Qt sends them."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from nodegraph.editor.session import Session
from nodegraph.editor.views.view import ViewWidget

LEFT, MIDDLE, RIGHT = Qt.MouseButton.LeftButton, Qt.MouseButton.MiddleButton, Qt.MouseButton.RightButton
NONE = Qt.KeyboardModifier.NoModifier


def opened(qtbot: QtBot, session: Session, path: str, width: int = 200, height: int = 200) -> ViewWidget:
    """A view that asks for its picture at once: that it waits until its size has settled has a test of its own."""
    widget = ViewWidget(session, path)
    qtbot.addWidget(widget)
    widget.resize(width, height)
    widget.show()
    widget._settle.stop()
    widget._watch()
    return widget


def click(widget: ViewWidget, x: float, y: float, button=LEFT) -> None:
    QTest.mouseClick(widget.area, button, NONE, QPoint(round(x), round(y)))


def drag(widget: ViewWidget, start: tuple[int, int], end: tuple[int, int], button=LEFT, modifiers=NONE) -> None:
    area = widget.area
    QTest.mousePress(area, button, modifiers, QPoint(*start))
    for part in (0.3, 0.6, 1.0):
        place = QPointF(*(a + (b - a) * part for a, b in zip(start, end, strict=True)))
        move(widget, place, button, modifiers)
    QTest.mouseRelease(area, button, modifiers, QPoint(*end))


def move(widget: ViewWidget, place: QPointF, button=Qt.MouseButton.NoButton, modifiers=NONE) -> None:
    """A move with its buttons: QTest's own has none."""
    area = widget.area
    event = QMouseEvent(
        QEvent.Type.MouseMove, place, area.mapToGlobal(place), Qt.MouseButton.NoButton, button, modifiers
    )
    QApplication.sendEvent(area, event)


def wheel(widget: ViewWidget, at: QPointF, steps: int, modifiers=NONE) -> None:
    event = QWheelEvent(
        widget.area.mapTo(widget, at),  # where Qt takes the notches that the area leaves to the view
        widget.area.mapToGlobal(at),
        QPoint(),
        QPoint(0, 120 * steps),
        Qt.MouseButton.NoButton,
        modifiers,
        Qt.ScrollPhase.NoScrollPhase,
        False,
    )
    QApplication.sendEvent(widget, event)


def size_of(widget: ViewWidget) -> tuple[int, int]:
    return widget.area.width(), widget.area.height()
