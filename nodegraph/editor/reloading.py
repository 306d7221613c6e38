"""Watches the files of processors and shaders, and takes over what changes in them while the editor runs."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import NamedTuple

from PySide6.QtCore import QFileSystemWatcher, QObject, QTimer, Signal

from nodegraph.editor.session import Session
from nodegraph.errors import GraphError
from nodegraph.reloading import Outcome, Reloading

DELAY = 150
"""Milliseconds of silence after a change: some programs write a file in several steps, or another one in its place."""


class _Seen(NamedTuple):
    outcomes: list[Outcome]
    refused: list[Outcome]
    places: list[str]


class Reloader(QObject):
    """Brings the session's document up to date with the files. Its work is done beside the window."""

    looked = Signal(object)  # list[Outcome]: what was taken over or refused, never empty
    mended = Signal(str)  # the place of a message that no longer holds

    def __init__(self, session: Session, delay: int = DELAY) -> None:
        super().__init__(session)
        self.session = session
        self.reloading = Reloading()
        self.refused: list[Outcome] = []
        self.kernels: list[Path] = []
        self._busy = self._again = False
        self._watcher = QFileSystemWatcher(self)
        self._soon = QTimer(self)
        self._soon.setSingleShot(True)
        self._soon.setInterval(delay)
        self._soon.timeout.connect(self.look)
        self._watcher.fileChanged.connect(self._soon.start)
        self._watcher.directoryChanged.connect(self._soon.start)
        self.look()

    def look(self) -> None:
        """Look at the files now, beside the window; when it is done, once more if something changed meanwhile."""
        self._again = self._busy
        if not self._busy:
            self._busy = True
            self.session.work(partial(_look, self.reloading, self.session), self._take)

    def close(self) -> None:
        """Watch no more."""
        self._soon.stop()
        self._watcher.removePaths([*self._watcher.files(), *self._watcher.directories()])
        self.reloading.close()

    def _take(self, seen: _Seen | None) -> None:
        self._busy = False
        if seen is None:
            return  # the engine is closing
        watched = {*self._watcher.files(), *self._watcher.directories()}
        # A file that was put in another's place is a new one, to be watched anew.
        if fresh := [place for place in seen.places if place not in watched]:
            self._watcher.addPaths(fresh)
        for gone in set(map(place_of, self.refused)) - set(map(place_of, seen.refused)):
            self.mended.emit(gone)
        self.refused = seen.refused
        self.kernels = [Path(place) for place in seen.places if place.endswith(".glsl")]
        if seen.outcomes:
            self._tell(seen.outcomes)
            self.looked.emit(seen.outcomes)
        if self._again:
            self.look()

    def _tell(self, outcomes: list[Outcome]) -> None:
        lost = self.session.rebind()
        for one in outcomes:
            if one.reason:
                self.session.tell(
                    "error",
                    f"{place_of(one)}: the new text fails: {one.reason}; what was there before stays in use",
                    place_of(one),
                )
            else:
                self.session.tell("info", f"{one.id} was loaded anew from {one.file}", str(one.file))
        for text in lost:
            self.session.tell("warning", text)


def place_of(outcome: Outcome) -> str:
    """File and line, as messages name them."""
    return f"{outcome.file}:{outcome.line}" if outcome.line else str(outcome.file)


def _look(reloading: Reloading, session: Session) -> _Seen | None:
    try:
        outcomes = reloading.look(session.engine)
    except GraphError:
        return None  # the engine was closed
    places: list[Path] = [*reloading.folders(), *reloading.files()]
    return _Seen(outcomes, reloading.refused, [str(place) for place in places])
