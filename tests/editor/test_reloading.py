"""A plug-in's file is changed while the editor runs: the picture follows, what fails is told and changes nothing."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from nodegraph import registry
from nodegraph.commands import Add, Connect, Mute, Rename, Set
from nodegraph.editor.reloading import Reloader
from nodegraph.editor.session import Message, Session
from nodegraph.editor.window import Window

RAMP = """\
// A ramp.
uniform ivec2 result_size;
uniform float gain = 1.0;   // 0..10; Factor.

vec4 pixel(ivec2 at) {
    return vec4(vec3(gain * 0.25), 1.0);
}
"""


@pytest.fixture
def plugin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of plug-ins with one kernel in it."""
    folder = tmp_path / "plugins"
    (folder / "image").mkdir(parents=True)
    (folder / "image" / "ramp.glsl").write_text(RAMP)
    monkeypatch.setenv("NODEGRAPH_PATH", str(folder))
    registry.default.cache_clear()
    yield folder / "image" / "ramp.glsl"
    registry.default.cache_clear()


@pytest.fixture
def reloader(plugin: Path, session: Session, qtbot: QtBot) -> Iterator[Reloader]:
    made = Reloader(session, delay=10)
    qtbot.waitUntil(lambda: str(plugin) in made._watcher.files(), timeout=10000)
    yield made
    made.close()


def shown(session: Session) -> float:
    value = session.value("ramp", "result")
    return float(value.color[0, 0, 0]) if value is not None else -1.0


def open_ramp(session: Session) -> None:
    session.do(Add("image.ramp", "ramp"))
    session.do(Add("output.view", "view"))
    session.do(Connect("ramp.result", "view.image"))
    session.do(Set("ramp.gain", 2.0))
    session.watch("test", "view", (8, 8))


def test_the_picture_follows_the_file_and_values_stay(
    plugin: Path, reloader: Reloader, session: Session, qtbot: QtBot
) -> None:
    open_ramp(session)
    qtbot.waitUntil(lambda: shown(session) == 0.5, timeout=20000)
    plugin.write_text(RAMP.replace("0.25", "0.5"))
    qtbot.waitUntil(lambda: shown(session) == 1.0, timeout=20000)
    # Many programs write another file and put it in the place of the first.
    for number in (3, 4):
        beside = plugin.with_suffix(".tmp")
        beside.write_text(RAMP.replace("0.25", f"{number}.0"))
        os.replace(beside, plugin)
        qtbot.waitUntil(lambda number=number: shown(session) == 2.0 * number, timeout=20000)
    assert session.history.undo_name.startswith("set ")  # a reload is nothing to undo


def test_what_fails_is_told_with_its_place_and_the_old_stays(
    plugin: Path, reloader: Reloader, session: Session, heard: list[Message], qtbot: QtBot
) -> None:
    open_ramp(session)
    qtbot.waitUntil(lambda: shown(session) == 0.5, timeout=20000)
    with qtbot.waitSignal(reloader.looked, timeout=20000):
        plugin.write_text(RAMP.replace("gain * 0.25", "gain * nothing"))
    error = next(message for message in heard if message.level == "error")
    assert error.path == f"{plugin}:6"
    assert error.text.startswith(f"{plugin}:6: ")
    assert "nothing" in error.text
    assert "stays in use" in error.text
    session.do(Set("ramp.gain", 4.0))
    qtbot.waitUntil(lambda: shown(session) == 1.0, timeout=20000)
    assert session.state("ramp") == "clean"
    with qtbot.waitSignal(reloader.mended, timeout=20000) as mended:
        plugin.write_text(RAMP.replace("0.25", "0.125"))
    assert mended.args == [error.path]
    qtbot.waitUntil(lambda: shown(session) == 0.5, timeout=20000)


def test_the_window_lists_a_new_file_and_forgets_what_was_mended(plugin: Path, window: Window, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: "image.ramp" in window.palette_panel.ids(), timeout=20000)
    qtbot.waitUntil(lambda: str(plugin) in window.reloader._watcher.files(), timeout=20000)
    other = plugin.with_name("other.glsl")
    other.write_text(RAMP.replace("gain * 0.25", "gain *"))
    qtbot.waitUntil(lambda: "Messages (1)" in window.docks["messages"].windowTitle(), timeout=20000)
    other.write_text(RAMP)
    qtbot.waitUntil(lambda: window.docks["messages"].windowTitle() == "Messages", timeout=20000)
    qtbot.waitUntil(lambda: "image.other" in window.palette_panel.ids(), timeout=20000)


def test_an_unknown_processor_is_a_placeholder_that_survives_and_wakes_up(
    plugin: Path, window: Window, tmp_path: Path, qtbot: QtBot
) -> None:
    """Edits around it, undo and saving keep all that the file had; when its plug-in comes, it is a node like others."""
    qtbot.waitUntil(lambda: str(plugin) in window.reloader._watcher.files(), timeout=20000)
    stored = {
        "type": "image.later",
        "version": 1,
        "params": {"gain": 3.0, "odd": [1, {"a": 2}]},
        "inputs": {"picture": "ramp.result", "more": ["ramp.result"]},
        "future": {"a": 1},
    }
    nodes = {
        "ramp": {"type": "image.ramp"},
        "late": stored,
        "view": {"type": "output.view", "inputs": {"image": "late.result"}},
    }
    (tmp_path / "net.json").write_text(json.dumps({"nodegraph": 1, "nodes": nodes}))
    window.open_file(tmp_path / "net.json")
    session = window.session
    session.select("late")
    trouble = window.parameters.sections["late"].trouble.text()
    assert "image.later" in trouble
    assert "Kept as stored: gain, odd." in trouble
    assert window.canvas.scene.nodes["late"].face.title == "image.later (not available)"
    session.do(Rename("late", "later"))
    session.do(Mute("later"))
    session.undo()
    session.do(Set("ramp.gain", 2.0))
    session.undo()
    assert session.save(tmp_path / "again.json")
    again = json.loads((tmp_path / "again.json").read_text())["nodes"]
    assert again["later"] == stored
    assert again["view"]["inputs"] == {"image": "later.result"}
    plugin.with_name("later.glsl").write_text(RAMP)
    qtbot.waitUntil(lambda: session.network.node("later").processor is not None, timeout=20000)
    assert session.network.get("later.gain") == 3.0
    assert "odd" in window.parameters.sections["later"].trouble.text()
    assert session.save(tmp_path / "again.json")
    again = json.loads((tmp_path / "again.json").read_text())["nodes"]
    assert again["later"] == stored
