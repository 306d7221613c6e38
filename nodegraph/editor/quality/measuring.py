"""What the quality panel computes, off the window's thread: errors against a reference, and proposals by `tune`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from nodegraph.accuracy import errors, reference, tune
from nodegraph.accuracy.points import text
from nodegraph.accuracy.running import Cancelled, Show, run_view, shown_value
from nodegraph.accuracy.settings import Settings, changes
from nodegraph.accuracy.tune import Tuned
from nodegraph.data import Image
from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.accuracy.reference import Reference
    from nodegraph.data.buffer import Array
    from nodegraph.engine import Engine
    from nodegraph.network import Network

SIDE = 128
"""Longest side, in pixels, of the pictures that errors are measured on: a reference takes seconds, not minutes."""
CAMERAS, HELD_OUT, REPEATS = 2, 1, 3
"""Fewer cameras than the command line takes, since somebody waits."""

Copy = Callable[[], "Network"]
"""Makes a copy of the document as it was, see `nodegraph.accuracy.settings.snapshot`."""


@dataclass(frozen=True)
class Errors:
    """The errors of a view as it is set. figures: by name; image and reference are of `size` (width, height).

    mask: (h, w), True where the reference converged, None where all of it counts. notes: what should be known.
    """

    figures: dict[str, float]
    size: tuple[int, int]
    image: Image
    reference: Reference
    mask: Array | None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Choice:
    """A setting on the front: what it costs and loses, and what would have to be changed to have it."""

    seconds: float
    error: float
    changes: Settings
    told: str


@dataclass(frozen=True)
class Proposal:
    """What a search found. choices: the front, from the fastest on; best: the one that is proposed, or None.

    others: (seconds, error) of all else that was tried on the same cameras. before: of the present settings.
    """

    tuned: Tuned
    choices: tuple[Choice, ...]
    best: int | None
    others: tuple[tuple[float, float], ...]
    before: tuple[float, float]


def bounded(size: tuple[int, int], side: int = SIDE) -> tuple[int, int]:
    """A size of the same proportions with no side above ``side`` pixels."""
    scale = min(1.0, side / max(size))
    return max(1, round(size[0] * scale)), max(1, round(size[1] * scale))


def measure(
    copy: Copy, view: str, size: tuple[int, int], engine: Engine, precise: Engine, show: Show, cancelled: Cancelled
) -> Errors:
    """The error of a view as ``engine`` renders it, against a reference of ``precise``.

    Raises PortError where a view shows no picture, DeviceError without double precision, Cancelled, a node's error.
    """
    network = copy()
    image = shown_value(run_view(engine, network, view, size, show=show, cancelled=cancelled), view)
    found = referred(copy, view, size, precise, show, cancelled)
    mask = found.mask if found.mask is not None and found.mask.any() else None
    notes = found.notes
    try:
        figures = errors(image, found.value, mask, flip=True)
    except GraphError as refused:
        figures = errors(image, found.value, mask)
        notes = (*notes, f"FLIP is not known: {refused}")
    return Errors(figures, size, image, found, mask, notes)


def referred(
    copy: Copy, view: str, size: tuple[int, int], precise: Engine, show: Show, cancelled: Cancelled
) -> Reference:
    """The reference of a view."""
    return reference(copy(), view, size, engine=precise, show=show, cancelled=cancelled)


def propose(
    copy: Copy,
    view: str,
    max_error: float | None,
    figure: str,
    budget_ms: float | None,
    seconds: float,
    size: tuple[int, int],
    device: str,
    precise: Engine,
    show: Show,
    cancelled: Cancelled,
) -> Proposal:
    """Search for ``seconds`` what keeps an error, or a time at this size, or both; see `nodegraph.accuracy.tune`."""
    network = copy()
    found = tune(
        network,
        view,
        max_error,
        budget_ms,
        figure=figure,
        size=size,
        device=device,
        cameras=CAMERAS,
        held_out=HELD_OUT,
        repeats=REPEATS,
        seconds=seconds,
        refer=partial(reference, engine=precise),
        show=show,
        cancelled=cancelled,
    )
    return proposal(network, view, found)


def proposal(network: Network, view: str, found: Tuned) -> Proposal:
    """A search as the panel shows it."""

    def place(tried: Any) -> tuple[float, float]:
        return tried.seconds, tried.errors.get(found.figure, float("inf"))

    choices = tuple(_choice(network, view, *place(tried), tried.settings) for tried in found.front)
    proposed = next((i for i, one in enumerate(choices) if one.changes == found.settings), None)
    if proposed is None:
        # Beside the front by a hair, since times are noisy; it is offered all the same.
        own = _choice(network, view, *place(found.best), found.best.settings)
        choices = tuple(sorted((*choices, own), key=lambda one: one.seconds))
        proposed = choices.index(own)
    cameras = len(found.best.cameras)
    others = tuple(place(tried) for tried in found.tried if len(tried.cameras) == cameras and not tried.failure)
    return Proposal(found, choices, proposed, others, place(found.before))


def _choice(network: Network, view: str, seconds: float, error: float, settings: Settings) -> Choice:
    changed = changes(network, view, settings)
    told = ", ".join(f"{place} = {text(value)}" for place, value in changed.items()) or "as it is"
    return Choice(seconds, error, changed, told)
