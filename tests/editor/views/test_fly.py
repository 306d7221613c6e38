"""Flying: keys, mouse and wheel, and that each movement is one step."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PySide6.QtCore import QEvent, QPointF, Qt
from PySide6.QtGui import QFocusEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from nodegraph.commands import Set
from nodegraph.data import Camera
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.fly import FASTER, SPRINT, TURN
from tests.editor.views.hands import click, drag, move, wheel

SHIFT = Qt.KeyboardModifier.ShiftModifier


@pytest.fixture
def flying(view, session):
    QTest.keyClick(view, Qt.Key.Key_F, SHIFT)
    tool = view.toolbox.flying
    assert tool.on
    tool._tick.setInterval(100_000)  # steps are made by hand here
    tool._idle.setInterval(20)  # and are over soon
    return tool


@pytest.mark.parametrize(
    ("key", "way"),
    [("W", (0, 1, 0)), ("S", (0, -1, 0)), ("A", (-1, 0, 0)), ("D", (1, 0, 0)), ("E", (0, 0, 1)), ("Q", (0, 0, -1))],
)
def test_keys_move_eye_and_focus(view, session, flying, until, key, way) -> None:
    camera = session.network.get("camera")  # looks along y, up is z
    flying.speed = 20.0
    QTest.keyPress(view, getattr(Qt.Key, f"Key_{key}"))
    flying.advance(0.5)
    flying.advance(0.25)
    QTest.keyRelease(view, getattr(Qt.Key, f"Key_{key}"))
    flying.advance(1.0)  # nothing is held any more
    there = session.network.get("camera")
    np.testing.assert_allclose(np.subtract(there.eye, camera.eye), 15.0 * np.array(way), atol=1e-9)
    np.testing.assert_allclose(np.subtract(there.target, camera.target), 15.0 * np.array(way), atol=1e-9)
    until(lambda: not session.in_gesture)
    assert session.history.undo_name == "fly"
    session.undo()
    assert session.network.get("camera") == camera
    assert session.history.undo_name == ""


def test_two_keys_are_not_faster_than_one_and_shift_is(view, session, flying) -> None:
    camera = session.network.get("camera")
    flying.speed = 10.0
    QTest.keyPress(view, Qt.Key.Key_W, SHIFT)
    QTest.keyPress(view, Qt.Key.Key_D, SHIFT)
    flying.advance(1.0)
    moved = np.subtract(session.network.get("camera").eye, camera.eye)
    np.testing.assert_allclose(moved, 10.0 * SPRINT * np.array([1, 1, 0]) / np.sqrt(2), atol=1e-9)


def test_the_mouse_looks_and_the_wheel_sets_the_speed(view, session, flying, until) -> None:
    camera, speed = session.network.get("camera"), flying.speed
    move(view, QPointF(100, 100))
    move(view, QPointF(120, 90))
    assert session.network.get("camera") == nav.looked(camera, (20 * TURN, 10 * TURN))
    assert session.network.get("camera").eye == camera.eye
    wheel(view, QPointF(100, 100), 2)
    assert flying.speed == pytest.approx(speed * FASTER**2)
    until(lambda: not session.in_gesture)
    assert session.history.undo_name == "fly"


@pytest.mark.parametrize("key", [Qt.Key.Key_Escape, Qt.Key.Key_Return])
def test_keys_leave_and_then_the_camera_turns_again(view, session, flying, key) -> None:
    QTest.keyPress(view, Qt.Key.Key_W)
    flying.advance(0.1)
    QTest.keyClick(view, key)
    assert not flying.on
    assert not session.in_gesture
    drag(view, (80, 60), (120, 90))
    assert session.history.undo_name == "turn"


def test_a_click_a_hidden_view_and_the_keyboard_elsewhere_end_it(view, session, flying) -> None:
    click(view, 50, 50)
    assert not flying.on
    flying.enter()
    view.hide()
    assert not flying.on
    view.show()
    flying.enter()
    QApplication.sendEvent(view, QFocusEvent(QEvent.Type.FocusOut))
    assert not flying.on


def test_an_orthographic_camera_becomes_a_perspective_one(view, session) -> None:
    QTest.keyClick(view, Qt.Key.Key_5)
    assert session.network.get("camera").orthographic
    view.toolbox.fly()
    assert not session.network.get("camera").orthographic


def test_the_engine_shows_what_is_flown_to(view, session, flying, until) -> None:
    flying.speed = 50.0
    QTest.keyPress(view, Qt.Key.Key_S)
    flying.advance(1.0)
    QTest.keyRelease(view, Qt.Key.Key_S)
    until(lambda: not session.in_gesture)
    session.do(Set("view.camera", session.network.get("camera").with_(target=(0, 0, 0))))
    until(lambda: view.shown.image.depth[0, -1] == pytest.approx(150.0))


def test_a_view_of_a_cut_does_not_fly(section, session) -> None:
    section.toolbox.fly()
    assert not section.toolbox.flying.on
    assert "no camera" in session.told[-1].text


angles = st.floats(-60.0, 60.0)


@given(angles, angles)
@settings(max_examples=50, deadline=None)
def test_looking_keeps_the_place_and_the_horizon(right: float, upwards: float) -> None:
    camera = Camera((10, -50, 20), (0, 0, 0), (0.1, 0.2, 1.0))
    there = nav.looked(camera, (right, upwards))
    assert there.eye == camera.eye
    assert there.up == camera.up
    lengths = [np.linalg.norm(np.subtract(one.target, one.eye)) for one in (camera, there)]
    assert lengths[0] == pytest.approx(lengths[1])
    level = nav.looked(nav.looked(camera, (right, 0.0)), (-right, 0.0))
    np.testing.assert_allclose(level.target, camera.target, atol=1e-9)


def test_nobody_looks_over_the_zenith() -> None:
    camera = Camera((0, -50, 0), (0, 0, 0))
    assert nav.looked(camera, (0.0, 500.0)).basis[2][2] == pytest.approx(np.sin(np.radians(nav.STEEPEST)))
    assert nav.looked(camera, (90.0, 0.0)).basis[2] == pytest.approx((1.0, 0.0, 0.0), abs=1e-12)  # to the right
