"""The error of each integrator falls with its step as theory says: docs/decisions/0007-rays.md, the table.

Double precision, so that rounding is far below. The cases, and what is compared, are in tests/support/convergence.py.
"""

from __future__ import annotations

import pytest

from tests.support.convergence import CASES, FIELDS, error, errors, order

WITHIN = 0.2
ADAPTIVE = {"integrator": "adaptive", "pair_table_size": 511}


@pytest.mark.parametrize("what", FIELDS)
@pytest.mark.parametrize("case", CASES, ids=[case.name.replace(", ", "-").replace(" ", "-") for case in CASES])
def test_the_order_of_convergence_is_that_of_theory(cl64, case, what):
    """Checks: Rezk-Salama 2001, X12: a table over pairs of values keeps its order where the transfer function jumps."""
    steps, found = errors(case, what, cl64)
    assert (found[1:] < found[:-1]).all()
    assert order(steps, found) == pytest.approx(case.order[what], abs=WITHIN)


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, 1e-4, 1e-5])
@pytest.mark.parametrize("segments", [4, 16])
def test_adaptive_errs_by_the_tolerance_at_most(cl64, segments, tolerance):
    """Where all is smooth, and the table is nearly exact. The worst pixel counts."""
    assert error(ADAPTIVE | {"tolerance": tolerance}, "smooth", segments, cl64, worst=True) <= tolerance


def test_adaptive_keeps_its_tolerance_at_a_jump_down_to_what_the_table_knows_of_it(cl64):
    """Parts shorter than a row of the table see the jump as a ramp one row wide, so that its place errs by half a row.
    That is the floor, and a table twice as fine halves it."""
    assert error(ADAPTIVE | {"tolerance": 1e-2}, "discontinuous", 4, cl64, worst=True) <= 1e-2
    floors = [
        error(ADAPTIVE | {"tolerance": 1e-6, "pair_table_size": rows}, "discontinuous", 4, cl64, worst=True)
        for rows in (127, 255, 509)
    ]
    assert floors[0] / floors[1] == pytest.approx(2.0, abs=0.2)
    assert floors[1] / floors[2] == pytest.approx(2.0, abs=0.2)
