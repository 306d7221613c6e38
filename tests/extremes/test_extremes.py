"""Each extreme on each device keeps its bound, and stands on the page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from tests.extremes.all import CASES
from tests.extremes.case import Case
from tests.extremes.refusals import REFUSALS

pytestmark = pytest.mark.slow

QUICK = ("midpoint", "preintegrated", "cellwise")
"""By samples, by tables and by roots: the other integrators are relatives of one of these."""
RUNS = [
    pytest.param(case, params, marks=() if params.get("integrator", QUICK[0]) in QUICK else pytest.mark.slow)
    for case in CASES
    for params in case.runs()
]
PAGE = Path(__file__).resolve().parents[2] / "docs" / "extremes.md"


def name(part: Any) -> str:
    return str(part) if isinstance(part, Case) else "-".join(part.values())


@pytest.mark.parametrize(("case", "params"), RUNS, ids=name)
def test_an_extreme_keeps_its_bound(device: Any, case: Case, params: dict[str, str]) -> None:
    error = case.measure(device, params)
    if error is None:
        # Said in one sentence, upon which the engine turns to OpenCL, where the same case is held to its bound.
        assert device.name == "gl"
    else:
        assert error <= case.bound(device, params), f"{case}: {error:.3g} {case.unit}"


def test_every_extreme_stands_once_on_the_page() -> None:
    lines = PAGE.read_text("utf-8").splitlines()
    cells = [f"| {case.extreme} | {case.happens} |" for case in CASES] + [f"| {r.extreme} |" for r in REFUSALS]
    missing = [cell for cell in cells if not any(line.startswith(cell) for line in lines)]
    assert missing == [], "run python -m tests.extremes"
    assert len({(case.topic, case.extreme) for case in CASES}) == len(CASES)
