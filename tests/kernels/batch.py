"""Many small cases in one kernel: a program costs about a second to build on OpenCL, a case nothing.

Row k of the picture is case k, column i is input i. A case is a function body in the kernel language that makes a
vec4 of two input vectors ``v`` and ``w`` and the column ``i``; its expectation is the same in numpy, in double.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from nodegraph.shaders import Source

COLUMNS = 24


@dataclass(frozen=True)
class Case:
    """``expect(v, w, i)`` takes (4, n), (4, n) and (n,) arrays and returns up to four rows, those that are compared."""

    name: str
    body: str
    expect: Callable[[Any, Any, Any], Sequence[Any]]
    tolerance: float = 4e-6

    def __str__(self) -> str:
        return self.name


def inputs() -> np.ndarray:
    """Return a (2, n, 4) float32 image: numbers of both signs, halves, zeros and whole numbers among them."""
    rng = np.random.default_rng(2)
    values = rng.uniform(-4.0, 4.0, (2, COLUMNS, 4)).astype(np.float32)
    values[0, 0] = (0.0, 1.0, -1.0, 0.5)
    values[0, 1] = (-0.5, 1.5, -1.5, 2.5)
    values[0, 2] = (2.0, 3.0, -2.0, -3.0)
    values[1, :3] = (1.0, 2.0, -2.0, 0.25)
    return values


def source(cases: Sequence[Case], shared: str = "") -> Source:
    """Return the kernel that runs all cases."""
    functions = "\n".join(f"vec4 case_{k}(vec4 v, vec4 w, int i) {{\n{case.body}\n}}" for k, case in enumerate(cases))
    calls = "\n".join(f"    if (at.y == {k}) return case_{k}(v, w, at.x);" for k in range(len(cases)))
    return Source.of(
        f"{shared}\nfield2 inputs;\n{functions}\nvec4 pixel(ivec2 at) {{\n"
        "    vec4 v = fetch2(inputs, ivec2(at.x, 0));\n    vec4 w = fetch2(inputs, ivec2(at.x, 1));\n"
        f"{calls}\n    return vec4(0.0);\n}}\n",
        "cases.glsl",
    )


class Results:
    """What each device made of a list of cases; run once per device."""

    def __init__(self, cases: Sequence[Case], shared: str = "", **bindings: Any) -> None:
        self.cases = list(cases)
        self.source = source(cases, shared)
        self.bindings = bindings
        self.rows: dict[str, np.ndarray] = {}

    def check(self, device: Any, case: Case) -> None:
        """Assert that the device agrees with numpy about one case."""
        if device.name not in self.rows:
            size = (COLUMNS, len(self.cases))
            self.rows[device.name] = device.run(self.source, size, inputs=inputs(), **self.bindings).array
        got = self.rows[device.name][self.cases.index(case)].T
        v, w = inputs().astype(np.float64).transpose(0, 2, 1)
        with np.errstate(all="ignore"):
            wanted = case.expect(v, w, np.arange(COLUMNS))
        assert 1 <= len(wanted) <= 4
        tolerance = case.tolerance if device.real == np.float32 else 1e-11
        for row, expected in zip(got, wanted, strict=False):
            expected = np.broadcast_to(np.asarray(expected, np.float64), row.shape)
            np.testing.assert_allclose(row, expected, rtol=tolerance, atol=tolerance, err_msg=case.body)
