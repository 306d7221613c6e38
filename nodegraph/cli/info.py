"""Describe a data file from its header, or say what a workspace holds and whether it could run."""

from __future__ import annotations

import argparse
import json
import os
from typing import Any

from nodegraph.cli.opening import open_workspace
from nodegraph.cli.terminal import answer


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="data file, picture or workspace")
    parser.add_argument("--json", action="store_true", help="print one JSON document")


def run(arguments: argparse.Namespace) -> int:
    suffix = os.path.splitext(arguments.file)[1].lower()
    told: dict[str, Any] = {}
    if suffix != ".json":
        from nodegraph import formats

        told |= formats.info(arguments.file)
        if "index_to_world" in told and "size" in told:
            told |= _place(told["size"], told["index_to_world"])
    if suffix == ".json" or told.get("workspace"):
        told |= _workspace(arguments.file)
    if arguments.json:
        answer(json.dumps(told, indent=1))
        return 0
    width = max(map(len, told))
    for name, value in told.items():
        if isinstance(value, dict):
            answer(f"{name}:")
            for inner, text in value.items():
                answer(f"  {inner}: {text}")
        else:
            answer(f"{name:{width}}  {_plain(value)}")
    return 0


def _place(size: list[int], index_to_world: list[list[float]]) -> dict[str, Any]:
    """Where the outer corners of a grid lie in the world, mm: what one needs to know to set up a camera."""
    low, high = [], []
    for *axes, origin in index_to_world[:3]:
        ends = [sorted((-0.5 * step, (count - 0.5) * step)) for step, count in zip(axes, size, strict=True)]
        low.append(origin + sum(least for least, _ in ends))
        high.append(origin + sum(greatest for _, greatest in ends))
    return {"world_min": low, "world_max": high}


def _plain(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, (list, tuple)):
        return " ".join(map(_plain, value))
    return str(value)


def _workspace(file: str) -> dict[str, Any]:
    from nodegraph.requests import default_sinks

    network = open_workspace(file)
    flat = network.flatten()
    told: dict[str, Any] = {"workspace": file, "nodes": {path: node.type for path, node in flat.nodes.items()}}
    if network.variables:
        told["variables"] = {name: variable.kind for name, variable in network.variables.items()}
    told["views and effects"] = default_sinks(flat)
    problems = {path: str(node.problem) for path, node in flat.nodes.items() if node.problem is not None}
    if problems:
        told["problems"] = problems
    return told
