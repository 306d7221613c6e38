"""The measured error of what was rendered, as a sentence and as JSON: what `run --error` tells."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.accuracy.reference import Reference
    from nodegraph.accuracy.running import Show
    from nodegraph.network import Network
    from nodegraph.report import Report

_WORDS = {"max": "max", "rmse": "RMSE", "psnr": "PSNR", "p999": "99.9 percentile"}


def measured(
    network: Network, report: Report, views: Sequence[str], size: tuple[int, int] | None, show: Show
) -> tuple[dict[str, dict[str, Any]], list[str], int]:
    """Errors of what the views showed: JSON by view, a sentence for each, and the exit code of the worst failure.

    A view that failed has nothing to be measured; one whose reference or measure fails says why.
    """
    from nodegraph.accuracy.measures import errors, measure_of
    from nodegraph.accuracy.reference import reference

    told: dict[str, dict[str, Any]] = {}
    sentences: list[str] = []
    code = 0
    for view in views:
        shown = report.shown.get(view, {})
        for output, value in shown.items():
            name = view if len(shown) == 1 else f"{view}.{output}"
            try:
                found = reference(network, name, size, show=show)
                # Where no pixel converged there is nothing to look at but the whole, wrong as the reference may be.
                mask = found.mask if found.mask is not None and found.mask.any() else None
                figures = errors(value, found.value, mask)
            except GraphError as error:
                told[name] = {"error": str(error)}
                sentences.append(f"{name}: its error is not known: {error}")
                code = max(code, error.exit_code)
                continue
            told[name] = {**as_json(figures), "left_out": found.share_left_out, "reference": reference_json(found)}
            sentences.append(sentence(name, figures, measure_of(value).units, found))
    return told, sentences, code


def sentence(name: str, figures: Mapping[str, float], units: Mapping[str, str], found: Reference) -> str:
    """``view: max 0.0021, RMSE 0.00012, ... against a reference in 3 rounds, ...``"""
    listed = ", ".join(
        f"{_WORDS.get(figure, figure)} {number:.3g}{' ' + units[figure] if figure in units else ''}"
        for figure, number in figures.items()
    )
    left_out = f", {100 * found.share_left_out:.3g} % left out" if found.mask is not None else ""
    if found.share_left_out == 1.0:
        left_out = ", nothing left out although nothing converged"
    notes = "".join(f"; {note}" for note in found.notes)
    return f"{name}: error {listed}{left_out}; {found.summary()}{notes}"


def reference_json(found: Reference) -> dict[str, Any]:
    """What ``--json`` tells of a reference."""
    return {
        "converged": found.converged,
        "rounds": found.rounds,
        "difference": number_json(found.difference),
        "bound": found.bound,
        "left_out": found.left_out,
        "settings": dict(found.settings),
        "notes": list(found.notes),
        "kept": found.kept,
    }


def as_json(figures: Mapping[str, float]) -> dict[str, float | str]:
    return {name: number_json(number) for name, number in figures.items()}


def number_json(number: float) -> float | str:
    """JSON has no inf and no nan; they are text."""
    return number if math.isfinite(number) else str(number)
