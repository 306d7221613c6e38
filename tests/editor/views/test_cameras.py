"""Views that turn together, and alone."""

from __future__ import annotations

import pytest

from nodegraph.commands import Add, Connect
from nodegraph.data import Camera
from nodegraph.editor.views import cameras
from nodegraph.editor.views.view import ViewWidget
from nodegraph.subjects import moved_with
from tests.editor.views.hands import drag, opened


@pytest.fixture
def other(session, view, qtbot, until) -> ViewWidget:
    """A second view in depth with a camera of its own, which no variable decides."""
    session.do(Add("trial.ball", "ball2", {"camera": Camera((0, 80, 0), (0, 0, 0))}))
    session.do(Add("output.view", "second"))
    session.do(Connect("block.volume", "ball2.volume"))
    session.do(Connect("ball2.image", "second.image"))
    widget = opened(qtbot, session, "second", 150, 120)
    until(lambda: widget.shown is not None)
    session.history.clear()
    return widget


def test_views_turn_alone_until_they_are_linked(view, other, session, until) -> None:
    alone = session.network.get("ball2.camera")
    drag(view, (80, 60), (120, 90))
    assert session.network.get("ball2.camera") == alone
    assert cameras.others(session, "view") == {"second": False}
    view.toolbox.link_cameras()
    assert session.history.undo_name == "link cameras"
    assert session.network.get("ball2.camera") == session.network.get("camera")
    assert cameras.others(session, "view") == {"second": True}
    for turned in (view, other):
        drag(turned, (60, 60), (90, 50))
        assert session.network.get("ball2.camera") == session.network.get("ball.camera")
        assert turned.sight().camera == session.network.get("camera")
    until(lambda: other.shown.image.color[0, 0, :3] == pytest.approx(view.shown.image.color[0, 0, :3], abs=1e-6))


def test_linking_is_one_step_that_is_undone(view, other, session) -> None:
    before = session.network.get("ball2.camera")
    other.toolbox.link_cameras()  # it has no variable, so it gets one
    assert session.network.get("ball.camera") == before
    assert set(moved_with(session.network, "view")) == {"ball.camera", "view.camera"}
    session.undo()
    assert session.network.get("ball2.camera") == before
    assert session.network.get("ball.camera") != before
    assert session.history.undo_name == ""


def test_a_view_that_parts_stays_where_it_is_and_turns_alone(view, other, session) -> None:
    view.toolbox.link_cameras()
    other.toolbox.own_camera()
    common = session.network.get("camera")
    assert session.network.get("ball2.camera") == common
    drag(other, (60, 60), (90, 50))
    assert session.network.get("camera") == common
    assert session.network.get("ball2.camera") != common
    other.toolbox.own_camera()
    assert "of its own already" in session.told[-1].text


def test_the_menu_says_with_which_views_one_turns(view, other, session) -> None:
    def entry():
        view.toolbox.look_menu.aboutToShow.emit()
        return next(action for action in view.toolbox.look_menu.actions() if action.text() == "Turns with second")

    assert not entry().isChecked()
    entry().trigger()
    assert entry().isChecked()
    entry().trigger()
    assert not entry().isChecked()


def test_views_of_one_picture_cannot_part(view, session) -> None:
    session.do(Add("output.view", "again"))
    session.do(Connect("ball.image", "again.image"))
    assert cameras.others(session, "view") == {"again": True}
    before = session.history.undo_name
    view.toolbox.own_camera()
    assert session.history.undo_name == before
    assert "shows what another shows" in session.told[-1].text
