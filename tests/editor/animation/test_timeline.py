"""The timeline: keys, scrubbing, playing, the turntable, rendering."""

from __future__ import annotations

import os
from collections.abc import Iterator

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from nodegraph import animation
from nodegraph.animation import Key, Span
from nodegraph.commands import Set
from nodegraph.editor.animation.export import ExportDialog
from nodegraph.editor.animation.timeline import Timeline
from nodegraph.editor.session import Session
from nodegraph.engine import Engine
from nodegraph.network import Network

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


@pytest.fixture
def session(qapp: QApplication) -> Iterator[Session]:
    net = Network()
    net.add("source.synthetic", "made", voxels=(8, 8, 8))
    net.add("render.raycast", "raycast")
    net.add("output.view", "view", width=16, height=12)
    net.connect("made.volume", "raycast.volume")
    net.connect("raycast.image", "view.image")
    net.link("raycast.camera", "camera")
    net.link("view.camera", "camera")
    net.history.clear()
    made = Session(net, Engine("cl", disk=False))
    made.told = []  # type: ignore[attr-defined]
    made.message.connect(made.told.append)  # type: ignore[attr-defined]
    yield made
    made.close()


@pytest.fixture
def timeline(qtbot, session) -> Timeline:
    widget = Timeline(session)
    qtbot.addWidget(widget)
    widget.resize(800, 160)
    widget.show()
    return widget


def keys(session: Session, target: str) -> list[tuple[int, object]]:
    return [(key.frame, key.value) for key in animation.track_of(session.network, target).keys]


def test_keys_are_set_moved_eased_and_removed(timeline, session) -> None:
    timeline.add_key("raycast.step")
    first = session.network.get("raycast.step")
    timeline.go_to(50)
    session.do(Set("raycast.step", 2.0))
    timeline.add_key("raycast.step")
    assert keys(session, "raycast.step") == [(0, first), (50, 2.0)]
    timeline.move_key("raycast.step", 50, 80)
    assert keys(session, "raycast.step") == [(0, first), (80, 2.0)]
    timeline.ruler.chosen = ("raycast.step", 0)
    timeline.set_easing("linear")
    assert animation.track_of(session.network, "raycast.step").keys[0] == Key(0, first, "linear")
    timeline.remove_key()
    timeline.ruler.chosen = ("raycast.step", 80)
    timeline.remove_key()
    assert animation.tracks_of(session.network) == []
    while session.history.undo_name:
        session.undo()
    assert session.network.node("raycast").ui == {}


def test_a_scrub_is_one_step_and_shows_every_frame(timeline, session) -> None:
    start = session.network.get("raycast.step")
    timeline.add_key("raycast.step")
    timeline._write(animation.track_of(session.network, "raycast.step").with_key(Key(100, 2 * start)))
    ruler = timeline.ruler
    steps = len(session.history._done)
    QTest.mousePress(ruler, LEFT, NONE, QPoint(round(ruler.x_of(20)), 8))
    for frame in (30, 50):
        QTest.mouseMove(ruler, QPoint(round(ruler.x_of(frame)), 8))
    ruler.scrubbed.emit(50)
    assert session.in_gesture
    assert session.network.get("raycast.step") == pytest.approx(1.5 * start)
    QTest.mouseRelease(ruler, LEFT, NONE, QPoint(round(ruler.x_of(50)), 8))
    assert not session.in_gesture
    assert len(session.history._done) == steps + 1
    session.undo()
    assert session.network.get("raycast.step") == start


def test_a_key_is_dragged_along_its_row(timeline, session) -> None:
    timeline.add_key("raycast.step")
    ruler = timeline.ruler
    place = QPoint(round(ruler.x_of(0)), 30 + 12)
    QTest.mousePress(ruler, LEFT, NONE, place)
    assert ruler.chosen == ("raycast.step", 0)
    QTest.mouseRelease(ruler, LEFT, NONE, QPoint(round(ruler.x_of(40)), place.y()))
    assert [frame for frame, _ in keys(session, "raycast.step")] == [40]
    assert ruler.chosen == ("raycast.step", 40)


def test_playing_runs_through_the_frames_and_round(timeline, session, qtbot) -> None:
    session.do(animation.write_span(Span(0, 3, 100)))
    timeline.add_key("raycast.step")
    seen = set()
    timeline._clock.timeout.connect(lambda: seen.add(timeline.frame))
    QTest.keyClick(timeline, Qt.Key.Key_Space)
    assert timeline.playing
    qtbot.waitUntil(lambda: seen == {0, 1, 2, 3}, timeout=5000)
    timeline.hide()
    assert not timeline.playing
    assert not session.in_gesture


def test_a_turntable_in_one_click_and_one_step(timeline, session) -> None:
    camera = session.network.get("camera")
    timeline._turn.click()
    (track,) = animation.tracks_of(session.network)
    assert track.target == "view.camera"
    eyes = np.array([track.at(frame).eye for frame in range(121)]) - camera.target
    np.testing.assert_allclose(np.linalg.norm(eyes, axis=1), np.linalg.norm(eyes[0]))
    steps = np.linalg.norm(np.diff(eyes, axis=0), axis=1)
    np.testing.assert_allclose(steps, steps[0], rtol=0.05)
    assert session.history.undo_name == "turntable"
    session.undo()
    assert animation.tracks_of(session.network) == []


def test_the_menu_of_keys_offers_cameras_and_the_selection(timeline, session) -> None:
    session.select("raycast")
    timeline._fill_keys()
    actions = {action.text(): action for action in timeline._keys.actions()}
    assert "Camera of view" in actions
    actions["step"].trigger()
    assert len(keys(session, "raycast.step")) == 1


def test_frames_and_rate_are_the_documents(timeline, session) -> None:
    timeline._last.setValue(10)
    timeline._rate.setValue(12)
    assert animation.span_of(session.network) == Span(0, 10, 12)
    session.undo()
    assert timeline._rate.value() == 25


def test_what_the_document_says_wrongly_is_told_once(timeline, session) -> None:
    session.network.node("view").ui["animation"] = {"width": []}
    timeline.refresh()
    timeline.refresh()
    assert [message.level for message in session.told] == ["warning"]


def test_rendering_writes_all_frames_and_leaves_the_document(timeline, session, qtbot, tmp_path) -> None:
    session.do(animation.write_span(Span(0, 2, 10)))
    timeline.add_turntable()
    camera = session.network.get("camera")
    timeline.render_to("view", tmp_path / "out", (16, 12))
    assert timeline.export is not None
    qtbot.waitUntil(lambda: timeline.export is None, timeout=20_000)
    assert sorted(os.listdir(tmp_path / "out")) == [f"view_{i:04d}.png" for i in range(3)]
    assert session.network.get("camera") == camera
    assert any("3 pictures" in message.text for message in session.told)


def test_rendering_is_stopped(timeline, session, qtbot, tmp_path) -> None:
    timeline.render_to("view", tmp_path / "out", (16, 12))
    timeline.open_export()  # the same button
    qtbot.waitUntil(lambda: timeline.export is None, timeout=20_000)
    assert len(os.listdir(tmp_path / "out")) < 121
    assert any("stopped" in message.text for message in session.told)


def test_the_dialog_completes_the_name_of_a_film(qtbot, session, tmp_path) -> None:
    dialog = ExportDialog(session, Span(0, 2, 10))
    qtbot.addWidget(dialog)
    chosen = []
    dialog.chosen.connect(lambda *told: chosen.append(told))
    assert (dialog.width_box.value(), dialog.height_box.value()) == (16, 12)
    dialog.format.setCurrentIndex(1)
    dialog.place.setText(str(tmp_path / "mine"))
    dialog.accept()
    assert chosen == [("view", tmp_path / "mine.mp4", (16, 12))]
