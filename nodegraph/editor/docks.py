"""Docks that look like one program: a title with its own buttons, or only a tab where several share a place."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QSize, Qt, QTimer
from PySide6.QtWidgets import (
    QDockWidget,
    QFrame,
    QHBoxLayout,
    QLabel,
    QLayout,
    QMainWindow,
    QScrollArea,
    QSizePolicy,
    QTabBar,
    QToolButton,
    QWidget,
)

from nodegraph.editor import theme
from nodegraph.editor.views.front import follow_front


class TitleBar(QWidget):
    """The title of a dock that stands alone, with buttons to tear it off and to close it."""

    def __init__(self, dock: QDockWidget) -> None:
        super().__init__(dock)
        self.collapsed = False
        self.text = QLabel(dock.windowTitle())
        self.text.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.float_it = _button("float", "Tear off, or put back")
        self.float_it.clicked.connect(lambda: dock.setFloating(not dock.isFloating()))
        self.close_it = _button("clear", "Close; View > Panels brings it back")
        self.close_it.clicked.connect(dock.close)
        row = QHBoxLayout(self)
        row.setSizeConstraint(QLayout.SizeConstraint.SetNoConstraint)
        row.setContentsMargins(10, 3, 4, 3)
        row.setSpacing(0)
        row.addWidget(self.text, 1)
        row.addWidget(self.float_it)
        row.addWidget(self.close_it)
        dock.windowTitleChanged.connect(self.text.setText)
        self._paint()

    def collapse(self, collapsed: bool) -> None:
        """Take no room, or the usual."""
        if collapsed != self.collapsed:
            self.collapsed = collapsed
            for part in (self.text, self.float_it, self.close_it):
                part.setHidden(collapsed)
            self.updateGeometry()

    def sizeHint(self) -> QSize:
        return QSize(0, 0) if self.collapsed else QSize(120, 28)

    def minimumSizeHint(self) -> QSize:
        return QSize(0, 0) if self.collapsed else QSize(80, 28)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "close_it"):
            self._paint()

    def _paint(self) -> None:
        self.float_it.setIcon(theme.icon("float", self.palette(), 12))
        self.close_it.setIcon(theme.icon("clear", self.palette(), 12))


class Titles(QObject):
    """Gives every dock of a window its title bar, and hides that of a dock whose tab says the same."""

    def __init__(self, window: QMainWindow) -> None:
        super().__init__(window)
        self.window = window
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.timeout.connect(self._sort)

    def add(self, dock: QDockWidget) -> None:
        """Look after a dock."""
        dock.setTitleBarWidget(TitleBar(dock))
        follow_front(dock)
        for signal in (dock.dockLocationChanged, dock.topLevelChanged, dock.visibilityChanged):
            signal.connect(lambda _: self._soon.start())

    def _sort(self) -> None:
        self._sort_tab_bars()
        for dock in self.window.findChildren(QDockWidget):
            bar = dock.titleBarWidget()
            if isinstance(bar, TitleBar):
                beside = [other for other in self.window.tabifiedDockWidgets(dock) if not other.isHidden()]
                tabbed = bool(beside) and not dock.isFloating()
                bar.collapse(tabbed)

    def _sort_tab_bars(self) -> None:
        """Show the tab bars of docks that share a place, and hide those that Qt forgot on the screen.

        Qt makes new bars when docks that shared a place are put elsewhere; the old ones keep the old tabs.
        """
        docks = self.window.findChildren(QDockWidget)
        groups = [{dock, *self.window.tabifiedDockWidgets(dock)} for dock in docks if not dock.isHidden()]
        titles = [{dock.windowTitle() for dock in group if not dock.isHidden()} for group in groups]
        for bar in self.window.findChildren(QTabBar, options=Qt.FindChildOption.FindDirectChildrenOnly):
            tabs = {bar.tabText(place) for place in range(bar.count())}
            bar.setVisible(len(tabs) > 1 and tabs in titles)


def scrolled(widget: QWidget) -> QScrollArea:
    """A panel that may be smaller than what it holds."""
    area = QScrollArea()
    area.setFrameShape(QFrame.Shape.NoFrame)
    area.setWidgetResizable(True)
    area.setWidget(widget)
    return area


def _button(name: str, tip: str) -> QToolButton:
    made = QToolButton()
    made.setObjectName(f"dock_{name}")
    made.setToolTip(tip)
    made.setAutoRaise(True)
    made.setIconSize(QSize(12, 12))
    made.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    return made
