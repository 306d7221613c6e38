"""Which parameters the panel shows: those that bear some words, those that are not at their default."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QHBoxLayout, QLineEdit, QToolButton, QWidget

from nodegraph.editor.parameters.look import icon, ink

if TYPE_CHECKING:
    from nodegraph.editor.parameters.row import ParameterRow

HEIGHT = 44


@dataclass(frozen=True, slots=True)
class Filter:
    """words: all of them are in the name or the doc of a parameter. changed: it is set, linked or wired."""

    words: tuple[str, ...] = ()
    changed: bool = False

    def lets(self, row: ParameterRow) -> bool:
        """Whether a row is shown."""
        if self.changed and not row.changed:
            return False
        text = f"{row.place.name} {row.label.text} {row.declared.doc}".casefold()
        return all(word in text for word in self.words)

    def __bool__(self) -> bool:
        return bool(self.words) or self.changed


class FilterBar(QWidget):
    """A line to search in, and a button for what is not at its default."""

    filtered = Signal(object)  # Filter

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.search = QLineEdit()
        self.search.setObjectName("search")
        self.search.setPlaceholderText("Search parameters")
        self.search.setAccessibleName("Search parameters")
        self.search.setClearButtonEnabled(True)
        self.search.textChanged.connect(self._tell)
        self.search.installEventFilter(self)
        self.changed = QToolButton()
        self.changed.setCheckable(True)
        self.changed.setAutoRaise(True)
        self.changed.setFixedSize(28, 28)
        self.changed.setIconSize(QSize(16, 16))
        self.changed.setToolTip("Only what is not at its default")
        self.changed.setAccessibleName("Only what is not at its default")
        self.changed.toggled.connect(self._tell)
        line = QHBoxLayout(self)
        line.setContentsMargins(8, 8, 8, 4)
        line.setSpacing(4)
        line.addWidget(self.search, 1)
        line.addWidget(self.changed)
        self._draw_icon()

    @property
    def filter(self) -> Filter:
        """What is asked for now."""
        return Filter(tuple(self.search.text().casefold().split()), self.changed.isChecked())

    def clear(self) -> None:
        """Show everything."""
        self.search.clear()
        self.changed.setChecked(False)

    def _tell(self, _: object) -> None:
        self.filtered.emit(self.filter)

    def _draw_icon(self) -> None:
        self.changed.setIcon(icon("changed", ink(self.palette(), 0.85)))

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "changed"):
            self._draw_icon()

    def eventFilter(self, watched: object, event: QEvent) -> bool:
        if event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            if event.key() == Qt.Key.Key_Escape and self.search.text():
                self.search.clear()
                return True
        return super().eventFilter(watched, event)  # type: ignore[arg-type]
