"""The image browser and the comparison of views."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest

from nodegraph.commands import Remove, Set
from nodegraph.data import Image
from nodegraph.editor.views.browser import ImageBrowser, pixel_text
from nodegraph.editor.views.compare import KEPT, REFERENCE, CompareView, measured
from nodegraph.editor.views.picture_area import PictureArea
from nodegraph.editor.views.shown import shown

pytestmark = pytest.mark.slow


@pytest.fixture
def browser(qtbot, session, until) -> ImageBrowser:
    widget = ImageBrowser(session)
    qtbot.addWidget(widget)
    widget.resize(500, 300)
    widget.show()
    session.ask("view", (40, 30))
    until(lambda: session.value("ball", "image") is not None)
    return widget


def test_it_lists_every_picture_and_shows_its_channels(browser, session, until) -> None:
    ports = [browser.list.item(row).text() for row in range(browser.list.count())]
    assert sorted(ports) == ["ball.image", "cut.image", "section.shown", "view.shown"]
    browser.choose("ball.image")
    until(lambda: browser.shown is not None and browser.shown.size == (40, 30))
    channels = [browser.channel.itemData(i) for i in range(browser.channel.count())]
    assert channels == ["color", "alpha", "depth", "ids"]
    browser.channel.setCurrentIndex(2)
    until(lambda: browser.shown.high == 100.0)
    assert "white 100" in browser.facts.text()
    browser.choose("cut.image")
    assert "No picture" in browser.area.note


def test_it_follows_the_selection_and_the_document(browser, session, until) -> None:
    session.select("ball")
    assert browser.port == "ball.image"
    session.do(Remove(["cut"]))
    until(lambda: browser.list.count() == 3)
    assert browser.port == "ball.image"


def test_it_tells_the_numbers_of_a_pixel(browser, until) -> None:
    browser.choose("ball.image")
    until(lambda: browser.shown is not None)
    QTest.mouseMove(browser.area, browser.area.rect().center())
    browser._hover((30, 10))
    assert browser.status.text().startswith("30, 10   RGBA 0, 0.25, 0, 0.5   depth 100 mm   id 7")
    assert pixel_text(browser.shown.image, (99, 0)) == ""


def test_zooming_keeps_the_pixel_under_the_cursor(qtbot) -> None:
    area = PictureArea()
    qtbot.addWidget(area)
    area.resize(200, 160)
    area.show_picture(shown(Image(np.zeros((30, 40, 4), np.float32))).picture)
    assert area.scale == 5.0
    at = QPointF(37.0, 51.0)
    before = area.to_picture(at)
    area.zoom(3.0, at)
    assert area.scale == 15.0
    after = area.to_picture(at)
    assert (after.x(), after.y()) == pytest.approx((before.x(), before.y()))
    area.fit()
    assert area.pixel_at(QPointF(0, 81)) == (0, 15)
    assert area.pixel_at(QPointF(10, 2)) is None


@pytest.fixture
def compare(qtbot, session, until) -> CompareView:
    widget = CompareView(session, "view", "section")
    qtbot.addWidget(widget)
    widget.resize(400, 300)
    widget.show()
    until(lambda: all(widget.pictures))
    return widget


def test_two_views_are_shown_at_one_size_and_measured(compare, until) -> None:
    until(lambda: compare.figures)
    assert compare.pictures[0].size == compare.pictures[1].size
    assert compare.figures["max"] == pytest.approx(0.5)  # alpha 0.5 against 1
    assert "RMSE" in compare.status.text()


def test_what_was_kept_is_equal_until_something_changes(compare, session, until) -> None:
    compare.keep()
    assert compare.boxes[1].currentData() == KEPT
    until(lambda: "equal" in compare.status.text())
    session.do(Set("ball.gain", 2.0))
    until(lambda: compare.figures.get("max", 0.0) > 0.0)
    assert compare.figures["max"] == pytest.approx(0.25)


def test_the_curtain_follows_the_mouse(compare) -> None:
    compare.set_mode("wipe")
    area = compare.area
    QTest.mousePress(area, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(area.width() // 4, 20))
    assert area.split == pytest.approx(0.25, abs=0.01)
    QTest.keyClick(area, Qt.Key.Key_Right)
    assert area.split == pytest.approx(0.27, abs=0.01)


def test_a_picture_is_compared_with_its_reference(compare, session, until) -> None:
    compare.boxes[1].setCurrentIndex(compare.boxes[1].findData(REFERENCE))
    until(lambda: "against its reference" in compare.status.text())
    assert compare.figures["max"] == 0.0  # nothing here depends on the device
    assert max(compare.pictures[0].size) <= 192
    assert compare.pictures[0].size == compare.pictures[1].size
    session.do(Set("ball.gain", 10.0))  # which fails
    until(lambda: compare.pictures[1] is None)
    session.undo()
    until(lambda: "against its reference" in compare.status.text())


def test_all_pictures_of_the_network_can_be_compared(compare, until) -> None:
    entries = [compare.boxes[0].itemData(i) for i in range(compare.boxes[0].count())]
    assert entries == ["view", "section", "ball.image", "cut.image"]
    compare.boxes[1].setCurrentIndex(2)
    until(lambda: "equal" in compare.status.text())  # the view shows just that


def test_a_difference_is_amplified() -> None:
    a = Image(np.full((2, 2, 4), 0.5, np.float32))
    b = Image(np.full((2, 2, 4), 0.51, np.float32))
    figures, picture = measured(a, b, 100.0)
    assert figures["max"] == pytest.approx(0.01, rel=1e-4)
    assert picture.pixelColor(0, 0).red() == 255
    assert measured(a, a, 100.0)[1].pixelColor(0, 0).red() == 0
