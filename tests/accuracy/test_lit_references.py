"""References of lit scenes converge: light jumps and swings along a ray, and pieces are cut and halved there."""

from __future__ import annotations

from pathlib import Path

import pytest

import nodegraph
from nodegraph.accuracy.reference import reference
from nodegraph.data import Camera, Gaussian, TransferFunction, TransferFunction2D, Trapezoid
from nodegraph.engine import Engine
from nodegraph.network import Network

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def double():
    """An engine in double precision that keeps nothing on disk."""
    with Engine("cl64", disk=False) as engine:
        yield engine


def test_the_reference_of_a_lit_torus_converges_in_every_pixel(double):
    """Rays past a torus meet places where the gradient turns from the viewer, turns from the lamp, and vanishes."""
    network = Network()
    network.add("source.synthetic", "field", kind="torus", voxels=(12, 12, 12))
    network.add("filter.gaussian_blur", "smooth", sigma=4.0)
    function = TransferFunction([(0.1, (0.9, 0.4, 0.2), 0.0), (0.4, (0.9, 0.8, 0.3), 0.1)])
    camera = Camera(eye=(60.0, -400.0, 90.0), field_of_view=20.0)
    network.add("render.raycast", "raycast", camera=camera, transfer_function=function, lit=True)
    network.connect("field.volume", "smooth.volume")
    network.connect("smooth.smoothed", "raycast.volume")
    found = reference(network, "raycast", size=(12, 12), engine=double)
    assert found.value.color[..., 3].max() > 0.1
    assert found.converged, found.summary()
    assert found.mask.all()


def test_the_reference_of_the_brain_converges_in_every_pixel(double):
    network = nodegraph.load(ROOT / "workspaces" / "brain.json")
    found = reference(network, "view", size=(48, 48), engine=double)
    assert found.value.color[..., :3].max() > 0.1
    assert found.converged, found.summary()
    assert found.mask.all()


def test_the_reference_by_value_and_gradient_magnitude_converges_too(double):
    """An edge that is not soft, a soft one and a Gaussian about the surface of a torus, under light."""
    network = Network()
    network.add("source.synthetic", "field", kind="torus", voxels=(12, 12, 12))
    network.add("filter.gaussian_blur", "smooth", sigma=4.0)
    areas = [
        Trapezoid((0.05, 0.4), (0.1, 0.2), (0.0, 0.02), 0.0, (0.9, 0.4, 0.2), 0.05),
        Trapezoid((0.2, 0.6), (0.3, 0.3), (0.001, 0.05), 0.5, (0.9, 0.8, 0.3), 0.1),
        Gaussian((0.3, 0.01), (0.05, 0.01), (0.2, 0.4, 0.9), 0.1),
    ]
    camera = Camera(eye=(60.0, -400.0, 90.0), field_of_view=20.0)
    network.add("render.raycast_2d", "raycast", camera=camera, transfer_function=TransferFunction2D(areas), lit=True)
    network.connect("field.volume", "smooth.volume")
    network.connect("smooth.smoothed", "raycast.volume")
    found = reference(network, "raycast", size=(12, 12), engine=double)
    assert found.value.color[..., 3].max() > 0.1
    assert found.settings["raycast.integrator"] == "cellwise"
    assert found.rounds <= 3
    assert found.converged, found.summary()
    assert found.mask.all()
