"""Say what made a node dirty or kept it clean.

With --set the workspace as it is counts as evaluated: what would make the node run again, and what would not. Example:

    nodegraph why first_light.json raycast --set ct.path=other.nii.gz
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from nodegraph.cli.arguments import add_run_options
from nodegraph.cli.opening import open_workspace
from nodegraph.cli.terminal import answer

if TYPE_CHECKING:
    from nodegraph.plan import Plan, Task


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="workspace (.json), or a picture (.png, .exr) that carries one")
    parser.add_argument("node", metavar="NODE", help="path of the node: raycast, or finish/raycast")
    add_run_options(parser)


def run(arguments: argparse.Namespace) -> int:
    from nodegraph import explain
    from nodegraph.engine import Engine
    from nodegraph.overrides import assign

    network = open_workspace(arguments.file)
    sinks = arguments.view or None
    with Engine(device=arguments.device) as engine:
        before = engine.plan(network, sinks, size=arguments.size)
        for assignment in arguments.set:
            assign(network, assignment.place, assignment.text)
        now = engine.plan(network, sinks, size=arguments.size)
        first, second = _task(before, arguments.node), _task(now, arguments.node)
        if not arguments.set or first is None or second is None:
            answer(explain.why(engine, network, arguments.node, sinks, size=arguments.size))
        elif first.fingerprint == second.fingerprint:
            answer(f"{arguments.node}: stays clean: nothing that it depends on changes")
        else:
            differences = explain.changes((first, before.tasks), (second, now.tasks))
            answer(f"{arguments.node}: runs again: {'; '.join(differences)}")
    return 0


def _task(plan: Plan, path: str) -> Task | None:
    """The first task of a node in a plan; None where the plan does without the node."""
    return next((task for task in plan.tasks if task.path == path), None)
