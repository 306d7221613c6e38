"""Kernels as text: what is saved is in the picture, what fails is marked, what is not ours is copied first."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from pytestqt.qtbot import QtBot

from nodegraph import locations, registry
from nodegraph.commands import Add, Connect, Set
from nodegraph.editor.session import Session
from nodegraph.editor.shader_editor.code import CodeEdit
from nodegraph.editor.shader_editor.copying import replace
from nodegraph.editor.window import Window
from nodegraph.engine import Engine

GAIN = """\
// A grey picture.
uniform ivec2 result_size;
uniform float gain = 1.0;   // 0..10; Factor.

vec4 pixel(ivec2 at) {
    return vec4(vec3(gain * 0.25), 1.0);
}
"""


@pytest.fixture
def kernel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    folder = tmp_path / "plugins" / "image"
    folder.mkdir(parents=True)
    (folder / "grey.glsl").write_text(GAIN)
    monkeypatch.setenv("NODEGRAPH_PATH", str(tmp_path / "plugins"))
    registry.default.cache_clear()
    yield folder / "grey.glsl"
    registry.default.cache_clear()


@pytest.fixture
def shown(kernel: Path, window: Window, qtbot: QtBot) -> Window:
    """A window that shows the picture of the kernel, with its node selected and its text open."""
    qtbot.waitUntil(lambda: kernel in window.shader.reloader.kernels, timeout=20000)
    window.session.do(Add("image.grey", "grey"))
    window.session.do(Add("output.view", "view"))
    window.session.do(Connect("grey.result", "view.image"))
    window.session.select("grey")
    window.show_shader()
    assert window.shader.path == kernel
    qtbot.waitUntil(lambda: level(window.session) == 0.25, timeout=20000)
    return window


def level(session: Session) -> float:
    value = session.value("grey", "result")
    return float(np.asarray(value.color)[0, 0, 0]) if value is not None else -1.0


def type_anew(window: Window, old: str, new: str) -> None:
    cursor = window.shader.code.document().find(old)
    assert not cursor.isNull()
    cursor.insertText(new)


def test_what_is_typed_and_saved_is_seen(shown: Window, kernel: Path, qtbot: QtBot) -> None:
    panel = shown.shader
    assert panel.code.toPlainText() == GAIN
    assert not panel.save_it.isEnabled()
    type_anew(shown, "0.25", "0.5")
    assert panel.modified
    qtbot.keyClick(panel.code, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    assert "0.5" in kernel.read_text()
    assert not panel.modified
    qtbot.waitUntil(lambda: level(shown.session) == 0.5, timeout=20000)


@pytest.mark.slow
def test_a_line_that_fails_is_marked_and_the_old_goes_on(shown: Window, kernel: Path, qtbot: QtBot) -> None:
    panel = shown.shader
    type_anew(shown, "gain * 0.25", "gian * 0.25")
    panel.save()
    qtbot.waitUntil(lambda: list(panel.code.errors) == [6], timeout=20000)
    assert "gian" in panel.code.errors[6]
    assert panel.state.text().startswith("line 6: ")
    assert len(panel.code.extraSelections()) == 1
    shown.session.do(Set("grey.gain", 2.0))
    qtbot.waitUntil(lambda: level(shown.session) == 0.5, timeout=20000)
    panel.code.go_to(1)
    item = next(
        shown.messages.list.item(row)
        for row in range(shown.messages.list.count())
        if ".glsl:6" in shown.messages.messages()[row].path
    )
    shown.messages.list.itemClicked.emit(item)  # a click on the message goes to the line
    assert panel.code.textCursor().blockNumber() == 5
    type_anew(shown, "gian * 0.25", "gain * 0.5")
    panel.save()
    qtbot.waitUntil(lambda: not panel.code.errors, timeout=20000)
    qtbot.waitUntil(lambda: level(shown.session) == 1.0, timeout=20000)


def test_changes_are_kept_until_saved_or_reverted(shown: Window, kernel: Path, qtbot: QtBot) -> None:
    panel = shown.shader
    type_anew(shown, "0.25", "0.125")
    assert not panel.open(locations.shaders() / "render" / "slice.glsl")
    assert "save or revert" in panel.state.text()
    panel.revert()
    assert panel.code.toPlainText() == GAIN
    kernel.write_text(GAIN.replace("0.25", "0.75"))  # another program
    qtbot.waitUntil(lambda: "0.75" in panel.code.toPlainText(), timeout=20000)
    assert panel.open(locations.shaders() / "render" / "slice.glsl", 3)
    assert panel.code.textCursor().blockNumber() == 2


@pytest.mark.slow
def test_a_file_that_is_not_ours_is_copied_to_the_plugins_and_used(
    shown: Window, kernel: Path, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    panel, session = shown.shader, shown.session
    for id, params in (("source.synthetic", {}), ("filter.gradient", {"method": "sobel"})):
        session.do(Add(id, "", params))
    session.do(Connect("synthetic.volume", "gradient.volume"))
    session.do(Add("render.raycast", "cast"))
    session.do(Connect("gradient.gradient", "cast.gradient"))
    session.select("gradient")
    file = locations.shaders() / "filter" / "gradient.glsl"
    assert panel.path == file
    monkeypatch.setattr(type(panel), "read_only", property(lambda self: self.path == file))
    panel._follow()
    assert panel.code.isReadOnly()
    assert panel.copy_it.isVisibleTo(panel)
    before = session.history.undo_name
    panel.copy()
    node = session.network.node("gradient")
    assert node.type == "filter.my_gradient"
    assert node.params == {"method": "sobel"}
    assert node.inputs == {"volume": ("synthetic.volume",)}
    assert session.network.node("cast").inputs == {"gradient": ("gradient.gradient",)}
    assert panel.path == kernel.parents[1] / "shaders" / "filter" / "my_gradient.glsl"
    assert not panel.code.isReadOnly()
    with Engine("cl", disk=False) as engine:
        session.do(Add("filter.gradient", "original", {"method": "sobel"}))
        session.do(Connect("synthetic.volume", "original.volume"))
        both = engine.evaluate(session.network, ["gradient", "original"])
        both.raise_first()
        mine, theirs = (both.shown[name]["gradient"].data for name in ("gradient", "original"))
        np.testing.assert_array_equal(mine, theirs)
    session.undo()
    session.undo()
    session.undo()
    assert session.network.node("gradient").type == "filter.gradient"
    assert session.history.undo_name == before


def test_a_replaced_node_keeps_links_place_and_mute(session: Session) -> None:
    net = session.network
    net.add("render.raycast", "cast", step=0.25)
    net.add("output.view", "view")
    net.connect("cast.image", "view.image")
    net.link("cast.camera", "camera")
    net.link("view.camera", "camera")
    net.mute("cast")
    net.node("cast").ui["position"] = [3.0, 4.0]
    replace(session, "cast", "render.raycast")
    node = net.node("cast")
    assert (node.params, node.links, node.muted, node.ui) == (
        {"step": 0.25},
        {"camera": "camera"},
        True,
        {"position": [3.0, 4.0]},
    )
    assert net.node("view").inputs == {"image": ("cast.image",)}


def test_typing_code(qtbot: QtBot) -> None:
    code = CodeEdit()
    qtbot.addWidget(code)
    code.show()
    for keys in ("void f() {", Qt.Key.Key_Return, "x;", Qt.Key.Key_Return, "/* a", Qt.Key.Key_Return, "b */"):
        qtbot.keyClicks(code, keys) if isinstance(keys, str) else qtbot.keyClick(code, keys)
    assert code.toPlainText() == "void f() {\n    x;\n    /* a\n    b */"
    assert code.document().findBlockByNumber(2).userState() == 1
    assert code.document().findBlockByNumber(3).userState() == 0
    qtbot.keyClick(code, Qt.Key.Key_Tab)
    assert code.toPlainText().endswith("*/    ")
    code.mark({2: "no", 99: "nowhere"})
    assert code.errors == {2: "no"}


@pytest.mark.slow
@pytest.mark.parametrize("half", ["", GAIN[:60], GAIN[:-20]], ids=["empty", "in a declaration", "in a function"])
def test_a_file_that_is_read_while_it_is_written_is_marked_no_longer_than_that(
    shown: Window, kernel: Path, qtbot: QtBot, half: str
) -> None:
    panel = shown.shader
    kernel.write_text(half)
    panel.reloader.look()
    qtbot.waitUntil(lambda: bool(panel.reloader.refused), timeout=20000)
    kernel.write_text(GAIN.replace("0.25", "0.5"))
    panel.reloader.look()
    qtbot.waitUntil(lambda: level(shown.session) == 0.5, timeout=20000)
    qtbot.waitUntil(lambda: not panel.code.errors, timeout=5000)
