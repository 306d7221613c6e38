"""The timeline: play, scrub, set keys, turn once round, render to files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QComboBox,
    QFrame,
    QHBoxLayout,
    QLabel,
    QMenu,
    QProgressBar,
    QScrollArea,
    QSpinBox,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from nodegraph import animation, links
from nodegraph.animation import EASINGS, Key, Span, Track
from nodegraph.editor.animation.export import Export, ExportDialog
from nodegraph.editor.animation.ruler import Ruler
from nodegraph.editor.views.icons import IconButton
from nodegraph.errors import GraphError
from nodegraph.pictures import views_of
from nodegraph.subjects import cameras_of

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

FARTHEST = 100_000


class Timeline(QWidget):
    """Shows and edits the animation of the document.

    To show a frame, the values of that frame are set in the document, as one step of the history for a whole scrub.
    """

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.export: Export | None = None
        self._tracks: list[Track] = []
        self._trouble = ""
        self._lay_out()
        self._clock = QTimer(self)
        self._clock.timeout.connect(self._tick)
        self.ruler.scrub_began.connect(lambda: self._begin("scrub"))
        self.ruler.scrubbed.connect(self.show_frame)
        self.ruler.scrub_ended.connect(self._end)
        self.ruler.key_chosen.connect(lambda _: self._show_choice())
        self.ruler.key_moved.connect(self.move_key)
        session.changed.connect(self.refresh)
        session.replaced.connect(self._restart)
        session.selected.connect(lambda _: self._show_choice())
        self._open = False
        self.refresh()

    # -- what it is made of ---------------------------------------------------------------------------------------

    def _lay_out(self) -> None:
        first = IconButton("first", "First frame", self)
        first.clicked.connect(lambda: self.go_to(self.span.first))
        self.play_button = IconButton("play", "Play (Space)", self)
        self.play_button.clicked.connect(self.toggle_play)
        last = IconButton("last", "Last frame", self)
        last.clicked.connect(lambda: self.go_to(self.span.last))
        self.frame_box = self._number(-FARTHEST, FARTHEST, "Frame")
        self.frame_box.valueChanged.connect(self.go_to)
        self._keys = QMenu(self)
        self._keys.aboutToShow.connect(self._fill_keys)
        add = IconButton("key_add", "Add a key at this frame", self)
        add.setMenu(self._keys)
        add.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._remove = IconButton("key_remove", "Remove the chosen key", self)
        self._remove.clicked.connect(self.remove_key)
        self._turn = IconButton("turntable", "Turn the camera once round", self)
        self._turn.clicked.connect(self.add_turntable)
        self._easing = QComboBox(self)
        self._easing.setToolTip("How the chosen key goes on to the next")
        for name in EASINGS:
            self._easing.addItem(name.capitalize(), name)
        self._easing.activated.connect(lambda _: self.set_easing(str(self._easing.currentData())))
        self._first = self._number(-FARTHEST, FARTHEST, "First frame")
        self._last = self._number(-FARTHEST, FARTHEST, "Last frame")
        self._rate = self._number(1, 1000, "Pictures a second")
        for box in (self._first, self._last, self._rate):
            box.valueChanged.connect(lambda _: self._write_span())
        self._render = IconButton("film", "Render to files", self)
        self._render.clicked.connect(self.open_export)
        self._progress = QProgressBar(self)
        self._progress.setFixedWidth(120)
        self._progress.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._progress.hide()
        bar = QHBoxLayout()
        bar.setContentsMargins(4, 2, 8, 2)
        bar.setSpacing(4)
        groups: tuple[tuple[QWidget, ...], ...] = (
            (first, self.play_button, last, self.frame_box),
            (add, self._remove, self._easing, self._turn),
            (QLabel("Frames", self), self._first, QLabel("to", self), self._last, self._rate, QLabel("/ s", self)),
        )
        for group in groups:
            for widget in group:
                bar.addWidget(widget)
            bar.addSpacing(12)
        bar.addStretch(1)
        bar.addWidget(self._progress)
        bar.addWidget(self._render)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.ruler = Ruler(self)
        scroll = QScrollArea(self)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setWidgetResizable(True)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setWidget(self.ruler)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(bar)
        layout.addWidget(scroll, 1)

    def _number(self, low: int, high: int, tip: str) -> QSpinBox:
        box = QSpinBox(self)
        box.setRange(low, high)
        box.setToolTip(tip)
        box.setAccessibleName(tip)
        box.setFixedWidth(72)
        box.setKeyboardTracking(False)
        return box

    # -- reading the document -------------------------------------------------------------------------------------

    @property
    def frame(self) -> int:
        """The frame that is shown."""
        return self.session.frame

    @property
    def span(self) -> Span:
        """The frames of the document; the usual ones where what it says cannot be read."""
        try:
            return animation.span_of(self.session.network)
        except GraphError:
            return Span()

    def refresh(self, _: Any = None) -> None:
        """Read everything anew."""
        try:
            self._tracks = animation.tracks_of(self.session.network)
            self._trouble = ""
        except GraphError as error:
            self._tracks = []
            if str(error) != self._trouble:
                self._trouble = str(error)
                self.session.tell("warning", self._trouble)
        span = self.span
        for box, value in ((self._first, span.first), (self._last, span.last), (self._rate, span.rate)):
            _show(box, value)
        _show(self.frame_box, self.frame)
        self.ruler.show_tracks(span, self._tracks, self.frame)
        self._show_choice()

    def _show_choice(self) -> None:
        key = self._chosen_key()
        self._remove.setEnabled(key is not None)
        self._easing.setEnabled(key is not None)
        if key is not None:
            self._easing.setCurrentIndex(self._easing.findData(key[1].easing))
        self._turn.setEnabled(bool(self._cameras()))

    def _chosen_key(self) -> tuple[Track, Key] | None:
        for track in self._tracks:
            for key in track.keys:
                if self.ruler.chosen == (track.target, key.frame):
                    return track, key
        return None

    def _restart(self) -> None:
        self._open = False
        self.stop()
        self.session.frame = self.span.first
        self.refresh()

    # -- time -----------------------------------------------------------------------------------------------------

    def go_to(self, frame: int) -> None:
        """Show a frame, as a step of its own."""
        if frame != self.frame:
            self._begin("frame")
            self.show_frame(frame)
            self._end()

    def show_frame(self, frame: int) -> None:
        """Set the values of a frame in the document."""
        self.session.frame = frame
        try:
            moves = animation.moves(self.session.network, frame, self._tracks)
        except GraphError as error:
            self.session.tell("error", str(error))
            moves = []
        for command in moves:
            if not self.session.do(command):
                break
        _show(self.frame_box, frame)
        self.ruler.show_tracks(self.span, self._tracks, frame)

    @property
    def playing(self) -> bool:
        return self._clock.isActive()

    def toggle_play(self) -> None:
        """Play, or stop."""
        if self.playing:
            self.stop()
            return
        self._begin("play")
        self.play_button.show_icon("pause")
        self._clock.start(round(1000 / self.span.rate))

    def stop(self) -> None:
        """Stop playing where it is."""
        if self.playing:
            self._clock.stop()
            self.play_button.show_icon("play")
            self._end()

    def _tick(self) -> None:
        span = self.span
        following = self.frame + 1
        self.show_frame(span.first if not span.first <= following <= span.last else following)

    def _begin(self, name: str) -> None:
        if not self._open:
            self.session.begin(name)
            self._open = True

    def _end(self) -> None:
        if self._open and not self.playing:
            self._open = False
            self.session.end()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Space:
            self.toggle_play()
        elif event.key() in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace):
            self.remove_key()
        else:
            super().keyPressEvent(event)

    def hideEvent(self, event: object) -> None:
        self.stop()
        self._end()

    # -- keys -----------------------------------------------------------------------------------------------------

    def _fill_keys(self) -> None:
        """Offer what can move: the cameras of views, then the parameters of the selected nodes."""
        self._keys.clear()
        cameras = self._cameras()
        for target in cameras:
            self._keys.addAction(f"Camera of {target.rpartition('.')[0]}").triggered.connect(_adds(self, target))
        for path in self.session.selection:
            node = self.session.network.node(path)
            names = list(node.processor.params) if node.processor is not None else list(node.expose.params)
            if names:
                self._keys.addSection(path)
            for name in names:
                self._keys.addAction(name).triggered.connect(_adds(self, f"{path}.{name}"))
        if not self.session.selection:
            hint = self._keys.addAction("Select a node to see its parameters")
            hint.setEnabled(False)

    def _cameras(self) -> list[str]:
        flat = self.session.network.flatten()
        found: dict[str, str] = {}
        for view in views_of(flat, None):
            for target in cameras_of(self.session.network, view):
                found.setdefault(animation.shared_place(self.session.network, target), target)
        return list(found.values())

    def add_key(self, target: str) -> None:
        """Set a key for the present value of a parameter at the present frame."""
        try:
            self.session.do(animation.key_at(self.session.network, target, self.frame))
        except GraphError as error:
            self.session.tell("error", str(error))

    def remove_key(self) -> None:
        """Remove the chosen key; a track without any goes, too."""
        found = self._chosen_key()
        if found is not None:
            track, key = found
            self._write(Track(track.target, tuple(other for other in track.keys if other != key)))

    def move_key(self, target: str, frame: int, to: int) -> None:
        """Move a key to another frame, in place of one that is there."""
        for track in self._tracks:
            if track.target == target:
                moved = [Key(to, key.value, key.easing) for key in track.keys if key.frame == frame]
                rest = Track(target, tuple(key for key in track.keys if key.frame != frame))
                for key in moved:
                    self._write(rest.with_key(key))

    def set_easing(self, easing: str) -> None:
        """How the chosen key goes on to the next."""
        found = self._chosen_key()
        if found is not None:
            self._write(found[0].with_key(Key(found[1].frame, found[1].value, easing)))

    def add_turntable(self) -> None:
        """Let every camera of a view turn once round over all frames, from where it stands."""
        span = self.span
        with self.session.gesture("turntable"):
            for target in self._cameras():
                there = animation.track_of(self.session.network, target).target  # where its keys are already
                camera = links.value_of(self.session.network, target)
                self._write(animation.turntable(there, camera, span.first, span.last))

    def _write(self, track: Track) -> None:
        try:
            command = animation.write_track(self.session.network, track)
        except GraphError as error:
            self.session.tell("error", str(error))
            return
        self.session.do(command)

    def _write_span(self) -> None:
        first, last = self._first.value(), self._last.value()
        self.session.do(animation.write_span(Span(first, max(first, last), self._rate.value())))

    # -- files ----------------------------------------------------------------------------------------------------

    def open_export(self) -> None:
        """Ask where to and how large, and render; while it renders, stop it."""
        if self.export is not None:
            self.export.stop()
            return
        dialog = ExportDialog(self.session, self.span, self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.chosen.connect(self.render_to)
        dialog.open()

    def render_to(self, view: str, out: Path, size: tuple[int, int]) -> None:
        """Render all frames of a view into a folder or a film, beside everything else."""
        if self.export is not None:
            return
        self.stop()
        span = self.span
        self.export = Export(self.session, view, self._tracks, span, out, size, self)
        self.export.progressed.connect(self._show_progress)
        self.export.done.connect(self._exported)
        self._progress.setRange(0, len(span.frames))
        self._progress.setValue(0)
        self._progress.setFormat("%v of %m")
        self._progress.show()
        self._render.show_icon("stop")
        self._render.setToolTip("Stop rendering")
        self.export.start()

    def _show_progress(self, done: int, count: int) -> None:
        self._progress.setValue(done)

    def _exported(self, files: object) -> None:
        self.export = None
        self._progress.hide()
        self._render.show_icon("film")
        self._render.setToolTip("Render to files")


def _show(box: QSpinBox, value: int) -> None:
    if box.value() != value:
        box.blockSignals(True)
        box.setValue(value)
        box.blockSignals(False)


def _adds(timeline: Timeline, target: str) -> Any:
    return lambda _=False: timeline.add_key(target)
