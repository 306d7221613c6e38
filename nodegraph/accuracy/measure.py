"""Vary settings, time them, compare what they make with a reference.

What is timed is the nodes that the settings change, and all below them. What stands above keeps its results; what the
timed nodes keep by `memo` stays as well, as it does when a camera turns. docs/accuracy.md says how and why.
"""

from __future__ import annotations

import contextlib
import os
import platform
import statistics
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from nodegraph.accuracy.asked import check_figure, planned
from nodegraph.accuracy.measures import Measure, errors, measure_of
from nodegraph.accuracy.points import Measured, Point, ReferenceNote
from nodegraph.accuracy.settings import applied, encoded, quality_parameters
from nodegraph.accuracy.trial import Trial
from nodegraph.data import Image
from nodegraph.errors import DeviceError, DeviceMissing, GraphError, ParameterError
from nodegraph.overrides import declaration

if TYPE_CHECKING:
    from nodegraph.accuracy.reference import Reference
    from nodegraph.engine import Engine
    from nodegraph.network import Network
    from nodegraph.plan import Plan

DEVICES = ("gl", "cl", "cl64")
REPEATS = 5
BOUND = 1e-5

OnProgress = Callable[[str, float], None]


def measure(
    network: Network,
    view: str,
    variants: Iterable[Mapping[str, Any]] = ({},),
    devices: Sequence[str] | str = "auto",
    *,
    size: tuple[int, int] | None = None,
    repeats: int = REPEATS,
    error: str = "",
    flip: bool = False,
    bound: float = BOUND,
    refer: Callable[[Network], Reference] | None = None,
    on_progress: OnProgress = lambda text, fraction: None,
    name: str = "",
) -> Measured:
    """Time each setting on each device and tell its errors, the front marked.

    view:     a node or ``node.output`` that shows one value, of any type that has a measure.
    variants: settings as `settings.combinations` makes them: values by place. Every one is checked before one runs.
    devices:  names; "all" is every device that this machine has.
    repeats:  how often each is timed, after one run that is not counted. Within a repeat all take turns.
    error:    the figure that the front is about; by default the first of the measure. flip: tell the mean FLIP, too.
    bound:    of the reference. refer: makes references from a network, by default `nodegraph.accuracy.reference`.

    A setting that fails is a point with its ``failure``. Raises CommandError and ParameterError for what makes no
    sense, DeviceMissing for a device that is not there, the reference's double precision included.
    """
    if repeats < 1:
        raise ParameterError(f"repeats: {repeats} is below 1")
    wanted = [dict(settings) for settings in variants]
    if not wanted:
        raise ParameterError("measure: there is no setting to measure")
    networks = [applied(network, settings) for settings in wanted]
    told = [encoded(network, settings) for settings in wanted]
    plans = [planned(one, view, size) for one in networks]
    check_figure(plans[0], view, error, flip)
    timed = timed_nodes(network, view, plans)

    refer = refer or _default_reference(view, size, bound, on_progress)
    with contextlib.ExitStack() as stack:
        opened, notes = _open(stack, devices)
        references, which, values = _references(network, view, wanted, refer, bound, on_progress)
        trials = [
            Trial(networks[i], view, size, told[i], label, engine, timed, made)
            for label, (engine, _) in opened.items()
            for made in [dict[str, float]()]
            for i in range(len(networks))
        ]
        points: list[Point] = []
        kind: Measure | None = None
        for count, trial in enumerate(trials):
            on_progress(f"{trial.label}, first run", count / len(trials))
            place = which[count % len(networks)]
            value = trial.first()
            found: dict[str, float] = {}
            failure = trial.failure or references[place].failure
            if not failure:
                kind = measure_of(value)
                try:
                    found = errors(value, values[place].value, _mask_of(values[place]), flip=flip)
                except GraphError as refused:
                    failure = str(refused)
            image = value if isinstance(value, Image) else None
            points.append(
                Point(trial.settings, trial.device, errors=found, reference=place, image=image, failure=failure)
            )
        _take_turns(trials, repeats, on_progress)
    return Measured(
        name=name,
        view=view,
        size=size,
        repeats=repeats,
        error=error or (kind.first if kind else "max"),
        rising=kind.rising if kind else frozenset(),
        units=_units(kind, values),
        points=tuple(_timed_point(point, trial) for point, trial in zip(points, trials, strict=True)),
        references=tuple(references),
        timed=timed,
        devices={label: description for label, (_, description) in opened.items()},
        machine=f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}",
        notes=tuple(notes),
    ).with_front()


def _take_turns(trials: Sequence[Trial], repeats: int, on_progress: OnProgress) -> None:
    """Time all in each repeat, so that a machine that is busy for a while hits all alike.

    Every other repeat goes backwards: what comes after a heavy neighbour comes before it the next time.
    """
    working = [trial for trial in trials if not trial.failure]
    for repeat in range(repeats):
        for count, trial in enumerate(working if repeat % 2 == 0 else reversed(working)):
            done = (repeat + count / len(working)) / repeats
            on_progress(f"{trial.label}, repeat {repeat + 1} of {repeats}", done)
            if not trial.failure:
                trial.time()


def _timed_point(point: Point, trial: Trial) -> Point:
    failure = point.failure or trial.failure
    point = replace(point, failure=failure, notes=trial.notes)
    if not trial.seconds or trial.failure:
        return point
    return replace(
        point,
        seconds=statistics.median(trial.seconds),
        device_seconds=statistics.median(trial.device_seconds),
        prepare_seconds=trial.prepare_seconds,
        bytes=trial.bytes,
        runs=tuple(trial.seconds),
    )


def timed_nodes(network: Network, view: str, plans: Sequence[Plan]) -> tuple[str, ...]:
    """The nodes whose results the settings change, in the order in which they run.

    Where one setting stands alone: the nodes that hold a knob and those below them; without a knob, all.
    """
    prints: dict[str, list[frozenset[bytes]]] = {}
    for number, plan in enumerate(plans):
        own: dict[str, set[bytes]] = {}
        for task in plan.tasks:
            own.setdefault(task.path, set()).add(task.fingerprint)
        for path, keys in own.items():
            prints.setdefault(path, [frozenset()] * len(plans))[number] = frozenset(keys)
    changed = {path for path, keys in prints.items() if len(set(keys)) > 1}
    if not changed:
        changed = {knob.place.rpartition(".")[0] for knob in quality_parameters(network, view)} & prints.keys()
        for task in plans[0].tasks:
            above = {plans[0].tasks[i].path for sources in task.feeds.values() for i, _ in sources or ()}
            if above & changed:
                changed.add(task.path)
    return tuple(path for path in prints if path in changed or not changed)


# -- devices and references ------------------------------------------------------------------------------------------


def _open(stack: contextlib.ExitStack, devices: Sequence[str] | str) -> tuple[dict[str, tuple[Engine, str]], list[str]]:
    """An engine on each device, by the device's name, with its description. What "all" does not find is a note."""
    from nodegraph.engine import Engine

    names = [devices] if isinstance(devices, str) else list(devices)
    every = "all" in names
    opened: dict[str, tuple[Engine, str]] = {}
    notes: list[str] = []
    for name in DEVICES if every else names:
        # Nothing may answer from an earlier process either.
        engine = stack.enter_context(Engine(device=name, disk=False))
        try:
            device = engine.call(lambda engine=engine, name=name: engine.devices.choose(name).device)  # type: ignore[misc]
        except DeviceError as missing:
            if not every:
                raise
            notes.append(f"{name} is left out: {missing}")
            continue
        opened.setdefault(device.name, (engine, device.description))
    if not opened:
        raise DeviceMissing("; ".join(notes))
    return opened, notes


def _default_reference(
    view: str, size: tuple[int, int] | None, bound: float, on_progress: OnProgress
) -> Callable[[Network], Reference]:
    def refer(network: Network) -> Reference:
        from nodegraph.accuracy.reference import reference

        def show(text: str, fraction: float | None) -> None:
            on_progress(text, fraction or 0.0)

        return reference(network, view, size=size, bound=bound, show=show)

    return refer


def _references(
    network: Network,
    view: str,
    variants: Sequence[Mapping[str, Any]],
    refer: Callable[[Network], Reference],
    bound: float,
    on_progress: OnProgress,
) -> tuple[list[ReferenceNote], list[int], dict[int, Reference]]:
    """References, which of them each setting has, and what was found, by its place.

    Settings that differ in knobs alone have one reference: that of the network as it is. What is no knob (a filter's
    width, a camera) is a question of its own, and has its own answer.
    """
    places = {place for settings in variants for place in settings}
    knobs = {place for place in places if declaration(network, place).quality is not None}
    knobs |= {knob.variable for knob in quality_parameters(network, view)}
    notes: list[ReferenceNote] = []
    which: list[int] = []
    found: dict[int, Reference] = {}
    known: dict[str, int] = {}
    for settings in variants:
        own = {place: value for place, value in settings.items() if place not in knobs}
        told = encoded(network, own)
        key = repr(sorted(told.items()))
        if key not in known:
            place = known[key] = len(notes)
            try:
                made = refer(applied(network, own))
            except DeviceError:
                raise  # without double precision there is no reference of anything
            except GraphError as failed:
                notes.append(ReferenceNote(told, bound=bound, failure=f"no reference: {failed}"))
            else:
                found[place] = made
                notes.append(_note_of(told, made))
        which.append(known[key])
    return notes, which, found


def _mask_of(made: Reference) -> Any:
    """Where to look; the whole where nothing converged, wrong as the reference may be."""
    return made.mask if made.mask is not None and made.mask.any() else None


def _note_of(settings: Mapping[str, Any], made: Reference) -> ReferenceNote:
    note = ReferenceNote(
        settings, made.summary(), made.converged, made.difference, made.bound, made.rounds, notes=made.notes
    )  # fmt: skip
    mask = _mask_of(made)
    if mask is not None:
        note = replace(note, left_out=made.share_left_out)
    elif made.mask is not None:
        lost = "nothing of the reference converged, so nothing is left out, and the errors are as uncertain as it is"
        note = replace(note, notes=(*note.notes, lost))
    return replace(note, image=made.value, mask=mask) if isinstance(made.value, Image) else note


def _units(kind: Measure | None, references: Mapping[int, Reference]) -> dict[str, str]:
    """Units of the figures; those of a volume are its own."""
    units = dict(kind.units) if kind is not None else {}
    unit = next((getattr(getattr(found.value, "mapping", None), "unit", "") for found in references.values()), "")
    if unit:
        units |= dict.fromkeys(("max", "rmse", "p999"), unit)
    return units
