"""Run a plan: data comes down.

A run starts at the sinks and goes backwards as far as results are missing; what is kept is not made again,
and nobody asks for what stands above it. Then everything runs as soon as its inputs are there: processors that
name a device on this thread, the engine's; the others on workers beside it. See docs/decisions/0004.
"""

from __future__ import annotations

import heapq
import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

from nodegraph.cache import Result, ResultCache, each_buffer
from nodegraph.errors import Cancelled, DeviceError, DeviceMissing, GraphError, PortError, ProcessError
from nodegraph.execution import collect_arguments, execute
from nodegraph.lasting import LastingKeys
from nodegraph.plan import Plan, Task
from nodegraph.report import CLEAN, Event, Observer, Report, State, Teller
from nodegraph.services import own
from nodegraph.workers import Inbox, Job, Workers

if TYPE_CHECKING:
    from nodegraph.disk_cache import DiskCache
    from nodegraph.marks import Marks


class DeviceSource(Protocol):
    """Opens devices when a task first needs one."""

    def main(self) -> Any:
        """The device that the user chose."""

    def opengl(self) -> Any:
        """A device that can rasterise. Raises DeviceError where there is none."""

    def after(self, device: Any) -> Any:
        """The device on which a node that failed on ``device`` is tried again, or None."""


@dataclass(slots=True)
class Context:
    """What a run works with. It belongs to the engine and outlives the run."""

    cache: ResultCache
    workers: Workers
    inbox: Inbox
    devices: DeviceSource
    disk: DiskCache | None = None
    marks: Marks | None = None


def run(
    plan: Plan,
    context: Context,
    on_event: Observer | None = None,
    cancelled: Callable[[], bool] = lambda: False,
) -> Report:
    """Run a plan on the thread that owns the devices. Raises Cancelled; failures of nodes are in the report."""
    current = Run(plan, context, on_event, cancelled)
    try:
        return current.finish()
    finally:
        current.end()


class Run:
    """One evaluation. All methods run on the engine's thread unless they say otherwise."""

    def __init__(
        self,
        plan: Plan,
        context: Context,
        on_event: Observer | None,
        cancelled: Callable[[], bool],
        document: Callable[[str], str] = lambda path: "",
    ) -> None:
        self.plan = plan
        self.document = document  # the service ``workspace`` of effects
        self.report = Report()
        self.teller = Teller(self.report, on_event)
        self._emit = self.teller.emit
        self.context = context
        self._cancelled = cancelled
        self._results: dict[int, Result] = {}
        self._blocked: dict[int, str] = {}
        self._readers: dict[int, int] = {}
        self._missing: dict[int, set[int]] = {}
        self._below: dict[int, list[int]] = {}
        self._device_queue: list[int] = []
        self._pool_queue: list[int] = []
        self._jobs: dict[int, Job] = {}
        self._pins: dict[int, bytes] = {}
        # Tasks that would do exactly what another one does: they take its result.
        self._twins: dict[int, list[int]] = {}
        self._followers: set[int] = set()
        self.lasting = LastingKeys(plan)
        self._over = False

    # -- the whole ----------------------------------------------------------------------------------------------

    def finish(self) -> Report:
        """Do all there is to do and return the report."""
        shown = {place for feeds in self.plan.sinks.values() for place, _ in feeds}
        shown |= {
            place
            for feeds in self.plan.sinks.values()
            for sink, output in feeds
            if not output
            for sources in self.plan.tasks[sink].feeds.values()
            for place, _ in sources or ()
        }
        todo = self._look_back(shown)
        self._prepare(todo, shown)
        while True:
            self.check()
            self._start_jobs()
            if self._device_queue:
                self._run_here(heapq.heappop(self._device_queue))
                self.context.inbox.serve_waiting()
            elif self._jobs:
                self.context.inbox.serve()
            elif not self._pool_queue:
                break
        self._show()
        self._tell_states()
        return self.report

    def end(self) -> None:
        """Leave nothing behind: jobs that still run are abandoned, late events are dropped."""
        self._over = True
        for job in self._jobs.values():
            self.context.workers.abandon(job)
        self._jobs.clear()
        self._results.clear()
        for place in list(self._pins):
            self._forget(place)

    def check(self) -> None:
        """Raise Cancelled where the evaluation shall stop. Any thread."""
        if self._over or self._cancelled():
            raise Cancelled

    # -- what has to run ----------------------------------------------------------------------------------------

    def _look_back(self, shown: set[int]) -> list[int]:
        """Walk from the sinks upwards; fill in what is kept and return, in order, what has to run."""
        tasks, cache = self.plan.tasks, self.context.cache
        needed = bytearray(len(tasks))
        for place in shown:
            needed[place] = 1
        todo: list[int] = []
        for place in range(len(tasks) - 1, -1, -1):
            if not needed[place]:
                continue
            task = tasks[place]
            kept = self._kept(task, place)
            if kept is not None:
                self._results[place] = kept
                self.report.cached.append(task.path)
                self.report.add_making(task.path, kept)
                for note in kept.notes:
                    self.teller.note(note, task.path)
                continue
            todo.append(place)
            if task.problem is None and cache.failure(task.fingerprint) is None:
                for sources in task.feeds.values():
                    for above, _ in sources or ():
                        needed[above] = 1
        self.report.cached.reverse()
        todo.reverse()
        return todo

    def _kept(self, task: Task, place: int) -> Result | None:
        if task.path in self.plan.given:
            value = self.plan.given[task.path]
            return Result({"value": value})
        processor = task.processor
        if task.problem is not None or processor is None or processor.effect:
            return None
        found = self.context.cache.get(task.fingerprint)
        if found is not None and all(name in found.values for name in task.wanted):
            return found
        if not processor.disk_cache or self.context.disk is None:
            return None
        found = self.context.disk.get(self.lasting.key(place))
        if found is None or not all(name in found.values for name in task.wanted):
            return None
        own(found.values, task.fingerprint)
        self.context.cache.put(task.fingerprint, found)
        return found

    def _prepare(self, todo: list[int], shown: set[int]) -> None:
        """Count, for every task that runs, what it waits for and who reads it; settle what cannot run."""
        for place in shown:
            self._readers[place] = 1
        if todo:
            # Letting go of what this run holds anyway would free nothing and lose it for the next one.
            self._pins = {place: self.plan.tasks[place].fingerprint for place in (*self._results, *todo)}
            for key in self._pins.values():
                self.context.cache.pin(key)
        running = set(todo)
        first: dict[bytes, int] = {}
        for place in todo:
            task = self.plan.tasks[place]
            if task.problem is None and task.processor is not None and not task.processor.effect:
                same = first.setdefault(task.fingerprint, place)
                if same != place:
                    self._twins.setdefault(same, []).append(place)
                    self._followers.add(place)
                    continue
            above = {source for sources in task.feeds.values() for source, _ in sources or ()}
            for source in above:
                self._readers[source] = self._readers.get(source, 0) + 1
                self._below.setdefault(source, []).append(place)
            self._missing[place] = above & running
        for place in todo:
            self._settle_or_queue(place)

    def _settle_or_queue(self, place: int) -> None:
        if place in self._blocked or place in self._results or place not in self._missing:
            return
        task = self.plan.tasks[place]
        error = task.problem or self._remembered(task)
        if error is not None:
            self._fail(place, error)
        elif task.processor is not None and task.processor.effect and task.path not in self.plan.named:
            reason = "it changes the world, so it runs only when it is named"
            self._block(place, f"{task.path}: {reason}", "blocked")
        elif not self._missing[place]:
            heapq.heappush(self._device_queue if task.on_device else self._pool_queue, place)

    def _remembered(self, task: Task) -> GraphError | None:
        failure = self.context.cache.failure(task.fingerprint)
        return failure if isinstance(failure, GraphError) else None

    # -- running one task ---------------------------------------------------------------------------------------

    def _start_jobs(self) -> None:
        while self._pool_queue:
            place = heapq.heappop(self._pool_queue)
            arguments = self._arguments(place)
            if arguments is not None:
                self._jobs[place] = self.context.workers.submit(self._job(place, arguments))

    def _job(self, place: int, arguments: dict[str, Any]) -> Callable[[], None]:
        def act() -> None:
            """On a worker's thread: run, and post the end."""
            try:
                result = execute(self, place, arguments, None)
            except BaseException as error:
                caught = error
                self.context.inbox.post(lambda: self._job_failed(place, caught))
            else:
                self.context.inbox.post(lambda: self._job_done(place, result))
            finally:
                # A traceback keeps this frame alive, and the frame would keep the volumes.
                arguments.clear()

        return act

    def _job_done(self, place: int, result: Result) -> None:
        if self._jobs.pop(place, None) is not None:
            self._done(place, result)

    def _job_failed(self, place: int, error: BaseException) -> None:
        if self._jobs.pop(place, None) is not None:
            self._raised(place, error)

    def _run_here(self, place: int) -> None:
        arguments = self._arguments(place)
        if arguments is None:
            return
        task = self.plan.tasks[place]
        try:
            device = self._open(task)
            try:
                result = execute(self, place, arguments, device)
            except DeviceMissing:
                raise
            except DeviceError as error:
                other = self.context.devices.after(device) if self._may_move(task) else None
                if other is None:
                    raise
                self.check()
                note = f"{task.path}: {device.name} failed ({error}); running on {other.name} instead"
                self.teller.note(note, task.path)
                result = execute(self, place, arguments, other)
                result = replace(result, notes=(note, *result.notes))
        except BaseException as error:
            self._raised(place, error)
        else:
            self._done(place, result)
        finally:
            arguments.clear()

    def _open(self, task: Task) -> Any:
        services = task.processor.services if task.processor is not None else ()
        return self.context.devices.opengl() if "gl" in services else self.context.devices.main()

    def _may_move(self, task: Task) -> bool:
        return task.processor is not None and "gl" not in task.processor.services

    def _arguments(self, place: int) -> dict[str, Any] | None:
        """Checked arguments of ``process``; None where they are refused, which fails the task."""
        task = self.plan.tasks[place]
        try:
            arguments = collect_arguments(task, self._value)
            if not task.on_device:
                # A worker must not wait for this thread, so what lies on a device comes to the host now.
                each_buffer(arguments, lambda buffer: None if buffer.on_host else buffer.array)
        except Exception as error:
            self._raised(place, error, "check")
            return None
        self._emit(Event("started", task.path, size=task.size))
        self.report.states[task.path] = State("running")
        return arguments

    def _value(self, source: int, output: str, where: str) -> Any:
        result = self._results[source]
        if output not in result.values:
            raise PortError(f"{where}: {self.plan.tasks[source].path} made nothing for its output {output!r}")
        return result.values[output]

    def memo_done(self, label: str, seconds: float, found: bool, nbytes: int) -> None:
        """Report a memo; on the engine's thread."""
        if self._over:
            return
        self.report.bytes[label] = nbytes
        if found:
            self.report.cached.append(label)
        else:
            self.report.ran.append(label)
            self.report.timings[label] = self.report.timings.get(label, 0.0) + seconds

    # -- ends ---------------------------------------------------------------------------------------------------

    def _done(self, place: int, result: Result) -> None:
        task = self.plan.tasks[place]
        processor = task.processor
        assert processor is not None
        report = self.report
        # What memos posted belongs before the end of their node.
        self.context.inbox.serve_waiting()
        report.ran.append(task.path)
        report.timings[task.path] = report.timings.get(task.path, 0.0) + result.seconds
        report.bytes[task.path] = result.nbytes
        report.add_making(task.path, result)
        if task.path not in report.errors:
            report.states[task.path] = CLEAN
        for note in result.notes:
            self.teller.note(note, task.path)
        self._results[place] = result
        if not processor.effect:
            self.context.cache.put(task.fingerprint, result, task.path)
            if processor.disk_cache and self.context.disk is not None:
                refused = self.context.disk.put(self.lasting.key(place), result)
                if refused:
                    self.teller.note(f"{task.path}: not kept on disk: {refused}", task.path)
        self._emit(Event("finished", task.path, seconds=result.seconds, size=task.size, values=result.values))
        twins = self._twins.get(place, ())
        for twin in twins:
            self._results[twin] = result
            if self.plan.tasks[twin].path != task.path:
                report.cached.append(self.plan.tasks[twin].path)
        self._release(place)
        for ready in (place, *twins):
            for below in self._below.get(ready, ()):
                waiting = self._missing.get(below)
                if waiting is not None and ready in waiting:
                    waiting.discard(ready)
                    if not waiting:
                        self._settle_or_queue(below)
            if self._readers.get(ready, 0) == 0:
                self._forget(ready)

    def _release(self, place: int) -> None:
        """Let go of what this task was the last to read, so that little more than what is still read is alive."""
        task = self.plan.tasks[place]
        for above in {source for sources in task.feeds.values() for source, _ in sources or ()}:
            self._readers[above] -= 1
            if self._readers[above] == 0:
                self._forget(above)

    def _forget(self, place: int) -> None:
        """Nobody in this run reads a task any more; the cache may keep it or not."""
        self._results.pop(place, None)
        key = self._pins.pop(place, None)
        if key is not None:
            self.context.cache.unpin(key)

    def _raised(self, place: int, error: BaseException, stage: str = "process") -> None:
        """A task ended in an error: remember it, block what stands below, go on with the rest."""
        task = self.plan.tasks[place]
        if isinstance(error, Cancelled):
            raise error
        if isinstance(error, (KeyboardInterrupt, GeneratorExit)) or self._cancelled():
            raise Cancelled from error
        file = task.processor.file if task.processor is not None else ""
        failure = error if isinstance(error, ProcessError) else ProcessError(task.path, stage, error, file)
        # The frames of the traceback hold the inputs; its lines are all that is wanted of it.
        traceback.clear_frames(error.__traceback__)
        if task.processor is not None and not task.processor.effect:
            self.context.cache.fail(task.fingerprint, failure)
        self._fail(place, failure)

    def _fail(self, place: int, error: GraphError) -> None:
        """A task cannot go on: it failed, or its own declaration or wiring forbids it to start."""
        for twin in self._twins.pop(place, ()):
            self._fail(twin, error)
        path = self.plan.tasks[place].path
        state = "failed" if isinstance(error, ProcessError) else "blocked"
        self.report.errors.setdefault(path, error)
        self._emit(Event(state, path, str(error), error=error))
        self._block(place, str(error), state)

    def _block(self, place: int, reason: str, state: str) -> None:
        """Block a task for a reason, and everything below it because of that."""
        first, below = place, [place]
        while below:
            place = below.pop()
            if place in self._blocked:
                continue
            path = self.plan.tasks[place].path
            text = reason if place == first else f"blocked by {reason}"
            self._blocked[place] = text
            self._missing.pop(place, None)
            if place == first:
                self.report.states[path] = State(state, text)
            else:
                self.report.states[path] = State("blocked", text)
                self._emit(Event("blocked", path, text))
            if place not in self._followers:
                self._release(place)
            self._forget(place)
            below += [*self._below.get(place, ()), *self._twins.get(place, ())]

    # -- telling ------------------------------------------------------------------------------------------------

    def tell(self, event: Event, here: bool) -> None:
        """Deliver an event from either thread."""
        if here:
            self._emit(event)
        else:
            self.context.inbox.post(lambda: None if self._over else self._emit(event))

    def _show(self) -> None:
        """Collect what the sinks show; a sink without outputs shows what arrived at its inputs."""
        tasks, report = self.plan.tasks, self.report
        for sink, feeds in self.plan.sinks.items():
            shown = report.shown.setdefault(sink, {})
            for place, output in feeds:
                pairs = [(place, output, output)] if output else []
                if not output and place not in self._blocked:
                    pairs = [(*feed, port) for port, many in tasks[place].feeds.items() for feed in many or ()]
                for source, name, label in pairs:
                    result = self._results.get(source)
                    if result is not None and name in result.values:
                        shown[label] = report.values[tasks[place].path, label] = result.values[name]

    def _tell_states(self) -> None:
        """Everything that neither ran nor failed is clean: it, or what reads it, is kept."""
        states = self.report.states
        for task in self.plan.tasks:
            if task.path not in states and task.path not in self.plan.given:
                states[task.path] = CLEAN
