"""The flat buttons of panels."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QToolButton


def flat_button(text: str, tip: str, act: Callable[[], object]) -> QToolButton:
    """A button with a word on it, which shows its edges when the mouse is over it."""
    made = QToolButton()
    made.setText(text)
    made.setToolTip(tip)
    made.setAutoRaise(True)
    made.clicked.connect(lambda _checked: act())
    return made
