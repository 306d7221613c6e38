"""Ctrl+K: every command, processor and node by its name."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QIcon, QKeyEvent
from PySide6.QtWidgets import QFrame, QLineEdit, QTreeWidget, QTreeWidgetItem, QVBoxLayout, QWidget

SHOWN = 60


@dataclass(frozen=True, slots=True)
class Entry:
    """Something that can be done. kind: Command, Add or Go to. hint: its shortcut, or where it belongs."""

    kind: str
    text: str
    act: Callable[[], object]
    hint: str = ""
    words: str = ""
    icon: QIcon | None = None


def rank(entry: Entry, words: Iterable[str]) -> int | None:
    """How well an entry fits some words, less is better; None where one of them is missing."""
    text, all_text, total = entry.text.casefold(), f"{entry.kind} {entry.text} {entry.words}".casefold(), 0
    for word in words:
        if text.startswith(word):
            continue
        if f" {word}" in f" {text}":
            total += 1
        elif word in text:
            total += 2
        elif word in all_text:
            total += 4
        else:
            return None
    return total


class CommandPalette(QFrame):
    """A field and a list over the middle of the window. Enter does the entry, Escape closes."""

    def __init__(self, parent: QWidget, entries: Callable[[], list[Entry]]) -> None:
        super().__init__(parent)
        self._collect = entries
        self._entries: list[Entry] = []
        self._found: list[Entry] = []
        self.setObjectName("command_palette")
        self.setAutoFillBackground(True)
        self.field = QLineEdit()
        self.field.setObjectName("search")
        self.field.setPlaceholderText("Do, add or go to ...")
        self.list = QTreeWidget()
        self.list.setHeaderHidden(True)
        self.list.setColumnCount(3)
        self.list.setRootIsDecorated(False)
        self.list.setUniformRowHeights(True)
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(10, 10, 10, 10)
        layout.setSpacing(8)
        layout.addWidget(self.field)
        layout.addWidget(self.list)
        self.field.installEventFilter(self)
        self.field.textChanged.connect(self.filter)
        self.field.returnPressed.connect(self.do_current)
        self.list.itemClicked.connect(lambda _item: self.do_current())
        parent.installEventFilter(self)
        self.hide()

    def open(self) -> None:
        """Show it, with everything that can be done now."""
        self._entries = self._collect()
        self.field.clear()
        self.filter("")
        self._place()
        self.show()
        self.raise_()
        self.field.setFocus()

    def filter(self, text: str) -> None:
        """List what fits, the best first."""
        words = text.casefold().split()
        ranked = [(rank(entry, words), place, entry) for place, entry in enumerate(self._entries)]
        self._found = [entry for score, _, entry in sorted((r for r in ranked if r[0] is not None), key=_order)][:SHOWN]
        self.list.clear()
        for entry in self._found:
            item = QTreeWidgetItem([entry.text, entry.kind, entry.hint])
            if entry.icon is not None:
                item.setIcon(0, entry.icon)
            for column in (1, 2):
                item.setForeground(column, self.palette().placeholderText())
            item.setTextAlignment(2, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
            self.list.addTopLevelItem(item)
        self._move_to(0)
        self._place()

    def found(self) -> list[str]:
        """Texts of what is listed."""
        return [entry.text for entry in self._found]

    def do_current(self) -> None:
        """Do the entry that is marked, and close."""
        row = self._row()
        self.close_it()
        if 0 <= row < len(self._found):
            self._found[row].act()

    def close_it(self) -> None:
        """Go away; the window has the keyboard again."""
        self.hide()
        parent = self.parentWidget()
        if parent is not None:
            parent.setFocus()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if watched is self.field and isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            step = {Qt.Key.Key_Down: 1, Qt.Key.Key_Up: -1, Qt.Key.Key_PageDown: 8, Qt.Key.Key_PageUp: -8}
            if event.key() in step:
                self._move_to(self._row() + step[Qt.Key(event.key())])
                return True
            if event.key() == Qt.Key.Key_Escape:
                self.close_it()
                return True
        elif watched is self.field and event.type() == QEvent.Type.FocusOut:
            self.hide()
        elif watched is self.parent() and event.type() == QEvent.Type.Resize and self.isVisible():
            self._place()
        return super().eventFilter(watched, event)

    def _row(self) -> int:
        item = self.list.currentItem()
        return self.list.indexOfTopLevelItem(item) if item is not None else -1

    def _move_to(self, row: int) -> None:
        item = self.list.topLevelItem(max(0, min(len(self._found) - 1, row)))
        if item is not None:
            self.list.setCurrentItem(item)

    def _place(self) -> None:
        parent = self.parentWidget()
        if parent is not None:
            width, height = min(620, parent.width() - 40), min(430, parent.height() - 80)
            row = self.list.sizeHintForRow(0) if self._found else 0
            height = min(height, 68 + row * max(1, len(self._found)))
            self.setGeometry((parent.width() - width) // 2, 60, width, height)
            self.list.setColumnWidth(0, width - 240)
            self.list.setColumnWidth(1, 90)


def _order(item: tuple[int | None, int, Entry]) -> tuple[int, int]:
    return item[0] or 0, item[1]
