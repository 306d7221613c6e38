"""The field of a camera: from an axis, from a view, from the clipboard, from a preset."""

from __future__ import annotations

import json
from typing import Any

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QApplication

from nodegraph import data
from nodegraph.commands import Set
from nodegraph.editor.parameters import presets
from nodegraph.editor.parameters.camera import CameraField
from nodegraph.editor.parameters.kinds import make_field
from nodegraph.editor.views import navigation as nav
from nodegraph.params import Camera

THERE = data.Camera((100, -200, 300), (10, 20, 30), field_of_view=45.0)


@pytest.fixture
def field(alone: Any) -> CameraField:
    found = alone("camera").field
    assert isinstance(found, CameraField)
    return found


@pytest.mark.parametrize("axis", nav.AXES)
def test_from_an_axis_as_a_view_does_it(field: CameraField, session: Any, axis: str) -> None:
    session.do(Set("all.camera", THERE))
    field.buttons[axis].click()
    assert session.network.get("all.camera") == nav.along(THERE, axis)
    session.undo()
    assert session.network.get("all.camera") == THERE


def test_from_a_view_that_looks_through_another_camera(field: CameraField, session: Any) -> None:
    net = session.network
    net.add("output.view", "view")
    net.connect("other.image", "view.image")
    net.set("other.camera", THERE)
    field.fill_views()
    assert [action.text() for action in field.views.actions()] == ["view"]
    field.views.actions()[0].trigger()
    assert net.get("all.camera") == THERE
    session.undo()
    assert net.get("all.camera") == data.Camera()
    net.link("all.camera", "shared")
    net.link("other.camera", "shared")
    field.fill_views()
    assert [action.isEnabled() for action in field.views.actions()] == [False], "it looks through this one"


def test_copy_and_paste_as_json(field: CameraField, session: Any, alone: Any) -> None:
    session.do(Set("all.camera", THERE))
    field.copy.click()
    assert json.loads(QGuiApplication.clipboard().text()) == THERE.to_json()
    alone("camera").place.reset()
    field.paste.click()
    assert session.network.get("all.camera") == THERE
    for text, says in (("no", "holds no camera"), ('{"eye": [0, 0]}', "clipboard.eye"), ("[1]", "clipboard")):
        QGuiApplication.clipboard().setText(text)
        field.paste.click()
        assert says in alone("camera").error.text()
        assert session.network.get("all.camera") == THERE


def test_the_button_opens_the_same_presets(field: CameraField, session: Any, alone: Any) -> None:
    session.do(Set("all.camera", THERE))
    presets.keep(alone("camera").place, "There")
    alone("camera").place.reset()
    menu = field.presets.menu()
    menu.aboutToShow.emit()
    menu.actions()[0].trigger()
    assert session.network.get("all.camera") == THERE


def test_alone_it_offers_what_needs_no_document(qtbot: Any) -> None:
    field = make_field(Camera(doc="A camera."))
    qtbot.addWidget(field)
    field.show_value(THERE)
    assert field.from_view.isHidden()
    assert field.presets.isHidden()
    seen: list[Any] = []
    field.edited.connect(seen.append)
    field.buttons["left"].click()
    assert seen == [nav.along(THERE, "left")]
    QApplication.sendEvent(field, QEvent(QEvent.Type.PaletteChange))
