"""Steps, opacities and optical depths far from the usual, against the closed form of a homogeneous slab.

Whatever the integrator and its step, a homogeneous slab hides 1 - exp(-tau) of what is behind it.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np

from nodegraph.data import TransferFunction, Volume
from nodegraph.data.transfer_function import MAX_OPACITY
from tests.extremes.case import AHEAD, PLAIN, case, matter, ones, relative, render, slab, worst

STEPS = "Steps"
OPACITY = "Opacity and optical depth"


def step_error(step: float, device: Any, **params: Any) -> float:
    """A slab of 10 voxels of opacity 0.2 each."""
    image = render(device, (3, 2), volume=ones((4, 10, 4)), camera=AHEAD, step=step,
                   transfer_function=matter(0.2), **params)  # fmt: skip
    return worst(image.color, slab(1 - 0.8**10))


for length in (1e-3, 0.37, 7.0, 1e3):
    case(
        STEPS, f"{length:g} voxel", "the closed form of a slab of 10 voxels", single=1e-5, double=1e-9,
        integrators=None,
    )(partial(step_error, length))  # fmt: skip


@case(
    STEPS, "1e5 samples on a ray", "the closed form of a slab of 100 voxels, step 0.001", single=1e-4, double=1e-9,
    integrators=None, counted=True,
)  # fmt: skip
def many_samples(device: Any, **params: Any) -> float:
    image = render(device, (1, 1), volume=ones((2, 100, 2)), camera=AHEAD.with_(eye=(0, -300, 0)), step=1e-3,
                   transfer_function=matter(0.01), **params)  # fmt: skip
    return worst(image.color, slab(1 - 0.99**100))


@case(
    STEPS, "1e5 samples in search of the maximum", "the greatest value, which one sample in the middle has",
    single=1e-6, double=1e-12, counted=True,
)  # fmt: skip
def many_looked_at(device: Any) -> float:
    data = np.zeros((2, 101, 2), np.float32)
    data[:, 50] = 1.0
    tf = TransferFunction([(0.0, (0, 0, 0), 0.0), (1.0, (1, 1, 1), 0.5)])
    camera = AHEAD.with_(eye=(0.0, -300.0005, 0.0))  # so that a sample lies where the maximum is
    image = render(device, (1, 1), volume=Volume(data), camera=camera, mode="maximum", step=1e-3, transfer_function=tf)
    # The nearest sample may lie half a step off, so its value lacks 0.0005.
    return max(0.0, worst(image.color, [0.5] * 4) - 0.0006)


@case(
    STEPS, "1e3 voxel across a linear field", "cut at every cell, whatever the step", single=2e-6, double=1e-7,
    integrators=("cellwise",),
)  # fmt: skip
def long_step_linear(device: Any, **params: Any) -> float:
    """Extinction rises linearly from voxel to voxel; half a voxel at both ends repeats the edge."""
    n, opacity = 8, 0.4
    data = np.broadcast_to(np.linspace(0, 1, n, dtype=np.float32)[None, :, None], (3, n, 3)).copy()
    tf = TransferFunction([(0.0, (0.8, 0.4, 0.1), 0.0), (1.0, (0.8, 0.4, 0.1), opacity)])
    image = render(device, (2, 2), volume=Volume(data), camera=AHEAD, step=1e3, transfer_function=tf, **params)
    greatest = -np.log1p(-opacity)
    return worst(image.color, slab(-np.expm1(-greatest * ((n - 1) / 2 + 0.5))))


@case(
    STEPS, "1e3 voxel, surfaces and maxima", "still the only sample of the volume, clamped into it", single=2e-5,
    double=1e-9,
)  # fmt: skip
def long_step_found(device: Any) -> float:
    """The surface at 0 lies between entry and exit, and is found between the two."""
    data = np.broadcast_to(np.linspace(-3.5, 3.5, 8, dtype=np.float32)[None, :, None], (3, 8, 3)).copy()
    image = render(device, (2, 2), volume=Volume(data), camera=AHEAD, mode="iso", iso_value=0.0, step=1e3)
    return worst(image.depth, 50.0)


def opacity_error(opacity: float, device: Any, **params: Any) -> float:
    """Relative, so that faint matter must keep its digits. The reference length is 1 mm, the slab 3 mm thick."""
    image = render(device, (2, 2), volume=ones((4, 3, 4)), camera=AHEAD, step=0.1, transfer_function=matter(opacity),
                   **params)  # fmt: skip
    alpha = -np.expm1(3.0 * np.log1p(-min(opacity, MAX_OPACITY)))
    return relative(image.color, slab(alpha))


for share in (1e-7, 1e-4, 0.5, 1 - 1e-7, 1.0):
    case(
        OPACITY, f"opacity {share:.9g} per mm", "the closed form of 3 mm of it", single=5e-6, double=1e-9,
        unit="relative", integrators=None,
    )(partial(opacity_error, share))  # fmt: skip


def depth_error(tau: float, device: Any, **params: Any) -> float:
    """Optical depth of 10 mm; the reference length is chosen so that the opacity is 1/2."""
    tf = matter(0.5, 10.0 * np.log(2.0) / tau)
    image = render(device, (2, 2), volume=ones((4, 10, 4)), camera=AHEAD, step=0.25, transfer_function=tf, **params)
    return relative(image.color, slab(-np.expm1(-tau)))


for tau in (1e-8, 1e-3, 1e4):
    case(
        OPACITY, f"optical depth {tau:g}", "the closed form of 10 mm of it", single=5e-6, double=1e-9,
        unit="relative", integrators=None,
    )(partial(depth_error, tau))  # fmt: skip


@case(
    OPACITY, "optical depth 1e4, depth", "half is hidden at the very face: depth is where matter begins",
    single=2e-5, double=1e-6, unit="mm", integrators=None,
)  # fmt: skip
def depth_of_dense(device: Any, **params: Any) -> float:
    tf = matter(0.5, 1e-3 * np.log(2.0))  # 1000 per mm
    image = render(device, (2, 2), volume=ones((4, 10, 4)), camera=AHEAD, step=0.25, transfer_function=tf, **params)
    return worst(image.depth, 45.0 + 1e-3 * np.log(2.0))


@case(
    OPACITY, "optical depth 1e-8, depth", "nothing hides half of what is behind it: depth is infinite", single=0,
    double=0, unit="pixels", integrators=PLAIN,
)  # fmt: skip
def depth_of_faint(device: Any, **params: Any) -> float:
    image = render(device, (2, 2), volume=ones((4, 10, 4)), camera=AHEAD, step=0.25,
                   transfer_function=matter(0.5, 1e9 * np.log(2.0)), **params)  # fmt: skip
    return float(np.isfinite(image.depth).sum())


@case(
    OPACITY, "a brightness of 1e6", "light is linear and has no upper end", single=2e-6, double=1e-9, unit="relative",
    integrators=None,
)  # fmt: skip
def bright(device: Any, **params: Any) -> float:
    tf = TransferFunction([(0.0, (1e6, 1e-6, 1.0), 0.3), (1.0, (1e6, 1e-6, 1.0), 0.3)])
    image = render(device, (2, 2), volume=ones((4, 4, 4)), camera=AHEAD, transfer_function=tf, **params)
    return relative(image.color, (1 - 0.7**4) * np.array([1e6, 1e-6, 1.0, 1.0]))
