"""Read a data file and write it in the format that the suffix of OUT names."""

from __future__ import annotations

import argparse

from nodegraph.cli.arguments import UsageError
from nodegraph.cli.terminal import answer


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("source", metavar="IN", help="file to read")
    parser.add_argument("target", metavar="OUT", help="file to write")
    parser.add_argument("--labels", action="store_true", help="read ids of a segmentation instead of values")
    parser.add_argument("--time", type=int, metavar="STEP", help="which step of a series over time, from 0")


def run(arguments: argparse.Namespace) -> int:
    from nodegraph import formats

    # Both suffixes are judged before anything is read: reading may take minutes.
    formats.find(arguments.source)
    if not hasattr(formats.find(arguments.target), "write"):
        raise UsageError(
            f"{arguments.target}: this format is only read; choose {', '.join(formats.suffixes(write=True))}"
        )
    options = {} if arguments.time is None else {"time": arguments.time}
    value = (formats.read_labels if arguments.labels else formats.read)(arguments.source, **options)
    formats.write(value, arguments.target)
    answer(arguments.target)
    return 0
