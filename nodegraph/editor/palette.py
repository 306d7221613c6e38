"""The processors to choose from: a tree by category with a search, from which one drags them onto the canvas."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from PySide6.QtCore import QMimeData, QSize, Qt, Signal
from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QLabel, QLineEdit, QTreeWidget, QTreeWidgetItem, QVBoxLayout, QWidget

from nodegraph import ports, registry
from nodegraph.editor import theme
from nodegraph.editor.canvas.faces import spaced
from nodegraph.editor.session import Session

MIME = "application/x-nodegraph-processor"
"""What a drag out of the palette carries: the id of the processor as UTF-8."""

_ID = Qt.ItemDataRole.UserRole
_TEXT = Qt.ItemDataRole.UserRole + 1


class Palette(QWidget):
    """A search and the tree. ``chosen`` is sent for a double click or Enter, ``highlighted`` for the current entry."""

    chosen = Signal(str)
    highlighted = Signal(str)

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.search = QLineEdit()
        self.search.setObjectName("search")
        self.search.setPlaceholderText("Search processors")
        self.search.setClearButtonEnabled(True)
        self.search.setToolTip("Words of the name, of what it does, or of port types: volume image")
        self.tree = _Tree()
        self.nothing = QLabel("Nothing has all these words.")
        self.nothing.hide()
        self.nothing.setProperty("dim", True)
        self.nothing.setAlignment(Qt.AlignmentFlag.AlignCenter)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        above = QVBoxLayout()
        above.setContentsMargins(8, 6, 8, 8)
        above.addWidget(self.search)
        layout.addLayout(above)
        layout.addWidget(self.nothing)
        layout.addWidget(self.tree, 1)
        self.search.textChanged.connect(self.filter)
        self.search.returnPressed.connect(self._choose_current)
        self.tree.itemActivated.connect(self._choose)
        self.tree.currentItemChanged.connect(self._highlight)
        self.refresh()

    def refresh(self) -> None:
        """Read the processors anew. Loading their files takes a moment, so that happens beside the window."""
        self.session.work(registry.catalogue, self.fill)

    def fill(self, catalogue: Iterable[Mapping[str, Any]] | None) -> None:
        """Show these entries of the catalogue, open by category."""
        self.tree.clear()
        homes: dict[str, QTreeWidgetItem] = {}
        for entry in sorted(catalogue or (), key=lambda entry: str(entry["id"])):
            category, _, _ = str(entry["id"]).rpartition(".")
            home = homes.get(category)
            if home is None:
                home = homes[category] = QTreeWidgetItem(self.tree, [_title(category)])
                home.setFlags(Qt.ItemFlag.ItemIsEnabled)
                font = home.font(0)
                font.setBold(True)
                home.setFont(0, font)
            item = QTreeWidgetItem(home, [_name(entry)])
            item.setData(0, _ID, entry["id"])
            item.setData(0, _TEXT, _words(entry))
            item.setIcon(0, _plug(entry))
            item.setToolTip(0, f"<p>{str(entry.get('doc', '')).partition('. ')[0].split(chr(10) * 2)[0]}</p>")
            if entry.get("unavailable"):
                item.setDisabled(True)
                item.setToolTip(0, f"<p>{entry['unavailable']}</p>")
        self.tree.expandAll()
        self.filter(self.search.text())

    def filter(self, text: str) -> None:
        """Show what has all the words of a text; what has them in its name comes first as the current one."""
        words = text.casefold().split()
        best: tuple[int, QTreeWidgetItem] | None = None
        for place in range(self.tree.topLevelItemCount()):
            home = self.tree.topLevelItem(place)
            assert home is not None
            shown = 0
            for item in _children(home):
                fits = all(word in item.data(0, _TEXT) for word in words)
                item.setHidden(not fits)
                shown += fits
                rank = sum(word not in item.text(0).casefold() for word in words)
                if fits and not item.isDisabled() and (best is None or rank < best[0]):
                    best = (rank, item)
            home.setHidden(shown == 0)
        self.nothing.setVisible(bool(words) and best is None)
        if words and best is not None:
            self.tree.setCurrentItem(best[1])

    def shown(self) -> list[str]:
        """Ids of the entries that the search leaves."""
        found = []
        for place in range(self.tree.topLevelItemCount()):
            home = self.tree.topLevelItem(place)
            found += [str(item.data(0, _ID)) for item in _children(home) if not item.isHidden()]
        return found

    def ids(self) -> list[str]:
        """Ids of all entries that can be added."""
        tops = [self.tree.topLevelItem(place) for place in range(self.tree.topLevelItemCount())]
        return [str(item.data(0, _ID)) for home in tops for item in _children(home) if not item.isDisabled()]

    def _choose_current(self) -> None:
        item = self.tree.currentItem()
        if item is not None:
            self._choose(item)

    def _choose(self, item: QTreeWidgetItem) -> None:
        if item.data(0, _ID) and not item.isDisabled():
            self.chosen.emit(item.data(0, _ID))

    def _highlight(self, item: QTreeWidgetItem | None) -> None:
        if item is not None and item.data(0, _ID):
            self.highlighted.emit(item.data(0, _ID))


class _Tree(QTreeWidget):
    def __init__(self) -> None:
        super().__init__()
        self.setHeaderHidden(True)
        self.setIndentation(14)
        self.setUniformRowHeights(True)
        self.setDragEnabled(True)
        self.setDragDropMode(QTreeWidget.DragDropMode.DragOnly)
        self.setIconSize(QSize(12, 12))
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)

    def mimeTypes(self) -> list[str]:
        return [MIME]

    def mimeData(self, items: Sequence[QTreeWidgetItem]) -> QMimeData:
        data = QMimeData()
        for item in items:
            if item.data(0, _ID):
                data.setData(MIME, str(item.data(0, _ID)).encode())
        return data


def _children(home: QTreeWidgetItem | None) -> list[QTreeWidgetItem]:
    found = [home.child(row) for row in range(home.childCount())] if home is not None else []
    return [item for item in found if item is not None]


def _name(entry: Mapping[str, Any]) -> str:
    return spaced(str(entry.get("name") or entry["id"].rpartition(".")[2]))


def _title(name: str) -> str:
    text = name.replace("_", " ").replace(".", " / ")
    return text[:1].upper() + text[1:]


def _words(entry: Mapping[str, Any]) -> str:
    kinds = [str(port.get("type", "")) for side in ("inputs", "outputs") for port in entry.get(side, {}).values()]
    named = str(entry["id"]).replace("_", " ")
    return " ".join([str(entry["id"]), named, str(entry.get("doc", "")), *kinds]).casefold()


def _plug(entry: Mapping[str, Any]) -> QIcon:
    """A disc in the colour of what comes out, or of what goes in where nothing does."""
    sides = [*entry.get("outputs", {}).values(), *entry.get("inputs", {}).values()]
    colors = {record.name: record.color for record in ports.port_types()}
    color = colors.get(str(sides[0]["type"]) if sides else "", "#909090")
    return QIcon(theme.disc(color, 12))
