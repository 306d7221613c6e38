"""The slab with a closed form as a plug-in file, and a workspace of it, for tests of the command line."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

PLUGIN = '''
"""A slab whose extinction grows linearly along the ray."""
import math
import time

import numpy as np
from nodegraph import Camera, Float, Output, Processor
from nodegraph.data import Image

class Slab(Processor):
    """Its opacity, by samples at the beginnings of equal pieces."""

    image = Output(Image, doc="Grey.")
    step = Float(0.25, min=2.0**-16, soft_min=2.0**-6, max=1.0, quality="lower", doc="Length of a piece.")
    camera = Camera(doc="Where the eye is.")

    def process(self, step, camera, *, size, device):
        if device.name != "cl64":  # so that references cost nothing
            time.sleep(min(4e-3 / step, 0.3))
        depth = 1.0 / max(abs(float(camera.basis[2][1])), 0.2) ** 2
        hidden = 1.0 - math.exp(-depth * (1.0 - step))
        color = np.full((size[1], size[0], 4), hidden)
        color[..., :3] = 0.0
        return Image(color.astype(device.real))
'''


def error(step: float, depth: float = 1.0) -> float:
    """The error of a step in closed form, seen at right angles."""
    return math.exp(-depth) * math.expm1(depth * step)


def write_plugin(folder: Path) -> Path:
    """Write the plug-in ``trial.slab`` below a folder for NODEGRAPH_PATH."""
    (folder / "trial").mkdir(parents=True)
    (folder / "trial" / "slab.py").write_text(PLUGIN)
    return folder


def write_workspace(file: Path, **params: Any) -> Path:
    """slab -> view, cameras linked, with content that nobody here knows."""
    camera = {"kind": "Camera", "value": {"eye": [0.0, -600.0, 0.0], "target": [0.0, 0.0, 0.0]}}
    content = {
        "nodegraph": 1,
        "author": {"name": "somebody", "since": 1994},
        "variables": {"camera": camera},
        "nodes": {
            "slab": {
                "type": "trial.slab",
                "version": 1,
                "params": params,
                "links": {"camera": "camera"},
                "colour": "unknown here",
            },
            "stranger": {"type": "no.such", "params": {"x": [1, 2, {"y": None}]}},
            "view": {
                "type": "output.view",
                "version": 1,
                "params": {"width": 6, "height": 4},
                "links": {"camera": "camera"},
                "inputs": {"image": "slab.image"},
            },
        },
        "ui": {"nodes": {"slab": {"x": 3}}, "zoom": 1.5},
    }
    file.write_text(json.dumps(content))
    return file
