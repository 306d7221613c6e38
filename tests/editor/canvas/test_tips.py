"""Tips of ports: made once for each value, never by evaluating anything, gone with the mouse."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QHelpEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from nodegraph.commands import Set
from nodegraph.data import Table, Volume
from nodegraph.editor import previews
from nodegraph.editor.canvas import CanvasView
from nodegraph.editor.canvas.preview_card import PreviewCard
from nodegraph.editor.canvas.tips import Known
from nodegraph.editor.previews import Preview, preview_of
from nodegraph.editor.session import Session
from tests.editor.canvas.conftest import Hand


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The values that previews were made of."""
    values: list[Any] = []
    real = previews.preview_of

    def count(value: Any, cancelled: Any) -> Preview:
        values.append(value)
        return real(value, cancelled)

    monkeypatch.setattr(previews, "preview_of", count)
    return values


def rest_on(canvas: CanvasView, hand: Hand, point: QPointF) -> None:
    """The mouse comes to rest."""
    hand.move(point)
    pixel = hand.pixel(point)
    QApplication.sendEvent(
        hand.viewport, QHelpEvent(QEvent.Type.ToolTip, pixel, hand.viewport.mapToGlobal(QPoint(pixel)))
    )


def test_a_port_shows_its_value_once_made(
    session: Session, canvas: CanvasView, hand: Hand, qtbot: QtBot, made: list[Any]
) -> None:
    port, tips = hand.port("volume", "volume", True), canvas.view.tips
    rest_on(canvas, hand, port)
    assert "no open view has asked" in tips.text
    assert tips.preview is None
    started: list[str] = []
    session.started.connect(started.append)
    session.engine.evaluate(session.network, "volume")
    hand.move(hand.middle("view"))
    assert tips.text == ""
    rest_on(canvas, hand, port)
    qtbot.waitUntil(lambda: tips.preview is not None, timeout=10000)
    assert not tips.card.picture.isHidden()
    hand.move(hand.middle("view"))
    rest_on(canvas, hand, hand.port("blur", "volume"))  # the same value at the other end of the wire
    assert tips.preview is not None
    assert len(made) == 1
    assert started == []


def test_a_tip_follows_what_is_computed_while_it_is_shown(
    session: Session, canvas: CanvasView, hand: Hand, qtbot: QtBot
) -> None:
    tips = canvas.view.tips
    rest_on(canvas, hand, hand.port("volume", "volume", True))
    assert "no open view" in tips.text
    session.ask("volume", None)
    qtbot.waitUntil(lambda: tips.preview is not None, timeout=20000)
    first = tips.preview
    volume = session.value("volume", "volume")
    low, high = volume.range
    assert f"{low:.6g}..{high:.6g}" in tips.text
    session.do(Set("volume.voxels", (12, 12, 12)))
    session.ask("volume", None)
    qtbot.waitUntil(lambda: tips.preview is not first, timeout=20000)
    assert "12x12x12" in tips.text


def test_the_mouse_that_leaves_cancels(
    session: Session, canvas: CanvasView, hand: Hand, qtbot: QtBot, made: list[Any]
) -> None:
    session.engine.evaluate(session.network, "volume")
    tips = canvas.view.tips
    for leave in (
        lambda: hand.move(hand.middle("view")),
        lambda: QTest.mouseClick(hand.viewport, Qt.MouseButton.LeftButton),
    ):
        rest_on(canvas, hand, hand.port("volume", "volume", True))
        assert tips.text
        leave()
        assert not tips.card.isVisible()
    qtbot.wait(100)
    assert tips.preview is None
    assert not tips.card.isVisible()


def test_what_it_rests_on_is_not_shown_anew(session: Session, canvas: CanvasView, hand: Hand) -> None:
    rest_on(canvas, hand, hand.title("blur"))
    first = canvas.view.tips.card.pos()
    assert "<b>blur</b>" in canvas.view.tips.text
    rest_on(canvas, hand, hand.title("blur") + QPointF(8, 0))
    assert canvas.view.tips.card.pos() == first
    session.new()
    assert not canvas.view.tips.card.isVisible()


def test_a_value_that_is_gone_is_forgotten() -> None:
    known = Known()
    value = Volume(np.zeros((2, 2, 2), np.float32))
    known.keep(value, Preview(lines=("here",)))
    assert known.get(value) == Preview(lines=("here",))
    del value
    assert known.get(Volume(np.zeros((2, 2, 2), np.float32))) is None


def test_a_table_is_shown_in_rows(canvas: CanvasView, qtbot: QtBot) -> None:
    card = PreviewCard(canvas)
    qtbot.addWidget(card)
    card.show_words(QPoint(10, 10), "a <b>table</b>")
    card.add(preview_of(Table({"name": np.array(["a & b", "c"]), "size": np.array([1.0, 2.5])})))
    assert "a &amp; b" in card.rest.text()
    assert card.picture.isHidden()
    card.show_words(QPoint(790, 790), "at the edge of the screen")
    assert card.rest.isHidden()
    assert card.screen().availableGeometry().contains(card.geometry())
