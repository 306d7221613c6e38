"""Wires by mouse: drawn, led elsewhere, taken out; nodes put into wires and pulled out."""

from __future__ import annotations

from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest

from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.session import Session
from tests.editor.canvas.conftest import Hand, text_of


def sources(session: Session, id: str, name: str) -> tuple[str, ...]:
    return session.network.node(id).inputs.get(name, ())


def test_a_drag_from_an_output_to_an_input_wires(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before = text_of(session)
    hand.drag(hand.port("volume", "volume", True), hand.port("raycast", "gradient"))
    assert sources(session, "raycast", "gradient") == ("volume.volume",)
    # A single input gives up the wire that it has.
    hand.drag(hand.port("volume", "volume", True), hand.port("raycast", "volume"))
    assert sources(session, "raycast", "volume") == ("volume.volume",)
    session.undo()
    session.undo()
    assert text_of(session) == before


def test_a_drag_back_from_an_empty_input_wires(session: Session, canvas: CanvasView, hand: Hand) -> None:
    canvas.edits.add("filter.gaussian_blur", QPointF(0, 400))
    canvas.fit()
    canvas.scene.choose(())
    canvas.fit()
    hand.drag(hand.port("gaussian_blur", "volume"), hand.port("volume", "volume", True))
    assert sources(session, "gaussian_blur", "volume") == ("volume.volume",)


def test_only_legal_targets_are_lit_and_taken(session: Session, canvas: CanvasView, hand: Hand) -> None:
    start = hand.port("blur", "smoothed", True)
    hand.press(start)
    hand.move(start + QPointF(30, 30))
    lit = {(id, name) for id, item in canvas.scene.nodes.items() for _, name in item.lit or ()}
    assert ("raycast", "volume") in lit
    assert ("blur", "volume") not in lit  # a cycle
    assert ("view", "image") not in lit  # another type
    assert canvas.scene.nodes["view"].faded
    before = text_of(session)
    hand.release(hand.port("view", "image"))
    assert text_of(session) == before
    assert all(item.lit is None and not item.faded for item in canvas.scene.nodes.values())


def test_escape_ends_a_wire(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before, count = text_of(session), len(canvas.scene.items())
    hand.press(hand.port("volume", "volume", True))
    hand.move(hand.middle("raycast"))
    hand.key(Qt.Key.Key_Escape)
    hand.release(hand.middle("raycast"))
    assert text_of(session) == before
    assert len(canvas.scene.items()) == count


def test_the_end_of_a_wire_is_led_elsewhere_in_one_step(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before = text_of(session)
    hand.drag(hand.port("box", "volume"), hand.port("raycast", "volume"))
    assert sources(session, "box", "volume") == ()
    assert sources(session, "raycast", "volume") == ("volume.volume",)
    session.undo()
    assert text_of(session) == before


def test_the_end_of_a_wire_dropped_on_nothing_takes_it_out(session: Session, canvas: CanvasView, hand: Hand) -> None:
    hand.drag(hand.port("box", "volume"), hand.port("box", "volume") + QPointF(-20, 120))
    assert sources(session, "box", "volume") == ()
    assert canvas.chooser is None


def test_a_wire_dropped_on_nothing_offers_what_fits(session: Session, canvas: CanvasView, hand: Hand) -> None:
    before = text_of(session)
    start = hand.port("volume", "volume", True)
    hand.drag(start, start + QPointF(60, 200))
    assert canvas.chooser is not None
    keys = canvas.chooser.shown()
    assert "filter.gaussian_blur.volume" in keys
    assert not any(key.startswith(("image.", "source.")) for key in keys)
    canvas.chooser.field.setText("gauss")
    assert canvas.chooser.shown() == ["filter.gaussian_blur.volume"]
    QTest.keyClick(canvas.chooser.field, Qt.Key.Key_Return)
    assert sources(session, "gaussian_blur", "volume") == ("volume.volume",)
    session.undo()
    assert text_of(session) == before


def test_a_wire_on_the_body_of_a_node_takes_the_input_that_fits(
    session: Session, canvas: CanvasView, hand: Hand
) -> None:
    canvas.edits.add("filter.gaussian_blur", QPointF(0, 400))
    canvas.scene.choose(())
    canvas.fit()
    hand.drag(hand.port("volume", "volume", True), hand.title("gaussian_blur"))
    assert sources(session, "gaussian_blur", "volume") == ("volume.volume",)


def test_a_node_dropped_on_a_wire_goes_into_it_and_one_undo_takes_it_back(
    session: Session, canvas: CanvasView, hand: Hand
) -> None:
    canvas.edits.add("filter.gaussian_blur", QPointF(0, 500))
    canvas.scene.choose(())
    canvas.fit()
    before = text_of(session)
    wire = next(item for item in canvas.scene.wires.values() if item.wire == ("blur.smoothed", "raycast", "volume"))
    target = wire.path().pointAtPercent(0.5)
    grip = hand.title("gaussian_blur")
    away = canvas.scene.nodes["gaussian_blur"].body_in_scene().center() - grip
    hand.drag(grip, target - away)
    assert sources(session, "gaussian_blur", "volume") == ("blur.smoothed",)
    assert sources(session, "raycast", "volume") == ("gaussian_blur.smoothed",)
    session.undo()
    assert text_of(session) == before


def test_alt_drag_pulls_a_node_out(session: Session, canvas: CanvasView, hand: Hand) -> None:
    hand.drag(hand.title("blur"), hand.title("blur") + QPointF(0, -160), Qt.KeyboardModifier.AltModifier)
    assert sources(session, "blur", "volume") == ()
    assert sources(session, "raycast", "volume") == ("volume.volume",)


def test_pulling_out_is_one_step_and_a_click_with_alt_pulls_nothing(
    session: Session, canvas: CanvasView, hand: Hand
) -> None:
    before = text_of(session)
    hand.click(hand.title("blur"), Qt.KeyboardModifier.AltModifier)
    assert text_of(session) == before
    hand.press(hand.title("blur"), Qt.KeyboardModifier.AltModifier)
    hand.move(hand.title("blur") + QPointF(0, -160))
    assert canvas.scene.wires[("blur.smoothed", "raycast", "volume"), 0].faded
    hand.key(Qt.Key.Key_Escape)
    hand.release(hand.title("blur"))
    assert text_of(session) == before
    assert not any(item.faded for item in canvas.scene.wires.values())
    hand.drag(hand.title("blur"), hand.title("blur") + QPointF(0, -160), Qt.KeyboardModifier.AltModifier)
    assert sources(session, "raycast", "volume") == ("volume.volume",)
    session.undo()
    assert text_of(session) == before


def test_a_node_is_pulled_from_one_wire_into_another(session: Session, canvas: CanvasView, hand: Hand) -> None:
    wire = canvas.scene.wires[("volume.volume", "box", "volume"), 0]
    target = wire.path().pointAtPercent(0.5)
    grip = hand.title("blur")
    away = canvas.scene.nodes["blur"].body_in_scene().center() - grip
    hand.drag(grip, target - away, Qt.KeyboardModifier.AltModifier)
    assert sources(session, "raycast", "volume") == ("volume.volume",)
    assert sources(session, "box", "volume") == ("blur.smoothed",)


def test_a_selected_wire_is_deleted(session: Session, canvas: CanvasView, hand: Hand) -> None:
    wire = next(item for item in canvas.scene.wires.values() if item.wire[1] == "box")
    hand.click(wire.path().pointAtPercent(0.5))
    hand.key(Qt.Key.Key_Delete)
    assert sources(session, "box", "volume") == ()


def test_a_drop_from_the_palette_on_a_wire_inserts(session: Session, canvas: CanvasView) -> None:
    before = text_of(session)
    wire = next(item for item in canvas.scene.wires.values() if item.wire == ("blur.smoothed", "raycast", "volume"))
    id = canvas.view.drop_processor("filter.gaussian_blur", wire.path().pointAtPercent(0.5))
    assert id == "gaussian_blur"
    assert sources(session, "raycast", "volume") == ("gaussian_blur.smoothed",)
    session.undo()
    assert text_of(session) == before


def test_a_drop_of_an_unknown_processor_is_told(session: Session, canvas: CanvasView) -> None:
    told: list[object] = []
    session.message.connect(told.append)
    before = text_of(session)
    assert canvas.view.drop_processor("no.such", QPointF(0, 0)) is None
    assert told
    assert text_of(session) == before
