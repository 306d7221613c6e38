"""One stream of evaluations, of which only the newest counts: what a view shows."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nodegraph.evaluation import Evaluation
    from nodegraph.report import Report

PATIENCE = 1.0  #: seconds that an interactive picture may take before a newer question cancels it
BUDGET = 0.1  #: seconds that an interactive picture shall take
SCALES = (1.0, 0.75, 0.5, 0.35, 0.25)  #: steps of the width of interactive pictures; few, so that the cache helps


@dataclass(slots=True, eq=False)
class Channel:
    """What is asked for, what runs, and what is asked next.

    sink, size: of the question; a size of None is the sink's own. watched: whether every change asks again.
    running, quality, since: the evaluation under way; ticket: what its answers bear.
    pending: the quality to ask for when it ends, or empty.
    step: place in SCALES, learnt from what the last interactive pictures cost.
    """

    sink: str
    size: tuple[int, int] | None = None
    watched: bool = False
    running: Evaluation | None = None
    quality: str = "final"
    since: float = 0.0
    ticket: object = None
    pending: str = ""
    step: int = 0

    def may_wait(self, quality: str) -> bool:
        """Whether what runs shall end first: only a picture of a drag, and only while the drag goes on."""
        if self.running is None or self.quality != "interactive" or quality != "interactive":
            return False
        return time.monotonic() - self.since < PATIENCE

    def asked_size(self, quality: str) -> tuple[int, int] | None:
        """The size to ask the engine for: smaller during a drag where the full one takes too long."""
        if quality != "interactive" or self.size is None:
            return self.size
        width, height = self.size
        scale = SCALES[self.step]
        return max(1, round(width * scale)), max(1, round(height * scale))

    def learn(self, report: Report) -> None:
        """Take the next interactive picture smaller or larger, by what this one cost."""
        if self.quality != "interactive" or not report.timings:
            return
        seconds = sum(seconds for path, seconds in report.timings.items() if "/" not in path or path in report.states)
        if seconds > BUDGET * 1.3 and self.step < len(SCALES) - 1:
            self.step += 1
        elif self.step and seconds * (SCALES[self.step - 1] / SCALES[self.step]) ** 2 < BUDGET:
            self.step -= 1
