"""The editor of functions over value and gradient magnitude: areas by mouse and keyboard, the joint histogram."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication

from nodegraph.data import Gaussian, TransferFunction2D, Trapezoid, Volume
from nodegraph.data.space import centred
from nodegraph.editor.parameters.transfer_function import menus
from nodegraph.editor.parameters.transfer_function.histogram import voxels
from nodegraph.editor.parameters.transfer_function_2d import areas, joint
from tests.support import raycast_twin

LEFT = Qt.MouseButton.LeftButton
RED, GREEN = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
BOX = Trapezoid.rectangle((100.0, 400.0), (0.0, 40.0), RED, 0.5, 0.25)
BELL = Gaussian((600.0, 60.0), (60.0, 12.0), GREEN, 0.8)
FUNCTION = TransferFunction2D([BOX, BELL])


@pytest.fixture
def field(alone: Any, qtbot: Any) -> Any:
    """The editor, with its histogram there, and a range that has room about both areas."""
    found = alone("areas").field
    qtbot.waitUntil(lambda: found.canvas.plot.histogram is not None, timeout=10000)
    found.canvas.plot.values.show(0.0, 1000.0)
    found.canvas.plot.gradients.show(0.0, 110.0)
    QApplication.processEvents()
    return found


def value(session: Any) -> TransferFunction2D:
    found: TransferFunction2D = session.network.get("all.areas")
    return found


def at(canvas: Any, value: float, gradient: float) -> QPoint:
    spot: QPoint = canvas.plot.at((value, gradient)).toPoint()
    return spot


def drag(qtbot: Any, canvas: Any, start: QPoint, *others: QPoint) -> None:
    qtbot.mousePress(canvas, LEFT, pos=start)
    for spot in others:
        qtbot.mouseMove(canvas, spot)
    qtbot.mouseRelease(canvas, LEFT, pos=others[-1])


# -- the mouse -----------------------------------------------------------------------------------------------------


def test_a_drag_is_live_and_one_step(field: Any, session: Any, qtbot: Any) -> None:
    canvas, changes = field.canvas, []
    session.changed.connect(changes.append)
    qtbot.mousePress(canvas, LEFT, pos=at(canvas, 250.0, 20.0))
    assert canvas.selected == 0
    for shift in (40.0, 90.0, 150.0):
        qtbot.mouseMove(canvas, at(canvas, 250.0 + shift, 30.0))
        assert value(session).areas[0].bottom[0] == pytest.approx(100.0 + shift, abs=5.0), "live while dragging"
        assert canvas.function == value(session)
    qtbot.mouseRelease(canvas, LEFT, pos=at(canvas, 400.0, 30.0))
    moved = value(session).areas[0]
    assert moved.gradients == pytest.approx((10.0, 50.0), abs=1.0)
    assert moved.bottom == moved.top, "a rectangle stays one"
    assert len(changes) >= 3
    assert len(session.history._done) == 1
    session.undo()
    assert value(session) == FUNCTION
    assert canvas.function == FUNCTION


def test_nothing_is_dragged_below_no_gradient(field: Any, session: Any, qtbot: Any) -> None:
    drag(qtbot, field.canvas, at(field.canvas, 250.0, 20.0), at(field.canvas, 250.0, 1.0))
    assert value(session).areas[0].gradients == (0.0, 40.0)


def test_sides_and_corners_reshape(field: Any, session: Any, qtbot: Any) -> None:
    canvas = field.canvas
    canvas.select(0)
    drag(qtbot, canvas, at(canvas, 400.0, 20.0), at(canvas, 500.0, 25.0))
    assert value(session).areas[0].bottom == value(session).areas[0].top == pytest.approx((100.0, 500.0), abs=5.0)
    drag(qtbot, canvas, at(canvas, 300.0, 40.0), at(canvas, 300.0, 80.0))
    assert value(session).areas[0].gradients == pytest.approx((0.0, 80.0), abs=1.0)
    drag(qtbot, canvas, at(canvas, 100.0, 80.0), at(canvas, 200.0, 90.0))
    leaning = value(session).areas[0]
    assert leaning.bottom[0] == 100.0
    assert leaning.top[0] == pytest.approx(200.0, abs=5.0)
    assert leaning.gradients[1] == pytest.approx(90.0, abs=1.0)
    drag(qtbot, canvas, at(canvas, 500.0, 45.0), at(canvas, -400.0, 45.0))
    low, high = value(session).areas[0].top
    assert low < high, "a side does not pass the other one"
    assert len(session.history._done) == 4


def test_a_gaussian_is_widened_by_its_sides(field: Any, session: Any, qtbot: Any) -> None:
    canvas = field.canvas
    canvas.select(1)
    drag(qtbot, canvas, at(canvas, 780.0, 60.0), at(canvas, 900.0, 60.0))
    assert value(session).areas[1].sigma == pytest.approx((100.0, 12.0), abs=2.0)
    drag(qtbot, canvas, at(canvas, 600.0, 96.0), at(canvas, 600.0, 75.0))
    assert value(session).areas[1].sigma[1] == pytest.approx(5.0, abs=0.5)
    assert value(session).areas[1].center == BELL.center


def test_escape_takes_a_drag_back_and_shift_keeps_to_one_axis(field: Any, session: Any, qtbot: Any) -> None:
    canvas = field.canvas
    qtbot.mousePress(canvas, LEFT, pos=at(canvas, 250.0, 20.0))
    qtbot.mouseMove(canvas, at(canvas, 500.0, 40.0))
    qtbot.keyClick(canvas, Qt.Key.Key_Escape)
    assert value(session) == FUNCTION
    assert not session.in_gesture
    qtbot.mouseRelease(canvas, LEFT)
    qtbot.mousePress(canvas, LEFT, pos=at(canvas, 250.0, 20.0))
    canvas._drag(QPointF(at(canvas, 450.0, 25.0)), Qt.KeyboardModifier.ShiftModifier)
    qtbot.mouseRelease(canvas, LEFT)
    assert value(session).areas[0].gradients == (0.0, 40.0)
    assert value(session).areas[0].bottom[0] == pytest.approx(300.0, abs=5.0)


def test_areas_are_added_and_deleted(field: Any, session: Any, qtbot: Any) -> None:
    canvas = field.canvas
    qtbot.mouseDClick(canvas, LEFT, pos=at(canvas, 850.0, 95.0))
    made = value(session).areas[2]
    assert isinstance(made, Trapezoid)
    assert sum(made.bottom) / 2 == pytest.approx(850.0, abs=5.0)
    assert canvas.selected == 2
    assert made.color not in (RED, GREEN)
    qtbot.mouseClick(field.gaussian, LEFT)
    assert isinstance(value(session).areas[3], Gaussian)
    canvas.setFocus()
    qtbot.keyClick(canvas, Qt.Key.Key_R)
    qtbot.keyClick(canvas, Qt.Key.Key_G)
    qtbot.mouseClick(field.rectangle, LEFT)
    assert [area.shape for area in value(session).areas[4:]] == ["trapezoid", "gaussian", "trapezoid"]
    assert len({area.color for area in value(session).areas}) == 7
    for _ in range(5):
        canvas.select(len(value(session).areas) - 1)
        qtbot.keyClick(canvas, Qt.Key.Key_Delete)
    assert value(session) == FUNCTION
    assert canvas.selected is None
    assert not field.delete.isEnabled()
    session.undo()
    assert len(value(session).areas) == 3


def test_what_lies_on_top_is_taken_and_the_selected_one_first(field: Any, session: Any) -> None:
    canvas = field.canvas
    session.network.set("all.areas", areas.added(FUNCTION, BOX._replace(color=GREEN)))
    spot = QPointF(at(canvas, 250.0, 20.0))
    assert canvas.plot.area_at(spot) == 2
    canvas.select(0)
    assert canvas.plot.area_at(spot) == 0
    assert canvas.plot.area_at(QPointF(at(canvas, 950.0, 100.0))) is None


def test_zoom_and_pan(field: Any, session: Any, qtbot: Any) -> None:
    canvas, plot = field.canvas, field.canvas.plot
    canvas.setFocus()
    spot = QPointF(at(canvas, 300.0, 80.0))
    for modifiers, axis in (
        (Qt.KeyboardModifier.NoModifier, plot.values),
        (Qt.KeyboardModifier.ControlModifier, plot.gradients),
    ):
        before, held = axis.span, plot.point(spot)
        event = QWheelEvent(
            spot, canvas.mapToGlobal(spot), QPoint(), QPoint(0, 240), Qt.MouseButton.NoButton, modifiers,
            Qt.ScrollPhase.NoScrollPhase, False,
        )  # fmt: skip
        QApplication.sendEvent(canvas, event)
        assert axis.span == pytest.approx(before / 1.44)
        assert plot.point(spot) == pytest.approx(held), "what is under the mouse stays there"
    low = plot.values.low
    drag(qtbot, canvas, at(canvas, 500.0, 100.0), at(canvas, 450.0, 100.0))
    assert plot.values.low > low
    qtbot.keyClick(canvas, Qt.Key.Key_Home)
    assert plot.values.low <= 0.0
    assert plot.gradients.low == 0.0
    assert plot.gradients.high >= 96.0
    assert not session.history.undo_name, "looking changes nothing"


# -- the keyboard and the entries ----------------------------------------------------------------------------------


def test_arrow_keys_choose_move_and_widen(field: Any, session: Any, qtbot: Any) -> None:
    canvas = field.canvas
    canvas.setFocus()
    qtbot.keyClick(canvas, Qt.Key.Key_Right)
    assert canvas.selected == 0
    qtbot.keyClick(canvas, Qt.Key.Key_PageDown)
    assert canvas.selected == 1
    qtbot.keyClick(canvas, Qt.Key.Key_PageUp)
    qtbot.keyClick(canvas, Qt.Key.Key_Right, Qt.KeyboardModifier.ControlModifier)
    qtbot.keyClick(canvas, Qt.Key.Key_Up)
    qtbot.keyClick(canvas, Qt.Key.Key_Right, Qt.KeyboardModifier.AltModifier)
    field.settle()
    wide, high = canvas.plot.pixel()
    area = value(session).areas[0]
    assert area.bottom == pytest.approx((100.0 + 10 * wide, 400.0 + 11 * wide))
    assert area.gradients == pytest.approx((high, 40.0 + high))
    session.undo()
    assert value(session) == FUNCTION, "steps that follow each other are undone together"


def type_into(qtbot: Any, entry: Any, text: str) -> None:
    entry.setFocus()
    entry.selectAll()
    qtbot.keyClicks(entry, text)
    qtbot.keyClick(entry, Qt.Key.Key_Return)


def test_numbers_and_colour_of_the_selected_area(field: Any, alone: Any, session: Any, qtbot: Any) -> None:
    canvas = field.canvas
    canvas.select(0)
    _, low, high = field.pairs[1]
    type_into(qtbot, low, "150")
    type_into(qtbot, field.pairs[2][2], "55.5")
    type_into(qtbot, field.opacity, "0.0003")
    type_into(qtbot, field.softness, "1")
    area = value(session).areas[0]
    assert (area.top, area.gradients, area.opacity, area.softness) == ((150.0, 400.0), (0.0, 55.5), 0.0003, 1.0)
    assert high.unit == "HU"
    assert field.pairs[2][1].unit == "HU/mm"
    type_into(qtbot, low, "500")
    assert value(session).areas[0].top == (150.0, 400.0)
    assert "the least value comes first" in alone("areas").error.text()
    canvas.select(1)
    assert field.pairs[2][0].isHidden()
    assert field.softness.isHidden()
    assert field.pairs[0][0].text() == "Centre"
    type_into(qtbot, field.pairs[1][2], "7")
    assert value(session).areas[1].sigma == (60.0, 7.0)
    canvas.setFocus()
    qtbot.keyClick(canvas, Qt.Key.Key_C)
    field.picker.close()
    qtbot.mouseDClick(canvas, LEFT, pos=at(canvas, 600.0, 60.0))
    type_into(qtbot, field.picker.hex, "#ffffff")
    assert value(session).areas[1].color == (1.0, 1.0, 1.0)
    field.picker.close()


def test_a_trapezoid_is_made_a_rectangle_by_its_menu(field: Any, session: Any) -> None:
    field.canvas.select(0)
    assert [action.text() for action in field.canvas.menu().actions()] == ["Colour …\tC", "Delete\tDel"]
    field.canvas.put(BOX._replace(top=(200.0, 500.0)))
    menu = field.canvas.menu()
    next(action for action in menu.actions() if action.text() == "Make it a rectangle").trigger()
    assert value(session).areas[0].bottom == value(session).areas[0].top == (150.0, 450.0)


def test_undo_of_an_area_that_is_selected(field: Any, session: Any, qtbot: Any) -> None:
    field.canvas.add_gaussian()
    assert field.canvas.selected == 2
    session.undo()
    assert field.canvas.selected is None
    assert field.canvas.function == FUNCTION
    assert not field.grab().isNull()


def test_an_empty_function_can_be_begun(field: Any, session: Any, qtbot: Any) -> None:
    session.network.set("all.areas", TransferFunction2D())
    assert not field.grab().isNull()
    qtbot.mouseDClick(field.canvas, LEFT, pos=at(field.canvas, 300.0, 50.0))
    assert len(value(session).areas) == 1


# -- the histogram -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("scale", "crop"),
    [(1.0, None), (-2.0, None), (1.0, ((0.25, 0.0, 0.5), (0.75, 1.0, 0.84))), (1.0, ((0, 0, 0), (1, 0.5, 0.5)))],
)
def test_the_joint_histogram_counts_what_the_ray_caster_sees(scale: float, crop: Any, rng: np.random.Generator) -> None:
    """Each voxel by its value and the length of its gradient, in a turned, anisotropic grid; of a part the same."""
    data = rng.integers(-50, 50, (6, 7, 8)).astype("i2")
    c, s = np.cos(0.3), np.sin(0.3)
    turn = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    volume = Volume(data, turn @ centred((8, 7, 6), (0.5, 1.0, 2.0)), (scale, 10.0, "HU"))
    found = joint.count(volume, crop)
    low, high = voxels(crop or ((0, 0, 0), (1, 1, 1)), volume.dims)
    points = np.stack(np.meshgrid(*map(np.arange, low, high), indexing="ij"), -1).reshape(-1, 3)
    values = raycast_twin.sample(volume, points)
    magnitudes = np.linalg.norm(raycast_twin.slope(volume, points), axis=-1)
    rows, columns = found.counts.shape
    expected = np.histogram2d(
        magnitudes, values, bins=(rows, columns), range=((0.0, found.top), (found.low, found.high))
    )[0]
    assert found.counts.sum() == len(points)
    assert np.abs(found.counts - expected).sum() <= 4, "rounding at the edges of bins"
    assert magnitudes.max() <= found.top <= 4.0 * magnitudes.max()
    assert (found.unit, found.unit_per_mm) == ("HU", "HU/mm")


def test_odd_volumes_are_counted() -> None:
    holed = np.ones((4, 4, 4), "f4")
    holed[1, 1, 1] = np.nan
    assert joint.count(Volume(holed)).counts.sum() == 64 - 7, "what is beside it has no gradient"
    assert joint.count(Volume(np.zeros((1, 3, 3), "u1"))).counts[0].sum() == 9
    assert joint.count(Volume(np.full((2, 2, 2), np.nan, "f4"))).counts.sum() == 0
    low, high, top = joint.count(Volume(np.zeros((3, 3, 3), "f4"))).usual()
    assert low < high
    assert top > 0.0


def test_the_histogram_has_two_scales_and_its_menu(field: Any) -> None:
    menu = menus.histogram(field)
    pictures = [field.canvas.grab().toImage()]
    next(action for action in menu.actions() if action.text() == "Counts linear").trigger()
    pictures.append(field.canvas.grab().toImage())
    assert pictures[0] != pictures[1]
    assert not next(action for action in menu.actions() if action.text() == "Of the crop alone").isEnabled()


def test_the_histogram_follows_the_wires(field: Any, session: Any, qtbot: Any) -> None:
    assert field.canvas.plot.histogram.high == pytest.approx(999.5, abs=4.0)
    session.network.set("cube.last", 2000)
    qtbot.waitUntil(lambda: field.canvas.plot.histogram.high > 1990.0, timeout=10000)
    session.network.disconnect("all.volume")
    qtbot.waitUntil(lambda: field.canvas.plot.histogram is None, timeout=10000)
