"""Settings that are tried: run, timed and compared with the reference, each camera for itself and each only once."""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from nodegraph.accuracy.measures import errors, measure_of
from nodegraph.accuracy.orbit import Orbit
from nodegraph.accuracy.reference import Reference, reference
from nodegraph.accuracy.running import Cancelled as Stop
from nodegraph.accuracy.running import Show
from nodegraph.accuracy.settings import Settings, applied, parameters_above
from nodegraph.accuracy.trial import Trial
from nodegraph.errors import Cancelled, GraphError, ParameterError, near_miss_or_all
from nodegraph.plan import Plan, plan

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.network import Network


@dataclass(frozen=True)
class Tried:
    """A setting and what it costs and loses, the worst of its cameras.

    settings: values by place. seconds: median of the slowest camera. errors: the greatest of each figure.
    cameras:  their numbers; 0 is the given one. failure: why it makes no result, if it does not.
    front:    no other setting that was tried on as many cameras beats it in both time and error.
    """

    settings: Settings
    seconds: float
    errors: dict[str, float] = field(default_factory=dict)
    cameras: tuple[int, ...] = (0,)
    failure: str = ""
    front: bool = False


class Tries:
    """Tries settings of one network. Equal work is done once: what decides is the fingerprint of the result.

    refer: makes the reference of a network; the tests of the search bring their own.
    """

    def __init__(
        self,
        network: Network,
        view: str,
        size: tuple[int, int] | None,
        engine: Engine,
        *,
        figure: str = "",
        bound: float,
        refer: Callable[..., Reference] = reference,
        show: Show | None = None,
        stop: Stop | None = None,
    ) -> None:
        self.network = network
        self.view = view
        self.size = size
        self.engine = engine
        self.bound = bound
        self.orbit = Orbit(network, view)
        self.show = show
        self.stop = stop
        self.units: dict[str, str] = {}
        self.figure = figure
        self.references: dict[int, Reference] = {}
        self.tried: dict[tuple[Any, ...], Tried] = {}
        self._refer = refer
        self._runs: dict[tuple[int, bytes], tuple[Trial, dict[str, float]]] = {}

    def reference(self, camera: int) -> Reference:
        """The reference of a camera, made when first asked for."""
        if camera not in self.references:
            turned = applied(self.network, self.orbit.settings(camera))
            label = f"camera {camera}:"

            def show(text: str, fraction: float | None) -> None:
                self.tell(f"{label} {text}", fraction)

            self.references[camera] = found = self._refer(
                turned, self.view, self.size, bound=self.bound, show=show, cancelled=self.stop
            )
            if camera == 0:
                self._choose_figure(found.value)
        return self.references[camera]

    def of(self, settings: Settings, cameras: Sequence[int], repeats: int) -> Tried:
        """Try a setting on some cameras, each timed so many times, beside one run that is not counted."""
        seconds, worst = 0.0, dict[str, float]()
        key = []
        for camera in cameras:
            if self.stop is not None and self.stop():
                raise Cancelled
            mark, trial, found = self._run(settings, camera)
            key.append(mark)
            while len(trial.seconds) < repeats and not trial.failure:
                trial.time()
            if trial.failure:
                tried = Tried(dict(settings), math.inf, {}, tuple(cameras), trial.failure)
                self.tried[camera, *key] = tried
                return tried
            seconds = max(seconds, statistics.median(trial.seconds))
            for figure, number in found.items():
                # A nan compares as no error; nothing was compared, so nothing may be promised.
                known = math.inf if math.isnan(number) and figure == self.figure else number
                falling = min if figure == "psnr" else max
                worst[figure] = falling(worst[figure], known) if figure in worst else known
        tried = Tried(dict(settings), seconds, worst, tuple(cameras))
        self.tried[tuple(key)] = tried
        return tried

    def knows(self, settings: Settings, cameras: Sequence[int]) -> bool:
        """Whether this setting was run on all these cameras already."""
        return all(self._mark(self._network(settings, camera), camera)[0] in self._runs for camera in cameras)

    def tell(self, text: str, fraction: float | None = None) -> None:
        if self.show is not None:
            self.show(text, fraction)

    def _run(self, settings: Settings, camera: int) -> tuple[tuple[int, bytes], Trial, dict[str, float]]:
        network = self._network(settings, camera)
        mark, planned = self._mark(network, camera)
        if mark in self._runs:
            return mark, *self._runs[mark]
        expected = self.reference(camera)
        timed = self._timed(network, planned)
        trial = Trial(network, self.view, self.size, settings, "", self.engine, timed, stop=self.stop)
        value = trial.first()
        found: dict[str, float] = {}
        if not trial.failure:
            try:
                found = errors(value, expected.value, expected.mask)
            except GraphError as refused:
                trial.failure = str(refused)
        self._runs[mark] = (trial, found)
        return mark, trial, found

    def _network(self, settings: Settings, camera: int) -> Network:
        return applied(self.network, {**settings, **self.orbit.settings(camera)})

    def _mark(self, network: Network, camera: int) -> tuple[tuple[int, bytes], Plan]:
        """What a result is known by, and the plan of it."""
        planned = plan(network.flatten(), [self.view], size=self.size, device=lambda: self.engine.device_name)
        results = (planned.tasks[place].fingerprint for feeds in planned.sinks.values() for place, _ in feeds)
        return (camera, b"".join(results)), planned

    def _timed(self, network: Network, planned: Plan) -> list[str]:
        """What runs anew when somebody turns the view; where there is no camera, when somebody sets a knob.

        What stands above, a filter say, is made once and kept; its knobs count by the error that they make.
        """
        declared = parameters_above(network, self.view)
        turned = [place for place, parameter, _ in declared if parameter.kind == "Camera"]
        knobs = [place for place, parameter, _ in declared if parameter.quality is not None]
        own = {place.rpartition(".")[0] for place in turned or knobs}
        reached: list[str] = []
        for task in planned.tasks:
            above = {planned.tasks[i].path for sources in task.feeds.values() for i, _ in sources or ()}
            if task.path in own or above & set(reached):
                reached.append(task.path)
        return reached or [task.path for task in planned.tasks]

    def _choose_figure(self, value: Any) -> None:
        """The figure that is meant by "the error". Raises ParameterError for one that this value does not have."""
        measure = measure_of(value)
        known = [figure for figure in errors(value, value) if figure not in measure.rising]
        self.units = {**measure.units}
        unit = getattr(getattr(value, "mapping", None), "unit", "")
        if unit:
            self.units |= dict.fromkeys(("max", "rmse", "p999"), unit)
        if self.figure and self.figure not in known:
            raise ParameterError(f"{self.figure}: no such error of {self.view}{near_miss_or_all(self.figure, known)}")
        self.figure = self.figure or measure.first
