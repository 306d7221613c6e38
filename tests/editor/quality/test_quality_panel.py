"""The quality panel: what it measures, how it proposes, and that it stops when it shall."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from pytestqt.qtbot import QtBot

from nodegraph import Network, data
from nodegraph.accuracy.tries import Tried
from nodegraph.accuracy.tune import Tuned
from nodegraph.commands import Set, SetUI
from nodegraph.editor.quality import panel as module
from nodegraph.editor.quality.front_plot import Axis
from nodegraph.editor.quality.measuring import bounded, proposal
from nodegraph.editor.quality.panel import QualityPanel
from nodegraph.editor.session import Session
from nodegraph.editor.settings import Settings
from nodegraph.errors import Cancelled, DeviceMissing


def scene() -> Network:
    """A ball of 12 voxels a side, cast into a view."""
    network = Network()
    network.add("source.synthetic", "volume", voxels=(12, 12, 12))
    network.add("render.raycast", "raycast", lit=False, step=1.0)
    network.add("output.view", "view")
    network.set("raycast.transfer_function", data.TransferFunction([(0.2, (1, 1, 1), 0.0), (0.8, (1, 0.5, 0), 0.3)]))
    network.connect("volume.volume", "raycast.volume")
    network.connect("raycast.image", "view.image")
    network.link("raycast.camera", "camera")
    network.history.mark_saved()
    return network


@pytest.fixture
def quality(session: Session, qtbot: QtBot) -> QualityPanel:
    """A panel on the scene."""
    session.adopt(scene())
    made = QualityPanel(session, Settings())
    qtbot.addWidget(made)
    made.resize(1100, 220)
    made.show()
    return made


def found(network: Network, *, met: bool = True) -> Tuned:
    """A search that tried three steps; the middle one is proposed."""

    def tried(step: float, seconds: float, error: float, front: bool) -> Tried:
        return Tried({"raycast.step": step}, seconds, {"max": error}, (0,), front=front)

    best = tried(0.5, 0.02, 0.004, True)
    others = (tried(1.0, 0.01, 0.02, True), tried(0.25, 0.05, 0.001, True), tried(2.0, 0.06, 0.1, False))
    return Tuned(
        {"raycast.step": 0.5}, best, others[0], None, met, (best, *others), "max", 0.005, None, (24, 16), "gl", {}, {}
    )  # fmt: skip


def test_sizes_are_bounded_and_keep_their_proportions() -> None:
    assert bounded((600, 400)) == (128, 85)
    assert bounded((40, 20)) == (40, 20)
    assert bounded((3000, 1)) == (128, 1)


def test_the_frame_is_that_of_whoever_shows_the_view_first(
    quality: QualityPanel, session: Session, qtbot: QtBot
) -> None:
    session.watch("screen", "view", (24, 16))
    qtbot.waitUntil(lambda: "at 24 × 16" in quality.figures.frame.text(), timeout=20000)
    with qtbot.waitSignal(session.answered, timeout=20000, check_params_cb=lambda channel, _: channel == "comparison"):
        session.watch("comparison", "view", (12, 8))
    assert "at 24 × 16" in quality.figures.frame.text()


@pytest.mark.slow
def test_it_measures_and_proposes(quality: QualityPanel, session: Session, qtbot: QtBot) -> None:
    session.watch("screen", "view", (24, 16))
    qtbot.waitUntil(lambda: "at 24 × 16" in quality.figures.frame.text(), timeout=20000)
    quality.measure_it.click()
    qtbot.waitUntil(lambda: quality.errors is not None, timeout=60000)
    assert quality.errors is not None
    assert quality.errors.size == (24, 16)
    assert 0.0 < quality.errors.figures["rmse"] < quality.errors.figures["max"] < 0.5
    assert quality.figures.numbers["max"].text() == f"{quality.errors.figures['max']:.3g}"
    assert "24 × 16 pixels" in quality.figures.told.text()
    quality.proposals.max_error.setValue(quality.errors.figures["max"] / 4)
    quality.proposals.seconds.setValue(4)
    quality.proposals.propose.click()
    assert quality.cancel_it.isVisible()
    qtbot.waitUntil(lambda: not quality.busy, timeout=120000)
    assert quality.proposals.proposal is not None, quality.summary.text()
    choices = quality.proposals.proposal.choices
    quality.proposals.mark(next(place for place, one in enumerate(choices) if one.changes))
    assert quality.proposals.choice is not None
    quality.apply_it.click()
    assert session.history.undo_name == "settings of quality"
    changed = quality.proposals.choice.changes
    assert {place: session.network.get(place) for place in changed} == changed
    session.undo()
    assert session.network.get("raycast.step") == 1.0


def test_a_proposal_is_a_table_a_plot_and_one_step(quality: QualityPanel, session: Session, qtbot: QtBot) -> None:
    made = proposal(session.network, "view", found(session.network))
    quality.proposals.show_proposal(made)
    rows = quality.proposals.rows
    told = [[rows.topLevelItem(i).text(column) for column in range(3)] for i in range(rows.topLevelItemCount())]
    assert told == [
        ["10 ms", "0.02", "as it is"],
        ["20 ms", "0.004", "raycast.step = 0.5"],
        ["50 ms", "0.001", "raycast.step = 0.25"],
    ]
    assert rows.indexOfTopLevelItem(rows.currentItem()) == 1 == quality.proposals.plot.selected
    plot = quality.proposals.plot
    qtbot.waitUntil(lambda: plot.width() > 100)
    places = [plot.place_of(one.seconds, one.error) for one in made.choices]
    assert places[0].x() < places[1].x() < places[2].x()
    assert places[0].y() < places[1].y() < places[2].y()  # less error is farther down
    QTest.mouseClick(plot, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, places[2].toPoint())
    assert rows.indexOfTopLevelItem(rows.currentItem()) == 2
    QTest.mouseClick(plot, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier, QPoint(1, 1))
    assert rows.indexOfTopLevelItem(rows.currentItem()) == 2
    assert quality.apply_it.isEnabled()
    quality.apply()
    assert session.network.get("raycast.step") == 0.25
    assert not quality.apply_it.isEnabled()  # nothing would change any more
    session.undo()
    assert session.network.get("raycast.step") == 1.0
    quality.proposals.mark(0)
    assert not quality.apply_it.isEnabled()


def test_what_runs_is_stopped_by_the_button_and_by_a_change(
    quality: QualityPanel, session: Session, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    ended: list[bool] = []
    begun = threading.Event()

    def endless(*arguments: Any) -> None:
        show, cancelled = arguments[-2:]
        show("at work", 0.5)
        begun.set()
        while not cancelled():
            threading.Event().wait(0.002)
        ended.append(True)
        raise Cancelled

    monkeypatch.setattr(module, "measure", endless)
    stops: list[Callable[[], object]] = [
        quality.cancel_it.click,
        lambda: session.do(Set("raycast.step", 0.5)),
        lambda: session.adopt(scene()),
    ]
    for count, stop in enumerate(stops, 1):
        begun.clear()
        quality.measure()
        assert begun.wait(10)
        qtbot.waitUntil(lambda: quality.summary.text() == "at work", timeout=10000)
        assert quality.bar.value() == 500
        session.do(SetUI("raycast", "position", [count, 0]))  # moving a node changes no picture
        assert quality.busy
        stop()
        assert not quality.busy
        qtbot.waitUntil(lambda count=count: len(ended) == count, timeout=10000)
    assert quality.errors is None
    quality.measure()
    begun.wait(10)  # and the session's end stops it, too: its fixture finds no thread


def test_a_failure_is_one_sentence(quality: QualityPanel, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> None:
        raise DeviceMissing("reference: a reference needs double precision on the device cl64: install one")

    monkeypatch.setattr(module, "measure", refuse)
    quality.measure()
    qtbot.waitUntil(lambda: not quality.busy, timeout=10000)
    assert quality.summary.text() == ("Reference: a reference needs double precision on the device cl64: install one.")
    assert quality.measure_it.isEnabled()


def test_nothing_can_be_measured_where_there_is_no_view(session: Session, qtbot: QtBot) -> None:
    panel = QualityPanel(session, Settings())
    qtbot.addWidget(panel)
    assert not panel.measure_it.isEnabled()
    assert not panel.proposals.propose.isEnabled()
    session.adopt(scene())
    assert panel.measure_it.isEnabled()
    panel.proposals.max_error.setValue(0.0)
    assert panel.proposals.max_error.text() == "any"
    assert not panel.proposals.propose.isEnabled()  # nothing is asked for


def test_the_budget_of_a_drag_is_remembered(quality: QualityPanel, session: Session, qtbot: QtBot) -> None:
    assert session.budget_ms == 80.0
    quality.budget.setValue(40.0)
    assert session.budget_ms == 40.0
    again = QualityPanel(session, Settings())
    qtbot.addWidget(again)
    assert again.budget.value() == 40.0


def test_an_axis_counts_in_powers_of_ten() -> None:
    axis = Axis([0.001, 0.1, math.inf, 0.0])
    assert axis.share(0.01) == pytest.approx(0.5)
    assert axis.share(0.0) == 0.0
    assert axis.share(1e9) == 1.0
    ticks = axis.ticks(5)
    assert ticks == sorted(ticks)
    assert {0.001, 0.01, 0.1} <= set(np.round(ticks, 9))
