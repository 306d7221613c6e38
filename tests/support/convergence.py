"""How fast the error of an integrator falls with its step: cases with known answers, and what theory says of them.

All rays lie inside one cell of a trilinear field, and the interval of entry and exit points begins and ends at whole
steps. So the value along a ray is one cubic, no segment is cut, and the only jumps are those of the transfer function.
It has so few keys that a table of it is exact, and its colour changes with the value, since an optical depth that is a
polynomial is nothing to a rule of Gauss. Where the transfer function jumps, the error of one ray is a saw: the jump
lies on another place of its segment for each step. So all figures are root mean squares over rays that cross it
everywhere.
`cellwise` knows no step, its pieces are cells: the same field, whole along the ray, on finer and finer grids.
"""

from __future__ import annotations

import functools
import itertools
import math
from typing import NamedTuple

import numpy as np

from nodegraph.data import Camera, Image, TransferFunction, Volume
from nodegraph.data.space import affine
from tests.support.calls import call
from tests.support.closed_forms import rays

SIDE = 16.0  # mm, of the cell
CORNERS = np.array([[[0.1, 0.35], [0.3, 0.2]], [[0.25, 0.9], [0.5, 0.85]]])  # (z, y, x)
START, LENGTH = 96.0, 16.0  # mm from the plane of the eye: whole steps of 16 mm / 2^n
SIZE = (12, 12)
FIELDS = ("smooth", "discontinuous")
JUMP = 0.5
SMOOTH = TransferFunction([(0.0, (0.1, 0.9, 0.4), 0.0), (1.0, (0.9, 0.2, 0.5), 0.4)])
"""Colour and extinction are linear in the value; those of the field lie between its two keys."""
JUMPING = TransferFunction(
    [
        (0.0, (0.1, 0.9, 0.4), 0.0),
        (JUMP, (0.5, 0.5, 0.2), 0.04),
        (JUMP, (0.9, 0.1, 0.3), 0.3),
        (1.0, (0.9, 0.2, 0.5), 0.4),
    ]
)
FUNCTIONS = dict(zip(FIELDS, (SMOOTH, JUMPING), strict=True))


_DIRECTION = np.array([0.62, 0.5, 0.6])
_EYE = SIDE / 2 - _DIRECTION / np.linalg.norm(_DIRECTION) * (START + LENGTH / 2)
ACROSS = Camera(eye=_EYE, target=(SIDE / 2,) * 3, up=(0.0, 0.0, 1.0), projection="orthographic", height=5.0)
"""Askew through the middle of the cell."""
ALONG = Camera(eye=(8.0, -START, 8.0), target=(8.0, 0.0, 8.0), projection="orthographic", height=12.0)
"""Along y, from face to face."""


class Case(NamedTuple):
    """An integrator with its parameters, and the segments (or cells) along each ray that show its order."""

    name: str
    params: dict[str, object]
    order: dict[str, int]  # by theory, for each of FIELDS
    counts: dict[str, tuple[int, ...]]


def _case(name, smooth, jumping, counts, jumping_counts=(16, 32, 64, 128, 256), **params):
    # Tables so fine that their floor lies below; the jump lies on a row of the table over pairs.
    params = {"integrator": name, "table_size": 8192, "pair_table_size": 511, **params}
    title = f"{name}, order {params['order']}" if "order" in params else name
    return Case(
        title, params, {"smooth": smooth, "discontinuous": jumping}, {"smooth": counts, "discontinuous": jumping_counts}
    )


CASES = (
    _case("midpoint", 2, 1, (8, 16, 32, 64, 128)),
    _case("trapezoid", 2, 1, (8, 16, 32, 64, 128)),
    _case("preintegrated", 2, 2, (4, 8, 16), (2, 4, 8)),
    _case("gauss2", 4, 1, (4, 8, 16, 32, 64)),
    _case("gauss3", 6, 1, (2, 4, 8, 16, 32)),
    *(
        _case("cellwise", 2 * order, 2 * order, counts, counts, order=order)
        for order, counts in ((1, (8, 16, 32, 64)), (2, (4, 8, 16, 32)), (3, (4, 8, 16)))
    ),
)


def errors(case, what, device):
    """Root mean square error of colour and opacity for each number of segments: (steps in mm, errors)."""
    found = [error(case.params, what, count, device) for count in case.counts[what]]
    return np.array([LENGTH / count for count in case.counts[what]]), np.array(found)


def order(steps, errors):
    """Slope of a straight line through the logarithms."""
    return float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


def error(params, what, count, device, worst=False):
    """Error of a picture with ``count`` segments a ray, or cells: root mean square, or the worst."""
    cells = params["integrator"] == "cellwise"
    camera = ALONG if cells else ACROSS
    volume = grid(count if cells else 1)
    if not cells:
        params = params | {"step": LENGTH / count / SIDE}
    interval = np.broadcast_to([START, START + LENGTH], (SIZE[1], SIZE[0], 2)).copy()
    picture = call(
        "render.raycast", device, SIZE, volume=volume, camera=camera, transfer_function=FUNCTIONS[what],
        interval=Image(interval), lit=False, termination=1.0, **params,
    )  # fmt: skip
    difference = picture.color - exact(camera, FUNCTIONS[what])
    return float(np.abs(difference).max() if worst else np.sqrt((difference**2).mean()))


def grid(cells):
    """The field on ``cells`` cells along y, and one along x and z."""
    at = np.linspace(0.0, 1.0, cells + 1)[None, :, None]
    data = CORNERS[:, :1] * (1.0 - at) + CORNERS[:, 1:] * at
    return Volume(data, affine((SIDE, SIDE / cells, SIDE)))


@functools.lru_cache
def exact(camera, function):
    """Colour and opacity (h, w, 4) in closed form but for one quadrature.

    The value is a cubic, extinction and colour are linear in it, so the optical depth is a polynomial on each side of
    the jump, and 40 points of Gauss integrate the rest."""
    origins, directions, _ = rays(camera, SIZE)
    places = np.linspace(0.0, 1.0, 4)
    values = np.stack([_trilinear(origins + directions * (START + LENGTH * s)) for s in places], axis=-1)
    cubics = np.linalg.solve(np.vander(places), values.reshape(-1, 4).T).T
    return np.array([_integral(cubic, function) for cubic in cubics]).reshape(*values.shape[:2], 4)


def _integral(value, function):
    """Colour and opacity of one ray, whose value is a polynomial over 0..1."""
    roots = np.roots(value - [0.0, 0.0, 0.0, JUMP])
    cuts = sorted(root.real for root in roots if abs(root.imag) < 1e-12 and 0.0 < root.real < 1.0)
    nodes, weights = np.polynomial.legendre.leggauss(40)
    color, depth = np.zeros(3), 0.0
    for a, b in zip([0.0, *cuts], [*cuts, 1.0], strict=True):
        slopes, offsets = _band(function, np.polyval(value, 0.5 * (a + b)))
        extinction = LENGTH * (slopes[3] * value + [0.0, 0.0, 0.0, offsets[3]])
        until = np.polyint(extinction)
        s = a + (b - a) * (0.5 + 0.5 * nodes)
        before = depth + np.polyval(until, s) - np.polyval(until, a)
        seen = np.polyval(extinction, s) * np.exp(-before) * weights * 0.5 * (b - a)
        color += (np.polyval(value, s)[:, None] * slopes[:3] + offsets[:3]).T @ seen
        depth += np.polyval(until, b) - np.polyval(until, a)
    return *color, -math.expm1(-depth)


def _band(function, value):
    """(slopes, offsets) of red, green, blue and extinction between the two keys about a value."""
    low, high = next((a, b) for a, b in itertools.pairwise(function.keys) if a.value <= value < b.value)
    here, there = (np.array([*key.color, -math.log1p(-key.opacity)]) for key in (low, high))
    slopes = (there - here) / (high.value - low.value)
    return slopes, here - slopes * low.value


def _trilinear(points):
    """The field at points (..., 3) inside the cell, mm."""
    x, y, z = np.moveaxis(points / SIDE, -1, 0)
    rows = CORNERS[0] * (1 - z[..., None, None]) + CORNERS[1] * z[..., None, None]
    ends = rows[..., 0, :] * (1 - y[..., None]) + rows[..., 1, :] * y[..., None]
    return ends[..., 0] * (1 - x) + ends[..., 1] * x
