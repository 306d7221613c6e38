"""Whether somebody can see a widget. A dock behind another one's tab is visible to Qt, and nobody sees it."""

from __future__ import annotations

from functools import partial
from typing import Protocol, runtime_checkable

from PySide6.QtWidgets import QDockWidget, QWidget


@runtime_checkable
class SeesFront(Protocol):
    """A widget that computes only while it is seen. In a dock it is told when its tab comes to the front or goes."""

    def set_in_front(self, front: bool) -> None: ...


def in_front(widget: QWidget) -> bool:
    """Whether some of a widget can be seen."""
    return widget.isVisible() and not widget.visibleRegion().isEmpty()


def follow_front(dock: QDockWidget) -> None:
    """Tell the widget of a dock when it comes to the front, if it wants to know."""
    dock.visibilityChanged.connect(partial(_tell, dock))


def _tell(dock: QDockWidget, front: bool) -> None:
    widget = dock.widget()
    if isinstance(widget, SeesFront):
        widget.set_in_front(front)
