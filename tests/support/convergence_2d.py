"""How fast the error of an integrator falls with its step where value and gradient magnitude decide what is seen.

The rays, the field and the interval are those of tests/support/convergence.py: one cell, no segment is cut. The value
along a ray is a cubic there, and the magnitude of differences over two voxels the root of a polynomial without a zero.
The smooth transfer function is bilinear over what the rays meet, so that a table of it is exact; the other has an edge
that is not soft and stands askew.
"""

from __future__ import annotations

import functools

import numpy as np
from scipy import optimize

from nodegraph.data import Image, TransferFunction2D, Trapezoid
from tests.support.calls import call
from tests.support.closed_forms import rays
from tests.support.convergence import ACROSS, CORNERS, FIELDS, LENGTH, SIDE, SIZE, START, Case, grid

GREEN, ROSE = (0.1, 0.9, 0.4), (0.9, 0.2, 0.5)
SLOPES = [
    Trapezoid.rectangle((0.0, 2.0), (0.0, 0.1), GREEN, 0.3, 1.0),  # rises with the value; falls with the magnitude
    Trapezoid.rectangle((-1.0, 1.0), (0.005, 0.205), ROSE, 0.4, 1.0),  # the other way round
]
EDGE = Trapezoid((0.42, 1.0), (0.72, 1.0), (0.0, 0.06), 0.0, (0.2, 0.4, 0.9), 0.35)
FUNCTIONS = {"smooth": TransferFunction2D(SLOPES), "discontinuous": TransferFunction2D([*SLOPES, EDGE])}


def _case(name, smooth, jumping, counts, jumping_counts=(4, 8, 16, 32, 64, 128), **params):
    params = {"integrator": name, "table_size": 2048, **params}
    orders = {"smooth": smooth, "discontinuous": jumping}
    return Case(name, params, orders, {"smooth": counts, "discontinuous": jumping_counts})


CASES = (
    _case("midpoint", 2, 1, (8, 16, 32, 64, 128)),
    _case("trapezoid", 2, 1, (8, 16, 32, 64, 128)),
    _case("preintegrated", 2, 2, (8, 16, 32, 64), (4, 8, 16, 32)),
    _case("gauss2", 4, 1, (4, 8, 16, 32)),
    _case("gauss3", 6, 1, (2, 4, 8)),
)


def errors(case, what, device):
    """Root mean square error of colour and opacity for each number of segments: (steps in mm, errors)."""
    found = [error(case.params, what, count, device) for count in case.counts[what]]
    return np.array([LENGTH / count for count in case.counts[what]]), np.array(found)


def error(params, what, count, device, worst=False):
    """Error of a picture with ``count`` segments a ray: root mean square, or the worst."""
    interval = np.broadcast_to([START, START + LENGTH], (SIZE[1], SIZE[0], 2)).copy()
    picture = call(
        "render.raycast_2d", device, SIZE, volume=grid(1), camera=ACROSS, transfer_function=FUNCTIONS[what],
        interval=Image(interval), lit=False, termination=1.0, step=LENGTH / count / SIDE, **params,
    )  # fmt: skip
    difference = picture.color - exact(what)
    return float(np.abs(difference).max() if worst else np.sqrt((difference**2).mean()))


@functools.lru_cache
def exact(what):
    """Colour and opacity (h, w, 4): 60 points of Gauss between the places where a ray meets the edge."""
    origins, directions, _ = rays(ACROSS, SIZE)
    found = [
        _integral(origin + direction * START, direction, FUNCTIONS[what], what in FIELDS[1:])
        for origin, direction in zip(origins.reshape(-1, 3), directions.reshape(-1, 3), strict=True)
    ]
    return np.array(found).reshape(SIZE[1], SIZE[0], 4)


def spots(points):
    """Value and gradient magnitude per mm at points (..., 3) inside the cell, mm."""
    x, y, z = np.moveaxis(points / SIDE, -1, 0)

    def value(x, y, z):
        ends = [
            (CORNERS[k][0][0] * (1 - x) + CORNERS[k][0][1] * x) * (1 - y)
            + (CORNERS[k][1][0] * (1 - x) + CORNERS[k][1][1] * x) * y
            for k in (0, 1)
        ]
        return ends[0] * (1 - z) + ends[1] * z

    # A voxel further the field repeats its edge.
    slope = [
        value(1.0, y, z) - value(0.0, y, z), value(x, 1.0, z) - value(x, 0.0, z), value(x, y, 1.0) - value(x, y, 0.0)
    ]  # fmt: skip
    return value(x, y, z), np.sqrt(sum(part**2 for part in slope)) / (2 * SIDE)


def _integral(origin, direction, function, has_edge):
    def at(s):
        return spots(origin + direction * LENGTH * np.asarray(s)[..., None])

    def inside(s):
        value, magnitude = at(s)
        low, high = EDGE.bottom[0], EDGE.top[0]
        return value - (low + (high - low) * magnitude / EDGE.gradients[1])

    cuts = []
    if has_edge:
        grid = np.linspace(0.0, 1.0, 2001)
        side = inside(grid)
        cuts = [
            optimize.brentq(inside, grid[i], grid[i + 1], xtol=1e-15) for i in np.flatnonzero(side[1:] * side[:-1] < 0)
        ]
    nodes, weights = np.polynomial.legendre.leggauss(60)
    color, depth = np.zeros(3), 0.0
    for a, b in zip([0.0, *cuts], [*cuts, 1.0], strict=True):
        emission = function.emission(*at(a + (b - a) * (0.5 + 0.5 * nodes))) * LENGTH * 0.5 * (b - a)
        until = np.polynomial.legendre.legint(np.polynomial.legendre.legfit(nodes, emission[:, 3], 45), lbnd=-1.0)
        before = depth + np.polynomial.legendre.legval(nodes, until)
        color += (weights * np.exp(-before)) @ emission[:, :3]
        depth += weights @ emission[:, 3]
    return *color, -np.expm1(-depth)
