"""Every kind of parameter: the user's gesture becomes a command, undo takes it back, and the widget follows."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtWidgets import QLineEdit, QWidget

from nodegraph import data, params
from nodegraph.editor.parameters import WIDGETS, make_field, widget_for
from nodegraph.editor.parameters.color import ColorField, to_linear, to_qcolor
from nodegraph.editor.parameters.numbers import Scale, short, typed
from nodegraph.editor.parameters.row import ParameterRow
from nodegraph.editor.parameters.simple import JsonField
from nodegraph.errors import ParameterError

LEFT = Qt.MouseButton.LeftButton


def enter(qtbot: Any, entry: QLineEdit, text: str) -> None:
    """Type over what an entry shows and press Enter."""
    entry.setFocus()
    entry.selectAll()
    qtbot.keyClicks(entry, text)
    qtbot.keyClick(entry, Qt.Key.Key_Return)


def drag(qtbot: Any, widget: QWidget, *points: QPointF | QPoint) -> None:
    """Press at the first point, move over the others, release at the last."""
    spots = [point.toPoint() if isinstance(point, QPointF) else point for point in points]
    qtbot.mousePress(widget, LEFT, pos=spots[0])
    for spot in spots[1:]:
        qtbot.mouseMove(widget, spot)
    qtbot.mouseRelease(widget, LEFT, pos=spots[-1])


def slide(row: ParameterRow, qtbot: Any) -> None:
    slider = row.field.slider
    middle = slider.height() // 2
    drag(qtbot, slider, QPoint(10, middle), QPoint(30, middle), QPoint(slider.width() // 2, middle))


GESTURES: dict[str, tuple[Callable[[ParameterRow, Any], object], Callable[[Any], bool]]] = {
    # parameter: (what the user does, what the value then is)
    "amount": (slide, lambda v: v == pytest.approx(5.0, abs=0.2)),
    "free": (lambda row, q: enter(q, row.field.entry, "-12.5"), lambda v: v == -12.5),
    "tiny": (slide, lambda v: v == pytest.approx(10**-3.5, rel=0.3)),
    "count": (lambda row, q: q.keyClick(row.field.slider, Qt.Key.Key_Right), lambda v: v == 4 and type(v) is int),
    "seed": (lambda row, q: enter(q, row.field.entry, "4294967295"), lambda v: v == 4294967295),
    "on": (lambda row, q: q.mouseClick(row.field.switch, LEFT), lambda v: v is True),
    "mode": (lambda row, q: q.keyClick(row.field.options, Qt.Key.Key_Down), lambda v: v == "two"),
    "title": (lambda row, q: enter(q, row.field.entry, "A title"), lambda v: v == "A title"),
    "path": (lambda row, q: enter(q, row.field.entry, "ct.nii"), lambda v: v == "ct.nii"),
    "folder": (lambda row, q: enter(q, row.field.entry, "out"), lambda v: v == "out"),
    "color": (lambda row, q: enter(q, row.field.hex, "#ff0000"), lambda v: v == (1.0, 0.0, 0.0)),
    "glass": (lambda row, q: enter(q, row.field.hex, "#00ff0000"), lambda v: v == (0.0, 1.0, 0.0, 0.0)),
    "vector": (lambda row, q: enter(q, row.field.entries[1], "7"), lambda v: v == (1.0, 7.0, 3.0)),
    "matrix": (lambda row, q: enter(q, row.field.entries[7], "2.5"), lambda v: v[1] == (0.0, 1.0, 0.0, 2.5)),
    "interval": (lambda row, q: enter(q, row.field.entries[1], "40"), lambda v: v == (10.0, 40.0)),
    "box": (lambda row, q: q.mouseClick(row.field.limited, LEFT), lambda v: v == ((0.0,) * 3, (1.0,) * 3)),
    "camera": (lambda row, q: q.mouseClick(row.field.buttons["top"], LEFT), lambda v: v.eye == (0.0, 0.0, 600.0)),
    "light": (lambda row, q: enter(q, row.field.vectors["position"][0], "3"), lambda v: v.position == (3.0, 0.7, 1.0)),
    "plane": (lambda row, q: q.mouseClick(row.field.buttons["Sagittal"], LEFT), lambda v: v.normal == (1.0, 0.0, 0.0)),
    "maybe": (lambda row, q: q.mouseClick(row.field.given, LEFT), lambda v: v == data.Plane()),
    "table": (lambda row, q: enter(q, row.field.length, "2.5"), lambda v: v.reference_length == 2.5),
    "areas": (lambda row, q: enter(q, row.field.length, "2.5"), lambda v: v.reference_length == 2.5),
}  # fmt: skip


def test_every_kind_is_covered(session: Any) -> None:
    """No kind without a widget of its own, none without a gesture in the table above."""
    declared = session.network.node("all").processor.params
    tried = {type(declared[name]) for name in GESTURES}
    assert tried == set(WIDGETS) == set(params.kinds().values())


@pytest.mark.parametrize("name", GESTURES)
def test_a_gesture_is_one_command_and_undo_takes_it_back(name: str, alone: Any, session: Any, qtbot: Any) -> None:
    gesture, expected = GESTURES[name]
    shown = alone(name)
    before = session.network.get(f"all.{name}")
    assert shown.field.isEnabled()
    gesture(shown, qtbot)
    shown.field.settle()
    after = session.network.get(f"all.{name}")
    assert expected(after), after
    assert shown.error.isHidden()
    assert shown.label.changed
    assert len(session.history._done) == 1, "one gesture is one step"
    seen = []
    shown.field.show_value = seen.append
    session.undo()
    assert session.network.get(f"all.{name}") == before
    assert seen[-1] == before, "the widget follows undo"
    assert not shown.label.changed
    session.redo()
    assert seen[-1] == after
    qtbot.mouseDClick(shown.label, LEFT)
    assert name not in session.network.node("all").params, "a double click on the name resets"
    assert not shown.label.changed


def test_lines_are_handed_on_when_the_focus_leaves(alone: Any, session: Any, qtbot: Any) -> None:
    shown = alone("notes")
    shown.field.entry.setFocus()
    qtbot.keyClicks(shown.field.entry, "a")
    qtbot.keyClick(shown.field.entry, Qt.Key.Key_Return)
    qtbot.keyClicks(shown.field.entry, "b")
    qtbot.keyClick(shown.field.entry, Qt.Key.Key_Return, Qt.KeyboardModifier.ControlModifier)
    assert session.network.get("all.notes") == "a\nb"
    session.undo()
    assert shown.field.entry.toPlainText() == ""


def test_a_typed_value_may_lie_beyond_the_slider_but_not_beyond_the_limit(alone: Any, session: Any, qtbot: Any) -> None:
    shown = alone("amount")
    enter(qtbot, shown.field.entry, "50")
    assert session.network.get("all.amount") == 50.0
    assert shown.field.slider.scale.place(50.0) == 1.0
    enter(qtbot, shown.field.entry, "500")
    assert session.network.get("all.amount") == 50.0
    assert shown.error.text() == "500.0 mm is outside 0.0..100.0 mm"
    assert shown.error.isVisible()
    enter(qtbot, shown.field.entry, "nonsense")
    assert "nonsense" in shown.error.text()
    enter(qtbot, shown.field.entry, "3/8")
    assert session.network.get("all.amount") == 0.375
    assert not shown.error.isVisible()
    shown.field.entry.clearFocus()
    assert shown.field.entry.text() == "0.375 mm"


def test_the_wheel_steps_only_with_the_focus_and_is_undone_at_once(alone: Any, session: Any, qtbot: Any) -> None:
    from PySide6.QtGui import QWheelEvent
    from PySide6.QtWidgets import QApplication

    slider = alone("amount").field.slider

    def turn() -> None:
        at = QPointF(slider.width() / 2, slider.height() / 2)
        none = Qt.KeyboardModifier.NoModifier
        event = QWheelEvent(
            at, slider.mapToGlobal(at), QPoint(), QPoint(0, 120), Qt.MouseButton.NoButton, none,
            Qt.ScrollPhase.NoScrollPhase, False,
        )  # fmt: skip
        QApplication.sendEvent(slider, event)

    slider.clearFocus()
    turn()
    assert session.network.get("all.amount") == 1.0
    slider.setFocus()
    for _ in range(3):
        turn()
    assert session.network.get("all.amount") == pytest.approx(1.3)
    assert session.in_gesture
    qtbot.waitUntil(lambda: not session.in_gesture, timeout=2000)
    session.undo()
    assert session.network.get("all.amount") == 1.0


def test_escape_takes_a_drag_back(alone: Any, session: Any, qtbot: Any) -> None:
    slider = alone("amount").field.slider
    qtbot.mousePress(slider, LEFT, pos=QPoint(20, 10))
    qtbot.mouseMove(slider, QPoint(60, 10))
    assert session.network.get("all.amount") != 1.0
    qtbot.keyClick(slider, Qt.Key.Key_Escape)
    assert session.network.get("all.amount") == 1.0
    assert not session.in_gesture
    assert not session.history.undo_name


def test_both_handles_of_an_interval(alone: Any, session: Any, qtbot: Any) -> None:
    shown = alone("interval").field.range
    middle = shown.height() // 2
    drag(qtbot, shown, QPoint(round(shown._x(20.0)), middle), QPoint(round(shown._x(60.0)), middle))
    low, high = session.network.get("all.interval")
    assert low == 10.0
    assert high == pytest.approx(60.0, abs=1.0)
    centre = round((shown._x(low) + shown._x(high)) / 2)
    drag(qtbot, shown, QPoint(centre, middle), QPoint(centre + 30, middle))
    moved = session.network.get("all.interval")
    assert moved[0] > low
    assert moved[1] - moved[0] == pytest.approx(high - low, abs=0.2)


def test_the_colour_picker_is_one_step_per_drag(alone: Any, session: Any, qtbot: Any) -> None:
    field = alone("color").field
    assert isinstance(field, ColorField)
    qtbot.mouseClick(field.swatch, LEFT)
    square = field.picker.square
    drag(qtbot, square, QPoint(100, 60), QPoint(150, 30), QPoint(195, 0))
    assert session.network.get("all.color") == pytest.approx(to_linear(to_qcolor((1.0, 0.5, 0.0))), abs=0.02)
    assert len(session.history._done) == 1
    enter(qtbot, field.picker.hex, "#0000ff")
    assert session.network.get("all.color") == (0.0, 0.0, 1.0)
    field.picker.close()


def test_a_file_beside_the_workspace_is_stored_relative(alone: Any, session: Any, tmp_path: Path) -> None:
    shown = alone("path")
    session.save(tmp_path / "net.json")
    (tmp_path / "ct.nii").write_bytes(b"")
    shown.field._chosen(str(tmp_path / "ct.nii"))
    assert session.network.get("all.path") == "ct.nii"


def test_a_plane_goes_to_the_middle_of_the_volume(alone: Any, session: Any, qtbot: Any) -> None:
    shown = alone("plane")
    shown.field.buttons["Centre"].click()
    assert "not known yet" in shown.error.text()
    with qtbot.waitSignal(session.values_changed, timeout=10000):
        session.ask("cube", None)
    shown.field.buttons["Centre"].click()
    assert session.network.get("all.plane").origin == tuple(session.value("cube", "volume").centre)
    session.undo()
    assert session.network.get("all.plane") == data.Plane()


def test_kinds_of_plugins() -> None:
    """A derived kind gets its parent's widget, another one shows its JSON."""

    class Percent(params.Float):
        pass

    class Pair(params.Parameter):
        pass

    assert widget_for(Percent(0.5, doc="x")) is WIDGETS[params.Float]
    assert widget_for(Pair([1, 2], doc="x")) is JsonField


def test_json_field(qtbot: Any) -> None:
    class Pair(params.Parameter):
        pass

    field = make_field(Pair([1, 2], doc="x"))
    qtbot.addWidget(field)
    field.show_value([1, 2])
    seen: list[Any] = []
    refused: list[str] = []
    field.edited.connect(seen.append)
    field.refused.connect(refused.append)
    enter(qtbot, field.entry, "[3, 4]")
    enter(qtbot, field.entry, "[3, ")
    assert seen == [[3, 4]]
    assert len(refused) == 1


def test_numbers_as_text() -> None:
    assert [short(v) for v in (3, 0.25, 1e-5, 123456.0, float("inf"))] == ["3", "0.25", "1e-5", "1.2346e5", "inf"]
    assert typed("2*3", integer=True) == 6
    assert typed("1,5") == 1.5
    with pytest.raises(ParameterError):
        typed("a")


@pytest.mark.parametrize(("low", "high"), [(0.0, 10.0), (1e-7, 1.0), (-5.0, 5.0)])
def test_a_slider_gives_back_what_it_shows(low: float, high: float) -> None:
    scale = Scale(low, high)
    for place in (0.0, 0.25, 0.5, 1.0):
        assert scale.place(scale.value(place)) == pytest.approx(place, abs=0.01)
