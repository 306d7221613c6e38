"""How coarse a picture may be while something moves: levels of quality chosen by what was measured.

A level of quality says how much work a result may be (`nodegraph.requests`), never how long it may take. `Pacing`
stands between the two, outside of every processor: it is told how long each node took at which level, and says at
which level to ask next. Choices behind it: docs/decisions/0010-quality.md. Source: Rezk-Salama 2001, R20; Orhun 2004,
OR-73.

    pacing = Pacing(budget_ms=80)
    quality = pacing.quality()                      # while something moves
    pacing.learn(engine.evaluate(network, "view", quality=quality), quality)
    quality = pacing.finer(quality)                 # at rest, until it is None
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from nodegraph.errors import ParameterError
from nodegraph.requests import LEVELS, coarseness, level

if TYPE_CHECKING:
    from nodegraph.report import Report

BUDGET_MS = 80.0
FORGET = 0.6
"""What a run weighs beside the next one: a scene that grows dearer is noticed within three pictures."""
FINER = 4
"""How much finer each picture at rest is than the one before: all before the last cost a third of it."""


@dataclass(slots=True)
class Cost:
    """What one node takes: seconds = fixed + work / n at the level n, fitted to its last runs.

    The sums are those of a weighted line through (1 / n, seconds); a run weighs `FORGET` times the one after it.
    """

    weight: float = 0.0
    x: float = 0.0
    y: float = 0.0
    xx: float = 0.0
    xy: float = 0.0

    def learn(self, n: int, seconds: float) -> None:
        """Take in one run at the level n."""
        x = 1.0 / n
        self.weight = FORGET * self.weight + 1.0
        self.x = FORGET * self.x + x
        self.y = FORGET * self.y + seconds
        self.xx = FORGET * self.xx + x * x
        self.xy = FORGET * self.xy + x * seconds

    def seconds(self, n: int) -> float:
        """What a run at the level n is expected to take."""
        fixed, work = self._line()
        return fixed + work / n

    def _line(self) -> tuple[float, float]:
        """The fixed part and the work, neither below 0. Runs at one level alone are taken for work."""
        spread = self.weight * self.xx - self.x * self.x
        if spread > 1e-9 * self.weight * self.xx:
            work = (self.weight * self.xy - self.x * self.y) / spread
            fixed = (self.y - work * self.x) / self.weight
            if work < 0.0:
                return self.y / self.weight, 0.0
            if fixed >= 0.0:
                return fixed, work
        return 0.0, self.xy / self.xx


class Pacing:
    """Chooses the level of the next request so that a picture takes at most ``budget_ms`` milliseconds.

    One for each view: its nodes are known by their paths.
    """

    def __init__(self, budget_ms: float = BUDGET_MS) -> None:
        """Raises ParameterError where the budget is no time."""
        self.budget_ms = budget_ms
        self._costs: dict[str, Cost] = {}
        self._running: frozenset[str] = frozenset()
        self._last = 1

    @property
    def budget_ms(self) -> float:
        """Milliseconds that a picture may take while something moves."""
        return self._budget_ms

    @budget_ms.setter
    def budget_ms(self, value: float) -> None:
        if not (math.isfinite(value) and value > 0.0):
            raise ParameterError(f"budget_ms: expected a time above 0 ms, got {value!r}")
        self._budget_ms = float(value)

    def learn(self, report: Report, quality: str) -> None:
        """Take in how long every node took that ran. What it prepared by memo counts as done once and for all."""
        n = coarseness(quality)
        for path in dict.fromkeys(report.ran):
            prepared = sum(report.timings.get(label, 0.0) for label in report.memos.get(path, ()))
            self._costs.setdefault(path, Cost()).learn(n, max(report.timings[path] - prepared, 0.0))
        if report.ran:
            self._running = frozenset(report.ran)
            self._last = n

    def seconds(self, quality: str) -> float | None:
        """What the nodes that ran last would take at a quality; None where none has run yet."""
        if not self._running:
            return None
        return sum(self._costs[path].seconds(coarseness(quality)) for path in self._running)

    def node_seconds(self, quality: str) -> dict[str, float]:
        """The same, node by node."""
        return {path: self._costs[path].seconds(coarseness(quality)) for path in sorted(self._running)}

    def quality(self) -> str:
        """The finest level that is expected to keep the budget; the coarsest where nothing does, or nothing ran yet.

        At most twice as fine as the last: a busy machine blurs what the levels differ by, and one picture that is far
        too fine is felt more than a few that are too coarse.
        """
        for n in (1, *LEVELS):
            if 2 * n < self._last:
                continue
            seconds = self.seconds(level(n))
            if seconds is not None and 1000.0 * seconds <= self.budget_ms:
                return level(n)
        return level(LEVELS[-1])

    def finer(self, shown: str) -> str | None:
        """What to ask for at rest, when a quality is shown: level by level up to final, then None.

        Where the final picture is expected within the budget it is asked for at once.
        """
        n = coarseness(shown)
        if n == 1:
            return None
        final = self.seconds("final")
        if final is not None and 1000.0 * final <= self.budget_ms:
            return "final"
        return level(max(n // FINER, 1))
