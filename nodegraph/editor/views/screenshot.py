"""Saving the picture of a view at any size."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QFormLayout,
    QSpinBox,
    QWidget,
)

from nodegraph import formats, workspace
from nodegraph.data import Image
from nodegraph.editor.saving import add_place, add_size, finish
from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.report import Report


class Screenshot(QObject):
    """One picture on its way to a file. `done` sends the path, or None where it failed (a message says why)."""

    done = Signal(object)

    def __init__(self, session: Session, node_path: str, file: Path, size: tuple[int, int], parent: QObject) -> None:
        super().__init__(parent)
        self.session = session
        self._node, self._file = node_path, file
        self._channel = object()
        session.answered.connect(self._answered)
        session.ask(node_path, size, "final", self._channel)

    def _answered(self, channel: object, report: Report) -> None:
        if channel is not self._channel:
            return
        self.session.answered.disconnect(self._answered)
        self.session.unwatch(self._channel)
        image = next((v for v in report.shown.get(self._node, {}).values() if isinstance(v, Image)), None)
        if image is None:
            self._end(f"{self._node}: there is no picture to save")
            return
        document = workspace.dumps(self.session.network, folder=self._file.parent)

        def write() -> str:
            try:
                formats.make_folder(self._file.parent)
                formats.write(image, self._file, workspace=document)
            except GraphError as error:
                return str(error)
            return ""

        self.session.work(write, self._end)

    def _end(self, trouble: str | None) -> None:
        if trouble == "":
            self.session.tell("info", f"saved {self._file}")
        else:
            self.session.tell("error", trouble or f"{self._file}: the picture could not be written")
        self.done.emit(self._file if trouble == "" else None)
        self.deleteLater()


class ScreenshotDialog(QDialog):
    """Asks for the file and the size."""

    def __init__(self, session: Session, node_path: str, size: tuple[int, int], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Save a picture")
        self.session, self.node_path = session, node_path
        folder = session.path.parent if session.path is not None else Path.home()
        form = QFormLayout()
        self.file = add_place(form, "File", str(folder / f"{node_path.replace('/', '.')}.png"), self._browse)
        self.width_box, self.height_box = add_size(form, size)
        self.proportions = QCheckBox("Keep proportions", self)
        self.proportions.setChecked(True)
        self._ratio = size[0] / size[1]
        self.width_box.valueChanged.connect(lambda value: self._follow(self.height_box, value / self._ratio))
        self.height_box.valueChanged.connect(lambda value: self._follow(self.width_box, value * self._ratio))
        form.addRow("", self.proportions)
        finish(self, form, QDialogButtonBox.StandardButton.Save)

    def accept(self) -> None:
        file = Path(self.file.text()).expanduser()
        if file.suffix.lower() not in workspace.PICTURES:
            file = file.with_name(file.name + ".png")
        size = (self.width_box.value(), self.height_box.value())
        Screenshot(self.session, self.node_path, file, size, self.session)
        super().accept()

    def _follow(self, box: QSpinBox, value: float) -> None:
        if self.proportions.isChecked():
            box.blockSignals(True)
            box.setValue(round(value))
            box.blockSignals(False)

    def _browse(self) -> None:
        name, _ = QFileDialog.getSaveFileName(self, "Save a picture", self.file.text(), "Pictures (*.png *.exr)")
        if name:
            self.file.setText(name)
