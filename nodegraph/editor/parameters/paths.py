"""File and Folder: a path, what kind of file it names, and a dialog that shows that before one is chosen."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, Qt
from PySide6.QtWidgets import QFileDialog, QGridLayout, QHBoxLayout, QToolButton, QVBoxLayout, QWidget

from nodegraph.editor.parameters.field import Field
from nodegraph.editor.parameters.file_look import look_at, look_into
from nodegraph.editor.parameters.file_preview import FilePreview
from nodegraph.editor.parameters.look import GAP, ROW_HEIGHT, icon, ink
from nodegraph.editor.parameters.simple import LineEntry
from nodegraph.params import File

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

STALE = 2.0
"""Seconds after which a file is looked at anew when its node changes: it may be another one."""


class PathField(Field):
    """A File or Folder: the path as it is stored, a button that looks for one, and what is there.

    A file below the folder of the workspace is stored relative to it, so that both can move together.
    """

    def __init__(self, declaration: Any, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(2)
        line = QHBoxLayout()
        line.setSpacing(GAP)
        self.entry = LineEntry()
        self.entry.setPlaceholderText("no file" if isinstance(declaration, File) else "no folder")
        self.entry.entered.connect(self.edited.emit)
        self.entry.installEventFilter(self)
        self.button = QToolButton()
        self.button.setIcon(icon("folder", ink(self.palette(), 0.8)))
        self.button.setFixedSize(ROW_HEIGHT, ROW_HEIGHT)
        self.button.setAutoRaise(True)
        self.button.setToolTip("Choose …")
        self.button.setAccessibleName("Choose a file" if isinstance(declaration, File) else "Choose a folder")
        self.button.clicked.connect(self.browse)
        self._looked: tuple[Path | None, float] = (None, 0.0)
        line.addWidget(self.entry, 1)
        line.addWidget(self.button)
        outer.addLayout(line)
        self.preview: FilePreview | None = None
        if self.session is not None:
            self.preview = FilePreview(self.session, look_at if isinstance(declaration, File) else look_into)
            outer.addWidget(self.preview)
        self.setFocusProxy(self.entry)
        self.setAcceptDrops(True)

    @property
    def session(self) -> Session | None:
        return self.place.session if self.place is not None else None

    @property
    def folder(self) -> Path:
        """What a relative path is relative to: the folder of the workspace, or where the program was started."""
        file = self.session.path if self.session is not None else None
        return Path(file).parent if file else Path.cwd()

    def show_value(self, value: Any) -> None:
        self.entry.show_text(value)
        self.entry.setToolTip(str(self.folder / value) if value else "")
        self._look(self.subject(value))

    def _look(self, path: Path | None) -> None:
        """Look at a file, unless it was looked at just now."""
        before, since = self._looked
        if self.preview is not None and (path != before or time.monotonic() - since > STALE):
            self._looked = (path, time.monotonic())
            self.preview.look(path)

    def subject(self, value: str) -> Path | None:
        """The one thing on this machine that a path names; None for several, elsewhere, or yet to be written."""
        if not value or getattr(self.declaration, "write", False):
            return None
        if "://" in value or any(sign in value for sign in "*?["):
            return None  # the node that reads it knows better
        return self.folder / value

    def browse(self) -> QFileDialog:
        """Open the dialog and return at once; what is chosen arrives as an edit."""
        dialog = QFileDialog(self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setWindowTitle(self.declaration.name.replace("_", " ") or "Choose")
        write = getattr(self.declaration, "write", False)
        if isinstance(self.declaration, File):
            dialog.setFileMode(QFileDialog.FileMode.AnyFile if write else QFileDialog.FileMode.ExistingFile)
            if write:
                dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
            if self.declaration.suffixes:
                patterns = " ".join(f"*{suffix}" for suffix in self.declaration.suffixes)
                dialog.setNameFilters([f"Supported files ({patterns})", "All files (*)"])
        else:
            dialog.setFileMode(QFileDialog.FileMode.Directory)
        present = self.folder / (self.entry.text() or "")
        dialog.setDirectory(str(present if present.is_dir() else present.parent))
        if isinstance(self.declaration, File) and not write and self.session is not None:
            _add_preview(dialog, self.session)
        dialog.fileSelected.connect(self._chosen)
        dialog.open()
        return dialog

    def _chosen(self, path: str) -> None:
        self.edited.emit(self.stored(path))

    def stored(self, path: str) -> str:
        """How a path is written down: relative to the workspace where it lies below it."""
        file = self.session.path if self.session is not None else None
        if file:
            try:
                return Path(path).relative_to(Path(file).parent).as_posix()
            except ValueError:
                pass
        return os.fspath(path)

    def eventFilter(self, watched: Any, event: QEvent) -> bool:
        # A line of text would take the address of a dropped file for text.
        if event.type() == QEvent.Type.DragEnter and event.mimeData().hasUrls():  # type: ignore[attr-defined]
            event.accept()
            return True
        if event.type() == QEvent.Type.Drop and event.mimeData().hasUrls():  # type: ignore[attr-defined]
            local = [url.toLocalFile() for url in event.mimeData().urls() if url.isLocalFile()]  # type: ignore[attr-defined]
            if local:
                self._chosen(local[0])
            event.accept()
            return True
        return super().eventFilter(watched, event)


def _add_preview(dialog: QFileDialog, session: Session) -> None:
    """Put a preview beside the files of a dialog. Only Qt's own dialog has room for one."""
    dialog.setOption(QFileDialog.Option.DontUseNativeDialog)
    layout = dialog.layout()
    if isinstance(layout, QGridLayout):
        preview = FilePreview(session, tall=True)
        layout.addWidget(preview, 1, layout.columnCount())
        dialog.currentChanged.connect(lambda name: preview.look(Path(name) if Path(name).is_file() else None))
