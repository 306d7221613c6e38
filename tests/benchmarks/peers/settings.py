"""Which of our settings are tried: everything that the ray-caster offers to trade."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import Any

STEPS = tuple(2.0 ** (k / 2) for k in range(8, -7, -1))
"""Lengths of a segment, voxels, coarse to fine: 16 to 1/8."""
FINE_STEPS = tuple(2.0 ** (k / 8) for k in range(16, -17, -1))
"""For what wins most often: 4 to 1/4."""
LEVEL_STEPS = FINE_STEPS[:29]
"""With interactive levels, 4 to 0.35: a level lengthens what is below 1, so that pictures grow instead."""
TOLERANCES = (0.3, 0.1, 0.03, 0.01, 0.003, 0.001)
TERMINATION = 254.0 / 255.0
"""Where VTK's GPU mapper ends a ray."""
PAIRS = (256, 1024)
PIXEL_TOLERANCES = (0.01,)
"""Of rays that are not cast where those around agree; for the integrators that are cheapest a sample."""
LEVELS = (2, 4, 8)
"""Interactive quality: about one n-th of the work, as a smaller picture that is enlarged."""

FAINT = (0.2,)
"""Opacities of a voxel up to which bricks are left out, with every ray."""
ROUGH = ((0.35, TERMINATION), (0.5, 0.8))
"""The same, and where a ray ends, with interactive levels of 4 and 8, whose pictures err by more already."""

Settings = Mapping[str, Any]


def ladders() -> Iterator[list[Settings]]:
    """Lists of settings, each from coarse to fine in the one thing in which its members differ."""
    for integrator in ("midpoint", "trapezoid", "gauss2", "gauss3"):
        steps = sorted({*STEPS, *FINE_STEPS}, reverse=True) if integrator == "midpoint" else STEPS
        yield [{"integrator": integrator, "step": step, "termination": TERMINATION} for step in steps]
    for faint in FAINT:
        yield [
            {"integrator": "midpoint", "step": step, "skip_opacity": faint, "termination": TERMINATION}
            for step in FINE_STEPS
        ]
    for size in PAIRS:
        yield [
            {"integrator": "preintegrated", "step": step, "pair_table_size": size, "termination": TERMINATION}
            for step in STEPS
        ]
    for integrator, found in itertools.product(("midpoint", "preintegrated"), PIXEL_TOLERANCES):
        yield [
            {
                "integrator": integrator,
                "step": step,
                "pair_table_size": PAIRS[0],
                "pixel_tolerance": found,
                "termination": TERMINATION,
            }
            for step in STEPS[2:]
        ]
    for step in (2.0, 4.0):
        yield [
            {"integrator": "adaptive", "step": step, "tolerance": tolerance, "termination": TERMINATION}
            for tolerance in TOLERANCES
        ]
    for n in LEVELS:
        yield [{"integrator": "midpoint", "step": step, "termination": TERMINATION, "level": n} for step in LEVEL_STEPS]
    for n, (faint, end) in itertools.product(LEVELS[1:], ROUGH):
        yield [
            {"integrator": "midpoint", "step": step, "skip_opacity": faint, "termination": end, "level": n}
            for step in LEVEL_STEPS
        ]
