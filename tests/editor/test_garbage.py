"""Widgets in cycles die on the window's thread, whoever allocates."""

from __future__ import annotations

import gc
import threading
import weakref

from pytestqt.qtbot import QtBot

from nodegraph.editor.garbage import Collector, keep_to_this_thread
from nodegraph.editor.session import Session


class Ring:
    """Something that only the collector can free."""

    def __init__(self) -> None:
        self.me = self


def test_cycles_are_collected_here_and_nowhere_else(session: Session, qtbot: QtBot, qapp: object) -> None:
    keep_to_this_thread()
    assert len(qapp.findChildren(Collector)) == 1  # type: ignore[attr-defined]
    assert not gc.isenabled()
    threads: list[threading.Thread] = []

    def allocate() -> None:
        for _ in range(5000):
            weakref.finalize(Ring(), lambda: threads.append(threading.current_thread()))

    other = threading.Thread(target=allocate)
    other.start()
    other.join()
    assert threads == []
    qtbot.waitUntil(lambda: len(threads) > 1000, timeout=5000)
    assert set(threads) == {threading.current_thread()}
