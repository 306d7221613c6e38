"""Run one task: collect the arguments of ``process``, call it, follow a generator, take the result apart."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from nodegraph.cache import Result
from nodegraph.errors import PortError, ProcessError
from nodegraph.report import Event
from nodegraph.services import DeviceService, Memo, Progress, open_raster, own

if TYPE_CHECKING:
    from nodegraph.compute.dispatch import KernelRun
    from nodegraph.plan import Task
    from nodegraph.processor import Processor
    from nodegraph.scheduler import Run

Fetch = Callable[[int, str, str], Any]


def collect_arguments(task: Task, value: Fetch) -> dict[str, Any]:
    """Inputs and parameters by name, each checked as its declaration says.

    ``value(task, output, where)`` returns what a task made. An input whose branch ``needs`` has cut is None.
    Raises PortError or ParameterError naming the place.
    """
    processor = _processor(task)
    arguments: dict[str, Any] = {}
    for name, port in processor.inputs.items():
        feeds = task.feeds.get(name, ())
        where = f"{task.path}.{name}"
        if feeds is None:
            arguments[name] = () if port.many else None
            continue
        values = [value(source, output, where) for source, output in feeds]
        arguments[name] = port.check(tuple(values) if port.many else (values or [None])[0], where)
    params = dict(task.node.values)
    for name in task.node.wired:
        wired = task.feeds.get(name)
        if wired:
            where = f"{task.path}.{name}"
            params[name] = processor.params[name].check(value(*wired[0], where), where)
    return {**arguments, **processor.effective(params)}


def execute(run: Run, place: int, arguments: dict[str, Any], device: Any) -> Result:
    """Call ``process`` on this thread: the engine's when there is a device, else a worker's."""
    task = run.plan.tasks[place]
    processor = _processor(task)
    run.check()
    memos: list[str] = []
    notes: list[str] = []
    decisions: list[str] = []
    services = _services(run, place, device, memos, notes, decisions)
    started = time.perf_counter()
    with _working_for(device, task.path), _marked(run, task.path, processor.id):
        returned = processor().process(**arguments, **services)
        if processor.generator:
            values = _refine(run, task, returned, device is not None)
        else:
            values = _pack(task, returned)
    seconds = time.perf_counter() - started
    runs: tuple[KernelRun, ...] = ()
    if "device" in services:
        run.report.device_seconds[task.path] = services["device"].seconds
        runs = services["device"].runs
    run.check()
    own(values, task.fingerprint)
    return Result(values, seconds, tuple(notes), tuple(memos), runs, tuple(dict.fromkeys(decisions)))


@contextlib.contextmanager
def _working_for(device: Any, path: str) -> Iterator[None]:
    """Count what is made on a device meanwhile under a node."""
    if device is None:
        yield
        return
    device.working_for = path
    try:
        yield
    finally:
        device.working_for = ""


def _marked(run: Run, path: str, id: str) -> contextlib.AbstractContextManager[None]:
    """Leave behind, should the process end here, which node it was."""
    marks = run.context.marks
    return marks.running(path, id) if marks is not None else contextlib.nullcontext()


def _refine(run: Run, task: Task, steps: Any, here: bool) -> dict[str, Any]:
    """Follow a generator: each yield is a point to cancel at, and may be a preview; the last one is the result."""
    last: dict[str, Any] | None = None
    try:
        while True:
            try:
                item = next(steps)
            except StopIteration as stop:
                if stop.value is not None:
                    last = _pack(task, stop.value)
                break
            run.check()
            if item is not None:
                last = _pack(task, item)
                run.tell(Event("preview", task.path, size=task.size, values=last), here)
            if here:
                # Nothing is being drawn now, so other threads may read what lies on the device.
                run.context.inbox.serve_waiting()
                run.check()
    finally:
        steps.close()
    return _pack(task, None) if last is None else last


def _pack(task: Task, returned: Any) -> dict[str, Any]:
    """`Processor.pack`; what it refuses is the processor's fault and no input of the user's."""
    try:
        return _processor(task).pack(returned, task.wanted, task.path)
    except PortError as error:
        error.exit_code = ProcessError.exit_code
        raise


def _services(
    run: Run, place: int, device: Any, memos: list[str], notes: list[str], decisions: list[str]
) -> dict[str, Any]:
    """What ``process`` names after its ``*``."""
    task = run.plan.tasks[place]
    processor = _processor(task)
    here = device is not None

    def report(fraction: float, text: str) -> None:
        run.tell(Event("progress", task.path, text, fraction), here)

    def remembered(label: str, seconds: float, found: bool, nbytes: int) -> None:
        memos.append(label)
        run.context.inbox.post(lambda: run.memo_done(label, seconds, found, nbytes))

    progress = Progress(run.check, report)
    make: dict[str, Callable[[], Any]] = {
        "size": lambda: task.size,
        "quality": lambda: task.quality,
        "wanted": lambda: task.wanted,
        "progress": lambda: progress,
        "device": lambda: DeviceService(device, processor, task.path, run.check, progress),
        "gl": lambda: open_raster(device, task.path),
        "workspace": lambda: run.document,
        "explain": lambda: decisions.append,
        "memo": lambda: Memo(
            task.path,
            run.context.cache,
            run.context.disk,
            run.check,
            remembered,
            notes.append,
            lambda made: run.lasting.of_input(place, made),
        ),
    }
    return {name: make[name]() for name in processor.services}


def _processor(task: Task) -> type[Processor]:
    """The class; a task without one has a problem and is never run."""
    assert task.processor is not None
    return task.processor
