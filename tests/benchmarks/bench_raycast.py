"""The ray-caster against hand-written ones.

The same 256^3 phantom, camera, step, storage, compiler options and outputs (colour and depth in 32 bits), brute force,
512 x 512. Each time is a whole frame: launch, wait, colour and depth on the host.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from nodegraph.compute import Devices
from tests.benchmarks.measure import Row, interleaved, ms
from tests.benchmarks.scene import SIZE, STEP, Scene, scene

TABLE = 2048
TERMINATION = 254.0 / 255.0
LIMIT = 1.10


def rows() -> Iterator[Row]:
    content = scene()
    devices = Devices()
    try:
        for name in ("gl", "cl"):
            device = devices.choose(name).device
            yield _compare(name, device, content)
    finally:
        devices.close()


def _compare(name: str, device: Any, content: Scene) -> Row:
    # An OpenGL context belongs to a thread, and our device counts on its own to stay current on this one.
    with ThreadPoolExecutor(1) as thread:
        peer = thread.submit(_peer, name, content).result()

        def frame() -> Any:
            return thread.submit(peer.render).result()

        ours, theirs = render(device, content), frame()
        difference = float(np.abs(ours - theirs).max())
        assert difference < 5e-3, f"{name}: the two ray-casters differ by {difference:.3g}; they do not render the same"
        taken = interleaved({"ours": lambda: render(device, content), "peer": frame})
        thread.submit(peer.close).result()
    return Row(
        f"{name}: nodegraph / hand-written {'moderngl' if name == 'gl' else 'pyopencl'}",
        taken["ours"] / taken["peer"],
        "x",
        LIMIT,
        f"{ms(taken['ours'])} / {ms(taken['peer'])}; pictures differ by at most {difference:.1e}",
    )


def _peer(name: str, content: Scene) -> Any:
    if name == "gl":
        from tests.benchmarks.peer_gl import PeerGL

        return PeerGL(content)
    from nodegraph.compute.cl import best_driver
    from tests.benchmarks.peer_cl import PeerCL

    # `best_driver` is what the device itself took: both run on the same one, with its options.
    return PeerCL(content, best_driver("float"), ["-cl-single-precision-constant"])


def render(device: Any, content: Scene) -> np.ndarray:
    """One frame of our ray-caster, unlit, colour and depth on the host; returns the colour (h, w, 4)."""
    function = content.transfer_function
    result = device.run(
        "render/raycast",
        SIZE,
        defines={"INTEGRATOR": 0, "TERMINATION": True, "FINITE": True},
        volume=content.volume,
        camera=content.camera.rays(SIZE, content.volume.world_to_index),
        step_length=STEP,
        table=function.table(TABLE),
        lookup=function.lookup(TABLE),
        depth_opacity=0.5,
        termination=TERMINATION,
    )
    result.depth.array  # noqa: B018  brought to the host, as the peer does
    color: np.ndarray = result.color.array
    return color
