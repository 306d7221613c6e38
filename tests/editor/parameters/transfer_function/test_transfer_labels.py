"""The table of labels, and showing in the views what has the values under the mouse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QEnterEvent
from PySide6.QtWidgets import QApplication, QLineEdit

from nodegraph.data import TransferFunction, Volume, bricks
from nodegraph.editor.parameters.transfer_function import histogram, label_table, labels
from nodegraph.editor.parameters.transfer_function.highlight import FAINT, OPACITY, highlight
from nodegraph.editor.parameters.transfer_function.keys import opacity_at
from nodegraph.editor.parameters.transfer_function.labels import Label

LEFT = Qt.MouseButton.LeftButton
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
FUNCTION = TransferFunction([(0.0, RED, 0.0), (500.0, GREEN, 0.5), (900.0, BLUE, 1.0)])


# -- labels ----------------------------------------------------------------------------------------------------------


@pytest.fixture
def rows(field: Any, session: Any, qtbot: Any) -> Any:
    """The table, over a volume of the labels 0, 1, 2 and 5."""
    assert not field.labels.isVisible(), "numbers that are no labels have no table"
    session.network.set("cube.labels", True)
    qtbot.waitUntil(lambda: bool(field.table.ids), timeout=10000)
    session.history.clear()
    qtbot.mouseClick(field.labels, LEFT)
    assert field.table.isVisible()
    assert not field.canvas.isVisible()
    return field.table


def click(qtbot: Any, rows: Any, row: int, column: int) -> None:
    place = rows.table.visualItemRect(rows.table.item(row, column)).center()
    qtbot.mouseClick(rows.table.viewport(), LEFT, pos=place)


def test_labels_are_coloured_hidden_and_shown(rows: Any, session: Any, qtbot: Any, table: Any) -> None:
    before = table()
    assert [label.id for label in rows.labels] == [0, 1, 2, 5]
    assert rows.ids == {0: 3, 1: 2, 2: 1, 5: 2}
    qtbot.mouseClick(rows.paint, LEFT)
    assert opacity_at(table(), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]) == pytest.approx([0, 1, 1, 0, 0, 1], abs=0.21)
    assert len({label.color for label in rows.labels}) == 4
    kept = rows.labels[2]
    click(qtbot, rows, 2, label_table.SEEN)
    assert opacity_at(table(), [2.0])[0] == 0.0
    assert rows.labels[2].opacity == kept.opacity, "what it had is remembered"
    assert not rows.grab().isNull()
    click(qtbot, rows, 2, label_table.SEEN)
    assert rows.labels[2] == kept
    session.undo()
    assert not rows.labels[2].visible
    session.undo()
    session.undo()
    assert table() == before
    assert "labels" not in session.network.node("all").ui


def test_numbers_names_and_colours_of_labels(rows: Any, session: Any, qtbot: Any, table: Any) -> None:
    rows.color_all()
    for column, text in ((label_table.NAME, "nucleus"), (label_table.OPACITY, "0.3")):
        rows.table.setCurrentCell(3, column)
        rows.table.editItem(rows.table.item(3, column))
        editor = next(one for one in rows.table.viewport().findChildren(QLineEdit) if one.isVisible())
        qtbot.keyClicks(editor, text)
        qtbot.keyClick(editor, Qt.Key.Key_Return)
        QApplication.processEvents()  # the table commits later
    assert rows.labels[3].name == "nucleus"
    assert opacity_at(table(), [5.0])[0] == pytest.approx(0.3)
    assert session.network.node("all").ui["labels"]["table"]["names"] == {"5": "nucleus"}
    rows.table.item(3, label_table.OPACITY).setText("seven")
    assert rows.table.item(3, label_table.OPACITY).text() == "0.3"
    click(qtbot, rows, 1, label_table.COLOR)
    rows.picker.hex.setFocus()
    rows.picker.hex.selectAll()
    qtbot.keyClicks(rows.picker.hex, "#00ff00")
    qtbot.keyClick(rows.picker.hex, Qt.Key.Key_Return)
    rows.picker.close()
    assert table().evaluate([1.0])[0, :3] == pytest.approx(GREEN)
    rows.table.selectRow(1)
    qtbot.mouseClick(rows.only, LEFT)
    assert [label.visible for label in rows.labels] == [False, True, False, False]
    qtbot.mouseClick(rows.all, LEFT)
    assert [label.visible for label in rows.labels] == [False, True, True, True]
    rows.table.selectRow(1)
    rows.setFocus()
    qtbot.keyClick(rows, Qt.Key.Key_Space)
    assert not rows.labels[1].visible


def test_interpolation_is_said_and_can_be_ended(rows: Any, session: Any, qtbot: Any) -> None:
    assert rows.note.isVisible()
    qtbot.mouseClick(rows.nearest, LEFT)
    assert session.network.get("all.interpolation") == "nearest"
    assert not rows.note.isVisible()
    session.undo()
    assert rows.note.isVisible()


def test_a_function_of_labels_and_back() -> None:
    made = [Label(1, RED, 0.5, True, "one"), Label(2, GREEN, 0.25), Label(7, BLUE, 0.75, False), Label(9, RED, 1.0)]
    function = labels.function_of(made, 2.0)
    assert labels.read(function, [9, 7, 2, 1], labels.notes(made)) == made
    assert opacity_at(function, [0.4, 1.49, 1.51, 2.6, 7.0, 9.6]) == pytest.approx([0.0, 0.5, 0.25, 0.0, 0.0, 0.0])
    assert function.reference_length == 2.0
    assert labels.read(function, [1], {"names": 3, "hidden": {"1": "x"}})[0].name == ""
    table = function.table(2048)
    scale, offset = function.lookup(2048)
    at = np.array([1, 2, 7, 9]) * scale + offset
    for column in range(4):
        read = np.interp(at, np.arange(len(table)), table[:, column])
        assert read == pytest.approx(function.evaluate([1.0, 2.0, 7.0, 9.0])[:, column], abs=1e-9)


def test_a_hidden_label_is_skipped() -> None:
    """Bricks that hold it alone are not visible to any ray."""
    function = labels.function_of([Label(1, RED, 0.5), Label(2, GREEN, 0.5, False), Label(3, BLUE, 0.5)])
    ranges = np.array([[[[1.0, 1.0], [2.0, 2.0], [3.0, 3.0], [1.0, 2.0]]]])
    seen = bricks.visible_bricks(ranges, function.table(2048), function.lookup(2048), 0.0)
    assert seen.ravel().tolist() == [True, False, True, True]


def test_what_is_no_label_is_not_taken_for_one() -> None:
    patches = np.repeat(np.repeat(np.arange(16, dtype="u1").reshape(1, 4, 4), 4, axis=1), 4, axis=2)
    assert set(histogram.count(Volume(patches)).ids) == set(range(16))
    part = histogram.count(Volume(patches), ((0.0, 0.0, 0.0), (0.5, 0.5, 1.0)))
    assert set(part.ids) == set(range(16)), "those outside the crop keep their colours"
    noise = np.random.default_rng(1).integers(0, 16, (4, 16, 16)).astype("u1")
    assert not histogram.count(Volume(noise)).ids
    assert not histogram.count(Volume(patches.astype("f4"))).ids


# -- what has these values? --------------------------------------------------------------------------------------------


def test_the_range_stands_out_and_the_rest_is_faint() -> None:
    shown = highlight(FUNCTION, 400.0, 450.0)
    values = np.array([100.0, 399.0, 451.0, 800.0, 2000.0])
    assert shown.evaluate(values)[:, 3] == pytest.approx(FAINT * FUNCTION.evaluate(values)[:, 3], rel=1e-6)
    assert opacity_at(shown, [400.0, 425.0, 449.9]) == pytest.approx([OPACITY] * 3)
    color = shown.evaluate([425.0])[0, :3]
    assert color.max() > 0.9
    assert color.min() < 0.05
    for beyond in (
        highlight(FUNCTION, -90.0, -80.0),
        highlight(TransferFunction(), 3.0, 4.0),
        highlight(FUNCTION, 500.0, 900.0),
    ):
        assert beyond.keys


def test_pointing_shows_in_the_views_and_changes_nothing(field: Any, session: Any, qtbot: Any, at: Any) -> None:
    pictures: list[Any] = []

    def take(channel: object, report: Any) -> None:
        if channel == "view":
            pictures.append(np.array(report.shown["all"]["image"].color[0, 0, :3]))

    session.answered.connect(take)
    session.watch("view", "all", (4, 4))
    qtbot.waitUntil(lambda: len(pictures) >= 1, timeout=10000)
    assert pictures[-1] == pytest.approx(GREEN), "the node shows the colour of the value 500"
    canvas, modified = field.canvas, session.modified
    count, revision = len(session.history._done), session.network.revision
    ui = dict(session.network.node("all").ui)
    finished: list[Any] = []
    session.finished.connect(finished.append)
    spot = at(500.0, 0.9)
    qtbot.mouseMove(canvas, spot)
    assert canvas.plot.band is None, "nothing happens without being asked for"
    canvas.setFocus()
    qtbot.keyPress(canvas, Qt.Key.Key_Space)
    assert canvas.plot.band is not None
    qtbot.waitUntil(lambda: pictures[-1][0] > 0.9, timeout=10000)
    assert not canvas.grab().isNull()
    assert session.network.get("all.table") == FUNCTION
    qtbot.keyRelease(canvas, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: pictures[-1][0] < 0.1, timeout=10000)
    assert pictures[-1] == pytest.approx(GREEN)
    qtbot.mouseClick(field.show_me, LEFT)
    qtbot.mouseMove(canvas, spot + QPoint(1, 0))
    qtbot.waitUntil(lambda: pictures[-1][0] > 0.9, timeout=10000)
    QApplication.sendEvent(canvas, QEvent(QEvent.Type.Leave))
    qtbot.waitUntil(lambda: pictures[-1][0] < 0.1, timeout=10000)
    assert (len(session.history._done), session.network.revision) == (count, revision)
    assert session.modified == modified
    assert session.network.node("all").ui == ui
    assert str(session.state("all")) == "clean"
    session.unwatch("view")


def test_pointing_ends_with_the_panel(field: Any, session: Any, qtbot: Any, at: Any) -> None:
    canvas = field.canvas
    QApplication.sendEvent(canvas, QEnterEvent(QPointF(1, 1), QPointF(1, 1), QPointF(1, 1)))
    canvas.set_pointing(True)
    qtbot.mouseMove(canvas, at(300.0, 0.9))
    assert session._channels.instead
    session.select("cube")
    assert not session._channels.instead


def test_a_linked_function_is_shown_for_all_that_follow_it(field: Any, session: Any, at: Any, qtbot: Any) -> None:
    session.network.link("all.table", "shared")
    session.network.link("other.table", "shared")
    field.canvas.set_pointing(True)
    qtbot.mouseMove(field.canvas, at(700.0, 0.2))
    assert set(session._channels.instead) == {("all", "table"), ("other", "table")}
