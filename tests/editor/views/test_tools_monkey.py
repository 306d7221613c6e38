"""A hand that does anything to two views: no exception, and undoing all of it gives the document back."""

from __future__ import annotations

import random

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest

from nodegraph import workspace
from tests.editor.views.hands import LEFT, MIDDLE, RIGHT, move, size_of, wheel

KEYS = "XCDARPFWSQEH1375"
OTHERS = (
    Qt.Key.Key_Escape,
    Qt.Key.Key_Return,
    Qt.Key.Key_Backspace,
    Qt.Key.Key_Delete,
    Qt.Key.Key_Up,
    Qt.Key.Key_PageDown,
)
SHIFT, CONTROL, NONE = (
    Qt.KeyboardModifier.ShiftModifier,
    Qt.KeyboardModifier.ControlModifier,
    Qt.KeyboardModifier.NoModifier,
)


@pytest.mark.parametrize("seed", [1, 2])
def test_anything_is_undone(view, section, session, until, seed, monkeypatch) -> None:
    rng = random.Random(seed)
    before = workspace.dumps(session.network)
    for widget in (view, section):
        monkeypatch.setattr(widget.toolbox, "menu_at", lambda *_: None)  # a menu would take the keyboard
        widget.toolbox.flying._tick.timeout.disconnect()
    held: set[Qt.MouseButton] = set()
    widget = view
    for _ in range(350):
        if not held and rng.random() < 0.1:
            widget = rng.choice([view, section])
            widget.setFocus()
        width, height = size_of(widget)
        at = QPoint(rng.randrange(width), rng.randrange(height))
        act = rng.random()
        modifiers = rng.choice([NONE, NONE, NONE, SHIFT, CONTROL])
        button = rng.choice([LEFT, LEFT, LEFT, MIDDLE, RIGHT])
        if act < 0.25:
            if button in held:
                QTest.mouseRelease(widget.area, button, NONE, at)
                held.discard(button)
            elif not held:
                QTest.mousePress(widget.area, button, modifiers, at)
                held.add(button)
        elif act < 0.5:
            move(widget, QPointF(at), next(iter(held), Qt.MouseButton.NoButton))
        elif act < 0.6 and not held:
            QTest.mouseDClick(widget.area, LEFT, NONE, at)
            QTest.mouseRelease(widget.area, LEFT, NONE, at)
        elif act < 0.7:
            wheel(widget, QPointF(at), rng.choice([-1, 1]), modifiers)
        elif act < 0.95:
            QTest.keyClick(widget, getattr(Qt.Key, f"Key_{rng.choice(KEYS)}"), modifiers)
            widget.toolbox.flying.advance(0.02)
        else:
            QTest.keyClick(widget, rng.choice(OTHERS))
    for button in held:
        QTest.mouseRelease(widget.area, button)
    for one in (view, section):
        one.hide()
    assert not session.in_gesture
    names = set()
    while session.history.undo_name:
        names.add(session.history.undo_name)
        session.undo()
    assert len(names) > 8, names
    assert workspace.dumps(session.network) == before
    assert not [message for message in session.told if message.level == "error"]
