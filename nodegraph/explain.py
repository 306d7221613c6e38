"""Say what a plan would do, and why a node is dirty or clean, as text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING

from nodegraph.errors import CommandError, near_miss
from nodegraph.plan import Plan, Task
from nodegraph.report import State

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.network import Network
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


def explain(
    engine: Engine,
    network: Network,
    sinks: Iterable[str] | str | None = None,
    *,
    size: tuple[int, int] | None = None,
    quality: str = "final",
) -> str:
    """The plan as text: tasks in order, the size and who asked for it, and for each whether and why it runs."""
    plan = engine.plan(network, sinks, size=size, quality=quality)
    last = engine.last(network)
    running = _running(engine, plan)
    rows: list[tuple[str, str, str]] = []
    for place, task in enumerate(plan.tasks):
        asked = f"{task.size[0]}x{task.size[1]} {task.quality}" if task.size else ""
        asked = ", ".join(part for part in (asked, task.reason) if part)
        rows.append((task.path, asked, _fate(engine, plan, place, running, last)))
        for memo in last.memos.get(task.path, ()):
            rows.append((f"  {memo}", "memo", _cost(last, memo)))
    count = sum(fate.startswith("runs") for _, _, fate in rows)
    head = f"{', '.join(plan.sinks) or 'no sinks'}: {_count(len(plan.tasks), 'task')}, {count} to run"
    widths = [max((len(row[column]) for row in rows), default=0) for column in (0, 1)]
    lines = [f"{path:<{widths[0]}}  {asked:<{widths[1]}}  {fate}".rstrip() for path, asked, fate in rows]
    return "\n".join([head, *lines])


def why(
    engine: Engine,
    network: Network,
    node: str,
    sinks: Iterable[str] | str | None = None,
    *,
    size: tuple[int, int] | None = None,
    quality: str = "final",
) -> str:
    """What made a node dirty, or what keeps it clean: the parameter, file, source text or node further up.

    Below that, what its result depends on. Without sinks the node itself is taken for one where no view reads it.
    Raises CommandError for an unknown node.
    """
    flat = network.flatten()
    if node not in flat.nodes:
        if node in flat.muted:
            return f"{node}: muted; it passes its input through and never runs"
        raise CommandError(f"{node}: no such node{near_miss(node, flat.nodes)}")
    plan = engine.plan(network, sinks, size=size, quality=quality)
    places = [place for place, task in enumerate(plan.tasks) if task.path == node]
    note = ""
    if not places:
        named = ", ".join(plan.sinks)
        note = f"{node}: nothing that is asked for needs it ({named})\n" if named else ""
        plan = engine.plan(network, node, size=size, quality=quality)
        places = [place for place, task in enumerate(plan.tasks) if task.path == node]
    running = _running(engine, plan)
    last = engine.last(network)
    told = [f"{node}: {_fate(engine, plan, place, running, last)}" for place in places]
    return note + "\n".join([*told, *_ingredients(plan, places[0])])


def states(
    engine: Engine,
    network: Network,
    sinks: Iterable[str] | str | None = None,
    *,
    size: tuple[int, int] | None = None,
    quality: str = "final",
) -> dict[str, State]:
    """State of every node that the sinks need, without running anything: clean, dirty, blocked or failed."""
    plan = engine.plan(network, sinks, size=size, quality=quality)
    running = _running(engine, plan)
    last = engine.last(network)
    found: dict[str, State] = {}
    for place, task in enumerate(plan.tasks):
        fate = _fate(engine, plan, place, running, last)
        word = {"runs": "dirty", "blocked": "blocked", "failed": "failed"}.get(
            fate.split(":")[0].split(" ")[0].rstrip(",")
        )
        if word is not None or task.path not in found:
            found[task.path] = State(word or "clean", fate)
    return found


def _ingredients(plan: Plan, place: int) -> list[str]:
    """What the result of a task depends on, one a line."""
    task = plan.tasks[place]
    lines = [f"{what} {text}" for what, text in task.local.code.parts]
    lines += [f"{name} = {text}" for name, text in task.local.encoded.items()]
    lines += [f"file {state}" for state in task.local.files.values()]
    lines += [f"asked-for {service.rstrip(chr(0))}" for service in task.services]
    for port, feeds in task.feeds.items():
        if feeds is None:
            lines.append(f"{port}: not read")
        for source, output in feeds or ():
            above = plan.tasks[source]
            lines.append(f"{port}: {above.path}.{output} {above.fingerprint.hex()[:16]}")
    return [f"    {line}" for line in lines]


def _running(engine: Engine, plan: Plan) -> set[int]:
    """Places of the tasks that a run would reach: not kept, and read by one that runs, or a sink."""
    needed = {place for feeds in plan.sinks.values() for place, _ in feeds}
    found: set[int] = set()
    for place in range(len(plan.tasks) - 1, -1, -1):
        task = plan.tasks[place]
        if place in needed and task.path not in plan.given and not _is_kept(engine, plan, place):
            found.add(place)
            needed |= {source for sources in task.feeds.values() for source, _ in sources or ()}
    return found


def _is_kept(engine: Engine, plan: Plan, place: int) -> str:
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


def _fate(engine: Engine, plan: Plan, place: int, running: set[int], last: LastRun) -> str:
    """What would become of a task, and why."""
    task = plan.tasks[place]
    if task.path in plan.given:
        return "given by the script"
    if task.problem is not None:
        return f"blocked: {task.problem}"
    failure = engine.cache.failure(task.fingerprint)
    if failure is not None:
        return f"failed, and nothing it depends on has changed since: {failure}"
    for source in sorted(_above(plan, place)):
        above = plan.tasks[source]
        error = above.problem or engine.cache.failure(above.fingerprint)
        if error is not None and place in running:
            return f"blocked by {error}"
    kept = _is_kept(engine, plan, place)
    if kept:
        return f"{kept}: nothing it depends on has changed{_cost(last, task.path, ', ')}"
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
    return f"runs: {'; '.join(changes(before, (task, plan.tasks)))}{_cost(last, task.path, '; last time ')}"


Place = tuple[Task, list[Task]]
"""A task and the plan that it stands in."""


def changes(before: Place, now: Place) -> list[str]:
    """What differs between two keys of one node: parts of its own, or where further up the difference begins."""
    found: dict[tuple[str, str], None] = {}
    seen: set[tuple[bytes, bytes]] = set()
    rest = [(before, now)]
    while rest:
        (old, old_tasks), (new, new_tasks) = rest.pop()
        if (old.fingerprint, new.fingerprint) in seen:
            continue
        seen.add((old.fingerprint, new.fingerprint))
        found.update(((new.path, text), None) for text in _own_changes(old, new))
        for port in dict.fromkeys([*old.feeds, *new.feeds]):
            then, here = old.feeds.get(port, ()), new.feeds.get(port, ())
            if then is None or here is None:
                if then != here:
                    found[new.path, f"{port} {'is no longer read' if here is None else 'is read now'}"] = None
                continue
            one = [(old_tasks[place].path, output) for place, output in then]
            two = [(new_tasks[place].path, output) for place, output in here]
            if one != two:
                found[new.path, _change(f"wires of {port}", _wires(one), _wires(two))] = None
                continue
            for (old_place, _), (new_place, _) in zip(then, here, strict=True):
                above, below = old_tasks[old_place], new_tasks[new_place]
                if above.fingerprint != below.fingerprint:
                    rest.append(((above, old_tasks), (below, new_tasks)))
    texts = [text if path == now[0].path else f"{path}: {text}" for path, text in found]
    return texts or ["something it depends on changed"]


def _own_changes(old: Task, new: Task) -> list[str]:
    """What differs in a node's own part: code, parameters, files, services."""
    found = []
    if old.local.digest != new.local.digest:
        then, code = dict(old.local.code.parts), dict(new.local.code.parts)
        for what in dict.fromkeys([*then, *code]):
            if then.get(what) != code.get(what):
                found.append(_change(what, then.get(what), code.get(what)))
        found += _differences("", old.local.encoded, new.local.encoded)
        found += _differences("file ", old.local.files, new.local.files)
    was = {service.rstrip("\0").partition(" ")[0]: service.rstrip("\0").partition(" ")[2] for service in old.services}
    now = {service.rstrip("\0").partition(" ")[0]: service.rstrip("\0").partition(" ")[2] for service in new.services}
    return found + _differences("asked-for ", was, now)


def _wires(wires: list[tuple[str, str]]) -> str:
    return " ".join(f"{path}.{output}" for path, output in wires) or "nothing"


def _differences(prefix: str, old: Mapping[str, str], new: Mapping[str, str]) -> list[str]:
    names = dict.fromkeys([*old, *new])
    return [_change(prefix + name, old.get(name), new.get(name)) for name in names if old.get(name) != new.get(name)]


def _change(what: str, old: str | None, new: str | None) -> str:
    if what.startswith(("source text", "shader ")):
        return f"the {what} changed"
    return f"{what} {_short(old)} -> {_short(new)}"


def _short(text: str | None) -> str:
    if text is None:
        return "not shown"
    return text if len(text) <= 60 else f"{text[:57]}..."


def _above(plan: Plan, place: int) -> set[int]:
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


def _cost(last: LastRun, path: str, before: str = "") -> str:
    parts = []
    if path in last.seconds:
        parts.append(f"{last.seconds[path]:.3g} s")
    if last.bytes.get(path):
        parts.append(f"{last.bytes[path] / 1e6:.3g} MB")
    return before + ", ".join(parts) if parts else ""


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'' if number == 1 else 's'}"
