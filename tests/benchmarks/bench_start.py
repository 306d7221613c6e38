"""Starting: the cost of an import, and of a cold run beside the sum of its parts.

The parts are timed alone in a fresh process: the interpreter, the imports, opening the device, reading the volume,
upload with rendering (compilation of the kernels included), writing the picture.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from tests.benchmarks.children import child, run
from tests.benchmarks.measure import Row, ms

FIRST_LIGHT = Path(__file__).resolve().parents[2] / "workspaces" / "first_light.json"
ROUNDS = 5

IMPORT = """
import json, time
import numpy
start = time.perf_counter()
import nodegraph
print(json.dumps(time.perf_counter() - start))
"""

PARTS = """
import json, sys, time
clock = [time.perf_counter()]
def lap():
    clock.append(time.perf_counter())
    return clock[-1] - clock[-2]

name, workspace, out = sys.argv[1:]
import numpy, OpenImageIO
__import__({"gl": "moderngl", "cl": "pyopencl"}[name])
import nodegraph.cli.run, nodegraph.compute.devices, nodegraph.engine, nodegraph.formats.png, nodegraph.pictures
parts = {"imports": lap()}
engine = nodegraph.Engine(device=name)
engine.devices
engine.call(lambda: engine.devices.choose(name))
parts["context"] = lap()
network = nodegraph.load(workspace)
report = engine.evaluate(network, size=(512, 512))
assert report.ok, report.errors
parts["read"] = report.timings["ct"]
parts["upload and render"] = sum(report.timings.values()) - parts["read"]
report.shown["view"]["shown"].color
lap()
nodegraph.formats.write(report.shown["view"]["shown"], out)
parts["write"] = lap()
print(json.dumps(parts))
"""


def rows() -> Iterator[Row]:
    child(IMPORT)  # writes the byte code
    seconds = statistics.median(child(IMPORT) for _ in range(11))
    yield Row("import nodegraph, after numpy", seconds * 1000, "ms", 60.0, "median of 11 fresh interpreters")
    for name in ("gl", "cl"):
        yield _cold(name)


def _cold(name: str) -> Row:
    with tempfile.TemporaryDirectory() as folder:
        out = str(Path(folder) / "view.png")
        command = [sys.executable, "-m", "nodegraph", "run", str(FIRST_LIGHT), "--size", "512x512", "--device", name]
        run([*command, "--out", out])  # fills the driver's cache of kernels
        whole, parts = [], []
        for _ in range(ROUNDS):
            start = time.perf_counter()
            run([*command, "--out", out])
            whole.append(time.perf_counter() - start)
            start = time.perf_counter()
            run([sys.executable, "-c", "pass"])
            interpreter = time.perf_counter() - start
            parts.append({"interpreter": interpreter, **child(PARTS, name, str(FIRST_LIGHT), out)})
    medians = {part: statistics.median(one[part] for one in parts) for part in parts[0]}
    detail = f"{ms(statistics.median(whole))}; {', '.join(f'{part} {ms(taken)}' for part, taken in medians.items())}"
    ratio = statistics.median(total / sum(one.values()) for total, one in zip(whole, parts, strict=True))
    return Row(f"{name}: cold run of first_light, 512 x 512 / sum of its parts", ratio, "x", 1.5, detail)
