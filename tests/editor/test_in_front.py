"""What nobody sees is not computed: a panel behind the tab of another asks for nothing."""

from __future__ import annotations

from pytestqt.qtbot import QtBot

from nodegraph import Network
from nodegraph.commands import Set
from nodegraph.editor.window import Window


def scene() -> Network:
    network = Network()
    network.add("source.synthetic", "volume", voxels=(8, 8, 8))
    network.add("render.slice", "slice")
    network.add("output.view", "view")
    network.connect("volume.volume", "slice.volume")
    network.connect("slice.image", "view.image")
    network.history.mark_saved()
    return network


def test_panels_behind_a_tab_ask_for_nothing(window: Window, qtbot: QtBot) -> None:
    session = window.session
    channels: list[object] = []
    session.answered.connect(lambda channel, _: channels.append(channel) if session.watches(channel) else None)
    session.adopt(scene())
    qtbot.waitUntil(lambda: bool(channels), timeout=20000)
    qtbot.wait(200)
    assert len(set(channels)) == 1
    window.show_compare()
    qtbot.waitUntil(lambda: len(set(channels)) == 3, timeout=20000)  # the view, A and B
    window.show_quality()
    qtbot.wait(50)
    channels.clear()
    session.do(Set("slice.interpolation", "nearest"))
    qtbot.waitUntil(lambda: bool(channels), timeout=20000)
    qtbot.wait(200)
    assert len(set(channels)) == 1
