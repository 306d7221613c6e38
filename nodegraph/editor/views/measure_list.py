"""The list of what is measured, with values to be read, copied and deleted."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QApplication,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QStackedLayout,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from nodegraph.editor.views import measures as m
from nodegraph.editor.views.icons import IconButton, icon
from nodegraph.editor.views.measured import Entry, Measured

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

COLUMNS = ("What", "Value", "Mean", "Deviation", "Least", "Greatest", "Samples", "View")
EMPTY = "Nothing is measured yet. In a view, D measures a distance, A an angle, R a rectangle and P a polygon."


class MeasureList(QWidget):
    """All measures of the document. Who chooses one sees it marked in the views; Delete takes it away."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.all = Measured.of(session)
        self.tree = QTreeWidget(self)
        self.tree.setHeaderLabels(list(COLUMNS))
        self.tree.setRootIsDecorated(False)
        self.tree.setUniformRowHeights(True)
        self.tree.setAllColumnsShowFocus(True)
        self.tree.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        numbers = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        for column in range(1, 7):
            self.tree.headerItem().setTextAlignment(column, numbers)
        header = self.tree.header()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setStretchLastSection(True)
        self.tree.itemSelectionChanged.connect(self._choose)
        self._empty = QLabel(EMPTY, self)
        self._empty.setProperty("dim", True)
        self._empty.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._empty.setWordWrap(True)
        self._copy = IconButton("copy", "Copy as a table (Ctrl+C)", self)
        self._copy.clicked.connect(self.copy)
        self._delete = IconButton("delete", "Delete what is chosen (Del)", self)
        self._delete.clicked.connect(self.delete)
        side = QVBoxLayout()
        side.setContentsMargins(4, 4, 4, 4)
        side.setSpacing(2)
        side.addWidget(self._copy)
        side.addWidget(self._delete)
        side.addStretch(1)
        self._pages = QStackedLayout()
        self._pages.addWidget(self._empty)
        self._pages.addWidget(self.tree)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(0)
        row.addLayout(self._pages, 1)
        row.addLayout(side)
        self.all.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the list anew."""
        entries = self.all.entries()
        self.tree.blockSignals(True)
        while self.tree.topLevelItemCount() > len(entries):
            self.tree.takeTopLevelItem(self.tree.topLevelItemCount() - 1)
        while self.tree.topLevelItemCount() < len(entries):
            self.tree.addTopLevelItem(QTreeWidgetItem())
        for place, entry in enumerate(entries):
            item = self.tree.topLevelItem(place)
            assert item is not None
            for column, text in enumerate(row_of(self.all, entry)):
                item.setText(column, text)
                if 1 <= column <= 6:
                    item.setTextAlignment(column, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            item.setIcon(0, icon(entry.measure.kind, self.palette()))
            if entry[:2] == self.all.marked and not item.isSelected():
                self.tree.clearSelection()
                item.setSelected(True)
                self.tree.scrollToItem(item)
        self.tree.blockSignals(False)
        self._pages.setCurrentIndex(1 if entries else 0)
        self._copy.setEnabled(bool(entries))
        self._delete.setEnabled(bool(self.chosen()))

    def chosen(self) -> list[Entry]:
        """The measures that are chosen."""
        entries = self.all.entries()
        places = [self.tree.indexOfTopLevelItem(item) for item in self.tree.selectedItems()]
        return [entries[place] for place in sorted(places) if place < len(entries)]

    def delete(self) -> None:
        """Delete the chosen ones."""
        self.all.remove(self.chosen())

    def copy(self) -> None:
        """Copy the chosen ones, or all, as a table with tabs between columns."""
        QApplication.clipboard().setText(table(self.all, self.chosen() or self.all.entries()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        control = event.modifiers() & Qt.KeyboardModifier.ControlModifier
        if event.key() == Qt.Key.Key_Delete:
            self.delete()
        elif event.key() == Qt.Key.Key_C and control:
            self.copy()
        else:
            super().keyPressEvent(event)

    def _choose(self) -> None:
        chosen = self.chosen()
        self._delete.setEnabled(bool(chosen))
        self.all.mark(chosen[0][:2] if len(chosen) == 1 else None)


def row_of(measured: Measured, entry: Entry) -> list[str]:
    """The texts of a row."""
    found = measured.statistics(entry)
    numbers = [""] * 5
    if found is not None:
        unit = f" {found.unit}".rstrip()
        told = [f"{value:.5g}{unit}" for value in (found.mean, found.std, found.min, found.max)]
        numbers = [*told, str(found.count)]
    return [entry.measure.kind.capitalize(), m.value_text(entry.measure), *numbers, entry.view]


def table(measured: Measured, entries: list[Entry]) -> str:
    """Lines of tab-separated columns with all digits, in mm, degrees and mm^2."""
    lines = ["kind\tmm\tdegrees\tmm^2\tmean\tstd\tmin\tmax\tsamples\tunit\tview\tpoints"]
    for entry in entries:
        measure, found = entry.measure, measured.statistics(entry)
        values = {"distance": m.distance, "angle": m.angle}
        size = values.get(measure.kind, m.area)(measure.array)
        column = 0 if measure.kind == "distance" else 1 if measure.kind == "angle" else 2
        sizes = ["", "", ""]
        sizes[column] = f"{size:.9g}" if math.isfinite(size) else ""
        told = [""] * 6
        if found is not None:
            told = [f"{value:.9g}" for value in (found.mean, found.std, found.min, found.max)]
            told += [str(found.count), found.unit]
        points = "; ".join(" ".join(f"{x:.9g}" for x in point) for point in measure.points)
        lines.append("\t".join([measure.kind, *sizes, *told, entry.view, points]))
    return "\n".join(lines) + "\n"
