"""Write a working processor and a test of it, ready to be changed.

NAME is category.name, for example filter.sharpen. The files go into FOLDER, which may then be named in NODEGRAPH_PATH.
"""

from __future__ import annotations

import argparse

from nodegraph.cli.terminal import answer


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("what", choices=("processor",), help="what to write")
    parser.add_argument("name", metavar="NAME", help="category.name of the processor")
    parser.add_argument("--folder", default=".", metavar="FOLDER", help="plug-in folder (default: the current one)")
    parser.add_argument("--glsl", action="store_true", help="a kernel alone, without Python")


def run(arguments: argparse.Namespace) -> int:
    from nodegraph import scaffold

    for path in scaffold.new_processor(arguments.name, arguments.folder, glsl=arguments.glsl):
        answer(str(path))
    return 0
