"""Cycles of objects are collected on the window's thread only.

Python collects on whichever thread happens to allocate. Where a cycle holds a widget, that would destroy it on the
engine's thread, which Qt does not survive. So the automatic collection is switched off, and a timer collects instead.
"""

from __future__ import annotations

import gc

from PySide6.QtCore import QCoreApplication, QObject, QTimer

EVERY = 250
"""Milliseconds between looks whether there is enough to collect."""


class Collector(QObject):
    """Collects the generations that Python itself would collect by now."""

    def __init__(self, app: QCoreApplication) -> None:
        super().__init__(app)
        self._limits = gc.get_threshold()
        gc.disable()
        gc.collect()
        gc.freeze()  # modules and classes that are here to stay are not looked at again, which keeps collections short
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.collect)
        self._timer.start(EVERY)

    def collect(self) -> None:
        """Collect what is due. Called on the window's thread."""
        counts = gc.get_count()
        due = [generation for generation in (0, 1, 2) if counts[generation] > self._limits[generation]]
        if due:
            gc.collect(max(due))


def keep_to_this_thread() -> None:
    """Switch over, once for the program; without a QApplication nothing has to be done."""
    app = QCoreApplication.instance()
    if app is not None and app.findChild(Collector) is None:
        Collector(app)
