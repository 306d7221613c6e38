"""Vary settings, and tell for each what it costs and how wrong it is.

Each setting is timed on each device and compared with a converged reference in double precision. A table is printed;
settings that no other beats in both time and error are marked with a star. With --out, the same as JSON, CSV, a plot
and a page with pictures. Examples:

    nodegraph measure brain.json --view view --vary raycast.step=0.25..4 --vary raycast.integrator=all --out front
    nodegraph measure brain.json --view smooth.smoothed --vary smooth.sigma=1,2,4 --device all

VALUES of --vary: a..b by factors of two (for parameters that trade speed for accuracy), a..b:n (n of them, evenly),
a,b,c, or "all" for choices and switches. Several --vary: all combinations.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import TYPE_CHECKING

from nodegraph.cli.arguments import DEVICES, UsageError, assignment, size
from nodegraph.cli.destination import require_room
from nodegraph.cli.opening import open_workspace
from nodegraph.cli.terminal import Progress, answer, say
from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.accuracy.points import Measured, Point


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="workspace (.json), or a picture (.png, .exr) that carries one")
    parser.add_argument("--view", metavar="NODE", help="a node, or node.output, of any type; needed where several show")
    parser.add_argument(
        "--vary", action="append", default=[], metavar="NODE.PARAM=VALUES", help="repeated: all combinations"
    )
    parser.add_argument(
        "--set", action="append", default=[], type=assignment, metavar="NODE.PARAM=VALUE", help="set a parameter"
    )
    parser.add_argument("--size", type=size, metavar="WxH", help="size of the pictures in pixels")
    parser.add_argument("--device", default="auto", choices=(*DEVICES, "all"), help="where kernels run (default: auto)")
    parser.add_argument(
        "--repeats", type=_repeats, default=5, metavar="N", help="times that each is timed (default: 5)"
    )
    parser.add_argument("--error", default="", metavar="NAME", help="the error that the front is about (default: max)")
    parser.add_argument("--flip", action="store_true", help="tell the mean FLIP of pictures, too (about 1 s each)")
    parser.add_argument("--bound", type=_bound, default=1e-5, help="of the reference (default: 1e-5)")
    parser.add_argument("--out", metavar="FOLDER", help="write measure.json, .csv, .html and .png there")
    parser.add_argument("--json", action="store_true", help="print everything as one JSON document")


def _repeats(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 10_000:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of repeats, 1 to 10000")
    return int(text)


def _bound(text: str) -> float:
    try:
        bound = float(text)
    except ValueError:
        bound = 0.0
    if not 0.0 < bound < 1.0:
        raise argparse.ArgumentTypeError(f"{text!r} is not a bound between 0 and 1, such as 1e-5")
    return bound


def run(arguments: argparse.Namespace) -> int:
    network = open_workspace(arguments.file, arguments.set)
    from nodegraph.accuracy.measure import measure
    from nodegraph.accuracy.report import document, write_all
    from nodegraph.accuracy.report_plot import can_plot
    from nodegraph.accuracy.settings import combinations, variants
    from nodegraph.pictures import views_of

    view = arguments.view
    if view is None:
        views = views_of(network.flatten(), None)
        if len(views) != 1:
            listed = f" (there are {', '.join(views)})" if views else ""
            raise UsageError(f"name what shall be measured with --view{listed}")
        view = views[0]
    if arguments.flip:
        _require_flip()
    settings = combinations([variants(text, network) for text in arguments.vary])
    if arguments.out:
        require_room(arguments.out, Path(arguments.out).absolute())
    with Progress() as progress:
        measured = measure(
            network,
            view,
            settings,
            arguments.device,
            size=arguments.size,
            repeats=arguments.repeats,
            error=arguments.error,
            flip=arguments.flip,
            bound=arguments.bound,
            name=Path(arguments.file).stem,
            on_progress=progress.show,
        )
    files: list[Path] = []
    unwritten: GraphError | None = None
    try:
        files = write_all(measured, arguments.out) if arguments.out else []
    except GraphError as error:
        unwritten = error  # what took so long to measure is printed all the same
    if arguments.json:
        failed = unwritten is not None or any(point.failure for point in measured.points)
        told = {"ok": not failed, **document(measured), "files": [str(file) for file in files]}
        answer(json.dumps(told if unwritten is None else {**told, "error": str(unwritten)}, indent=1))
    else:
        for line in table(measured):
            answer(line)
        for file in files:
            say(f"wrote {file}")
    if files and not can_plot():
        say("no plot, since it needs the package matplotlib: pip install 'nodegraph[plot]'")
    code = tell(measured)
    if unwritten is not None:
        say(str(unwritten))
        return unwritten.exit_code
    return code


def _require_flip() -> None:
    """Refuse --flip before an hour of rendering, and not after it."""
    import importlib.util

    if importlib.util.find_spec("flip_evaluator") is None:
        raise UsageError("--flip: needs the package flip-evaluator: pip install 'nodegraph[accuracy]'")


def tell(measured: Measured) -> int:
    """Say what has to be said of the references and of settings that failed; return the exit code."""
    for note in measured.notes:
        say(note)
    for reference in measured.references:
        told = reference.failure or reference.summary
        if reference.left_out:
            told += f"; {100 * reference.left_out:.3g} % of it count in no error"
        which = ", ".join(f"{place}={value}" for place, value in reference.settings.items())
        say(f"{which}: {told}" if which else told)
        for text in reference.notes:
            say(text)
    for text in dict.fromkeys(note for point in measured.points for note in point.notes):
        say(text)
    failed = [point for point in measured.points if point.failure]
    for point in failed:
        say(f"{point.label} on {point.device}: {point.failure}")
    return 1 if failed else 0


def table(measured: Measured) -> list[str]:
    """Lines of aligned columns: a star for the front, settings, device, milliseconds, bytes, errors."""
    from nodegraph.accuracy.points import text

    units = measured.units
    heads = ["", *measured.places, "device", "ms", "device ms", "prepare ms", "bytes"]
    heads += [f"{figure}/{units[figure]}" if units.get(figure) else figure for figure in measured.figures]
    rows = [heads]
    for point in measured.points:
        own = [text(point.settings[place]) if place in point.settings else "" for place in measured.places]
        rows.append(["*" if point.front else "", *own, point.device, *_costs(point)])
        rows[-1] += [f"{point.errors[name]:.3g}" if name in point.errors else "-" for name in measured.figures]
    widths = [max(len(row[i]) for row in rows) for i in range(len(heads))]
    left = 2 + len(measured.places)  # words stand left, numbers right
    return [
        "  ".join(
            cell.ljust(width) if i < left else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def _costs(point: Point) -> list[str]:
    if not point.runs:
        return ["failed", "-", "-", "-"]
    seconds = (point.seconds, point.device_seconds, point.prepare_seconds)
    return [*(f"{1000 * each:.2f}" for each in seconds), str(point.bytes)]
