"""What gradients made beforehand cost, and what they save.

The phantom of the other benchmarks at 128^3, lit, 192 x 192, a step of one voxel. The ray-caster's choice rests on two
of these figures (`saves_time` in nodegraph/data/gradients.py): the time to make gradients, per voxel, and the time that
they save, per sample of rays in what can be seen.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from nodegraph.compute import Devices
from nodegraph.data import TransferFunction, Volume, bricks, gradients
from tests.benchmarks.measure import Row, interleaved, ms
from tests.benchmarks.scene import Scene, scene
from tests.support.calls import call

SIDE = 128
SIZE = (192, 192)
FUNCTIONS = {
    "fog": TransferFunction([(-1100.0, (0.5, 0.6, 0.7), 0.002), (700.0, (1.0, 0.9, 0.8), 0.02)]),
    "bones": TransferFunction([(300.0, (1.0, 0.7, 0.5), 0.0), (700.0, (1.0, 0.95, 0.85), 0.3)]),
}


def rows() -> Iterator[Row]:
    content = scene(SIDE)
    voxels = SIDE**3
    made = interleaved({"made": lambda: gradients.index_gradient(content.volume)}, rounds=3)["made"]
    yield Row("gradients made beforehand, int16", made / voxels * 1e9, "ns", detail=f"per voxel; {ms(made)} in all")
    devices = Devices()
    try:
        for name in ("gl", "cl"):
            for what, function in FUNCTIONS.items():
                yield _saved(devices.choose(name).device, content, what, function)
    finally:
        devices.close()


def _saved(device: Any, content: Scene, what: str, function: TransferFunction) -> Row:
    """Time that one frame takes less with gradients that are there already, by the samples that are estimated."""
    kept: dict[Any, Any] = {}

    def memo(made: Any, *args: Any, disk: bool = False) -> Any:
        # Of the arguments that are as lasting as this function, and of those that are equal when they are the same.
        key = (made, *(id(each) if isinstance(each, Volume) else each for each in args))
        if key not in kept:
            kept[key] = made(*args)
        return kept[key]

    def frame(kind: str) -> Any:
        return call(
            "render.raycast", device, SIZE, memo=memo, volume=content.volume, camera=content.camera, step=1.0,
            transfer_function=function, gradients=kind,
        ).color  # fmt: skip

    taken = interleaved({kind: lambda kind=kind: frame(kind) for kind in ("on_the_fly", "precomputed")}, rounds=5)
    visible = bricks.visible_bricks(bricks.brick_ranges(content.volume), function.table(2048), function.lookup(2048))
    step_length = float(content.volume.spacing.min())
    samples = gradients.visible_samples(content.volume, content.camera, SIZE, step_length, float(visible.mean()))
    saved = taken["on_the_fly"] - taken["precomputed"]
    detail = f"per sample; {ms(taken['on_the_fly'])} / {ms(taken['precomputed'])}, {samples:.3g} samples"
    return Row(f"{device.name}: saved by them in {what}", saved / samples * 1e9, "ns", detail=detail)
