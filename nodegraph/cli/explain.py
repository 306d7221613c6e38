"""Print what a run would do, and why: every task in order, with its size, who asked for it, and whether it is kept."""

from __future__ import annotations

import argparse

from nodegraph.cli.arguments import add_run_options
from nodegraph.cli.opening import open_workspace
from nodegraph.cli.terminal import answer


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="workspace (.json), or a picture (.png, .exr) that carries one")
    add_run_options(parser)


def run(arguments: argparse.Namespace) -> int:
    from nodegraph import explain
    from nodegraph.engine import Engine

    network = open_workspace(arguments.file, arguments.set)
    with Engine(device=arguments.device) as engine:
        answer(explain.explain(engine, network, arguments.view or None, size=arguments.size))
    return 0
