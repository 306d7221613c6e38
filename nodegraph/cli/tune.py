"""Find the cheapest settings whose error stays below --max-error, or the most accurate ones within --budget-ms.

What may be set is what processors declare as a trade of speed for accuracy. The error is the worst on several cameras
around the scene, against references in double precision, and it is told for other cameras, too, that had no part in the
search. The settings are printed, one a line, as --set takes them; with --write they go into the workspace. Exit code 3:
nothing that was tried keeps what was asked for; the best that was found is printed, and nothing is written.
"""

from __future__ import annotations

import argparse
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nodegraph.cli.arguments import DEVICES, UsageError, assignment, size
from nodegraph.cli.errors_told import as_json, number_json
from nodegraph.cli.opening import open_workspace
from nodegraph.cli.terminal import Progress, answer, say
from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.accuracy.tries import Tried
    from nodegraph.accuracy.tune import Tuned
    from nodegraph.network import Network

NOT_KEPT = 3


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="workspace (.json), or a picture (.png, .exr) that carries one")
    parser.add_argument(
        "--set", action="append", default=[], type=assignment, metavar="NODE.PARAM=VALUE", help="set a parameter"
    )
    parser.add_argument("--view", metavar="NODE", help="what is looked at; may be left out where there is one view")
    parser.add_argument("--max-error", type=float, metavar="E", help="greatest error that is allowed")
    parser.add_argument("--budget-ms", type=float, metavar="MS", help="longest time that is allowed, milliseconds")
    parser.add_argument(
        "--measure",
        default="",
        metavar="FIGURE",
        help="which error: max (default: the worst channel of the worst pixel), rmse, p999, ...",
    )
    parser.add_argument(
        "--size",
        type=size,
        metavar="WxH",
        help="size of the pictures in pixels (default: at most 256 a side, or the view's own with --budget-ms)",
    )
    parser.add_argument("--device", default="auto", choices=DEVICES, help="where kernels run (default: auto)")
    parser.add_argument("--cameras", type=int, default=4, metavar="N", help="cameras that are searched on (default: 4)")
    parser.add_argument("--held-out", type=int, default=4, metavar="N", help="other cameras, tried after (default: 4)")
    parser.add_argument("--repeats", type=int, default=3, metavar="N", help="times that each is timed (default: 3)")
    parser.add_argument(
        "--seconds", type=float, default=120.0, metavar="S", help="how long new settings are tried (default: 120)"
    )
    parser.add_argument("--write", action="store_true", help="write the settings into the workspace FILE")
    parser.add_argument("--json", action="store_true", help="print everything that was found as one JSON document")


def run(arguments: argparse.Namespace) -> int:
    from nodegraph import workspace
    from nodegraph.accuracy.tune import tune

    file = Path(arguments.file)
    if arguments.write and file.suffix.lower() in workspace.PICTURES:
        raise UsageError(f"{file}: --write needs a workspace file, and this is a picture; leave --write out")
    if arguments.write and arguments.set:
        raise UsageError("--write: what is tuned with --set is not what the file holds; leave one of them out")
    before = _content(file) if arguments.write else b""
    if before:
        _require_writable(file)
    network = open_workspace(arguments.file, arguments.set)
    view = arguments.view or _only_view(network, arguments.file)
    with Progress() as progress:
        found = tune(
            network,
            view,
            arguments.max_error,
            arguments.budget_ms,
            figure=arguments.measure,
            size=arguments.size,
            device=arguments.device,
            cameras=arguments.cameras,
            held_out=arguments.held_out,
            repeats=arguments.repeats,
            seconds=arguments.seconds,
            show=progress.show,
        )
    written = arguments.write and found.met
    unwritten: GraphError | None = None
    if written:
        for place, value in found.settings.items():
            network.set(place, value)
        try:
            if _content(file) != before:
                raise UsageError(f"{file}: it was changed while this ran, so nothing is written; run it again")
            if found.settings:
                workspace.save(network)
        except GraphError as error:
            written, unwritten = False, error  # what took so long to find is printed all the same
    code = unwritten.exit_code if unwritten is not None else 0 if found.met else NOT_KEPT
    if arguments.json:
        told = {"file": arguments.file, **document(found, network, view, code), "written": written}
        if unwritten is not None:
            told |= {"ok": False, "error": str(unwritten)}
        answer(json.dumps(told, indent=1))
    else:
        for text in assignments(found, network):
            answer(text)
        _tell(found, written, arguments)
    if unwritten is not None:
        say(str(unwritten))
    return code


def document(found: Tuned, network: Network, view: str, code: int) -> dict[str, Any]:
    """What ``--json`` prints."""
    from nodegraph.accuracy.settings import encoded

    def tried(one: Tried) -> dict[str, Any]:
        told: dict[str, Any] = {
            "settings": encoded(network, one.settings),
            "seconds": number_json(one.seconds),
            "errors": as_json(one.errors),
            "cameras": list(one.cameras),
            "front": one.front,
        }
        if one.failure:
            told["failure"] = one.failure
        return told

    return {
        "view": view,
        "ok": found.met,
        "exit_code": code,
        "summary": found.summary(),
        "settings": encoded(network, found.settings),
        "measure": found.figure,
        "error": number_json(found.error),
        "max_error": found.max_error,
        "budget_ms": found.budget_ms,
        "size": list(found.size),
        "device": found.device,
        "rounds": found.rounds,
        "before": tried(found.before),
        "best": tried(found.best),
        "held_out": tried(found.held_out) if found.held_out is not None else None,
        "tried": [tried(one) for one in found.tried],
        "left_out": found.left_out,
        "notes": list(found.notes),
    }


def assignments(found: Tuned, network: Network) -> list[str]:
    """The settings as ``--set`` takes them."""
    from nodegraph.accuracy.points import text
    from nodegraph.accuracy.settings import encoded

    told = encoded(network, found.settings)
    return [f"{place}={repr(value) if isinstance(value, float) else text(value)}" for place, value in told.items()]


def _tell(found: Tuned, written: bool, arguments: argparse.Namespace) -> None:
    for line in _front(found):
        say(line)
    for note in found.notes:
        say(note)
    for place, reason in found.left_out.items():
        say(f"{place} is left as it is: {reason}")
    say(found.summary())
    if found.held_out is not None:
        error = found.held_out.errors.get(found.figure, float("inf"))
        say(
            f"over {len(found.held_out.cameras)} cameras that had no part in the search: {found.figure} {error:.3g}, "
            f"{1e3 * found.held_out.seconds:.3g} ms"
        )
    if written:
        say(f"written into {arguments.file}" if found.settings else f"{arguments.file} is best as it is")
    elif arguments.write:
        say(f"{arguments.file} is left as it was")
    elif not found.settings and found.met:
        say("the settings are best as they are")


def _front(found: Tuned) -> list[str]:
    """The front, a line each, with the settings in which they differ."""
    from nodegraph.accuracy.points import text

    front = found.front
    places = dict.fromkeys(place for one in front for place in one.settings)
    places = {place: None for place in places if len({repr(one.settings.get(place)) for one in front}) > 1}
    lines = []
    for one in front:
        shown = ", ".join(f"{place}={text(one.settings[place])}" for place in places if place in one.settings)
        error = one.errors.get(found.figure, float("inf"))
        lines.append(f"front: {1e3 * one.seconds:8.3g} ms  {found.figure} {error:.3g}  {shown or 'as it is'}")
    return lines


def _only_view(network: Network, file: str) -> str:
    from nodegraph.pictures import views_of

    views = views_of(network.flatten(), None)
    if len(views) != 1:
        found = f"it has {len(views)} views ({', '.join(views)})" if views else "it has no view"
        raise UsageError(f"{file}: {found}; name one with --view")
    return views[0]


def _require_writable(file: Path) -> None:
    """Refuse a file that somebody protected, and a folder where none can be made, before minutes of searching."""
    target = Path(os.path.realpath(file))
    # The mode is asked as well: a file is replaced and not opened, which a mode without w would not hinder.
    if not (target.stat().st_mode & 0o222 and os.access(target, os.W_OK) and os.access(target.parent, os.W_OK)):
        raise UsageError(f"{file}: it cannot be written to; leave --write out, or make it writable (chmod u+w)")


def _content(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except (FileNotFoundError, IsADirectoryError, NotADirectoryError):
        return b""  # reading the workspace says so
