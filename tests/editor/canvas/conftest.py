"""A session whose network nobody evaluates, and a canvas that shows it."""

from __future__ import annotations

import os
from collections.abc import Iterator

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from nodegraph import Network, workspace
from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.session import Session

NONE = Qt.KeyboardModifier.NoModifier


@pytest.fixture
def session(qtbot: QtBot) -> Iterator[Session]:
    """volume -> blur -> raycast <- rays <- box <- volume; raycast -> shade -> view. Without a history."""
    network = Network()
    network.add("source.synthetic", "volume")
    network.add("filter.gaussian_blur", "blur")
    network.add("geometry.proxy_box", "box")
    network.add("render.entry_exit_points", "rays")
    network.add("render.raycast", "raycast")
    network.add("image.background", "shade")
    network.add("output.view", "view")
    for source, target in (
        ("volume.volume", "blur.volume"),
        ("volume.volume", "box.volume"),
        ("box.geometry", "rays.geometry"),
        ("blur.smoothed", "raycast.volume"),
        ("rays.interval", "raycast.interval"),
        ("raycast.image", "shade.image"),
        ("shade.composed", "view.image"),
    ):
        network.connect(source, target)
    network.history.clear()
    session = Session(network)
    yield session
    session.close()


@pytest.fixture
def canvas(session: Session, qtbot: QtBot) -> CanvasView:
    made = CanvasView(session)
    qtbot.addWidget(made)
    made.resize(1400, 800)
    made.show()
    qtbot.waitExposed(made)
    return made


class Hand:
    """A mouse on the canvas, told where to go in coordinates of the scene."""

    def __init__(self, canvas: CanvasView) -> None:
        self.canvas = canvas
        self.viewport = canvas.view.viewport()

    def pixel(self, point: QPointF) -> QPoint:
        return self.canvas.view.mapFromScene(point)

    def port(self, id: str, name: str, output: bool = False) -> QPointF:
        return self.canvas.scene.nodes[id].anchor(output, name)

    def middle(self, id: str) -> QPointF:
        return self.canvas.scene.nodes[id].body_in_scene().center()

    def title(self, id: str) -> QPointF:
        return self.canvas.scene.nodes[id].pos() + QPointF(30, 12)

    def press(self, point: QPointF, keys: Qt.KeyboardModifier = NONE) -> None:
        QTest.mousePress(self.viewport, Qt.MouseButton.LeftButton, keys, self.pixel(point))

    def move(self, point: QPointF) -> None:
        QTest.mouseMove(self.viewport, self.pixel(point))

    def release(self, point: QPointF, keys: Qt.KeyboardModifier = NONE) -> None:
        QTest.mouseRelease(self.viewport, Qt.MouseButton.LeftButton, keys, self.pixel(point))

    def drag(self, start: QPointF, end: QPointF, keys: Qt.KeyboardModifier = NONE) -> None:
        self.press(start, keys)
        for part in (0.3, 0.7, 1.0):
            self.move(start + (end - start) * part)
        self.release(end, keys)

    def click(self, point: QPointF, keys: Qt.KeyboardModifier = NONE) -> None:
        QTest.mouseClick(self.viewport, Qt.MouseButton.LeftButton, keys, self.pixel(point))

    def double_click(self, point: QPointF) -> None:
        QTest.mouseDClick(self.viewport, Qt.MouseButton.LeftButton, NONE, self.pixel(point))

    def key(self, key: Qt.Key, keys: Qt.KeyboardModifier = NONE) -> None:
        QTest.keyClick(self.canvas.view, key, keys)


@pytest.fixture
def hand(canvas: CanvasView) -> Hand:
    return Hand(canvas)


def text_of(session: Session) -> str:
    """The document as it would be saved."""
    return workspace.dumps(session.network)
