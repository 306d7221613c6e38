"""What a proposal shall keep, and what was found: a table and a plot of the front, of which one row is marked."""

from __future__ import annotations

from typing import NamedTuple

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QDoubleSpinBox,
    QHBoxLayout,
    QHeaderView,
    QPushButton,
    QSizePolicy,
    QSpinBox,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from nodegraph.editor.quality.front_plot import FrontPlot
from nodegraph.editor.quality.measuring import Choice, Proposal
from nodegraph.editor.quality.words import dim, upright

SOUGHT = {"max": "max", "rmse": "RMSE", "p999": "99.9 %"}
SECONDS = 30


class Asked(NamedTuple):
    """What settings shall keep. max_error, milliseconds: None where anything will do. seconds: for the search."""

    max_error: float | None
    figure: str
    milliseconds: float | None
    seconds: float


class Proposals(QWidget):
    """`wanted`: search for what `asked` says. `marked`: another row is. `taken`: the marked row shall be set."""

    wanted = Signal()
    marked = Signal()
    taken = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.proposal: Proposal | None = None
        self.rows = QTreeWidget()
        self.rows.setHeaderLabels(["Time", "Error", "Change"])
        self.rows.setRootIsDecorated(False)
        self.rows.setUniformRowHeights(True)
        self.rows.setMinimumHeight(56)
        self.rows.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Ignored)  # a low panel needs no bar
        for column in (0, 1):
            self.rows.header().setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
            self.rows.headerItem().setTextAlignment(column, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.rows.currentItemChanged.connect(lambda _item, _before: self._mark())
        self.rows.itemActivated.connect(lambda _item, _column: self.taken.emit())
        self.plot = FrontPlot()
        self.plot.chosen.connect(self.mark)
        results = QHBoxLayout()
        results.setSpacing(0)
        results.addWidget(self.rows, 3)
        results.addWidget(upright())
        results.addWidget(self.plot, 2)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(6)
        layout.addLayout(self._asking())
        layout.addLayout(results, 1)

    def _asking(self) -> QHBoxLayout:
        self.max_error = _number(1.0, 5, 0.001, "The greatest error that is allowed, in linear light")
        self.max_error.setValue(0.01)
        self.figure = QComboBox()
        self.figure.setToolTip("Which error is meant")
        for name, words in SOUGHT.items():
            self.figure.addItem(words, name)
        self.milliseconds = _number(60000.0, 0, 10.0, "The longest that a frame may take, at the size of the view")
        self.milliseconds.setSuffix(" ms")
        for box in (self.max_error, self.milliseconds):
            box.valueChanged.connect(lambda _: self.marked.emit())
        self.seconds = QSpinBox()
        self.seconds.setRange(2, 600)
        self.seconds.setValue(SECONDS)
        self.seconds.setSuffix(" s")
        self.seconds.setToolTip("How long settings are tried; the references, and the last trial, take time beside it")
        self.propose = QPushButton("Propose")
        self.propose.setToolTip("Search for other settings: the cheapest within an error, else the most exact")
        self.propose.clicked.connect(self.wanted.emit)
        row = QHBoxLayout()
        row.setSpacing(6)
        groups: tuple[tuple[str, tuple[QWidget, ...]], ...] = (
            ("Error up to", (self.max_error, self.figure)),
            ("Frame up to", (self.milliseconds,)),
            ("Try for", (self.seconds,)),
        )
        for words, boxes in groups:
            row.addWidget(dim(words))
            for one in boxes:
                row.addWidget(one)
            row.addSpacing(8)
        row.addWidget(self.propose)
        row.addStretch(1)
        return row

    @property
    def asked(self) -> Asked:
        """What the fields say."""
        error, milliseconds = self.max_error.value() or None, self.milliseconds.value() or None
        return Asked(error, str(self.figure.currentData()), milliseconds, float(self.seconds.value()))

    @property
    def choice(self) -> Choice | None:
        """What the marked row stands for."""
        place = self._place()
        return self.proposal.choices[place] if self.proposal is not None and place >= 0 else None

    def show_proposal(self, found: Proposal | None) -> None:
        """Show what was found, the best row marked; None clears it."""
        self.proposal = found
        self.rows.clear()
        self.plot.show_proposal(found)
        for i, choice in enumerate(found.choices if found is not None else ()):
            item = QTreeWidgetItem([f"{1e3 * choice.seconds:.3g} ms", f"{choice.error:.2g}", choice.told])
            item.setToolTip(2, choice.told)
            for column in (0, 1):
                item.setTextAlignment(column, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self.rows.addTopLevelItem(item)
            if found is not None and i == found.best:
                self.rows.setCurrentItem(item)

    def mark(self, place: int) -> None:
        """Mark a row."""
        item = self.rows.topLevelItem(place)
        if item is not None:
            self.rows.setCurrentItem(item)

    def _place(self) -> int:
        item = self.rows.currentItem()
        return self.rows.indexOfTopLevelItem(item) if item is not None else -1

    def _mark(self) -> None:
        self.plot.select(self._place())
        self.marked.emit()


def _number(most: float, decimals: int, step: float, tip: str) -> QDoubleSpinBox:
    """A field for a number above 0; at 0 it says that anything will do."""
    box = QDoubleSpinBox()
    box.setRange(0.0, most)
    box.setDecimals(decimals)
    box.setSingleStep(step)
    box.setSpecialValueText("any")
    box.setMinimumWidth(86)
    box.setToolTip(tip)
    return box
