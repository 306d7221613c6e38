"""Small pieces that the parts of the quality panel share."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QPalette
from PySide6.QtWidgets import QFrame, QLabel


def dim(text: str) -> QLabel:
    """A label in the colour of what is said by the way."""
    label = QLabel(text)
    label.setProperty("dim", True)
    return label


def sentence() -> QLabel:
    """A place for a sentence, which may take several lines and can be copied."""
    label = dim("")
    label.setWordWrap(True)
    label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
    return label


def upright() -> QFrame:
    """A thin line between what stands side by side."""
    line = QFrame()
    line.setFixedWidth(1)
    line.setAutoFillBackground(True)
    line.setBackgroundRole(QPalette.ColorRole.Mid)
    return line


def said(text: str) -> str:
    """What an error or a summary says, as a sentence that stands alone."""
    return text[:1].upper() + text[1:].removesuffix(".") + "." if text else ""
