"""Work is not lost: the document is written aside every few seconds, and offered after a crash."""

from __future__ import annotations

import json
import os
import secrets
import time
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QLockFile, QObject, QTimer

from nodegraph import workspace
from nodegraph.editor.session import Session
from nodegraph.editor.settings import config_folder
from nodegraph.errors import GraphError
from nodegraph.network import Network

EVERY = 4000
"""Milliseconds between looks whether there is something to write."""


@dataclass(frozen=True, slots=True)
class Lost:
    """A document that an editor left behind. file: where it was opened from, None for one that had no file yet."""

    at: Path
    file: Path | None
    saved: float
    text: str

    def network(self) -> Network:
        """The document as it was, belonging to its file again and differing from it. Raises WorkspaceError."""
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
        self.at.unlink(missing_ok=True)


class Autosave(QObject):
    """Writes a session's document aside while it differs from its file, and removes that once it no longer does."""

    def __init__(self, session: Session, folder: Path | None = None, every: int = EVERY) -> None:
        super().__init__(session)
        self.session = session
        self.folder = folder if folder is not None else recovery_folder()
        self.at = self.folder / f"{os.getpid()}-{secrets.token_hex(4)}.json"
        self._lock = _lock(self.at)  # the system gives it up when this program ends, however it ends
        self._written: tuple[int, int] | None = None
        self._timer = QTimer(self)
        self._timer.setInterval(every)
        self._timer.timeout.connect(self.write)
        self._timer.start()
        session.saved.connect(self.write)
        session.replaced.connect(self.write)

    def write(self, *_: object) -> None:
        """Write what is there, if it differs from the file and from what was written last."""
        network = self.session.network
        if not self.session.modified:
            self.at.unlink(missing_ok=True)
            self._written = None
            return
        if self.session.in_gesture or self._written == (id(network), network.revision):
            return
        file = self.session.path
        text = workspace.dumps(network, folder=file.parent if file is not None else None)
        kept = {"file": str(file) if file else None, "time": time.time(), "workspace": text}
        beside = self.at.with_suffix(".tmp")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._lock.tryLock(0)
            beside.write_text(json.dumps(kept), encoding="utf-8")
            os.replace(beside, self.at)
        except OSError as error:
            if self._written is None:
                self.session.tell("warning", f"autosave: cannot write {self.at}: {error.strerror}; save often")
        self._written = (id(network), network.revision)

    def close(self) -> None:
        """End in order: nothing is left behind."""
        self._timer.stop()
        self.at.unlink(missing_ok=True)
        self._lock.unlock()


def recovery_folder() -> Path:
    """Where documents are written aside."""
    return config_folder() / "recovery"


def lost_documents(folder: Path | None = None) -> list[Lost]:
    """What editors that no longer run left behind, the latest first. What cannot be read is passed over."""
    found = []
    for at in sorted((folder if folder is not None else recovery_folder()).glob("*.json")):
        try:
            kept = json.loads(at.read_text(encoding="utf-8"))
            if not _lock(at).tryLock(0):
                continue  # its editor still runs
            file = Path(kept["file"]) if kept["file"] else None
            lost = Lost(at, file, float(kept["time"]), str(kept["workspace"]))
            lost.network()
            found.append(lost)
        except (OSError, ValueError, KeyError, TypeError, GraphError):
            continue
    return sorted(found, key=lambda lost: -lost.saved)


def _lock(at: Path) -> QLockFile:
    lock = QLockFile(str(at) + ".lock")
    lock.setStaleLockTime(0)
    return lock
