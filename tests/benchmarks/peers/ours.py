"""Our ray-caster on the scenes, through the engine, as every user runs it."""

from __future__ import annotations

import hashlib
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nodegraph import formats
from nodegraph.accuracy.reference import reference
from nodegraph.data import Camera
from nodegraph.engine import Engine
from nodegraph.network import Network
from nodegraph.report import Report
from nodegraph.requests import level
from tests.benchmarks.peers.points import Picture
from tests.benchmarks.peers.scenes import AMBIENT, DIFFUSE, Scene

FOLDER = Path(tempfile.gettempdir()) / "nodegraph-peers"


class Ours:
    """A scene as a network of a file and a ray-caster.

    The file lies in ``folder`` and is written once, so that a reference of it is kept from one run to the next.
    """

    def __init__(self, scene: Scene, engine: Engine, folder: Path = FOLDER) -> None:
        self.scene, self.engine = scene, engine
        self.network = network = Network()
        network.add("source.volume", "volume", path=str(_written(scene, folder)))
        network.add(
            "render.raycast",
            "raycast",
            transfer_function=scene.transfer_function,
            camera=scene.camera,
            lit=scene.lit,
            **({"light": scene.light, "ambient": AMBIENT, "diffuse": DIFFUSE, "specular": 0.0} if scene.lit else {}),
        )
        network.connect("volume.volume", "raycast.volume")
        self.usual: dict[str, Any] = {}
        """What the settings that were tried were before."""

    def frame(self, settings: Mapping[str, Any], camera: Camera | None = None, quality: str = "final") -> NDArray[Any]:
        """Render and bring the picture to the host: linear premultiplied RGBA (h, w, 4). Other settings as shipped.

        A setting ``level`` n stands for the quality interactive/n.
        """
        return self.run(settings, camera, quality)[0]

    def run(
        self, settings: Mapping[str, Any], camera: Camera | None = None, quality: str = "final"
    ) -> tuple[NDArray[Any], Report]:
        """The picture, and what the engine tells of it."""
        node = self.network["raycast"]
        settings = dict(settings)
        if "level" in settings:
            quality = level(settings.pop("level"))
        for name in settings:
            self.usual.setdefault(name, getattr(node, name))
        for name, value in (self.usual | settings).items():
            if getattr(node, name) != value:
                setattr(node, name, value)
        node.camera = camera or self.scene.camera
        report = self.engine.evaluate(self.network, "raycast.image", size=self.scene.size, quality=quality)
        report.raise_first()
        color: NDArray[Any] = report.values["raycast", "image"].color
        return color, report

    def picture(self, settings: Mapping[str, Any], camera: Camera | None = None) -> Picture:
        """Linear RGB over black, (h, w, 3)."""
        return np.asarray(self.frame(settings, camera)[..., :3], np.float64)

    def truth(self, say: Callable[[str], None] = print) -> Picture:
        """What the picture converges to: linear RGB over black in double precision. Kept on disk."""
        found = reference(self.network, "raycast.image", self.scene.size)
        say(f"{self.scene.name}: {found.summary()}")
        return np.asarray(found.value.color[..., :3], np.float64)


def _written(scene: Scene, folder: Path) -> Path:
    volume = scene.volume
    told = hashlib.blake2b(volume.data.tobytes() + volume.index_to_world.tobytes(), digest_size=8).hexdigest()
    path = folder / f"{scene.name.split(',')[0]}-{told}.nrrd"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        formats.write(volume, path)
    return path
