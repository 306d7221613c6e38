"""Every shipped workspace runs headless and shows what it showed before, on each device.

The pictures in expected/ were made by ``python -m tests.workspaces.test_workspaces`` with OpenGL (llvmpipe); they are
to be looked at before they are committed.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import nodegraph
from nodegraph.data import Image
from nodegraph.data.image import srgb_encode

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent.parent
EXPECTED = Path(__file__).parent / "expected"
NAMES = sorted(path.stem for path in (ROOT / "workspaces").glob("*.json"))
SIZE = (128, 128)


def load(name):
    return nodegraph.load(ROOT / "workspaces" / f"{name}.json")


def exact(net):
    """Without early termination, so that devices have no reason to differ."""
    if "termination" in net["raycast"].params or net["raycast"].mode == "composite":
        net["raycast"].termination = 1.0
    return net


@pytest.fixture(scope="module")
def pictures():
    """Each workspace on each device, rendered once: {name: {device: Image}}."""
    return {
        name: {device: exact(load(name)).run("view", size=SIZE, device=device) for device in ("gl", "cl", "cl64")}
        for name in NAMES
    }


def test_there_are_workspaces_to_test():
    assert {"first_light", "boundaries", "brain", "marschner_lobb"} <= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_devices_agree(pictures, name):
    """Mean at most 2e-5, 99.9 percentile at most 2e-3, at most 0.1 % of the pixels beyond; on RGBA in 0..1."""
    gl = pictures[name]["gl"].color
    assert gl.shape == (*SIZE[::-1], 4)
    assert np.ptp(gl[..., :3]) > 0.3, "the picture shows nothing"
    for device in ("cl", "cl64"):
        error = np.abs(gl - pictures[name][device].color)
        beyond = error.max(axis=-1) > 2e-3
        assert beyond.mean() <= 1e-3, device
        assert error[~beyond].mean() <= 2e-5, device
        if name != "marschner_lobb":  # whose ridges are silhouettes all over: a pixel hit or missed is one of the 0.1 %
            assert error.mean() <= 2e-5, device


@pytest.mark.parametrize("name", NAMES)
def test_the_picture_is_the_one_that_was_looked_at(pictures, name):
    from nodegraph import formats

    expected = formats.read(EXPECTED / f"{name}.png")
    assert isinstance(expected, Image)
    error = np.abs(srgb_encode(pictures[name]["gl"].color[..., :3]) - srgb_encode(expected.color[..., :3]))
    assert error.mean() <= 1 / 255
    assert np.percentile(error, 99.5) <= 3 / 255


def test_halving_the_step_converges_on_first_light():
    """Mean change at most 1/255 for the first halving, and each further at most 0.6 of the one before."""
    net = exact(load("first_light"))
    images = []
    shipped = net["raycast"].step
    for step in (shipped, shipped / 2, shipped / 4, shipped / 8):
        net["raycast"].step = step
        images.append(net.run("raycast", size=(64, 64)).color)
    changes = [float(np.abs(a - b).mean()) for a, b in pairwise(images)]
    assert changes[0] <= 1 / 255
    assert changes[1] <= 0.6 * changes[0]
    assert changes[2] <= 0.6 * changes[1]


def test_the_proxy_changes_nothing_on_first_light():
    net = exact(load("first_light"))
    boxed = net.run("raycast", size=(96, 96)).color
    net.disconnect("raycast.interval")
    whole = net.run("raycast", size=(96, 96)).color
    assert np.abs(boxed - whole).max() <= 1e-6


if __name__ == "__main__":
    EXPECTED.mkdir(exist_ok=True)
    for name in NAMES:
        from nodegraph import formats

        formats.write(exact(load(name)).run("view", size=SIZE, device="gl"), EXPECTED / f"{name}.png")
