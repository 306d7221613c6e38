"""Slices of affine fields are affine, on each device."""

import math

import numpy as np
import pytest

from nodegraph.data import Plane, TransferFunction, Volume
from nodegraph.data.space import centred, transform_points
from nodegraph.requests import LEVELS, level
from tests.support.calls import call


def ramp(dims=(12, 10, 8), spacing=(1.0, 1.5, 2.0)):
    """value = 2 x - y + 3 z + 5 in world mm."""
    matrix = centred(dims, spacing)
    z, y, x = np.meshgrid(*(np.arange(n) for n in dims[::-1]), indexing="ij")
    world = transform_points(matrix, np.stack([x, y, z], -1))
    return Volume((world @ [2.0, -1.0, 3.0] + 5.0).astype(np.float32), matrix)


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, -1, 0), (1, 0, 0), (0.3, -0.5, 0.8)])
def test_an_affine_field_is_shown_exactly(device, normal):
    volume = ramp()
    plane = Plane((0.5, 0.25, -0.5), normal)
    low, high = -60.0, 80.0
    size = (21, 17)
    image = call("render.slice", device, size, volume=volume, plane=plane, height=6.0, window=(low, high))
    right, up = plane.axes
    pixel = 6.0 / size[1]
    ys, xs = np.mgrid[: size[1], : size[0]]
    world = (
        np.array(plane.origin)
        + (xs - (size[0] - 1) / 2)[..., None] * pixel * right
        - (ys - (size[1] - 1) / 2)[..., None] * pixel * up
    )
    inside = np.all(np.abs(world) <= [5.4, 6.6, 6.9], axis=-1)
    grey = (world @ [2.0, -1.0, 3.0] + 5.0 - low) / (high - low)
    assert inside.mean() > 0.5
    assert np.abs(image.color[..., 0] - grey)[inside].max() < 2e-5
    assert np.all(image.color[inside][:, 3] == 1)


def test_outside_is_transparent_and_zero_height_shows_everything(device):
    volume = ramp()
    image = call("render.slice", device, (64, 64), volume=volume, plane=Plane((0, 0, 0), (0, 0, 1)))
    rows = np.flatnonzero(image.color[..., 3].any(axis=1))
    assert rows[0] <= 1
    assert rows[-1] >= 62
    assert image.color[32, 0, 3] == 0


def test_nearest_shows_stored_values_only(device):
    volume = Volume(np.arange(27, dtype=np.uint8).reshape(3, 3, 3))
    image = call(
        "render.slice", device, (30, 30), volume=volume, plane=Plane((0, 0, 0), (0, 0, 1)), interpolation="nearest",
        window=(0.0, 26.0),
    )  # fmt: skip
    assert np.allclose(np.unique(image.color[..., 0]) * 26, np.arange(9, 18), atol=1e-4)


def test_the_head_is_up_and_the_patient_faces_the_viewer(device):
    """Coronal, seen from the front: z up, and the patient's left (+x) on the right of the picture."""
    volume = ramp()
    image = call(
        "render.slice", device, (32, 32), volume=volume, plane=Plane((0, 0, 0), (0, -1, 0)), window=(-60.0, 80.0)
    )
    grey = image.color[..., 0]
    assert grey[4, 16] > grey[28, 16]
    assert grey[16, 24] > grey[16, 8]


def test_a_transfer_function_colours_with_its_own_opacity(device):
    volume = Volume(np.full((4, 4, 4), 0.5, np.float32))
    tf = TransferFunction([(0.0, (1, 0, 0), 0.0), (1.0, (1, 0, 0), 0.75)], reference_length=3.0)
    image = call("render.slice", device, (8, 8), volume=volume, coloring="transfer_function", transfer_function=tf)
    assert np.allclose(image.color[4, 4], [0.5, 0, 0, 0.5], atol=1e-6)  # half the extinction of 0.75: sqrt(0.25)


def test_the_middle_of_an_even_number_of_slices_is_the_same_slice_everywhere(device):
    """It lies exactly between two voxels; a far origin and a tiny spacing leave the decision to the last digit."""
    data = np.arange(4, dtype=np.float32)[:, None, None] * np.ones((4, 6, 6), np.float32)
    for spacing in (1.0, 1e-6, 0.7):
        volume = Volume(data, centred((6, 6, 4), [spacing] * 3))
        image = call("render.slice", device, (9, 9), volume=volume, interpolation="nearest", window=(0.0, 4.0))
        assert np.all(image.color[2:7, 2:7, 0] == 0.5)


@pytest.mark.parametrize("value", [0.3, 1.0, 3e38, -7e-9])
def test_a_constant_volume_is_black_in_its_own_range(device, value):
    volume = Volume(np.full((4, 4, 4), value, np.float32))
    image = call("render.slice", device, (5, 5), volume=volume)
    assert np.array_equal(image.color[2, 2], [0.0, 0.0, 0.0, 1.0])


@pytest.mark.parametrize("n", LEVELS[:4])
def test_a_coarser_picture_shows_the_same_plane_in_the_size_that_was_asked_for(device, n):
    """What is shown is affine, so what is interpolated between fewer pixels of it is exact, but at the edges."""
    kernels = []
    volume = ramp()
    plane = Plane((0.5, 0.25, -0.5), (0.3, -0.5, 0.8))
    common = {"volume": volume, "plane": plane, "height": 6.0, "window": (-60.0, 80.0)}
    size = (53, 45)
    final = call("render.slice", device, size, **common)
    recorder = Recorder(device, kernels)
    coarse = call("render.slice", recorder, size, quality=level(n), **common)
    assert coarse.size == final.size == size
    assert coarse.color.dtype == final.color.dtype
    small = kernels[0][1]
    assert small[0] * small[1] == pytest.approx(size[0] * size[1] / n, rel=0.12)
    assert kernels[1][1] == size
    assert np.all(final.color[..., 3] == 1.0)
    border = math.ceil(0.5 * size[1] / small[1])  # beyond the centres of the outermost pixels that were cast
    assert np.abs(coarse.color - final.color)[border:-border, border:-border].max() < 3e-5


@pytest.mark.parametrize("n", LEVELS[:4])
def test_a_coarser_picture_covers_the_same_of_a_volume_that_is_shown_whole(device, n):
    common = {"volume": ramp(), "plane": Plane((0.5, 0.25, -0.5), (0.3, -0.5, 0.8)), "window": (-60.0, 80.0)}
    final = call("render.slice", device, (53, 45), **common)
    coarse = call("render.slice", device, (53, 45), quality=level(n), **common)
    lost = np.abs(coarse.color - final.color).mean()
    assert 0.0 < lost < 0.012 * math.sqrt(n)
    assert coarse.color[..., 3].mean() == pytest.approx(final.color[..., 3].mean(), rel=0.03)
    shifted = [np.roll(coarse.color, by, axis) for axis in (0, 1) for by in (-1, 1)]
    assert lost < min(np.abs(other - final.color).mean() for other in shifted)


def test_final_runs_one_kernel(gl):
    kernels = []
    call("render.slice", Recorder(gl, kernels), (9, 7), volume=ramp())
    assert kernels == [("render/slice", (9, 7))]


class Recorder:
    """A device that tells which kernels run, and over how many pixels."""

    def __init__(self, device, ran):
        self.device, self.ran = device, ran

    def run(self, kernel, size, **bindings):
        self.ran.append((kernel, tuple(size)))
        return self.device.run(kernel, size, **bindings)
