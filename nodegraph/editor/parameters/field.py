"""What all widgets of parameters share: a value comes in, and what the user makes of it goes out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

if TYPE_CHECKING:
    from nodegraph.editor.parameters.place import Place
    from nodegraph.params import Parameter

BURST_MS = 400
"""Steps of the wheel or of an arrow key that follow each other within this time are undone together."""


class Field(QWidget):
    """The widget of one parameter. It keeps nothing: `show_value` shows what the document has.

    declaration: says limits, unit and choices.
    place:       where in the document the value lives, for what a declaration cannot know (the data that the node
                 reads, the folder of the workspace). A field that has none shows and edits all the same.

    Signals: ``edited(value)`` is a value that the user wants; ``began`` and ``ended`` enclose those that belong to one
    gesture, ``cancelled`` ends it and takes it back; ``refused(text)`` says why an entry is no value.
    """

    edited = Signal(object)
    began = Signal()
    ended = Signal()
    cancelled = Signal()
    refused = Signal(str)

    wide = False  #: it stands below its label and takes the whole width

    def __init__(self, declaration: Parameter, place: Place | None = None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.declaration = declaration
        self.place = place
        self._burst = QTimer(self, singleShot=True, interval=BURST_MS)
        self._burst.timeout.connect(self.ended)

    def show_value(self, value: Any) -> None:
        """Show a checked value; nothing is emitted."""
        raise TypeError(f"{type(self).__name__}.show_value: every field says how it shows a value")

    def set_read_only(self, read_only: bool) -> None:
        """Let the user look only: a wire or an expression decides."""
        self.setEnabled(not read_only)

    def step_to(self, value: Any) -> None:
        """Report a value that a wheel or key led to. Steps that follow at once join the same gesture."""
        if not self._burst.isActive():
            self.began.emit()
        self._burst.start()
        self.edited.emit(value)

    def settle(self) -> None:
        """End a gesture of steps now, for example because undo is about to be called."""
        if self._burst.isActive():
            self._burst.stop()
            self.ended.emit()

    def leave(self) -> None:
        """End what is under way: the widget is about to be hidden or to go."""
        self.settle()

    def hideEvent(self, event: Any) -> None:
        self.settle()
        super().hideEvent(event)


_NO_SHORTCUTS = (Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Control)


def is_shortcut(event: QEvent) -> bool:
    """Whether a key is about to be looked up as a shortcut with Ctrl: undo, save. Arrows with Ctrl are long steps."""
    return (
        event.type() == QEvent.Type.ShortcutOverride
        and isinstance(event, QKeyEvent)
        and bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)
        and event.key() not in _NO_SHORTCUTS
    )


def wheel_steps(event: QWheelEvent) -> float:
    """Notches of a wheel, up is positive; Alt turns the wheel sideways on some systems."""
    delta = event.angleDelta()
    return (delta.y() or delta.x()) / 120.0


def pace(modifiers: Qt.KeyboardModifier) -> float:
    """How much a step counts: a tenth with Shift, ten times with Ctrl."""
    if modifiers & Qt.KeyboardModifier.ShiftModifier:
        return 0.1
    return 10.0 if modifiers & Qt.KeyboardModifier.ControlModifier else 1.0
