"""What is done in the window is written down as Python that does it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from PySide6.QtGui import QGuiApplication
from pytestqt.qtbot import QtBot

from nodegraph import workspace
from nodegraph.commands import Add, Connect, Set
from nodegraph.editor.window import Window

ROOT = Path(__file__).resolve().parents[2]


def test_a_session_is_written_down_and_runs_in_a_fresh_interpreter(
    window: Window, tmp_path: Path, qtbot: QtBot
) -> None:
    session, recorder = window.session, window.recorder
    window.show_recorder()
    assert recorder.summary.text() == "Nothing was done yet"
    window.add_processor("source.synthetic")
    session.do(Add("filter.gaussian_blur", "blur"))
    session.do(Connect("synthetic.volume", "blur.volume"))
    with session.gesture("drag"):
        for sigma in (1.0, 2.0, 3.0, 4.0):
            session.do(Set("blur.sigma", sigma))
    session.undo()
    session.redo()
    session.do(Set("blur.nothing", 1.0))  # refused
    window.console.line.setText("net['blur'].sigma = 0.5")
    window.console.enter()
    qtbot.waitUntil(lambda: "sigma', 0.5" in recorder.script.toPlainText(), timeout=5000)
    assert "net.undo()\nnet.redo()\n" in recorder.script.toPlainText()
    recorder.copy()
    script = QGuiApplication.clipboard().text()
    assert script == recorder.script.toPlainText()
    assert recorder.save(tmp_path / "done.py")
    assert (tmp_path / "done.py").read_text() == script
    (tmp_path / "run.py").write_text(f"{script}net.save({str(tmp_path / 'again.json')!r})\n")
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, str(tmp_path / "run.py")], check=True, env=environment, timeout=60)
    workspace.save(session.network, tmp_path / "mine.json")
    assert (tmp_path / "again.json").read_text() == (tmp_path / "mine.json").read_text()
    recorder.begin()
    assert "gesture" not in recorder.script.toPlainText()
    assert not recorder.save(tmp_path)  # a folder
    window.session.new()
    assert recorder.script.toPlainText() == "import nodegraph\n\nnet = nodegraph.Network()\n"
