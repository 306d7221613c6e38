"""The Pareto front: what is worth its time."""

from __future__ import annotations

import math
from collections.abc import Sequence


def pareto(costs: Sequence[float], errors: Sequence[float]) -> list[bool]:
    """Mark the points that no other beats: none is at most as dear and at most as wrong, and better in one of both.

    Less is better in both. Equal points stand or fall together. A point with a nan is beaten by none and on no front.
    """
    front = [False] * len(costs)
    order = sorted(
        (i for i in range(len(costs)) if not (math.isnan(costs[i]) or math.isnan(errors[i]))),
        key=lambda i: (costs[i], errors[i]),
    )
    # From the cheapest on, a point must be less wrong than all that were cheaper.
    least = math.inf
    last: int | None = None
    for i in order:
        equal = last is not None and (costs[i], errors[i]) == (costs[last], errors[last])
        if errors[i] < least or last is None or equal:
            front[i] = True
            least, last = errors[i], i
    return front
