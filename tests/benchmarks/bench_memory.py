"""Memory: the peak of a run above that of an 8^3 volume on the same device.

Resident memory of a fresh process that reads a file, casts rays through it and writes a picture. On software devices
the texture or buffer counts, too: the device's memory is the host's.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from nodegraph import formats
from nodegraph.data import Volume
from nodegraph.data.space import centred
from tests.benchmarks.children import child
from tests.benchmarks.measure import Row
from tests.benchmarks.scene import phantom

SIDE = 256
MB = 1e6

PEAK = """
import json, pathlib, re, resource, sys
from nodegraph.cli import main
assert main(["run", *sys.argv[1:]]) == 0
status = pathlib.Path("/proc/self/status")
if status.exists():  # on Linux the peak of the process that started this one counts in getrusage
    peak = 1024 * int(re.search(r"VmHWM:\\s*(\\d+)", status.read_text())[1])
else:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
print(json.dumps(peak))
"""


def rows() -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        small = {dtype: _workspace(folder, 8, dtype, suffix) for dtype, suffix in FILES}
        large = {dtype: _workspace(folder, SIDE, dtype, suffix) for dtype, suffix in FILES}
        for device in ("gl", "cl"):
            for dtype, suffix in FILES:
                base = _peak(small[dtype], device, folder)
                peak = _peak(large[dtype], device, folder)
                volume = SIDE**3 * np.dtype(dtype).itemsize
                yield Row(
                    f"{device}: peak above 8^3, {SIDE}^3 {dtype} from {suffix}",
                    (peak - base) / MB,
                    "MB",
                    (2.2 * volume + 60e6) / MB,
                    f"volume {volume / MB:.0f} MB, peaks {base / MB:.0f} and {peak / MB:.0f} MB",
                )


FILES = (("int16", ".nii.gz"), ("float32", ".nrrd"))


def _workspace(folder: Path, side: int, dtype: str, suffix: str) -> Path:
    file = folder / f"{side}{suffix}"
    formats.write(Volume(phantom(side).astype(dtype), centred((side,) * 3, (256.0 / side,) * 3)), file)
    nodes = {
        "ct": {"type": "source.volume", "version": 1, "params": {"path": str(file)}},
        "raycast": {
            "type": "render.raycast",
            "version": 1,
            "inputs": {"volume": "ct.volume"},
            "params": {"lit": False},
        },
        "view": {"type": "output.view", "version": 1, "inputs": {"image": "raycast.image"}},
    }
    path = folder / f"{side}{suffix}.json"
    path.write_text(json.dumps({"nodegraph": 1, "nodes": nodes}))
    return path


def _peak(workspace: Path, device: str, folder: Path) -> int:
    """Bytes; the less of two runs, because the first may have to compile kernels."""
    options = ("--device", device, "--size", "128x128", "--out", str(folder / "view.png"))
    peaks: list[int] = [child(PEAK, str(workspace), *options) for _ in range(2)]
    return min(peaks)
