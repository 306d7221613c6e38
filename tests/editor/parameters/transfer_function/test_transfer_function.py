"""The transfer-function editor: keys by mouse and keyboard, scales, histogram, presets."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication

from nodegraph import plugins
from nodegraph.data import TransferFunction, Volume
from nodegraph.editor.parameters import preset_files
from nodegraph.editor.parameters.place import Place
from nodegraph.editor.parameters.transfer_function import axes, histogram, keys, presets
from nodegraph.editor.parameters.transfer_function.field import TransferFunctionField

LEFT = Qt.MouseButton.LeftButton
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
FUNCTION = TransferFunction([(0.0, RED, 0.0), (500.0, GREEN, 0.5), (900.0, BLUE, 1.0)])


# -- the mouse and the keyboard -----------------------------------------------------------------------------------


def test_a_drag_is_live_and_one_step(field: Any, session: Any, qtbot: Any, at: Any, table: Any) -> None:
    canvas, changes = field.canvas, []
    session.changed.connect(changes.append)
    start = canvas.place_of(1).toPoint()
    qtbot.mousePress(canvas, LEFT, pos=start)
    for value in (550.0, 600.0, 700.0):
        qtbot.mouseMove(canvas, at(value, 0.75))
        assert table().keys[1].value == pytest.approx(value, abs=5.0), "live while dragging"
        assert canvas.function == table()
    qtbot.mouseRelease(canvas, LEFT, pos=at(700.0, 0.75))
    assert len(changes) >= 3
    assert table().keys[1].opacity == pytest.approx(0.75, abs=0.02)
    assert table().keys[1].color == GREEN
    assert len(session.history._done) == 1
    session.undo()
    assert table() == FUNCTION
    assert canvas.function == FUNCTION


def test_a_key_does_not_pass_its_neighbours(field: Any, session: Any, qtbot: Any, at: Any, table: Any) -> None:
    canvas = field.canvas
    qtbot.mousePress(canvas, LEFT, pos=canvas.place_of(1).toPoint())
    qtbot.mouseMove(canvas, at(990.0, 0.5))
    qtbot.mouseRelease(canvas, LEFT, pos=at(990.0, 0.5))
    values = [key.value for key in table().keys]
    assert values == sorted(set(values)), "no step by chance"
    assert values[1] > 890.0


def test_escape_takes_a_drag_back(field: Any, session: Any, qtbot: Any, at: Any, table: Any) -> None:
    canvas = field.canvas
    qtbot.mousePress(canvas, LEFT, pos=canvas.place_of(1).toPoint())
    qtbot.mouseMove(canvas, at(700.0, 0.2))
    qtbot.keyClick(canvas, Qt.Key.Key_Escape)
    assert table() == FUNCTION
    assert not session.in_gesture


def test_shift_keeps_to_one_axis(field: Any, session: Any, qtbot: Any, at: Any, table: Any) -> None:
    canvas = field.canvas
    qtbot.mousePress(canvas, LEFT, pos=canvas.place_of(1).toPoint())
    field.canvas._drag(QPointF(at(700.0, 0.45)), Qt.KeyboardModifier.ShiftModifier)
    qtbot.mouseRelease(canvas, LEFT)
    assert table().keys[1].opacity == 0.5
    assert table().keys[1].value == pytest.approx(700.0, abs=5.0)


def test_a_double_click_inserts_with_the_colour_of_the_place(
    field: Any, session: Any, qtbot: Any, at: Any, table: Any
) -> None:
    canvas = field.canvas
    qtbot.mouseDClick(canvas, LEFT, pos=at(250.0, 0.8))
    assert len(table().keys) == 4
    added = table().keys[1]
    assert added.value == pytest.approx(250.0, abs=5.0)
    assert added.opacity == pytest.approx(0.8, abs=0.02)
    assert added.color == pytest.approx((0.5, 0.5, 0.0), abs=0.02)
    assert canvas.selected == 1
    session.undo()
    assert table() == FUNCTION


def test_delete(field: Any, session: Any, qtbot: Any, table: Any) -> None:
    canvas = field.canvas
    qtbot.mouseClick(canvas, LEFT, pos=canvas.place_of(1).toPoint())
    assert canvas.selected == 1
    qtbot.keyClick(canvas, Qt.Key.Key_Delete)
    assert [key.value for key in table().keys] == [0.0, 900.0]
    assert canvas.selected is None
    assert not field.delete.isEnabled()
    session.undo()
    assert table() == FUNCTION


def test_arrow_keys_move_the_selected_key(field: Any, session: Any, qtbot: Any, table: Any) -> None:
    canvas = field.canvas
    canvas.setFocus()
    qtbot.keyClick(canvas, Qt.Key.Key_Right)
    assert canvas.selected == 0
    qtbot.keyClick(canvas, Qt.Key.Key_PageDown)
    assert canvas.selected == 1
    for _ in range(3):
        qtbot.keyClick(canvas, Qt.Key.Key_Right)
    qtbot.keyClick(canvas, Qt.Key.Key_Up)
    field.settle()
    assert table().keys[1].value > 500.0
    assert table().keys[1].opacity == pytest.approx(0.51)
    session.undo()
    assert table() == FUNCTION, "steps that follow each other are undone together"


def test_entries_and_colour_of_the_selected_key(field: Any, session: Any, qtbot: Any, table: Any) -> None:
    canvas = field.canvas
    canvas.select(1)
    for entry, text in ((field.value, "420.5"), (field.opacity, "0.0003")):
        entry.setFocus()
        entry.selectAll()
        qtbot.keyClicks(entry, text)
        qtbot.keyClick(entry, Qt.Key.Key_Return)
    assert table().keys[1][::2] == (420.5, 0.0003)
    field.opacity.selectAll()
    qtbot.keyClicks(field.opacity, "2")
    qtbot.keyClick(field.opacity, Qt.Key.Key_Return)
    assert table().keys[1].opacity == 0.0003
    qtbot.mouseDClick(canvas, LEFT, pos=canvas.place_of(1).toPoint())
    picker = field.picker
    picker.hex.setFocus()
    picker.hex.selectAll()
    qtbot.keyClicks(picker.hex, "#ffffff")
    qtbot.keyClick(picker.hex, Qt.Key.Key_Return)
    assert table().keys[1].color == (1.0, 1.0, 1.0)
    picker.close()


def test_steps(field: Any, session: Any, qtbot: Any, at: Any, table: Any) -> None:
    canvas = field.canvas
    canvas.select(1)
    qtbot.mouseClick(field.step, LEFT)
    assert [key.value for key in table().keys] == [0.0, 500.0, 500.0, 900.0]
    assert [key.opacity for key in table().keys] == [0.0, 0.0, 0.5, 1.0]
    qtbot.mousePress(canvas, LEFT, pos=canvas.place_of(2).toPoint())
    qtbot.mouseMove(canvas, at(600.0, 0.5))
    qtbot.mouseRelease(canvas, LEFT, pos=at(600.0, 0.5))
    values = [key.value for key in table().keys]
    assert values[1] == values[2] == pytest.approx(600.0, abs=5.0), "both sides of a step move"
    canvas.select(2)
    qtbot.mouseClick(field.step, LEFT)
    assert [key.opacity for key in table().keys] == pytest.approx([0.0, 0.5, 1.0], abs=0.02)


def test_zoom_and_pan_of_the_values(field: Any, session: Any, qtbot: Any, at: Any) -> None:
    canvas = field.canvas
    axis = canvas.plot.axis
    canvas.setFocus()
    before, spot = axis.span, QPointF(at(300.0, 0.9))
    held = canvas.plot.value(spot.x())
    event = QWheelEvent(
        spot, canvas.mapToGlobal(spot), QPoint(), QPoint(0, 240), Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(canvas, event)
    assert axis.span == pytest.approx(before / 1.44)
    assert canvas.plot.value(spot.x()) == pytest.approx(held), "what is under the mouse stays there"
    low = axis.low
    qtbot.mousePress(canvas, LEFT, pos=QPoint(200, 30))
    qtbot.mouseMove(canvas, QPoint(150, 30))
    qtbot.mouseRelease(canvas, LEFT, pos=QPoint(150, 30))
    assert axis.low > low
    qtbot.keyClick(canvas, Qt.Key.Key_Home)
    assert axis.low <= 0.0
    assert axis.high >= 999.0
    assert not session.history.undo_name, "looking changes nothing"


@pytest.mark.parametrize("scale", axes.SCALES)
def test_opacity_can_be_set_on_every_scale(
    scale: str, field: Any, session: Any, qtbot: Any, at: Any, table: Any
) -> None:
    canvas = field.canvas
    canvas.set_scale(scale)
    qtbot.mousePress(canvas, LEFT, pos=canvas.place_of(1).toPoint())
    qtbot.mouseMove(canvas, at(500.0, 0.3))
    qtbot.mouseRelease(canvas, LEFT, pos=at(500.0, 0.3))
    assert table().keys[1].opacity == pytest.approx(0.3, rel=0.1)


# -- the parts -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", axes.SCALES)
def test_the_scales_are_inverted_exactly(scale: str) -> None:
    for value in (0.0, 1e-5, 1e-4, 1e-3, 0.1, 0.5, 1.0):
        assert axes.opacity(float(axes.height(value, scale)), scale) == pytest.approx(value, abs=1e-12, rel=1e-9)
    heights = [float(axes.height(value, scale)) for value in np.linspace(0.0, 1.0, 101)]
    assert heights == sorted(heights)
    if scale != "linear":
        assert float(axes.height(1e-4, scale)) >= 0.1 - 1e-9, "0.0001 can be told from 0"


def test_ticks_are_round_and_inside() -> None:
    assert axes.ValueAxis(-1024.0, 3071.0).ticks(5) == [-1000.0, 0.0, 1000.0, 2000.0, 3000.0]
    assert axes.ValueAxis(0.0, 0.37).ticks(4) == [0.0, 0.1, 0.2, 0.3]


def test_the_curve_is_what_is_marched() -> None:
    """Extinction is linear between keys: the opacity in the middle is not the mean."""
    function = TransferFunction([(0.0, RED, 0.0), (1.0, RED, 0.75)])
    assert keys.opacity_at(function, [0.5])[0] == pytest.approx(0.5)


def test_the_histogram_counts_every_finite_voxel() -> None:
    data = np.array([[[-3, -3, 0, 5], [5, 5, 7, 7]]], "i2")
    found = histogram.count(Volume(data, mapping=(2.0, 10.0, "HU")))
    width = (found.high - found.low) / len(found.counts)
    at_value = {v: found.counts[int((v * 2.0 + 10.0 - found.low) / width)] for v in (-3, 0, 5, 7)}
    assert at_value == {-3: 2, 0: 1, 5: 3, 7: 2}
    assert found.counts.sum() == 8
    assert found.unit == "HU"
    real = np.array([[[0.0, 1.0, np.nan, np.inf]]], "f4")
    assert histogram.count(Volume(real)).counts.sum() == 2
    turned = histogram.count(Volume(data, mapping=(-1.0, 0.0, "")))
    assert turned.counts[0] == 2
    assert turned.low == pytest.approx(-7.5)
    assert histogram.count(Volume(np.zeros((2, 2, 2), "f4"))).counts.sum() == 8


def test_the_histogram_follows_the_wires(field: Any, session: Any, qtbot: Any) -> None:
    assert field.canvas.plot.histogram.high == pytest.approx(999.5, abs=2.0)
    session.network.set("cube.last", 2000)
    qtbot.waitUntil(lambda: field.canvas.plot.histogram.high > 1990.0, timeout=10000)
    assert field.value.unit == "HU"
    session.network.disconnect("all.volume")
    qtbot.waitUntil(lambda: field.canvas.plot.histogram is None, timeout=10000)


def test_presets_are_read_and_applied(field: Any, session: Any, qtbot: Any, table: Any) -> None:
    offered = presets.presets("HU")
    assert len(offered) >= 12
    assert not presets.refusals()
    qtbot.mouseClick(field.presets, LEFT)
    listed = field.list.list
    assert listed.count() == len(offered)
    assert not listed.item(0).icon().isNull()
    row = next(i for i in range(listed.count()) if listed.item(i).text() == "CT: Bone")
    listed.setCurrentRow(row)
    qtbot.keyClick(listed, Qt.Key.Key_Return)
    assert table() == offered[row].value
    session.undo()
    assert table() == FUNCTION
    ramp = next(one for one in offered if one.name == "Ramp")
    field.take_preset(ramp)
    low, high = field.canvas.plot.histogram.usual()
    assert table().domain == (low, high), "a relative preset takes the range of the data"
    assert len(session.history._done) == 1


def test_presets_of_plugins(monkeypatch: pytest.MonkeyPatch) -> None:
    described = {"name": "Mine", "kind": "TransferFunction", "value": {"keys": [[0.0, [1, 1, 1], 0.5]]}}
    offers = (
        plugins.Plugin("one", described, "", "a"),
        plugins.Plugin("made", lambda: [{**described, "name": "Made"}], "", "a"),
        plugins.Plugin("other", {**described, "kind": "Camera"}, "", "a"),
        plugins.Plugin("wrong", {**described, "value": {"keys": 3}}, "", "a"),
        plugins.Plugin("gone", None, "needs the package 'x': pip install x", "a"),
    )
    monkeypatch.setattr(plugins, "discover", lambda group: offers if group == "nodegraph.presets" else ())
    presets.forget()
    try:
        names = [one.name for one in presets.presets()]
        assert {"Mine", "Made"} < set(names)
        assert set(presets.refusals()) == {"wrong", "gone"}
    finally:
        presets.forget()


def test_shipped_presets_are_json_of_their_kind() -> None:
    for file in preset_files.FOLDER.glob("*.json"):
        for one in json.loads(file.read_text(encoding="utf-8")):
            read = presets.read(one)
            assert read is not None
            assert read.unit or read.relative, f"{one['name']}: in which unit?"
            low, high = read.value.domain
            assert not read.relative or 0.0 <= low < high <= 1.0


def test_a_thumbnail_shows_the_colours(qapp: QApplication) -> None:
    image = presets.thumbnail(TransferFunction([(0.0, RED, 1.0), (1.0, BLUE, 1.0)]), 64, 8).toImage()
    assert image.pixelColor(0, 4).red() > 240
    assert image.pixelColor(63, 4).blue() > 240


def test_an_empty_function_can_be_begun(field: Any, session: Any, qtbot: Any, at: Any, table: Any) -> None:
    session.network.set("all.table", TransferFunction())
    canvas = field.canvas
    assert not field.grab().isNull()
    qtbot.mouseDClick(canvas, LEFT, pos=at(100.0, 0.5))
    assert table().keys[0].color == (1.0, 1.0, 1.0)


def test_keys_are_seen_whole_before_anything_is_known_of_the_data(session: Any, qtbot: Any) -> None:
    shown = TransferFunctionField(Place(session, "all", "table").declared)
    qtbot.addWidget(shown)
    shown.show_value(TransferFunction([(-300.0, (1, 1, 1), 0.0), (1200.0, (1, 1, 1), 0.5)]))
    axis = shown.canvas.plot.axis
    assert shown.canvas.plot.histogram is None
    assert axis.low < -300.0
    assert 1200.0 < axis.high < 2000.0
