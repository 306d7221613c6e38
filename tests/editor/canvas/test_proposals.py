"""What suggests itself for a node that is dropped among others, and the bar that offers it."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt
from PySide6.QtGui import QDragEnterEvent, QDragLeaveEvent, QDropEvent
from PySide6.QtTest import QTest

from nodegraph.commands import Connect, Remove, Set
from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.canvas.proposals import LinkProposal, WireProposal
from nodegraph.editor.canvas.view import HANDLE, MIME
from nodegraph.editor.session import Session
from nodegraph.variable_commands import Link
from tests.editor.canvas.conftest import Hand, text_of

SHIFT = Qt.KeyboardModifier.ShiftModifier


def right_of(canvas: CanvasView, id: str, y: float = 0.0) -> QPointF:
    """Where a processor is held so that it comes to stand to the right of a node."""
    box = canvas.scene.nodes[id].body_in_scene()
    return QPointF(box.right() + 60, box.top() + y) + HANDLE


@pytest.fixture
def alone(session: Session, canvas: CanvasView) -> CanvasView:
    """Only the volume, the rays and the view are left, without wires."""
    session.do(Remove(["blur", "box", "shade", "raycast"]))
    canvas.scene.flush()
    return canvas


def test_the_nearest_output_that_fits_is_proposed(session: Session, alone: CanvasView) -> None:
    id = alone.view.drop_processor("filter.gaussian_blur", right_of(alone, "volume"))
    assert id is not None
    assert alone.view.proposing.proposals[0] == WireProposal("volume.volume", id, "volume")
    assert not alone.view.proposing.bar.isHidden()
    before = text_of(session)
    alone.accept_proposals()
    assert session.network.node(id).inputs["volume"] == ("volume.volume",)
    assert alone.view.proposing.bar.isHidden()
    session.undo()
    assert text_of(session) == before


def test_far_away_nothing_is_proposed(session: Session, alone: CanvasView) -> None:
    alone.view.drop_processor("filter.gaussian_blur", right_of(alone, "volume", 4000))
    assert alone.view.proposing.proposals == []
    assert alone.view.proposing.bar.isHidden()


def test_outputs_go_to_what_still_needs_them_and_never_round(session: Session, alone: CanvasView) -> None:
    view = alone.scene.nodes["view"].body_in_scene()
    id = alone.view.drop_processor("image.background", QPointF(view.left() - 220, view.top()) + HANDLE)
    assert id is not None
    proposals = alone.view.proposing.proposals
    assert WireProposal(f"{id}.composed", "view", "image") in proposals
    session.do(Connect("view.shown", f"{id}.image"))
    alone.scene.flush()
    assert WireProposal(f"{id}.composed", "view", "image") not in alone.view.proposing.proposals


def test_cameras_are_shared(session: Session, canvas: CanvasView) -> None:
    id = canvas.view.drop_processor("render.raycast", QPointF(0, 3000))
    assert id is not None
    links = [one for one in canvas.view.proposing.proposals if isinstance(one, LinkProposal)]
    camera = next(one for one in links if one.parameter == f"{id}.camera")
    assert camera.fresh
    table = next(one for one in links if one.parameter == f"{id}.transfer_function")
    assert table.giver == "raycast.transfer_function"
    before = text_of(session)
    canvas.accept_proposals()
    node = session.network.node(id)
    giver, _, name = camera.giver.rpartition(".")
    assert node.links["camera"] == session.network.node(giver).links[name]
    assert node.links["transfer_function"] == session.network.node("raycast").links["transfer_function"]
    session.undo()
    assert text_of(session) == before


def test_a_variable_that_others_follow_comes_first(session: Session, canvas: CanvasView) -> None:
    session.do(Link("rays.camera", "eye"))
    session.do(Link("blur.sigma", "softness"))
    one = canvas.view.drop_processor("filter.gaussian_blur", QPointF(0, 3000))
    assert canvas.view.proposing.proposals == [LinkProposal(f"{one}.sigma", "softness", "blur.sigma")]
    two = canvas.view.drop_processor("render.raycast", QPointF(0, 4000))
    assert LinkProposal(f"{two}.camera", "eye", "rays.camera") in canvas.view.proposing.proposals


def test_what_is_not_ticked_is_left_out(session: Session, alone: CanvasView, hand: Hand) -> None:
    id = alone.view.drop_processor("render.raycast", right_of(alone, "volume"))
    assert id is not None
    bar = alone.view.proposing.bar
    assert bar.chips[0].text() == f"volume.volume \u2192 {id}.volume"
    bar.chips[0].setChecked(False)
    QTest.mouseClick(bar.accept, Qt.MouseButton.LeftButton)
    assert not session.network.node(id).inputs.get("volume")
    assert "camera" in session.network.node(id).links


def test_escape_and_a_change_end_it(session: Session, alone: CanvasView, hand: Hand) -> None:
    id = alone.view.drop_processor("filter.gaussian_blur", right_of(alone, "volume"))
    lines = len(alone.scene.items())
    hand.key(Qt.Key.Key_Escape)
    assert alone.view.proposing.bar.isHidden()
    assert len(alone.scene.items()) < lines
    alone.view.proposing.offer(str(id))
    session.do(Set(f"{id}.sigma", 3.0))
    assert not alone.view.proposing.bar.isHidden()
    session.do(Connect("volume.volume", f"{id}.volume"))
    alone.scene.flush()
    assert alone.view.proposing.bar.isHidden()
    alone.view.proposing.offer(str(id))
    session.undo()
    session.undo()
    session.undo()
    alone.scene.flush()
    assert id not in session.network
    assert alone.view.proposing.bar.isHidden()


def test_a_drag_shows_wires_and_shift_draws_them(session: Session, alone: CanvasView) -> None:
    view = alone.view
    data = QMimeData()
    data.setData(MIME, b"filter.gaussian_blur")
    where = view.mapFromScene(right_of(alone, "volume"))
    count, before = len(alone.scene.items()), text_of(session)
    action, left, none = Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    view.dragEnterEvent(QDragEnterEvent(where, action, data, left, none))
    assert len(alone.scene.items()) == count + 1
    view.dragLeaveEvent(QDragLeaveEvent())
    assert len(alone.scene.items()) == count
    assert text_of(session) == before
    view.dragEnterEvent(QDragEnterEvent(where, action, data, left, SHIFT))
    view.dropEvent(QDropEvent(QPointF(where), action, data, left, SHIFT, QEvent.Type.Drop))
    assert session.network.node("gaussian_blur").inputs["volume"] == ("volume.volume",)
    assert view.proposing.bar.isHidden()
    session.undo()
    assert text_of(session) == before


def test_over_a_wire_the_wire_is_lit_and_takes_it(session: Session, canvas: CanvasView) -> None:
    data = QMimeData()
    data.setData(MIME, b"filter.gaussian_blur")
    wire = canvas.scene.wires[("volume.volume", "box", "volume"), 0]
    where = canvas.view.mapFromScene(wire.path().pointAtPercent(0.5) + QPointF(0, -10))
    action, left, none = Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    canvas.view.dragEnterEvent(QDragEnterEvent(where, action, data, left, none))
    lit = [item.wire for item in canvas.scene.wires.values() if item.marked]
    assert len(lit) == 1
    canvas.view.dropEvent(QDropEvent(QPointF(where), action, data, left, none, QEvent.Type.Drop))
    assert not any(item.marked for item in canvas.scene.wires.values())
    assert session.network.node("gaussian_blur").inputs["volume"] == (lit[0][0],)


def test_the_bar_stays_at_the_lower_edge(session: Session, alone: CanvasView) -> None:
    alone.view.drop_processor("render.raycast", right_of(alone, "volume"))
    bar = alone.view.proposing.bar
    alone.resize(900, 500)
    assert bar.geometry().bottom() < alone.view.height()
    assert alone.view.rect().contains(bar.geometry().center() + QPoint(0, 0))
