"""A homogeneous cube: outline, coverage, what it hides and how deep it lies, in parallel and in central projection."""

from __future__ import annotations

import math

import numpy as np
import pytest

from nodegraph.data import Camera, TransferFunction, Volume
from nodegraph.data.space import centred
from tests.support import closed_forms as forms
from tests.support.calls import call
from tests.support.integrators import each, params, rounding

SIZE = (30, 27)
EDGE = 24.0
CAMERAS = {
    "orthographic": Camera(eye=(50, -90, 60), target=(1, 2, -1), projection="orthographic", height=52.0),
    "perspective": Camera(eye=(50, -90, 60), target=(1, 2, -1), up=(0.2, 0.1, 1.0), field_of_view=26.0),
    "on the axis": Camera(eye=(0, -70, 0), target=(0, 0, 0), field_of_view=40.0),
}
CUBE = Volume(np.ones((6, 8, 12), np.float32), centred((12, 8, 6), (2.0, 3.0, 4.0)))
CORNERS = (np.array([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]) - 0.5) * EDGE
each_camera = pytest.mark.parametrize("camera", CAMERAS.values(), ids=CAMERAS.keys())


def chords(camera):
    origins, directions, cosine = forms.rays(camera, SIZE)
    entry, exit = forms.box_interval(origins, directions, np.full(3, -EDGE / 2), np.full(3, EDGE / 2))
    return entry, np.maximum(exit - entry, 0.0), cosine


def cast(device, camera, extinction, **params):
    color = (0.9, 0.6, 0.3)
    function = TransferFunction([(0.0, color, 0.0), (1.0, color, -math.expm1(-extinction))])
    return call("render.raycast", device, SIZE, volume=CUBE, camera=camera, transfer_function=function, **params)


@each
@each_camera
def test_what_a_cube_hides(device, integrator, camera):
    """alpha = 1 - exp(-e L) with the chord L of each ray between the six planes; no rule errs on a constant. The ends
    of a chord are known to a few units in the last place of the distance, so the bound is e times those."""
    extinction = 0.06
    image = cast(device, camera, extinction, **params(integrator, 0.7))
    _, chord, _ = chords(camera)
    distance = 150.0
    bound = rounding(device) + extinction * rounding(device, distance)
    assert np.abs(image.color[..., 3] + np.expm1(-extinction * chord)).max() <= bound


@each_camera
def test_the_outline_of_a_cube_and_the_area_that_it_covers(device, camera):
    """A pixel shows the cube where its ray has a chord. Their number times the area of a pixel is the area of the
    outline (the convex hull of the projected corners), but for pixels that the outline itself crosses: its perimeter
    times the diagonal of a pixel. Seen in parallel, that area is also sum_i |n_i . d| a^2 (Cauchy)."""
    image = cast(device, camera, 0.5, mode="iso", iso_value=0.5, lit=False)
    _, chord, _ = chords(camera)
    shown = image.color[..., 3] > 0
    assert np.array_equal(shown[chord > 1e-3], np.ones((chord > 1e-3).sum(), bool))
    assert not shown[chord == 0].any()
    across, _ = forms.film(camera, SIZE)
    pixel = across[0, 1] - across[0, 0]
    area, perimeter = forms.area_and_perimeter(forms.outline(camera, CORNERS))
    assert abs(shown.sum() * pixel**2 - area) <= perimeter * math.sqrt(2) * pixel
    if camera.projection == "orthographic":
        assert area == pytest.approx(np.abs(forms.axes(camera)[2]).sum() * EDGE**2)


@pytest.mark.parametrize("mode", ["iso", "first_hit"])
@each_camera
def test_depth_of_the_faces_of_a_cube(device, camera, mode):
    """Depth is the distance at which the ray enters, times its cosine to the axis of view."""
    image = cast(device, camera, 0.5, mode=mode, iso_value=0.5, hit_extinction=0.2, lit=False)
    entry, chord, cosine = chords(camera)
    hit = chord > 1e-3
    assert np.abs(image.depth - entry * cosine)[hit].max() <= rounding(device, 150.0)
    assert np.isinf(image.depth[chord == 0]).all()


@each
@each_camera
def test_depth_at_which_a_share_is_hidden(device, integrator, camera):
    """1 - exp(-e s) = q at s = -log(1 - q) / e behind the face; rays with a shorter chord never hide as much."""
    extinction, share = 0.1, 0.6
    image = cast(device, camera, extinction, depth_opacity=share, **params(integrator, 0.9))
    entry, chord, cosine = chords(camera)
    reach = -math.log1p(-share) / extinction
    deep = chord > reach + 1e-2
    assert 0.05 < deep.mean() < 0.9
    # Rounding of what is hidden, over the extinction and what is left of the light.
    bound = rounding(device, 150.0) + rounding(device) / (extinction * (1 - share))
    assert np.abs(image.depth - (entry + reach) * cosine)[deep].max() <= bound
    assert np.isinf(image.depth[chord < reach - 1e-2]).all()
