"""The panel of shared values, and the arcs between the nodes that share them."""

from __future__ import annotations

import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit, QTreeWidgetItem
from pytestqt.qtbot import QtBot

from nodegraph.commands import Remove, Set
from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.canvas.link_table import EXPRESSION, NAME, VALUE, LinkTable
from nodegraph.editor.session import Session
from nodegraph.group_commands import Group
from nodegraph.variable_commands import AddVariable, Link, SetExpression
from tests.editor.canvas.conftest import Hand, text_of


@pytest.fixture
def table(session: Session, canvas: CanvasView, qtbot: QtBot) -> LinkTable:
    """Two cameras are shared, and the width of the blur is half of a number that nobody follows."""
    session.do(Link("rays.camera", "camera"))
    session.do(Link("raycast.camera", "camera"))
    session.do(Link("blur.sigma", "fine"))
    session.do(Set("blur.sigma", 2.0))
    session.do(AddVariable("coarse", "Float", expression="2 * fine"))
    made = LinkTable(session)
    made.marked.connect(canvas.scene.arcs.mark)
    qtbot.addWidget(made)
    made.resize(900, 260)
    made.show()
    return made


def row(table: LinkTable, name: str) -> QTreeWidgetItem:
    return next(item for item in table._tops() if item.text(NAME) == name)


def type_into(table: LinkTable, name: str, column: int, text: str) -> None:
    """Edit a cell as somebody with a keyboard does."""
    item = row(table, name)
    table.tree.setCurrentItem(item, column)
    table.tree.editItem(item, column)
    field = table.tree.viewport().findChild(QLineEdit)
    assert field is not None
    field.setText(text)
    QTest.keyClick(field, Qt.Key.Key_Return)
    field.setParent(None)


def test_it_shows_what_the_document_has(session: Session, table: LinkTable) -> None:
    camera, fine, coarse = row(table, "camera"), row(table, "fine"), row(table, "coarse")
    assert [camera.child(i).text(NAME) for i in range(2)] == ["rays.camera", "raycast.camera"]
    assert fine.text(VALUE) == "2"
    assert (coarse.text(EXPRESSION), coarse.text(VALUE)) == ("2 * fine", "4")
    session.do(Set("blur.sigma", 3.0))
    table.refresh()
    assert (fine.text(VALUE), coarse.text(VALUE)) == ("3", "6")
    session.do(Remove(["raycast"]))
    table.refresh()
    assert row(table, "camera").childCount() == 1
    assert table.summary.text() == "3 variables, followed by 2 parameters"


def test_expressions_names_and_values_are_typed(session: Session, table: LinkTable) -> None:
    before = text_of(session)
    type_into(table, "coarse", EXPRESSION, "fine + 1")
    assert session.network.variables["coarse"].expression == "fine + 1"
    assert row(table, "coarse").text(VALUE) == "3"
    type_into(table, "fine", NAME, "thin")
    assert session.network.node("blur").links["sigma"] == "thin"
    assert row(table, "coarse").text(EXPRESSION) == "thin + 1"
    type_into(table, "thin", VALUE, "5")
    assert session.network.get("blur.sigma") == 5.0
    for _ in range(3):
        session.undo()
    assert text_of(session) == before


@pytest.mark.parametrize(
    ("name", "column", "text", "said"),
    [
        ("coarse", EXPRESSION, "fine +", "fine +"),
        ("coarse", EXPRESSION, "fin * 2", "fine"),
        ("coarse", EXPRESSION, "coarse", "follows itself"),
        ("fine", VALUE, "-4", "-4"),
        ("fine", VALUE, "thick", "thick"),
        ("fine", NAME, "camera", "camera"),
    ],
)
def test_what_is_refused_is_told_and_can_be_mended(
    session: Session, table: LinkTable, name: str, column: int, text: str, said: str
) -> None:
    before = text_of(session)
    type_into(table, name, column, text)
    assert text_of(session) == before
    assert not table.error.isHidden()
    assert said in table.error.text()
    assert table.shown_text(name, column) == text
    table.refresh()
    assert row(table, name).text(NAME) == name
    session.do(Set("blur.sigma", 1.5))
    assert table.error.isHidden()


def test_cells_that_hold_no_text_are_not_edited(session: Session, table: LinkTable) -> None:
    assert not table.can_enter("camera", VALUE)
    assert not table.can_enter("coarse", VALUE)
    assert table.can_enter("fine", VALUE)


def test_menus_remove_and_let_go(session: Session, table: LinkTable) -> None:
    before = text_of(session)
    menu = table.menu_for(row(table, "camera"))
    next(action for action in menu.actions() if action.text() == "Remove").trigger()
    assert "camera" not in session.network.variables
    assert session.network.node("rays").links == {}
    session.undo()
    assert text_of(session) == before
    table.refresh()
    child = row(table, "camera").child(0)
    next(action for action in table.menu_for(child).actions() if action.text() == "Follow no longer").trigger()
    assert session.network.node("rays").links == {}
    table.tree.setCurrentItem(row(table, "fine"))
    QTest.keyClick(table.tree, Qt.Key.Key_Delete)  # coarse is derived from it
    assert "coarse" in table.error.text()
    next(a for a in table.menu_for(row(table, "coarse")).actions() if a.text() == "Make it plain").trigger()
    assert session.network.variables["coarse"].expression == ""


def test_a_click_on_a_parameter_goes_to_its_node(session: Session, table: LinkTable) -> None:
    session.do(Group(["raycast"]))
    table.refresh()
    child = row(table, "camera").child(1)
    assert child.text(NAME) == "group/raycast.camera"
    where = table.tree.visualItemRect(child).center()
    QTest.mouseClick(table.tree.viewport(), Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, where)
    assert session.level == "group"
    assert session.selection == ("group/raycast",)


def test_arcs_join_what_shares(session: Session, canvas: CanvasView, hand: Hand, table: LinkTable) -> None:
    arcs = canvas.scene.arcs
    assert arcs.items == []
    hand.key(Qt.Key.Key_K)
    assert {(item.variable, item.start, item.end) for item in arcs.items} == {("camera", "rays", "raycast")}
    before = arcs.items[0].path()
    hand.drag(hand.title("rays"), hand.title("rays") + QPointF(0, 60))
    assert arcs.items[0].path() != before
    session.do(Link("view.camera", "camera"))
    canvas.scene.arcs.sync()
    assert {(item.start, item.end) for item in arcs.items} == {("rays", "raycast"), ("raycast", "view")}
    assert [item.label.text for item in arcs.items if item.label is not None] == ["camera"]
    canvas.grab()
    hand.key(Qt.Key.Key_K)
    assert arcs.items == []


def test_a_derived_variable_hangs_on_what_it_is_derived_from(
    session: Session, canvas: CanvasView, table: LinkTable, qtbot: QtBot
) -> None:
    session.do(SetExpression("coarse", ""))
    table.refresh()
    session.do(AddVariable("half", "Float", expression="fine / 2"))
    name = next(
        name for name, declared in session.network.node("volume").processor.params.items() if declared.kind == "Float"
    )
    session.do(Link(f"volume.{name}", "half"))
    canvas.toggle_arcs()
    derived = [item for item in canvas.scene.arcs.items if item.derived]
    assert [(item.variable, item.start, item.end) for item in derived] == [("half", "blur", "volume")]
    assert derived[0].label is not None
    assert derived[0].label.text == "half = fine / 2"


def test_the_current_variable_is_drawn_alone(session: Session, canvas: CanvasView, table: LinkTable) -> None:
    table.tree.setCurrentItem(row(table, "camera"))
    assert [item.variable for item in canvas.scene.arcs.items] == ["camera"]
    table.tree.setCurrentItem(row(table, "fine"))
    assert canvas.scene.arcs.items == []
    table.tree.setCurrentItem(row(table, "camera"))
    session.enter("")
    session.new()
    assert canvas.scene.arcs.items == []
    assert table.tree.topLevelItemCount() == 0
