"""Bends of wires: added, dragged, taken out; they follow their wire through everything that renames or cuts it."""

from __future__ import annotations

import json

from PySide6.QtCore import QPointF, Qt

from nodegraph import Network, workspace
from nodegraph.bends import bends_of
from nodegraph.clipboard import Paste, copy
from nodegraph.commands import Disconnect, Rename
from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.canvas.faces import as_position
from nodegraph.editor.canvas.wires import WireItem
from nodegraph.editor.session import Session
from nodegraph.group_commands import Group, Ungroup
from tests.editor.canvas.conftest import Hand, text_of

ALT = Qt.KeyboardModifier.AltModifier
WIRE = ("blur.smoothed", "raycast", "volume")


def wire(canvas: CanvasView) -> WireItem:
    return canvas.scene.wires[WIRE, 0]


def middle(canvas: CanvasView) -> QPointF:
    return wire(canvas).path().pointAtPercent(0.5)


def stored(session: Session) -> list[tuple[float, float]]:
    return bends_of(session.network.node("raycast"), "volume", "blur.smoothed")


def test_a_double_click_bends_a_wire_and_another_on_the_dot_takes_it_back(
    session: Session, canvas: CanvasView, hand: Hand
) -> None:
    before = text_of(session)
    hand.double_click(middle(canvas))
    assert len(stored(session)) == 1
    dot = wire(canvas).dots[0]
    assert hand.pixel(dot.pos()) == hand.pixel(QPointF(*stored(session)[0]))
    hand.drag(dot.pos(), dot.pos() + QPointF(0, -40))
    assert wire(canvas).dots[0].y() == stored(session)[0][1]
    assert wire(canvas).touches(wire(canvas).dots[0].sceneBoundingRect())
    moved = stored(session)
    hand.double_click(QPointF(*moved[0]))
    assert stored(session) == []
    assert wire(canvas).dots == []
    for bends in (moved, None, []):  # three steps: bend, move, straighten
        session.undo()
        assert bends is None or stored(session) == bends
    assert text_of(session) == before


def test_an_alt_drag_bends_in_one_step(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before = text_of(session)
    start = middle(canvas)
    hand.drag(start, start + QPointF(0, 120), ALT)
    (place,) = stored(session)
    assert abs(place[1] - start.y() - 120) < 4
    hand.press(wire(canvas).path().pointAtPercent(0.8), ALT)
    hand.key(Qt.Key.Key_Escape)
    hand.release(middle(canvas))
    assert len(wire(canvas).dots) == 1
    session.undo()
    assert text_of(session) == before
    assert wire(canvas).dots == []


def test_a_second_bend_goes_where_it_is_on_the_wire(session: Session, canvas: CanvasView, hand: Hand) -> None:
    canvas.edits.add_bend(WIRE, middle(canvas))
    first = wire(canvas).dots[0].pos()
    canvas.edits.add_bend(WIRE, wire(canvas).path().pointAtPercent(0.1))
    canvas.edits.add_bend(WIRE, wire(canvas).path().pointAtPercent(0.95))
    assert wire(canvas).dots[1].pos() == first or stored(session)[1] == (round(first.x()), round(first.y()))
    canvas.scene.choose([wire(canvas).dots[1]])
    hand.key(Qt.Key.Key_Delete)
    assert len(stored(session)) == 2
    hand.key(Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
    canvas.scene.choose([wire(canvas)])
    canvas.straighten()
    assert stored(session) == []


def test_bends_move_with_both_ends(session: Session, canvas: CanvasView, hand: Hand) -> None:
    canvas.edits.add_bend(WIRE, middle(canvas))
    (was,) = stored(session)
    canvas.scene.choose([canvas.scene.nodes["blur"]])
    hand.drag(hand.title("blur"), hand.title("blur") + QPointF(0, 60))
    assert stored(session) == [was]
    canvas.scene.choose([canvas.scene.nodes["blur"], canvas.scene.nodes["raycast"]])
    hand.drag(hand.title("blur"), hand.title("blur") + QPointF(0, 60))
    (now,) = stored(session)
    assert abs(now[1] - was[1] - 60) < 4
    hand.key(Qt.Key.Key_Down)
    assert stored(session)[0][1] == now[1] + 20
    session.undo()
    session.undo()
    assert stored(session) == [was]
    assert wire(canvas).dots[0].y() == was[1]


def test_a_band_takes_bends_and_what_is_far_is_shown(session: Session, canvas: CanvasView, hand: Hand) -> None:
    canvas.edits.bend(WIRE, [middle(canvas) + QPointF(0, 600)])
    canvas.scene.choose(())
    canvas.fit()
    place = wire(canvas).dots[0].pos()
    assert canvas.view.seen().contains(place)
    hand.drag(place - QPointF(30, 30), place + QPointF(30, 30))
    assert wire(canvas).dots[0].chosen
    assert session.selection == ()
    hand.key(Qt.Key.Key_Delete)
    assert stored(session) == []


def test_a_node_put_into_a_bent_wire_leaves_the_bends_on_their_sides(
    session: Session, canvas: CanvasView, hand: Hand
) -> None:
    start, end = hand.port("blur", "smoothed", True), hand.port("raycast", "volume")
    canvas.edits.bend(WIRE, [start + QPointF(20, 200), end + QPointF(-20, 200)])
    canvas.edits.add("filter.gaussian_blur", wire(canvas).path().pointAtPercent(0.5) - QPointF(70, 40))
    assert canvas.edits.insert("gaussian_blur", WIRE)
    level = session.network
    assert len(bends_of(level.node("gaussian_blur"), "volume", "blur.smoothed")) == 1
    assert len(bends_of(level.node("raycast"), "volume", "gaussian_blur.smoothed")) == 1


def test_bends_follow_their_wire(session: Session, canvas: CanvasView) -> None:
    network = session.network
    revision = network.revision
    canvas.edits.bend(WIRE, [QPointF(10, 20), QPointF(30, 40)])
    assert network.revision == revision  # nothing is computed for it
    before = text_of(session)
    session.do(Rename("blur", "soft"))
    assert bends_of(network.node("raycast"), "volume", "soft.smoothed") == [(10, 20), (30, 40)]
    session.do(Group(["soft"]))
    canvas.scene.flush()
    assert bends_of(network.node("raycast"), "volume", "group.smoothed") == [(10, 20), (30, 40)]
    assert len(canvas.scene.wires[("group.smoothed", "raycast", "volume"), 0].dots) == 2
    session.do(Ungroup("group"))
    assert bends_of(network.node("raycast"), "volume", "soft.smoothed") == [(10, 20), (30, 40)]
    for _ in range(3):
        session.undo()
    assert text_of(session) == before
    session.do(Disconnect("raycast.volume"))
    assert "bends" not in network.node("raycast").ui
    session.undo()
    assert text_of(session) == before
    assert workspace.dumps(workspace.loads(before)) == before


def test_a_copy_bends_like_its_original(session: Session, canvas: CanvasView) -> None:
    canvas.edits.bend(WIRE, [QPointF(10, 20)])
    canvas.scene.choose([canvas.scene.nodes["blur"], canvas.scene.nodes["raycast"]])
    ids = canvas.duplicate() or canvas.scene.chosen()
    soft, cast = (session.network.node(id) for id in ids)
    assert bends_of(cast, "volume", f"{soft.id}.smoothed") == [(40, 50)]
    # Without its source the wire does not come along, and neither do its bends.
    other = Network()
    other.history.do(Paste(json.dumps(copy(session.network, ["raycast"]))))
    assert "bends" not in other.node("raycast").ui
    assert bends_of(session.network.node("raycast"), "volume", "blur.smoothed") == [(10, 20)]


def test_what_is_no_place_is_no_bend(session: Session, canvas: CanvasView) -> None:
    node = session.network.node("raycast")
    for nonsense in (5, [], {"volume": 3}, {"volume": {"blur.smoothed": "here"}}, {"volume": {"blur.smoothed": [[1]]}}):
        node.ui["bends"] = nonsense
        canvas.scene.sync()
        assert wire(canvas).dots == []


def test_bends_in_a_file_that_are_no_places_are_passed_over() -> None:
    network = Network()
    network.add("filter.gradient", "gradient")
    node = network.node("gradient")
    node.ui["bends"] = {"volume": {"ct.volume": [[10**400, 0], [0, -(10**400)], [1e300, 0], ["1", 2], [1, 2], 5]}}
    assert bends_of(node, "volume", "ct.volume") == [(1.0, 2.0)]
    assert as_position([10**400, 0]) is None
    assert as_position([1, 2]) == (1.0, 2.0)
