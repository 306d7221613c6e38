"""Bool, Choice, Text, File, Folder; and the JSON form for kinds that plug-ins bring without a widget."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from PySide6.QtCore import QEvent, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent, QPen, QWheelEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QFileDialog,
    QHBoxLayout,
    QLineEdit,
    QPlainTextEdit,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from nodegraph.editor.parameters.field import Field
from nodegraph.editor.parameters.look import GAP, ROW_HEIGHT, accent, blend, complaint, icon, ink
from nodegraph.errors import ParameterError
from nodegraph.params import Choice, File, Parameter, Text


class Switch(QAbstractButton):
    """On or off: a knob in a slot."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setCheckable(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setFixedSize(self.sizeHint())

    def sizeHint(self) -> QSize:
        return QSize(38, ROW_HEIGHT)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        palette, on, enabled = self.palette(), self.isChecked(), self.isEnabled()
        slot = QRectF(2.0, (self.height() - 18) / 2, 34.0, 18.0)
        off = ink(palette, 0.25 if enabled else 0.12)
        painter.setPen(QPen(accent(palette), 1.5) if self.hasFocus() else Qt.PenStyle.NoPen)
        painter.setBrush(accent(palette, enabled) if on else off)
        painter.drawRoundedRect(slot, 9, 9)
        painter.setPen(Qt.PenStyle.NoPen)
        knob = palette.base().color() if enabled else blend(palette.base().color(), palette.window().color(), 0.5)
        painter.setBrush(Qt.GlobalColor.white if on and enabled else knob)
        painter.drawEllipse(QRectF(slot.right() - 16 if on else slot.left() + 2, slot.top() + 2, 14, 14))


class BoolField(Field):
    """A switch."""

    def __init__(self, declaration: Parameter, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self.switch = Switch()
        self.switch.clicked.connect(lambda on: self.edited.emit(on))
        layout.addWidget(self.switch)
        layout.addStretch(1)
        self.setFocusProxy(self.switch)

    def show_value(self, value: Any) -> None:
        self.switch.setChecked(value)


class Options(QComboBox):
    """A drop-down list that the wheel turns only while it has the focus."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setFixedHeight(ROW_HEIGHT)
        self.setMinimumContentsLength(6)
        self.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.hasFocus():
            super().wheelEvent(event)
        else:
            event.ignore()


class ChoiceField(Field):
    """A list of words, written as a person would."""

    def __init__(self, declaration: Choice, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self.options = Options()
        for word in declaration.choices:
            self.options.addItem(word.replace("_", " "), word)
        self.options.activated.connect(lambda index: self.edited.emit(self.options.itemData(index)))
        layout.addWidget(self.options)
        self.setFocusProxy(self.options)

    def show_value(self, value: Any) -> None:
        self.options.setCurrentIndex(self.options.findData(value))


class LineEntry(QLineEdit):
    """A line of text that is handed on when Enter is pressed or the focus leaves; Escape takes it back."""

    entered = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setFixedHeight(ROW_HEIGHT)
        self.setTextMargins(3, 0, 3, 0)
        self.shown = ""
        self.editingFinished.connect(self._finish)

    def show_text(self, text: str) -> None:
        self.shown = text
        if text != self.text() and not (self.hasFocus() and self.isModified()):
            self.setText(text)

    def _finish(self) -> None:
        if self.isModified():
            self.setModified(False)
            self.entered.emit(self.text())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape and self.isModified():
            self.setModified(False)
            self.show_text(self.shown)
        else:
            super().keyPressEvent(event)


class Lines(QPlainTextEdit):
    """Several lines of text, handed on when the focus leaves or with Ctrl-Enter."""

    entered = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setTabChangesFocus(True)
        self.setFixedHeight(3 * ROW_HEIGHT)

    def show_text(self, text: str) -> None:
        if text != self.toPlainText() and not (self.hasFocus() and self.document().isModified()):
            self.setPlainText(text)
            self.document().setModified(False)

    def _finish(self) -> None:
        if self.document().isModified():
            self.document().setModified(False)
            self.entered.emit(self.toPlainText())

    def focusOutEvent(self, event: Any) -> None:
        super().focusOutEvent(event)
        self._finish()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        enter = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        if enter and event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self._finish()
        else:
            super().keyPressEvent(event)


class TextField(Field):
    """A line of text, or several."""

    def __init__(self, declaration: Text, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self.entry: LineEntry | Lines = Lines() if declaration.multiline else LineEntry()
        self.entry.entered.connect(self.edited.emit)
        layout.addWidget(self.entry)
        self.setFocusProxy(self.entry)

    def show_value(self, value: Any) -> None:
        self.entry.show_text(value)


class PathField(Field):
    """A File or Folder: the path as it is stored, a button that looks for one, and a word on what is there.

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
        self.state = complaint()
        line.addWidget(self.entry, 1)
        line.addWidget(self.button)
        outer.addLayout(line)
        outer.addWidget(self.state)
        self.setFocusProxy(self.entry)
        self.setAcceptDrops(True)

    @property
    def folder(self) -> Path:
        """What a relative path is relative to: the folder of the workspace, or where the program was started."""
        file = self.place.session.path if self.place is not None else None
        return Path(file).parent if file else Path.cwd()

    def show_value(self, value: Any) -> None:
        self.entry.show_text(value)
        self.entry.setToolTip(str(self.folder / value) if value else "")
        self.state.setText(self._state(value))
        self.state.setVisible(bool(self.state.text()))

    def _state(self, value: str) -> str:
        if not value or getattr(self.declaration, "write", False):
            return ""
        if "://" in value or any(sign in value for sign in "*?["):
            return ""  # not one file of this machine; the node that reads it knows better
        full = self.folder / value
        if not full.exists():
            return f"not found: {full.name}"
        return ""

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
        dialog.fileSelected.connect(self._chosen)
        dialog.open()
        return dialog

    def _chosen(self, path: str) -> None:
        self.edited.emit(self.stored(path))

    def stored(self, path: str) -> str:
        """How a path is written down: relative to the workspace where it lies below it."""
        file = self.place.session.path if self.place is not None else None
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


class JsonField(Field):
    """The JSON form of a value: for kinds of parameters that nobody has made a widget for."""

    def __init__(self, declaration: Parameter, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self.entry = LineEntry()
        self.entry.entered.connect(self._read)
        layout.addWidget(self.entry)
        self.setFocusProxy(self.entry)
        self.value: Any = declaration.default

    def show_value(self, value: Any) -> None:
        self.value = value
        self.entry.show_text(json.dumps(self.declaration.encode(value)))

    def _read(self, text: str) -> None:
        try:
            value = self.declaration.decode(json.loads(text), self.declaration.name or self.declaration.kind)
        except json.JSONDecodeError as error:
            self.refused.emit(f"no JSON: {error}")
            return
        except ParameterError as error:
            self.refused.emit(str(error))
            return
        self.edited.emit(value)
