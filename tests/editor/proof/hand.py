"""A mouse and a keyboard for whole windows: events enter where the window system's do, and Qt finds who gets them."""

from __future__ import annotations

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QWindow
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QWidget
from shiboken6 import isValid

LEFT, RIGHT, MIDDLE = Qt.MouseButton.LeftButton, Qt.MouseButton.RightButton, Qt.MouseButton.MiddleButton
NONE = Qt.KeyboardModifier.NoModifier


def home(widget: QWidget) -> QWindow:
    """The window that a widget lies in, as the window system knows it."""
    handle = widget.window().windowHandle()
    assert handle is not None, f"{widget} is in no window that was shown"
    return handle


def place(widget: QWidget, at: QPoint | None = None) -> QPoint:
    """A point of a widget (default: its middle) in its window."""
    return widget.mapTo(widget.window(), at if at is not None else widget.rect().center())


def click(
    widget: QWidget, at: QPoint | None = None, button: Qt.MouseButton = LEFT, keys: Qt.KeyboardModifier = NONE
) -> None:
    """Press and release a button."""
    handle, point = home(widget), place(widget, at)
    QTest.mouseMove(handle, point)
    if isValid(handle):  # a torn-off panel gets another window when it is put back, which a step before may have begun
        QTest.mousePress(handle, button, keys, point)
    if isValid(handle):
        QTest.mouseRelease(handle, button, keys, point)
    QApplication.processEvents()


def double_click(widget: QWidget, at: QPoint | None = None) -> None:
    """Two clicks that belong together."""
    handle, point = home(widget), place(widget, at)
    QTest.mouseDClick(handle, LEFT, NONE, point)
    QApplication.processEvents()


def drag(
    widget: QWidget, start: QPoint, end: QPoint, button: Qt.MouseButton = LEFT, keys: Qt.KeyboardModifier = NONE
) -> None:
    """Press at one point of a widget, move in steps, and release at another."""
    handle, first, last = home(widget), place(widget, start), place(widget, end)
    QTest.mouseMove(handle, first)
    if isValid(handle):
        QTest.mousePress(handle, button, keys, first)
    for part in (0.1, 0.4, 0.7, 1.0):
        if isValid(handle):
            QTest.mouseMove(handle, first + (last - first) * part)
        QApplication.processEvents()
    if isValid(handle):
        QTest.mouseRelease(handle, button, keys, last)
    QApplication.processEvents()


def wheel(widget: QWidget, at: QPoint, notches: int, keys: Qt.KeyboardModifier = NONE) -> None:
    """Turn the wheel."""
    QTest.wheelEvent(home(widget), place(widget, at), QPoint(0, 120 * notches), stateKey=keys)
    QApplication.processEvents()


def _activate(widget: QWidget) -> None:
    """Do what a window manager does when a popup or a dialog went away."""
    if QApplication.activeWindow() is None:
        widget.window().activateWindow()
        QApplication.processEvents()


def key(widget: QWidget, what: Qt.Key, keys: Qt.KeyboardModifier = NONE) -> None:
    """Press a key; whoever has the focus in the widget's window gets it, or a shortcut."""
    _activate(widget)
    QTest.keyClick(home(widget), what, keys)
    QApplication.processEvents()


def write(widget: QWidget, text: str) -> None:
    """Type text."""
    _activate(widget)
    for letter in text:
        keys = Qt.KeyboardModifier.ShiftModifier if letter.isupper() else NONE
        QTest.keyClick(home(widget), Qt.Key(ord(letter.upper())), keys)
    QApplication.processEvents()
