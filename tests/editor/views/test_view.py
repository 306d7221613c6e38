"""A view: what it shows, what a hand does to it, and that each gesture is one step."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from nodegraph import formats
from nodegraph.commands import Mute, Remove, Rename, Set
from nodegraph.data import Image, Plane, Volume
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.dock import ViewDock
from nodegraph.editor.views.pick import Pick, value_at
from nodegraph.editor.views.screenshot import Screenshot, ScreenshotDialog
from nodegraph.editor.views.shown import VIEWPORT, channels_of, linear, shown
from nodegraph.editor.views.tools import Tool
from nodegraph.editor.views.view import ViewWidget
from nodegraph.formats import png, srgb
from tests.editor.views.hands import LEFT, MIDDLE, NONE, RIGHT, drag, move, size_of, wheel

# -- what it shows ----------------------------------------------------------------------------------------------------


def test_it_shows_the_node_at_its_own_size_over_its_background(view, session) -> None:
    assert view.shown.size == view.pixels
    behind = np.array(linear(QColor(VIEWPORT)))
    expected = srgb.encode(np.array([0.0, 0.25, 0.0]) + 0.5 * behind) * 255
    pixel = view.shown.picture.pixelColor(5, 5)
    np.testing.assert_allclose((pixel.red(), pixel.green(), pixel.blue()), expected, atol=1.01)


def test_a_change_of_the_document_is_shown(view, session, until) -> None:
    before = view.shown
    session.do(Set("ball.gain", 2.0))
    until(lambda: view.shown is not before)
    assert view.shown.image.color[0, 0, 1] == pytest.approx(0.5)


def test_another_size_is_asked_for_once_it_settles(view, until) -> None:
    view.resize(260, 180)
    until(lambda: view.shown.size == view.pixels)


def test_what_fails_is_said_over_the_last_picture(view, session, until) -> None:
    session.do(Set("ball.gain", 20.0))
    until(lambda: view.area.note)
    assert "too bright" in view.area.note or "ball" in view.area.note
    assert view.area.picture is not None
    session.undo()
    until(lambda: not view.area.note)


def test_a_hidden_view_asks_for_nothing(view, session, qtbot) -> None:
    view.hide()
    before = view.shown
    session.do(Set("ball.gain", 3.0))
    qtbot.wait(150)
    assert view.shown is before


def test_a_dock_follows_a_rename_and_closes_with_its_node(qtbot, session) -> None:
    dock = ViewDock(session, "view")
    qtbot.addWidget(dock)
    dock.show()
    session.do(Rename("view", "picture"))
    assert (dock.windowTitle(), dock.view.path) == ("picture", "picture")
    session.do(Remove(["picture"]))
    assert not dock.isVisible()
    session.undo()
    assert dock.view.alive


def test_every_channel_has_a_picture() -> None:
    color = np.zeros((2, 3, 4), np.float32)
    color[..., 3] = np.linspace(0, 1, 3)
    depth = np.array([[1.0, np.inf, 3.0]] * 2, np.float32)
    image = Image(color, depth, np.full((2, 3), 5, np.uint32))
    assert channels_of(image) == ["color", "alpha", "depth", "ids"]
    assert [shown(image, None, "alpha").picture.pixelColor(x, 0).red() for x in range(3)] == [0, 128, 255]
    made = shown(image, None, "depth")
    assert [made.picture.pixelColor(x, 0).red() for x in range(3)] == [0, 0, 255]
    assert (made.low, made.high) == (1.0, 3.0)
    pairs = Image(np.array([[[0.0, 0.0], [1.0, 3.0]]], np.float32))
    assert (shown(pairs).low, shown(pairs).high) == (0.0, 2.0)
    nothing = Image(np.full((2, 2, 1), np.nan, np.float32))
    assert shown(nothing).picture.pixelColor(0, 0).red() == 0


# -- turning ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("button", "modifiers", "name", "law"),
    [
        (LEFT, NONE, "turn", nav.turn),
        (MIDDLE, NONE, "pan", nav.pan),
        (LEFT, Qt.KeyboardModifier.ShiftModifier, "pan", nav.pan),
        (LEFT, Qt.KeyboardModifier.ControlModifier, "roll", nav.roll),
    ],
)
def test_a_drag_is_one_step_and_does_what_its_law_says(view, session, button, modifiers, name, law) -> None:
    camera = session.network.get("camera")
    drag(view, (80, 60), (120, 90), button, modifiers)
    assert session.network.get("camera") == law(camera, size_of(view), (80.0, 60.0), (120.0, 90.0))
    assert session.network.get("ball.camera") == session.network.get("camera")
    assert session.history.undo_name == name
    assert not session.in_gesture
    session.undo()
    assert session.network.get("camera") == camera
    assert session.history.undo_name == ""


def test_there_and_back_leaves_the_camera(view, session) -> None:
    camera = session.network.get("camera")
    QTest.mousePress(view.area, LEFT, NONE, QPoint(80, 60))
    for place in ((150, 90), (30, 140), (80, 60)):
        move(view, QPointF(*place), LEFT)
    QTest.mouseRelease(view.area, LEFT, NONE, QPoint(80, 60))
    assert session.network.get("camera") == camera


def test_escape_takes_a_drag_back(view, session) -> None:
    camera = session.network.get("camera")
    QTest.mousePress(view.area, LEFT, NONE, QPoint(80, 60))
    move(view, QPointF(120, 100), LEFT)
    assert session.network.get("camera") != camera
    assert session.in_gesture
    QTest.keyClick(view, Qt.Key.Key_Escape)
    assert session.network.get("camera") == camera
    QTest.mouseRelease(view.area, LEFT, NONE, QPoint(120, 100))
    assert not session.in_gesture
    assert session.history.undo_name == ""


def test_notches_that_follow_closely_are_one_step(view, session, until) -> None:
    camera = session.network.get("camera")
    at = QPointF(50.0, 40.0)
    wheel(view, at, 1)
    wheel(view, at, 1)
    assert session.in_gesture
    point = nav.on_focus(camera, size_of(view), (50.0, 40.0))
    np.testing.assert_allclose(nav.seen_at(session.network.get("camera"), size_of(view), point), (50, 40), atol=1e-6)
    until(lambda: not session.in_gesture)
    session.undo()
    assert session.network.get("camera") == camera


def test_a_view_that_is_hidden_ends_its_gesture(view, session) -> None:
    wheel(view, QPointF(50.0, 40.0), 1)
    view.hide()
    assert not session.in_gesture
    assert session.history.undo_name == "zoom"


@pytest.mark.parametrize(
    ("key", "modifiers", "axis"),
    [
        (Qt.Key.Key_1, NONE, "front"),
        (Qt.Key.Key_1, Qt.KeyboardModifier.ControlModifier, "back"),
        (Qt.Key.Key_3, NONE, "left"),
        (Qt.Key.Key_7, NONE, "top"),
    ],
)
def test_keys_look_along_axes(view, session, key, modifiers, axis) -> None:
    session.do(Set("view.camera", nav.rolled(nav.along(session.network.get("camera"), "right"), 20.0)))
    camera = session.network.get("camera")
    QTest.keyClick(view, key, modifiers)
    assert session.network.get("camera") == nav.along(camera, axis)


def test_other_keys_of_the_camera(view, session) -> None:
    camera = session.network.get("camera")
    QTest.keyClick(view, Qt.Key.Key_5)
    assert session.network.get("camera").orthographic
    QTest.keyClick(view, Qt.Key.Key_5)
    assert not session.network.get("camera").orthographic
    QTest.keyClick(view, Qt.Key.Key_Left)
    QTest.keyClick(view, Qt.Key.Key_Right)
    np.testing.assert_allclose(session.network.get("camera").eye, camera.eye, atol=1e-9)
    QTest.keyClick(view, Qt.Key.Key_Plus)
    assert session.network.get("camera").eye[1] > camera.eye[1]
    QTest.keyClick(view, Qt.Key.Key_BracketLeft)
    assert session.history.undo_name == "roll"


def test_fit_shows_the_whole_volume(view, session, until) -> None:
    until(lambda: session.value("block", "volume") is not None)
    QTest.keyClick(view, Qt.Key.Key_F)
    corners = session.value("block", "volume").corners
    places = [nav.seen_at(session.network.get("camera"), size_of(view), corner) for corner in corners]
    assert (np.array(places) >= 0).all()
    assert (np.array(places) <= size_of(view)).all()


def test_a_menu_offers_the_same_as_the_keys(view, session) -> None:
    view.toolbox.look_menu.aboutToShow.emit()
    actions = {action.text().partition("\t")[0]: action for action in view.toolbox.look_menu.actions()}
    actions["From the top"].trigger()
    assert session.network.get("camera").basis[2][2] == pytest.approx(-1.0)
    actions["Orthographic"].trigger()
    assert session.network.get("camera").orthographic


def test_a_node_without_a_camera_is_left_alone(view, session) -> None:
    session.do(Mute("ball"))
    session.do(Remove(["ball"]))
    assert view.interactor is None
    done = session.history.undo_name
    drag(view, (80, 60), (120, 90))
    QTest.keyClick(view, Qt.Key.Key_1)
    assert session.history.undo_name == done


# -- picking ----------------------------------------------------------------------------------------------------------


def test_the_line_below_tells_colour_depth_and_place(view, session) -> None:
    width, height = size_of(view)
    move(view, QPointF(width * 0.75, height * 0.5))
    found = view.pick_at((width * 0.75, height * 0.5))
    assert found.color == pytest.approx((0.0, 0.25, 0.0, 0.5))
    assert (found.id, found.depth) == (7, pytest.approx(100.0))
    np.testing.assert_allclose(
        nav.seen_at(session.network.get("camera"), view.shown.size, found.world),
        (found.pixel[0] + 0.5, found.pixel[1] + 0.5),
        atol=1e-6,
    )
    assert found.world[1] == pytest.approx(0.0, abs=1e-9)
    assert "depth 100.0 mm" in view.status
    assert "id 7" in view.status
    move(view, QPointF(width * 0.25, height * 0.5))
    assert "depth" not in view.status  # nothing is seen there


def test_a_double_click_puts_the_focus_where_something_is(view, session) -> None:
    width, height = size_of(view)
    found = view.pick_at((width * 0.75, height * 0.25))
    QTest.mouseDClick(view.area, LEFT, NONE, QPoint(round(width * 0.75), round(height * 0.25)))
    QTest.mouseRelease(view.area, LEFT)
    np.testing.assert_allclose(session.network.get("camera").target, found.world, atol=2.0)
    assert session.history.undo_name == "focus"


# -- cuts -------------------------------------------------------------------------------------------------------------


def test_the_wheel_scrolls_a_cut_by_voxels(section, session, until) -> None:
    wheel(section, QPointF(50, 50), 2)
    assert session.network.get("cut.plane").origin == pytest.approx((0.0, 0.0, 6.0))
    wheel(section, QPointF(50, 50), -1)
    until(lambda: not session.in_gesture)
    assert session.network.get("cut.plane").origin == pytest.approx((0.0, 0.0, 3.0))
    session.undo()
    assert session.network.get("cut.plane") == Plane()


def test_a_right_drag_sets_the_window_from_the_whole_range(section, session) -> None:
    low, high = session.value("block", "volume").range
    drag(section, (100, 100), (150, 80), RIGHT)
    expected = nav.windowed((low, high), size_of(section), (100.0, 100.0), (150.0, 80.0))
    assert session.network.get("cut.window") == pytest.approx(expected)
    assert session.history.undo_name == "window"
    section.interactor.reset_window()
    assert session.network.get("cut.window") == (0.0, 0.0)


def test_a_cut_is_shifted_zoomed_and_fitted(section, session, until) -> None:
    drag(section, (60, 60), (90, 60), MIDDLE)
    assert session.network.get("cut.plane").origin[2] == 0.0
    assert session.network.get("cut.plane").origin != (0.0, 0.0, 0.0)
    height = section.interactor.height()
    point = nav.on_plane(session.network.get("cut.plane"), height, size_of(section), (40.0, 50.0))
    wheel(section, QPointF(40.0, 50.0), 1, Qt.KeyboardModifier.ControlModifier)
    assert session.network.get("cut.height") < height
    plane, height = session.network.get("cut.plane"), session.network.get("cut.height")
    np.testing.assert_allclose(nav.on_plane(plane, height, size_of(section), (40.0, 50.0)), point, atol=1e-9)
    QTest.keyClick(section, Qt.Key.Key_F)
    assert session.network.get("cut.height") == 0.0
    assert session.network.get("cut.plane").origin == pytest.approx((5.5, 9.0, 0.0))
    QTest.keyClick(section, Qt.Key.Key_1)
    assert session.network.get("cut.plane").normal == (0.0, -1.0, 0.0)
    session.do(Set("cut.plane", Plane((0, 0, 500), (0, 0, 1))))
    QTest.keyClick(section, Qt.Key.Key_F)
    assert session.network.get("cut.plane").origin == pytest.approx((5.5, 9.0, 10.5))


def test_a_cut_tells_value_and_place(section, session, until) -> None:
    section.fit()
    QTest.keyClick(section, Qt.Key.Key_Up)
    width, height = size_of(section)
    move(section, QPointF(width / 2, height / 2))
    until(lambda: "value" in section.status)
    found = section.pick_at((width / 2, height / 2))
    index = np.floor(found.world / [1.0, 2.0, 3.0] + 0.5)
    assert found.read() == index @ [1, 100, 10000]
    assert index[2] == 1


# -- saving -----------------------------------------------------------------------------------------------------------


def test_a_screenshot_has_the_size_that_was_asked_for_and_the_workspace(view, session, until, tmp_path) -> None:
    ends = []
    shot = Screenshot(session, "view", tmp_path / "new" / "a.png", (48, 20), session)
    shot.done.connect(ends.append)
    until(lambda: ends)
    assert ends == [tmp_path / "new" / "a.png"]
    image = formats.read(ends[0])
    assert image.size == (48, 20)
    assert image.color[0, 0, 3] == pytest.approx(0.5, abs=0.01)
    assert "trial.ball" in png.read_workspace(ends[0])


def test_a_screenshot_that_cannot_be_written_is_a_message(view, session, until, tmp_path) -> None:
    (tmp_path / "file").write_text("mine")
    ends = []
    Screenshot(session, "view", tmp_path / "file" / "a.png", (8, 8), session).done.connect(ends.append)
    until(lambda: ends)
    assert ends == [None]
    assert any(
        (message.level == "error" and "a.png" in message.text) or "file" in message.text for message in session.told
    )


def test_the_dialog_keeps_proportions_and_completes_the_name(qtbot, session, until, tmp_path) -> None:
    dialog = ScreenshotDialog(session, "view", (200, 100))
    qtbot.addWidget(dialog)
    dialog.width_box.setValue(50)
    assert dialog.height_box.value() == 25
    dialog.file.setText(str(tmp_path / "mine"))
    dialog.accept()
    until(lambda: (tmp_path / "mine.png").exists())
    assert formats.read(tmp_path / "mine.png").size == (50, 25)


# -- tools ------------------------------------------------------------------------------------------------------------


class Stamp(Tool):
    """Takes the left button and draws where it was pressed."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self.heard: list[str] = []

    def press(self, event) -> bool:
        self.heard.append(f"press {event.position().x():.0f} {event.position().y():.0f}")
        return event.button() == LEFT

    def move(self, event) -> bool:
        self.heard.append("move")
        return True

    def release(self, event) -> bool:
        self.heard.append("release")
        return True

    def paint(self, painter) -> None:
        painter.fillRect(0, 0, 20, 20, QColor("#ff0000"))


def test_a_tool_has_the_mouse_before_the_camera_and_draws_over_the_picture(view, session) -> None:
    stamp, camera = Stamp(view), session.network.get("camera")
    view.tools.append(stamp)
    drag(view, (80, 60), (120, 90))
    assert stamp.heard == ["press 80 60", "move", "move", "move", "release"]
    assert session.network.get("camera") == camera
    drag(view, (80, 60), (120, 90), MIDDLE)  # what it does not take goes on to the camera
    assert session.network.get("camera") != camera
    assert view.grab().toImage().pixelColor(view.area.mapTo(view, QPoint(10, 10))).name() == "#ff0000"


def test_the_line_below_is_copied(view, session) -> None:
    width, height = size_of(view)
    move(view, QPointF(width * 0.75, height * 0.5))
    QTest.keyClick(view, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    assert QApplication.clipboard().text() == view.status != ""


def test_a_view_in_depth_tells_the_value_of_the_voxel_that_is_seen(view, session, until) -> None:
    session.do(Set("view.camera", session.network.get("camera").with_(eye=(3, -90, 6), target=(3, 10, 6))))
    until(lambda: view.shown.image.depth[0, -1] == pytest.approx(100.0))
    width, height = size_of(view)
    move(view, QPointF(width * 0.5 + 2, height * 0.5))
    until(lambda: "value" in view.status)
    found = view.pick_at((width * 0.5 + 2, height * 0.5))
    index = np.floor(found.world / [1.0, 2.0, 3.0] + 0.5)
    assert found.read() == index @ [1, 100, 10000]


def test_values_are_real_ones_in_their_unit() -> None:
    volume = Volume(np.arange(8, dtype=np.int16).reshape(2, 2, 2), np.eye(4), (2.0, -1000.0, "HU"))
    assert value_at(volume, np.array([1.4, 0.0, 1.0])) == 5 * 2 - 1000
    assert value_at(volume, np.array([1.6, 0.0, 1.0])) is None
    assert Pick((1, 2), (0.0, 0.0, 0.0, 1.0), unit="HU").text(-990.0).startswith("value -990 HU   pixel")
