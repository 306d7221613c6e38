"""What has no picture is refused, in one sentence that names the place: in Python, and on the command line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from nodegraph import registry
from nodegraph.data import Camera, Image, Labels, Light, TransferFunction, Volume
from nodegraph.data.space import affine

INF, NAN = float("inf"), float("nan")


@dataclass(frozen=True)
class Refusal:
    """``make()`` raises a GraphError whose text holds ``said``."""

    extreme: str
    make: Callable[[], Any]
    said: str

    def __str__(self) -> str:
        return self.extreme.replace(" ", "_")


@dataclass(frozen=True)
class Command:
    """Arguments of ``run`` after the workspace; exit code 2, or 1 for what only running can tell."""

    arguments: tuple[str, ...]
    said: str
    code: int = 2

    def __str__(self) -> str:
        return "_".join(self.arguments)


def raycast(parameter: str, value: Any) -> Callable[[], Any]:
    """Check a value as everybody who sets it does."""
    return lambda: registry.find("render.raycast").params[parameter].check(value, f"raycast.{parameter}")


def key(value: float, opacity: float = 0.5) -> list[Any]:
    return [value, [1, 1, 1], opacity]


REFUSALS = (
    Refusal("eye = target", lambda: Camera(eye=(1, 2, 3), target=(1, 2, 3)), "the eye lies at the target"),
    Refusal("eye and target a subnormal apart", lambda: Camera(eye=(0, 0, 0), target=(0, 5e-324, 0)), "the eye lies"),
    Refusal("up along the view", lambda: Camera(eye=(0, 0, 9), target=(0, 0, 0)), "up is parallel to the view"),
    Refusal("up against the view", lambda: Camera(eye=(0, 0, -9), target=(0, 0, 0)), "up is parallel to the view"),
    Refusal("up nearly along the view", lambda: Camera(eye=(1e-10, 0, 9), target=(0, 0, 0)), "up is parallel"),
    Refusal("no up", lambda: Camera(up=(0, 0, 0)), "or zero"),
    Refusal("an eye that is nan", lambda: Camera(eye=(NAN, 0, 0)), "camera.eye[0]: expected a finite number"),
    Refusal("an eye at infinity", lambda: Camera(eye=(0, -INF, 0)), "camera.eye[1]: expected a finite number"),
    Refusal("a field of view of 0", lambda: Camera(field_of_view=0.0), "outside 0..180 degrees"),
    Refusal("a field of view of 180", lambda: Camera(field_of_view=180.0), "outside 0..180 degrees"),
    Refusal("a height of 0", lambda: Camera(height=0.0), "a height above 0 mm"),
    Refusal("light from nowhere", lambda: Light("directional", "eye", (0, 0, 0)), "a direction other than 0 0 0"),
    Refusal("negative light", lambda: Light(intensity=-1.0), "at least 0"),
    Refusal("an opacity above 1", lambda: TransferFunction([key(0, 1.5)]), "outside 0..1"),
    Refusal("an opacity that is nan", lambda: TransferFunction([key(0, NAN)]), "expected a finite number"),
    Refusal("a key at infinity", lambda: TransferFunction([key(INF)]), "expected a finite number"),
    Refusal("keys that descend", lambda: TransferFunction([key(1), key(0)]), "values must ascend"),
    Refusal("three keys at a value", lambda: TransferFunction([key(0), key(0), key(0)]), "at most two keys may share"),
    Refusal("a reference length of 0", lambda: TransferFunction([key(0)], 0.0), "a length above 0 mm"),
    Refusal("a volume of no voxels", lambda: Volume(np.zeros((0, 4, 4), np.float32)), "the data is empty"),
    Refusal("voxels without width", lambda: Volume(np.zeros((2, 2, 2)), affine((1, 0, 1))), "a voxel has no volume"),
    Refusal("voxels nowhere", lambda: Volume(np.zeros((2, 2, 2)), affine((1, 1, 1), (0, NAN, 0))), "a finite affine"),
    Refusal("a scale of 0", lambda: Volume(np.zeros((2, 2, 2)), mapping=(0.0, 1.0, "")), "a scale other than 0"),
    Refusal("complex voxels", lambda: Volume(np.zeros((2, 2, 2), complex)), "expected integers or reals"),
    Refusal("ids above 2^32", lambda: Labels(np.full((1, 1, 1), 2**32, np.uint64)), "expected ids in 0..4294967295"),
    Refusal("a picture of no pixels", lambda: Image(np.zeros((0, 4, 4), np.float32)), "the picture is empty"),
    Refusal("a step of 0", raycast("step", 0.0), "outside 0.001..1000.0 voxel"),
    Refusal("a step of 1001 voxels", raycast("step", 1001.0), "outside 0.001..1000.0 voxel"),
    Refusal("a step that is nan", raycast("step", NAN), "nan is not allowed"),
    Refusal("a shininess of 0", raycast("shininess", 0.0), "below 1.0"),
)  # fmt: skip

CAMERA = '{"eye": [0, -9, 0], "target": [0, 0, 0], %s}'
COMMANDS = (
    Command(("--size", "0x8"), "'0x8'"),
    Command(("--size", "1e9x1"), "'1e9x1'"),
    Command(("--size=-4x4",), "-4x4"),
    Command(("--size", "100000000x100000000"), "100000000"),
    Command(("--set", "raycast.step=0"), "raycast.step: 0.0 voxel is outside 0.001..1000.0 voxel"),
    Command(("--set", "raycast.step=1e9"), "raycast.step: 1000000000.0 voxel is outside"),
    Command(("--set", "raycast.step=nan"), "raycast.step: nan is not allowed here"),
    Command(("--set", "raycast.step=inf"), "must be finite"),
    Command(("--set", 'raycast.camera={"eye": [0, 0, 0], "target": [0, 0, 0]}'), "the eye lies at the target"),
    Command(("--set", "raycast.camera=" + CAMERA % '"up": [0, 1, 0]'), "up is parallel to the view"),
    Command(("--set", "raycast.camera=" + CAMERA % '"field_of_view": 180'), "outside 0..180 degrees"),
    Command(("--set", "raycast.camera=" + CAMERA % '"projection": "fisheye"'), "expected one of perspective"),
    Command(("--set", 'raycast.transfer_function={"keys": [[1, [1, 1, 1], 1], [0, [1, 1, 1], 1]]}'), "must ascend"),
    Command(("--set", 'raycast.transfer_function={"keys": [["nan", [1, 1, 1], 1]]}'), "finite"),
    Command(("--set", "source.voxels=0,4,4"), "source.voxels[0]"),
    Command(("--set", "source.voxels=100000,100000,100000"), "voxels"),
    Command(("--set", "source.extent=0,1,1"), "source.extent[0]"),
)
