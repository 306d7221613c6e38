"""The result that errors are measured against: double precision, refined until it no longer changes.

The network is the same and so are its kernels. Every parameter of quality, and every one that declares ``reference=``,
takes its reference value; those that are a walk (``reference=(3, 5, 8)``, or a number that is halved or doubled) go one
step further in each round. Two rounds that agree end it. What still differs then is counted and masked.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from nodegraph import links
from nodegraph.accuracy.differences import distance
from nodegraph.accuracy.ladders import refined
from nodegraph.accuracy.running import Cancelled, Show, run_view, shown_value
from nodegraph.accuracy.settings import WIRED, Settings, copy_of, parameters_above
from nodegraph.cache import Result
from nodegraph.data import Image, Volume
from nodegraph.data.buffer import Array
from nodegraph.errors import DeviceError, DeviceMissing, ParameterError, PortError
from nodegraph.fingerprint import canonical, digest
from nodegraph.lasting import LastingKeys
from nodegraph.network import split
from nodegraph.params import Bounded, Parameter
from nodegraph.plan import plan

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.network import Network

BOUND = 1e-5
MAX_ROUNDS = 10
RULES = "1"
"""Counts changes of how a reference is made, so that what was kept by older rules is made anew."""


@dataclass(frozen=True)
class Reference:
    """A converged result, or as near to one as it came.

    value:      what the view shows, in double precision where kernels made it.
    mask:       of pictures (h, w) and volumes (z, y, x), True where the last two rounds agree; None of other values.
    difference: the greatest that was left between the last two rounds, where the mask is False as well. Of pictures
                it is absolute (white is 1), of other values a share of the greatest magnitude.
    rounds:     how many were run. settings: the values of the last one, by place.
    left_out:   how many pixels or voxels the mask leaves out. notes: what could not be refined, and why.
    """

    value: Any
    mask: Array | None
    difference: float
    rounds: int
    converged: bool
    bound: float
    settings: Settings = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    seconds: float = 0.0
    kept: bool = False

    @property
    def left_out(self) -> int:
        return int(np.count_nonzero(~self.mask)) if self.mask is not None else 0

    @property
    def share_left_out(self) -> float:
        """Share of pixels or voxels that the mask leaves out, 0..1."""
        return self.left_out / self.mask.size if self.mask is not None and self.mask.size else 0.0

    def summary(self) -> str:
        """One sentence: how good it is."""
        rounds = f"{self.rounds} round{'s' if self.rounds != 1 else ''}"
        if self.converged and self.rounds == 1:
            return "reference in 1 round; nothing in it can be refined"
        if self.converged:
            return f"reference in {rounds}, the last two agree within {self.difference:.2g}"
        if self.mask is None:
            return f"the reference did not converge in {rounds}: the last two differ by {self.difference:.2g}"
        what = "pixels" if self.mask.ndim == 2 else "voxels"
        return (
            f"the reference did not converge in {rounds}: {self.left_out} of {self.mask.size} {what} still differ, "
            f"by up to {self.difference:.2g}"
        )


def reference(
    network: Network,
    view: str,
    size: tuple[int, int] | None = None,
    bound: float = BOUND,
    *,
    device: str = "cl64",
    max_rounds: int = MAX_ROUNDS,
    engine: Engine | None = None,
    show: Show | None = None,
    cancelled: Cancelled | None = None,
) -> Reference:
    """Return the reference of what a view shows: made now, or kept on disk from an earlier time.

    view: a node, or ``node.output``. size: of the picture, pixels; None for the view's own. bound: what two rounds may
    differ by, of pictures in linear colour, of other values as a share of the greatest magnitude. engine: one on that
    device; None takes the one of this process. The network is not changed.

    A reference that does not converge is returned as it is, and says so; it is kept, too. Raises DeviceError where
    there is no double precision, CommandError for views that are not there, the error of a node that fails, Cancelled.
    """
    if not bound > 0.0:
        raise ParameterError(f"reference: the bound must be above 0, got {bound!r}")
    if max_rounds < 2:
        raise ParameterError(f"reference: it takes at least 2 rounds to compare, got {max_rounds}")
    walk = _Walk(network, view)
    engine = engine or _engine(device)
    key = _key(walk.network, view, size, bound, max_rounds, device)
    kept = _kept(engine, key, walk.notes)
    if kept is not None:
        return kept

    start = time.perf_counter()
    before: Any = None
    value, mask, difference, rounds, settled = None, None, np.inf, 0, False
    while rounds < max_rounds and not settled:
        try:
            label = f"reference, round {rounds + 1}:"
            report = run_view(engine, walk.network, view, size, label=label, show=show, cancelled=cancelled)
        except DeviceMissing as error:
            raise _no_double(device, error) from None
        value = shown_value(report, view)
        rounds += 1
        settings = dict(walk.settings)
        notes = tuple(dict.fromkeys((*walk.notes, *_single(report, walk.network, view, size))))
        if before is not None:
            mask, difference = agreement(value, before, bound)
            settled = difference <= bound
        before = value
        if not settled and not walk.go_on():
            if rounds == 1:
                # Everything takes a fixed value: there is no second round to compare with.
                mask, difference = agreement(value, value, bound)
                settled = True
            break
    made = Reference(
        value, mask, float(difference), rounds, settled, bound, settings, notes, time.perf_counter() - start
    )
    _keep(engine, key, made)
    return made


# -- the walk -----------------------------------------------------------------------------------------------------


class _Walk:
    """A copy of a network whose parameters go from one reference value to the next."""

    def __init__(self, network: Network, view: str) -> None:
        self.network = copy_of(network)
        self.view = view
        self.settings: Settings = {}
        self.notes: list[str] = []
        self._rounds: dict[str, int] = {}
        self._advance()

    def go_on(self) -> bool:
        """Take the next round's values. False where every value is the last one already."""
        before = dict(self.settings)
        for place in self._rounds:
            self._rounds[place] += 1
        self._advance()
        return self.settings != before

    def _advance(self) -> None:
        """Set everything that is visible; a choice may show what was hidden, so look until nothing new appears."""
        done: set[str] = set()
        while True:
            found = [
                (place, parameter, value)
                for place, parameter, value in parameters_above(self.network, self.view)
                if place not in done and (parameter.quality is not None or parameter.reference)
            ]
            # Choices and switches first: they decide what else means something.
            found.sort(key=lambda one: isinstance(one[1], Bounded))
            if not found:
                return
            self._step(*found[0])
            done.add(found[0][0])

    def _step(self, place: str, parameter: Parameter, value: Any) -> None:
        round = self._rounds.setdefault(place, 0)
        if parameter.reference:
            wanted = parameter.reference[min(round, len(parameter.reference) - 1)]
        elif value is WIRED:
            self._note(f"{place}: a wire decides its value, so the reference takes it as it is")
            return
        elif isinstance(parameter, Bounded):
            finer = refined(parameter, value, parameter.min, parameter.max)
            wanted = value if round == 0 else finer
            if finer == value == 0 and parameter.quality == "higher":
                self._note(f"{place}: it is 0, which no doubling refines")
        else:
            wanted = refined(parameter, value)
        if value is WIRED or wanted != value:
            self._set(place, wanted)
        self.settings[place] = wanted

    def _set(self, place: str, value: Any) -> None:
        """Set one parameter of the copy, whoever decides it: a reference follows no wire and no expression."""
        path, name = split(place)
        leaf = self.network.node(path)
        if links.is_wired(leaf, name):
            self.network.disconnect(_wire_end(leaf, name))
        link = links.link_of(leaf, name)
        if link is not None:
            holder, param, _ = link
            self.network.unlink(f"{holder.path}.{param}")
        self.network.set(place, value)

    def _note(self, text: str) -> None:
        if text not in self.notes:
            self.notes.append(text)


def _wire_end(leaf: Any, name: str) -> str:
    """Where the wire ends that feeds a parameter: at the node itself, or at the face of a group around it."""
    node, param = leaf, name
    while param not in node.inputs:
        owner = node.parent.owner
        inner = f"{node.id}.{param}"
        node, param = owner, next(face for face, ports in owner.expose.params.items() if inner in ports)
    return f"{node.path}.{param}"


# -- agreement ----------------------------------------------------------------------------------------------------


def agreement(value: Any, before: Any, bound: float) -> tuple[Array | None, float]:
    """Where two rounds agree within the bound (None of values without places), and the greatest difference.

    Pictures count their colour in every channel, absolutely; volumes their real values as a share of the greatest
    magnitude; all else by its measure, relative where that is told. Depth does not count: at the edge of what is
    barely visible it jumps however fine the round is.
    """
    if isinstance(value, Image) and isinstance(before, Image) and value.color.shape == before.color.shape:
        scale = 1.0 if value.channels != 2 else _magnitude(value.color)
        apart = distance(value.color, before.color).max(axis=-1, initial=0.0) / scale
    elif isinstance(value, Volume) and isinstance(before, Volume) and value.data.shape == before.data.shape:
        now = value.real(np.float64)
        apart = distance(now, before.real(np.float64)) / _magnitude(now)
        apart = apart.max(axis=-1, initial=0.0) if apart.ndim == 4 else apart
    else:
        return None, _by_measure(value, before)
    return apart <= bound, float(apart.max(initial=0.0))


def _magnitude(values: Array) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max(initial=0.0)) or 1.0


def _by_measure(value: Any, before: Any) -> float:
    from nodegraph.accuracy.measures import errors, measure_of

    try:
        found = errors(value, before)
    except PortError:
        # Two rounds of a mesh or a table that differ in kind are as far apart as can be; a type that no measure
        # knows is refused when somebody asks for its error.
        measure_of(value)
        return float("inf")
    return float(found["relative"] if "relative" in found else found[measure_of(value).first])


def _single(report: Any, network: Network, view: str, size: tuple[int, int] | None) -> list[str]:
    """Nodes of a reference that have no double precision: those that draw with OpenGL."""
    tasks = plan(network.flatten(), [view], size=size, device=lambda: "cl64").tasks
    return [
        f"{task.path}: it draws with OpenGL, in single precision"
        for task in tasks
        if task.processor is not None and "gl" in task.processor.services
    ]


# -- on disk ------------------------------------------------------------------------------------------------------


def _engine(device: str) -> Engine:
    from nodegraph import scripting

    return scripting.engine(device)


def _no_double(device: str, error: DeviceError) -> DeviceError:
    cure = str(error).removeprefix(f"{device}: ")
    return DeviceMissing(f"reference: a reference needs double precision on the device {device}: {cure}")


def _key(
    network: Network, view: str, size: tuple[int, int] | None, bound: float, max_rounds: int, device: str
) -> bytes:
    """What a reference depends on, the same in every process: its first round on this device, and how it goes on."""
    planned = plan(network.flatten(), [view], size=size, device=lambda: device)
    lasting = LastingKeys(planned)
    parts: list[bytes | str] = ["reference", RULES, canonical([bound, max_rounds])]
    for feeds in planned.sinks.values():
        for place, output in feeds:
            parts += [lasting.key(place), output]
    return digest(*parts)


def _kept(engine: Engine, key: bytes, notes: list[str]) -> Reference | None:
    result = (engine.disk.get(key) if engine.disk is not None else None) or engine.cache.get(key)
    if result is None:
        return None
    told = result.values["told"]
    return Reference(
        result.values["value"],
        result.values["mask"],
        told["difference"],
        told["rounds"],
        told["converged"],
        told["bound"],
        dict(told["settings"]),
        tuple(told["notes"]),
        result.seconds,
        kept=True,
    )


def _keep(engine: Engine, key: bytes, made: Reference) -> None:
    """On disk where the type of the value can lie there, else for as long as the engine lives."""
    told = {
        "difference": made.difference,
        "rounds": made.rounds,
        "converged": made.converged,
        "bound": made.bound,
        "settings": dict(made.settings),
        "notes": list(made.notes),
    }
    result = Result({"value": made.value, "mask": made.mask, "told": told}, made.seconds)
    if engine.disk is None or engine.disk.put(key, result):
        engine.cache.put(key, result)
