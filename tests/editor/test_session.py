"""The session: one document, its engine beside the window, and what is known of its nodes."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot
from shiboken6 import delete

from nodegraph import Float, Network, Output, Processor, registry
from nodegraph.commands import Add, Mute, Remove, Rename, Set, SetUI
from nodegraph.data import Image, Volume
from nodegraph.editor.channels import Channel
from nodegraph.editor.previews import Preview
from nodegraph.editor.session import Message, Session
from nodegraph.report import Report
from nodegraph.requests import coarseness


def small() -> Network:
    """volume -> blur, with a slice of it in a view; 16 voxels a side."""
    network = Network()
    network.add("source.synthetic", "volume", voxels=(16, 16, 16))
    network.add("filter.gaussian_blur", "blur")
    network.add("render.slice", "slice")
    network.add("output.view", "view")
    network.connect("volume.volume", "blur.volume")
    network.connect("blur.smoothed", "slice.volume")
    network.connect("slice.image", "view.image")
    network.history.mark_saved()
    return network


def is_final(session: Session) -> Callable[[object, Report], bool]:
    """Whether an answer is the last one, at rest."""
    return lambda channel, _: session.quality(channel) == "final"


@pytest.fixture
def shown(session: Session, qtbot: QtBot) -> Session:
    """A session whose view was computed once, in final quality."""
    session.adopt(small())
    with qtbot.waitSignal(session.answered, timeout=20000, check_params_cb=is_final(session)):
        session.watch("test", "view", (32, 32))
    return session


def test_what_is_refused_is_told_and_changes_nothing(session: Session, heard: list[Message]) -> None:
    assert session.do(Add("source.synthetic", "volume"))
    assert not session.do(Set("volume.nothing", 1))
    assert [(message.level, message.path) for message in heard] == [("error", "volume")]
    assert "no such parameter" in heard[0].text
    session.undo()
    assert not session.network.nodes
    session.undo()  # there is nothing more to undo, which is no mistake
    session.redo()
    assert list(session.network.nodes) == ["volume"]


def test_a_watched_view_is_computed_again_after_every_change(shown: Session, qtbot: QtBot) -> None:
    assert {str(shown.state(path)) for path in shown.network.nodes} == {"clean"}
    first = shown.report
    with qtbot.waitSignal(shown.answered, timeout=20000, check_params_cb=is_final(shown)):
        shown.do(Set("blur.sigma", 9.0))
        assert str(shown.state("blur")) == str(shown.state("view")) == "dirty"
        assert str(shown.state("volume")) == "clean"
    assert shown.report is not first
    assert "volume" not in shown.report.timings
    assert str(shown.state("view")) == "clean"


def test_moving_a_node_asks_for_nothing(shown: Session, qtbot: QtBot) -> None:
    with qtbot.assertNotEmitted(shown.answered, wait=150):
        shown.do(SetUI("blur", "position", [10, 20]))
    assert str(shown.state("view")) == "clean"


def test_a_drag_is_one_step_and_ends_in_final_quality(shown: Session, qtbot: QtBot) -> None:
    asked: list[str] = []
    submit = shown.engine.submit

    def spy(*arguments: object, **named: object) -> object:
        asked.append(str(named["quality"]))
        return submit(*arguments, **named)  # type: ignore[arg-type]

    shown.engine.submit = spy  # type: ignore[method-assign, assignment]
    with shown.gesture("drag"):
        for sigma in (2.0, 3.0, 4.0):
            with qtbot.waitSignal(shown.answered, timeout=20000):
                shown.do(Set("blur.sigma", sigma))
    with qtbot.waitSignal(shown.answered, timeout=20000):
        pass
    assert asked[-1] == "final"
    shown.undo()
    assert shown.network.get("blur.sigma") == 1.0


def test_an_exception_takes_the_whole_gesture_back(session: Session) -> None:
    def drag() -> None:
        with session.gesture("outer"):
            session.do(Add("source.synthetic"))
            with session.gesture("inner"):
                raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        drag()
    assert not session.network.nodes
    assert not session.in_gesture


def test_failures_are_told_once_with_their_node_and_the_state_says_why(
    shown: Session, heard: list[Message], qtbot: QtBot
) -> None:
    with qtbot.waitSignal(shown.answered, timeout=20000):
        shown.network.disconnect("slice.volume")
    with qtbot.waitSignal(shown.answered, timeout=20000):
        shown.do(Set("view.width", 300))
    errors = [message for message in heard if message.level == "error"]
    assert [message.path for message in errors] == ["slice"]
    assert str(shown.state("slice")) == "blocked"
    assert "slice.volume" in shown.state("slice").reason
    assert "blocked by" in shown.state("view").reason


def test_values_and_their_pictures(shown: Session, qtbot: QtBot) -> None:
    volume = shown.value("volume", "volume")
    assert isinstance(volume, Volume)
    assert volume.data.shape == (16, 16, 16)
    assert shown.value("volume", "nothing") is None
    got: dict[str, Preview | None] = {}
    red = Image(np.array([[[1.0, 0.0, 0.0, 1.0], [0.25, 0.0, 0.0, 0.5]]], np.float32))
    for name, value in (("volume", volume), ("red", red), ("text", "no picture")):
        shown.preview(value, partial(got.__setitem__, name))
    shown.preview(volume, partial(got.__setitem__, "cancelled"))()
    qtbot.waitUntil(lambda: len(got) == 3, timeout=10000)
    qtbot.wait(50)
    assert "cancelled" not in got
    made = {name: preview.picture for name, preview in got.items() if preview is not None}
    assert made["text"] is None
    assert made["volume"] is not None
    picture = made["red"]
    assert picture is not None
    assert picture.pixelColor(0, 0).getRgb() == (255, 0, 0, 255)
    # Premultiplied 0.25 at half opacity is 0.5, which sRGB writes as 188.
    assert picture.pixelColor(1, 0).getRgb() == (188, 0, 0, 128)


def test_the_selection_follows_renames_and_removals(session: Session) -> None:
    session.adopt(small())
    seen: list[tuple[str, ...]] = []
    session.selected.connect(seen.append)
    session.select("blur", "volume", "nothing")
    session.do(Rename("blur", "soft"))
    assert session.selection == ("soft", "volume")
    session.do(Remove(["soft"]))
    assert session.selection == ("volume",)
    assert seen == [("blur", "volume"), ("volume",)]


def test_groups_and_muted_nodes_have_states(shown: Session) -> None:
    shown.network.group("volume", "blur", id="front")
    assert str(shown.state("front")) in ("clean", "dirty")
    shown.enter("front")
    assert shown.level == "front"
    shown.do(Mute("front/blur"))
    assert "muted" in shown.state("front/blur").reason
    shown.undo()
    shown.undo()
    assert shown.level == ""


def test_open_and_save(session: Session, heard: list[Message], tmp_path: Path) -> None:
    session.adopt(small())
    file = tmp_path / "net.json"
    assert session.save(file)
    assert session.path == file
    session.do(Set("blur.sigma", 2.0))
    assert session.modified
    assert session.open(file)
    assert not session.modified
    assert session.network.get("blur.sigma") == 1.0
    kept = session.network
    assert not session.open(tmp_path / "nothing.json")
    assert session.network is kept
    assert heard[-1].level == "error"


class Listens(Processor):
    """A picture that holds the level it was made at; it takes a second's worth of work."""

    gain = Float(1.0, doc="Changes the picture.")
    image = Output(Image, doc="One pixel.")

    def process(self, gain, *, quality, size):
        time.sleep(0.3 / coarseness(quality))
        return Image(np.full((*size[::-1], 1), coarseness(quality), "f4"))


@pytest.fixture
def paced(session: Session) -> tuple[Session, list[int]]:
    """A session that watches a picture which listens to the level, and the levels of what it was shown."""
    Listens.id = "trial.listens"
    network = Network(lambda id: Listens if id == "trial.listens" else registry.find(id))
    network.add("trial.listens", "listens")
    session.adopt(network)
    seen: list[int] = []

    def take(channel: object, report: Report) -> None:
        seen.append(int(report.values["listens", "image"].color.max()))

    session.answered.connect(take)
    session.watch("test", "listens", (4, 4))
    return session, seen


def test_at_rest_a_picture_comes_at_once_and_is_refined(paced: tuple[Session, list[int]], qtbot: QtBot) -> None:
    session, seen = paced
    qtbot.waitUntil(lambda: seen[-1:] == [1], timeout=10000)
    assert seen == [64, 16, 4, 1]
    session.retry()  # nothing has changed, so nothing coarse is shown again
    qtbot.waitUntil(lambda: len(seen) == 5, timeout=10000)
    assert seen[-1] == 1


def test_a_drag_keeps_its_budget_and_ends_in_final(paced: tuple[Session, list[int]], qtbot: QtBot) -> None:
    session, seen = paced
    qtbot.waitUntil(lambda: seen[-1:] == [1], timeout=10000)
    session.budget_ms = 50
    seen.clear()
    with session.gesture("drag"):
        for gain in range(12):
            with qtbot.waitSignal(session.answered, timeout=10000):
                session.do(Set("listens.gain", gain + 2.0))
        assert set(seen) <= {4, 8, 16, 32, 64}
        assert session.quality("test") != "final"
        assert len(seen) == 12  # while it goes on, nothing is refined
    qtbot.waitUntil(lambda: seen[-1] == 1, timeout=10000)


class Deaf(Processor):
    """A picture that is the same at every level."""

    gain = Float(1.0, doc="Changes the picture.")
    image = Output(Image, doc="All pixels alike.")

    def process(self, gain, *, size):
        return Image(np.full((*size[::-1], 1), gain, "f4"))


def test_what_does_not_listen_to_levels_is_asked_for_once(session: Session, qtbot: QtBot) -> None:
    Deaf.id = "trial.deaf"
    network = Network(lambda id: Deaf if id == "trial.deaf" else registry.find(id))
    network.add("trial.deaf", "deaf")
    session.adopt(network)
    with qtbot.waitSignal(session.answered, timeout=20000):
        session.watch("test", "deaf", (4, 4))
    answers: list[object] = []
    session.answered.connect(lambda channel, _: answers.append(session.quality(channel)))
    with qtbot.waitSignal(session.answered, timeout=20000):
        session.do(Set("deaf.gain", 3.0))
    qtbot.wait(100)
    assert answers == ["final"]


def test_a_picture_of_a_drag_may_end_but_not_for_ever() -> None:
    slot = Channel("view", (400, 200))
    slot.running, slot.moving, slot.since = object(), True, float("inf")  # type: ignore[assignment]
    assert slot.may_end(True)
    assert not slot.may_end(False)  # the drag is over: what is asked for now comes first
    slot.since = 0.0
    assert not slot.may_end(True)
    slot.moving, slot.since = False, float("inf")
    assert not slot.may_end(True)  # a picture at rest gives way to a drag at once


def test_nobody_is_called_back_for_a_widget_that_is_gone(session: Session, qtbot: QtBot) -> None:
    gone, gate, called = QLabel(), threading.Event(), []
    session.work(gate.wait, lambda _: called.append("gone"), gone)
    session.work(gate.wait, lambda _: called.append("nobody's"))
    delete(gone)
    gate.set()
    qtbot.waitUntil(lambda: "nobody's" in called)
    there = QLabel()
    session.work(lambda: 1, lambda _: called.append("there"), there)
    qtbot.waitUntil(lambda: "there" in called)
    assert called == ["nobody's", "there"]
