"""Run the benchmarks, print them, and write docs/performance.md."""

from __future__ import annotations

import datetime
import importlib
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.measure import Row, machine

FOLDER = Path(__file__).resolve().parent
PAGE = FOLDER.parents[1] / "docs" / "performance.md"
BEGIN, END = "<!-- measured: written by make bench -->", "<!-- end of what make bench writes -->"


def main(names: Sequence[str]) -> int:
    """Run all benchmarks or those named. Returns 1 where a figure is beyond its limit."""
    known = sorted(path.stem.removeprefix("bench_") for path in FOLDER.glob("bench_*.py"))
    unknown = [name for name in names if name not in known]
    if unknown:
        print(f"{unknown[0]}: no such benchmark; there are {', '.join(known)}", file=sys.stderr)
        return 2
    tables: dict[str, list[Row]] = {}
    for name in names or known:
        module = importlib.import_module(f"tests.benchmarks.bench_{name}")
        title = (module.__doc__ or name).split("\n", 1)[0].rstrip(".")
        print(f"\n{title}", flush=True)
        measured = tables[title] = []
        for row in module.rows():
            measured.append(row)
            print(_line(row), flush=True)
    if not names:
        write(tables)
    beyond = [row for rows in tables.values() for row in rows if not row.holds]
    print(f"\n{len(beyond)} beyond their limit" if beyond else "\nall within their limits")
    return 1 if beyond else 0


def _line(row: Row) -> str:
    limit = f"  at most {row.limit:g}{'' if row.holds else '  BEYOND'}" if row.limit is not None else ""
    return f"  {row.what:58} {row.value:9.3g} {row.unit:4}{limit}  {row.detail}"


def write(tables: dict[str, list[Row]]) -> None:
    """Put the figures between the two marks of docs/performance.md; the text around them stays."""
    parts = [f"Measured {datetime.date.today().isoformat()} on {machine()}."]
    for title, rows in tables.items():
        lines = ["| what | measured | at most | made of |", "| --- | --- | --- | --- |"]
        for row in rows:
            limit = f"{row.limit:g} {row.unit}" if row.limit is not None else ""
            lines.append(f"| {row.what} | {row.value:.3g} {row.unit} | {limit} | {row.detail} |")
        parts.append(f"## {title}\n\n" + "\n".join(lines))
    text = PAGE.read_text("utf-8")
    measured = f"{BEGIN}\n\n" + "\n\n".join(parts) + f"\n\n{END}"
    page, count = re.subn(re.escape(BEGIN) + ".*" + re.escape(END), lambda _: measured, text, flags=re.DOTALL)
    if count != 1:
        raise SystemExit(f"{PAGE}: the two marks of the measured part are missing")
    PAGE.write_text(page, "utf-8")
    print(f"\nwrote {PAGE}")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
