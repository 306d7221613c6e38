"""Handles in a view: which there are, that a drag is one step that follows the cursor, and odd places of the eye."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from nodegraph.commands import Remove, Set
from nodegraph.data import Camera, Light, Plane
from nodegraph.editor.session import Session
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.handles import Handles
from nodegraph.editor.views.handles_shapes import cut_outline
from nodegraph.editor.views.view import ViewWidget
from nodegraph.group_commands import ShowPort
from tests.editor.views.hands import opened

LEFT, NONE = Qt.MouseButton.LeftButton, Qt.MouseButton.NoButton
OBLIQUE = Camera((40, -70, 50), (5, 9, 11), field_of_view=40.0)


@pytest.fixture
def view(qtbot: Any, session: Session, until: Callable[..., None]) -> ViewWidget:
    """Looks at the block from aside; a box, a lamp, a cut and another camera are there to be selected."""
    net = session.network
    net.add("geometry.proxy_box", "box")
    net.connect("block.volume", "box.volume")
    net.add("render.raycast", "lamp")
    net.set("lamp.lit", True)
    net.link("lamp.camera", "camera")
    net.add("render.entry_exit_points", "other")
    net.set("cut.plane", Plane((5, 9, 11), (0.2, -0.3, 1.0)))
    net.set("other.camera", Camera((25, -20, 30), (5, 9, 11)))
    net.set("camera", OBLIQUE)
    net.history.clear()
    widget = opened(qtbot, session, "view", 240, 260)
    until(lambda: widget.shown is not None and session.value("block", "volume") is not None)
    return widget


def place(handles: Handles, name: str) -> tuple[float, float]:
    """Where a grip of the only handle is seen."""
    (handle,) = handles.found()
    assert handles.lens is not None
    found = handles.lens.place(handle.shape.grip(handles.lens, name).at)
    assert found is not None
    return found


def send(view: ViewWidget, kind: QEvent.Type, at: tuple[float, float], button=NONE, buttons=NONE) -> None:
    area, point = view.area, QPointF(*at)
    none = Qt.KeyboardModifier.NoModifier
    QApplication.sendEvent(area, QMouseEvent(kind, point, area.mapToGlobal(point), button, buttons, none))


def press(view: ViewWidget, at: tuple[float, float]) -> None:
    send(view, QEvent.Type.MouseButtonPress, at, LEFT, LEFT)


def move(view: ViewWidget, at: tuple[float, float], buttons=LEFT) -> None:
    send(view, QEvent.Type.MouseMove, at, NONE, buttons)


def release(view: ViewWidget, at: tuple[float, float]) -> None:
    send(view, QEvent.Type.MouseButtonRelease, at, LEFT, NONE)


def drag(view: ViewWidget, start: tuple[float, float], end: tuple[float, float]) -> None:
    press(view, start)
    for part in (0.4, 1.0):
        move(view, tuple(a + (b - a) * part for a, b in zip(start, end, strict=True)))
    release(view, end)


DRAGS = [
    # node, grip, parameter, whether the grip stays under the cursor
    ("box", "middle", "box.crop", True),
    ("box", "high x", "box.crop", False),
    ("box", "low z", "box.crop", False),
    ("cut", "origin", "cut.plane", True),
    ("cut", "tilt", "cut.plane", False),
    ("cut", "tilt back", "cut.plane", False),
    ("lamp", "lamp", "lamp.light", False),
    ("other", "eye", "other.camera", True),
    ("other", "target", "other.camera", True),
    ("other", "whole", "other.camera", True),
]


@pytest.mark.parametrize(("node", "grip", "target", "follows"), DRAGS, ids=[f"{d[0]} {d[1]}" for d in DRAGS])
def test_a_drag_is_one_step_and_follows_the_cursor(
    view: ViewWidget, session: Session, node: str, grip: str, target: str, follows: bool
) -> None:
    for camera in (OBLIQUE, nav.switched(OBLIQUE)):
        session.do(Set("view.camera", camera))
        if node == "box":
            session.do(Set("box.crop", ((0.2, 0.2, 0.2), (0.7, 0.8, 0.6))))
        session.select(node)
        session.history.clear()
        before = session.network.get(target)
        start = place(view.handles, grip)
        end = (start[0] + 9.0, start[1] - 7.0)
        drag(view, start, end)
        after = session.network.get(target)
        assert after != before
        if follows:
            assert place(view.handles, grip) == pytest.approx(end, abs=0.1)
        assert session.history.undo_name == f"drag {target.partition('.')[2]}"
        assert not session.in_gesture
        session.undo()
        assert session.network.get(target) == before
        assert session.history.undo_name == ""
        assert session.network.get("camera") == camera, "the view did not turn"


def test_a_face_follows_the_part_of_a_drag_along_its_axis(view: ViewWidget, session: Session) -> None:
    session.select("box")
    start = place(view.handles, "high x")
    toward = place(view.handles, "middle")
    end = tuple(0.7 * a + 0.3 * b for a, b in zip(start, toward, strict=True))
    drag(view, start, end)
    low, high = session.network.get("box.crop")
    assert low == (0.0, 0.0, 0.0), "a box that was everything is one now"
    assert high[1:] == (1.0, 1.0)
    assert place(view.handles, "high x") == pytest.approx(end, abs=0.1)


def test_a_box_stays_within_the_volume_and_is_never_turned_over(view: ViewWidget, session: Session) -> None:
    session.select("box")
    at = place(view.handles, "high x")
    middle = place(view.handles, "middle")
    away = tuple(a + 40.0 * (a - b) for a, b in zip(at, middle, strict=True))
    drag(view, at, away)
    assert session.network.get("box.crop") is None or session.network.get("box.crop")[1] == (1.0, 1.0, 1.0)
    drag(view, at, tuple(2 * a - b for a, b in zip(at, away, strict=True)))
    low, high = session.network.get("box.crop")
    assert low[0] == 0.0
    assert high[0] == pytest.approx(1e-3)


def test_the_outline_of_a_cut_pushes_it(view: ViewWidget, session: Session) -> None:
    session.select("cut")
    (handle,) = view.handles.found()
    a, b = handle.shape.outline[:2]
    at = view.handles.lens.place((a + b) / 2)
    before = session.network.get("cut.plane")
    drag(view, at, (at[0], at[1] - 12.0))
    after = session.network.get("cut.plane")
    assert after.normal == before.normal
    assert np.subtract(after.origin, before.origin) @ before.unit_normal > 1.0
    np.testing.assert_allclose(np.cross(np.subtract(after.origin, before.origin), before.unit_normal), 0.0, atol=1e-3)


def test_hover_lights_and_escape_takes_back(view: ViewWidget, session: Session) -> None:
    session.select("box")
    at = place(view.handles, "low y")
    dark = view.area.grab().toImage()
    move(view, at, NONE)
    assert view.handles._lit == ("box.crop", "low y")
    assert view.area.cursor().shape() == Qt.CursorShape.PointingHandCursor
    assert view.area.grab().toImage() != dark
    press(view, at)
    move(view, (at[0] + 30.0, at[1]))
    assert session.in_gesture
    assert session.network.get("box.crop") is not None
    QTest.keyClick(view, Qt.Key.Key_7)  # no other key joins the drag
    assert session.network.get("camera") == OBLIQUE
    QTest.keyClick(view, Qt.Key.Key_Escape)
    assert session.network.get("box.crop") is None
    release(view, at)
    assert not session.in_gesture
    assert session.history.undo_name == ""
    move(view, (2.0, 2.0), NONE)
    assert view.handles._lit is None
    assert view.area.cursor().shape() != Qt.CursorShape.PointingHandCursor


def test_a_click_on_a_grip_is_no_step(view: ViewWidget, session: Session) -> None:
    session.select("box")
    at = place(view.handles, "low y")
    press(view, at)
    release(view, at)
    assert session.history.undo_name == ""
    assert session.network.get("box.crop") is None
    assert not session.in_gesture


def test_beside_a_grip_the_view_turns(view: ViewWidget, session: Session) -> None:
    session.select("other")
    drag(view, (5.0, 200.0), (30.0, 190.0))
    assert session.network.get("camera") != OBLIQUE
    assert session.history.undo_name == "turn"


def test_h_hides_them_and_only_what_is_selected_has_some(view: ViewWidget, session: Session) -> None:
    assert view.handles.found() == []
    session.select("box", "cut", "ball", "view")
    assert [handle.place.target for handle in view.handles.found()] == ["box.crop", "cut.plane"], "not its own camera"
    QTest.keyClick(view, Qt.Key.Key_H)
    assert view.handles.found() == []
    assert not view.toolbox._handles.isChecked()
    view.toolbox._handles.click()
    assert view.toolbox._handles.isChecked()
    assert len(view.handles.found()) == 2
    session.do(Remove(["box"]))
    assert [handle.place.target for handle in view.handles.found()] == ["cut.plane"]


def test_another_view_shows_the_camera_that_its_picture_is_taken_with(view: ViewWidget, session: Session) -> None:
    net = session.network
    net.add("trial.ball", "ball2")
    net.add("output.view", "view2")
    net.connect("block.volume", "ball2.volume")
    net.connect("ball2.image", "view2.image")
    session.select("view2")
    assert [handle.place.target for handle in view.handles.found()] == ["ball2.camera"]


def test_what_a_wire_decides_is_only_looked_at(view: ViewWidget, session: Session, until: Callable[..., None]) -> None:
    net = session.network
    session.select("cut")
    at = place(view.handles, "tilt")
    net.add("trial.level", "level")
    net.connect("level.plane", "cut.plane")
    session.ask("level", None)
    until(lambda: session.value("level", "plane") is not None)
    until(lambda: [handle.locked for handle in view.handles.found()] == [True])
    assert view.handles.at(at) is None
    view.area.grab()
    session.undo()
    net.link("cut.plane", "shared")
    assert view.handles.at(at) is not None, "a plain variable is set by whoever follows it"


def test_the_face_of_a_group_has_the_handles_of_what_is_behind_it(view: ViewWidget, session: Session) -> None:
    net = session.network
    net.group("box", id="finish")
    session.do(ShowPort("finish", "params", "part", "box.crop"))
    session.select("finish")
    drag(view, place(view.handles, "high z"), place(view.handles, "middle"))
    assert net.get("finish/box.crop") is not None
    session.select("finish/box")
    assert [handle.place.target for handle in view.handles.found()] == ["finish/box.crop"]


def test_a_camera_that_would_look_nowhere_is_refused_silently(view: ViewWidget, session: Session) -> None:
    session.do(Set("view.camera", Camera((5, -70, 11), (5, 9, 11))))
    session.do(Set("other.camera", Camera((25, 9, 11), (5, 9, 11))))
    session.select("other")
    drag(view, place(view.handles, "eye"), place(view.handles, "target"))
    assert session.network.get("other.camera").eye != (25.0, 9.0, 11.0), "the part before is kept"
    assert not [message for message in session.told if message.level == "error"]


@pytest.mark.parametrize("light", [Light("point", "world", (20, -10, 30)), Light("point", "eye", (5, 5, -60))])
def test_a_lamp_at_a_place_stays_under_the_cursor(view: ViewWidget, session: Session, light: Light) -> None:
    session.do(Set("lamp.light", light))
    session.select("lamp")
    start = place(view.handles, "lamp")
    end = (start[0] - 11.0, start[1] + 5.0)
    drag(view, start, end)
    assert place(view.handles, "lamp") == pytest.approx(end, abs=0.2)
    assert session.network.get("lamp.light").frame == light.frame


def test_a_lamp_far_away_goes_with_its_frame(view: ViewWidget, session: Session) -> None:
    session.do(Set("lamp.light", Light("directional", "eye", (0.0, 0.0, 2.0))))
    session.select("lamp")
    start = place(view.handles, "lamp")
    assert start == pytest.approx((view.area.width() / 2, view.area.height() / 2), abs=0.1)
    drag(view, start, (start[0] + 20.0, start[1]))
    x, y, z = session.network.get("lamp.light").position
    assert (x > 0.3, abs(y) < 1e-3, z > 1.0) == (True, True, True)
    assert np.linalg.norm((x, y, z)) == pytest.approx(2.0, rel=1e-3)


ODD = {
    "inside the box": Camera((5, 9, 11), (5, 20, 11)),
    "box behind the eye": Camera((5, 60, 11), (5, 90, 11)),
    "along an edge": Camera((-0.5, -80, -1.5), (-0.5, 0, -1.5)),
    "plane edge-on": Camera((5 - 60, 9, 11), (5, 9, 11)),
    "close to a face": Camera((5, -1.0001, 11), (5, 9, 11)),
}


@pytest.mark.parametrize("name", ODD)
def test_odd_places_of_the_eye_neither_raise_nor_jump(view: ViewWidget, session: Session, name: str) -> None:
    """Every grip that is seen is dragged all over the picture; where the cursor has come back, so has the value."""
    for camera in (ODD[name], nav.switched(ODD[name])):
        session.do(Set("view.camera", camera))
        session.do(Set("cut.plane", Plane((5, 9, 11), (0.0, 0.0, 1.0))))
        session.do(Set("box.crop", ((0.1, 0.1, 0.1), (0.9, 0.9, 0.9))))
        for node in ("box", "cut", "lamp", "other"):
            session.select(node)
            view.area.grab()  # a painter that raises fails the test
            lens = view.handles.lens
            for handle in view.handles.found():
                value = handle.place.value()
                for grip in handle.shape.grips(lens):
                    start = lens.place(grip.at)
                    if start is None:
                        continue
                    for end in ((-500.0, 7.0), (3.0, 900.0), (120.0, 130.0), (400.0, -400.0)):
                        moved = handle.place.declared.check(handle.shape.moved(lens, grip, start, end), node)
                        assert "nan" not in repr(moved)
                        assert "inf" not in repr(moved)
                    still = handle.shape.moved(lens, grip, start, start)
                    assert np.allclose(_flat(still), _flat(value), atol=1e-3) or grip.name.startswith(
                        ("origin", "tilt")
                    )


def _flat(value: Any) -> list[float]:
    """The numbers of a value."""
    if isinstance(value, (Camera, Light, Plane)):
        value = list(value.to_json().values())
    if isinstance(value, (list, tuple)):
        return [number for part in value for number in _flat(part)]
    return [] if isinstance(value, str) else [float(value)]


def test_the_outline_of_a_cut_through_a_box() -> None:
    corners = np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)], float)
    square = cut_outline(np.array([0.5, 0.5, 0.25]), np.array([0.0, 0.0, 1.0]), corners)
    assert sorted(map(tuple, square.tolist())) == [(0, 0, 0.25), (0, 1, 0.25), (1, 0, 0.25), (1, 1, 0.25)]
    sides = np.linalg.norm(square - np.roll(square, 1, axis=0), axis=1)
    np.testing.assert_allclose(sides, 1.0)  # in order around it
    diagonal = np.ones(3) / np.sqrt(3)
    assert len(cut_outline(np.full(3, 0.5), diagonal, corners)) == 6
    assert len(cut_outline(np.full(3, 5.0), diagonal, corners)) == 0
    assert len(cut_outline(np.zeros(3), diagonal, np.empty((0, 3)))) == 0


def test_what_the_picture_hides_is_dim(view: ViewWidget, session: Session) -> None:
    """The ball's picture shows something at the depth of the focus in its right half, nothing in its left."""
    lens = view.handles.lens
    depth = lens.distance
    width, height = lens.size
    places = np.array([[0.25 * width, 0.5 * height], [0.75 * width, 0.5 * height]])
    assert view.handles._hides(lens, places, np.full(2, depth + 5.0)).tolist() == [False, True]
    assert view.handles._hides(lens, places, np.full(2, depth - 5.0)).tolist() == [False, False]


def test_nothing_is_left_of_a_drag_when_the_view_is_hidden(view: ViewWidget, session: Session) -> None:
    session.select("box")
    at = place(view.handles, "low y")
    press(view, at)
    move(view, (at[0] + 20.0, at[1]))
    view.hide()
    assert not session.in_gesture
    assert session.history.undo_name == "drag crop"
