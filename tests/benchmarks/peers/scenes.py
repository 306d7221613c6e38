"""The scenes that VTK and we render: volume, transfer function, camera, light; nothing that belongs to either."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nodegraph.data import Camera, Light, TransferFunction, Volume
from nodegraph.data.space import affine, centred
from tests.benchmarks.scene import phantom

CHEST = Path(__file__).resolve().parents[3] / "workspaces" / "data" / "cta_chest.nii.gz"
AMBIENT, DIFFUSE = 0.2, 0.8

BONES_AND_VESSELS = TransferFunction(
    [
        (150.0, (0.50, 0.03, 0.015), 0.0),
        (230.0, (0.55, 0.035, 0.02), 0.25),
        (340.0, (0.66, 0.06, 0.03), 0.5),
        (430.0, (0.75, 0.16, 0.08), 0.55),
        (540.0, (0.86, 0.60, 0.36), 0.7),
        (750.0, (0.96, 0.85, 0.66), 0.9),
        (2000.0, (1.0, 0.98, 0.94), 0.95),
    ],
    reference_length=1.5,
)
FOG = TransferFunction(
    [
        (-1900.0, (0.45, 0.55, 0.70), 0.0),
        (-1000.0, (0.45, 0.55, 0.70), 0.02),
        (-820.0, (0.55, 0.75, 0.95), 0.05),
        (0.0, (0.85, 0.50, 0.40), 0.05),
        (60.0, (0.95, 0.60, 0.45), 0.08),
        (250.0, (0.95, 0.75, 0.45), 0.15),
        (700.0, (1.0, 0.95, 0.85), 0.25),
    ],
    reference_length=10.0,
)


@dataclass(frozen=True)
class Scene:
    """What is rendered.

    volume:   its voxels stand along the axes of the world, and its outermost layer is invisible: VTK's volume ends at
              the centres of the outermost voxels, ours half a voxel beyond, so nothing may be seen there.
    lit:      ambient and diffuse light of a lamp at the eye, which is where VTK has it; without gloss.
    """

    name: str
    volume: Volume
    transfer_function: TransferFunction
    camera: Camera
    size: tuple[int, int]
    lit: bool = False

    def illuminated(self) -> Scene:
        """The same with light."""
        return replace(self, name=f"{self.name}, lit", lit=True)

    @property
    def light(self) -> Light:
        """The lamp at the eye."""
        return Light(type="point", frame="eye", position=(0.0, 0.0, 0.0))

    def step_length(self, step: float) -> float:
        """Millimetres of a step that is given in units of the least voxel spacing."""
        return step * float(self.volume.spacing.min())

    def seen_from(self, turn: float) -> Camera:
        """The camera after a turn by degrees about the target and its up axis."""
        eye, target = np.array(self.camera.eye), np.array(self.camera.target)
        axis = np.array(self.camera.up) / np.linalg.norm(self.camera.up)
        a, v = math.radians(turn), eye - target
        turned = v * math.cos(a) + np.cross(axis, v) * math.sin(a) + axis * (axis @ v) * (1.0 - math.cos(a))
        return self.camera.with_(eye=(target + turned).tolist())

    def visible_share(self) -> float:
        """Share of the voxels that have extinction."""
        data = self.volume.data
        low = int(data.min())
        counts = np.bincount((data - np.int32(low)).ravel())
        visible = self.transfer_function.evaluate(low + np.arange(len(counts)))[:, 3] > 0.0
        return float(counts[visible].sum() / data.size)


def scenes(side: int) -> list[Scene]:
    """Sparse and dense without light, at a side in pixels, and with light at half of it.

    A reference of a lit picture takes a hundred times as long: a quarter of an hour at 256 x 256.
    """
    half = (side // 2, side // 2)
    return [chest((side, side)), fog((side, side)), chest(half).illuminated(), fog(half).illuminated()]


def chest(size: tuple[int, int]) -> Scene:
    """Bones and vessels of the CT of a chest: most voxels are empty."""
    from nodegraph import formats

    read: Any = formats.read(str(CHEST))
    matrix, data = read.index_to_world, read.data
    if np.count_nonzero(matrix[:3, :3]) != 3:
        raise SystemExit(f"{CHEST}: its axes are not those of the world")
    # Mirrored axes are turned round in memory, so that a spacing and an origin say where the volume lies.
    for axis in range(3):
        if matrix[axis, axis] < 0.0:
            data = np.flip(data, 2 - axis)
    spacing = np.abs(np.diag(matrix)[:3])
    corner = read.corners.min(axis=0) + spacing / 2
    volume = Volume(bordered(data, -1000), affine(spacing.tolist(), corner.tolist()))
    camera = Camera(eye=(-116.0, -791.0, 743.0), target=(-3.5, -150.5, 678.0), up=(0.0, 0.0, 1.0), field_of_view=27.0)
    return Scene("sparse", volume, BONES_AND_VESSELS, camera, size)


def fog(size: tuple[int, int], side: int = 256) -> Scene:
    """The phantom of the other benchmarks as a fog: everything is visible, nothing is opaque."""
    volume = Volume(bordered(phantom(side), -2000), centred((side, side, side), (256.0 / side,) * 3))
    camera = Camera(eye=(180.0, -560.0, 120.0), target=(0.0, 0.0, 0.0), up=(0.0, 0.0, 1.0), field_of_view=30.0)
    return Scene("dense", volume, FOG, camera, size)


def bones(size: tuple[int, int], side: int) -> Scene:
    """The bones and vessels of the phantom, of any resolution: the sparse scene of the measurement over sizes."""
    dense = fog(size, side)
    volume = Volume(bordered(dense.volume.data, -1000), dense.volume.index_to_world)
    return replace(dense, name="sparse", volume=volume, transfer_function=BONES_AND_VESSELS)


def bordered(data: NDArray[Any], value: int) -> NDArray[Any]:
    """A copy whose outermost layer of voxels holds ``value``."""
    result = np.full(data.shape, value, data.dtype)
    result[1:-1, 1:-1, 1:-1] = data[1:-1, 1:-1, 1:-1]
    return result
