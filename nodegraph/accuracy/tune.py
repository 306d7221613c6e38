"""Find the cheapest settings that keep an error, or the most accurate ones that keep a time.

The promise shall hold for views that were not looked at while searching. So the error of a setting is its worst on
several cameras around the scene, a part of the error is kept as a margin, and what was found is tried on cameras that
had no part in finding it. If one of these breaks the bound, it joins those that are searched on, the margin grows,
and the next trial has new cameras again.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from nodegraph.accuracy.asked import check_figure, planned
from nodegraph.accuracy.descent import Rank, combinations_of_choices, descend, is_better
from nodegraph.accuracy.front import pareto
from nodegraph.accuracy.reference import BOUND, Reference, reference
from nodegraph.accuracy.running import Cancelled, Show
from nodegraph.accuracy.settings import Knob, Settings, applied, changes, find_knobs, require_value
from nodegraph.accuracy.tries import Tried, Tries
from nodegraph.errors import CommandError, ParameterError
from nodegraph.params import Bounded
from nodegraph.requests import sink_size

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.network import Network

CAMERAS, HELD_OUT = 4, 4
REPEATS = 3
MOST_CAMERAS, MOST_REPEATS = 1000, 10_000
"""More than anybody would wait for: the time for the search begins when the present setting was tried on all."""
MARGIN = 0.8
"""Share of the allowed error, and of the time, that the cameras of the search may use."""
UNFELT = 5e-3
"""Seconds that are added to every time before times are compared: below it, shares of a time are noise."""
TIGHTENINGS = 4
SEARCH_SECONDS = 120.0
"""How long a search goes on trying new settings, references and the last trials apart."""
FINALISTS = 3
SIDE = 256
"""Longest side, in pixels, of the pictures that an error is tuned on where nobody says a size."""


@dataclass(frozen=True)
class Tuned:
    """What a search found.

    settings: the values that differ from those of the network, by place; empty where it is best as it is.
    best:     these settings on the cameras of the search. before: the network as it was, on these and the others.
    held_out: the best on cameras that had no part in the search; None where there is but one camera.
    met:      whether everything that was asked for is kept, on the cameras of the search and on the others.
    tried:    every setting that was tried, the front marked.
    figure:   what is meant by the error. left_out: parameters of quality that could not be set, and why.
    rounds:   how often the search began anew with less of the error to spend. ended: it ran out of time.
    """

    settings: Settings
    best: Tried
    before: Tried
    held_out: Tried | None
    met: bool
    tried: tuple[Tried, ...]
    figure: str
    max_error: float | None
    budget_ms: float | None
    size: tuple[int, int]
    device: str
    units: dict[str, str]
    left_out: dict[str, str]
    notes: tuple[str, ...] = ()
    rounds: int = 1
    ended: bool = False

    @property
    def error(self) -> float:
        """The error on all cameras, those of the search and the others."""
        seen = [self.best, *([self.held_out] if self.held_out is not None else [])]
        return max(tried.errors.get(self.figure, math.inf) for tried in seen)

    @property
    def front(self) -> list[Tried]:
        """The front of what was tried on all cameras of the search, from the fastest on."""
        most = max((len(one.cameras) for one in self.tried), default=0)
        front = [one for one in self.tried if one.front and len(one.cameras) == most]
        return sorted(front, key=lambda one: one.seconds)

    def summary(self) -> str:
        """One sentence: what was found, and whether it is what was asked for."""
        unit = f" {self.units[self.figure]}" if self.figure in self.units else ""
        slowest = max(one.seconds for one in (self.best, self.held_out) if one is not None)
        cost = f"{1e3 * slowest:.3g} ms at {self.size[0]}x{self.size[1]} on {self.device}"
        found = f"{self.figure} {self.error:.3g}{unit} in {cost}"
        asked = " and ".join(
            ([f"{self.figure} {self.max_error:g}{unit}"] if self.max_error is not None else [])
            + ([f"{self.budget_ms:g} ms"] if self.budget_ms is not None else [])
        )
        if self.met:
            before = self.before.errors.get(self.figure, math.inf)
            return f"{found}; before: {before:.3g}{unit} in {1e3 * self.before.seconds:.3g} ms"
        return f"no setting that was tried keeps {asked}; the best of them has {found}"


def tune(
    network: Network,
    view: str,
    max_error: float | None = None,
    budget_ms: float | None = None,
    *,
    figure: str = "",
    size: tuple[int, int] | None = None,
    device: str = "auto",
    cameras: int = CAMERAS,
    held_out: int = HELD_OUT,
    repeats: int = REPEATS,
    margin: float = MARGIN,
    bound: float | None = None,
    seconds: float = SEARCH_SECONDS,
    engine: Engine | None = None,
    refer: Callable[..., Reference] = reference,
    show: Show | None = None,
    cancelled: Cancelled | None = None,
) -> Tuned:
    """Search the knobs above a view. The network is not changed; `applied(network, tuned.settings)` is the tuned one.

    max_error: of ``figure``, by default the first of the measure (pictures: max, the worst channel of the worst pixel).
    budget_ms: milliseconds that the nodes may take that run anew when the view turns. With a bound on the error, the
               cheapest setting under it is sought; with a budget alone, the most accurate one within it.
    size:      of the pictures; None: the view's own for a budget, else at most 256 pixels wide and high.
    cameras:   how many are searched on, the given one among them; held_out: how many others it is tried on then.
    bound:     of the references; None: a fiftieth of ``max_error``, at most 1e-5 otherwise.
    seconds:   how long new settings are tried; what was found until then is offered, and a note says so.

    What cannot be kept is no error: ``met`` is then False, and the best that was found is offered. Raises
    ParameterError and CommandError for what makes no sense, DeviceError where there is no double precision, Cancelled.
    """
    _check(max_error, budget_ms, cameras, held_out, repeats, margin, seconds)
    require_value(network, view)
    check_figure(planned(network, view, size), view, figure, flip=False)
    knobs = find_knobs(network, view)
    if not knobs.knobs:
        said = "".join(f"; {place}: {reason}" for place, reason in knobs.left_out.items())
        raise CommandError(f"{view}: nothing above it declares a quality that could be tuned{said}")
    pixels = size or _size(network, view, small=budget_ms is None)
    precise = bound if bound is not None else BOUND if max_error is None else max(min(max_error / 50.0, 1e-3), BOUND)
    if engine is not None:
        search = _Search(network, view, pixels, engine, figure, precise, refer, show, cancelled, seconds)
        return search.run(max_error, budget_ms, cameras, held_out, repeats, margin, knobs.left_out)
    from nodegraph.engine import Engine as Own

    with Own(device=device, disk=False) as own:  # nothing may be answered from an earlier process
        search = _Search(network, view, pixels, own, figure, precise, refer, show, cancelled, seconds)
        return search.run(max_error, budget_ms, cameras, held_out, repeats, margin, knobs.left_out)


class _Search:
    """One search: its tries, and what is asked for."""

    def __init__(
        self,
        network: Network,
        view: str,
        size: tuple[int, int],
        engine: Engine,
        figure: str,
        bound: float,
        refer: Callable[..., Reference],
        show: Show | None,
        cancelled: Cancelled | None,
        seconds: float,
    ) -> None:
        self.network, self.view, self.size = network, view, size
        self.seconds = seconds
        self.deadline = math.inf
        self.ended = False
        self.tries = Tries(
            network, view, size, engine, figure=figure, bound=bound, refer=refer, show=show, stop=cancelled
        )
        self.limit: float | None = None
        self.budget: float | None = None

    def run(
        self,
        max_error: float | None,
        budget_ms: float | None,
        cameras: int,
        held_out: int,
        repeats: int,
        margin: float,
        left_out: dict[str, str],
    ) -> Tuned:
        tries, alone = self.tries, bool(self.tries.orbit.fixed)
        numbers = [0] if alone else list(range(cameras))
        fresh = 0 if alone else held_out
        asked = _Asked(max_error, None if budget_ms is None else budget_ms / 1e3, tries)
        self.limit = None if max_error is None else margin * max_error
        self.budget = None if asked.seconds is None else margin * asked.seconds
        tries.of({}, numbers, repeats)
        self.deadline = time.monotonic() + self.seconds
        starts = self._scout(repeats)
        next_camera, rounds = len(numbers), 1
        while True:
            best = self._refine(starts, numbers, repeats)
            others = list(range(next_camera, next_camera + fresh))
            next_camera += fresh
            trial = tries.of(best.settings, others, repeats) if others else None
            met = asked.is_kept_by(best) and (trial is None or asked.is_kept_by(trial))
            if met or trial is None or not asked.is_kept_by(best) or rounds > TIGHTENINGS:
                break
            rounds += 1
            numbers += [one for one in others if not asked.is_kept_by(tries.of(best.settings, [one], repeats))]
            self.limit = _tightened(self.limit, max_error, asked.error(trial))
            self.budget = _tightened(self.budget, asked.seconds, trial.seconds)
        before = tries.of({}, numbers, repeats)
        if trial is not None:
            before = _worse(before, tries.of({}, others, repeats), tries.figure)
        changed = changes(self.network, self.view, best.settings)
        return Tuned(
            changed, best, before, trial, met, self._with_front(), tries.figure, max_error, budget_ms,
            self.size, self._device(), tries.units, left_out, self._notes(), rounds, self.ended,
        )  # fmt: skip

    def _scout(self, repeats: int) -> list[Settings]:
        """Descend once for every combination of choices, on the given camera; the best few of them."""
        knobs = find_knobs(self.network, self.view).knobs
        found: list[tuple[Rank, Settings]] = []
        combinations = combinations_of_choices(knobs)
        idle: set[str] = set()  # numbers that save no time
        for count, choices in enumerate(combinations):
            shown = find_knobs(applied(self.network, choices), self.view).knobs
            start = {knob.place: choices.get(knob.place, knob.value) for knob in shown}
            part = count / len(combinations)
            over, cost = self._rank(start, [0], 1, part)
            if self.limit is not None and over > 0.0 and any(rank[0] == 0.0 and rank[1] < cost for rank, _ in found):
                continue  # it would have to become more accurate, and is dearer already than what suffices
            free = [knob for knob in shown if knob.place not in idle]
            best = descend(start, free, lambda settings, part=part: self._rank(settings, [0], 1, part), rough=True)  # type: ignore[misc]
            idle |= {knob.place for knob in free if best[knob.place] == start[knob.place] and self._is_idle(best, knob)}
            found.append((self._rank(best, [0], repeats, part), best))
        found.sort(key=lambda one: one[0])
        return [settings for _, settings in found[:FINALISTS]]

    def _is_idle(self, settings: Settings, knob: Knob) -> bool:
        """Whether two rungs towards the fast end of a number save nothing that could be felt."""
        ladder = knob.ladder()
        rung = ladder.index(settings[knob.place])
        other = {**settings, knob.place: ladder[max(0, rung - 2)]}
        if rung == 0 or not isinstance(knob.parameter, Bounded) or time.monotonic() > self.deadline:
            return False
        return self.tries.of(other, [0], 1).seconds > 0.95 * self.tries.of(settings, [0], 1).seconds

    def _refine(self, starts: Sequence[Settings], cameras: list[int], repeats: int) -> Tried:
        """Descend from the best few again, on all cameras; the best one, as it is there."""
        best: tuple[Rank, Settings] | None = None
        for count, start in enumerate(starts):
            shown = find_knobs(applied(self.network, start), self.view).knobs
            part = count / len(starts)

            def rank(settings: Settings, part: float = part) -> Rank:
                return self._rank(settings, cameras, repeats, part)

            self.tries.of(start, cameras, repeats)  # also when the time is up: these are what was found until then
            found = descend(start, shown, rank)
            score = rank(found)
            if best is None or is_better(score, best[0]):
                best = (score, found)
        assert best is not None
        # What is there already stays, unless the other is better by more than chance.
        present = self._rank({}, cameras, repeats, 1.0)
        return self.tries.of(best[1] if is_better(best[0], present) else {}, cameras, repeats)

    def _rank(self, settings: Settings, cameras: Sequence[int], repeats: int, part: float) -> Rank:
        count = len(self.tries.tried)
        if time.monotonic() > self.deadline and not self.tries.knows(settings, cameras):
            self.ended = True
            return math.inf, math.inf
        place = "on all cameras" if len(cameras) > 1 else "on the given camera"
        self.tries.tell(f"{count} settings tried, searching {place}", part)
        tried = self.tries.of(settings, cameras, repeats)
        error = tried.errors.get(self.tries.figure, math.inf)
        over = 0.0
        if self.limit is not None:
            over = max(over, _excess(error, self.limit))
        if self.budget is not None:
            over = max(over, _excess(tried.seconds, self.budget))
        return over, tried.seconds + UNFELT if self.limit is not None else error

    def _device(self) -> str:
        used = self.tries.engine.device_in_use
        return used["name"] if used is not None else "the host"

    def _with_front(self) -> tuple[Tried, ...]:
        """All tries, the front marked among those of equally many cameras: more cameras, a worse worst."""
        marked: list[Tried] = []
        for count in sorted({len(one.cameras) for one in self.tries.tried.values()}, reverse=True):
            group = [one for one in self.tries.tried.values() if len(one.cameras) == count and 0 in one.cameras]
            marks = pareto(
                [one.seconds if not one.failure else math.nan for one in group],
                [one.errors.get(self.tries.figure, math.nan) for one in group],
            )
            marked += [replace(one, front=mark) for one, mark in zip(group, marks, strict=True)]
        return tuple(marked)

    def _notes(self) -> tuple[str, ...]:
        notes: list[Any] = [self.tries.orbit.fixed] if self.tries.orbit.fixed else []
        if self.ended:
            notes.append(f"the search ended after {self.seconds:g} s; with more (--seconds) it may find better")
        for camera, found in self.tries.references.items():
            if not found.converged:
                notes.append(f"camera {camera}: {found.summary()}")
            notes += found.notes
        return tuple(dict.fromkeys(notes))


@dataclass(frozen=True)
class _Asked:
    """What the user asked for, without any margin."""

    max_error: float | None
    seconds: float | None
    tries: Tries

    def error(self, tried: Tried) -> float:
        return tried.errors.get(self.tries.figure, math.inf)

    def is_kept_by(self, tried: Tried) -> bool:
        return (self.max_error is None or self.error(tried) <= self.max_error) and (
            self.seconds is None or (tried.seconds <= self.seconds and not tried.failure)
        )


def _worse(one: Tried, other: Tried, figure: str) -> Tried:
    """A setting on the cameras of two trials: its worst error of that figure, its longest time."""
    errors = {figure: max(tried.errors.get(figure, math.inf) for tried in (one, other))}
    cameras = (*one.cameras, *other.cameras)
    return replace(
        one,
        seconds=max(one.seconds, other.seconds),
        errors={**one.errors, **errors},
        cameras=cameras,
        failure=one.failure or other.failure,
    )


def _tightened(limit: float | None, asked: float | None, found: float) -> float | None:
    """What the next search may use, after other cameras found more than was asked for."""
    if limit is None or asked is None or found <= asked:
        return limit
    return limit * max(0.25, min(0.9, asked / found))


def _excess(value: float, limit: float) -> float:
    """By which share a limit is broken."""
    return max(0.0, value / limit - 1.0)


def _size(network: Network, view: str, *, small: bool) -> tuple[int, int]:
    width, height = sink_size(network.flatten(), view)
    scale = min(1.0, SIDE / max(width, height)) if small else 1.0
    return max(1, round(width * scale)), max(1, round(height * scale))


def _check(
    max_error: float | None,
    budget_ms: float | None,
    cameras: int,
    held_out: int,
    repeats: int,
    margin: float,
    seconds: float,
) -> None:
    if max_error is None and budget_ms is None:
        raise ParameterError("tune: say what is allowed, an error (--max-error) or a time (--budget-ms), or both")
    for name, value in (("max_error", max_error), ("budget_ms", budget_ms)):
        if value is not None and not 0.0 < value < math.inf:
            raise ParameterError(f"tune: {name} must be above 0 and finite, got {value!r}")
    if cameras < 1 or held_out < 0 or repeats < 1:
        raise ParameterError("tune: it takes at least 1 camera, 1 repeat, and 0 or more held-out cameras")
    if max(cameras, held_out) > MOST_CAMERAS or repeats > MOST_REPEATS:
        raise ParameterError(
            f"tune: it takes at most {MOST_CAMERAS} cameras, as many held out, {MOST_REPEATS} repeats; ask for fewer"
        )
    if not seconds > 0.0:
        raise ParameterError(f"tune: seconds must be above 0, got {seconds!r}")
    if not 0.0 < margin <= 1.0:
        raise ParameterError(f"tune: the margin is a share of the error, above 0 and at most 1, got {margin!r}")
