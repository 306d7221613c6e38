"""A window that was closed leaves nothing behind: no widget, no thread, nothing on a device."""

from __future__ import annotations

import gc
import threading
import weakref
from collections import Counter
from pathlib import Path

import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication, QWidget
from pytestqt.qtbot import QtBot

from nodegraph import workspace
from nodegraph.commands import Set
from nodegraph.editor.app import application, open_window
from nodegraph.editor.session import Session
from nodegraph.editor.settings import Settings
from nodegraph.engine import Engine
from tests.editor.conftest import left_of
from tests.editor.proof.test_monkey import cast


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "cast.json"
    workspace.save(cast(), path)
    return path


def settle() -> None:
    for _ in range(3):
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)
        QApplication.processEvents()
        gc.collect()


def widgets() -> Counter[str]:
    return Counter(type(widget).__name__ for widget in QApplication.allWidgets())


Weak = weakref.ReferenceType[object]


def used_and_closed(file: Path, qtbot: QtBot) -> tuple[list[int], list[Weak]]:
    """Open a window, use each of its panels, close it.

    Returns how many objects each device still holds, and what nobody should hold any more.
    """
    window = open_window([file], "auto", Settings())
    session = window.session
    qtbot.waitUntil(lambda: str(session.state("view")) == "clean", timeout=30000)
    devices = list(session.engine._devices.opened)
    assert devices
    assert sum(device.memory.objects for device in devices) > 0
    session.select("raycast")
    for dock in window.docks.values():
        dock.show()
        dock.raise_()
        QApplication.processEvents()
    window.views[0].setFloating(True)
    window.open_commands()
    window.canvas.add_node()
    window.views[0].view.open_screenshot()
    QApplication.processEvents()
    for box in window.findChildren(QWidget):
        if box.isModal():
            box.close()
    tools = window.views[0].view.toolbox
    for act in (tools.crosshair, tools.distance, tools.fly):
        act()
    window.quad_view()
    session.undo()
    session.do(Set("raycast.step", 0.5))
    window.toggle_theme()
    window._leaving = True
    window.close()
    assert session.engine.closed
    gone = [window, session, session.network, session.engine, window.canvas.scene, window.views[0].view]
    return [device.memory.objects for device in devices], [weakref.ref(one) for one in gone]


@pytest.mark.slow
def test_open_and_close_three_times(file: Path, qtbot: QtBot) -> None:
    application()
    threads = set(threading.enumerate())
    Session(engine=Engine("cl")).close()  # garbage.py never looks at what was there when it began
    settle()
    before = widgets()
    for _ in range(3):
        objects, gone = used_and_closed(file, qtbot)
        assert not any(objects)
        settle()
        assert widgets() - before == Counter()
        assert left_of(threads) == []
        qtbot.waitUntil(lambda gone=gone: settle() or not any(one() is not None for one in gone), timeout=5000)
    application().setStyleSheet("")
