"""The table of labels: number, name, colour, opacity, and whether it is seen."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QPoint, QSize, Qt, Signal
from PySide6.QtGui import QContextMenuEvent, QIcon, QKeyEvent, QPixmap, QResizeEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QFrame,
    QHBoxLayout,
    QHeaderView,
    QMenu,
    QPushButton,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from nodegraph.commands import Set, SetUI
from nodegraph.data import TransferFunction
from nodegraph.editor.parameters.color import ColorPicker, open_picker, to_qcolor
from nodegraph.editor.parameters.look import ROW_HEIGHT, caption, icon, ink
from nodegraph.editor.parameters.numbers import short, typed
from nodegraph.editor.parameters.transfer_function import labels
from nodegraph.editor.parameters.transfer_function.labels import Label
from nodegraph.editor.views.labels import Found, LabelSelection
from nodegraph.errors import GraphError
from nodegraph.params import Choice

if TYPE_CHECKING:
    from nodegraph.editor.parameters.place import Place

SEEN, ID, COLOR, OPACITY, NAME, VOXELS = range(6)
HEADS = ("", "Id", "", "Opacity", "Name", "Voxels")
WIDTHS = (28, 40, 36, 62, 96, 70)
NARROW = 330  #: pixels below which the voxels are not told


class LabelTable(QWidget):
    """Rows of labels. ``edited(function)`` is the function that a change leads to; names go into the ``ui``."""

    KEY = "labels"  #: of the ``ui`` of the node

    edited = Signal(object)
    began = Signal()
    ended = Signal()

    def __init__(self, place: Place | None = None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.place = place
        self.ids: Mapping[int, int] = {}
        self.function = TransferFunction()
        self.labels: list[Label] = []
        self.picker: ColorPicker | None = None
        self._filling = False
        self.table = QTableWidget(0, len(HEADS))
        self.table.setHorizontalHeaderLabels(HEADS)
        self.table.verticalHeader().hide()
        self.table.verticalHeader().setDefaultSectionSize(ROW_HEIGHT)
        self.table.setShowGrid(False)
        self.table.setFrameShape(QFrame.Shape.NoFrame)
        self.table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.table.setIconSize(QSize(22, 14))
        self.table.setMinimumHeight(216)
        self.table.setAccessibleName("Labels")
        for column, width in enumerate(WIDTHS):
            self.table.setColumnWidth(column, width)
        self.table.horizontalHeader().setSectionResizeMode(NAME, QHeaderView.ResizeMode.Stretch)
        self.table.horizontalHeader().setMinimumSectionSize(24)
        self.table.itemChanged.connect(self._typed)
        self.table.cellClicked.connect(self._clicked)
        self.paint = QPushButton("Colour all")
        self.paint.setToolTip("Give every label a colour of its own and hide 0")
        self.all = QPushButton("Show all")
        self.only = QPushButton("Only chosen")
        self.only.setToolTip("Hide all labels but those of the chosen rows")
        line = QHBoxLayout()
        line.setSpacing(4)
        for one, act in ((self.paint, self.color_all), (self.all, self.show_all), (self.only, self.show_only)):
            one.setFixedHeight(ROW_HEIGHT)
            one.setStyleSheet("padding: 0 8px")
            one.clicked.connect(act)
            line.addWidget(one)
        line.addStretch(1)
        self.table.itemSelectionChanged.connect(self._choose)
        self.chosen = LabelSelection.of(place.session) if place is not None else None
        if self.chosen is not None:
            self.chosen.changed.connect(self._mark)
        self.note = caption("Values between voxels are interpolated here: rims show the colours of other labels.")
        self.note.setWordWrap(True)
        self.nearest = QPushButton("Take the nearest")
        self.nearest.setFixedHeight(ROW_HEIGHT)
        self.nearest.setStyleSheet("padding: 0 8px")
        self.nearest.clicked.connect(self.take_nearest)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        below = QHBoxLayout()
        below.addWidget(self.note, 1)
        below.addWidget(self.nearest)
        for item in (line, self.table, below):
            layout.addWidget(item) if isinstance(item, QWidget) else layout.addLayout(item)

    # -- showing ------------------------------------------------------------------------------------------------

    def show_ids(self, ids: Mapping[int, int]) -> None:
        """Which labels there are, and how many voxels each has."""
        if dict(ids) != dict(self.ids):
            self.ids = ids
            self.table.setRowCount(len(ids))
            self.labels = []
            self.show_function(self.function)

    def show_function(self, function: TransferFunction) -> None:
        """Show what a function makes of the labels."""
        self.function = function
        if not self.ids:
            return
        found = labels.read(function, self.ids, self._noted())
        how = self._interpolation()
        self.note.setVisible(how != "nearest")
        self.nearest.setVisible(how not in ("nearest", ""))
        if found == self.labels:
            return
        before, self.labels = self.labels, found
        self._filling = True
        for row, label in enumerate(found):
            if row >= len(before) or before[row] != label:
                self._fill(row, label)
        self._filling = False

    def _fill(self, row: int, label: Label) -> None:
        color = QPixmap(22, 14)
        color.fill(to_qcolor(label.color))
        faded = ink(self.palette(), 1.0 if label.visible else 0.5)
        eye = icon("show" if label.visible else "hide", faded)
        texts = ("", str(label.id), "", short(label.opacity), label.name, f"{self.ids.get(label.id, 0):,}")
        for column, text in enumerate(texts):
            item = self.table.item(row, column) or self._item(row, column)
            item.setText(text)
            item.setForeground(faded)
            if column == SEEN:
                item.setIcon(eye)
                item.setToolTip("Hide" if label.visible else "Show")
            if column == COLOR:
                item.setIcon(QIcon(color))

    def _item(self, row: int, column: int) -> QTableWidgetItem:
        """Make an item; from then on it is changed and not replaced, since somebody may be editing it."""
        item = QTableWidgetItem()
        flags = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
        if column in (OPACITY, NAME):
            flags |= Qt.ItemFlag.ItemIsEditable
        item.setFlags(flags)
        if column in (ID, OPACITY, VOXELS):
            item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        if column == COLOR:
            item.setToolTip("Choose a colour")
        self.table.setItem(row, column, item)
        return item

    def resizeEvent(self, event: QResizeEvent) -> None:
        self.table.setColumnHidden(VOXELS, self.width() < NARROW)

    def _noted(self) -> dict[str, Any]:
        ui = self.place.node.ui.get(self.KEY) if self.place is not None else None
        found = ui.get(self.place.name) if isinstance(ui, dict) and self.place is not None else None
        return found if isinstance(found, dict) else {}

    def _interpolation(self) -> str:
        """How the node finds values between voxels, as far as it can be chosen; empty where it cannot."""
        node = self.place.node if self.place is not None else None
        declared = getattr(node.processor, "params", {}).get("interpolation") if node is not None else None
        if node is None or not isinstance(declared, Choice) or "nearest" not in declared.choices:
            return ""
        return str(node.params.get("interpolation", declared.default))

    # -- changing -----------------------------------------------------------------------------------------------

    def put(self, found: Iterable[Label]) -> None:
        """Let the document have labels: steps in the function, names in the ``ui``."""
        listed = list(found)
        function = labels.function_of(listed, self.function.reference_length)
        if self.place is None:
            self.edited.emit(function)
            return
        ui = self.place.node.ui.get(self.KEY)
        before = ui if isinstance(ui, dict) else {}
        after = {key: kept for key, kept in before.items() if key != self.place.name}
        after |= {self.place.name: noted} if (noted := labels.notes(listed)) else {}
        session = self.place.session
        with session.gesture(f"set {self.place.name}"):
            session.do(SetUI(self.place.path, self.KEY, after or None))
            self.edited.emit(function)

    def color_all(self) -> None:
        """Give every label a colour of its own."""
        kept = labels.function_of(self.labels, self.function.reference_length) == self.function
        found = self.labels if kept else [replace(label, opacity=labels.OPACITY) for label in self.labels]
        self.put(labels.in_colors(found))

    def show_all(self) -> None:
        """Show all labels but 0."""
        self.put(replace(label, visible=label.id != 0) for label in self.labels)

    def show_only(self) -> None:
        """Hide all labels but those of the chosen rows."""
        rows = self._rows()
        if rows:
            self.put(replace(label, visible=row in rows) for row, label in enumerate(self.labels))

    def take_nearest(self) -> None:
        """Let the node take the nearest voxel's value instead of interpolating."""
        if self.place is not None:
            self.place.session.do(Set(f"{self.place.path}.interpolation", "nearest"))

    def _mark(self) -> None:
        """Choose the row of the label that was picked in a view."""
        label = self.chosen.label if self.chosen is not None else None
        row = next((row for row, one in enumerate(self.labels) if label is not None and one.id == label.id), -1)
        if row >= 0 and self._rows() != {row}:
            self.table.selectRow(row)
            self.table.scrollTo(self.table.model().index(row, ID))

    def _choose(self) -> None:
        """Mark the label of the one row that is chosen in the views."""
        rows = self._rows()
        if self.chosen is not None and len(rows) == 1 and not self._filling:
            label = self.labels[min(rows)]
            before = self.chosen.label
            if label.id != 0 and (before is None or before.id != label.id):
                self.chosen.select(Found(label.id, label.name))

    def toggle(self, rows: Iterable[int]) -> None:
        """Hide what is seen, and show what is hidden; several rows follow the first."""
        chosen = set(rows)
        if chosen:
            seen = not self.labels[min(chosen)].visible
            self._change(chosen, visible=seen)

    def pick_color(self, row: int) -> None:
        """Open the colour picker for a label, and for the other chosen rows with it."""
        rows = self._rows() | {row} if row in self._rows() else {row}
        picker = open_picker(self, self.labels[row].color, lambda color: self._change(rows, color=color))
        area = self.table.visualRect(self.table.model().index(row, COLOR))
        picker.show_at(self.table.viewport().mapToGlobal(area.bottomLeft() + QPoint(0, 2)))

    def _change(self, rows: Iterable[int], **values: Any) -> None:
        chosen = set(rows)
        self.put(replace(one, **values) if row in chosen else one for row, one in enumerate(self.labels))

    def _rows(self) -> set[int]:
        return {index.row() for index in self.table.selectionModel().selectedRows()}

    def _clicked(self, row: int, column: int) -> None:
        if column == SEEN:
            self.toggle([row])
        elif column == COLOR:
            self.pick_color(row)

    def _typed(self, item: QTableWidgetItem) -> None:
        if self._filling:
            return
        row = item.row()
        rows = self._rows() if row in self._rows() else {row}
        if item.column() == NAME:
            self._change({row}, name=item.text().strip())
        elif item.column() == OPACITY:
            try:
                value = float(typed(item.text()))
            except GraphError:
                value = -1.0
            if 0.0 <= value <= 1.0:
                self._change(rows, **({"opacity": value, "visible": True} if value > 0.0 else {"visible": False}))
        if row < len(self.labels):  # what is no number shows what was there
            self._filling = True
            self._fill(row, self.labels[row])
            self._filling = False

    def keyPressEvent(self, event: QKeyEvent) -> None:
        row = self.table.currentRow()
        act: dict[int, Callable[[], None]] = {
            Qt.Key.Key_Space: partial(self.toggle, self._rows()),
            Qt.Key.Key_C: partial(self.pick_color, row),
        }
        if event.key() in act and row >= 0:
            act[event.key()]()
        else:
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        rows = self._rows()
        menu = QMenu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.addAction("Show or hide\tSpace", partial(self.toggle, rows)).setEnabled(bool(rows))
        menu.addAction("Colour …\tC", partial(self.pick_color, max(0, self.table.currentRow()))).setEnabled(bool(rows))
        menu.addAction("Only these", self.show_only).setEnabled(bool(rows))
        menu.popup(event.globalPos())
