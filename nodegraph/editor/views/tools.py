"""What takes part in a view beside its camera or plane: it draws over the picture and may take mouse and keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QWheelEvent
from PySide6.QtWidgets import QWidget

if TYPE_CHECKING:
    from nodegraph.editor.views.view import ViewWidget

CLICK = 4.0
"""Pixels within which a press and a release are a click."""


class Tool(QObject):
    """A part of one view. What it does not take (False) goes to the next tool, and at last to the interactor.

    Places of events and of the painter are those of the picture area, logical pixels from its upper left. Who takes a
    press gets all events until every button is up. Tools of a view are asked in the order of `ViewWidget.tools`, and
    draw in the opposite order, so that the first lies on top.
    """

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self.view = view
        self.session = view.session

    @property
    def active(self) -> bool:
        """Whether a gesture is open: the view then keeps its interactor, whatever the document says."""
        return False

    def paint(self, painter: QPainter) -> None:
        """Draw over the picture."""

    def press(self, event: QMouseEvent) -> bool:
        """A button went down."""
        return False

    def move(self, event: QMouseEvent) -> bool:
        """The mouse moved, with a button down or without."""
        return False

    def release(self, event: QMouseEvent) -> bool:
        """A button went up."""
        return False

    def click(self, event: QMouseEvent) -> bool:
        """A button went up where it went down, and nobody had taken it."""
        return False

    def double_click(self, event: QMouseEvent) -> bool:
        """The second press of a double click."""
        return False

    def wheel(self, event: QWheelEvent) -> bool:
        """A notch of the wheel."""
        return False

    def key(self, event: QKeyEvent) -> bool:
        """A key went down."""
        return False

    def key_up(self, event: QKeyEvent) -> bool:
        """A key went up."""
        return False

    def end(self) -> None:
        """End what is open and keep it: the view is hidden or loses the keyboard."""

    def forget(self) -> None:
        """Another document was opened, so that nothing that was begun is left."""


def mouse_inside(event: QMouseEvent, view: QWidget, area: QWidget) -> QMouseEvent:
    """An event of a view with its place in the picture area."""
    return QMouseEvent(
        event.type(),
        area.mapFrom(view, event.position()),
        event.globalPosition(),
        event.button(),
        event.buttons(),
        event.modifiers(),
    )


def wheel_inside(event: QWheelEvent, view: QWidget, area: QWidget) -> QWheelEvent:
    """A notch of the wheel over a view with its place in the picture area."""
    return QWheelEvent(
        area.mapFrom(view, event.position()),
        event.globalPosition(),
        event.pixelDelta(),
        event.angleDelta(),
        event.buttons(),
        event.modifiers(),
        event.phase(),
        event.inverted(),
    )
