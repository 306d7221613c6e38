"""List the devices of this machine with drivers and limits, what is missing and which package brings it.

With --require the exit code is 2 where a named device is missing: the line to put first into a job script.
"""

from __future__ import annotations

import argparse
import json
import platform
from typing import TYPE_CHECKING, Any

from nodegraph.cli.arguments import DEVICES
from nodegraph.cli.terminal import answer, say
from nodegraph.errors import DeviceMissing

if TYPE_CHECKING:
    from nodegraph.compute.survey import Finding

_BYTES = ("B", "KiB", "MiB", "GiB", "TiB")


def configure(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--require", action="append", default=[], choices=DEVICES[1:], metavar="DEVICE", help="gl, cl or cl64"
    )
    parser.add_argument("--quiet", action="store_true", help="say only what is required and missing")
    parser.add_argument("--json", action="store_true", help="print one JSON document")


def run(arguments: argparse.Namespace) -> int:
    from nodegraph.compute import survey

    findings = survey()
    if arguments.json:
        answer(json.dumps(_document(findings), indent=1))
    elif not arguments.quiet:
        answer("\n".join(_lines(findings)))
    for name in arguments.require:
        if not any(finding.available for finding in findings if finding.name == name):
            lacking = next(finding for finding in findings if finding.name == name)
            say(f"{lacking.description}{_cure(lacking)}")
            return DeviceMissing.exit_code
    return 0


def _document(findings: list[Finding]) -> dict[str, Any]:
    from dataclasses import asdict

    import nodegraph
    from nodegraph import registry

    broken = {entry["id"]: entry["unavailable"] for entry in registry.catalogue() if "unavailable" in entry}
    return {
        "nodegraph": nodegraph.__version__,
        "python": platform.python_version(),
        "platform": platform.platform(),
        "devices": [asdict(finding) for finding in findings],
        "unavailable": broken,
    }


def _lines(findings: list[Finding]) -> list[str]:
    told = _document(findings)
    lines = [f"nodegraph {told['nodegraph']}, Python {told['python']}, {told['platform']}", ""]
    for finding in findings:
        mark = "ready" if finding.chosen else "also there" if finding.available else "missing"
        kind = "hardware" if finding.hardware else "software"
        lines.append(
            f"{finding.name:5} {mark:10} {f'{finding.description}, {kind}' if finding.available else ''}".rstrip()
        )
        if not finding.available:
            lines.append(f"      {finding.description}{_cure(finding)}")
        for name, value in finding.limits.items():
            lines.append(f"      {name}: {_limit(name, value)}")
        lines += [f"      {note}" for note in finding.notes]
    for id, reason in told["unavailable"].items():
        lines.append(f"processor {id} is unavailable: {reason}")
    return lines


def _cure(finding: Finding) -> str:
    return f" ({finding.cure})" if finding.cure and finding.cure not in finding.description else ""


def _limit(name: str, value: Any) -> str:
    if not name.endswith("bytes") or not isinstance(value, int):
        return str(value)
    power = 0
    while value >= 1024 ** (power + 1) and power < len(_BYTES) - 1:
        power += 1
    return f"{value / 1024**power:.4g} {_BYTES[power]}"
