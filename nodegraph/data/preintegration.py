"""Transfer functions integrated beforehand, over pairs of values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.transfer_function import TransferFunction

FINE = 16
"""Rows of the integrals for each row of the table over pairs."""
PIECES = 16
"""Parts between front and back that are laid over each other for the colour."""


def pair_table(function: TransferFunction, size: int, length: float) -> NDArray[np.float64]:
    """Mean colour and extinction of a segment on which the value goes evenly from front to back.

    Returns (size, size, 4): row = back, column = front, as places of `TransferFunction.lookup(size)`; linear RGB and
    extinction per mm. The extinction is the exact mean, so a segment of any length s hides 1 - exp(-extinction s). The
    colour counts what the front part of the segment hides of the rest for one that is ``length`` mm long.
    Source: Rezk-Salama 2001, X12 (pre-integrated classification).
    """
    scale, offset = function.lookup(size)
    if scale == 0.0:
        return np.broadcast_to(function.table(size), (size, size, 4)).copy()
    rows = (size - 1) * FINE + 1
    fine = _fine(function, np.arange(rows) / FINE, scale, offset)
    integrals = _integrals(function, np.arange(rows) / FINE, scale, offset)
    depth, light = integrals[:, 3], integrals[:, :3]
    ends = np.arange(size) * float(FINE)
    front, back = np.meshgrid(ends, ends, indexing="xy")
    here = fine[::FINE]
    result = np.empty((size, size, 4))
    width = back - front
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (depth[back.astype(np.intp)] - depth[front.astype(np.intp)]) / width
    same = width == 0.0
    result[..., 3] = np.where(same, here[:, 3][:, None] * np.ones(size), mean)
    # From places to mm: over the whole segment the optical depth is the mean extinction times its length.
    per_place = np.where(same, 0.0, length / np.where(same, 1.0, width))
    seen = np.ones((size, size))
    total = np.zeros((size, size))
    color = np.zeros((size, size, 3))
    before, before_light = depth[front.astype(np.intp)], light[front.astype(np.intp)]
    for piece in range(1, PIECES + 1):
        at = front + width * (piece / PIECES)
        index = np.minimum(at.astype(np.intp), rows - 2)
        part = at - index
        here_depth = depth[index] + part * (depth[index + 1] - depth[index])
        here_light = light[index] + part[..., None] * (light[index + 1] - light[index])
        amount = (here_depth - before) * np.sign(width)
        share = seen * -np.expm1(-np.abs(here_depth - before) * np.abs(per_place))
        some = amount > 0.0
        mean_color = np.where(
            some[..., None],
            (here_light - before_light) * np.sign(width)[..., None] / np.where(some, amount, 1.0)[..., None],
            0.0,
        )
        color += share[..., None] * mean_color
        total += share
        seen = seen - share
        before, before_light = here_depth, here_light
    empty = total <= 0.0
    result[..., :3] = np.where(
        empty[..., None], 0.5 * (here[None, :, :3] + here[:, None, :3]), color / np.where(empty, 1.0, total)[..., None]
    )
    diagonal = np.arange(size)
    result[diagonal, diagonal, :3] = here[:, :3]
    return result


def _fine(function: TransferFunction, places: NDArray[Any], scale: float, offset: float) -> NDArray[np.float64]:
    """What is at places of the table, the first of which stands for all below it: at a step there, its left side."""
    fine = function.evaluate((places - offset) / scale)
    if function.keys and function.domain[0] == -offset / scale:
        fine[0] = [*function.keys[0].color, float(function.extinction(function.keys[0].opacity))]
    return fine


def _integrals(function: TransferFunction, places: NDArray[Any], scale: float, offset: float) -> NDArray[np.float64]:
    """From the first place to each, (n, 4): of light (colour times extinction) and extinction; unit: fine rows.

    Exact, since both are polynomials between two keys: were a jump not met where it is, but between two rows, the table
    would be wrong by the width of a row however many pieces a ray is cut into.
    """
    keys = np.array([key.value for key in function.keys]) * scale + offset
    keys = keys[(keys > places[0]) & (keys < places[-1])]
    ends = np.concatenate([places, keys])
    sources = np.argsort(ends, kind="stable")
    ends = ends[sources]
    width = np.diff(ends)
    total = np.zeros((len(ends), 4))
    # Two points of Gauss, inside each part and so on the right side of each jump, are exact up to cubics.
    for node in (0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)):
        matter = function.evaluate((ends[:-1] + node * width - offset) / scale)
        matter[:, :3] *= matter[:, 3:]
        total[1:] += 0.5 * FINE * width[:, None] * matter
    result = np.empty((len(ends), 4))
    result[sources] = np.cumsum(total, axis=0)
    return result[: len(places)]


def gauss_rule(points: int) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Gauss-Legendre points in 0..1, their weights, and (points, points): in row i what the part before point i weighs.

    The last are those of the polynomial through the values at the points, as the implicit Runge-Kutta methods of Gauss
    have them; so what is integrated with all three keeps order 2 ``points``.
    """
    nodes, weights = np.polynomial.legendre.leggauss(points)
    nodes, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    powers = np.arange(points)
    # Exact on every power: sum_j before[i, j] x_j^p = x_i^(p + 1) / (p + 1).
    moments = nodes[:, None] ** (powers + 1) / (powers + 1)
    before = np.asarray(np.linalg.solve((nodes[:, None] ** powers).T, moments.T).T, np.float64)
    return nodes, weights, before


def pair_extinction(function: TransferFunction, size: int) -> tuple[NDArray[np.float64], tuple[float, float]]:
    """What `pair_table` can show of which values, for `nodegraph.data.bricks.visible_bricks`: a table and its look-up.

    Rows (2 size - 1, 4) hold, as extinction, that of a row of the table at even places, and at odd ones the greatest
    between it and the next: a segment with an end in there reads both.
    """
    scale, offset = function.lookup(size)
    if scale == 0.0:
        return function.table(size), (scale, offset)
    rows = (size - 1) * FINE + 1
    places = np.arange(rows) / FINE
    fine = _fine(function, places, scale, offset)[:, 3]
    within = np.diff(_integrals(function, places, scale, offset)[:, 3])  # spikes between two fine rows, too
    table = np.zeros((2 * size - 1, 4))
    table[::2, 3] = fine[::FINE]
    table[1::2, 3] = np.maximum(np.maximum(fine[:-1], within).reshape(-1, FINE).max(axis=1), fine[FINE::FINE])
    return table, (2.0 * scale, 2.0 * offset)
