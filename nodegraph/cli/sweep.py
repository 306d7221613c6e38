"""Run a workspace once for every combination of some parameters' values.

Each task has a folder of its own under OUT, named after its values, with the pictures of the views. Run the command
again to go on after an interruption: finished tasks are skipped. Example:

    nodegraph sweep first_light.json --vary raycast.step=0.25..2:8 --vary raycast.lit=on,off --out steps
"""

from __future__ import annotations

import argparse
import itertools

from nodegraph.cli import many
from nodegraph.cli.arguments import UsageError, variation
from nodegraph.cli.opening import open_workspace

MOST = 100_000


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="workspace (.json), or a picture (.png, .exr) that carries one")
    parser.add_argument(
        "--vary",
        action="append",
        required=True,
        type=variation,
        metavar="NODE.PARAM=A..B:N",
        help="n values from a to b, or a list a,b,c; repeated: all combinations",
    )
    many.add_options(parser)


def run(arguments: argparse.Namespace) -> int:
    places = [place for place, _ in arguments.vary]
    twice = next((place for place in places if places.count(place) > 1), "")
    if twice:
        raise UsageError(f"--vary {twice}: named twice; list all its values in one place")
    rows = list(itertools.islice(itertools.product(*(values for _, values in arguments.vary)), MOST + 1))
    if len(rows) > MOST:
        raise UsageError(f"--vary: more than {MOST} combinations; vary less at a time")
    labels = [",".join(f"{place}={value}" for place, value in zip(places, row, strict=True)) for row in rows]
    variants = [
        many.Variant(name, tuple(zip(places, row, strict=True)))
        for name, row in zip(many.names_of(labels), rows, strict=True)
    ]
    return many.run_variants(arguments, open_workspace(arguments.file, arguments.set), variants)
