"""Nodes, frames and notes: moved, copied, grouped, renamed; each is one step, and undo takes it back exactly."""

from __future__ import annotations

import json

import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QDropEvent, QGuiApplication
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from nodegraph.commands import Rename, Set, SetUI
from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.canvas.view import MIME
from nodegraph.editor.session import Session
from nodegraph.group_commands import Group
from tests.editor.canvas.conftest import Hand, text_of


def place(session: Session, path: str) -> list[float] | None:
    found: list[float] | None = session.network.node(path).ui.get("position")
    return found


def test_a_drag_is_one_step_and_keeps_the_drawing(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before = text_of(session)
    stood = {id: item.pos() for id, item in canvas.scene.nodes.items()}
    hand.drag(hand.title("blur"), hand.title("blur") + QPointF(0, -100))
    assert place(session, "blur") == [stood["blur"].x(), stood["blur"].y() - 100]
    assert place(session, "view") == [stood["view"].x(), stood["view"].y()]  # it stays where it was seen
    session.undo()
    assert text_of(session) == before
    assert {id: item.pos() for id, item in canvas.scene.nodes.items()} == stood


def test_escape_puts_nodes_back(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before, stood = text_of(session), canvas.scene.nodes["blur"].pos()
    hand.press(hand.title("blur"))
    hand.move(hand.title("blur") + QPointF(80, 80))
    assert canvas.scene.nodes["blur"].pos() != stood
    hand.key(Qt.Key.Key_Escape)
    hand.release(hand.title("blur"))
    assert canvas.scene.nodes["blur"].pos() == stood
    assert text_of(session) == before


def test_selection_goes_both_ways(session: Session, canvas: CanvasView, hand: Hand) -> None:
    hand.click(hand.title("blur"))
    assert session.selection == ("blur",)
    hand.click(hand.title("view"), Qt.KeyboardModifier.ShiftModifier)
    assert set(session.selection) == {"blur", "view"}
    session.select("rays")
    assert canvas.scene.chosen() == ["rays"]
    hand.drag(canvas.scene.content().topLeft() - QPointF(30, 30), canvas.scene.content().bottomRight() + QPointF(9, 9))
    assert set(session.selection) == set(session.network.nodes)


def test_copy_and_paste_by_the_clipboard(session: Session, canvas: CanvasView, qtbot: QtBot) -> None:
    session.select("blur", "raycast")
    canvas.copy()
    copied = json.loads(QGuiApplication.clipboard().text())
    assert set(copied["nodes"]) == {"blur", "raycast"}
    before = text_of(session)
    canvas.paste()
    assert set(session.selection) == {"blur_2", "raycast_2"}
    assert session.network.node("raycast_2").inputs["volume"] == ("blur_2.smoothed",)
    away = canvas.scene.nodes["raycast_2"].pos() - canvas.scene.nodes["blur_2"].pos()
    assert away == canvas.scene.nodes["raycast"].pos() - canvas.scene.nodes["blur"].pos()
    session.undo()
    assert text_of(session) == before
    other = Session()
    try:
        window = CanvasView(other)
        qtbot.addWidget(window)
        window.paste()
        assert set(other.network.nodes) == {"blur", "raycast"}
    finally:
        other.close()


def test_paste_of_something_else_is_told(session: Session, canvas: CanvasView) -> None:
    told: list[object] = []
    session.message.connect(told.append)
    before = text_of(session)
    QGuiApplication.clipboard().setText("just words")
    canvas.paste()
    assert told
    assert text_of(session) == before


def test_duplicate_keeps_the_wires_into_it(session: Session, canvas: CanvasView) -> None:
    session.select("raycast", "shade")
    before = text_of(session)
    canvas.duplicate()
    assert session.network.node("raycast_2").inputs == session.network.node("raycast").inputs
    assert session.network.node("shade_2").inputs["image"] == ("raycast_2.image",)
    session.undo()
    assert text_of(session) == before


def test_mute_and_wake(session: Session, canvas: CanvasView, hand: Hand) -> None:
    session.select("blur")
    hand.key(Qt.Key.Key_M)
    assert session.network.node("blur").muted
    assert canvas.scene.nodes["blur"].face.muted
    hand.key(Qt.Key.Key_M)
    assert not session.network.node("blur").muted


def test_rename_in_place(session: Session, canvas: CanvasView, hand: Hand) -> None:
    hand.double_click(hand.title("blur"))
    assert canvas.field is not None
    canvas.field.setText("smooth")  # type: ignore[union-attr]
    QTest.keyClick(canvas.field, Qt.Key.Key_Return)
    assert "smooth" in canvas.scene.nodes
    assert session.network.node("raycast").inputs["volume"] == ("smooth.smoothed",)
    told: list[object] = []
    session.message.connect(told.append)
    canvas.rename(canvas.scene.nodes["smooth"])
    canvas.field.setText("not a name")  # type: ignore[union-attr]
    QTest.keyClick(canvas.field, Qt.Key.Key_Return)
    assert told
    assert "smooth" in session.network.nodes


def test_rename_is_left_by_escape(session: Session, canvas: CanvasView) -> None:
    canvas.rename(canvas.scene.nodes["blur"])
    assert canvas.field is not None
    canvas.field.setText("other")  # type: ignore[union-attr]
    QTest.keyClick(canvas.field, Qt.Key.Key_Escape)
    assert "blur" in session.network.nodes
    assert "other" not in session.network.nodes


def test_groups_open_and_close(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before = text_of(session)
    session.select("raycast", "shade")
    canvas.group()
    assert set(canvas.scene.nodes) == {"volume", "blur", "box", "rays", "group", "view"}
    assert canvas.scene.nodes["group"].face.group
    hand.double_click(hand.middle("group"))
    assert session.level == "group"
    assert set(canvas.scene.nodes) == {"raycast", "shade"}
    assert dict(canvas.scene.nodes["shade"].face.tags) == {"out.composed": "composed"}
    canvas.leave_group()
    assert session.level == ""
    assert session.selection == ("group",)
    canvas.ungroup()
    assert "group" not in canvas.scene.nodes
    session.undo()
    session.undo()
    assert text_of(session) == before


def test_a_group_that_goes_while_it_is_open(session: Session, canvas: CanvasView) -> None:
    session.select("raycast", "shade")
    canvas.group()
    session.enter("group")
    session.undo()
    assert session.level == ""
    assert "raycast" in canvas.scene.nodes


def test_a_frame_takes_along_what_is_in_it(session: Session, canvas: CanvasView, hand: Hand) -> None:
    session.select("blur")
    key = canvas.edits.add_frame("Smoothing")
    canvas.scene.choose(())
    before, stood = text_of(session), canvas.scene.nodes["blur"].pos()
    title = canvas.scene.boxes["frames", key].pos() + QPointF(30, 10)
    hand.drag(title, title + QPointF(0, -60))
    assert canvas.scene.nodes["blur"].pos() == stood + QPointF(0, -60)
    session.undo()
    assert text_of(session) == before
    corner = canvas.scene.boxes["frames", key].rect_in_scene().bottomRight() - QPointF(4, 4)
    width = canvas.scene.boxes["frames", key].rect_in_scene().width()
    hand.drag(corner, corner + QPointF(50, 0))
    assert canvas.scene.boxes["frames", key].rect_in_scene().width() == pytest.approx(width + 50, abs=2)


def test_a_note_is_written_and_deleted(session: Session, canvas: CanvasView) -> None:
    key = canvas.edits.add_box("notes", QRectF(0, -200, 200, 80), "old")
    canvas.rename(canvas.scene.boxes["notes", key])
    canvas.field.setPlainText("Turn the light first.")  # type: ignore[union-attr]
    canvas.field.finish()  # type: ignore[union-attr]
    assert session.network.ui["notes"][key]["text"] == "Turn the light first."
    canvas.scene.choose([canvas.scene.boxes["notes", key]])
    canvas.delete_selection()
    assert "notes" not in session.network.ui
    session.undo()
    assert canvas.scene.boxes["notes", key].text == "Turn the light first."


def test_layout_and_align(session: Session, canvas: CanvasView) -> None:
    canvas.layout_all()
    assert all(place(session, id) is not None for id in session.network.nodes)
    session.select("blur", "box", "view")
    canvas.align("left")
    assert len({canvas.scene.nodes[id].x() for id in ("blur", "box", "view")}) == 1
    canvas.align("columns")
    rects = [canvas.scene.nodes[id].body_in_scene() for id in ("blur", "box", "view")]
    assert not any(a.intersects(b) for a in rects for b in rects if a is not b)


def test_delete_takes_wires_along(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before = text_of(session)
    session.select("raycast")
    hand.key(Qt.Key.Key_Delete)
    assert "raycast" not in session.network.nodes
    assert not any("raycast" in (wire[0].split(".")[0], wire[1]) for wire, _ in canvas.scene.wires)
    session.undo()
    assert text_of(session) == before
    canvas.scene.flush()
    assert "raycast" in canvas.scene.nodes


def test_a_drop_carries_a_processor(session: Session, canvas: CanvasView) -> None:
    mime = QMimeData()
    mime.setData(MIME, b"filter.gradient")
    event = QDropEvent(
        QPointF(300, 600), Qt.DropAction.CopyAction, mime, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    )
    canvas.view.dropEvent(event)
    assert event.isAccepted()
    body = canvas.scene.nodes["gradient"].body_in_scene()
    assert body.contains(canvas.view.mapToScene(QPoint(300, 600)))


def test_nodes_that_are_added_at_one_place_do_not_hide_each_other(canvas: CanvasView) -> None:
    ids = [canvas.edits.add("filter.gradient", QPointF(0, 600)) for _ in range(3)]
    assert len({canvas.scene.nodes[str(id)].pos().toTuple() for id in ids}) == 3


def test_it_follows_what_others_change(session: Session, canvas: CanvasView) -> None:
    session.do(SetUI("blur", "position", [5, 7]))
    assert canvas.scene.nodes["blur"].pos() == QPointF(5, 7)
    session.do(Rename("blur", "soft"))
    session.network.add("source.volume", "other")
    canvas.scene.flush()
    assert {"soft", "other"} <= set(canvas.scene.nodes)
    session.new()
    assert not canvas.scene.nodes
    assert canvas._hint.isVisible()


def test_tooltips_say_what_is_there_or_why_not(session: Session, canvas: CanvasView, hand: Hand, qtbot: QtBot) -> None:
    assert "no open view has asked" in canvas.view.tip_at(hand.port("volume", "volume", True))
    assert "Nothing is connected" in canvas.view.tip_at(hand.port("raycast", "gradient"))
    assert "from volume.volume" in canvas.view.tip_at(hand.port("blur", "volume"))
    report = session.engine.evaluate(session.network, "volume")
    assert report.ok
    value = report.shown["volume"]["volume"]
    assert value.summary() in canvas.view.tip_at(hand.port("volume", "volume", True))
    assert value.summary() in canvas.view.tip_at(hand.port("blur", "volume"))
    qtbot.waitUntil(lambda: canvas.view.tips.preview is not None, timeout=10000)


def test_a_node_says_how_it_stands(session: Session, canvas: CanvasView, qtbot: QtBot) -> None:
    session.do(Set("blur.sigma", 2.0))
    canvas.edits.add("source.volume", QPointF(0, 500))
    canvas.edits.add("filter.gradient", QPointF(300, 500))
    canvas.edits.connect("volume_2.volume", "gradient", "volume")
    session.do(Set("volume_2.path", "nowhere.nii"))
    assert canvas.scene.nodes["blur"].status.state == "dirty"
    with qtbot.waitSignal(session.answered, timeout=20000):
        session.ask("gradient", None)
    assert canvas.scene.nodes["volume_2"].status.state in ("failed", "blocked")
    assert "nowhere.nii" in canvas.scene.nodes["volume_2"].status.text
    assert canvas.scene.nodes["gradient"].status.state == "blocked"
    assert "volume_2" in canvas.scene.nodes["gradient"].status.text


def test_find_goes_through_what_it_found(session: Session, canvas: CanvasView) -> None:
    session.select("raycast", "shade")
    canvas.group()
    canvas.find()
    canvas.finder.field.setText("raycast")
    assert canvas.finder.count.text() == "1 of 1"
    assert session.level == "group"
    assert session.selection == ("group/raycast",)
    canvas.finder.field.setText("nothing has this name")
    assert canvas.finder.count.text() == "none"


def test_zoom_keeps_the_point_below_the_mouse(canvas: CanvasView) -> None:
    here = QPointF(300, 200)
    before = canvas.view.mapToScene(here.toPoint())
    canvas.view.zoom_by(1.4, here)
    after = canvas.view.mapToScene(here.toPoint())
    assert abs(after.x() - before.x()) < 2
    assert abs(after.y() - before.y()) < 2


def test_keys_and_menus_name_methods(canvas: CanvasView) -> None:
    from nodegraph.editor.canvas.menus import ACTIONS, KEYS, menu_for

    assert all(callable(getattr(canvas, name)) for name in ACTIONS)
    assert len(KEYS) == len(ACTIONS)
    items = [None, canvas.scene.nodes["blur"], next(iter(canvas.scene.wires.values()))]
    for item in items:
        menu = menu_for(canvas, item)
        assert menu.actions()
        menu.deleteLater()


def test_a_drag_ends_when_another_level_is_shown(session: Session, canvas: CanvasView, hand: Hand) -> None:
    session.do(Group(["blur"], "inside"))
    canvas.scene.flush()
    hand.press(QPointF(-300, -300))
    hand.move(QPointF(500, 500))
    assert canvas.view.drag is not None
    session.enter("inside")
    assert canvas.view.drag is None
    hand.release(QPointF(500, 500))
