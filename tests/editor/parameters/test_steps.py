"""Wheel, arrow keys, units and what lies beyond a slider: the same for every kind that has numbers."""

from __future__ import annotations

from typing import Any

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QApplication, QLabel, QLineEdit, QWidget

from nodegraph import params, registry
from nodegraph.editor.parameters import WIDGETS, make_field, widget_for
from nodegraph.editor.parameters.numbers import NumberEntry, NumberField
from nodegraph.editor.parameters.several import Numbers
from nodegraph.editor.parameters.values import Parts

BOX = ((0.0, 0.0, 0.0), (5.0, 5.0, 5.0))
NUMBERS = ("amount", "free", "tiny", "count", "seed", "vector", "matrix", "interval", "box", "camera", "light", "plane")


def entries(field: QWidget) -> list[NumberEntry]:
    return [entry for entry in field.findChildren(NumberEntry) if entry.isVisible()]


def turn(widget: QWidget, notches: int) -> None:
    at = QPointF(widget.width() / 2, widget.height() / 2)
    none, still = Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase
    event = QWheelEvent(
        at, widget.mapToGlobal(at), QPoint(), QPoint(0, 120 * notches), Qt.MouseButton.NoButton, none, still, False
    )
    QApplication.sendEvent(widget, event)


def test_all_kinds_with_numbers_are_tried(session: Any) -> None:
    declared = session.network.node("all").processor.params
    tried = {widget_for(declared[name]) for name in NUMBERS}
    assert tried == {field for field in WIDGETS.values() if issubclass(field, (NumberField, Numbers, Parts))}


@pytest.mark.parametrize("name", NUMBERS)
def test_arrows_and_wheel_step_every_number_and_are_undone_together(
    name: str, alone: Any, session: Any, qtbot: Any
) -> None:
    if name == "box":
        session.network.set("all.box", BOX)
    session.history.clear()
    shown = alone(name)
    before = session.network.get(f"all.{name}")
    for entry in entries(shown.field)[:6]:
        entry.clearFocus()
        turn(entry, 1)
        assert session.network.get(f"all.{name}") == before, "without the focus the wheel scrolls the panel"
        entry.setFocus()
        qtbot.keyClick(entry, Qt.Key.Key_Up)
        once = session.network.get(f"all.{name}")
        assert once != before
        turn(entry, 1)
        assert session.network.get(f"all.{name}") != once
        shown.leave()
        session.undo()
        assert session.network.get(f"all.{name}") == before


def test_the_range_and_the_list_turn_with_the_wheel_too(alone: Any, session: Any, qtbot: Any) -> None:
    interval = alone("interval")
    interval.field.range.clearFocus()
    turn(interval.field.range, 1)
    assert session.network.get("all.interval") == (10.0, 20.0)
    interval.field.range.setFocus()
    turn(interval.field.range, 2)
    assert session.network.get("all.interval") == (12.0, 20.0)
    qtbot.keyClick(interval.field.range, Qt.Key.Key_Space)
    qtbot.keyClick(interval.field.range, Qt.Key.Key_Left)
    assert session.network.get("all.interval") == (12.0, 19.0)
    interval.leave()
    mode = alone("mode")
    mode.field.options.setFocus()
    turn(mode.field.options, -1)
    turn(mode.field.options, -1)
    turn(mode.field.options, -1)
    assert session.network.get("all.mode") == "three_words"
    mode.leave()
    session.undo()
    assert session.network.get("all.mode") == "one", "notches are one step"
    session.undo()
    assert session.network.get("all.interval") == (10.0, 20.0)


@pytest.mark.parametrize(
    ("name", "typed", "value"),
    [("amount", "70", 70.0), ("count", "12", 12), ("tiny", "1e-7", 1e-7), ("seed", "7", 7)],
)
def test_what_is_typed_may_lie_beyond_the_slider(name: str, typed: str, value: Any, alone: Any, session: Any) -> None:
    entry = alone(name).field.entry
    enter(entry, typed)
    assert session.network.get(f"all.{name}") == value


def test_an_interval_beyond_its_slider_is_shown_at_its_end(alone: Any, session: Any) -> None:
    field = alone("interval").field
    enter(field.entries[1], "4000")
    enter(field.entries[0], "-1000")
    assert session.network.get("all.interval") == (-1000.0, 4000.0)
    assert [field.range.scale.place(value) for value in session.network.get("all.interval")] == [0.0, 1.0]


def enter(entry: QLineEdit, text: str) -> None:
    entry.setText(text)
    entry.setModified(True)
    entry.editingFinished.emit()


def test_units_are_shown(alone: Any, session: Any) -> None:
    session.network.set("all.box", BOX)
    session.network.set("all.light", {"type": "point"}, encoded=True)
    alone("amount").field.entry.clearFocus()
    assert alone("amount").field.entry.text() == "1 mm"
    assert [entry.text() for entry in alone("interval").field.entries] == ["10 HU", "20 HU"]
    for name, word in (("vector", "mm"), ("box", "mm"), ("camera", "Eye, mm"), ("light", "From, mm"), ("plane", "mm")):
        assert any(word in label.text() for label in alone(name).field.findChildren(QLabel)), name
    assert alone("camera").field.fields["field_of_view"].entry.text() == "30 deg"


def test_every_kind_there_is_has_a_widget() -> None:
    """Also one that was written and forgotten in the table of kinds."""

    def derived(kind: type[params.Parameter]) -> set[type[params.Parameter]]:
        return {kind, *(one for child in kind.__subclasses__() for one in derived(child))}

    ours = {kind for kind in derived(params.Parameter) if kind.__module__.startswith("nodegraph.params.")}
    public = {kind for kind in ours if not kind.__name__.startswith("_")} - {params.Parameter, params.Bounded}
    assert public == set(params.kinds().values()) == set(WIDGETS)


def test_every_parameter_of_every_processor_is_shown(qtbot: Any) -> None:
    """Its widget shows the default, and takes an end of its range, without a word of complaint."""
    seen = set()
    for id in registry.ids():
        for declared in registry.find(id).params.values():
            key = (declared.kind, str(declared.describe()))
            if isinstance(declared, params.TransferFunction) or key in seen:
                continue
            seen.add(key)
            field = make_field(declared)
            qtbot.addWidget(field)
            field.show_value(declared.default)
            for end in (getattr(declared, "soft_min", None), getattr(declared, "soft_max", None)):
                if end is not None and isinstance(field, NumberField):
                    field.show_value(declared.check(end, id))
    assert len(seen) > 50
