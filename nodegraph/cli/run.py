"""Run a workspace: all its views and effects, or those named by --view.

Pictures go to OUT/<node>.png, by default into the current folder; an OUT that ends in .png or .exr is one file and
needs exactly one view. FILE is a workspace, or a picture that carries the workspace that made it. The files that were
written are printed, one a line. With --error, every view is compared with a reference in double precision, and the
error of what was just rendered is told.
"""

from __future__ import annotations

import argparse
import json
import time
from typing import TYPE_CHECKING, Any

from nodegraph.cli.arguments import UsageError, add_run_options
from nodegraph.cli.destination import Destination
from nodegraph.cli.opening import open_workspace
from nodegraph.cli.terminal import Progress, answer, say

if TYPE_CHECKING:
    from nodegraph.report import Event, Report


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="workspace (.json), or a picture (.png, .exr) that carries one")
    add_run_options(parser)
    parser.add_argument("--out", default=".", metavar="PATH", help="folder of the pictures, or one file (.png, .exr)")
    parser.add_argument(
        "--error", action="store_true", help="tell the measured error of what each view shows (makes a reference)"
    )
    parser.add_argument(
        "--json", action="store_true", help="print states, timings, bytes and files as one JSON document"
    )


def run(arguments: argparse.Namespace) -> int:
    from nodegraph.engine import Engine
    from nodegraph.pictures import images_of, is_empty, views_of, write_picture

    start = time.perf_counter()
    network = open_workspace(arguments.file, arguments.set)
    sinks = arguments.view or None
    views = views_of(network.flatten(), sinks)
    if not sinks and not network.nodes:
        raise UsageError(f"{arguments.file}: the workspace has no nodes, so there is nothing to run")
    destination = Destination(arguments.out, views)

    files = []
    with Engine(device=arguments.device) as engine:
        with Progress() as progress:
            report = engine.evaluate(network, sinks, size=arguments.size, on_event=lambda event: _show(progress, event))
        for name, image in images_of(report, views).items():
            path = destination.file_for(name)
            write_picture(image, path, network)
            files.append(str(path))
            if is_empty(image):
                report.notes.append(
                    f"{name}: every pixel is transparent; see whether the camera looks at the data (nodegraph info "
                    f"says where they lie) and whether the transfer function shows their values"
                )
        device = engine.device_in_use
        seconds = time.perf_counter() - start
        accuracy: dict[str, dict[str, Any]] = {}
        sentences: list[str] = []
        code = report.exit_code
        if arguments.error:
            from nodegraph.cli.errors_told import measured

            with Progress() as progress:
                accuracy, sentences, failed = measured(network, report, views, arguments.size, progress.show)
            code = max(code, failed)
    if arguments.json:
        told = document(report, arguments.file, files, device, seconds)
        if arguments.error:
            told |= {"accuracy": accuracy, "exit_code": code, "ok": report.ok and code == 0}
        answer(json.dumps(told, indent=1))
    else:
        if device is not None:
            say(f"device {device['reason']}")
        for file in files:
            answer(file)
    tell(report)
    for text in sentences:
        say(text)
    return code


def _show(progress: Progress, event: Event) -> None:
    if event.kind == "started":
        progress.show(event.path)
    elif event.kind == "progress":
        progress.show(f"{event.path} {event.text}".rstrip(), event.fraction)


def tell(report: Report) -> None:
    """Say what went wrong, and what went another way than planned."""
    for note in report.notes:
        say(note)
    for error in report.errors.values():
        say(str(error))
    blocked = [path for path, state in report.states.items() if state == "blocked" and path not in report.errors]
    if blocked and report.errors:
        say(f"not run because of that: {', '.join(blocked)}")


def document(
    report: Report, file: str, files: list[str], device: dict[str, str] | None, seconds: float
) -> dict[str, Any]:
    """What ``--json`` prints."""
    nodes: dict[str, dict[str, Any]] = {}
    for path, state in report.states.items():
        told: dict[str, Any] = {"state": str(state)}
        if state.reason:
            told["reason"] = state.reason
        nodes[path] = told
    for path, taken in report.timings.items():
        nodes.setdefault(path, {})["seconds"] = round(taken, 6)
    for path, size in report.bytes.items():
        nodes.setdefault(path, {})["bytes"] = size
    return {
        "file": file,
        "ok": report.ok,
        "exit_code": report.exit_code,
        "device": device,
        "seconds": round(seconds, 6),
        "files": files,
        "ran": report.ran,
        "cached": report.cached,
        "nodes": nodes,
        "errors": {path: str(error) for path, error in report.errors.items()},
        "notes": report.notes,
    }
