"""How things are timed, and what a measurement says of itself."""

from __future__ import annotations

import os
import platform
import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """One measured figure.

    Attributes:
        what: in words.
        value: the figure.
        unit: ``x`` for a ratio, else ms, MB, us, ...
        limit: the most that is wanted, or None for figures that only inform.
        detail: what the figure was made of.
    """

    what: str
    value: float
    unit: str
    limit: float | None = None
    detail: str = ""

    @property
    def holds(self) -> bool:
        """Whether the figure is within its limit."""
        return self.limit is None or self.value <= self.limit


def interleaved(
    actions: Mapping[str, Callable[[], object]], rounds: int = 7, clock: Callable[[], float] = time.perf_counter
) -> dict[str, float]:
    """Seconds that each action takes by a clock, median of ``rounds``, after one round that is not counted.

    The actions take turns, so that whatever else the machine does meets all of them alike.
    """
    taken: dict[str, list[float]] = {name: [] for name in actions}
    for counted in range(-1, rounds):
        for name, action in actions.items():
            start = clock()
            action()
            if counted >= 0:
                taken[name].append(clock() - start)
    return {name: statistics.median(times) for name, times in taken.items()}


def ms(seconds: float) -> str:
    """Seconds as text in milliseconds."""
    return f"{seconds * 1000:.3g} ms" if seconds < 0.1 else f"{seconds * 1000:.0f} ms"


def machine() -> str:
    """Cores, system and drivers in one line."""
    from nodegraph.compute import survey

    drivers = {f"{found.name}: {found.description}" for found in survey() if found.chosen}
    return (
        f"{os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}; {'; '.join(sorted(drivers))}"
    )
