"""A session with a picture in three dimensions and a cut, and waiting for what it shows."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
import pytest
from PySide6.QtWidgets import QApplication

from nodegraph import Camera, Float, Input, Interval, Output, Plane, Processor, data
from nodegraph.data import Image, Volume
from nodegraph.editor.session import Session
from nodegraph.editor.views.view import ViewWidget
from nodegraph.engine import Engine
from nodegraph.errors import UnknownProcessor
from nodegraph.network import Network
from tests.editor.views.hands import opened


class Block(Processor):
    """Voxels that say where they are: x + 100 y + 10000 z."""

    volume = Output(Volume, doc="The volume.")

    def process(self):
        z, y, x = np.indices((8, 10, 12), np.float32)
        return Volume(x + 100 * y + 10000 * z, np.diag([1.0, 2.0, 3.0, 1.0]))


class Ball(Processor):
    """A picture of the plane through the focus, its colour the direction of view."""

    volume = Input(Volume, doc="Not looked at.")
    image = Output(Image, doc="The picture.")
    camera = Camera(data.Camera((0, -100, 0), (0, 0, 0)), doc="Where from.")
    gain = Float(1.0, min=0.0, doc="Brightness; above 9 fails.")

    def process(self, volume, camera, gain, *, size):
        if gain > 9.0:
            raise ValueError("too bright")
        width, height = size
        color = np.zeros((height, width, 4), np.float32)
        color[..., :3] = np.abs(camera.basis[2]) * 0.5 * gain
        color[..., 3] = 0.5
        color[..., :3] *= 0.5
        depth = np.full((height, width), np.linalg.norm(np.subtract(camera.eye, camera.target)), np.float32)
        depth[:, : width // 2] = np.inf
        return Image(color, depth, np.full((height, width), 7, np.uint32))


class Cut(Processor):
    """A grey cut whose parameters are those of render.slice."""

    volume = Input(Volume, doc="What is cut.")
    image = Output(Image, doc="The picture.")
    plane = Plane(doc="Where to cut.")
    height = Float(0.0, min=0.0, doc="What the picture covers.")
    window = Interval((0.0, 0.0), doc="Black and white.")

    def process(self, volume, plane, height, window, *, size):
        low, high = window if window != (0.0, 0.0) else volume.range
        grey = np.full((size[1], size[0], 4), 0.25 if high > low else 0.0, np.float32)
        grey[..., 3] = 1.0
        return Image(grey)


class Level(Processor):
    """A plane that is computed."""

    plane = Output(data.Plane, doc="The plane.")

    def process(self):
        return data.Plane((5.0, 9.0, 11.0), (0.0, 1.0, 0.0))


OWN = {"trial.block": Block, "trial.ball": Ball, "trial.cut": Cut, "trial.level": Level}


def find(id: str) -> type[Processor]:
    if id in OWN:
        return OWN[id]
    if id.startswith("trial."):
        raise UnknownProcessor(f"{id}: no such processor")
    from nodegraph import registry

    return registry.find(id)


@pytest.fixture(scope="session", autouse=True)
def ids() -> None:
    for id, cls in OWN.items():
        cls.id = id


@pytest.fixture
def network() -> Network:
    net = Network(find)
    net.add("trial.block", "block")
    net.add("trial.ball", "ball")
    net.add("trial.cut", "cut")
    net.add("output.view", "view")
    net.add("output.view", "section")
    net.connect("block.volume", "ball.volume")
    net.connect("block.volume", "cut.volume")
    net.connect("ball.image", "view.image")
    net.connect("cut.image", "section.image")
    net.link("ball.camera", "camera")
    net.link("view.camera", "camera")
    net.history.clear()
    return net


@pytest.fixture
def session(qapp: QApplication, network: Network) -> Iterator[Session]:
    made = Session(network, Engine("cl", disk=False))
    made.told = []  # type: ignore[attr-defined]
    made.message.connect(made.told.append)  # type: ignore[attr-defined]
    yield made
    made.close()


@pytest.fixture
def until(qtbot) -> Callable[[Callable[[], object]], None]:
    """Wait until something holds."""

    def wait(holds: Callable[[], object]) -> None:
        qtbot.waitUntil(lambda: bool(holds()), timeout=10_000)

    return wait


@pytest.fixture
def view(qtbot, session, until) -> ViewWidget:
    widget = opened(qtbot, session, "view")
    until(lambda: widget.shown is not None)
    return widget


@pytest.fixture
def section(qtbot, session, until) -> ViewWidget:
    widget = opened(qtbot, session, "section")
    until(lambda: widget.shown is not None)
    until(lambda: widget.interactor._whole is not None)
    return widget
