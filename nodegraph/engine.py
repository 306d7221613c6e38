"""The engine: one thread that owns the devices, the cache, and the evaluation that runs now."""

from __future__ import annotations

import itertools
import os
import threading
import weakref
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from nodegraph.cache import ResultCache
from nodegraph.data import Value
from nodegraph.errors import Cancelled, DeviceError, GraphError
from nodegraph.fingerprint import unique_key
from nodegraph.plan import Plan, Planner, Task
from nodegraph.report import Report
from nodegraph.scheduler import Context, Observer, Run
from nodegraph.workers import Inbox, Workers

if TYPE_CHECKING:
    from nodegraph.disk_cache import DiskCache
    from nodegraph.flat import Flat
    from nodegraph.network import Network

T = TypeVar("T")

CACHE_BYTES = 2 << 30
_channels = itertools.count()


class Evaluation:
    """A request to the engine, from any thread: wait for its report, or cancel it."""

    def __init__(self, start: Callable[[Evaluation], Report], channel: object, wake: Callable[[], None]) -> None:
        self._start = start
        self._wake = wake
        self.channel = channel
        self._cancelled = threading.Event()
        self._done = threading.Event()
        self._report: Report | None = None
        self._error: BaseException | None = None

    def cancel(self) -> None:
        """Stop at the next strip, yield or progress report; library calls are abandoned. Returns at once."""
        self._cancelled.set()
        self._wake()

    @property
    def cancelled(self) -> bool:
        """True once `cancel` was called, or a newer evaluation of the same channel came."""
        return self._cancelled.is_set()

    def done(self) -> bool:
        """True when `result` returns at once."""
        return self._done.is_set()

    def result(self, timeout: float | None = None) -> Report:
        """Wait for the report. Raises Cancelled, what planning raised, or TimeoutError."""
        if not self._done.wait(timeout):
            raise TimeoutError(f"the evaluation takes longer than {timeout} s")
        if self._error is not None:
            raise self._error
        assert self._report is not None
        return self._report

    def run(self) -> None:
        """Evaluate, on the engine's thread."""
        try:
            if self.cancelled:
                raise Cancelled
            self._report = self._start(self)
        except BaseException as error:
            self._error = error
        finally:
            self._start = _finished
            self._done.set()

    def refuse(self, error: GraphError) -> None:
        """End without having run."""
        self._error = error
        self._start = _finished
        self._done.set()


def _finished(_: Evaluation) -> Report:
    raise Cancelled


class Engine:
    """Evaluates networks, one at a time, on a thread of its own.

    device:       "auto", "gl", "cl" or "cl64"; opened when a task first needs it.
    cache_bytes:  budget of the results that are kept in memory; 0 keeps nothing.
    device_bytes: budget of device memory; None leaves it to the device. Where the device's memory is the host's,
                  cache and device share one budget, the sum of both.
    disk:         whether processors may keep results on disk between runs; a DiskCache to say where.
    workers:      threads for processors that need no device.

    All methods may be called from any thread. Close it, or use it as a context manager.
    """

    def __init__(
        self,
        device: str = "auto",
        *,
        cache_bytes: int = CACHE_BYTES,
        device_bytes: int | None = None,
        disk: bool | DiskCache = True,
        workers: int | None = None,
        devices: Any = None,
    ) -> None:
        self.cache = ResultCache(cache_bytes)
        self.device_name = device
        self._device_bytes = device_bytes
        self._disk_wanted = disk
        self._devices = devices
        self._owns_devices = devices is None
        self._main: Any = None
        self._inbox = Inbox()
        self._workers = Workers(workers or max(2, min(8, os.cpu_count() or 2)))
        self._lock = threading.Lock()
        self._waiting: deque[Evaluation] = deque()
        self._current: Evaluation | None = None
        self._run: Run | None = None
        self._pending_notes: list[str] = []
        self._planners: weakref.WeakKeyDictionary[Any, Planner] = weakref.WeakKeyDictionary()
        self._last: weakref.WeakKeyDictionary[Any, LastRun] = weakref.WeakKeyDictionary()
        self._closed = False
        self._thread = threading.Thread(target=self._work, name="nodegraph-engine", daemon=True)
        self._context = Context(self.cache, self._workers, self._inbox, _Opener(self), self._disk())
        self._thread.start()

    # -- asking for results -------------------------------------------------------------------------------------

    def evaluate(
        self,
        network: Network | Flat,
        sinks: Iterable[str] | str | None = None,
        *,
        size: tuple[int, int] | None = None,
        quality: str = "final",
        on_event: Observer | None = None,
        given: Mapping[str, Value] | None = None,
    ) -> Report:
        """Run what the sinks need and wait for the report; failures of nodes are in it.

        Without sinks: all views and effects. Ctrl-C cancels. Raises CommandError for an unknown sink, DeviceError
        when the chosen device is not there.
        """
        evaluation = self.submit(network, sinks, size=size, quality=quality, on_event=on_event, given=given)
        if threading.current_thread() is self._thread:
            evaluation.refuse(GraphError("evaluate: called on the engine's own thread, where it would wait for itself"))
        try:
            # Waiting in short pieces lets Ctrl-C through on every platform.
            while not evaluation._done.wait(0.2):
                pass
        except KeyboardInterrupt:
            evaluation.cancel()
            evaluation._done.wait(5.0)
            raise
        return evaluation.result()

    def submit(
        self,
        network: Network | Flat,
        sinks: Iterable[str] | str | None = None,
        *,
        size: tuple[int, int] | None = None,
        quality: str = "final",
        on_event: Observer | None = None,
        given: Mapping[str, Value] | None = None,
        channel: object = None,
    ) -> Evaluation:
        """Ask for an evaluation and return at once. One that is newer on the same channel supersedes this one.

        The network is looked at now: later edits do not change this evaluation. ``on_event`` is called on the
        engine's thread. Values in ``given`` stand for the plain nodes with those paths.
        """
        flat: Flat = network.flatten() if hasattr(network, "flatten") else network
        owner = _root(network)
        named = (sinks,) if isinstance(sinks, str) else None if sinks is None else tuple(sinks)
        values = dict(given or {})
        for value in values.values():
            if value.provenance is None:
                value.provenance = unique_key()

        def start(evaluation: Evaluation) -> Report:
            plan = self._planner(owner).plan(flat, named, size=size, quality=quality, given=values)
            self._run = run = Run(plan, self._context, on_event, lambda: evaluation.cancelled)
            try:
                for note in self._pending_notes:
                    run.note(note)
                self._pending_notes.clear()
                report = run.finish()
            finally:
                self._run = None
                run.end()
            self._remember(owner, plan, report)
            return report

        evaluation = Evaluation(start, channel if channel is not None else next(_channels), self._inbox.wake)
        with self._lock:
            if self._closed:
                raise GraphError("engine: it is closed; make a new one")
            superseded = [other for other in self._waiting if other.channel == evaluation.channel]
            for other in superseded:
                self._waiting.remove(other)
            if self._current is not None and self._current.channel == evaluation.channel:
                self._current.cancel()
            self._waiting.append(evaluation)
        for other in superseded:
            other._cancelled.set()
            other.refuse(Cancelled("superseded by a newer evaluation"))
        self._inbox.wake()
        return evaluation

    def plan(
        self,
        network: Network | Flat,
        sinks: Iterable[str] | str | None = None,
        *,
        size: tuple[int, int] | None = None,
        quality: str = "final",
        given: Mapping[str, Value] | None = None,
    ) -> Plan:
        """Plan without running anything."""
        flat: Flat = network.flatten() if hasattr(network, "flatten") else network
        owner = _root(network)
        named = (sinks,) if isinstance(sinks, str) else sinks
        return self.call(lambda: self._planner(owner).plan(flat, named, size=size, quality=quality, given=given))

    def call(self, function: Callable[[], T]) -> T:
        """Run a function on the engine's thread, between evaluations or while one waits, and return what it returns."""
        if threading.current_thread() is self._thread:
            return function()
        done = threading.Event()
        outcome: list[Any] = [None, None]

        def act() -> None:
            try:
                outcome[0] = function()
            except BaseException as error:
                outcome[1] = error
            finally:
                done.set()

        with self._lock:
            if self._closed:
                raise GraphError("engine: it is closed; make a new one")
            self._inbox.post(act)
        while not done.wait(0.2):
            if not self._thread.is_alive():
                raise GraphError("engine: it was closed before it could answer")
        if outcome[1] is not None:
            raise outcome[1]
        result: T = outcome[0]
        return result

    def retry(self) -> None:
        """Forget which nodes failed, so that they are tried again although nothing they depend on has changed."""
        self.cache.forget_failures()

    # -- what it owns -------------------------------------------------------------------------------------------

    @property
    def devices(self) -> Any:
        """The devices of this engine, `nodegraph.compute.Devices`; made on first use, on the engine's thread."""
        if self._devices is None:
            self.call(self._make_devices)
        return self._devices

    def last(self, network: Network | Flat) -> LastRun:
        """What is known of the last evaluations of a network: tasks, seconds, memos, by path."""
        return self._last.get(_root(network)) or LastRun()

    def close(self) -> None:
        """Cancel what runs, free every device object, end the threads. Calling it twice is fine."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
            waiting = list(self._waiting)
            self._waiting.clear()
            if self._current is not None:
                self._current.cancel()
        for evaluation in waiting:
            evaluation.refuse(Cancelled("the engine was closed"))
        self._inbox.post(self._shut)
        if threading.current_thread() is not self._thread:
            self._thread.join()
        self._workers.close()

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- the engine's thread ------------------------------------------------------------------------------------

    def _work(self) -> None:
        self._alive = True
        while self._alive:
            self._inbox.serve()
            while self._alive and self._next():
                pass

    def _next(self) -> bool:
        with self._lock:
            if not self._waiting:
                return False
            self._current = evaluation = self._waiting.popleft()
        try:
            evaluation.run()
        finally:
            with self._lock:
                self._current = None
        return True

    def _shut(self) -> None:
        if self._run is not None:
            # An evaluation is on its way out; come back when it is gone.
            self._inbox.post(self._shut)
            return
        self._alive = False
        self.cache.clear()
        self.cache.shared = None
        if self._devices is not None and self._owns_devices:
            self._devices.close()

    def _planner(self, owner: Any) -> Planner:
        planner = self._planners.get(owner)
        if planner is None:
            planner = self._planners[owner] = Planner(lambda: str(self._main_device().name))
        return planner

    def _remember(self, owner: Any, plan: Plan, report: Report) -> None:
        last = self._last.get(owner)
        if last is None:
            last = self._last[owner] = LastRun()
        last.add(plan, report)

    def _disk(self) -> DiskCache | None:
        if self._disk_wanted is False:
            return None
        if self._disk_wanted is True:
            from nodegraph.disk_cache import DiskCache

            return DiskCache()
        return self._disk_wanted

    # -- devices, on the engine's thread ------------------------------------------------------------------------

    def _make_devices(self) -> None:
        if self._devices is None:
            from nodegraph.compute import Devices

            self._devices = Devices(device_bytes=self._device_bytes, call=self.call)

    def _main_device(self) -> Any:
        """The device that was chosen, opened now if need be. Says once which it is, and why."""
        if self._main is None:
            self._make_devices()
            self._main, reason = self._devices.choose(self.device_name)
            self._adopt(self._main)
            self._say(f"device {self._main.name}: {self._main.description} ({reason})")
        return self._main

    def _adopt(self, device: Any) -> None:
        """Let a device ask the cache for room, and share its budget where its memory is the host's."""
        device.call = self.call
        device.memory.on_pressure = self.cache.release_cheap

    def _say(self, text: str) -> None:
        if self._run is not None:
            self._run.note(text)
        else:
            self._pending_notes.append(text)


class LastRun:
    """What the last evaluations of one network left behind, by path; what `explain` and `why` compare with."""

    def __init__(self) -> None:
        self.tasks: dict[str, tuple[Task, list[Task]]] = {}
        self.seconds: dict[str, float] = {}
        self.bytes: dict[str, int] = {}
        self.memos: dict[str, list[str]] = {}

    def add(self, plan: Plan, report: Report) -> None:
        """Take in one evaluation."""
        tasks = plan.tasks
        for task in tasks:
            self.tasks[task.path] = (task, tasks)
        self.seconds.update(report.timings)
        self.bytes.update(report.bytes)
        self.memos.update(report.memos)


class _Opener:
    """What a run sees of the engine's devices."""

    def __init__(self, engine: Engine) -> None:
        self._engine = weakref.ref(engine)

    @property
    def engine(self) -> Engine:
        engine = self._engine()
        assert engine is not None
        return engine

    def main(self) -> Any:
        return self.engine._main_device()

    def opengl(self) -> Any:
        engine = self.engine
        engine._make_devices()
        if engine._main is not None and hasattr(engine._main, "raster"):
            return engine._main
        try:
            device, _ = engine._devices.choose("gl")
        except DeviceError as error:
            raise DeviceError(f"needs OpenGL: {error}") from None
        engine._adopt(device)
        return device

    def after(self, device: Any) -> Any:
        found = self.engine._devices.next_after(device)
        other = found[0] if isinstance(found, tuple) else found
        if other is not None:
            self.engine._adopt(other)
        return other


def _root(network: Network | Flat) -> Any:
    """The document that plans and last results are remembered for; a group's inside belongs to its document."""
    return getattr(network, "root", network)
