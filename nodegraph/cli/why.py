"""Say what made a node dirty or kept it clean: what its result depends on, and whether such a result is kept."""

from __future__ import annotations

import argparse

from nodegraph.cli.arguments import add_run_options
from nodegraph.cli.opening import open_workspace


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="workspace (.json), or a picture (.png) that carries one")
    parser.add_argument("node", metavar="NODE", help="path of the node: raycast, or finish/raycast")
    add_run_options(parser)


def run(arguments: argparse.Namespace) -> int:
    from nodegraph import explain
    from nodegraph.engine import Engine

    network = open_workspace(arguments.file, arguments.set)
    engine = Engine(device=arguments.device)
    try:
        print(explain.why(engine, network, arguments.node, arguments.view or None, size=arguments.size))
    finally:
        engine.close()
    return 0
