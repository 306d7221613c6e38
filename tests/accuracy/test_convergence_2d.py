"""The error of each integrator by value and gradient magnitude falls with its step as theory says.

Double precision, so that rounding is far below. The cases are in tests/support/convergence_2d.py: closed forms but for
one quadrature in numpy, which share nothing with the kernels.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.convergence import FIELDS
from tests.support.convergence_2d import CASES, error, errors, exact

WITHIN = 0.2


@pytest.mark.parametrize("what", FIELDS)
@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_the_order_of_convergence_is_that_of_theory(cl64, case, what):
    steps, found = errors(case, what, cl64)
    order = float(np.polyfit(np.log(steps), np.log(found), 1)[0])
    assert order == pytest.approx(case.order[what], abs=WITHIN), found


@pytest.mark.parametrize("order", [1, 2, 8])
@pytest.mark.parametrize("what", FIELDS)
def test_cellwise_is_exact_whatever_the_order(cl64, what, order):
    """Parts are halved until they agree, so that a low order takes longer, and nothing else. The worst pixel counts."""
    assert np.ptp(exact(what)) > 0.5
    assert error({"integrator": "cellwise", "order": order}, what, 1, cl64, worst=True) <= 3e-6


@pytest.mark.parametrize("what", FIELDS)
def test_cellwise_is_exact_in_single_precision_too(device, what):
    assert error({"integrator": "cellwise", "order": 3}, what, 1, device, worst=True) <= 3e-6


@pytest.mark.parametrize("what", FIELDS)
def test_adaptive_errs_by_the_tolerance_at_most(device, what):
    for segments in (4, 16):
        for tolerance in (1e-2, 1e-3, 1e-4, 1e-5):
            params = {"integrator": "adaptive", "tolerance": tolerance}
            assert error(params, what, segments, device, worst=True) <= tolerance
