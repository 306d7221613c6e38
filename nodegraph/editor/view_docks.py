"""The panels of the views in a window: one for each view of the document, and where they stand."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt

from nodegraph.editor.quad import quad
from nodegraph.editor.views.dock import ViewDock

if TYPE_CHECKING:
    from nodegraph.editor.views.view import ViewWidget
    from nodegraph.editor.window import Window

ABOVE = Qt.DockWidgetArea.TopDockWidgetArea
LEAST = 130
"""Pixels that the canvas and the panels below it keep in a quad."""
NARROWEST, SIDES = 280, 680
"""Pixels that a view needs, and that the panels at its sides take before the window has laid them out."""
ACROSS, DOWN = Qt.Orientation.Horizontal, Qt.Orientation.Vertical


class ViewDocks:
    """Keeps one dock for each view of the document. ``docks`` is in the order in which they came."""

    def __init__(self, window: Window) -> None:
        self.window = window
        self.docks: list[ViewDock] = []

    def sync(self) -> None:
        """Give every view of the document a dock, and take away those of views that are gone."""
        for dock in list(self.docks):
            if not dock.view.alive:
                self.docks.remove(dock)
                self.window.removeDockWidget(dock)
                dock.setObjectName(f"gone {id(dock)}")  # a view of the next document may have this name, and its place
                dock.deleteLater()
        known = {dock.view.path for dock in self.docks}
        for node in self.window.session.network.walk():
            if node.type == "output.view" and node.path not in known:
                dock = ViewDock(self.window.session, node.path, self.window)
                self.window.titles.add(dock)
                self.docks.append(dock)
                self.place(dock)

    def current(self) -> ViewWidget | None:
        """The view that had the keyboard last; None, with a message, where the document has none."""
        shown = [dock.view for dock in self.docks if not dock.isHidden()]
        if not shown:
            self.window.session.tell("info", "no view is open: add an output.view, or show its panel")
            return None
        return max(shown, key=lambda view: view.used)

    def place(self, dock: ViewDock) -> None:
        """Views stand beside each other above the canvas, while there is room; further ones share the last place."""
        window = self.window
        dock.setFloating(False)
        beside = [one for one in self.docks if one is not dock and _is_above(window, one)]
        room = max(window.middle.width(), window.width() - SIDES)
        window.addDockWidget(ABOVE, dock, ACROSS)
        if beside and (len(beside) + 1) * NARROWEST > room:
            window.tabifyDockWidget(beside[-1], dock)
        dock.show()
        self.window.resizeDocks([dock], [max(240, (self.window.height() - 100) * 10 // 20)], DOWN)

    def quad(self) -> None:
        """Stand the four views of a quad two by two; `nodegraph.editor.quad` finds or adds them."""
        room = self.window.middle.width()
        found = [dock for path in quad(self.window.session) for dock in self.docks if dock.view.path == path]
        if len(found) < 4:
            return
        window = self.window
        for dock in found:
            window.removeDockWidget(dock)
            dock.setFloating(False)
        cast, axial, coronal, sagittal = found
        window.addDockWidget(ABOVE, cast, ACROSS)
        window.splitDockWidget(cast, axial, ACROSS)
        window.splitDockWidget(cast, coronal, DOWN)
        window.splitDockWidget(axial, sagittal, DOWN)
        for dock in found:
            dock.show()
        window.resizeDocks([cast, axial], [room // 2] * 2, ACROSS)
        # The canvas keeps a strip; the panels below give way first.
        window.resizeDocks([window.docks["messages"]], [LEAST], DOWN)
        tall = max(LEAST, (window.height() - 2 * LEAST) * 2 // 5)
        window.resizeDocks([cast, coronal, axial, sagittal], [tall] * 4, DOWN)


def _is_above(window: Window, dock: ViewDock) -> bool:
    return window.dockWidgetArea(dock) == ABOVE and not dock.isFloating() and not dock.isHidden()
