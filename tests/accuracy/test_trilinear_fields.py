"""Random trilinear fields against rays that are integrated to the last digits, for each integrator and device."""

from __future__ import annotations

import numpy as np

from nodegraph.data import Camera, TransferFunction, Volume
from nodegraph.data.space import centred
from tests.support import closed_forms as forms
from tests.support.calls import call
from tests.support.cell_twin import integrate
from tests.support.integrators import cut_error, each, line_error, params, rounding, table_error

SIZE = (6, 5)
CAMERA = Camera(eye=(22.0, -60.0, 17.0), target=(0.4, 0.1, -0.3), field_of_view=11.0)
VOLUME = Volume(
    np.random.default_rng(77).random((8, 7, 9)).astype(np.float32), centred((9, 7, 8), (1.2, 1.5, 1.1))
)  # fmt: skip
KEYS = [(0.0, (0.1, 0.2, 0.9), 0.0), (0.45, (0.9, 0.3, 0.1), 0.02), (1.0, (0.9, 0.8, 0.6), 0.4)]
FUNCTION = TransferFunction(KEYS)
SLOPES = np.diff(FUNCTION.extinction([key[2] for key in KEYS])) / np.diff([key[0] for key in KEYS])


def exact():
    """Rays of the camera, each integrated by the twin; None where it misses."""
    origins, directions, _ = forms.rays(CAMERA, SIZE)
    entry, exit = forms.box_interval(origins, directions, VOLUME.corners[0], VOLUME.corners[7])
    linear, shift = VOLUME.world_to_index[:3, :3], VOLUME.world_to_index[:3, 3]
    return [
        integrate(VOLUME, FUNCTION, linear @ o + shift, linear @ d, a, b) if b > a else None
        for o, d, a, b in zip(
            origins.reshape(-1, 3), directions.reshape(-1, 3), entry.ravel(), exit.ravel(), strict=True
        )
    ]


RAYS = exact()
LENGTH = 20.0


@each
def test_opacity_of_a_random_field(device, integrator):
    """|alpha - exact| <= |tau - exact|, and that is the rule's error for as much as the slope of extinction varies on
    this very ray; where the value is taken for linear, for as much as the slope of the value varies, times the steepest
    slope of the function. What the table adds is the bend at its middle key, cut off within a row."""
    assert sum(ray is not None for ray in RAYS) > 20
    for step in (0.2, 0.7):
        image = call(
            "render.raycast", device, SIZE, volume=VOLUME, camera=CAMERA, transfer_function=FUNCTION,
            **params(integrator, step),
        )  # fmt: skip
        h = step * 1.1
        for ray, got in zip(RAYS, image.color.reshape(-1, 4), strict=True):
            if ray is None:
                assert got[3] == 0
                continue
            linear_value = integrator in ("preintegrated", "adaptive")
            variation = SLOPES.max() * ray.value_variation if linear_value else ray.variation
            bound = line_error(integrator, h, variation) + cut_error(integrator, h, SLOPES.max() * 3.0)
            bound += table_error(integrator, LENGTH, 1.0, np.ptp(SLOPES)) + rounding(device)
            assert abs(got[3] - ray.rgba[3]) <= bound


def test_cellwise_gives_all_digits_of_colour_and_opacity(device):
    """Between cell faces and keys everything is smooth, so eight points leave rounding: in single precision that of the
    places of cuts, about 1e-6 of the distance to the eye, times the extinction there; in double none to speak of."""
    image = call(
        "render.raycast", device, SIZE, volume=VOLUME, camera=CAMERA, transfer_function=FUNCTION,
        **params("cellwise", 1.0, order=8),
    )  # fmt: skip
    bound = 1e-9 if device.name == "cl64" else 4e-6
    for ray, got in zip(RAYS, image.color.reshape(-1, 4), strict=True):
        assert np.abs(got - (0 if ray is None else ray.rgba)).max() <= bound
