"""Measurements as JSON and CSV, for programs and spreadsheets."""

from __future__ import annotations

import csv
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nodegraph.accuracy.points import text
from nodegraph.formats.atomic import replacing
from nodegraph.params.parameter import json_float

if TYPE_CHECKING:
    from nodegraph.accuracy.points import Measured, Point, ReferenceNote

COSTS = ("seconds", "device_seconds", "prepare_seconds", "bytes")


def document(measured: Measured) -> dict[str, Any]:
    """A measurement as JSON; inf and nan as text, as everywhere."""
    return {
        "name": measured.name,
        "view": measured.view,
        "size": list(measured.size) if measured.size else None,
        "repeats": measured.repeats,
        "error": measured.error,
        "units": dict(measured.units),
        "timed": list(measured.timed),
        "devices": dict(measured.devices),
        "machine": measured.machine,
        "references": [_reference(note) for note in measured.references],
        "points": [_point(point) for point in measured.points],
        "notes": list(measured.notes),
    }


def _reference(note: ReferenceNote) -> dict[str, Any]:
    return {
        "settings": dict(note.settings),
        "summary": note.summary,
        "converged": note.converged,
        "difference": json_float(note.difference),
        "bound": json_float(note.bound),
        "rounds": note.rounds,
        "left_out": note.left_out,
        "failure": note.failure,
        "notes": list(note.notes),
    }


def _point(point: Point) -> dict[str, Any]:
    return {
        "settings": dict(point.settings),
        "device": point.device,
        "front": point.front,
        "seconds": json_float(point.seconds),
        "device_seconds": json_float(point.device_seconds),
        "prepare_seconds": json_float(point.prepare_seconds),
        "runs": list(point.runs),
        "bytes": point.bytes,
        "errors": {name: json_float(error) for name, error in point.errors.items()},
        "reference": point.reference,
        "failure": point.failure,
        "notes": list(point.notes),
    }


def write_json(measured: Measured, path: str | os.PathLike[str]) -> None:
    """Write `document`. Raises FormatError where the file cannot be written."""
    with replacing(path) as part:
        part.write_text(json.dumps(document(measured), indent=1) + "\n", encoding="utf-8")


def write_csv(measured: Measured, path: str | os.PathLike[str]) -> None:
    """Write one line for each point: settings, device, costs, errors, front, failure. Raises FormatError."""
    with replacing(path) as part, open(part, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*measured.places, "device", *COSTS, *measured.figures, "front", "failure"])
        for point in measured.points:
            failed = not point.runs
            writer.writerow(
                [
                    *(text(point.settings[place]) if place in point.settings else "" for place in measured.places),
                    point.device,
                    *("" if failed else getattr(point, cost) for cost in COSTS),
                    *(point.errors.get(figure, "") for figure in measured.figures),
                    "yes" if point.front else "no",
                    point.failure,
                ]
            )


def write_all(measured: Measured, folder: str | os.PathLike[str]) -> list[Path]:
    """Write measure.json, measure.csv, measure.html, and measure.png where matplotlib is there; return their paths.

    Makes the folder. Raises FormatError where it cannot be written.
    """
    from nodegraph.accuracy.report_html import write_html
    from nodegraph.accuracy.report_plot import can_plot, write_plot
    from nodegraph.formats import make_folder

    folder = Path(folder)
    make_folder(folder)
    writers = {"measure.json": write_json, "measure.csv": write_csv, "measure.html": write_html}
    if can_plot():
        writers["measure.png"] = write_plot
    for name, write in writers.items():
        write(measured, folder / name)
    return [folder / name for name in writers]
