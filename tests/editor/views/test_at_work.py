"""What a view shows while it is computed: previews of a processor that gives some, and what runs and how far it is."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from nodegraph import Float, Output, Processor, registry
from nodegraph.commands import Set
from nodegraph.data import Image
from nodegraph.editor.session import Session
from nodegraph.editor.views.view import ViewWidget
from nodegraph.network import Network

GO = threading.Event()


def grey(level: float, size: tuple[int, int]) -> Image:
    return Image(np.full((size[1], size[0], 4), [level, level, level, 1.0], np.float32))


class Gradual(Processor):
    """A dark picture first; a bright one when it is told to go on."""

    image = Output(Image, doc="The picture.")
    top = Float(1.0, doc="The bright one.")

    def process(self, top, *, size, progress):
        yield grey(0.01, size)
        progress(0.4, "half way")
        while not GO.wait(0.005):
            yield None
        yield grey(top, size)


@pytest.fixture
def view(session: Session, qtbot: Any) -> Iterator[ViewWidget]:
    Gradual.id = "trial.gradual"
    network = Network(lambda id: Gradual if id == "trial.gradual" else registry.find(id))
    network.add("trial.gradual", "gradual")
    network.add("output.view", "view")
    network.connect("gradual.image", "view.image")
    GO.clear()
    session.adopt(network)
    made = ViewWidget(session, "view")
    qtbot.addWidget(made)
    made.resize(300, 240)
    made.show()
    yield made
    GO.set()


def brightness(view: ViewWidget) -> float:
    assert view.shown is not None
    return float(view.shown.image.color.max(axis=(0, 1))[0])


def test_a_preview_is_seen_before_the_result(view: ViewWidget, until: Any) -> None:
    until(lambda: view.shown is not None)
    assert brightness(view) == pytest.approx(0.01)
    assert "not finished" in view._facts.text()
    until(view.progress.isVisible)
    assert view.progress.text == "gradual  ·  40%  ·  half way"
    assert view.progress.fraction == pytest.approx(0.4)
    assert view.progress.geometry().bottom() == view.area.rect().bottom()
    GO.set()
    until(lambda: brightness(view) == 1.0)
    until(lambda: "not finished" not in view._facts.text())
    until(lambda: not view.progress.isVisible())


def test_a_newer_change_ends_what_runs(view: ViewWidget, session: Session, until: Any) -> None:
    until(lambda: view.shown is not None)
    session.do(Set("gradual.top", 0.5))
    GO.set()
    until(lambda: brightness(view) == 0.5)
    assert session.network.get("gradual.top") == 0.5


def test_nothing_is_said_of_what_is_quick(view: ViewWidget, session: Session, until: Any) -> None:
    GO.set()
    until(lambda: view.shown is not None and brightness(view) == 1.0)
    until(lambda: not view.progress.isVisible())
    seen: list[bool] = []
    session.progressed.connect(lambda *_: seen.append(view.progress.isVisible()))
    session.do(Set("gradual.top", 0.25))
    until(lambda: brightness(view) == 0.25)
    assert seen
    assert not any(seen)
