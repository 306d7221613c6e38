"""The cross-hair: one point of the world, through which all cuts go."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest

from nodegraph.commands import Add, Connect, Set
from nodegraph.data import Plane
from nodegraph.editor.views import crosshair
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.view import ViewWidget
from tests.editor.views.hands import LEFT, drag, move, opened, size_of, wheel

NORMALS = {"section": (0, 0, 1), "front": (0, -1, 0), "side": (1, 0, 0)}


@pytest.fixture
def cuts(session, section, qtbot, until) -> dict[str, ViewWidget]:
    """Three cuts across each other, of one volume, the first of which is the usual one."""
    found = {"section": section}
    for name in ("front", "side"):
        session.do(Add("trial.cut", f"{name}_cut", {"plane": Plane((5, 9, 10), NORMALS[name])}))
        session.do(Add("output.view", name))
        session.do(Connect("block.volume", f"{name}_cut.volume"))
        session.do(Connect(f"{name}_cut.image", f"{name}.image"))
    session.do(Set("cut.plane", Plane((5, 9, 10), NORMALS["section"])))
    found |= {name: opened(qtbot, session, name, 160, 200) for name in ("front", "side")}
    until(lambda: all(one.shown is not None and one.volume() is not None for one in found.values()))
    session.history.clear()
    return found


def offs(session) -> list[float]:
    """How far the cross-hair is from each plane."""
    point = crosshair.place(session.network)
    return [float((point - plane.origin) @ plane.unit_normal) for plane in crosshair.planes(session.network).values()]


def test_it_appears_where_the_planes_meet_and_moves_none(cuts, session) -> None:
    before = crosshair.planes(session.network)
    assert len(before) == 3
    QTest.keyClick(cuts["section"], Qt.Key.Key_X)
    np.testing.assert_allclose(crosshair.place(session.network), (5, 9, 10), atol=1e-12)
    assert crosshair.planes(session.network) == before
    QTest.keyClick(cuts["front"], Qt.Key.Key_X)
    assert crosshair.place(session.network) is None
    session.undo()
    assert crosshair.place(session.network) is not None


def test_where_planes_lie_outside_they_come_to_the_middle(cuts, session) -> None:
    session.do(Set("cut.plane", Plane((0, 0, 999), (0, 0, 1))))
    cuts["section"].toolbox.crosshair()
    np.testing.assert_allclose(crosshair.place(session.network), (5.5, 9.0, 10.5))
    np.testing.assert_allclose(offs(session), 0.0, atol=1e-9)


def test_a_drag_moves_the_other_planes_and_is_one_step(cuts, session) -> None:
    section = cuts["section"]
    section.toolbox.crosshair()
    before = crosshair.planes(session.network)
    sight = section.sight()
    drag(section, (90, 90), (120, 70))
    point = crosshair.place(session.network)
    np.testing.assert_allclose(point, sight.world((120.0, 70.0)))
    after = crosshair.planes(session.network)
    assert after["cut.plane"] == before["cut.plane"]
    assert after["front_cut.plane"].origin == pytest.approx((5, point[1], 10))
    assert after["side_cut.plane"].origin == pytest.approx((point[0], 9, 10))
    assert session.history.undo_name == "cross-hair"
    session.undo()
    assert crosshair.planes(session.network) == before
    np.testing.assert_allclose(crosshair.place(session.network), (5, 9, 10), atol=1e-12)


def test_escape_takes_a_drag_back(cuts, session) -> None:
    section = cuts["section"]
    section.toolbox.crosshair()
    before = crosshair.planes(session.network)
    QTest.mousePress(section.area, LEFT)
    move(section, QPointF(120, 60), LEFT)
    assert crosshair.planes(session.network) != before
    QTest.keyClick(section, Qt.Key.Key_Escape)
    assert crosshair.planes(session.network) == before
    QTest.mouseRelease(section.area, LEFT)
    assert not session.in_gesture


def test_a_plane_that_is_scrolled_takes_it_along(cuts, session, until) -> None:
    cuts["section"].toolbox.crosshair()
    wheel(cuts["section"], QPointF(50, 50), 2)
    until(lambda: not session.in_gesture)
    np.testing.assert_allclose(crosshair.place(session.network), (5, 9, 16))
    QTest.keyClick(cuts["side"], Qt.Key.Key_Up)
    np.testing.assert_allclose(crosshair.place(session.network), (6, 9, 16))
    np.testing.assert_allclose(offs(session), 0.0, atol=1e-9)
    session.undo()
    np.testing.assert_allclose(crosshair.place(session.network), (5, 9, 16))


def test_a_plane_that_is_turned_stays_in_it(cuts, session) -> None:
    cuts["section"].toolbox.crosshair()
    drag(cuts["section"], (90, 90), (120, 70))
    QTest.keyClick(cuts["section"], Qt.Key.Key_3)
    assert session.network.get("cut.plane").normal == nav.AXES["left"][1]
    np.testing.assert_allclose(offs(session), 0.0, atol=1e-9)


def test_c_brings_it_to_what_is_seen_in_depth(cuts, view, session) -> None:
    width, height = size_of(view)
    move(view, QPointF(width * 0.75, height * 0.4))
    world = view.pick_at((width * 0.75, height * 0.4)).world
    QTest.keyClick(view, Qt.Key.Key_C)
    np.testing.assert_allclose(crosshair.place(session.network), world)
    np.testing.assert_allclose(offs(session), 0.0, atol=1e-9)
    move(view, QPointF(width * 0.25, height * 0.4))  # nothing is seen there
    QTest.keyClick(view, Qt.Key.Key_C)
    np.testing.assert_allclose(crosshair.place(session.network), world)


def test_it_is_drawn_where_the_point_is_seen(cuts, view, session) -> None:
    session.do(Set("view.camera", session.network.get("camera").with_(eye=(5, -100, 10), target=(5, 0, 10))))
    session.do(Set("cut.plane", Plane((0, 0, 10), (0, 0, 1))))
    point = np.array([2.0, 0.0, 14.0])
    with session.gesture("x"):
        crosshair.put(session, point)
    for widget in (view, cuts["section"]):
        before = widget.area.grab().toImage()
        x, y = (round(number) for number in widget.sight().seen(point))
        crosshair.toggle(session, point)
        after = widget.area.grab().toImage()
        session.undo()
        for way in ((9, 0), (-9, 0), (0, 9), (0, -9)):
            at = x + way[0], y + way[1]
            lines = [before.pixelColor(at[0] + i * (way[1] != 0), at[1] + i * (way[0] != 0)) for i in (-1, 0, 1)]
            assert any(color.red() > 200 and color.blue() < 150 for color in lines)
            assert after.pixelColor(*at) != before.pixelColor(*at)


def test_it_is_saved_and_nonsense_is_passed_over(cuts, session, tmp_path) -> None:
    cuts["section"].toolbox.crosshair()
    session.save(tmp_path / "a.json")
    assert '"crosshair"' in (tmp_path / "a.json").read_text()
    for bad in ({"at": [1, 2]}, {"at": "here"}, 7, {"at": [1, 2, float("inf")]}):
        session.note(crosshair.KEY, bad)
        assert crosshair.place(session.network) is None
