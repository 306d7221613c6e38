"""The search of `tune`: coordinate descent over ladders, for every combination of choices and switches.

A choice changes what its neighbours mean (an integrator of high order is worth its price only with a longer step), so
choices are gone through and not descended along. Numbers are: one knob after the other moves along its ladder for as
long as that makes things better, until none moves; then pairs move, one coarser and the other as far as it likes, since
an error may be spent at one place or at another.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

from nodegraph.accuracy.settings import Knob, Settings
from nodegraph.params import Bounded

Rank = tuple[float, float]
"""How good a setting is, less is better: by how much it breaks what was asked, then what is to be made small."""

PATIENCE = 2
"""Rungs that may bring nothing before a walk along a ladder ends: one of them may be an accident."""
GAIN = 0.97
"""What counts as better: times differ by a few percent from run to run."""
ROUGH_GAIN = 0.9
"""The same where each was timed only once."""
MOST_COMBINATIONS = 64


def is_better(one: Rank, other: Rank, gain: float = GAIN) -> bool:
    """Whether a setting is better by more than chance."""
    if one[0] != other[0]:
        return one[0] == 0.0 or (other[0] > 0.0 and one[0] < gain * other[0])
    return one[1] < gain * other[1]


def combinations_of_choices(knobs: Sequence[Knob]) -> list[Settings]:
    """Settings of choices and switches, from the fastest on; where these are too many, one change at a time."""
    choices = [knob for knob in knobs if not isinstance(knob.parameter, Bounded)]
    ladders = [knob.ladder() for knob in choices]
    count = 1
    for ladder in ladders:
        count *= len(ladder)
    present = {knob.place: knob.value for knob in choices}
    if count <= MOST_COMBINATIONS:
        rows = [dict(zip(present, row, strict=True)) for row in itertools.product(*ladders)]
        return sorted(rows, key=lambda row: row != present)  # what the network has now comes first
    alone = [{**present, knob.place: value} for knob, ladder in zip(choices, ladders, strict=True) for value in ladder]
    return [present, *(row for row in alone if row != present)]


def descend(
    start: Settings, knobs: Sequence[Knob], rank: Callable[[Settings], Rank], *, rough: bool = False
) -> Settings:
    """Move the numbers of a setting along their ladders until nothing becomes better.

    rough: every rank comes from one run, so only great gains count and nothing is traded between knobs.
    """
    gain = ROUGH_GAIN if rough else GAIN
    ladders = {knob.place: knob.ladder() for knob in knobs if isinstance(knob.parameter, Bounded)}
    best, score = _diagonally(dict(start), ladders, rank, gain)
    moved = True
    while moved:
        moved = False
        for place, ladder in ladders.items():
            found, reached = _along(best, place, ladder, rank, score, gain)
            if is_better(reached, score, gain):
                best, score, moved = found, reached, True
        # Where what was asked for is not reached, there is nothing to spend elsewhere.
        for coarser, finer in itertools.permutations(ladders, 2) if not (moved or rough) and score[0] == 0.0 else ():
            rung = ladders[coarser].index(best[coarser])
            if rung == 0:
                continue
            # What one knob saves by going a rung down, the other may spend.
            other = {**best, coarser: ladders[coarser][rung - 1]}
            found, reached = _along(other, finer, ladders[finer], rank, rank(other), gain)
            if is_better(reached, score, gain):
                best, score, moved = found, reached, True
                break
    return best


def _diagonally(
    start: Settings, ladders: dict[str, tuple[object, ...]], rank: Callable[[Settings], Rank], gain: float
) -> tuple[Settings, Rank]:
    """Where a limit is broken: all knobs a rung finer (or coarser, if that is what helps) until it is kept.

    One knob alone may not help at all while another spoils the picture, and a descent would wander.
    """
    best, score = start, rank(start)
    for direction in (1, -1):
        other = best
        while score[0] > 0.0:
            rungs = {place: ladder.index(other[place]) + direction for place, ladder in ladders.items()}
            moved = {place: ladders[place][rung] for place, rung in rungs.items() if 0 <= rung < len(ladders[place])}
            if not moved:
                break
            other = {**other, **moved}
            found = rank(other)
            if not is_better(found, score, gain):
                break
            best, score = other, found
    return best, score


def _along(
    start: Settings, place: str, ladder: Sequence[object], rank: Callable[[Settings], Rank], score: Rank, gain: float
) -> tuple[Settings, Rank]:
    """The best rung of one ladder: from the present one first to where help is likely, then the other way.

    Where a limit is broken, an accurate rung may keep it; where all is kept, a fast one may cost less. (With a limit
    on the time it is the other way round, which costs a few rungs in vain.)
    """
    best, reached = start, score
    here = ladder.index(start[place])
    ways = (ladder[:here][::-1], ladder[here + 1 :])
    for rungs in ways if score[0] == 0.0 else ways[::-1]:
        if best is not start:
            break
        in_vain = 0
        for value in rungs:
            other = {**start, place: value}
            found = rank(other)
            if is_better(found, reached, gain):
                best, reached, in_vain = other, found, 0
            else:
                in_vain += 1
                if in_vain == PATIENCE:
                    break
    return best, reached
