"""Bells: keys that follow them within a bound, what is remembered of them, and dragging them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt

from nodegraph import workspace
from nodegraph.data import TransferFunction
from nodegraph.editor.parameters.transfer_function import bells, grips, remembered
from nodegraph.editor.parameters.transfer_function.bells import Bell, Shape, compose
from nodegraph.editor.parameters.transfer_function.grips import Grip

LEFT = Qt.MouseButton.LeftButton
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
KEYS = TransferFunction([(0.0, RED, 0.0), (90.0, GREEN, 0.3), (90.0, BLUE, 0.1), (200.0, RED, 0.6)], 2.0)


# -- the keys that are written ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("base", "bumps"),
    [
        (TransferFunction(), (Bell(100.0, 20.0, 0.5, RED),)),
        (TransferFunction(), (Bell(100.0, 20.0, 1e-4, RED), Bell(110.0, 3.0, 0.9, GREEN))),
        (TransferFunction([(50.0, BLUE, 0.0), (150.0, BLUE, 0.0)]), (Bell(1e5, 1e-2, 0.99, GREEN),)),
        (KEYS, (Bell(100.0, 20.0, 0.5, BLUE), Bell(130.0, 15.0, 0.2, GREEN), Bell(-300.0, 40.0, 0.7, RED))),
    ],
)
def test_keys_follow_bells_within_the_bound(base: TransferFunction, bumps: tuple[Bell, ...]) -> None:
    function = compose(base, bumps)
    x = np.concatenate([np.linspace(b.low - b.width, b.high + b.width, 4001) for b in bumps])
    made, flat = function.evaluate(x), base.evaluate(x)
    peaks = [float(base.extinction(bell.opacity)) for bell in bumps]
    up = [p * np.exp(-0.5 * ((x - b.center) / b.width) ** 2) for p, b in zip(peaks, bumps, strict=True)]
    extinction = flat[:, 3] + sum(up)
    shone = flat[:, :3] * flat[:, 3:] + sum(u[:, None] * np.array(b.color) for u, b in zip(up, bumps, strict=True))
    allowed = bells.TOLERANCE * max(peaks) * 1.05  # colours are written to six digits
    assert np.abs(made[:, 3] - extinction).max() <= allowed
    assert np.abs(made[:, :3] * made[:, 3:] - shone).max() <= allowed
    assert function.reference_length == base.reference_length


def test_few_keys_and_nothing_beyond_the_ends() -> None:
    bell = Bell(100.0, 20.0, 0.5, RED)
    function = compose(TransferFunction(), (bell,))
    assert 20 < len(function.keys) < 70
    assert function.domain == (bell.low, bell.high)
    assert not function.evaluate([bell.low, bell.high])[:, 3].any(), "what is beyond can be skipped"
    assert function.evaluate([100.0])[0, 3] == pytest.approx(float(function.extinction(0.5))), "the peak is exact"
    assert compose(KEYS, ()) is KEYS


def test_steps_of_the_keys_stay() -> None:
    function = compose(KEYS, (Bell(100.0, 20.0, 0.5, BLUE),))
    step = [key for key in function.keys if key.value == 90.0]
    assert len(step) == 2
    assert step[0].opacity > step[1].opacity


def test_shapes_survive_json() -> None:
    shape = Shape(KEYS, (Bell(100.0, 20.0, 0.5, BLUE),))
    assert Shape.from_json(shape.to_json()) == shape


# -- the mouse and the document -----------------------------------------------------------------------------------


def test_a_bell_is_added_dragged_and_deleted(
    field: Any, session: Any, qtbot: Any, at: Any, table: Any, drag: Any
) -> None:
    canvas, before = field.canvas, table()
    qtbot.mouseClick(field.bell, LEFT)
    assert len(canvas.shape.bells) == 1
    assert canvas.current == grips.bell(0)
    assert table() == canvas.shape.function != before
    assert canvas.shape.base == before, "the keys stay what they were"
    canvas.snaps = False
    steps = len(session.history._done)
    drag(canvas.plot.at(grips.bell(0)).toPoint(), at(600.0, 0.7), at(700.0, 0.8))
    assert canvas.shape.bells[0].center == pytest.approx(700.0, abs=5.0)
    assert canvas.shape.bells[0].opacity == pytest.approx(0.8, abs=0.02)
    width = canvas.shape.bells[0].width
    right = canvas.plot.at(Grip("right", 0))
    drag(right.toPoint(), (right + QPointF(20.0, 0.0)).toPoint())
    assert canvas.shape.bells[0].width == pytest.approx(width + canvas.plot.value(20.0) - canvas.plot.value(0.0), abs=3)
    assert len(session.history._done) == steps + 2, "one step for each drag"
    session.undo()
    assert canvas.shape.bells[0].width == width, "undo brings the bell back, and not its keys alone"
    assert table() == canvas.shape.function
    qtbot.keyClick(canvas, Qt.Key.Key_Delete)
    assert table() == before
    assert remembered.KEY not in session.network.node("all").ui
    session.undo()
    assert canvas.shape.bells[0].width == width
    assert table() == canvas.shape.function


def test_numbers_and_colour_of_a_bell(field: Any, session: Any, qtbot: Any, at: Any) -> None:
    canvas = field.canvas
    canvas.setFocus()
    qtbot.keyClick(canvas, Qt.Key.Key_B)
    for entry, text in ((field.row.value, "400"), (field.row.width_entry, "33"), (field.row.opacity, "0.25")):
        assert entry.isVisible()
        entry.setFocus()
        entry.selectAll()
        qtbot.keyClicks(entry, text)
        qtbot.keyClick(entry, Qt.Key.Key_Return)
    assert canvas.shape.bells[0][:3] == (400.0, 33.0, 0.25)
    qtbot.mouseDClick(canvas, LEFT, pos=canvas.plot.at(grips.bell(0)).toPoint())
    field.picker.hex.setFocus()
    field.picker.hex.selectAll()
    qtbot.keyClicks(field.picker.hex, "#0000ff")
    qtbot.keyClick(field.picker.hex, Qt.Key.Key_Return)
    field.picker.close()
    assert canvas.shape.bells[0].color == BLUE
    field.row.width_entry.setFocus()
    field.row.width_entry.selectAll()
    qtbot.keyClicks(field.row.width_entry, "-3")
    qtbot.keyClick(field.row.width_entry, Qt.Key.Key_Return)
    assert canvas.shape.bells[0].width == 33.0


def test_escape_takes_back_the_bell_too(field: Any, session: Any, qtbot: Any, at: Any, table: Any) -> None:
    canvas = field.canvas
    canvas.add_bell()
    shape = canvas.shape
    qtbot.mousePress(canvas, LEFT, pos=canvas.plot.at(grips.bell(0)).toPoint())
    qtbot.mouseMove(canvas, at(800.0, 0.2))
    assert canvas.shape != shape
    qtbot.keyClick(canvas, Qt.Key.Key_Escape)
    assert canvas.shape == shape
    assert table() == shape.function


def test_bells_are_kept_with_the_workspace(field: Any, session: Any, table: Any) -> None:
    field.canvas.add_bell(300.0)
    again = workspace.loads(workspace.dumps(session.network), find=session.network.find)
    assert again.get("all.table") == table()
    noted = again.node("all").ui[remembered.KEY]["table"]
    assert Shape.from_json(noted) == field.canvas.shape
    assert noted["digest"] == remembered.digest(again.get("all.table"))


def test_what_somebody_else_writes_is_keys(field: Any, session: Any, table: Any) -> None:
    field.canvas.add_bell(300.0)
    made = table()
    other = TransferFunction(made.keys[1:], made.reference_length)
    session.network.set("all.table", other)
    assert field.canvas.shape == Shape(other)
    session.undo()
    assert len(field.canvas.shape.bells) == 1


def test_a_linked_node_knows_the_bells(field: Any, session: Any, panel: Any) -> None:
    field.canvas.add_bell(300.0)
    session.network.link("all.table", "shared")
    session.network.link("other.table", "shared")
    session.select("other")
    assert (
        panel.row("other", "table").field.canvas.shape.bells
        == Shape.from_json(session.network.node("all").ui[remembered.KEY]["table"]).bells
    )


def test_bells_can_become_keys(field: Any, session: Any, table: Any) -> None:
    field.canvas.add_bell(300.0)
    made = table()
    field.bake()
    assert table() == made
    assert field.canvas.shape == Shape(made)
    session.undo()
    assert len(field.canvas.shape.bells) == 1
