"""Which integrators the ray-caster offers, and how wrong each of them may be: bounds that follow from error terms.

A rule that is exact for straight lines errs by at most K V for a function whose slope varies by V in all (the sum of
its kinks, and the integral of |f''| between), where K is the greatest value of its Peano kernel: what is left of
(t - x)_+ on a segment, h^2 / 8 for one point in the middle and for the two ends. So no smoothness is taken for granted,
and a trilinear field, which has a kink at every cell face, is within the bound.
"""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph import registry

_offered = registry.find("render.raycast").params
INTEGRATORS = tuple(_offered["integrator"].choices) if "integrator" in _offered else ("midpoint",)
TOLERANCE = 1e-4
"""What `adaptive` is asked for."""
PAIRS = 64
"""Rows and columns of the table over pairs of values: fewer than by default, since each case makes its own."""
NODES = {
    "midpoint": ([0.0], [2.0]),
    "trapezoid": ([-1.0, 1.0], [1.0, 1.0]),
    "preintegrated": ([-1.0, 1.0], [1.0, 1.0]),  # taken for linear in between
    "gauss2": np.polynomial.legendre.leggauss(2),
    "gauss3": np.polynomial.legendre.leggauss(3),
}

each = pytest.mark.parametrize("integrator", INTEGRATORS)


def params(integrator, step, **more):
    """Parameters of the ray-caster: one integrator, ``step`` in voxels, all of every ray, no light."""
    chosen = {"step": step, "termination": 1.0, "lit": False} | more
    if "integrator" in _offered:
        chosen["integrator"] = integrator
    if integrator == "adaptive":
        chosen["tolerance"] = TOLERANCE
    if integrator == "preintegrated" and "pair_table_size" in _offered:
        chosen["pair_table_size"] = PAIRS
    return chosen


def kernel(integrator):
    """Greatest value of the Peano kernel of a rule for lines, in units of h^2; 0 for rules that cut at every kink."""
    if integrator not in NODES:
        return 0.0
    nodes, weights = (np.asarray(part, np.float64) for part in NODES[integrator])
    x = np.linspace(-1.0, 1.0, 2001)
    left = (1 - x) ** 2 / 2 - (weights * np.maximum(nodes - x[:, None], 0.0)).sum(axis=1)
    return float(np.abs(left).max()) / 4


def line_error(integrator, h, variation):
    """Bound on the error of an integral over segments of length h of a function whose slope varies by ``variation``."""
    return kernel(integrator) * h**2 * variation + (TOLERANCE if integrator == "adaptive" else 0.0)


def cut_error(integrator, h, slope):
    """Bound on what the two cut segments at the ends add. Only the midpoint of the lattice is no middle of what is left
    of its segment: of a length s it is off by (h - s) / 2, which costs slope s (h - s) / 2 <= slope h^2 / 8."""
    return 2 * slope * h**2 / 8 if integrator == "midpoint" else 0.0


def jump_error(integrator, h, jump, cell):
    """Bound where the function itself jumps, within a segment: a rule can give the jump a place that is wrong by h.

    Pre-integration knows the place, up to a ``cell`` (mm of the ray) of its table of values; so do rules that cut
    there. All others read a table as well."""
    if integrator == "cellwise":
        return jump * 2.0**-22  # the place is found by up to 24 halvings of a cell
    if integrator == "adaptive":
        return TOLERANCE
    return jump * (cell if integrator == "preintegrated" else h + cell)


def rounding(device, size=1.0):
    """Of a sum of numbers up to ``size`` on a device: 16 units in the last place of single precision, 1e4 of double."""
    return size * (1e-12 if device.name == "cl64" else 16 * 2.0**-24 + 1.5e-6)


def row(integrator, span):
    """Distance of two rows of the table that an integrator reads, where ``span`` is the range of its values."""
    if integrator == "preintegrated":
        return span / (PAIRS - 1)
    return span / ((_offered["table_size"].default if "table_size" in _offered else 2048) - 1)


def table_error(integrator, length, span, bend):
    """Bound on what a table adds to an optical depth over ``length``: between two rows a bend of the transfer function
    (change of its slope) is cut off, by at most a quarter of a row; over pairs, at the front and at the back."""
    if integrator in ("cellwise", "adaptive"):
        return 0.0
    ends = 2 if integrator == "preintegrated" else 1
    return length * ends * bend * row(integrator, span) / 4
