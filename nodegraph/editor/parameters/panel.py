"""The dock that shows the parameters of the selected nodes."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, QSize, Qt, QTimer
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QScrollArea, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from nodegraph.editor.parameters.look import ROW_HEIGHT, caption, complaint, icon, ink
from nodegraph.editor.parameters.place import Place, kept_values, shown_parameters
from nodegraph.editor.parameters.row import ParameterRow
from nodegraph.errors import one_sentence

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

SLICE = 0.010
"""Seconds for which rows are made before the window gets its turn again."""
PATIENCE = 0.25
"""Seconds for which rows are made before what there is is painted: each painting of a long list takes time, too."""
MOST_NODES = 12
"""Nodes of a selection whose parameters are shown; more are counted."""
KEPT = 6
"""Sections of nodes that were selected before which are kept: widgets take long to make and little room."""


class NodeSection(QWidget):
    """The parameters of one node below its name, which folds them away."""

    def __init__(self, session: Session, path: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.path = path
        self.rows: dict[str, ParameterRow] = {}
        self._rest = QTimer(self, singleShot=True, interval=0)
        self._rest.timeout.connect(self._make_rest)
        self._waiting: list[str] = []  # parameters whose rows are still to be made
        self._paint_at = 0.0
        node = self.node = session.network.node(path)
        self.body = QWidget()
        self.header = QWidget()
        self.header.installEventFilter(self)
        line = QHBoxLayout(self.header)
        line.setContentsMargins(0, 0, 0, 0)
        line.setSpacing(4)
        self.arrow = QToolButton()
        self.arrow.setAutoRaise(True)
        self.arrow.setFixedSize(22, ROW_HEIGHT)
        self.arrow.clicked.connect(lambda: self.fold(self.body.isVisibleTo(self)))
        title = QLabel(node.path)
        font = title.font()
        font.setBold(True)
        title.setFont(font)
        kind = caption(node.type)
        kind.setAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        if node.processor is not None:
            self.header.setToolTip(f"<p>{(node.processor.__doc__ or '').strip().partition(chr(10))[0]}</p>")
        for widget in (self.arrow, title):
            line.addWidget(widget)
        line.addStretch(1)
        line.addWidget(kind)
        self.trouble = complaint()
        self.trouble.setIndent(12)
        self.layout_of_rows = QVBoxLayout(self.body)
        self.layout_of_rows.setContentsMargins(0, 2, 0, 8)
        self.layout_of_rows.setSpacing(4)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(2)
        outer.addWidget(self.header)
        outer.addWidget(self.trouble)
        outer.addWidget(self.body)
        self.nothing = caption("no parameters")
        self.nothing.setIndent(12)
        self.layout_of_rows.addWidget(self.nothing)
        self.fold(False)
        self.refresh()

    def fold(self, folded: bool) -> None:
        """Show the name alone, or the parameters as well."""
        self.body.setVisible(not folded)
        self.arrow.setIcon(icon("right" if folded else "down", ink(self.palette(), 0.8)))
        self.arrow.setAccessibleName("Unfold" if folded else "Fold")

    def complete(self) -> None:
        """Make all rows now."""
        while self._waiting:
            self._make_rest()

    def refresh(self) -> None:
        """Show what the document has now. Rows that come to mean something are made bit by bit, others hidden."""
        shown = shown_parameters(self.session, self.path)
        for name, row in self.rows.items():
            if name not in shown:
                row.leave()
                row.hide()
        for name in shown:
            present = self.rows.get(name)
            if present is None:
                continue
            if present.declared is not present.place.declared:
                present = self._remake(name, present)
            else:
                present.refresh()
            if present.isHidden():
                present.show()
        self.nothing.setVisible(not shown)
        self._show_trouble(self.session.network.node(self.path))
        self._waiting = [name for name in shown if name not in self.rows]
        if self._waiting:
            self._paint_at = time.perf_counter() + PATIENCE
            self._make_rest()

    def _make_rest(self) -> None:
        """Make some of the rows that are missing; after a moment the window gets its turn."""
        self._rest.stop()
        end = time.perf_counter() + SLICE
        self.body.setUpdatesEnabled(False)
        while self._waiting:
            name = self._waiting.pop(0)
            row = self.rows[name] = ParameterRow(Place(self.session, self.path, name))
            self.layout_of_rows.insertWidget(self._index(name), row)
            row.show()
            if time.perf_counter() > end:
                break
        if self._waiting:
            self._rest.start()
        if not self._waiting or time.perf_counter() > self._paint_at:
            self.body.setUpdatesEnabled(True)
            self._paint_at = time.perf_counter() + PATIENCE

    def _remake(self, name: str, old: ParameterRow) -> ParameterRow:
        """Make the row of a parameter anew: its processor was reloaded and declares something else."""
        old.leave()
        made = self.rows[name] = ParameterRow(Place(self.session, self.path, name))
        self.layout_of_rows.replaceWidget(old, made)
        old.hide()
        old.deleteLater()
        return made

    def leave(self) -> None:
        """End open gestures: the section is about to go, or to be hidden until its node is selected again."""
        self._rest.stop()
        self._waiting = []
        self.body.setUpdatesEnabled(True)
        for row in self.rows.values():
            row.leave()

    def _index(self, name: str) -> int:
        """Where the row of a parameter belongs among those that are there: the declaration's order."""
        node = self.session.network.node(self.path)
        names = list(node.expose.params if node.network is not None else getattr(node.processor, "params", ()))
        return sum(1 for other in names[: names.index(name)] if other in self.rows)

    def _show_trouble(self, node: Any) -> None:
        texts = [one_sentence(node.trouble)] if node.trouble is not None else []
        known = getattr(node.processor, "params", ())
        texts += [
            f"{name}: kept as it was stored{kept.reason}"
            for name, kept in kept_values(node).items()
            if name not in known
        ]
        self.trouble.setText("\n".join(texts))
        self.trouble.setVisible(bool(texts))

    def eventFilter(self, watched: Any, event: QEvent) -> bool:
        if watched is self.header and event.type() == QEvent.Type.MouseButtonDblClick:
            assert isinstance(event, QMouseEvent)
            self.fold(self.body.isVisibleTo(self))
            return True
        return super().eventFilter(watched, event)


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
            self.sections[path] = section
            self._list.insertWidget(i, section)
            section.show()
        more = len(paths) - MOST_NODES
        self.note.setText(f"and {more} more" if more > 0 else "" if paths else "Select a node to see its parameters.")
        self.note.setVisible(bool(self.note.text()))
        self._list.setStretch(self._list.count() - 1, 1 if paths else 0)

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
            return  # the looks of nodes alone
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
