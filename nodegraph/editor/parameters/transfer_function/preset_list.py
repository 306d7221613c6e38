"""The popup with presets: pick one, take its colours alone, save one's own, exchange them as files."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QEvent, QSize, Qt, Signal
from PySide6.QtGui import QIcon, QKeyEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QVBoxLayout,
    QWidget,
)

from nodegraph.editor.parameters.look import ROW_HEIGHT, caption
from nodegraph.editor.parameters.simple import Switch
from nodegraph.editor.parameters.transfer_function import presets
from nodegraph.editor.parameters.transfer_function.bells import Shape
from nodegraph.editor.parameters.transfer_function.chosen import button
from nodegraph.editor.parameters.transfer_function.presets import Preset

ROWS = 12
THUMBNAIL = QSize(88, 18)


class PresetList(QFrame):
    """Presets and what they look like.

    picked(preset, colors alone): one was chosen. import_wanted, export_wanted: from a file, to a file.
    refused(text): why one could not be saved or deleted.
    """

    picked = Signal(object, bool)
    import_wanted = Signal()
    export_wanted = Signal()
    refused = Signal(str)

    def __init__(self, shape: Shape, unit: str = "", parent: QWidget | None = None) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self.shape, self.unit = shape, unit
        self.list = QListWidget()
        self.list.setFrameShape(QFrame.Shape.NoFrame)
        self.list.setIconSize(THUMBNAIL)
        self.list.setUniformItemSizes(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.setAccessibleName("Presets")
        self.colors = Switch()
        self.colors.setAccessibleName("Colours alone")
        self.colors.setToolTip("Keep opacities, and take the colours of what is picked. Colour maps always do.")
        alone = QHBoxLayout()
        alone.addWidget(QLabel("Colours alone"))
        alone.addStretch(1)
        alone.addWidget(self.colors)
        self.name = QLineEdit()
        self.name.setFixedHeight(ROW_HEIGHT)
        self.name.setPlaceholderText("Save this one as …")
        self.name.setAccessibleName("Name of a preset to save")
        self.load = button("folder", "Read a preset from a JSON file")
        self.export = button("export", "Write this one to a JSON file")
        line = QHBoxLayout()
        line.setSpacing(4)
        line.addWidget(self.name, 1)
        line.addWidget(self.load)
        line.addWidget(self.export)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(6, 6, 6, 6)
        layout.setSpacing(6)
        self.note = caption()
        self.note.setWordWrap(True)
        layout.addWidget(self.list, 1)
        layout.addLayout(alone)
        layout.addLayout(line)
        layout.addWidget(self.note)
        self.list.itemClicked.connect(self._take)
        self.list.itemActivated.connect(self._take)
        self.list.installEventFilter(self)
        self.name.returnPressed.connect(lambda: self._save(self.name.text()))
        self.load.clicked.connect(self._import)
        self.export.clicked.connect(self._export)
        self.fill()

    def fill(self) -> None:
        """List what there is."""
        self.list.clear()
        for preset in presets.presets(self.unit):
            unit = f" ({preset.unit})" if preset.unit else ", over the range of the data" if preset.relative else ""
            group = f"{preset.group}: " if preset.group else ""
            pixmap = presets.thumbnail(preset.value, THUMBNAIL.width(), THUMBNAIL.height(), preset.colors)
            item = QListWidgetItem(QIcon(pixmap), f"{group}{preset.name}")
            item.setToolTip(f"{group}{preset.name}{unit}" + (". Del deletes it." if preset.file else ""))
            item.setSizeHint(QSize(240, 26))
            item.setData(Qt.ItemDataRole.UserRole, preset)
            self.list.addItem(item)
        own = any(self.preset(row).file for row in range(self.list.count()))
        self.note.setText("Del deletes one of your own.")
        self.note.setVisible(own)
        self.setFixedSize(300, min(ROWS, self.list.count()) * 26 + (106 if own else 84))

    def preset(self, row: int) -> Preset:
        """The preset of a row."""
        found: Preset = self.list.item(row).data(Qt.ItemDataRole.UserRole)
        return found

    def _take(self, item: QListWidgetItem) -> None:
        if self.isVisible():
            preset = item.data(Qt.ItemDataRole.UserRole)
            self.hide()
            self.picked.emit(preset, self.colors.isChecked() or preset.colors)
            self.close()

    def _save(self, name: str) -> None:
        if not name.strip():
            return
        try:
            presets.keep(name.strip(), self.shape, self.unit)
        except OSError as error:
            self.refused.emit(f"{name.strip()}: could not be saved: {error.strerror or error}")
            return
        self.name.clear()
        self.fill()

    def _import(self) -> None:
        self.hide()
        self.import_wanted.emit()
        self.close()

    def _export(self) -> None:
        self.hide()
        self.export_wanted.emit()
        self.close()

    def eventFilter(self, watched: object, event: QEvent) -> bool:
        if watched is self.list and isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            item = self.list.currentItem()
            if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and item is not None:
                self._take(item)
                return True
            if event.key() == Qt.Key.Key_Delete and item is not None:
                self._delete(item.data(Qt.ItemDataRole.UserRole))
                return True
        return bool(super().eventFilter(watched, event))  # type: ignore[arg-type]

    def _delete(self, preset: Preset) -> None:
        if preset.file is None:
            return
        try:
            presets.drop(preset)
        except OSError as error:
            self.refused.emit(f"{preset.name}: could not be deleted: {error.strerror or error}")
        self.fill()


def json_name(path: str) -> Path:
    """A path for a JSON file, with its suffix."""
    return Path(path) if path.lower().endswith(".json") else Path(f"{path}.json")
