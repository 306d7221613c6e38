"""What is asked of a measure, checked before anything runs: a view with one value, and an error that it has."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from nodegraph.accuracy.measures import measure_for
from nodegraph.errors import CommandError, ParameterError, near_miss_or_all

if TYPE_CHECKING:
    from nodegraph.network import Network
    from nodegraph.plan import Plan


def planned(network: Network, view: str, size: tuple[int, int] | None) -> Plan:
    """The plan of one setting; CommandError where the view is none that can be measured."""
    from nodegraph.pictures import is_effect
    from nodegraph.plan import plan

    flat = network.flatten()
    if is_effect(flat, view):
        sources = [f"{path}.{output}" for path, output in _feeding(flat, view)]
        cure = f", {' or '.join(sources)}" if sources else ""
        raise CommandError(f"{view}: it changes the world, so it is not measured; name what it reads{cure}")
    made = plan(flat, [view], size=size, device=lambda: "none")
    outputs = outputs_of(made, view)
    if len(outputs) != 1:
        names = ", ".join(f"{path}.{output}" for path, output, _ in outputs)
        cure = f"several values; name one: {names}" if outputs else "nothing; name a node with an output"
        raise CommandError(f"{view}: it shows {cure}")
    return made


def _feeding(flat: Any, view: str) -> Iterator[tuple[str, str]]:
    for sources in flat.nodes[view].sources.values() if view in flat.nodes else ():
        for source in sources:
            if isinstance(source, tuple):
                yield source[0], source[1]


def outputs_of(plan: Plan, view: str) -> list[tuple[str, str, type]]:
    """(path, output, declared type) of what a sink shows."""
    feeds = list(plan.sinks[view])
    for place, output in plan.sinks[view]:
        if not output:
            feeds.remove((place, output))
            feeds += [feed for sources in plan.tasks[place].feeds.values() for feed in sources or ()]
    found = []
    for place, output in feeds:
        processor = plan.tasks[place].processor
        port = processor.outputs.get(output) if processor is not None else None
        found.append((plan.tasks[place].path, output, port.type if port is not None else object))
    return found


def check_figure(plan: Plan, view: str, error: str, flip: bool) -> None:
    """Refuse a type without a measure, and an error that its measure does not tell."""
    _, _, declared = outputs_of(plan, view)[0]
    if declared is object:
        return  # a port for anything: what comes is seen when it is there
    known = measure_for(declared)
    figures = tuple(figure for figure in known.figures if flip or figure != "flip")
    if error and error not in figures:
        cure = "; say --flip as well" if error == "flip" and "flip" in known.figures else ""
        raise ParameterError(f"{error}: no such error of {view}{cure or near_miss_or_all(error, figures)}")
