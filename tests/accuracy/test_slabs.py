"""Slabs: emission and absorption with closed forms, for each integrator and on each device.

Every bound is the error term of the integrator (tests/support/integrators.py) for the slope that the case has.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from nodegraph.data import Camera, Image, TransferFunction, Volume
from nodegraph.data.space import centred
from tests.support import closed_forms as forms
from tests.support.calls import call
from tests.support.cell_twin import integrate
from tests.support.integrators import (
    INTEGRATORS,
    TOLERANCE,
    cut_error,
    each,
    jump_error,
    line_error,
    params,
    rounding,
    row,
)

pytestmark = pytest.mark.slow

# No whole number of any step from the volume, so that the first and the last segment of each ray are cut.
FLAT = Camera(eye=(0.3, -150.37, 0.2), target=(0.3, 0, 0.2), projection="orthographic", height=3.0)
SIZE = (4, 4)
COLOR = (1.0, 0.5, 0.25)


def ramp(extinction, high, first=COLOR, last=COLOR, low=0.0, floor=0.0):
    """Extinction linear in the value: ``floor`` per mm at ``low``, ``extinction`` at ``high``."""
    return TransferFunction([(low, first, -math.expm1(-floor)), (high, last, -math.expm1(-extinction))])


def cast(device, volume, function, integrator, step, camera=FLAT, size=SIZE, **more):
    chosen = params(integrator, step, **more)
    return call("render.raycast", device, size, volume=volume, camera=camera, transfer_function=function, **chosen)


def along_y(values, spacing=1.0):
    """A volume whose values depend on y alone."""
    values = np.asarray(values, np.float32)
    return Volume(np.broadcast_to(values[None, :, None], (4, len(values), 4)).copy(),
                  centred((4, len(values), 4), (1.0, spacing, 1.0)))  # fmt: skip


@each
@pytest.mark.parametrize("tau", [1e-4, 0.7, 5.0])
def test_homogeneous_slab_over_a_background(device, integrator, tau):
    """D = e L everywhere, so alpha = 1 - exp(-D), the picture c alpha, and what is behind shows through by exp(-D).

    No rule errs on a constant, whatever the step: the bound is rounding. Checks: Rezk-Salama 2001, R01.
    """
    volume = along_y(np.ones(10), 0.8)
    alpha = -math.expm1(-tau)
    for step in (0.29, 1.0, 13.0):
        image = cast(device, volume, ramp(tau / 8.0, 1.0), integrator, step)
        assert np.abs(image.color[..., 3] - alpha).max() <= rounding(device, alpha)
        assert np.abs(image.color[..., :3] - alpha * np.array(COLOR)).max() <= rounding(device, alpha)
        behind = (0.1, 0.4, 0.9)
        over = call("image.background", device, image=image, pattern="solid", color=behind).color
        expected = alpha * np.array(COLOR) + math.exp(-tau) * np.array(behind)
        assert np.abs(over[..., :3] - expected).max() <= rounding(device)


@each
@pytest.mark.parametrize("step", [0.31, 0.9, 2.3])
def test_linear_extinction(device, integrator, step):
    """Values 0, 1 ... n - 1 at spacing s: a trapezoid over each cell and half a voxel of the last values at either end
    make the sum of all values, so D = e s n (n - 1) / 2 for an extinction e per mm and value.

    Along the ray the slope is e / s, with a kink of that size at the first and the last voxel centre.
    """
    n, spacing, per_value = 12, 0.7, 0.03
    image = cast(device, along_y(np.arange(n), spacing), ramp(per_value * (n - 1), n - 1.0), integrator, step)
    tau = per_value * spacing * n * (n - 1) / 2
    slope = per_value / spacing
    h = step * spacing
    bound = line_error(integrator, h, 2 * slope) + cut_error(integrator, h, slope) + rounding(device)
    assert np.abs(image.color[..., 3] + math.expm1(-tau)).max() <= bound
    assert np.abs(image.color[..., :3] - image.color[..., 3:] * COLOR).max() <= rounding(device)


@each
def test_linear_extinction_along_slanted_rays(device, integrator):
    """An affine field a + g . p is a line along a ray: over a length L its integral is L times the middle value.
    The rays are cut, by entry and exit points, within the outermost voxel centres, where nothing is clamped."""
    size, step = (9, 7), 0.8
    camera = Camera(eye=(70.0, -120.0, 55.0), target=(1, 2, 3), field_of_view=16.0)
    dims, gradient = (14, 12, 10), np.array([0.4, -0.7, 0.5])
    matrix = centred(dims, (2.0, 2.5, 3.0))
    z, y, x = np.meshgrid(*(np.arange(n) for n in dims[::-1]), indexing="ij")
    world = np.stack([x, y, z, np.ones_like(x)], -1) @ matrix.T
    volume = Volume((40.0 + world[..., :3] @ gradient).astype(device.real), matrix)
    origins, directions, _ = forms.rays(camera, size)
    entry, exit = forms.box_interval(origins, directions, [-12.0, -13.0, -13.0], [12.0, 13.0, 13.0])
    hit = exit > entry
    assert hit.mean() > 0.4
    interval = np.where(hit[..., None], np.stack([entry, exit], -1), np.nan).astype(device.real)
    per_value = 0.0008
    image = cast(device, volume, ramp(per_value * 80, 80.0), integrator, step, camera, size, interval=Image(interval))
    middle = origins + directions * ((entry + exit) / 2)[..., None]
    tau = np.where(hit, (exit - entry) * per_value * (40.0 + middle @ gradient), 0.0)
    h = step * 2.0
    # Entry and exit points are widened by a millionth of their distance.
    widened = 2 * 1e-6 * 180.0 * per_value * 80
    bound = cut_error(integrator, h, per_value * np.linalg.norm(gradient)) + line_error(integrator, h, 0.0)
    assert np.abs(image.color[..., 3] + np.expm1(-tau)).max() <= bound + widened + rounding(device)


@each
@pytest.mark.parametrize("step", [0.4, 1.7])
def test_density_emitter(device, integrator, step, rng):
    """Emission q0 rho and absorption k0 rho of one density: dI/dt = q0 rho - k0 rho I has the solution (q0 / k0)
    (1 - exp(-k0 int rho)) for any rho, so colour over opacity is q0 / k0 on every ray, whatever the step.

    Checks: Rezk-Salama 2001, R01.
    """
    volume = Volume(rng.random((8, 9, 10)).astype(np.float32), centred((10, 9, 8), (1.0, 1.3, 0.9)))
    camera = Camera(eye=(25.0, -60.0, 18.0), field_of_view=12.0)
    color = cast(device, volume, ramp(0.4, 1.0), integrator, step, camera, (11, 9)).color
    assert color[..., 3].max() > 0.5
    assert np.abs(color[..., :3] - color[..., 3:] * COLOR).max() <= rounding(device)


@each
@pytest.mark.parametrize("step", [0.23, 0.7])
@pytest.mark.parametrize("back", [False, True], ids=["from the front", "from behind"])
def test_a_colour_that_changes_within_the_slab(device, integrator, step, back):
    """Constant extinction e, colour a + b t: by parts, a (1 - T) + b ((1 - T) / e - L T) with T = exp(-e L).

    The colour of the half voxels at the ends is constant: layers of their own. A rule takes the integral of colour and
    transmittance w = exp(-e t) e; the slope of their product varies by at most b w at both kinks and by (2 b e + e^2) w
    in between, which sums to 2 b e + 2 b e + e^2 = 4 b e + e^2 (the integral of w is at most 1).
    """
    n, extinction = 16, 0.12
    first, last = np.array([0.9, 0.1, 0.5]), np.array([0.2, 0.8, 0.5])
    camera = FLAT if not back else FLAT.with_(eye=(0.3, 150.37, 0.2))
    function = ramp(extinction, n - 1.0, tuple(first), tuple(last), floor=extinction)
    color = cast(device, along_y(np.arange(n)), function, integrator, step, camera).color
    if back:
        first, last = last, first
    inner = forms.ramp_of_colour(extinction, n - 1.0, first, last)
    half, seen = -math.expm1(-extinction / 2), math.exp(-extinction * (n - 1))
    clear = math.exp(-extinction / 2)
    expected = half * first + clear * inner + clear * seen * half * last
    slope = np.abs(last - first).max() / (n - 1)
    bound = line_error(integrator, step, 4 * slope * extinction + extinction**2)
    bound += cut_error(integrator, step, slope * extinction) + rounding(device)
    if integrator == "cellwise":
        bound += 1e-8  # three points on exp over a cell: (e h)^7 / 7! and less
    if integrator == "preintegrated":
        # Colour over (front, back) is smooth; between rows of its table it bends by an eighth of a row squared.
        bound += row(integrator, n - 1.0) ** 2 / 8 * extinction * np.abs(last - first).max()
    assert np.abs(color[..., :3] - expected).max() <= bound
    assert np.abs(color[..., 3] + math.expm1(-extinction * n)).max() <= rounding(device)


MEAN_PLACE = {
    "midpoint": lambda e, h: e * h**2 / 12,
    "trapezoid": lambda e, h: e * h**2 / 6,
    "gauss2": lambda e, h: e**3 * h**4 / 1080,
    "gauss3": lambda e, h: e**5 * h**6 / 336000,
    "cellwise": lambda e, h: e**5 / 336000,  # three points in each voxel
    "preintegrated": lambda e, h: e**2 * h**3 / 81,
}


@each
def test_the_order_of_colour_where_nothing_has_a_kink(device, integrator):
    """Constant extinction e and a colour a + b t: a segment shows its colour at the mean place m of what is hidden in
    it, m = 1 / e - h / (exp(e h) - 1) = h/2 - e h^2 / 12 + e^3 h^4 / 720 - e^5 h^6 / 30240 ..., so the error is b
    times that of m. A rule takes m = sum w_i t_i exp(-e t_i) / sum w_i exp(-e t_i): the middle h/2; of both ends
    h/2 - e h^2 / 4; of two points q = h / sqrt(12) off the middle h/2 - q tanh(e q) = h/2 - e h^2 / 12 + e^3 h^4
    / 432; of three, to e^5 h^6 / 336000. A table over pairs holds m for a whole step, and errs only in segments
    that are cut: by e s (h - s) / 12 over e s, at most e^2 h^3 / 81 each. Rays are cut within the outermost voxel
    centres.
    """
    n, extinction, step = 16, 0.5, 1.3
    first, last = np.array([0.9, 0.1, 0.5]), np.array([0.2, 0.8, 0.5])
    function = ramp(extinction, n - 1.0, tuple(first), tuple(last), floor=extinction)
    # Voxel centres lie at -7.5 .. 7.5 mm.
    low, high = -7.0, 6.9
    interval = np.broadcast_to(np.array([low, high]) + 20.37, (*SIZE[::-1], 2)).astype(device.real)
    near = FLAT.with_(eye=(0.3, -20.37, 0.2))  # intervals are widened by a millionth of their distance
    color = cast(device, along_y(np.arange(n)), function, integrator, step, near, interval=Image(interval.copy())).color
    slope = (last - first) / (n - 1)
    expected = forms.ramp_of_colour(extinction, high - low, first + slope * (low + 7.5), first + slope * (high + 7.5))
    b = np.abs(slope).max()
    bound = b * MEAN_PLACE[integrator](extinction, step) if integrator in MEAN_PLACE else TOLERANCE
    bound += cut_error(integrator, step, b * extinction)
    widened = 2 * 1e-6 * 28.0 * (b + extinction)
    assert np.abs(color[..., :3] - expected).max() <= bound + widened + rounding(device)


@each
def test_gauss_points_are_exact_on_the_cubic_of_a_cell(device, integrator):
    """Inside one cell the value along a slanted ray is a cubic of the distance: n Gauss-Legendre points are exact to
    the degree 2 n - 1, so two are enough. Other rules err by their bound for lines."""
    corners = np.array([[[0.1, 0.9], [0.8, 0.0]], [[0.7, 0.2], [0.1, 1.0]]])
    volume = Volume(corners.astype(device.real), centred((2, 2, 2), (12.0, 11.0, 10.0)))
    camera = Camera(eye=(60.0, -75.0, 50.0), field_of_view=3.0)
    size, step, extinction = (5, 4), 0.31, 0.12
    origins, directions, _ = forms.rays(camera, size)
    entry, exit = forms.box_interval(origins, directions, [-5.9, -5.4, -4.9], [5.9, 5.4, 4.9])
    assert (exit > entry).all()
    interval = Image(np.stack([entry, exit], -1).astype(device.real))
    function = ramp(extinction, 1.0)
    color = cast(device, volume, function, integrator, step, camera, size, interval=interval).color
    to_index = volume.world_to_index
    h = step * 10.0
    for o, d, a, b, got in zip(*(v.reshape(20, -1) for v in (origins, directions, entry, exit, color)), strict=True):
        ray = integrate(volume, function, to_index[:3, :3] @ o + to_index[:3, 3], to_index[:3, :3] @ d, a[0], b[0])
        bound = 2 * 1e-6 * 115.0 * extinction + rounding(device)
        if integrator not in ("gauss2", "gauss3"):
            steepest = extinction / 10.0 * 1.5  # a corner to its neighbour, along three axes at once
            bound += line_error(integrator, h, ray.variation) + cut_error(integrator, h, steepest)
        assert abs(got[3] - ray.rgba[3]) <= bound


@each
@pytest.mark.parametrize("step", [0.11, 0.6])
def test_two_coloured_slabs_in_both_orders(device, integrator, step):
    """Values 1 and 3, a step of the transfer function at 2: it lies in the middle between the two voxel centres. Front
    over back is c1 a1 + (1 - a1) c2 a2, which is another colour from the other side. The value passes 2 at 2 per mm."""
    red, blue = 0.25, 0.4
    keys = [(0, (1, 0, 0), -math.expm1(-red)), (2, (1, 0, 0), -math.expm1(-red)),
            (2, (0, 0, 1), -math.expm1(-blue)), (4, (0, 0, 1), -math.expm1(-blue))]  # fmt: skip
    volume = along_y([1, 1, 1, 1, 3, 3, 3, 3])
    slabs = [(-math.expm1(-4 * red), (1, 0, 0)), (-math.expm1(-4 * blue), (0, 0, 1))]
    cell = row(integrator, 4.0) / 2.0
    bound = jump_error(integrator, step, red + blue, cell) + rounding(device)
    seen = []
    for side, order in ((-1, slabs), (1, slabs[::-1])):
        camera = FLAT.with_(eye=(0.3, side * 150.37, 0.2))
        color = cast(device, volume, TransferFunction(keys), integrator, step, camera).color
        assert np.abs(color - forms.layers(order)).max() <= bound
        seen.append(color[2, 2])
    assert seen[0][0] > seen[1][0] + 0.3
    assert seen[1][2] > seen[0][2] + 0.3


def test_pictures_of_n_slabs_composed_are_one_picture_of_all(device):
    """Over is associative: pictures of slabs, laid over each other from either end, are sum c_i a_i prod_j<i (1 - a_j).
    By depth, two of them find their order themselves."""
    slabs = [(0.3, (1, 0, 0)), (0.5, (0, 1, 0)), (0.2, (0, 0, 1)), (0.7, (1, 1, 0)), (0.4, (0, 1, 1))]
    pictures = []
    for i, (opacity, color) in enumerate(slabs):
        matrix = centred((4, 2, 4), (1.0, 1.0, 1.0))
        matrix[1, 3] += 2.0 * i
        function = TransferFunction([(0.0, color, opacity), (2.0, color, opacity)], reference_length=2.0)
        slab = Volume(np.ones((4, 2, 4), np.float32), matrix)
        pictures.append(cast(device, slab, function, INTEGRATORS[0], 0.7, depth_opacity=0.1))
    expected = forms.layers(slabs)
    for fold in ("from the front", "from behind"):
        total = pictures[0] if fold == "from the front" else pictures[-1]
        for picture in pictures[1:] if fold == "from the front" else pictures[-2::-1]:
            front, back = (total, picture) if fold == "from the front" else (picture, total)
            total = call("image.compose", device, front=front, back=back, mode="over")
        assert np.abs(total.color - expected).max() <= rounding(device)
    behind = call("image.compose", device, front=pictures[1], back=pictures[0], mode="nearest")
    assert np.abs(behind.color - forms.layers(slabs[:2])).max() <= rounding(device)
