"""The dock that shows the parameters of the selected nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, QSize, Qt
from PySide6.QtGui import QKeySequence, QResizeEvent, QShortcut
from PySide6.QtWidgets import QFrame, QScrollArea, QSizePolicy, QVBoxLayout, QWidget

from nodegraph.editor.parameters.filter import HEIGHT, Filter, FilterBar
from nodegraph.editor.parameters.look import caption
from nodegraph.editor.parameters.row import ParameterRow
from nodegraph.editor.parameters.section import NodeSection

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

FEW = 10
"""So many parameters need no search."""
MOST_NODES = 12
"""Nodes of a selection whose parameters are shown; more are counted."""
KEPT = 6
"""Sections of nodes that were selected before which are kept: widgets take long to make and little room."""


class ParameterPanel(QScrollArea):
    """The parameters of the selection, one section per node, always as the document has them."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.sections: dict[str, NodeSection] = {}
        self._kept: dict[str, NodeSection] = {}  # of nodes that were selected before, the last at the end
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setMinimumWidth(300)
        self.note = caption()
        self.note.setWordWrap(True)
        self.note.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.note.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Expanding)
        page = QWidget()
        self._list = QVBoxLayout(page)
        self._list.setContentsMargins(8, 8, 8, 8)
        self._list.setSpacing(8)
        self._list.addWidget(self.note)
        self._list.addStretch(0)
        self.setWidget(page)
        self.bar = FilterBar(self)
        self.bar.filtered.connect(self._show_filter)
        self.bar.hide()
        find = QShortcut(QKeySequence.StandardKey.Find, self)
        find.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        find.activated.connect(self.start_search)
        session.selected.connect(self._rebuild)
        session.replaced.connect(self._start_over)
        session.changed.connect(self._follow)
        session.values_changed.connect(self._see_values)
        self._rebuild()

    def sizeHint(self) -> QSize:
        return QSize(360, 600)

    def row(self, path: str, name: str) -> ParameterRow:
        """The row of a parameter that is shown. Raises KeyError."""
        self.sections[path].complete()
        return self.sections[path].rows[name]

    def _rebuild(self, *_: Any) -> None:
        """Show the sections of the selection: those that were shown before come back, others are made."""
        paths = [path for path in self.session.selection if path in self.session.network]
        before = {**self._kept, **self.sections}
        shown = {path: before.pop(path) for path in paths[:MOST_NODES] if self._holds(path, before.get(path))}
        for old in before.values():
            if old in self.sections.values():
                self._put_aside(old)
        gone = [path for path, section in before.items() if not self._holds(path, section)]
        gone += [path for path in before if path not in gone][: max(0, len(before) - len(gone) - KEPT)]
        for path in gone:
            self._drop(before.pop(path))
        self._kept = before
        self.sections = {}
        for i, path in enumerate(paths[:MOST_NODES]):
            section = shown.get(path)
            if section is None:
                section = NodeSection(self.session, path)
            elif section.isHidden():
                section.refresh()
            section.show_filter(self.bar.filter)
            self.sections[path] = section
            self._list.insertWidget(i, section)
            section.show()
        more = len(paths) - MOST_NODES
        self.note.setText(f"and {more} more" if more > 0 else "" if paths else "Select a node to see its parameters.")
        self.note.setVisible(bool(self.note.text()))
        self._list.setStretch(self._list.count() - 1, 1 if paths else 0)
        self._show_bar()

    def start_search(self) -> None:
        """Write into the line that searches."""
        if not self.bar.isHidden():
            self.bar.search.setFocus()
            self.bar.search.selectAll()

    def _show_filter(self, wanted: Filter) -> None:
        for section in self.sections.values():
            section.show_filter(wanted)

    def _show_bar(self) -> None:
        """Offer to search where there is much, or where something is hidden by a search."""
        many = sum(section.count for section in self.sections.values()) > FEW
        self.bar.setVisible(many or (bool(self.bar.filter) and bool(self.sections)))
        self.setViewportMargins(0, 0 if self.bar.isHidden() else HEIGHT, 0, 0)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.bar.setGeometry(0, 0, self.width(), HEIGHT)

    def _start_over(self, *_: Any) -> None:
        """Another document, or another palette: icons and colours of labels are drawn for one."""
        for section in (*self.sections.values(), *self._kept.values()):
            self._drop(section)
        self.sections, self._kept = {}, {}
        self._rebuild()

    def _holds(self, path: str, section: NodeSection | None) -> bool:
        """Whether a section is still that of the node at a path."""
        network = self.session.network
        return section is not None and path in network and network.node(path) is section.node

    def _put_aside(self, section: NodeSection) -> None:
        """Hide a section; it stays a child of the page."""
        section.leave()
        section.hide()
        self._list.removeWidget(section)

    def _follow(self, commands: Any) -> None:
        """Show what a change did; a node that was renamed, retyped or removed is made anew."""
        if list(self.sections) != list(self.session.selection[:MOST_NODES]):
            self._rebuild()
            return
        if not any(command.touched or command.structural for command in commands):
            for section in self.sections.values():
                section.show_keys()  # the looks of nodes alone, and the keys of the animation
            return
        for section in self.sections.values():
            section.refresh()

    def _see_values(self, paths: Any) -> None:
        """What wires carry is known anew."""
        for section in self.sections.values():
            for row in section.rows.values():
                if row.place.tie().kind == "wire" and not row.isHidden():
                    row.refresh()

    def _drop(self, section: NodeSection) -> None:
        section.leave()
        section.hide()
        self._list.removeWidget(section)
        section.setParent(None)
        section.deleteLater()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "_list"):
            self._start_over()
