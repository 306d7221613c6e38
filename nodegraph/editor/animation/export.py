"""Rendering an animation from the editor, beside everything else that goes on in it."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QDialog,
    QDialogButtonBox,
    QFileDialog,
    QFormLayout,
    QLabel,
    QWidget,
)

from nodegraph import film, workspace
from nodegraph.animation import Span, Track
from nodegraph.editor.saving import add_place, add_size, finish
from nodegraph.errors import Cancelled, one_sentence
from nodegraph.pictures import views_of
from nodegraph.requests import sink_size

if TYPE_CHECKING:
    from nodegraph.editor.session import Session


class Export(QObject):
    """One animation on its way to files, on a thread of its own with a copy of the document.

    `done` sends the files, or None where it failed or was stopped; a message says why.
    """

    progressed = Signal(int, int)  # pictures done, of how many
    done = Signal(object)
    _ended = Signal(object)  # list[Path], or what was raised

    def __init__(
        self,
        session: Session,
        view: str,
        tracks: list[Track],
        span: Span,
        out: Path,
        size: tuple[int, int],
        parent: QObject | None = None,
    ) -> None:
        super().__init__(parent)
        self.session = session
        self._view, self._tracks, self._span, self._out, self._size = view, list(tracks), span, out, size
        folder = session.path.parent if session.path is not None else None
        self._network = workspace.loads(workspace.dumps(session.network, folder=folder), folder=folder)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._work, name="nodegraph-film", daemon=True)
        self._ended.connect(self._end)
        session.replaced.connect(self.stop)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """Stop after the picture that is being made."""
        self._stopped.set()

    def wait(self, seconds: float) -> bool:
        """Wait for the thread to end; whether it did."""
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _work(self) -> None:
        try:
            found: object = film.render(
                self._network,
                self._view,
                self._tracks,
                self._span.frames,
                self._out,
                engine=self.session.engine,
                size=self._size,
                rate=self._span.rate,
                on_frame=self.progressed.emit,
                cancelled=self._stopped.is_set,
            )
        except BaseException as error:
            found = error
        try:
            self._ended.emit(found)
        except RuntimeError:
            pass  # the window was closed meanwhile, and this object with it

    def _end(self, found: object) -> None:
        self._thread.join()
        if isinstance(found, list):
            what = str(self._out) if self._out.suffix.lower() == film.FILM else f"{len(found)} pictures in {self._out}"
            self.session.tell("info", f"rendered {what}")
        elif isinstance(found, Cancelled):
            self.session.tell("info", "rendering the animation was stopped")
        elif isinstance(found, BaseException):
            self.session.tell("error", one_sentence(found))
        self.done.emit(found if isinstance(found, list) else None)
        self.deleteLater()


class ExportDialog(QDialog):
    """Asks for the view, the size and the place."""

    chosen = Signal(str, object, object)  # view, Path, (width, height)

    def __init__(self, session: Session, span: Span, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Render the animation")
        self.session = session
        flat = session.network.flatten()
        self.view = QComboBox(self)
        self.view.addItems(views_of(flat, None))
        self.format = QComboBox(self)
        self.format.addItem("Pictures (PNG)", "")
        self.format.addItem("Film (MP4)", film.FILM)
        self.format.currentIndexChanged.connect(lambda _: self._suggest())
        count = len(span.frames)
        frames = f"{span.first} to {span.last}, {count / span.rate:.1f} s at {span.rate} / s"
        form = QFormLayout()
        form.addRow("View", self.view)
        form.addRow("Format", self.format)
        self.place = add_place(form, "Place", "", self._browse)
        size = sink_size(flat, self.view.currentText()) if self.view.count() else (640, 480)
        self.width_box, self.height_box = add_size(form, size, least=2)
        form.addRow("Frames", QLabel(frames, self))
        self.go = finish(self, form, QDialogButtonBox.StandardButton.Ok)
        self.go.setText("Render")
        self.go.setEnabled(self.view.count() > 0)
        self._suggest()

    def accept(self) -> None:
        out = Path(self.place.text()).expanduser()
        suffix = str(self.format.currentData())
        if suffix and out.suffix.lower() != suffix:
            out = out.with_name(out.name + suffix)
        self.chosen.emit(self.view.currentText(), out, (self.width_box.value(), self.height_box.value()))
        super().accept()

    def _suggest(self) -> None:
        path = self.session.path
        stem = path.with_suffix("") if path is not None else Path.home() / "animation"
        suffix = str(self.format.currentData())
        self.place.setText(str(stem.with_name(f"{stem.name}{suffix}" if suffix else f"{stem.name}_frames")))

    def _browse(self) -> None:
        if self.format.currentData():
            name, _ = QFileDialog.getSaveFileName(self, "Render to", self.place.text(), "Films (*.mp4)")
        else:
            name = QFileDialog.getExistingDirectory(self, "Render to", self.place.text())
        if name:
            self.place.setText(name)
