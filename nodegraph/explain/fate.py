"""What would become of each task of a plan, and why: the words that the other parts of `explain` put together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodegraph.explain.differences import changes
from nodegraph.plan import Plan, Task

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.report import Report


class LastRun:
    """What the last evaluations of one network left behind, by path: keys to compare with, seconds, bytes, memos."""

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


def running_places(engine: Engine, plan: Plan) -> set[int]:
    """Places of the tasks that a run would reach: not kept, and read by one that runs, or a sink."""
    needed = {place for feeds in plan.sinks.values() for place, _ in feeds}
    found: set[int] = set()
    for place in range(len(plan.tasks) - 1, -1, -1):
        task = plan.tasks[place]
        if place in needed and task.path not in plan.given and not where_kept(engine, plan, place):
            found.add(place)
            needed |= {source for sources in task.feeds.values() for source, _ in sources or ()}
    return found


def where_kept(engine: Engine, plan: Plan, place: int) -> str:
    """Where the result of a task is kept: memory, disk, or empty for nowhere."""
    task = plan.tasks[place]
    processor = task.processor
    if processor is None or processor.effect or task.problem is not None:
        return ""
    if task.fingerprint in engine.cache:
        return "kept"
    # Hashing what a script gave is not worth an explanation.
    if processor.disk_cache and engine.disk is not None and task.stable and task.fingerprint in engine.disk:
        return "kept on disk"
    return ""


def fate(engine: Engine, plan: Plan, place: int, running: set[int], last: LastRun) -> str:
    """What would become of a task, and why."""
    task = plan.tasks[place]
    if task.path in plan.given:
        return "given by the script"
    if task.problem is not None:
        return f"blocked: {task.problem}"
    failure = engine.cache.failure(task.fingerprint)
    if failure is not None:
        return f"failed, and nothing it depends on has changed since: {failure}"
    for source in sorted(above(plan, place)):
        higher = plan.tasks[source]
        error = higher.problem or engine.cache.failure(higher.fingerprint)
        if error is not None and place in running:
            return f"blocked by {error}"
    kept = where_kept(engine, plan, place)
    if kept:
        return f"{kept}: nothing it depends on has changed{cost(last, task.path, ', ')}"
    if place not in running:
        return "not needed: what reads it is kept"
    if task.processor is not None and task.processor.effect:
        if task.path not in plan.named:
            return "blocked: it changes the world, so it runs only when it is named"
        return "runs: it changes the world, so it is never kept"
    before = last.tasks.get(task.path)
    if before is None:
        return "runs: it has not run before in this engine"
    if before[0].fingerprint == task.fingerprint:
        return "runs: nothing it depends on has changed, but its result was let go to stay within the budget"
    return f"runs: {'; '.join(changes(before, (task, plan.tasks)))}{cost(last, task.path, '; last time ')}"


def above(plan: Plan, place: int) -> set[int]:
    """All tasks above one."""
    found: set[int] = set()
    rest = [place]
    while rest:
        for sources in plan.tasks[rest.pop()].feeds.values():
            for source, _ in sources or ():
                if source not in found:
                    found.add(source)
                    rest.append(source)
    return found


def asked(task: Task) -> str:
    """The size and quality of a task, and who asked for it."""
    size = f"{task.size[0]}x{task.size[1]} {task.quality}" if task.size else ""
    return ", ".join(part for part in (size, task.reason) if part)


def cost(last: LastRun, path: str, before: str = "") -> str:
    """Seconds and bytes of a node or a memo when it last ran; empty where neither is known."""
    parts = []
    if path in last.seconds:
        parts.append(f"{last.seconds[path]:.3g} s")
    if last.bytes.get(path):
        parts.append(f"{last.bytes[path] / 1e6:.3g} MB")
    return before + ", ".join(parts) if parts else ""


def counted(number: int, noun: str) -> str:
    """``1 task``, ``2 tasks``."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
