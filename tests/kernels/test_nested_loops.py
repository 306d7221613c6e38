"""Loops inside loops, left by neighbouring pixels at different times.

On llvmpipe (Mesa 22.3) pixels that have left a do loop go on computing what is read behind it, so the printer lets them
do nothing; printed as it was written, this kernel gave 198 wrong pixels of 256.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nodegraph.shaders import Source

KERNEL = """
vec4 pixel(ivec2 at) {
    int n = 3 + (at.x * 7 + at.y * 3) % 11;
    int next = 0;
    float sum = 0.0;
    int turns = 0;
    while (next < n && sum < 40.0) {
        float found = 0.0;
        LOOP
        if (found > 0.0) {
            sum += found;
            ++turns;
        }
    }
    return vec4(sum, float(turns), float(next), 0.0);
}
"""
STEP = """
            found = (next * 5 + at.x) % 3 == 0 ? float(next + 1) : 0.0;
            ++next;
"""
SKIPPING = """
            found = 0.0;
            ++next;
            if ((next * 5 - 5 + at.x) % 3 != 0) {
                continue;
            }
            found = float(next);
"""
AGAIN = "while (next < n && !(found > 0.0))"
LOOPS = {
    "while": f"{AGAIN} {{ {STEP} }}",
    "do": f"do {{ {STEP} }} {AGAIN};",
    "do with continue": f"do {{ {SKIPPING} }} {AGAIN};",
    "flag": f"bool going = true; while (going) {{ {STEP} going = next < n && !(found > 0.0); }}",
    "for": f"for (; next < n && !(found > 0.0);) {{ {STEP} }}",
    "for with break": f"for (int i = 0; i < 100; ++i) {{ if (!(next < n) || found > 0.0) {{ break; }} {STEP} }}",
}


def expected(x: int, y: int) -> tuple[float, float, float, float]:
    n = 3 + (x * 7 + y * 3) % 11
    next, total, turns = 0, 0.0, 0
    while next < n and total < 40.0:
        found = 0.0
        while next < n and not found > 0.0:
            found = float(next + 1) if (next * 5 + x) % 3 == 0 else 0.0
            next += 1
        if found > 0.0:
            total += found
            turns += 1
    return total, float(turns), float(next), 0.0


@pytest.mark.parametrize("loop", LOOPS)
def test_neighbours_may_leave_at_different_times(device: Any, loop: str) -> None:
    got = device.run(Source.of(KERNEL.replace("LOOP", LOOPS[loop])), (16, 16)).array
    np.testing.assert_array_equal(got, [[expected(x, y) for x in range(16)] for y in range(16)])
