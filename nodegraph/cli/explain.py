"""Print what a run would do, and why: every task in order, with its size, who asked for it, and whether it is kept.

Nothing is run, unless --scene asks what the pictures require: which features the kernels hold is decided by processors
while they run, so --scene renders the views (at --size), writes no file, and tells for every node why it ran, the
variants of its kernels with what they hold and leave out, its decisions, seconds, and bytes by purpose.
"""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from nodegraph.cli.arguments import add_run_options
from nodegraph.cli.opening import open_workspace
from nodegraph.cli.terminal import Progress, answer

if TYPE_CHECKING:
    from nodegraph.report import Event


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="workspace (.json), or a picture (.png, .exr) that carries one")
    add_run_options(parser)
    parser.add_argument(
        "--scene", action="store_true", help="run the views, then tell what they required: features, seconds, bytes"
    )


def run(arguments: argparse.Namespace) -> int:
    from nodegraph import explain
    from nodegraph.cli.run import tell
    from nodegraph.engine import Engine

    network = open_workspace(arguments.file, arguments.set)
    sinks = arguments.view or None
    with Engine(device=arguments.device) as engine:
        if not arguments.scene:
            answer(explain.explain(engine, network, sinks, size=arguments.size))
            return 0
        with Progress() as progress:
            scene = explain.scene(
                engine, network, sinks, size=arguments.size, on_event=lambda event: _show(progress, event)
            )
    answer(str(scene))
    tell(scene.report)
    return scene.report.exit_code


def _show(progress: Progress, event: Event) -> None:
    if event.kind in ("started", "progress"):
        progress.show(f"{event.path} {event.text}".rstrip(), event.fraction if event.kind == "progress" else None)
