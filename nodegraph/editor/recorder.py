"""What was done since the document was opened, as the Python that does it."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QTimer
from PySide6.QtGui import QFontDatabase, QGuiApplication, QShowEvent
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QLabel, QPlainTextEdit, QVBoxLayout, QWidget

from nodegraph.editor.buttons import flat_button
from nodegraph.editor.session import Session
from nodegraph.recording import Recording


class Recorder(QWidget):
    """The script, newest line at the end; it can be copied, saved, and begun anew from here."""

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.recording = Recording(session.network)
        self.script = QPlainTextEdit()
        self.script.setReadOnly(True)
        self.script.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.script.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self.script.document().setDocumentMargin(8)
        self.script.setAccessibleName("Recorded Python")
        self.summary = QLabel()
        self.summary.setProperty("dim", True)
        row = QHBoxLayout()
        row.setContentsMargins(10, 4, 6, 4)
        row.addWidget(self.summary, 1)
        self.copy_it = flat_button("Copy", "Copy the whole script", self.copy)
        self.save_it = flat_button("Save ...", "Save the script to a file", self.save_dialog)
        self.start_again = flat_button(
            "Begin here", "Forget what was recorded, and begin with the network as it is", self.begin
        )
        for button in (self.copy_it, self.save_it, self.start_again):
            row.addWidget(button)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(row)
        layout.addWidget(self.script, 1)
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.setInterval(150)
        self._soon.timeout.connect(self._show_text)
        session.changed.connect(lambda _commands: self._soon.start())
        session.replaced.connect(self.begin)
        session.saved.connect(self._saved)
        self._show_text()

    def begin(self) -> None:
        """Record anew, from the document as it is now."""
        self.recording.close()
        self.recording = Recording(self.session.network)
        self._show_text()

    def copy(self) -> None:
        """Put the script into the clipboard."""
        QGuiApplication.clipboard().setText(self.recording.text())

    def save_dialog(self) -> None:
        """Choose where the script goes."""
        box = QFileDialog(self, "Save the recording", "recording.py", "Python (*.py)")
        box.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        box.setDefaultSuffix("py")
        box.fileSelected.connect(lambda name: self.save(Path(name)))
        box.open()

    def save(self, path: Path) -> bool:
        """Write the script to a file; what goes wrong becomes a message."""
        try:
            path.write_text(self.recording.text(), encoding="utf-8")
        except OSError as error:
            self.session.tell(
                "error", f"{path}: the recording cannot be written: {error.strerror}; choose another place"
            )
            return False
        self.session.tell("info", f"saved the recording to {path}")
        return True

    def _saved(self, path: Path) -> None:
        self.recording.saved(path)
        self._soon.start()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        self._show_text()

    def _show_text(self) -> None:
        self._soon.stop()
        if not self.isVisible():
            return
        text = self.recording.text()
        bar = self.script.verticalScrollBar()
        at_end, place = bar.value() >= bar.maximum() - 1, bar.value()
        self.script.setPlainText(text)
        bar.setValue(bar.maximum() if at_end else place)
        steps = self.recording.steps
        self.summary.setText("Nothing was done yet" if not steps else f"{steps} step{'s' if steps > 1 else ''}")
