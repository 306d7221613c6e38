"""Every entry of a parameter's menu: what it does, and that undo takes it back."""

from __future__ import annotations

import json
from typing import Any

import pytest
from PySide6.QtCore import QPoint
from PySide6.QtGui import QContextMenuEvent, QGuiApplication
from PySide6.QtWidgets import QApplication, QMenu

from nodegraph import animation, data, workspace
from nodegraph.editor.parameters import preset_files, presets
from nodegraph.editor.parameters.menu import ParameterMenu
from nodegraph.editor.parameters.place import Place
from nodegraph.network import Network
from tests.editor.parameters.conftest import find


def action(menu: QMenu, text: str) -> Any:
    """The action of a menu, or of a menu inside it, whose text begins so."""
    for one in menu.actions():
        inner = one.menu()
        found = action(inner, text) if inner is not None else one if one.text().startswith(text) else None
        if found is not None:
            return found
    return None


def document(session: Any) -> str:
    told: str = workspace.dumps(session.network)
    return told


def titles(menu: QMenu) -> list[str]:
    return [one.text() for one in menu.actions() if one.text()]


def test_all_that_it_offers(alone: Any, session: Any) -> None:
    QGuiApplication.clipboard().setText("2")
    assert titles(alone("amount").menu()) == [
        "Reset to default", "Copy value", "Copy as Python", "Paste value", "Presets", "Link to", "Expression …",
        "Add a key at frame 0",
    ]  # fmt: skip
    assert titles(alone("title").menu()) == [
        "Reset to default", "Copy value", "Copy as Python", "Paste value", "Presets", "Link to", "Add a key at frame 0",
    ]  # fmt: skip
    assert "Presets" not in titles(alone("table").menu()), "its editor has its own"
    session.network.connect("number.number", "all.free")
    assert titles(alone("free").menu()) == ["Reset to default", "Copy value", "Copy as Python", "Paste value"]
    assert not action(alone("free").menu(), "Paste").isEnabled()


@pytest.mark.parametrize(
    "name", ["amount", "on", "mode", "title", "color", "vector", "matrix", "box", "camera", "table"]
)
def test_python_says_the_same(name: str, alone: Any, session: Any) -> None:
    from nodegraph.testing.samples import another

    shown = alone(name)
    shown.place.set(another(shown.declared))
    action(shown.menu(), "Copy as Python").trigger()
    text = QGuiApplication.clipboard().text()
    assert text.startswith(f"net.set('all.{name}', ")
    net = Network(find)
    net.add("everything", "all")
    exec(text, {"net": net})
    assert net.get(f"all.{name}") == session.network.get(f"all.{name}")


def test_python_says_numbers_that_no_literal_can_say() -> None:
    from nodegraph import params
    from nodegraph.editor.parameters.place import _literal

    declared = params.Float(0.0, finite=False, doc="x")
    assert _literal(declared, float("inf")) == "'inf', encoded=True"
    assert _literal(declared, 0.5) == "0.5"


def test_python_says_who_decides(alone: Any, session: Any) -> None:
    net = session.network
    net.set("all.amount", 4.0)
    net.link("all.amount", "coarse")
    alone("free").place.express("coarse / 8")
    assert alone("amount").place.as_python() == "net.link('all.amount', 'coarse')\nnet.set('coarse', 4.0)"
    derived = alone("free").place.as_python()
    net.connect("number.number", "all.tiny", replace=True)
    wired = alone("tiny").place.as_python()
    again = Network(find)
    again.add("everything", "all")
    again.add("number", "number")
    for text in (alone("amount").place.as_python(), derived, wired):
        exec(text, {"net": again})
    assert (again.get("all.amount"), again.get("all.free")) == (4.0, 0.5)
    assert again.node("all").inputs["tiny"] == ("number.number",)


def test_on_the_face_of_a_group_and_off_it(panel: Any, session: Any) -> None:
    net = session.network
    net.group("other", id="finish")
    session.history.clear()
    session.select("finish/other")
    shown = panel.row("finish/other", "amount")
    before = document(session)
    action(shown.menu(), "Show on the face of “finish”").trigger()
    assert net.node("finish").expose.params == {"amount": ("other.amount",)}
    after = document(session)
    action(shown.menu(), "Take off the face of “finish”").trigger()
    assert document(session) == before
    session.undo()
    assert document(session) == after
    session.undo()
    assert document(session) == before
    assert action(shown.menu(), "Show on the face").isEnabled()
    net.node("finish").expose.params["amount"] = ("other.free",)
    shown.place.show_on_face()
    assert net.node("finish").expose.params["amount_2"] == ("other.amount",)


def test_keys_at_the_frame_that_is_shown(alone: Any, session: Any) -> None:
    shown = alone("amount")
    session.frame = 12
    action(shown.menu(), "Add a key at frame 12").trigger()
    session.frame = 20
    shown.place.set(3.0)
    action(shown.menu(), "Add a key at frame 20").trigger()
    (track,) = animation.tracks_of(session.network)
    assert [(key.frame, key.value) for key in track.keys] == [(12, 1.0), (20, 3.0)]
    shown.place.set(4.0)
    action(shown.menu(), "Replace the key at frame 20").trigger()
    assert animation.track_of(session.network, "all.amount").at(20) == 4.0
    session.undo()
    assert animation.track_of(session.network, "all.amount").at(20) == 3.0
    action(shown.menu(), "Remove the key at frame 20").trigger()
    assert shown.place.keys() == [12]
    session.undo()
    assert shown.place.keys() == [12, 20]


def test_a_preset_is_saved_chosen_and_deleted(alone: Any, session: Any) -> None:
    camera = data.Camera((1, 2, 3))
    shown = alone("camera")
    shown.place.set(camera)
    dialog = _submenu(shown.menu(), "Presets").ask_name()
    dialog.setTextValue("Over there")
    dialog.accept()
    (file,) = preset_files.own_folder().glob("*.json")
    assert json.loads(file.read_text())["name"] == "Over there"
    shown.place.reset()
    action(shown.menu(), "Over there").trigger()
    assert session.network.get("all.camera") == camera
    session.undo()
    assert session.network.get("all.camera") != camera
    delete = next(one.menu() for one in _submenu(shown.menu(), "Presets").actions() if one.menu() is not None)
    action(delete, "Over there").trigger()
    assert not list(preset_files.own_folder().glob("*.json"))
    assert titles(_submenu(shown.menu(), "Presets")) == ["Save as a preset …"]


def _submenu(menu: QMenu, title: str) -> Any:
    return next(one.menu() for one in menu.actions() if one.text() == title)


def test_a_number_is_a_preset_of_its_own_parameter_alone(alone: Any, session: Any) -> None:
    presets.keep(alone("amount").place, "fine")
    assert [one.name for one in presets.presets_for(Place(session, "other", "amount"))] == ["fine"]
    assert presets.presets_for(alone("free").place) == []


def test_presets_that_cannot_be_used_are_left_out(alone: Any) -> None:
    preset_files.own_folder().mkdir(parents=True)
    for number, text in enumerate(('{"name": "a", "kind": "Camera"}', "[", "[1]", '{"kind": "Camera", "value": 3}')):
        (preset_files.own_folder() / f"{number}.json").write_text(text)
    assert presets.presets_for(alone("camera").place) == []


def test_a_preset_that_cannot_be_written_is_said(alone: Any, session: Any) -> None:
    from nodegraph.editor.parameters.preset_menu import save

    told = []
    session.message.connect(told.append)
    preset_files.own_folder().parent.mkdir(parents=True, exist_ok=True)
    preset_files.own_folder().write_text("in the way")
    save(alone("amount").place, "fine")
    save(alone("amount").place, "  ")
    assert [message.text[:28] for message in told] == ["the preset was not saved: Fi"]


def test_the_right_button_over_a_number_opens_it_too(alone: Any) -> None:
    entry = alone("amount").field.entry
    event = QContextMenuEvent(QContextMenuEvent.Reason.Mouse, QPoint(5, 5), entry.mapToGlobal(QPoint(5, 5)))
    QApplication.sendEvent(entry, event)
    menu = QApplication.activePopupWidget()
    assert isinstance(menu, ParameterMenu)
    menu.close()
