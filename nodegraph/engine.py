"""The engine: one thread that owns the devices, the cache, and the evaluation that runs now."""

from __future__ import annotations

import atexit
import itertools
import os
import threading
import weakref
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar

from nodegraph.cache import ResultCache
from nodegraph.errors import Cancelled, DeviceError, GraphError
from nodegraph.evaluation import Evaluation
from nodegraph.explain import LastRun
from nodegraph.plan import Plan, Planner
from nodegraph.report import Observer, Report
from nodegraph.scheduler import Context, Run
from nodegraph.workers import Inbox, Workers

if TYPE_CHECKING:
    from nodegraph.disk_cache import DiskCache
    from nodegraph.flat import Flat
    from nodegraph.marks import Marks
    from nodegraph.network import Network
    from nodegraph.shaders import Source

T = TypeVar("T")

# Engines that nobody closed are closed when the program ends: drivers do not like to find their thread gone.
_open: weakref.WeakSet[Engine] = weakref.WeakSet()

CACHE_BYTES = 2 << 30
_channels = itertools.count()


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
        self._in_use: dict[str, str] | None = None
        self._announcement = ""
        self._planners: weakref.WeakKeyDictionary[Any, Planner] = weakref.WeakKeyDictionary()
        self._last: weakref.WeakKeyDictionary[Any, LastRun] = weakref.WeakKeyDictionary()
        self._closed = False
        self._thread = threading.Thread(target=self._work, name="nodegraph-engine", daemon=True)
        self._context = Context(self.cache, self._workers, self._inbox, _Opener(self), self._disk())
        self._thread.start()
        _open.add(self)

    # -- asking for results -------------------------------------------------------------------------------------

    def evaluate(
        self,
        network: Network | Flat,
        sinks: Iterable[str] | str | None = None,
        *,
        size: tuple[int, int] | None = None,
        quality: str = "final",
        on_event: Observer | None = None,
        given: Mapping[str, Any] | None = None,
    ) -> Report:
        """Run what the sinks need and wait for the report; failures of nodes are in it.

        Without sinks: all views and effects. Ctrl-C cancels. Raises CommandError for an unknown sink, DeviceError
        when the chosen device is not there.
        """
        if threading.current_thread() is self._thread:
            raise GraphError("evaluate: called on the engine's own thread, where it would wait for itself; use submit")
        evaluation = self.submit(network, sinks, size=size, quality=quality, on_event=on_event, given=given)
        try:
            # Waiting in short pieces lets Ctrl-C through on every platform.
            while not evaluation._done.wait(0.2):
                self._require_thread()
        except KeyboardInterrupt:
            evaluation.cancel()
            evaluation._done.wait(2.0)
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
        given: Mapping[str, Any] | None = None,
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
        document = _document(owner, flat)

        def attempt(evaluation: Evaluation, notice: str = "") -> Report:
            plan = self._planner(owner).plan(flat, named, size=size, quality=quality, given=values)
            self._run = run = Run(plan, self._context, on_event, lambda: evaluation.cancelled, document)
            try:
                if notice:
                    run.teller.note(notice)
                if self._announcement:
                    run.teller.announce(self._announcement)
                    self._announcement = ""
                report = run.finish()
            finally:
                self._run = None
                run.end()
            self._remember(owner, plan, report)
            return report

        def start(evaluation: Evaluation) -> Report:
            report = attempt(evaluation)
            lost = self._drop_lost()
            if lost and report.errors:
                # What lay on the lost device is gone, so all of it runs once more, on one that is opened anew.
                report = attempt(evaluation, f"{lost} was lost while it ran; its results are made anew")
            return report

        evaluation = Evaluation(start, channel if channel is not None else next(_channels), self._inbox.wake)
        with self._lock:
            self._require_thread()
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
        given: Mapping[str, Any] | None = None,
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
            self._require_thread()
            self._inbox.post(act)
        while not done.wait(0.2):
            if not self._thread.is_alive() and not done.is_set():
                raise GraphError("engine: it was closed before it could answer")
        if outcome[1] is not None:
            raise outcome[1]
        result: T = outcome[0]
        return result

    def retry(self) -> None:
        """Forget which nodes failed, so that they are tried again although nothing they depend on has changed."""
        self.cache.forget_failures()

    def try_kernel(self, old: Source, new: Source) -> None:
        """Compile a changed kernel on every open device as its old text has run there. Raises ShaderError."""
        self.call(lambda: [device.try_text(old, new) for device in getattr(self._devices, "opened", ())])

    def mark_in(self, marks: Marks | None) -> None:
        """Mark from now on which nodes run, for whoever wants to know after a crash."""
        self._context.marks = marks

    @property
    def disk(self) -> DiskCache | None:
        """Results that outlive the process; None where `disk` was refused."""
        return self._context.disk

    # -- what it owns -------------------------------------------------------------------------------------------

    @property
    def devices(self) -> Any:
        """The devices of this engine, `nodegraph.compute.Devices`; made on first use, on the engine's thread."""
        if self._devices is None:
            self.call(self._make_devices)
        return self._devices

    @property
    def device_in_use(self) -> dict[str, str] | None:
        """Name, description and reason of the device that was chosen; None while no task has needed one."""
        return dict(self._in_use) if self._in_use is not None else None

    @property
    def closed(self) -> bool:
        """True once `close` was called."""
        return self._closed

    def last(self, network: Network | Flat) -> LastRun:
        """What is known of the last evaluations of a network: tasks, seconds, memos, by path."""
        owner = _root(network)
        return (self._last.get(owner) if owner is not None else None) or LastRun()

    def close(self, patience: float | None = None) -> None:
        """Cancel what runs, free every device object, end the threads. Calling it twice is fine.

        A library call in the middle of a node cannot be stopped: ``patience`` says how many seconds to wait for it,
        None as long as it takes. The device is freed when it returns.
        """
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
        self._inbox.wake()
        if threading.current_thread() is not self._thread:
            self._thread.join(patience)
        self._workers.close()

    def __enter__(self) -> Engine:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        # Who presses Ctrl-C does not want to wait.
        self.close(0.5 if kind is not None and issubclass(kind, KeyboardInterrupt) else None)

    # -- the engine's thread ------------------------------------------------------------------------------------

    def _work(self) -> None:
        while not self._closed:
            self._inbox.serve()
            while self._next():
                pass
        # Who called before the end gets an answer.
        self._inbox.serve_waiting()
        self.cache.clear()
        self.cache.shared = None
        if self._devices is not None and self._owns_devices:
            self._devices.close()

    def _require_thread(self) -> None:
        if self._closed:
            raise GraphError("engine: it is closed; make a new one")
        if not self._thread.is_alive():
            raise GraphError("engine: it belongs to the process that this one was forked from; make one here")

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

    def _planner(self, owner: Any) -> Planner:
        planner = self._planners.get(owner) if owner is not None else None
        if planner is None:
            planner = Planner(lambda: str(self._main_device().name))
            if owner is not None:
                self._planners[owner] = planner
        return planner

    def _remember(self, owner: Any, plan: Plan, report: Report) -> None:
        if owner is not None:
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
            from nodegraph.compute import Budget, Devices

            # Where the device's memory is the host's, cache and device draw on one budget.
            room = self._device_bytes if self._device_bytes is not None else machine_bytes() // 2
            budget = Budget(self.cache.limit + room)
            budget.watch(self.cache.host_bytes, lambda: self.cache.nbytes)
            self.cache.shared = budget
            self._devices = Devices(
                host_budget=budget, device_bytes=self._device_bytes, call=self.call, on_pressure=self._on_pressure
            )

    def _on_pressure(self, wanted: int) -> None:
        self.cache.release_cheap(wanted)

    def _drop_lost(self) -> str:
        """Close devices whose context was lost while they ran, and forget all results: some lay there alone.

        Returns the names of those devices.
        """
        lost = [device for device in getattr(self._devices, "opened", ()) if getattr(device, "lost", False)]
        for device in lost:
            self._devices.drop(device)
            if device is self._main:
                self._main = None
        if lost:
            self.cache.clear()
            self.cache.forget_failures()
        return ", ".join(device.name for device in lost)

    def _main_device(self) -> Any:
        """The device that was chosen, opened now if need be. Says once which it is, and why."""
        if self._main is None:
            self._make_devices()
            self._main, reason = self._devices.choose(self.device_name)
            self._in_use = {"name": self._main.name, "description": self._main.description, "reason": reason}
            self._announcement = f"device {reason}"
        return self._main


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
        return device

    def after(self, device: Any) -> Any:
        choice = self.engine._devices.next_after(device)
        return None if choice is None else choice[0]


def _root(network: Network | Flat) -> Any:
    """The document that plans and last results are remembered for; None for a snapshot that stands alone.

    The inside of a group belongs to its document.
    """
    return getattr(network, "root", None)


def _document(owner: Network | None, flat: Flat) -> Callable[[str], str]:
    """The service ``workspace``: the text of the workspace as it is now, for a file at a path.

    There is none of a snapshot that stands alone, nor where no processor asks for it.
    """
    processors = (node.processor for node in flat.nodes.values())
    if owner is None or not any(p is not None and "workspace" in p.services for p in processors):
        return lambda path: ""
    from nodegraph import workspace

    text = workspace.dumps(owner)
    return lambda path: workspace.moved(text, os.path.dirname(os.path.abspath(path)))


def _close_all() -> None:
    for engine in list(_open):
        engine.close()


atexit.register(_close_all)


def machine_bytes() -> int:
    """Memory of this machine; 8 GiB where it does not say."""
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, OSError, ValueError):
        return 8 << 30
