"""The canvas by mouse and keys alone, as somebody uses it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QContextMenuEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu
from pytestqt.qtbot import QtBot

from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.canvas.choosers import NameField, NoteField
from nodegraph.editor.session import Session
from nodegraph.variable_commands import Link
from tests.editor.canvas.conftest import Hand, text_of

CTRL, ALT, SHIFT = (
    Qt.KeyboardModifier.ControlModifier,
    Qt.KeyboardModifier.AltModifier,
    Qt.KeyboardModifier.ShiftModifier,
)
LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def other(qtbot: QtBot) -> Iterator[Hand]:
    """A second window with an empty network."""
    session = Session()
    canvas = CanvasView(session)
    qtbot.addWidget(canvas)
    canvas.resize(700, 500)
    canvas.show()
    yield Hand(canvas)
    session.close()


def band(hand: Hand, *ids: str) -> None:
    """Select nodes with a rubber band around them."""
    area = QRectF()
    for id in ids:
        area = area.united(hand.canvas.scene.nodes[id].body_in_scene())
    hand.drag(area.topLeft() - QPointF(12, 12), area.bottomRight() + QPointF(12, 12))


def context_menu(hand: Hand, point: QPointF) -> QMenu:
    pixel = hand.pixel(point)
    event = QContextMenuEvent(QContextMenuEvent.Reason.Mouse, pixel, hand.viewport.mapToGlobal(pixel))
    QApplication.sendEvent(hand.viewport, event)
    assert hand.canvas.menu is not None
    return hand.canvas.menu


def trigger(menu: QMenu, text: str) -> None:
    """Choose an entry, also of a submenu."""
    for action in menu.actions():
        below = action.menu()
        if action.text() == text:
            action.trigger()
            menu.close()
            return
        if isinstance(below, QMenu) and any(one.text() == text for one in below.actions()):
            trigger(below, text)
            menu.close()
            return
    raise AssertionError(f"no {text!r} in {[action.text() for action in menu.actions()]}")


def test_nodes_are_copied_from_one_window_to_another(
    session: Session, canvas: CanvasView, hand: Hand, other: Hand
) -> None:
    session.do(Link("raycast.camera", "eye"))
    band(hand, "blur")
    hand.click(hand.title("raycast"), SHIFT)
    assert set(session.selection) == {"blur", "raycast"}
    hand.key(Qt.Key.Key_C, CTRL)
    other.key(Qt.Key.Key_V, CTRL)
    there = other.canvas.session.network
    assert set(there.nodes) == {"blur", "raycast"}
    assert there.node("raycast").inputs == {"volume": ("blur.smoothed",)}
    assert there.node("raycast").links["camera"] == "eye"
    other.key(Qt.Key.Key_V, CTRL)
    assert set(there.nodes) == {"blur", "raycast", "blur_2", "raycast_2"}
    other.canvas.session.undo()
    other.canvas.session.undo()
    assert not there.nodes
    assert not there.variables


def test_cut_and_paste_in_one_window(session: Session, canvas: CanvasView, hand: Hand) -> None:
    hand.click(hand.title("shade"))
    hand.key(Qt.Key.Key_X, CTRL)
    assert "shade" not in session.network
    hand.key(Qt.Key.Key_V, CTRL)
    assert session.selection == ("shade",)


def test_duplicate_keeps_wires_and_links(session: Session, canvas: CanvasView, hand: Hand) -> None:
    session.do(Link("raycast.camera", "eye"))
    before = text_of(session)
    hand.click(hand.title("raycast"))
    hand.key(Qt.Key.Key_D, CTRL)
    copy = session.network.node("raycast_2")
    assert copy.inputs == session.network.node("raycast").inputs
    assert copy.links == {"camera": "eye"}
    assert session.selection == ("raycast_2",)
    session.undo()
    assert text_of(session) == before


def test_mute_by_key_and_by_menu(session: Session, canvas: CanvasView, hand: Hand) -> None:
    hand.click(hand.title("blur"))
    hand.key(Qt.Key.Key_M)
    assert session.network.node("blur").muted
    canvas.scene.flush()
    assert canvas.scene.nodes["blur"].status.text == "data passes it by"
    trigger(context_menu(hand, hand.title("blur")), "Mute or unmute")
    assert not session.network.node("blur").muted


def test_a_frame_is_titled_coloured_moved_and_taken_away(
    session: Session, canvas: CanvasView, hand: Hand, qtbot: QtBot
) -> None:
    before = text_of(session)
    band(hand, "box", "rays")
    hand.key(Qt.Key.Key_F, CTRL | ALT)
    field = canvas.view.viewport().findChild(NameField)
    assert field is not None
    field.clear()
    QTest.keyClicks(field, "Rays")
    QTest.keyClick(field, Qt.Key.Key_Return)
    frame = canvas.scene.boxes["frames", "frame"]
    assert frame.text == "Rays"
    title = frame.pos() + QPointF(20, 10)
    trigger(context_menu(hand, title), "Blue")
    assert frame.color == "#4f9bd9"
    was = canvas.scene.nodes["box"].pos()
    hand.drag(title, title + QPointF(0, 40))
    assert abs(canvas.scene.nodes["box"].y() - was.y() - 40) < 3
    corner = frame.rect_in_scene().bottomRight() - QPointF(5, 5)
    wide = frame.rect_in_scene().width()
    hand.drag(corner, corner + QPointF(60, 0))
    assert abs(frame.rect_in_scene().width() - wide - 60) < 3
    hand.click(frame.pos() + QPointF(20, 10))
    hand.key(Qt.Key.Key_Delete)
    assert not canvas.scene.boxes
    assert "box" in session.network
    while session.history.undo_name:
        session.undo()
    assert text_of(session) == before


def test_a_note_is_typed(session: Session, canvas: CanvasView, hand: Hand) -> None:
    hand.move(hand.middle("view") + QPointF(0, 200))
    hand.key(Qt.Key.Key_N)
    field = canvas.view.viewport().findChild(NoteField)
    assert field is not None
    QTest.keyClicks(field, "Turn the light first")
    QTest.keyClick(field, Qt.Key.Key_Return, CTRL)
    note = canvas.scene.boxes["notes", "note"]
    assert note.text == "Turn the light first"
    hand.double_click(note.rect_in_scene().center())
    field = next(one for one in canvas.view.viewport().findChildren(NoteField) if not one.isHidden())
    QTest.keyClicks(field, "Anew")
    QTest.keyClick(field, Qt.Key.Key_Escape)
    assert note.text == "Turn the light first"


def test_nodes_are_aligned_by_the_menu(session: Session, canvas: CanvasView, hand: Hand) -> None:
    band(hand, "blur", "box")
    trigger(context_menu(hand, hand.title("blur")), "Left edges")
    assert canvas.scene.nodes["blur"].x() == canvas.scene.nodes["box"].x()
    assert session.history.undo_name == "align"


def test_zoomed_in_the_minimap_leads_and_fit_shows_all(
    session: Session, canvas: CanvasView, hand: Hand, qtbot: QtBot
) -> None:
    canvas.view.zoom_by(2.5)
    assert canvas.minimap.isVisible()
    seen = canvas.view.seen().center()
    QTest.mouseClick(canvas.minimap, LEFT, pos=QPoint(150, 60))
    assert canvas.view.seen().center() != seen
    hand.key(Qt.Key.Key_M, CTRL)
    assert not canvas.minimap.isVisible()
    hand.key(Qt.Key.Key_M, CTRL)
    canvas.scene.choose(())
    hand.key(Qt.Key.Key_F)
    assert canvas.view.seen().contains(canvas.scene.content())


def test_find_by_keys(session: Session, canvas: CanvasView, hand: Hand) -> None:
    hand.key(Qt.Key.Key_F, CTRL)
    QTest.keyClicks(canvas.finder.field, "ray")
    assert canvas.finder.count.text() == "1 of 2"
    first = session.selection
    QTest.keyClick(canvas.finder.field, Qt.Key.Key_Return)
    assert session.selection != first
    assert {*first, *session.selection} == {"rays", "raycast"}
    QTest.keyClick(canvas.finder.field, Qt.Key.Key_Escape)
    assert canvas.finder.isHidden()
    assert not any(item.faded for item in canvas.scene.nodes.values())


def test_a_processor_is_added_by_keys_alone(session: Session, canvas: CanvasView, hand: Hand) -> None:
    hand.key(Qt.Key.Key_Tab)
    assert canvas.chooser is not None
    QTest.keyClicks(canvas.chooser.field, "gaussian")
    QTest.keyClick(canvas.chooser.field, Qt.Key.Key_Return)
    assert "gaussian_blur" in session.network
    assert session.selection == ("gaussian_blur",)
    hand.key(Qt.Key.Key_Delete)
    assert "gaussian_blur" not in session.network


def test_a_group_is_made_entered_and_left_by_keys(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before = text_of(session)
    band(hand, "shade", "view")
    hand.key(Qt.Key.Key_G, CTRL)
    assert "group" in session.network
    hand.key(Qt.Key.Key_Return)
    assert session.level == "group"
    assert set(canvas.scene.nodes) == {"shade", "view"}
    hand.key(Qt.Key.Key_Backspace)
    assert session.level == ""
    assert session.selection == ("group",)
    hand.key(Qt.Key.Key_G, CTRL | SHIFT)
    assert "group" not in session.network
    session.undo()
    session.undo()
    assert text_of(session) == before


def test_several_are_pulled_out_by_a_key(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before = text_of(session)
    canvas.scene.choose([canvas.scene.nodes["blur"], canvas.scene.nodes["shade"]])
    hand.key(Qt.Key.Key_X, SHIFT)
    assert session.network.node("raycast").inputs["volume"] == ("volume.volume",)
    assert session.network.node("view").inputs["image"] == ("raycast.image",)
    session.undo()
    assert text_of(session) == before
