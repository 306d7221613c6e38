"""Transfer functions that jump: rays that graze a jump, and jumps at the ends of what a table covers."""

import numpy as np
import pytest

from nodegraph.data import Camera, TransferFunction, Volume
from nodegraph.data.space import centred
from tests.support.calls import call

pytestmark = pytest.mark.slow

WHITE, BLUE = (0.9, 0.8, 0.6), (0.1, 0.2, 0.9)
N = 40
CAMERA = Camera(eye=(20, -200, 40), target=(0, 0, 0), field_of_view=15)
FUNCTIONS = {
    "step": [(0.5, BLUE, 0.0), (0.5, WHITE, 0.3)],
    "nearly opaque": [(0.5, BLUE, 0.0), (0.5, WHITE, 0.99)],
    "two steps": [(0.0, BLUE, 0.02), (0.3, BLUE, 0.05), (0.3, WHITE, 0.2), (0.7, BLUE, 0.3), (0.7, WHITE, 0.01)],
    "colour alone": [(0.2, BLUE, 0.1), (0.5, BLUE, 0.1), (0.5, WHITE, 0.1), (1.0, WHITE, 0.1)],
}


def waves():
    """A soft ball with bumps, in double precision."""
    at = (np.arange(N) + 0.5) / N - 0.5
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    ball = np.exp(-(x * x + y * y + 1.5 * z * z) / 0.0625)
    return Volume(ball * (1 + 0.3 * np.sin(20 * x) * np.sin(17 * y) * np.sin(15 * z)), centred((N, N, N), (1, 1, 1)))


def render(device, volume, function, camera=CAMERA, size=(48, 48), **params):
    params = {"lit": False, "termination": 1.0} | params
    return call("render.raycast", device, size, volume=volume, camera=camera, transfer_function=function, **params)


@pytest.mark.parametrize("keys", FUNCTIONS.values(), ids=list(FUNCTIONS))
def test_adaptive_keeps_its_tolerance_at_jumps(cl64, keys):
    """Against the reference. Some of the 2304 rays graze the surface at which the transfer function jumps."""
    volume, function = waves(), TransferFunction(keys)
    exact = render(cl64, volume, function, integrator="cellwise", order=6).color
    assert exact[..., 3].max() > 0.5
    for step in (0.5, 1.0):
        for tolerance in (1e-2, 1e-3):
            found = render(cl64, volume, function, integrator="adaptive", step=step, tolerance=tolerance).color
            assert np.abs(found - exact).max() <= tolerance


@pytest.mark.parametrize("integrator", ["midpoint", "trapezoid", "preintegrated", "gauss2", "adaptive", "cellwise"])
@pytest.mark.parametrize("opacities", [(0.0, 0.2, 0.3), (0.3, 0.0, 0.0)])
def test_a_step_at_the_first_key_goes_on_below_it_as_its_left_side(device, integrator, opacities):
    """A value that rises by 1 over 32 mm, and a step at 0.4."""
    rise = np.linspace(0.0, 1.0, 32, dtype=np.float32)
    volume = Volume(np.broadcast_to(rise[None, :, None], (8, 32, 8)).copy())
    places = zip((0.4, 0.4, 0.9), opacities, strict=True)
    function = TransferFunction([(place, WHITE, opacity) for place, opacity in places])
    camera = Camera(eye=(0, -100, 0), target=(0, 0, 0), projection="orthographic", height=4)
    color = render(device, volume, function, camera, (4, 4), integrator=integrator, step=0.25).color
    before, after, last = (float(function.extinction(opacity)) for opacity in opacities)
    # 0.4 lies 12.4 mm behind the first voxel centre; from 0.9 on, 3.6 mm to the outer face, the last key goes on.
    depth = 12.9 * before + 15.5 * 0.5 * (after + last) + 3.6 * last
    # A step is met within a segment or a row of the table, 0.07 mm.
    assert np.abs(color[..., 3] + np.expm1(-depth)).max() <= np.exp(-depth) * 0.4 * (0.25 + 0.07) + 1e-5
