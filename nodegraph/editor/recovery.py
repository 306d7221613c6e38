"""Work is not lost: the document is written aside every few seconds, and offered after a crash."""

from __future__ import annotations

import contextlib
import json
import os
import secrets
import time
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QLockFile, QObject, QTimer

from nodegraph import workspace
from nodegraph.commands import Command, Mute
from nodegraph.editor.guard import recovery_folder
from nodegraph.editor.session import Session
from nodegraph.errors import GraphError
from nodegraph.marks import Marks, Running, left_in
from nodegraph.network import Network

EVERY = 4000
"""Milliseconds between looks whether there is something to write."""
AT_ONCE = 0.01
"""Seconds that writing at once may take."""


@dataclass(frozen=True, slots=True)
class Lost:
    """A document that an editor left behind.

    file: where it was opened from, None for one that had no file yet. text: the document where it differed from that
    file, else empty. suspects: nodes that ran when the editor ended.
    """

    at: Path
    file: Path | None
    saved: float
    text: str
    suspects: tuple[Running, ...] = ()

    def network(self) -> Network:
        """The document as it was, belonging to its file and, where it differed from that, differing again.

        Raises WorkspaceError.
        """
        if not self.text:
            return workspace.load(self.file) if self.file is not None else Network()
        folder = self.file.parent if self.file is not None else None
        network = workspace.loads(self.text, folder=folder, file=self.file.name if self.file else "recovered")
        network.file = self.file
        # What is forgotten while it differs from the file goes on to differ, whatever is undone later.
        network.history.begin("recover")
        network.history.clear()
        network.history.end()
        return network

    def discard(self) -> None:
        """Forget it for good."""
        for file in (self.at, _marks_of(self.at)):
            file.unlink(missing_ok=True)


class Autosave(QObject):
    """Writes a session's document aside while it differs from its file, and marks which nodes run.

    It is written every few seconds, and before anything runs that a new node or wire brought: that may be what crashes.
    """

    def __init__(self, session: Session, folder: Path | None = None, every: int = EVERY) -> None:
        super().__init__(session)
        self.session = session
        self.folder = folder if folder is not None else recovery_folder()
        self.at = self.folder / f"{os.getpid()}-{secrets.token_hex(4)}.json"
        self._lock = _lock(self.at)  # the system gives it up when this program ends, however it ends
        self._written: object = None
        self._took, self._warned = 0.0, False
        self._timer = QTimer(self)
        self._timer.setInterval(every)
        self._timer.timeout.connect(self.write)
        self._timer.start()
        self._at_once = QTimer(self)
        self._at_once.setSingleShot(True)
        self._at_once.timeout.connect(self.write)
        self._marks = self._mark()
        session.changed.connect(self._see)
        session.saved.connect(self.write)
        session.replaced.connect(self.write)
        self.write()

    def write(self, *_: object) -> None:
        """Write what is there, if it is not what was written last; of a document as in its file, only which that is."""
        session, network = self.session, self.session.network
        state = (id(network), session.path, network.revision if session.modified else -1)
        if session.in_gesture or self._written == state:
            return
        started = time.perf_counter()
        file, text = session.path, ""
        if session.modified:
            text = workspace.dumps(network, folder=file.parent if file is not None else None)
        kept = {"file": str(file.absolute()) if file else None, "time": time.time(), "workspace": text}
        beside = self.at.with_suffix(".tmp")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock.tryLock(0)
            beside.write_text(json.dumps(kept), encoding="utf-8")
            os.replace(beside, self.at)
        except OSError as error:
            if text and not self._warned:
                self._warned = True
                session.tell("warning", f"autosave: cannot write {self.at}: {error.strerror}; save often")
        else:
            self._written = state  # else it is tried again, as a disk that was full need not stay so
        self._took = time.perf_counter() - started

    def close(self) -> None:
        """End in order: nothing is left behind."""
        self._timer.stop()
        self._at_once.stop()
        if self._marks is not None:
            self.session.engine.mark_in(None)
            with contextlib.suppress(OSError):
                self._marks.close()
        with contextlib.suppress(OSError):  # where nothing could be written, or can be any more, the window closes too
            self.at.unlink(missing_ok=True)
        self._lock.unlock()

    def _see(self, commands: list[Command]) -> None:
        # A document that takes longer than a frame to write waits for the timer.
        if self._took < AT_ONCE and any(command.structural for command in commands):
            self._at_once.start(0)

    def _mark(self) -> Marks | None:
        try:
            marks = Marks(_marks_of(self.at))
        except OSError:
            return None  # the first write says that nothing can be written there
        self.session.engine.mark_in(marks)
        return marks


def lost_documents(folder: Path | None = None, process: int | None = None) -> list[Lost]:
    """What editors that no longer run left behind, the latest first; of one process, or of all.

    Of all, only what would be lost or ran is listed; the rest is removed. What cannot be read is passed over.
    """
    found = []
    folder = folder if folder is not None else recovery_folder()
    for at in sorted(folder.glob(f"{process}-*.json" if process is not None else "*.json")):
        try:
            kept = json.loads(at.read_text(encoding="utf-8"))
            if not _lock(at).tryLock(0):
                continue  # its editor still runs
            file = Path(kept["file"]) if kept["file"] else None
            lost = Lost(at, file, float(kept["time"]), str(kept["workspace"]), tuple(left_in(_marks_of(at))))
            if process is None and not lost.text and not (file and lost.suspects):
                lost.discard()
                continue
            lost.network()
            found.append(lost)
        except (OSError, ValueError, KeyError, TypeError, GraphError):
            continue
    return sorted(found, key=lambda lost: -lost.saved)


def mute_suspects(session: Session, lost: Lost) -> None:
    """Mute the nodes that ran when the editor ended, and say so. Ones that are no longer there are only told."""
    there = [one for one in lost.suspects if one.path in session.network]
    with session.gesture("mute what ran at the crash"):
        for one in there:
            session.do(Mute(one.path))
    for one in lost.suspects:
        cure = "it is muted; wake it to try again" if one in there else "it is not in what was recovered"
        session.tell("warning", f"{one.path}: {one.type} ran when the editor ended unexpectedly; {cure}", one.path)
    if not lost.suspects:
        session.tell("warning", "the editor ended unexpectedly while no node ran; what was open is here again")


def _marks_of(at: Path) -> Path:
    return at.with_suffix(".running")


def _lock(at: Path) -> QLockFile:
    lock = QLockFile(str(at) + ".lock")
    lock.setStaleLockTime(0)
    return lock
