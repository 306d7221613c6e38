"""The parameters of one node, below its name."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QHBoxLayout, QLabel, QToolButton, QVBoxLayout, QWidget

from nodegraph.animation import UI
from nodegraph.editor.parameters.filter import Filter
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
        self._filter = Filter()
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
            # What is in the hand stays, though it may pass its default.
            held = self.session.in_gesture and not present.isHidden()
            present.setVisible(held or self._filter.lets(present))
        self._show_trouble(self.session.network.node(self.path))
        self._waiting = [name for name in shown if name not in self.rows]
        if self._waiting:
            self._paint_at = time.perf_counter() + PATIENCE
            self._make_rest()
        self._show_nothing()
        self.show_keys()

    def show_keys(self) -> None:
        """Mark the parameters that the animation moves."""
        noted = self.session.network.node(self.path).ui.get(UI)
        for name, row in self.rows.items():
            row.label.set_keyed(isinstance(noted, dict) and name in noted)

    def show_filter(self, wanted: Filter) -> None:
        """Show only the parameters that a filter lets through."""
        if wanted != self._filter:
            self._filter = wanted
            self.refresh()

    @property
    def count(self) -> int:
        """How many parameters mean something now, whatever the filter."""
        return len(shown_parameters(self.session, self.path))

    def _show_nothing(self) -> None:
        """Say why there is nothing to see."""
        seen = bool(self._waiting) or any(not row.isHidden() for row in self.rows.values())
        self.nothing.setText("nothing that suits the search" if self._filter else "no parameters")
        self.nothing.setVisible(not seen)

    def _make_rest(self) -> None:
        """Make some of the rows that are missing; after a moment the window gets its turn."""
        self._rest.stop()
        end = time.perf_counter() + SLICE
        self.body.setUpdatesEnabled(False)
        while self._waiting:
            name = self._waiting.pop(0)
            row = self.rows[name] = ParameterRow(Place(self.session, self.path, name))
            self.layout_of_rows.insertWidget(self._index(name), row)
            row.setVisible(self._filter.lets(row))
            if time.perf_counter() > end:
                break
        if self._waiting:
            self._rest.start()
        else:
            self._show_nothing()
            self.show_keys()
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
        kept = kept_values(node)
        if node.trouble is not None:  # it says why none of the values can be used
            texts = [one_sentence(node.trouble)]
            texts += [f"Kept as stored: {', '.join(kept)}."] if kept else []
        else:
            known = getattr(node.processor, "params", ())
            texts = [f"{name}: kept as it was stored{one.reason}" for name, one in kept.items() if name not in known]
        self.trouble.setText("\n".join(texts))
        self.trouble.setVisible(bool(texts))

    def eventFilter(self, watched: Any, event: QEvent) -> bool:
        if watched is self.header and event.type() == QEvent.Type.MouseButtonDblClick:
            assert isinstance(event, QMouseEvent)
            self.fold(self.body.isVisibleTo(self))
            return True
        return super().eventFilter(watched, event)
