"""Volumes that do not fit the memory budget: what a frame costs, and the most memory that is held meanwhile.

Each case is a process of its own, so that its memory is its own:

    python -m tests.benchmarks.peers.large FILE PIXELS BUDGET_MB
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

SIDE = 1024
BUDGET_MB = 512
COARSE = 256
CHUNK = 64
FRAMES = 3


@dataclass(frozen=True)
class Large:
    """What rendering a file took.

    seconds, processor: of a frame whose camera has moved, wall and processor time; first: of the first frame, which
                        looks through all of the file.
    held:               most bytes of memory, without pages of a mapped file, less what the process held before.
    blocks:             whether it was rendered block by block.
    """

    case: str
    side: int
    budget_mb: int
    first: float
    seconds: float
    processor: float
    held: int
    blocks: bool


def large(say: Callable[[str], None], side: int = SIDE, picture: int = 512) -> list[Large]:
    """The sparse scene as a memory map and as OME-Zarr, within a budget and, half as wide, without need of one."""
    found = []
    with tempfile.TemporaryDirectory(prefix="nodegraph-large-") as folder:
        for wide, budgets in ((side // 2, (BUDGET_MB // 4, 8 * BUDGET_MB)), (side, (BUDGET_MB,))):
            for name in ("memory map", "OME-Zarr"):
                path = Path(folder) / f"{wide}{'.npy' if name == 'memory map' else '.ome.zarr'}"
                (write_npy if name == "memory map" else write_zarr)(path, wide)
                for budget in budgets:
                    if wide * wide * wide * 2 < budget << 20 or wide == side or budget == budgets[0]:
                        found.append(_measured(name, wide, path, picture, budget))
                        say(describe(found[-1]))
    return found


def describe(case: Large) -> str:
    """One line."""
    how = "in blocks" if case.blocks else "in one piece"
    return (
        f"{case.side}^3 int16 as {case.case}, budget {case.budget_mb} MB: {how}, first frame {case.first:.2f} s, "
        f"then {case.seconds * 1000:.0f} ms ({case.processor * 1000:.0f} ms of processor time), "
        f"{case.held / 1e6:.0f} MB held"
    )


def _measured(name: str, side: int, path: Path, picture: int, budget: int) -> Large:
    command = [sys.executable, "-m", __spec__.name, str(path), str(picture), str(budget)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return Large(case=name, side=side, budget_mb=budget, **json.loads(done.stdout.splitlines()[-1]))


def slabs(side: int) -> Iterator[tuple[int, NDArray[np.int16]]]:
    """The phantom at a resolution that never stands in memory: (first plane, planes), interpolated from 256^3."""
    from tests.benchmarks.scene import phantom

    coarse = phantom(min(COARSE, side)).astype(np.float32)
    n = len(coarse)
    at = np.clip((np.arange(side) + 0.5) / side * n - 0.5, 0, n - 1)
    below = np.minimum(at.astype(int), n - 2)
    weights = np.zeros((side, n), np.float32)
    weights[np.arange(side), below] = 1 - (at - below)
    weights[np.arange(side), below + 1] += at - below
    for first in range(0, side, CHUNK):
        rows = weights[first : first + CHUNK]
        planes = np.stack([weights @ np.tensordot(row, coarse, 1) @ weights.T for row in rows])
        yield first, np.rint(planes).astype(np.int16)


def write_npy(path: Path, side: int) -> None:
    """A NumPy file, which is mapped when it is read."""
    array = np.lib.format.open_memmap(path, "w+", np.int16, (side,) * 3)
    for first, planes in slabs(side):
        array[first : first + len(planes)] = planes
    array.flush()


def write_zarr(path: Path, side: int) -> None:
    """OME-Zarr in chunks of 64^3, compressed."""
    import zarr

    group = zarr.open_group(str(path), mode="w")
    array = group.create_array("0", shape=(side,) * 3, chunks=(CHUNK,) * 3, dtype="int16")
    for first, planes in slabs(side):
        array[first : first + len(planes)] = planes
    axes = [{"name": axis, "type": "space", "unit": "millimeter"} for axis in "zyx"]
    scale = [{"type": "scale", "scale": [1.0, 1.0, 1.0]}]
    datasets = [{"path": "0", "coordinateTransformations": scale}]
    group.attrs["ome"] = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": datasets, "name": "phantom"}]}


class Anonymous:
    """The most memory of this process that is no page of a file, looked at fifty times a second."""

    def __init__(self) -> None:
        self.most = self.before = _anonymous()
        self._going = True
        self._thread = threading.Thread(target=self._watch, daemon=True)
        self._thread.start()

    def _watch(self) -> None:
        while self._going:
            self.most = max(self.most, _anonymous())
            time.sleep(0.02)

    def stop(self) -> int:
        """Bytes above what there was at the start."""
        self._going = False
        self._thread.join()
        return self.most - self.before


def _anonymous() -> int:
    with open("/proc/self/status", encoding="ascii") as file:
        return next(int(line.split()[1]) * 1024 for line in file if line.startswith("RssAnon"))


def render(path: Path, picture: int, budget_mb: int) -> dict[str, Any]:
    """Render some frames of a file in this process."""
    from nodegraph.data import Camera
    from nodegraph.engine import Engine
    from nodegraph.network import Network
    from tests.benchmarks.peers.scenes import BONES_AND_VESSELS

    network = Network()
    network.add("source.volume", "volume", path=str(path))
    network.add("render.raycast", "raycast", transfer_function=BONES_AND_VESSELS, step=1.0, lit=False)
    network.connect("volume.volume", "raycast.volume")
    node = network["raycast"]
    times = []
    with Engine("gl", disk=False, cache_bytes=budget_mb << 19, device_bytes=budget_mb << 19) as engine:
        memory = Anonymous()
        for i in range(1 + FRAMES):
            started = time.perf_counter(), time.process_time()
            report = engine.evaluate(network, "volume.volume")
            report.raise_first()
            volume = report.values["volume", "volume"]
            centre, width = volume.centre, float(np.linalg.norm(volume.corners[7] - volume.corners[0]))
            eye = centre + np.array([0.19 + 0.001 * i, -0.59, 0.13]) * width * 2.2
            node.camera = Camera(eye=eye, target=centre, up=(0.0, 0.0, 1.0), field_of_view=30.0)
            report = engine.evaluate(network, "raycast.image", size=(picture, picture))
            report.raise_first()
            color = report.values["raycast", "image"].color
            times.append((time.perf_counter() - started[0], time.process_time() - started[1]))
        held = memory.stop()
    assert color.max() > 0.1
    later = times[1:]
    whole = int(np.prod(volume.dims)) * volume.dtype.itemsize
    return {
        "first": times[0][0],
        "seconds": median(wall for wall, _ in later),
        "processor": median(own for _, own in later),
        "held": held,
        "blocks": whole > 0.8 * (budget_mb << 20),
    }


if __name__ == "__main__":
    print(json.dumps(render(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))))
