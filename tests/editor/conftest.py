"""The editor without a screen: Qt's offscreen platform, settings of its own, and nothing left running."""

from __future__ import annotations

import os

os.environ["QT_QPA_PLATFORM"] = "offscreen"  # before anything imports Qt

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from nodegraph.editor.app import application
from nodegraph.editor.session import Message, Session
from nodegraph.editor.settings import Settings
from nodegraph.editor.window import Window


@pytest.fixture(scope="session")
def qapp_args() -> list[str]:
    return ["nodegraph"]


@pytest.fixture(autouse=True)
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Settings and recovery of this test alone."""
    folder = tmp_path / "config"
    monkeypatch.setenv("NODEGRAPH_CONFIG", str(folder))
    return folder


@pytest.fixture
def no_threads_left() -> Iterator[None]:
    """Fails where a test leaves a thread of ours behind."""
    before = set(threading.enumerate())
    yield
    assert left_of(before) == []


def left_of(before: set[threading.Thread]) -> list[str]:
    """Names of our threads that were not there before. One that was told to end is given a moment."""
    ours = [thread for thread in set(threading.enumerate()) - before if thread.name.startswith("nodegraph")]
    for thread in ours:
        thread.join(10.0)
    return [thread.name for thread in ours if thread.is_alive()]


@pytest.fixture
def session(qtbot: QtBot, no_threads_left: None) -> Iterator[Session]:
    """A session on an empty document, closed at the end."""
    made = Session()
    yield made
    made.close()


@pytest.fixture
def heard(session: Session) -> list[Message]:
    """What the session tells."""
    told: list[Message] = []
    session.message.connect(told.append)
    return told


MakeWindow = Callable[..., Window]


@pytest.fixture
def make_window(qtbot: QtBot, no_threads_left: None) -> Iterator[MakeWindow]:
    """Makes windows that are closed at the end without a question."""
    made: list[Window] = []

    def make(settings: Settings | None = None) -> Window:
        application()
        window = Window(settings=settings)
        qtbot.addWidget(window, before_close_func=lambda window: setattr(window, "_leaving", True))
        window.show()
        made.append(window)
        return window

    yield make
    for window in made:
        window._leaving = True
        window.close()


@pytest.fixture
def window(make_window: MakeWindow) -> Window:
    """A window with nothing open."""
    return make_window()
