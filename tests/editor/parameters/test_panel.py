"""The panel: selection, visibility, who decides a value, and the menu of a parameter."""

from __future__ import annotations

from typing import Any

import pytest
from PySide6.QtCore import QEvent, QPoint, Qt
from PySide6.QtGui import QContextMenuEvent, QGuiApplication, QKeyEvent
from PySide6.QtWidgets import QApplication, QMenu

from nodegraph.editor.parameters.menu import ParameterMenu
from nodegraph.editor.parameters.place import Place, shown_parameters


def action(menu: QMenu, text: str) -> Any:
    """The action of a menu, or of a menu inside it, whose text begins so."""
    for one in menu.actions():
        if one.menu() is not None:
            found = action(one.menu(), text)
            if found is not None:
                return found
        elif one.text().startswith(text):
            return one
    return None


def test_it_shows_the_selection(panel: Any, session: Any) -> None:
    assert list(panel.sections) == ["all"]
    session.select("cube", "number")
    assert list(panel.sections) == ["cube", "number"]
    assert not panel.sections["number"].nothing.isHidden()
    session.select()
    assert not panel.sections
    assert panel.note.text().startswith("Select a node")


def test_it_follows_renaming_and_removal(panel: Any, session: Any) -> None:
    session.network.rename("all", "renamed")
    assert list(panel.sections) == ["renamed"]
    session.network.remove("renamed")
    assert not panel.sections
    session.undo()


def test_rows_are_made_bit_by_bit(panel: Any, session: Any, qtbot: Any) -> None:
    session.select("other")
    section = panel.sections["other"]
    names = shown_parameters(session, "other")
    qtbot.waitUntil(lambda: len(section.rows) == len(names), timeout=5000)
    assert names == [section.layout_of_rows.itemAt(i).widget().place.name for i in range(len(names))]


def test_visible_if_is_obeyed_live(panel: Any, session: Any) -> None:
    section = panel.sections["all"]
    section.complete()
    assert "only_two" not in section.rows
    session.network.set("all.mode", "two")
    section.complete()
    assert section.rows["only_two"].isVisibleTo(section)
    session.undo()
    assert not section.rows["only_two"].isVisibleTo(section)


def test_the_doc_is_the_tooltip(alone: Any) -> None:
    shown = alone("amount")
    assert "A number with a soft range." in shown.label.toolTip()
    assert "Default: 1.0 mm" in shown.label.toolTip()
    assert "A number with a soft range." in shown.field.toolTip()


def test_the_menu_resets(alone: Any, session: Any) -> None:
    shown = alone("amount")
    assert not action(shown.menu(), "Reset").isEnabled()
    session.network.set("all.amount", 2.0)
    action(shown.menu(), "Reset").trigger()
    assert session.network.get("all.amount") == 1.0


@pytest.mark.parametrize("name", ["amount", "on", "mode", "title", "color", "camera", "table", "box"])
def test_copy_and_paste(name: str, alone: Any, session: Any) -> None:
    from nodegraph.testing.samples import another

    shown = alone(name)
    declared = shown.declared
    value = declared.check(another(declared), name)
    session.network.set(f"other.{name}", value)
    QGuiApplication.clipboard().setText(Place(session, "other", name).text())
    action(shown.menu(), "Paste").trigger()
    assert session.network.get(f"all.{name}") == value
    action(shown.menu(), "Copy").trigger()
    assert QGuiApplication.clipboard().text() == Place(session, "other", name).text()


def test_what_cannot_be_pasted_is_said(alone: Any, session: Any) -> None:
    shown = alone("amount")
    QGuiApplication.clipboard().setText("[1, 2]")
    action(shown.menu(), "Paste").trigger()
    assert session.network.get("all.amount") == 1.0
    assert "expected a number" in shown.error.text()


def test_link_to_a_variable_and_unlink(alone: Any, session: Any) -> None:
    network, shown = session.network, alone("amount")
    action(shown.menu(), "New variable").trigger()
    assert network.node("all").links == {"amount": "amount"}
    assert shown.tied.text() == "follows the variable amount"
    assert shown.field.isEnabled(), "a plain variable is set by whoever follows it"
    shown.place.set(4.0)
    assert network.get("amount") == 4.0
    other = alone("free")
    names = [one.text() for one in action_menu(other.menu(), "Link to").actions()]
    assert names == ["amount", "", "New variable “free”"]
    action(other.menu(), "amount").trigger()
    assert network.get("all.free") == 4.0
    assert "amount" not in [one.text() for one in action_menu(alone("title").menu(), "Link to").actions()]
    action(other.menu(), "Unlink from amount").trigger()
    assert network.node("all").links == {"amount": "amount"}
    assert network.get("all.free") == 4.0
    for _ in range(4):
        session.undo()
    assert shown.tied.isHidden()


def action_menu(menu: QMenu, title: str) -> Any:
    return next(one.menu() for one in menu.actions() if one.text() == title)


def test_an_expression(alone: Any, session: Any, qtbot: Any) -> None:
    network = session.network
    network.link("other.amount", "coarse")
    network.set("coarse", 8.0)
    shown = alone("amount")
    action(shown.menu(), "Expression").trigger()
    assert shown.expression.isVisible()
    qtbot.keyClicks(shown.expression, "coarse / 4")
    qtbot.keyClick(shown.expression, Qt.Key.Key_Return)
    assert network.get("all.amount") == 2.0
    assert not shown.field.isEnabled()
    assert shown.expression.text() == "= coarse / 4"
    session.undo()
    assert network.get("all.amount") == 1.0, "variable and link are one step"
    assert "all_amount" not in network.variables
    session.redo()
    shown.expression.setFocus()
    shown.expression.selectAll()
    qtbot.keyClicks(shown.expression, "= coarse / 8")
    qtbot.keyClick(shown.expression, Qt.Key.Key_Return)
    assert network.get("all.amount") == 1.0
    shown.expression.selectAll()
    qtbot.keyClicks(shown.expression, "missing + 1")
    qtbot.keyClick(shown.expression, Qt.Key.Key_Return)
    assert "missing" in shown.error.text()
    assert network.variables["all_amount"].expression == "coarse / 8"


def test_a_refused_expression_changes_nothing(alone: Any, session: Any) -> None:
    assert "outside" in alone("count").place.express("100")
    assert not session.network.variables
    assert not session.history.undo_name


def test_a_wire_decides(alone: Any, session: Any) -> None:
    shown = alone("free")
    session.network.connect("number.number", "all.free")
    assert shown.tied.text() == "wired from number.number"
    assert not shown.field.isEnabled()
    assert action_menu_titles(shown.menu()) == []
    session.undo()
    assert shown.field.isEnabled()


def action_menu_titles(menu: QMenu) -> list[str]:
    return [one.text() for one in menu.actions() if one.menu() is not None]


def test_the_value_of_a_wire_is_shown_when_it_is_known(row: Any, session: Any, qtbot: Any) -> None:
    session.network.connect("number.number", "all.free")
    shown = row("free")
    with qtbot.waitSignal(session.values_changed, timeout=10000):
        session.ask("number", None)
    assert shown.field.value == 0.25


def test_the_right_button_opens_the_menu(alone: Any, qtbot: Any) -> None:
    shown = alone("amount")
    event = QContextMenuEvent(QContextMenuEvent.Reason.Mouse, QPoint(5, 5), shown.mapToGlobal(QPoint(5, 5)))
    QApplication.sendEvent(shown, event)
    menu = QApplication.activePopupWidget()
    assert isinstance(menu, ParameterMenu)
    assert menu.row is shown
    menu.close()


def test_a_group_shows_its_face(panel: Any, session: Any) -> None:
    network = session.network
    network.group("other", id="finish")
    node = network.node("finish")
    node.expose.params["strength"] = ("other.amount",)
    session.select("finish")
    shown = panel.row("finish", "strength")
    shown.place.set(7.0)
    assert network.get("finish/other.amount") == 7.0


def test_a_value_that_cannot_be_used_is_said(panel: Any, session: Any) -> None:
    from nodegraph.network import Kept

    node = session.network.node("other")
    node.params["amount"] = Kept("x", ": expected a number, got 'x'")
    node.params["ancient"] = Kept(3, ": no such parameter")
    session.select("other")
    assert "expected a number" in panel.row("other", "amount").error.text()
    assert panel.sections["other"].trouble.text() == "ancient: kept as it was stored: no such parameter"
    panel.row("other", "amount").reset()
    assert session.network.get("other.amount") == 1.0


def test_a_gesture_ends_when_its_widget_goes(row: Any, session: Any, qtbot: Any) -> None:
    slider = row("amount").field.slider
    qtbot.mousePress(slider, Qt.MouseButton.LeftButton, pos=QPoint(30, 10))
    assert session.in_gesture
    session.select("other")
    assert not session.in_gesture
    session.undo()
    assert session.network.get("all.amount") == 1.0


def test_nothing_is_left_behind(session: Any, qtbot: Any) -> None:
    from nodegraph.editor.parameters import ParameterPanel

    for _ in range(3):
        shown = ParameterPanel(session)
        session.select("all")
        shown.row("all", "table")
        session.select()
        shown.close()
        shown.deleteLater()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        QApplication.processEvents()
    assert not [widget for widget in QApplication.allWidgets() if type(widget).__name__ == "ParameterRow"]


def test_steps_end_before_a_shortcut_is_looked_up(alone: Any, session: Any, qtbot: Any) -> None:
    """Undo right after an arrow key takes that step back; it is not refused for a gesture that is still open."""
    slider = alone("amount").field.slider
    slider.setFocus()
    qtbot.keyClick(slider, Qt.Key.Key_Right)
    assert session.in_gesture
    control = Qt.KeyboardModifier.ControlModifier
    QApplication.sendEvent(slider, QKeyEvent(QEvent.Type.ShortcutOverride, Qt.Key.Key_Z, control))
    assert not session.in_gesture
    session.undo()
    assert session.network.get("all.amount") == 1.0


def test_a_new_palette_reaches_icons_and_widgets(panel: Any, row: Any, session: Any) -> None:
    old = row("amount")
    palette = panel.palette()
    palette.setColor(palette.ColorRole.Highlight, Qt.GlobalColor.magenta)
    panel.setPalette(palette)
    assert row("amount") is not old


def test_what_was_selected_before_comes_back_as_it_is_now(panel: Any, session: Any) -> None:
    panel.sections["all"].complete()
    first = panel.sections["all"]
    row = first.rows["count"]
    session.select("cube")
    assert first.isHidden()
    session.network.set("all.count", 7)
    session.select("all")
    assert panel.sections["all"] is first
    assert first.rows["count"] is row
    assert row.field.entry.text() == "7"
    assert not first.isHidden()
    session.select()
    session.network.remove("all")
    session.undo()
    session.select("cube")
    assert all(section.node in session.network.nodes.values() for section in panel._kept.values())


def test_what_has_keys_is_marked(panel: Any, row: Any, session: Any) -> None:
    shown = row("amount")
    assert not shown.label.keyed
    shown.place.add_key()
    assert shown.label.keyed
    assert not row("free").label.keyed
    session.undo()
    assert not shown.label.keyed


def test_a_tall_widget_is_folded_for_all_nodes_of_its_type_and_stays_so(panel: Any, row: Any, session: Any) -> None:
    from nodegraph import workspace
    from tests.editor.parameters.conftest import find

    session.history.mark_saved()
    shown = row("camera")
    assert shown.arrow.isVisible()
    shown.arrow.click()
    assert shown.field.isHidden()
    assert not session.modified, "how the panel looks is no edit"
    session.select("other")
    assert panel.row("other", "camera").field.isHidden()
    again = workspace.loads(workspace.dumps(session.network), find=find)
    assert again.ui["folded"] == ["everything.camera"]
    panel.row("other", "camera").arrow.click()
    assert not panel.row("other", "camera").field.isHidden()
    assert "folded" not in session.network.ui
    assert panel.row("other", "amount").arrow.isHidden()
