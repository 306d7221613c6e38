"""Work survives a kill: what was not saved is offered to the next editor."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from nodegraph import workspace
from nodegraph.commands import Set
from nodegraph.editor.recovery import Autosave, lost_documents
from nodegraph.editor.session import Session
from nodegraph.editor.window import Window
from tests.editor.test_session import small

VICTIM = """
import os, signal, sys
os.environ["QT_QPA_PLATFORM"] = "offscreen"
from PySide6.QtCore import QTimer
from nodegraph.commands import Set
from nodegraph.editor.app import application, open_window
from pathlib import Path
app = application()
window = open_window([Path(sys.argv[1])])
window.session.do(Set("blur.sigma", 7.5))
window.autosave.write()
os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_differs_from_the_file_is_written_aside_and_removed_when_it_is_saved(
    session: Session, tmp_path: Path
) -> None:
    autosave = Autosave(session, tmp_path / "aside")
    session.adopt(small())
    autosave.write()
    assert not autosave.at.exists()
    session.do(Set("blur.sigma", 2.0))
    autosave.write()
    assert "sigma" in autosave.at.read_text()
    assert lost_documents(tmp_path / "aside") == []  # its editor still runs
    session.save(tmp_path / "net.json")
    assert not autosave.at.exists()
    autosave.close()


def test_it_writes_by_itself(session: Session, tmp_path: Path, qtbot: QtBot) -> None:
    autosave = Autosave(session, tmp_path / "aside", every=20)
    session.adopt(small())
    session.do(Set("blur.sigma", 2.0))
    qtbot.waitUntil(autosave.at.exists, timeout=5000)
    autosave.close()
    assert list((tmp_path / "aside").glob("*.json*")) == []


def test_a_killed_editor_loses_nothing(window: Window, config: Path, tmp_path: Path) -> None:
    file = tmp_path / "net.json"
    workspace.save(small(), file)
    done = subprocess.run(
        [sys.executable, "-c", VICTIM, str(file)], env=dict(os.environ), capture_output=True, text=True, timeout=120
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    lost = lost_documents()
    assert [one.file for one in lost] == [file]
    window.offer(lost)
    assert "net.json" in window.banner.text.text()
    window.banner.buttons["Recover"].click()
    assert window.session.network.get("blur.sigma") == 7.5
    assert window.session.path == file
    assert window.session.modified
    assert not lost[0].at.exists()
    assert window.autosave.at.exists()  # it is still not in its file
    assert workspace.load(file).get("blur.sigma") == 1.0


@pytest.mark.parametrize("text", ["", "[]", '{"file": 3}', '{"file": null, "time": 1, "workspace": "{"}'])
def test_damaged_files_are_passed_over(tmp_path: Path, text: str) -> None:
    (tmp_path / "1-a.json").write_text(text)
    assert lost_documents(tmp_path) == []
