"""Run a workspace once for each of many data files.

Each file takes the place of the one that the workspace reads, and has a folder of its own under OUT with the pictures
of the views. Where the workspace reads several files, --into says which one. Run the command again to go on after an
interruption: finished tasks are skipped unless their file has changed. Example:

    nodegraph batch chest.json --over study/*.nii.gz --out pictures
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from nodegraph.cli import many
from nodegraph.cli.arguments import UsageError
from nodegraph.cli.opening import open_workspace

if TYPE_CHECKING:
    from nodegraph.network import Network


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="workspace (.json), or a picture (.png, .exr) that carries one")
    parser.add_argument("--over", nargs="+", required=True, metavar="FILES", help="data files, one task each")
    parser.add_argument("--into", metavar="NODE.PARAM", help="the parameter that takes the files")
    many.add_options(parser)


def run(arguments: argparse.Namespace) -> int:
    network = open_workspace(arguments.file, arguments.set)
    place = arguments.into or only_file(network)
    files = [os.path.abspath(file) for file in dict.fromkeys(arguments.over)]
    missing = next((file for file in files if not os.path.exists(file)), "")
    if missing:
        raise UsageError(f"--over {missing}: there is no such file")
    variants = [
        many.Variant(name, ((place, file),), (file,))
        for name, file in zip(many.names_of(labels_of(files)), files, strict=True)
    ]
    return many.run_variants(arguments, network, variants)


def labels_of(files: list[str]) -> list[str]:
    """Names of files without their suffixes; with their folder where two are alike."""
    stems = [Path(file).name.split(".", 1)[0] or Path(file).name for file in files]
    return [
        f"{Path(file).parent.name}_{stem}" if stems.count(stem) > 1 else stem
        for file, stem in zip(files, stems, strict=True)
    ]


def only_file(network: Network) -> str:
    """The one parameter of the workspace that names a file to read. Raises UsageError where there are more or none."""
    found = [
        f"{path}.{name}"
        for path, node in network.flatten().nodes.items()
        if node.processor is not None
        for name in node.values
        if node.processor.params[name].kind in ("File", "Folder")
        and not getattr(node.processor.params[name], "write", False)
    ]
    if not found:
        raise UsageError("--over: the workspace reads no file")
    if len(found) > 1:
        raise UsageError(f"--over: the workspace reads {len(found)} files; say --into {' or --into '.join(found)}")
    return found[0]
