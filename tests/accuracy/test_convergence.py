"""The error of each integrator falls with its step as theory says: docs/decisions/0007-rays.md, the table.

Double precision, so that rounding is far below. The cases, and what is compared, are in tests/support/convergence.py.
"""

from __future__ import annotations

import pytest

from tests.support.convergence import CASES, FIELDS, error, errors, order

WITHIN = 0.2
ADAPTIVE = {"integrator": "adaptive"}


@pytest.mark.parametrize("what", FIELDS)
@pytest.mark.parametrize("case", CASES, ids=[case.name.replace(", ", "-").replace(" ", "-") for case in CASES])
def test_the_order_of_convergence_is_that_of_theory(cl64, case, what):
    """Checks: Rezk-Salama 2001, X12: a table over pairs of values keeps its order where the transfer function jumps."""
    steps, found = errors(case, what, cl64)
    assert (found[1:] < found[:-1]).all()
    assert order(steps, found) == pytest.approx(case.order[what], abs=WITHIN)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-5, 1e-6])
@pytest.mark.parametrize("segments", [4, 16])
@pytest.mark.parametrize("what", FIELDS)
def test_adaptive_errs_by_the_tolerance_at_most(cl64, what, segments, tolerance):
    """Against a closed form, where all is smooth as where the transfer function jumps. The worst pixel counts."""
    assert error(ADAPTIVE | {"tolerance": tolerance}, what, segments, cl64, worst=True) <= tolerance


@pytest.mark.parametrize("what", FIELDS)
def test_adaptive_keeps_its_tolerance_in_single_precision(device, what):
    for tolerance in (1e-2, 1e-3, 1e-4, 1e-5):
        assert error(ADAPTIVE | {"tolerance": tolerance}, what, 4, device, worst=True) <= tolerance
