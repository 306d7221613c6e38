"""Several keys at once, drags that catch, the values that are seen, and the tools of the menu."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication

from nodegraph.data import TransferFunction, Volume
from nodegraph.editor.parameters.transfer_function import axes, grips, histogram, keys, menus, snap
from nodegraph.editor.parameters.transfer_function.bells import Bell, Shape

LEFT = Qt.MouseButton.LeftButton
CONTROL, SHIFT, ALT = (
    Qt.KeyboardModifier.ControlModifier,
    Qt.KeyboardModifier.ShiftModifier,
    Qt.KeyboardModifier.AltModifier,
)
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
FUNCTION = TransferFunction([(0.0, RED, 0.0), (500.0, GREEN, 0.5), (900.0, BLUE, 1.0)])


def click_menu(menu: Any, text: str) -> None:
    """Do an entry of a menu, also one of a menu inside it."""
    for action in menu.actions():
        if action.text().startswith(text):
            action.trigger()
            menu.close()
            return
        if action.menu() is not None and any(inner.text().startswith(text) for inner in action.menu().actions()):
            click_menu(action.menu(), text)
            return
    raise AssertionError(text)


# -- several at once -----------------------------------------------------------------------------------------------


def test_several_keys_move_together(field: Any, session: Any, qtbot: Any, table: Any) -> None:
    canvas = field.canvas
    canvas.snaps = False
    qtbot.mouseClick(canvas, LEFT, pos=canvas.place_of(1).toPoint())
    qtbot.mouseClick(canvas, LEFT, CONTROL, pos=canvas.place_of(2).toPoint())
    assert canvas.plot.chosen == {grips.key(1), grips.key(2)}
    assert field.value.placeholderText() == "2 chosen"
    start = canvas.place_of(1)
    qtbot.mousePress(canvas, LEFT, pos=start.toPoint())
    qtbot.mouseMove(canvas, (start + QPointF(-30.0, 20.0)).toPoint())
    qtbot.mouseRelease(canvas, LEFT, pos=(start + QPointF(-30.0, 20.0)).toPoint())
    moved = table().keys
    assert moved[0] == FUNCTION.keys[0]
    assert moved[2].value - moved[1].value == pytest.approx(400.0)
    assert moved[1].value < 480.0
    assert moved[1].opacity < 0.45
    assert moved[2].opacity == pytest.approx(1.0 - (0.5 - moved[1].opacity), abs=0.01)
    session.undo()
    assert table() == FUNCTION


def test_they_stop_at_a_key_that_stays(field: Any, qtbot: Any, table: Any) -> None:
    canvas = field.canvas
    canvas.choose([grips.key(1), grips.key(2)])
    start = canvas.place_of(1)
    qtbot.mousePress(canvas, LEFT, pos=start.toPoint())
    qtbot.mouseMove(canvas, (start + QPointF(-500.0, 0.0)).toPoint())
    qtbot.mouseRelease(canvas, LEFT)
    values = [key.value for key in table().keys]
    assert values[0] < values[1] < 10.0
    assert values[2] - values[1] == pytest.approx(400.0)


def test_a_rectangle_chooses(field: Any, session: Any, qtbot: Any, at: Any) -> None:
    canvas = field.canvas
    first, last = at(400.0, 0.9), at(950.0, 0.2)
    qtbot.mousePress(canvas, LEFT, SHIFT, pos=first)
    qtbot.mouseMove(canvas, last)
    assert canvas.plot.rubber is not None
    assert not canvas.grab().isNull()
    qtbot.mouseRelease(canvas, LEFT, SHIFT, pos=last)
    assert canvas.plot.chosen == {grips.key(1)}
    assert canvas.plot.rubber is None
    canvas.setFocus()
    qtbot.keyClick(canvas, Qt.Key.Key_A, CONTROL)
    assert len(canvas.plot.chosen) == 3
    qtbot.keyClick(canvas, Qt.Key.Key_Delete)
    assert session.network.get("all.table") == TransferFunction()
    session.undo()
    assert session.network.get("all.table") == FUNCTION


def test_arrow_keys_move_by_a_pixel_and_by_ten(field: Any, session: Any, qtbot: Any, table: Any) -> None:
    canvas = field.canvas
    pixel = canvas.plot.axis.span / canvas.plot.area.width()
    canvas.setFocus()
    canvas.select(1)
    qtbot.keyClick(canvas, Qt.Key.Key_Right)
    assert table().keys[1].value == pytest.approx(500.0 + pixel, abs=0.6)
    qtbot.keyClick(canvas, Qt.Key.Key_Left, CONTROL)
    assert table().keys[1].value == pytest.approx(500.0 - 9 * pixel, abs=1.2)
    field.settle()
    session.undo()
    assert table() == FUNCTION


@pytest.mark.parametrize("scale", axes.SCALES)
def test_mirror_turn_over_and_reverse(scale: str, field: Any, session: Any, table: Any) -> None:
    canvas = field.canvas
    canvas.set_scale(scale)
    click_menu(menus.tools(field), "Mirror")
    assert [key.value for key in table().keys] == [0.0, 400.0, 900.0]
    assert [key.opacity for key in table().keys] == [1.0, 0.5, 0.0]
    click_menu(menus.tools(field), "Mirror")
    assert table() == FUNCTION
    click_menu(menus.tools(field), "Turn upside down")
    assert [key.opacity for key in table().keys] == [1.0, 0.5, 0.0]
    session.undo()
    click_menu(menus.tools(field), "Reverse")
    assert [key.color for key in table().keys] == [BLUE, GREEN, RED]
    session.undo()
    assert table() == FUNCTION


def test_density_multiplies_extinction(field: Any, session: Any, table: Any) -> None:
    before = table().evaluate([250.0, 500.0])[:, 3]
    click_menu(menus.tools(field), "× 0.5")
    assert table().evaluate([250.0, 500.0])[:, 3] == pytest.approx(before / 2.0, rel=1e-3)
    session.undo()
    assert table() == FUNCTION
    assert keys.dense(0.5, 2.0) == 0.75
    assert keys.dense(1e-6, 2.0) == pytest.approx(2e-6, rel=1e-3)
    assert keys.dense(1.0, 10.0) == 1.0
    assert keys.dense(0.0, 0.1) == 0.0


def test_tools_know_bells() -> None:
    shape = Shape(FUNCTION, (Bell(200.0, 10.0, 0.75, RED), Bell(600.0, 20.0, 0.5, GREEN)))
    turned = grips.change(shape, grips.every(shape), "mirror")
    assert [bell.center for bell in turned.bells] == [700.0, 300.0]
    assert [key.value for key in turned.base.keys] == [0.0, 400.0, 900.0]
    assert grips.change(turned, grips.every(shape), "mirror") == shape
    thin = grips.change(shape, [grips.bell(0)], "thicker", 0.5)
    assert thin.bells[0].opacity == pytest.approx(0.5)
    assert thin.base == shape.base
    painted = grips.painted(shape, TransferFunction([(0.0, RED, 0.0), (900.0, BLUE, 0.0)]))
    assert painted.bells[1].color == pytest.approx((1 / 3, 0.0, 2 / 3), abs=1e-4)


# -- steps ---------------------------------------------------------------------------------------------------------


def test_both_colours_of_a_step(field: Any, qtbot: Any, table: Any) -> None:
    canvas = field.canvas
    canvas.select(1)
    assert not field.row.right.isVisible()
    qtbot.mouseClick(field.step, LEFT)
    assert field.row.right.isVisible()
    for swatch, text in ((field.row.swatch, "#ff0000"), (field.row.right, "#0000ff")):
        qtbot.mouseClick(swatch, LEFT)
        field.picker.hex.setFocus()
        field.picker.hex.selectAll()
        qtbot.keyClicks(field.picker.hex, text)
        qtbot.keyClick(field.picker.hex, Qt.Key.Key_Return)
        field.picker.close()
    assert [key.color for key in table().keys] == [RED, RED, BLUE, BLUE]
    assert [key.value for key in table().keys] == [0.0, 500.0, 500.0, 900.0]
    assert not canvas.grab().isNull()


# -- drags that catch ----------------------------------------------------------------------------------------------


def test_a_drag_catches_on_round_numbers_and_alt_holds_it_off(field: Any, qtbot: Any, at: Any, table: Any) -> None:
    canvas = field.canvas
    near = at(600.0, 0.52) + QPoint(3, 0)
    qtbot.mousePress(canvas, LEFT, pos=canvas.place_of(1).toPoint())
    canvas._drag(QPointF(near), Qt.KeyboardModifier.NoModifier)
    assert table().keys[1].value == 600.0
    assert table().keys[1].opacity == 0.5
    assert canvas.plot.guides[0] is not None
    assert not canvas.grab().isNull()
    canvas._drag(QPointF(near), ALT)
    assert table().keys[1].value != 600.0
    assert table().keys[1].opacity != 0.5
    qtbot.mouseRelease(canvas, LEFT, pos=near)
    assert canvas.plot.guides == (None, None)


def test_a_drag_catches_on_keys_of_other_functions(field: Any, session: Any, qtbot: Any, at: Any, table: Any) -> None:
    session.network.set("other.table", TransferFunction([(641.25, RED, 0.3)]))
    canvas = field.canvas
    spot = at(641.25, 0.3) + QPoint(2, 0)
    qtbot.mousePress(canvas, LEFT, pos=canvas.place_of(1).toPoint())
    qtbot.mouseMove(canvas, spot)
    assert table().keys[1].value == 641.25
    assert "another function" in canvas.readout
    qtbot.mouseRelease(canvas, LEFT, pos=spot)
    click_menu(menus.tools(field), "Drags catch")
    assert not canvas.snaps


def test_peaks_of_a_histogram() -> None:
    x = np.arange(400)
    hills = 1000 * np.exp(-0.5 * ((x - 100) / 10.0) ** 2) + 50 * np.exp(-0.5 * ((x - 300) / 12.0) ** 2)
    found = snap.peaks(histogram.Histogram(hills.astype(np.int64), -1000.0, 1000.0))
    assert found == pytest.approx([-497.5, 502.5], abs=6.0)
    assert snap.peaks(histogram.Histogram(np.full(400, 7), 0.0, 1.0)) == ()
    assert snap.peaks(histogram.Histogram(np.zeros(400, np.int64), 0.0, 1.0)) == ()


# -- what is seen --------------------------------------------------------------------------------------------------


def test_fit_to_data_and_to_keys(field: Any, session: Any, qtbot: Any) -> None:
    session.network.set("all.table", TransferFunction([(3000.0, RED, 0.1), (4000.0, RED, 0.2)]))
    canvas, axis = field.canvas, field.canvas.plot.axis
    click_menu(menus.fit(field), "Fit to the keys")
    assert 2900.0 < axis.low < 3000.0 < 4000.0 < axis.high < 4100.0
    click_menu(menus.fit(field), "Fit to the data")
    assert -50.0 < axis.low < 1.0
    assert 999.0 < axis.high < 1100.0
    canvas.setFocus()
    span = axis.span
    qtbot.keyClick(canvas, Qt.Key.Key_Plus)
    assert axis.span < span
    qtbot.keyClick(canvas, Qt.Key.Key_Minus)
    assert axis.span == pytest.approx(span)
    before = axis.low
    spot = QPointF(150.0, 60.0)
    turn = QWheelEvent(
        spot, canvas.mapToGlobal(spot), QPoint(), QPoint(0, 120), Qt.MouseButton.NoButton, SHIFT,
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(canvas, turn)
    assert axis.low < before
    assert axis.span == pytest.approx(span)


def test_scales_are_chosen_in_menus(field: Any) -> None:
    click_menu(menus.scale(field), "Opacity logarithmic")
    assert field.canvas.plot.scale == "logarithmic"
    click_menu(menus.histogram(field), "Counts linear")
    assert field.canvas.plot.histogram_scale == "linear"
    assert not field.grab().isNull()


def test_a_histogram_of_the_crop(field: Any, session: Any, qtbot: Any) -> None:
    network, canvas = session.network, field.canvas
    assert canvas.plot.histogram.counts.sum() == 1000
    network.add("cropped", "box")
    network.connect("cube.volume", "box.volume")
    network.connect("box.image", "all.interval")
    network.set("box.crop", ((0.0, 0.0, 0.5), (1.0, 1.0, 1.0)))
    qtbot.waitUntil(lambda: canvas.plot.histogram.counts.sum() == 500, timeout=10000)
    half = canvas.plot.histogram
    assert (half.low, half.high) == pytest.approx((-0.5, 999.5), abs=2.0)
    assert not half.counts[: len(half.counts) // 2 - 1].any(), "the upper half holds the greater values"
    click_menu(menus.histogram(field), "Of the crop")
    qtbot.waitUntil(lambda: canvas.plot.histogram.counts.sum() == 1000, timeout=10000)


def test_parts_of_a_volume() -> None:
    assert histogram.voxels(((0.0, 0.25, 0.0), (1.0, 0.75, 0.0)), (10, 8, 4)) == ((0, 2, 0), (10, 6, 1))
    data = np.arange(8, dtype="u1").reshape(2, 2, 2)
    part = histogram.count(Volume(data), ((0.5, 0.0, 0.0), (1.0, 1.0, 1.0)))
    assert part.counts.tolist() == [0, 1, 0, 1, 0, 1, 0, 1]


def test_what_is_held_is_let_go_with_the_panel(field: Any, session: Any, qtbot: Any, at: Any, table: Any) -> None:
    canvas = field.canvas
    canvas.snaps = False
    qtbot.mousePress(canvas, LEFT, pos=canvas.place_of(1).toPoint())
    qtbot.mouseMove(canvas, at(610.0, 0.4))
    moved = table()
    assert moved != FUNCTION
    session.select("cube")
    assert not session.in_gesture
    session.select("all")
    qtbot.mouseMove(field.canvas, at(700.0, 0.2))
    assert table() == moved
    session.undo()
    assert table() == FUNCTION


def test_several_take_one_colour(field: Any, session: Any, qtbot: Any, table: Any) -> None:
    canvas = field.canvas
    canvas.add_bell(300.0)
    canvas.choose([grips.key(0), grips.key(2), grips.bell(0)])
    qtbot.mouseClick(field.row.swatch, LEFT)
    field.picker.hex.setFocus()
    field.picker.hex.selectAll()
    qtbot.keyClicks(field.picker.hex, "#ffffff")
    qtbot.keyClick(field.picker.hex, Qt.Key.Key_Return)
    field.picker.close()
    assert [key.color for key in canvas.shape.base.keys] == [(1.0, 1.0, 1.0), GREEN, (1.0, 1.0, 1.0)]
    assert canvas.shape.bells[0].color == (1.0, 1.0, 1.0)
    assert table() == canvas.shape.function


def test_the_picture_lives_while_a_bell_is_dragged(field: Any, session: Any, qtbot: Any, at: Any) -> None:
    pictures: list[Any] = []

    def take(channel: object, report: Any) -> None:
        if channel == "view":
            pictures.append(np.array(report.shown["all"]["image"].color[0, 0, :3]))

    canvas = field.canvas
    canvas.snaps = False
    session.network.set("all.table", TransferFunction([(0.0, BLUE, 0.1), (900.0, BLUE, 0.1)]))
    canvas.add_bell(800.0)
    session.answered.connect(take)
    session.watch("view", "all", (4, 4))
    qtbot.waitUntil(lambda: bool(pictures), timeout=10000)
    assert pictures[-1] == pytest.approx(BLUE), "the node shows the colour of the value 500"
    qtbot.mousePress(canvas, LEFT, pos=canvas.plot.at(grips.bell(0)).toPoint())
    qtbot.mouseMove(canvas, at(500.0, 0.5))
    assert session.in_gesture
    qtbot.waitUntil(lambda: pictures[-1][0] > 0.3, timeout=10000)
    assert session.in_gesture, "the button is still down"
    qtbot.mouseRelease(canvas, LEFT, pos=at(500.0, 0.5))
    assert not session.in_gesture
    session.unwatch("view")
