"""Measure every extreme on every device and write docs/extremes.md: `python -m tests.extremes`."""

from __future__ import annotations

import datetime
import itertools
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tests.extremes.all import CASES
from tests.extremes.case import Case, offered
from tests.extremes.refusals import COMMANDS, REFUSALS

PAGE = Path(__file__).resolve().parents[2] / "docs" / "extremes.md"
DEVICES = ("gl", "cl", "cl64")

BEGIN = "<!-- measured: written by python -m tests.extremes -->"
END = "<!-- end of what python -m tests.extremes writes -->"

REFUSED = """## Refused

What has no picture is refused in one sentence that names the place, before anything runs.

| extreme | what is said |
|---|---|
"""

ON_THE_COMMAND_LINE = """
On the command line the same, with exit code 2 and nothing written.

| `nodegraph run tiny.json` with | says |
|---|---|
"""


def measured(case: Case, device: Any) -> tuple[str, bool]:
    """The greatest error over the integrators with the name of the worst, and whether all keep their bounds."""
    worst, whose, held = -1.0, "", True
    for params in case.runs():
        error = case.measure(device, params)
        if error is not None:
            held = held and error <= case.bound(device, params)
            if error > worst:
                worst, whose = error, params.get("integrator", "")
    if worst < 0.0:
        return "refused", True
    named = f" {whose}" if len(case.runs()) > 1 and worst > 0.0 else ""
    return f"{worst:.1e}{named}" if worst > 0.0 else "0", held


def tables(devices: Iterable[Any]) -> tuple[list[str], list[str]]:
    """The tables, one for each topic, and what is beyond its bound."""
    opened = list(devices)
    lines, beyond = [], []
    for topic, cases in itertools.groupby(CASES, key=lambda case: case.topic):
        lines += [f"\n## {topic}\n", f"| extreme | what happens | {' | '.join(f'`{name}`' for name in DEVICES)} | of |"]
        lines.append("|" + "---|" * (len(DEVICES) + 3))
        for case in cases:
            cells = []
            for device in opened:
                text, held = measured(case, device)
                cells.append(text)
                if not held:
                    beyond.append(f"{case.topic}: {case.extreme}: {text} on {device.name}")
            lines.append(f"| {case.extreme} | {case.happens} | {' | '.join(cells)} | {case.unit} |")
    return lines, beyond


def refused() -> list[str]:
    """The table of what is refused, with the sentences as they are said."""
    lines = [REFUSED.rstrip()]
    for refusal in REFUSALS:
        try:
            refusal.make()
        except Exception as error:
            lines.append(f"| {refusal.extreme} | {error} |")
    lines.append(ON_THE_COMMAND_LINE.rstrip())
    for command in COMMANDS:
        arguments = " ".join(f"'{part}'" if " " in part else part for part in command.arguments)
        lines.append(f"| `{arguments}` | ... {command.said} ... |")
    return lines


def write(measured: str) -> None:
    """Put the tables between the two marks of the page; the text before them stays."""
    text = PAGE.read_text("utf-8")
    before, _, rest = text.partition(BEGIN)
    _, mark, after = rest.partition(END)
    if not mark:
        raise SystemExit(f"{PAGE}: the two marks of the measured part are missing")
    PAGE.write_text(f"{before}{BEGIN}\n{measured}\n\n{END}{after}", "utf-8")
    print(f"wrote {PAGE}")


def main() -> int:
    """Write the page; 1 where something is beyond its bound."""
    from nodegraph.compute import Devices

    devices = Devices()
    try:
        opened = [devices.choose(name).device for name in DEVICES]
        rows, beyond = tables(opened)
        names = ", ".join(offered()) or "midpoint"
        drivers = "; ".join(f"{device.name}: {device.description}" for device in opened)
        told = f"\nMeasured {datetime.date.today().isoformat()} on {drivers}. Integrators: {names}."
    finally:
        devices.close()
    write("\n".join([told, *rows, "", *refused()]))
    for line in beyond:
        print(f"beyond its bound: {line}", file=sys.stderr)
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
