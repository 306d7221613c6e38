"""The plan as text, the states of its nodes, and what made one of them dirty. Nothing is run."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from nodegraph.errors import CommandError, near_miss
from nodegraph.explain.fate import asked, cost, counted, fate, running_places
from nodegraph.plan import Plan
from nodegraph.report import State

if TYPE_CHECKING:
    from nodegraph.engine import Engine
    from nodegraph.network import Network


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
    running = running_places(engine, plan)
    rows: list[tuple[str, str, str]] = []
    for place, task in enumerate(plan.tasks):
        rows.append((task.path, asked(task), fate(engine, plan, place, running, last)))
        for memo in last.memos.get(task.path, ()):
            rows.append((f"  {memo}", "memo", cost(last, memo)))
    count = sum(what.startswith("runs") for _, _, what in rows)
    head = f"{', '.join(plan.sinks) or 'no sinks'}: {counted(len(plan.tasks), 'task')}, {count} to run"
    widths = [max((len(row[column]) for row in rows), default=0) for column in (0, 1)]
    lines = [f"{path:<{widths[0]}}  {who:<{widths[1]}}  {what}".rstrip() for path, who, what in rows]
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
    running = running_places(engine, plan)
    last = engine.last(network)
    told = [f"{node}: {fate(engine, plan, place, running, last)}" for place in places]
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
    running = running_places(engine, plan)
    last = engine.last(network)
    found: dict[str, State] = {}
    for place, task in enumerate(plan.tasks):
        reason = fate(engine, plan, place, running, last)
        word = {"runs": "dirty", "blocked": "blocked", "failed": "failed"}.get(
            reason.split(":")[0].split(" ")[0].rstrip(",")
        )
        if word is not None or task.path not in found:
            found[task.path] = State(word or "clean", reason)
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
