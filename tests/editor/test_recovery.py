"""Work survives a kill: what was not saved is offered to the next editor."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from nodegraph import workspace
from nodegraph.commands import Set
from nodegraph.editor import guard
from nodegraph.editor.recovering import offer
from nodegraph.editor.recovery import Autosave, lost_documents
from nodegraph.editor.session import Session
from nodegraph.editor.window import Window
from nodegraph.marks import Marks, left_in
from nodegraph.network import Network
from tests.editor.test_session import small

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]

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
    assert "sigma" not in autosave.at.read_text()
    session.do(Set("blur.sigma", 2.0))
    autosave.write()
    assert "sigma" in autosave.at.read_text()
    assert lost_documents(tmp_path / "aside") == []  # its editor still runs
    session.save(tmp_path / "net.json")
    assert "sigma" not in autosave.at.read_text()
    autosave.close()
    assert list((tmp_path / "aside").iterdir()) == []


def test_it_writes_by_itself(session: Session, tmp_path: Path, qtbot: QtBot) -> None:
    autosave = Autosave(session, tmp_path / "aside", every=20)
    session.adopt(small())
    session.do(Set("blur.sigma", 2.0))
    qtbot.waitUntil(lambda: "sigma" in autosave.at.read_text(), timeout=5000)
    autosave.close()
    assert list((tmp_path / "aside").iterdir()) == []


def test_where_nothing_can_be_written_it_is_tried_again_and_ends_in_order(session: Session, tmp_path: Path) -> None:
    place = tmp_path / "config"
    place.write_text("a file where a folder should be")
    autosave = Autosave(session, place / "recovery", every=1_000_000)
    session.adopt(small())
    session.do(Set("blur.sigma", 2.0))
    autosave.write()
    assert not autosave.at.exists()
    place.unlink()
    autosave.write()
    assert "sigma" in autosave.at.read_text()
    place.rename(tmp_path / "gone")
    place.write_text("and here it is again")
    autosave.close()


def test_a_killed_editor_loses_nothing(window: Window, config: Path, tmp_path: Path) -> None:
    file = tmp_path / "net.json"
    workspace.save(small(), file)
    done = subprocess.run(
        [sys.executable, "-c", VICTIM, str(file)], env=dict(os.environ), capture_output=True, text=True, timeout=120
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    lost = lost_documents()
    assert [one.file for one in lost] == [file]
    offer(window, lost)
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


CRASHER = '''
"""Read where nothing is."""
import ctypes
import os

from nodegraph import Choice, Output, Processor
from nodegraph.data import Image


class Crasher(Processor):
    """End the program."""

    image = Output(Image, doc="Nothing.")
    way = Choice("stay", "null", "abort", doc="How it ends.")

    def process(self, way, *, size):
        import numpy as np

        if way == "null":
            ctypes.string_at(0)
        if way == "abort":
            os.abort()
        return Image(np.ones((4, 4, 4), "f4"))
'''

GUARDED = """
import os, sys, json
os.environ["QT_QPA_PLATFORM"] = "offscreen"
from pathlib import Path
from PySide6.QtCore import QTimer
from nodegraph.commands import Add, Connect, Set
from nodegraph.editor import app as editor
from nodegraph.editor.settings import config_folder

opened = editor.open_window

def open_window(*arguments, after=None, **options):
    window = opened(*arguments, after=after, **options)
    session = window.session

    def crash():
        session.do(Add("source.crasher", "bad", {"way": os.environ["WAY"]}))
        session.do(Connect("bad.image", "view.image"))

    def look():
        told = [message.text for message in window.messages.messages() if message.level == "warning"]
        state = {
            "after": after,
            "muted": [node.path for node in session.network.walk() if node.muted],
            "nodes": list(session.network.nodes),
            "file": str(session.path),
            "modified": session.modified,
            "undo": session.history.undo_name,
            "told": told,
        }
        (config_folder() / "seen.json").write_text(json.dumps(state))
        window._leaving = True
        window.close()

    QTimer.singleShot(300, crash if after is None else look)
    return window

editor.open_window = open_window
from nodegraph.cli import main
sys.exit(main())
"""


@pytest.mark.parametrize("way", ["null", pytest.param("abort", marks=pytest.mark.slow)])
def test_a_native_crash_brings_the_editor_back_with_the_suspect_muted(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    plugins = tmp_path / "plugins"
    (plugins / "source").mkdir(parents=True)
    (plugins / "source" / "crasher.py").write_text(CRASHER)
    net = Network()
    net.add("output.view", "view")
    workspace.save(net, tmp_path / "net.json")
    # What the guard starts is a script that does as a user would.
    (tmp_path / "starting.py").write_text(GUARDED)
    environment = {**os.environ, "NODEGRAPH_PATH": str(plugins), "WAY": way, "PYTHONPATH": str(ROOT)}
    guarded = (
        "import sys; from nodegraph.editor import guard; "
        "guard.COMMAND[:] = [sys.executable, sys.argv[1]]; sys.exit(guard.run(sys.argv[2:], 'cl'))"
    )
    done = subprocess.run(
        [sys.executable, "-c", guarded, str(tmp_path / "starting.py"), str(tmp_path / "net.json")],
        env=environment,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert done.returncode == 0, done.stderr
    assert "crashed and comes back" in done.stderr
    seen = json.loads((config / "seen.json").read_text())
    assert seen["after"] > 0
    assert seen["nodes"] == ["view", "bad"]
    assert seen["muted"] == ["bad"]
    assert seen["file"] == str(tmp_path / "net.json")
    assert seen["modified"]
    assert seen["undo"] == "mute what ran at the crash"
    assert any("bad: source.crasher ran when the editor ended" in text for text in seen["told"])
    assert list((config / "recovery").iterdir()) == []


@pytest.mark.parametrize(
    ("code", "expected"), [(0, False), (1, False), (2, False), (-15, False), (-2, False), (-9, False), (-11, True)]
)
def test_who_is_asked_to_end_did_not_crash(code: int, expected: bool) -> None:
    assert guard.crashed(code) is expected


def test_an_editor_that_crashes_at_once_is_not_started_for_ever(
    config: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    nothing = "import os; os.abort()"
    monkeypatch.setattr(guard, "COMMAND", [sys.executable, "-c", nothing])
    assert guard.run([], "auto") == 1
    assert "crash" not in capfd.readouterr().err  # no window came up
    leaving = f"import os, pathlib; pathlib.Path({str(config)!r}, 'recovery', str(os.getpid()) + '-a.json').touch(); "
    (config / "recovery").mkdir(parents=True)
    monkeypatch.setattr(guard, "COMMAND", [sys.executable, "-c", leaving + nothing])
    assert guard.run([], "auto") == 1
    assert "crashed twice" in capfd.readouterr().err
    assert len(list((config / "recovery").iterdir())) == 2


def test_what_ran_is_read_after_the_end_and_forgotten_in_order(tmp_path: Path) -> None:
    marks = Marks(tmp_path / "a" / "1.running")
    with marks.running("group/blur", "filter.gaussian_blur"):
        with marks.running("x" * 5000, "filter.long"):
            assert len(left_in(marks.file)) == 2
        assert left_in(marks.file) == [("group/blur", "filter.gaussian_blur")]
    assert left_in(marks.file) == []
    marks.close()
    assert left_in(marks.file) == []
