"""A ray through a trilinear field, integrated to the last digits: the ray-caster's answer for no step at all.

Between two cell faces the field is a cubic of the distance. Each such piece is cut where the cubic meets a key of the
transfer function; what is left is smooth, and ten Gauss-Legendre points give all digits. No line of it is the kernels'.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from tests.support.raycast_twin import sample

NODES, WEIGHTS = np.polynomial.legendre.leggauss(10)
NODES, WEIGHTS = (NODES + 1) / 2, WEIGHTS / 2
# Column j holds the integrals from 0 to each node of the polynomial that is 1 at node j and 0 at the others.
_powers = np.arange(10)
PARTIAL = (NODES[:, None] ** (_powers + 1) / (_powers + 1)) @ np.linalg.inv(NODES[:, None] ** _powers)


class Ray(NamedTuple):
    """What a ray sees, its optical depth, and by how much the slopes (per mm) of extinction and of value vary."""

    rgba: np.ndarray
    depth: float
    variation: float
    value_variation: float


def cubics(volume, origin, direction, breaks):
    """Coefficients (m, 4), highest first, of the value over 0..1 of each piece between breaks (m + 1,)."""
    at = np.array([0.0, 1 / 3, 2 / 3, 1.0])
    t = breaks[:-1, None] + np.diff(breaks)[:, None] * at
    values = sample(volume, origin + t[..., None] * direction)
    return values @ np.linalg.inv(np.vander(at, 4)).T


def total_variation(cubic, lengths):
    """Of the slope of a piecewise cubic: its jumps, and the integral of |f''|, which is linear, within each piece."""
    first = np.stack([cubic[:, 2], cubic @ [3.0, 2.0, 1.0, 0.0]], axis=1) / lengths[:, None]
    x = (np.arange(64) + 0.5) / 64
    second = np.abs(6 * cubic[:, :1] * x + 2 * cubic[:, 1:2]) / lengths[:, None] ** 2
    return float(np.abs(first[1:, 0] - first[:-1, 1]).sum() + (second.mean(axis=1) * lengths).sum())


def integrate(volume, transfer_function, origin, direction, entry, exit):
    """One ray, given in index space per mm, between two distances."""
    breaks = [entry, exit]
    for axis in range(3):
        if direction[axis] != 0.0:
            ends = sorted(origin[axis] + direction[axis] * np.array([entry, exit]))
            faces = np.arange(np.ceil(ends[0]), np.floor(ends[1]) + 1)
            breaks.extend((faces - origin[axis]) / direction[axis])
    cells = np.unique(np.clip(breaks, entry, exit))
    cells = cells[np.concatenate([[True], np.diff(cells) > 1e-12])]
    values = cubics(volume, origin, direction, cells)
    crossings = []
    for start, length, cubic in zip(cells, np.diff(cells), values, strict=False):
        for key in transfer_function.keys:
            roots = np.roots(cubic - [0, 0, 0, key.value])
            real = roots[np.abs(roots.imag) < 1e-9].real
            crossings.extend(start + length * real[(real > 0) & (real < 1)])
    breaks = np.unique(np.concatenate([cells, crossings]))
    lengths = np.diff(breaks)
    t = breaks[:-1, None] + lengths[:, None] * NODES
    matter = transfer_function.evaluate(sample(volume, origin + t[..., None] * direction))
    extinction = matter[..., 3]
    before = np.concatenate([[0.0], np.cumsum(lengths * (extinction @ WEIGHTS))])
    passed = before[:-1, None] + lengths[:, None] * (extinction @ PARTIAL.T)
    weight = extinction * np.exp(-passed) * WEIGHTS * lengths[:, None]
    color = (matter[..., :3] * weight[..., None]).sum(axis=(0, 1))
    pieces = cubics(volume, origin, direction, breaks)
    slope = _slopes(transfer_function, pieces @ [0.5**3, 0.5**2, 0.5, 1.0])
    return Ray(
        np.array([*color, -np.expm1(-before[-1])]),
        float(before[-1]),
        total_variation(pieces * slope[:, None], lengths),
        total_variation(pieces, lengths),
    )


def _slopes(transfer_function, values):
    """Change of extinction with value at each of some values, which lie at no key."""
    step = 1e-6
    return (transfer_function.evaluate(values + step) - transfer_function.evaluate(values - step))[:, 3] / (2 * step)
