"""Where the panels of the window are: at first, in a workspace, and while the page with examples fills the window."""

from __future__ import annotations

import base64
import binascii
from typing import TYPE_CHECKING

from PySide6.QtCore import QByteArray, Qt
from PySide6.QtWidgets import QDockWidget, QMainWindow, QTabWidget

if TYPE_CHECKING:
    from nodegraph.editor.window import Window

LAYOUT = "window"
"""Key of the document's ``ui`` that holds where the panels are."""
AREAS: dict[Qt.DockWidgetArea, tuple[str, ...]] = {
    Qt.DockWidgetArea.LeftDockWidgetArea: ("palette",),
    Qt.DockWidgetArea.RightDockWidgetArea: ("parameters", "help", "shader"),
    Qt.DockWidgetArea.BottomDockWidgetArea: (
        "messages",
        "profile",
        "links",
        "images",
        "compare",
        "quality",
        "measures",
        "timeline",
        "console",
        "recorder",
    ),
}
"""Where each panel is at first; the first of an area is in front."""


class Arrangement:
    """Moves the docks of a window; what it keeps is in the document."""

    def __init__(self, window: Window) -> None:
        self.window = window
        self._aside: list[QDockWidget] = []
        window.setDockOptions(window.dockOptions() | QMainWindow.DockOption.AllowNestedDocks)
        window.setTabPosition(Qt.DockWidgetArea.AllDockWidgetAreas, QTabWidget.TabPosition.North)
        for corner, area in (
            (Qt.Corner.TopLeftCorner, Qt.DockWidgetArea.LeftDockWidgetArea),
            (Qt.Corner.TopRightCorner, Qt.DockWidgetArea.RightDockWidgetArea),
            (Qt.Corner.BottomRightCorner, Qt.DockWidgetArea.RightDockWidgetArea),
        ):
            window.setCorner(corner, area)

    def reset(self) -> None:
        """Put the panels where they are at first."""
        window, docks = self.window, self.window.docks
        self._aside = []
        for dock in (*docks.values(), *window.views):
            window.removeDockWidget(dock)
        for area, names in AREAS.items():
            first, *others = [docks[name] for name in names]
            window.addDockWidget(area, first)
            for dock in others:
                window.tabifyDockWidget(first, dock)
            for dock in (first, *others):
                dock.setFloating(False)
                dock.show()
            first.raise_()
        for view in window.views:
            window.view_docks.place(view)
        window.resizeDocks([docks["palette"], docks["parameters"]], [230, 410], Qt.Orientation.Horizontal)
        window.resizeDocks([docks["messages"]], [180], Qt.Orientation.Vertical)

    def note(self) -> None:
        """Write into the document where the panels are."""
        self.bring_back()
        state = base64.b64encode(self.window.saveState().data()).decode()
        self.window.session.note(LAYOUT, {"layout": state})

    def restore(self) -> None:
        """Put the panels where the document says; where it says nothing, or nonsense, they stay."""
        self.bring_back()
        kept = self.window.session.network.ui.get(LAYOUT)
        if isinstance(kept, dict) and isinstance(kept.get("layout"), str):
            try:
                self.window.restoreState(QByteArray(base64.b64decode(kept["layout"], validate=True)))
            except (binascii.Error, ValueError):
                pass  # somebody edited it

    def set_aside(self) -> None:
        """Leave the whole window to what stands in its middle, but for panels that were torn off."""
        for dock in (*self.window.docks.values(), *self.window.views):
            if not dock.isHidden() and not dock.isFloating():
                self._aside.append(dock)
                dock.hide()

    def bring_back(self) -> None:
        """Show the panels again that were set aside."""
        aside, self._aside = self._aside, []
        for dock in aside:
            if dock in self.window.docks.values() or dock in self.window.views:
                dock.show()
