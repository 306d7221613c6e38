"""Render the pictures of an animation: a folder of PNG files, or a film (.mp4).

What moves is in the workspace: key frames that the editor's timeline sets, and whatever follows the variable `frame`.
With --turntable the cameras of the view turn about what they look at, in a workspace without any key, too. The files
that were written are printed, one a line.
"""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from nodegraph.cli.arguments import DEVICES, UsageError, assignment, size
from nodegraph.cli.destination import require_room
from nodegraph.cli.opening import open_workspace
from nodegraph.cli.terminal import Progress, answer, say

if TYPE_CHECKING:
    from nodegraph.animation import Track
    from nodegraph.network import Network

MAX_FRAMES = 100_000


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="workspace (.json), or a picture (.png, .exr) that carries one")
    parser.add_argument("--frames", type=frames, metavar="A..B", help="first and last frame (default: the workspace's)")
    parser.add_argument("--out", default="frames", metavar="PATH", help="folder, or a film .mp4 (default: frames)")
    parser.add_argument("--view", metavar="NODE", help="the view to film, where there are several")
    parser.add_argument("--size", type=size, metavar="WxH", help="size of the pictures in pixels")
    parser.add_argument("--rate", type=_rate, metavar="N", help="pictures a second (default: the workspace's)")
    parser.add_argument(
        "--turntable", type=float, metavar="DEGREES", help="turn the camera so far over all frames, 360 for once round"
    )
    parser.add_argument(
        "--set", action="append", default=[], type=assignment, metavar="NODE.PARAM=VALUE", help="set a parameter"
    )
    parser.add_argument("--device", default="auto", choices=DEVICES, help="where kernels run (default: auto)")


def frames(text: str) -> range:
    """Parse ``A..B``, both shown."""
    found = re.fullmatch(r"(-?\d{1,9})\.\.(-?\d{1,9})", text.strip())
    if found is None or int(found[2]) < int(found[1]):
        raise argparse.ArgumentTypeError(f"{text!r} is not a range of frames such as 0..120")
    asked = range(int(found[1]), int(found[2]) + 1)
    if len(asked) > MAX_FRAMES:
        raise argparse.ArgumentTypeError(f"{text!r} is more than {MAX_FRAMES} frames")
    return asked


def _rate(text: str) -> int:
    if not text.isdigit() or not 1 <= int(text) <= 1000:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number of pictures a second, 1 to 1000")
    return int(text)


def run(arguments: argparse.Namespace) -> int:
    from nodegraph import film
    from nodegraph.animation import span_of, tracks_of
    from nodegraph.engine import Engine

    network = open_workspace(arguments.file, arguments.set)
    view = view_of(network, arguments.view)
    span = span_of(network)
    asked = arguments.frames if arguments.frames is not None else span.frames
    tracks = tracks_of(network)
    if arguments.turntable is not None:
        tracks = turned(network, view, tracks, asked, arguments.turntable)
    out = Path(arguments.out)
    if out.suffix.lower() in (".png", ".gif", ".avi", ".mov", ".mkv", ".webm"):
        raise UsageError(f"--out {arguments.out}: an animation is a folder of pictures, or a film that ends in .mp4")
    require_room(arguments.out, out.parent if out.suffix.lower() == film.FILM else out)
    rate = arguments.rate or span.rate
    with Engine(device=arguments.device) as engine, Progress() as progress:
        files = film.render(
            network,
            view,
            tracks,
            asked,
            out,
            engine=engine,
            size=arguments.size,
            rate=rate,
            on_frame=lambda done, count: progress.show(f"frame {done} of {count}", done / count),
        )
    for file in files:
        answer(str(file))
    if not tracks and "frame" not in network.variables:
        say(f"{arguments.file}: nothing in it moves, so all pictures are alike; try --turntable 360")
    return 0


def view_of(network: Network, named: str | None) -> str:
    """The one view to film. Raises UsageError where there is none, or several and none is named."""
    from nodegraph.pictures import views_of

    views = views_of(network.flatten(), [named] if named else None)
    if len(views) != 1:
        listed = f"there are {len(views)} ({', '.join(views)}); name one with --view" if views else "there is none"
        raise UsageError(f"an animation needs one view, and {listed}")
    return views[0]


def turned(network: Network, view: str, tracks: list[Track], asked: range, degrees: float) -> list[Track]:
    """The tracks with those of the cameras of a view replaced by an even turn. Raises UsageError without a camera."""
    from nodegraph import links
    from nodegraph.animation import shared_place, turntable
    from nodegraph.subjects import cameras_of

    cameras = cameras_of(network, view)
    if not cameras:
        raise UsageError(f"--turntable: nothing that {view} shows has a camera")
    places = {shared_place(network, camera) for camera in cameras}
    kept = [track for track in tracks if shared_place(network, track.target) not in places]
    turns = [turntable(camera, links.value_of(network, camera), asked[0], asked[-1], degrees) for camera in cameras]
    return kept + turns
