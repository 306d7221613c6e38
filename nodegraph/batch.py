"""Run many workspaces: every value of a sweep, every file of a study, on any ``concurrent.futures.Executor``.

A task is plain data (JSON text of a workspace, assignments, files to write), so it travels to another process or
machine as it is. Each finished task leaves ``task.json`` beside its files, written last; a task whose record names the
same content is skipped, so an interrupted batch goes on where it stopped.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from nodegraph.errors import GraphError, PortError

RECORD = "task.json"


@dataclass(frozen=True)
class Task:
    """One run of one workspace.

    Attributes:
        name: unique in its batch; names the folder of the task.
        workspace: JSON text; the paths in it are absolute.
        assignments: ``(place, text)`` as in ``--set place=text``.
        outputs: ``(node, file)``: pictures of views, and files of effects.
        folder: where ``task.json`` goes.
        size: of the pictures, or None for each view's own.
        device: auto, gl, cl or cl64.
        inputs: files whose change makes the task a new one.
    """

    name: str
    workspace: str
    folder: str
    assignments: tuple[tuple[str, str], ...] = ()
    outputs: tuple[tuple[str, str], ...] = ()
    size: tuple[int, int] | None = None
    device: str = "auto"
    inputs: tuple[str, ...] = ()

    def digest(self) -> str:
        """What the outputs depend on, as far as it is known without running: equal digests, equal outputs."""
        content = asdict(self)
        del content["folder"]
        content["inputs"] = [[path, *_state_of(path)] for path in self.inputs]
        text = json.dumps(content, sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()

    def is_finished(self) -> bool:
        """Whether an earlier run wrote everything that this task would write."""
        try:
            record = json.loads(Path(self.folder, RECORD).read_text("utf-8"))
        except (OSError, ValueError):
            return False
        return (
            isinstance(record, dict)
            and record.get("digest") == self.digest()
            and all(os.path.exists(file) for _, file in self.outputs)
        )


@dataclass(frozen=True)
class Outcome:
    """How a task ended: ``state`` is done, skipped or failed; ``error`` says why in one sentence."""

    name: str
    state: str
    error: str = ""
    exit_code: int = 0
    seconds: float = 0.0
    files: tuple[str, ...] = ()
    details: str = ""
    notes: tuple[str, ...] = field(default=())


def _state_of(path: str) -> tuple[int, int]:
    try:
        status = os.stat(path)
    except OSError:
        return (-1, -1)
    return (status.st_size, status.st_mtime_ns)


def run_task(task: Task) -> Outcome:
    """Run one task in this process and write its files. Never raises for what a task can do wrong."""
    from nodegraph import formats

    start = time.perf_counter()
    try:
        notes = _write_outputs(task)
        record = {
            "digest": task.digest(),
            "name": task.name,
            "assignments": dict(task.assignments),
            "seconds": round(time.perf_counter() - start, 3),
            "files": [file for _, file in task.outputs],
        }
        with formats.replacing(Path(task.folder, RECORD)) as part:
            part.write_text(json.dumps(record, indent=1) + "\n", "utf-8")
    except GraphError as error:
        return Outcome(task.name, "failed", str(error), error.exit_code, time.perf_counter() - start)
    except OSError as error:
        return Outcome(task.name, "failed", str(error), 2, time.perf_counter() - start)
    except Exception as error:
        # Ours, not the user's: the other tasks go on, and the traceback is shown at the end.
        text = f"{type(error).__name__}: {error}"
        return Outcome(task.name, "failed", text, 1, time.perf_counter() - start, details=traceback.format_exc())
    files = tuple(file for _, file in task.outputs)
    return Outcome(task.name, "done", "", 0, time.perf_counter() - start, files, notes=tuple(notes))


def _write_outputs(task: Task) -> list[str]:
    """Evaluate a task and write its pictures; what effects write they write themselves. Returns the report's notes."""
    from nodegraph import formats, scripting, workspace
    from nodegraph.overrides import assign
    from nodegraph.pictures import images_of, is_effect, write_picture

    network = workspace.loads(task.workspace)
    for place, text in task.assignments:
        assign(network, place, text)
    flat = network.flatten()
    formats.make_folder(Path(task.folder))
    # The engine of this process: opening a device and reading a volume once serves all tasks of a worker.
    engine = scripting.engine(task.device)
    report = engine.evaluate(network, [sink for sink, _ in task.outputs], size=task.size)
    report.raise_first()
    for sink, file in task.outputs:
        if not is_effect(flat, sink):
            images = images_of(report, [sink])
            if len(images) != 1:
                raise PortError(f"{sink}: shows {len(images)} pictures where one was expected; name it as node.output")
            write_picture(next(iter(images.values())), Path(file), network)
    return report.notes


def run_tasks(
    tasks: Sequence[Task],
    open_executor: Callable[[], contextlib.AbstractContextManager[Executor]],
    *,
    at_once: int,
    on_done: Callable[[Outcome], None] = lambda outcome: None,
) -> list[Outcome]:
    """Run tasks on an executor, skip the finished ones, and return the outcomes in the order of the tasks.

    At most ``at_once`` tasks are handed over at a time. When a worker dies (a driver that crashes takes its process
    along) the tasks it may have been running are tried once more, each alone, so that only the deadly one is lost.
    """
    outcomes: dict[str, Outcome] = {}

    def finish(outcome: Outcome) -> None:
        outcomes[outcome.name] = outcome
        on_done(outcome)

    waiting: list[Task] = []
    for task in tasks:
        if task.is_finished():
            finish(Outcome(task.name, "skipped", files=tuple(file for _, file in task.outputs)))
        else:
            waiting.append(task)
    waiting.reverse()
    while waiting:
        suspects: list[Task] = []
        with open_executor() as executor:
            for task, outcome in _drain(waiting, executor, at_once):
                if outcome is None:
                    suspects.append(task)
                else:
                    finish(outcome)
        for task in suspects:
            with open_executor() as executor:
                ((_, outcome),) = _drain([task], executor, 1)
            finish(outcome or Outcome(task.name, "failed", "its worker process died", 1))
    return [outcomes[task.name] for task in tasks]


def _drain(waiting: list[Task], executor: Executor, at_once: int) -> Iterator[tuple[Task, Outcome | None]]:
    """Run the tasks at the end of ``waiting``; yield each with its outcome, or None when its worker died.

    Stops when the executor is broken, leaving in ``waiting`` what was never handed over.
    """
    running: dict[Future[Outcome], Task] = {}
    broken = False
    while running or (waiting and not broken):
        while waiting and len(running) < at_once and not broken:
            task = waiting.pop()
            try:
                running[executor.submit(run_task, task)] = task
            except BrokenExecutor:
                waiting.append(task)
                broken = True
        ready, _ = wait(running, return_when=FIRST_COMPLETED)
        for future in ready:
            task = running.pop(future)
            try:
                yield task, future.result()
            except (BrokenExecutor, CancelledError):
                broken = True
                yield task, None
            except Exception as error:
                # The executor itself failed the task: a cluster that lost its scheduler, for example.
                yield task, Outcome(task.name, "failed", f"{type(error).__name__}: {error}", 1)


@contextlib.contextmanager
def process_pool(workers: int) -> Iterator[Executor]:
    """Fresh processes on this machine; stopped at once, with what they run, when the block is left by an exception."""
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    threads = max(1, (os.cpu_count() or 1) // workers)
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(
        workers, mp_context=multiprocessing.get_context("spawn"), initializer=_prepare_worker, initargs=(threads,)
    )
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for child in set(multiprocessing.active_children()) - before:
            child.terminate()
        raise
    finally:
        pool.shutdown(wait=True)


def _prepare_worker(threads: int) -> None:
    """Give each worker its share of the cores, and let it end at once when it shall, or when nobody waits for it."""
    for name in ("LP_NUM_THREADS", "POCL_MAX_PTHREAD_COUNT", "OMP_NUM_THREADS"):
        os.environ.setdefault(name, str(threads))
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda number, _: _end(128 + number))
    threading.Thread(target=_end_with_parent, name="nodegraph-parent", daemon=True).start()


def _end_with_parent() -> None:
    """A parent that is killed cannot stop its workers, so they look after themselves."""
    import multiprocessing

    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        _end(1)


def _end(code: int) -> None:
    """Leave no half file; wait for nothing, since what runs may take hours."""
    from nodegraph.formats.atomic import remove_parts

    remove_parts()
    os._exit(code)


@contextlib.contextmanager
def dask_cluster(address: str) -> Iterator[Executor]:
    """The workers of a Dask cluster. They must have nodegraph installed and see the same files."""
    try:
        import distributed
    except ImportError:
        raise GraphError("--cluster: Dask is not installed; pip install 'nodegraph[dask]'") from None
    connect: Any = distributed.Client
    try:
        client = connect(address, timeout="15s")
    except (OSError, ValueError) as error:
        raise GraphError(f"--cluster {address}: no Dask scheduler answers there ({type(error).__name__})") from None
    try:
        yield client.get_executor(pure=False)
    finally:
        client.close()
