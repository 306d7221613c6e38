"""Measuring with the mouse: what is kept, what it says, and that it is undone, saved, listed and deleted."""

from __future__ import annotations

import math

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from nodegraph.commands import Add, Connect, Rename, Set
from nodegraph.data import Camera, Plane
from nodegraph.editor.views import measures as m
from nodegraph.editor.views.measure_list import MeasureList
from nodegraph.editor.views.measured import KEY, Measured
from nodegraph.editor.views.measures import Measure
from nodegraph.editor.views.view import ViewWidget
from nodegraph.engine import Engine
from tests.editor.views.hands import LEFT, click, drag, move, size_of


@pytest.fixture
def measured(session) -> Measured:
    return Measured.of(session)


def world(widget, x: float, y: float) -> np.ndarray:
    return widget.sight().world((float(x), float(y)))


def test_a_distance_by_two_clicks_or_one_pull(section, session, measured) -> None:
    QTest.keyClick(section, Qt.Key.Key_D)
    click(section, 60, 80)
    assert measured.entries() == []
    click(section, 120, 40)
    QTest.keyClick(section, Qt.Key.Key_D)
    drag(section, (30, 30), (50, 90))
    pixel = section.interactor.height() / size_of(section)[1]
    lengths = [m.distance(entry.measure.array) for entry in measured.entries()]
    assert lengths == pytest.approx([pixel * math.hypot(60, 40), pixel * math.hypot(20, 60)])
    assert session.history.undo_name == "measure a distance"
    assert session.network.get("cut.plane") == Plane()  # the mouse did nothing else
    session.undo()
    session.undo()
    assert measured.entries() == []
    assert KEY not in session.network.node("section").ui


def test_an_angle_by_three_clicks_in_depth(view, session, measured) -> None:
    session.do(Set("view.camera", session.network.get("camera").with_(projection="orthographic", height=40)))
    view.toolbox.angle()
    middle = size_of(view)[0] / 2  # to its right, something is seen
    for place in ((60, 100), (20, 100), (20, 60)):
        click(view, middle + place[0], place[1])
    (entry,) = measured.entries()
    assert m.angle(entry.measure.array) == pytest.approx(90.0, abs=1.0)  # a pick is a pixel
    assert entry.view == "view"


def test_where_nothing_is_seen_nothing_is_put(view, session, measured) -> None:
    QTest.keyClick(view, Qt.Key.Key_D)
    click(view, 20, 100)  # the left half is empty
    assert "nothing is seen" in session.told[-1].text
    QTest.keyClick(view, Qt.Key.Key_R)
    assert "slice view" in session.told[-1].text
    assert view.toolbox.measuring.kind == "distance"


def test_a_rectangle_tells_what_lies_below(section, session, measured, until) -> None:
    section.fit()
    session.do(Set("cut.plane", Plane((5.5, 9.0, 3.0), (0, 0, 1))))
    QTest.keyClick(section, Qt.Key.Key_R)
    drag(section, (60, 60), (130, 120))
    (entry,) = measured.entries()
    until(lambda: measured.statistics(entry) is not None)
    found = measured.statistics(entry)
    a, b = world(section, 60, 60), world(section, 130, 120)
    assert m.area(entry.measure.array) == pytest.approx(abs((b - a)[0] * (b - a)[1]))
    xs = [x for x in range(12) if min(a[0], b[0]) <= x <= max(a[0], b[0])]
    ys = [y for y in range(10) if min(a[1], b[1]) <= 2 * y <= max(a[1], b[1])]
    values = np.array([x + 100 * y + 10000 for x in xs for y in ys])
    assert found.count == values.size > 4
    assert (found.mean, found.std) == pytest.approx((values.mean(), values.std()))
    assert (found.min, found.max) == (values.min(), values.max())


def test_a_polygon_ends_by_enter_at_its_first_corner_or_by_a_double_click(section, measured) -> None:
    corners = ((40, 40), (90, 45), (80, 100))

    def begin() -> None:
        QTest.keyClick(section, Qt.Key.Key_P)
        for corner in corners:
            click(section, *corner)

    begin()
    QTest.keyClick(section, Qt.Key.Key_Return)
    begin()
    click(section, 41, 41)
    begin()
    QTest.mouseDClick(section.area, LEFT, pos=QPoint(80, 100))
    shapes = [entry.measure for entry in measured.entries()]
    expected = m.area(np.array([world(section, *corner) for corner in corners]))
    assert [m.area(shape.array) for shape in shapes] == pytest.approx([expected] * 3)


def test_backspace_takes_a_point_back_and_escape_gives_up(section, measured) -> None:
    tool = section.toolbox.measuring
    QTest.keyClick(section, Qt.Key.Key_A)
    click(section, 40, 40)
    click(section, 90, 45)
    QTest.keyClick(section, Qt.Key.Key_Backspace)
    assert len(tool._points) == 1
    QTest.keyClick(section, Qt.Key.Key_Escape)
    assert tool.kind == ""
    assert measured.entries() == []
    click(section, 40, 40)
    assert measured.entries() == []


def put(section, session) -> Measure:
    points = (world(section, 60, 60), world(section, 120, 60))
    measure = Measure("distance", tuple(tuple(point.tolist()) for point in points))
    Measured.of(session).add("section", measure)
    return measure


def test_a_point_is_dragged_elsewhere_as_one_step(section, session, measured) -> None:
    before = put(section, session)
    move(section, QPointF(120, 60))
    drag(section, (120, 60), (60, 120))
    (entry,) = measured.entries()
    np.testing.assert_allclose(entry.measure.array[1], world(section, 60, 120))
    assert entry.measure.points[0] == before.points[0]
    assert session.history.undo_name == "change a measure"
    session.undo()
    assert measured.entries()[0].measure == before
    QTest.mousePress(section.area, LEFT, pos=QPoint(120, 60))
    move(section, QPointF(30, 30), LEFT)
    QTest.keyClick(section, Qt.Key.Key_Escape)
    QTest.mouseRelease(section.area, LEFT)
    assert measured.entries()[0].measure == before


def test_what_is_under_the_cursor_is_deleted(section, session, measured) -> None:
    put(section, session)
    measured.mark(None)
    QTest.keyClick(section, Qt.Key.Key_Delete)
    assert len(measured.entries()) == 1  # none is meant
    move(section, QPointF(60, 60))
    QTest.keyClick(section, Qt.Key.Key_Delete)
    assert measured.entries() == []
    session.undo()
    assert len(measured.entries()) == 1


def test_it_is_drawn_on_its_plane_only(section, session, measured) -> None:
    empty = section.area.grab().toImage()
    put(section, session)
    assert section.area.grab().toImage().pixelColor(90, 60) != empty.pixelColor(90, 60)
    session.do(Set("cut.plane", Plane((0, 0, 6), (0, 0, 1))))
    assert section.area.grab().toImage().pixelColor(90, 60) == empty.pixelColor(90, 60)


def test_measures_survive_saving_and_follow_a_rename(section, session, measured, tmp_path, network) -> None:
    measure = put(section, session)
    session.do(Rename("section", "cut_view"))
    assert [(entry.view, entry.measure) for entry in measured.entries()] == [("cut_view", measure)]
    session.save(tmp_path / "a.json")
    from nodegraph import workspace

    kept = workspace.load(tmp_path / "a.json").node("cut_view").ui[KEY]
    assert [Measure.from_json(json) for json in kept] == [measure]


def test_the_list_shows_marks_copies_and_deletes(section, session, measured, qtbot, until) -> None:
    panel = MeasureList(session)
    qtbot.addWidget(panel)
    panel.show()
    put(section, session)
    QTest.keyClick(section, Qt.Key.Key_R)
    drag(section, (30, 90), (80, 150))
    until(lambda: panel.tree.topLevelItem(1).text(6))
    assert panel.tree.topLevelItem(0).text(1) == m.value_text(measured.entries()[0].measure)
    assert [entry.measure.kind for entry in panel.chosen()] == ["rectangle"]  # the new one
    panel.tree.clearSelection()
    panel.tree.topLevelItem(0).setSelected(True)
    assert measured.marked == ("section", 0)
    QTest.keyClick(panel, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    header, line = QApplication.clipboard().text().splitlines()
    assert line.split("\t")[:2] == ["distance", f"{m.distance(measured.entries()[0].measure.array):.9g}"]
    assert len(line.split("\t")) == len(header.split("\t"))
    QTest.keyClick(panel, Qt.Key.Key_Delete)
    assert [entry.measure.kind for entry in measured.entries()] == ["rectangle"]
    session.undo()
    assert panel.tree.topLevelItemCount() == 2


def test_statistics_follow_the_data(section, session, measured, until) -> None:
    QTest.keyClick(section, Qt.Key.Key_R)
    drag(section, (30, 30), (150, 150))
    (entry,) = measured.entries()
    until(lambda: measured.statistics(entry) is not None)
    before = measured.statistics(entry)
    session.do(Set("cut.plane", Plane((0, 0, 3), (0, 0, 1))))
    assert measured.statistics(entry) is before  # it stays where it was put
    session.adopt(session.network)
    assert isinstance(session.engine, Engine)
    until(lambda: measured.statistics(measured.entries()[0]) is not None)
    assert measured.statistics(measured.entries()[0]) == before


@pytest.mark.parametrize("projection", ["perspective", "orthographic"])
def test_picks_in_depth_lie_on_the_surface_that_is_cast(session, qtbot, until, measured, projection) -> None:
    """A ball of 25 mm: both ends of a distance lie on it, where the rays through the clicks meet it."""
    camera = Camera((20, -150, 40), (0, 0, 0), (0, 0, 1), projection, 25.0, 66.0)
    session.do(Add("source.synthetic", "ball3", {"kind": "sphere", "voxels": (48, 48, 48)}))
    session.do(Add("render.raycast", "cast", {"mode": "iso", "iso_value": 0.5, "camera": camera}))
    session.do(Add("output.view", "round"))
    session.do(Connect("ball3.volume", "cast.volume"))
    session.do(Connect("cast.image", "round.image"))
    widget = ViewWidget(session, "round")
    qtbot.addWidget(widget)
    widget.resize(240, 280)
    widget.show()
    facts = widget._facts
    until(lambda: "ms" in facts.text() and "draft" not in facts.text() and widget.shown.size == widget.pixels)
    size = size_of(widget)
    clicks = [(size[0] // 2 - 30, size[1] // 2 + 20), (size[0] // 2 + 45, size[1] // 2 - 15)]
    widget.toolbox.distance()
    for place in clicks:
        click(widget, *place)
    (entry,) = measured.entries()
    expected = []
    for x, y in clicks:
        origin, way = camera.ray(size, x, y)  # through the middle of the pixel
        along = -(origin @ way) - math.sqrt((origin @ way) ** 2 - origin @ origin + 25.0**2)
        expected.append(origin + along * way)
    np.testing.assert_allclose(entry.measure.array, expected, atol=0.12)
    assert m.distance(entry.measure.array) == pytest.approx(math.dist(*expected), abs=0.1)
