"""What `sweep` and `batch` have in common: making tasks of variants of a workspace, and running them."""

from __future__ import annotations

import argparse
import json
import os
import re
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from nodegraph.cli.arguments import UsageError, add_run_options
from nodegraph.cli.destination import require_room
from nodegraph.cli.terminal import Progress, answer, say

if TYPE_CHECKING:
    from nodegraph.batch import Outcome, Task
    from nodegraph.network import Network

AT_ONCE_ON_A_CLUSTER = 1000


@dataclass(frozen=True)
class Variant:
    """One way to run the workspace: a name, what it sets, and the data files that it depends on."""

    name: str
    assignments: tuple[tuple[str, str], ...]
    inputs: tuple[str, ...] = ()


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add what `sweep` and `batch` take beside their variants."""
    add_run_options(parser)
    parser.add_argument("--out", default="out", metavar="DIR", help="folder of the results (default: out)")
    parser.add_argument("--workers", type=_count, metavar="K", help="processes on this machine (default: one per core)")
    parser.add_argument("--cluster", metavar="ADDRESS", help="scheduler of a Dask cluster to run on instead")
    parser.add_argument("--json", action="store_true", help="print the outcome of every task as one JSON document")


def _count(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 1024:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of processes, 1 to 1024")
    return int(text)


def names_of(labels: Sequence[str]) -> list[str]:
    """Names of folders for labels: safe on every system, short, and each once."""
    names: list[str] = []
    taken: set[str] = set()
    for label in labels:
        name = re.sub(r"[^\w.=,+-]+", "_", label.replace("/", "."))[:120].strip(".") or "task"
        unique, number = name, 2
        while unique.lower() in taken:  # some file systems do not tell case
            unique, number = f"{name}_{number}", number + 1
        taken.add(unique.lower())
        names.append(unique)
    return names


def run_variants(arguments: argparse.Namespace, network: Network, variants: Sequence[Variant]) -> int:
    """Run every variant and return the exit code: 1 where a task failed."""
    from nodegraph import batch

    tasks = make_tasks(arguments, network, variants)
    if arguments.cluster:
        open_executor, at_once = partial(batch.dask_cluster, arguments.cluster), AT_ONCE_ON_A_CLUSTER
    else:
        at_once = min(arguments.workers or os.cpu_count() or 1, len(tasks))
        open_executor = partial(batch.process_pool, at_once)
    done = 0
    with Progress() as progress:

        def show(outcome: Outcome) -> None:
            nonlocal done
            done += 1
            progress.show(f"{outcome.name} {outcome.state}, {done} of {len(tasks)} tasks", done / len(tasks))

        outcomes = batch.run_tasks(tasks, open_executor, at_once=at_once, on_done=show)
    return tell(outcomes, as_json=arguments.json)


def make_tasks(arguments: argparse.Namespace, network: Network, variants: Sequence[Variant]) -> list[Task]:
    """Turn variants into tasks. Raises for a value that is refused, before anything runs."""
    from nodegraph import workspace
    from nodegraph.batch import Task
    from nodegraph.overrides import assign

    text = workspace.dumps(network)
    outputs = outputs_of(network, arguments.view)
    for place, value in dict.fromkeys(pair for variant in variants for pair in variant.assignments):
        assign(network, place, value)
    out = Path(arguments.out).absolute()
    require_room(arguments.out, out)
    tasks = []
    for variant in variants:
        folder = out / variant.name
        files = tuple((sink, str(folder / name)) for sink, name, _ in outputs)
        own = tuple((place, str(folder / name)) for _, name, place in outputs if place)
        tasks.append(
            Task(
                name=variant.name,
                workspace=text,
                folder=str(folder),
                assignments=(*variant.assignments, *own),
                outputs=files,
                size=arguments.size,
                device=arguments.device,
                inputs=variant.inputs,
            )
        )
    return tasks


def outputs_of(network: Network, sinks: Sequence[str]) -> list[tuple[str, str, str]]:
    """What each task writes: sink, name of the file, and the parameter to set where the sink is an effect.

    Every task has a folder of its own, so effects are sent there: their path keeps its last part only.
    """
    from nodegraph.pictures import is_effect
    from nodegraph.requests import default_sinks

    flat = network.flatten()
    found = []
    for sink in sinks or default_sinks(flat):
        if not is_effect(flat, sink):
            found.append((sink, f"{sink.replace('/', '.')}.png", ""))
            continue
        node = flat.nodes[sink]
        assert node.processor is not None
        written = [name for name in node.values if getattr(node.processor.params[name], "write", False)]
        if len(written) != 1 or not node.values[written[0]]:
            say(f"{sink}: left out, since it is an effect that names no file")
            continue
        found.append((sink, Path(node.values[written[0]]).name, f"{sink}.{written[0]}"))
    if not found:
        raise UsageError("the workspace has no view and no effect that writes a file; name a node with --view")
    names = [name for _, name, _ in found]
    twice = next((name for name in names if names.count(name) > 1), "")
    if twice:
        raise UsageError(f"two nodes would write {twice} into the folder of a task; give them different file names")
    return found


def tell(outcomes: Sequence[Outcome], *, as_json: bool) -> int:
    """Print how the tasks ended, and return the exit code."""
    failed = [outcome for outcome in outcomes if outcome.state == "failed"]
    if as_json:
        answer(json.dumps({"ok": not failed, "tasks": [asdict(outcome) for outcome in outcomes]}, indent=1))
    else:
        for outcome in outcomes:
            for file in outcome.files:
                answer(file)
    for note in dict.fromkeys(note for outcome in outcomes for note in outcome.notes):
        say(note)
    for outcome in failed:
        say(f"{outcome.name}: {outcome.error}")
        if outcome.details:
            print(outcome.details, file=sys.stderr)
    counts = {state: sum(outcome.state == state for outcome in outcomes) for state in ("done", "skipped", "failed")}
    say(", ".join(f"{count} {state}" for state, count in counts.items() if count or state == "done"))
    return 1 if failed else 0
