"""A recording, run anew, ends with the same network and the same steps to undo."""

from __future__ import annotations

import random
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from nodegraph import workspace
from nodegraph.commands import Remove, Set, SetUI
from nodegraph.data import Camera, Plane, TransferFunction
from nodegraph.errors import GraphError
from nodegraph.network import Network
from nodegraph.recording import Recording
from tests.nodegraph.test_commands import START, random_command
from tests.support.document import find

ROOT = Path(__file__).resolve().parents[2]


def rerun(recording: Recording) -> Network:
    names: dict[str, Network] = {}
    exec(compile(recording.text(), "recorded", "exec"), names)
    return names["net"]


def assert_same(recording: Recording) -> None:
    """Also after everything is undone, step by step."""
    mine, again = recording.network, rerun(recording)
    recording.close()
    assert workspace.dumps(again) == workspace.dumps(mine)
    while mine.history.undo_name:
        assert again.history.undo_name == mine.history.undo_name
        mine.undo()
        again.undo()
        assert workspace.dumps(again) == workspace.dumps(mine)
    assert not again.history.undo_name


def session(net: Network) -> None:
    """Some of everything."""
    net.add("source.volume", "ct", path="chest.nii.gz")
    net.add("render.raycast", "cast", camera=Camera(eye=(1.0, 2.5, 3.0)), step=0.25)
    net.add("render.slice", plane=Plane((0.0, 1.0, 2.0), (1.0, 0.0, 0.0)))
    net.connect("ct.volume", "cast.volume")
    net.set("cast.transfer_function", TransferFunction([(0.0, (1.0, 0.0, 0.0), 0.0), (9.0, (1.0, 1.0, 0.5), 0.7)], 2.0))
    net.undo()
    net.redo()
    net.history.begin("turn")
    for x in range(20):
        net.history.do(Set("cast.camera", Camera(eye=(x + 1.0, 2.5, 3.0))))
    net.history.end()
    net.history.begin("back and forth")
    net.set("cast.step", 0.5)
    net.set("cast.step", 0.7)
    net.set("cast.step", 0.25)
    net.history.end()
    net.history.begin("given up")
    net.set("cast.step", 3.0)
    net.history.cancel()
    net.link("cast.camera", "camera")
    net.set("camera", Camera(eye=(0.0, -4.0, 0.0)))
    net.history.do(SetUI("ct", "position", [10.0, 20.5]))
    net.mute("slice")
    del net["cast"].step
    net.group("ct", "cast", id="both")
    copied = net.copy("both", "slice")
    net.set("camera", Camera(eye=(0.0, -5.0, 0.0)))
    net.paste(copied)
    net.mute("slice", False)
    net.rename("slice", "cut")
    net.ungroup("both")
    net.history.do(Remove(["cut"]))
    net.undo()


def test_a_session_runs_in_a_fresh_interpreter_and_gives_the_same_network(tmp_path: Path) -> None:
    net = Network()
    recording = Recording(net)
    session(net)
    script = tmp_path / "recorded.py"
    script.write_text(recording.text() + f"net.save({str(tmp_path / 'again.json')!r})\n")
    subprocess.run([sys.executable, str(script)], check=True, cwd=ROOT, env={"PYTHONPATH": str(ROOT)}, timeout=60)
    workspace.save(net, tmp_path / "mine.json")
    assert (tmp_path / "again.json").read_text() == (tmp_path / "mine.json").read_text()
    assert recording.text().count("cast.camera") == 3  # of a drag two values are kept
    assert "given up" not in recording.text()


def test_all_steps_are_there() -> None:
    net = Network()
    recording = Recording(net)
    session(net)
    assert_same(recording)


@pytest.mark.parametrize("seed", range(25))
def test_any_sequence_of_commands(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(workspace, "loads", partial(workspace.loads, find=find))
    draw = random.Random(seed)
    net = workspace.loads(START)
    recording = Recording(net)
    for _ in range(40):
        try:
            net.history.do(random_command(net, draw))
        except GraphError:
            continue
        if draw.random() < 0.15:
            net.undo()
        if draw.random() < 0.1 and net.history.redo_name:
            net.redo()
    assert "NotImplementedError" not in recording.text()
    assert_same(recording)


def test_where_a_recording_begins(tmp_path: Path) -> None:
    net = Network()
    net.add("source.volume", "ct")
    net.save(tmp_path / "net.json")
    opened = workspace.load(tmp_path / "net.json")
    recording = Recording(opened)
    assert recording.steps == 0
    opened.set("ct.time", 1)
    assert f"net = nodegraph.load({str(tmp_path / 'net.json')!r})" in recording.text()
    opened.save()
    recording.saved(opened.file)
    assert f"net.save({str(tmp_path / 'net.json')!r})" in recording.text()
    assert "nodegraph.load" not in recording.text()  # the file holds something else now
    assert workspace.dumps(rerun(recording)) == workspace.dumps(opened)
    net.set("ct.level", 2)
    later = Recording(net)  # of a document that differs from its file
    net.set("ct.level", 3)
    net.undo()
    net.redo()
    assert rerun(later).get("ct.level") == 3
