"""Two nodes with a transfer function each and nothing else, over a cube, and the editor of the first."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from typing import Any

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtWidgets import QApplication

from nodegraph import Choice, Input, Output, Processor, params
from nodegraph import data as d
from nodegraph.editor.parameters import ParameterPanel
from nodegraph.editor.session import Session
from tests.editor.parameters.networks import finder, panel_of, session_with

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)


class Values(Processor):
    """A cube with the values 0..999 HU, or with the labels 0, 1, 2, 5."""

    volume = Output(d.Volume, doc="The cube.")
    last = params.Int(999, min=1, max=10000, doc="The last value.")
    labels = params.Bool(False, doc="Whether it holds labels.")

    def process(self, last, labels):
        if labels:
            return d.Volume(np.array([0, 0, 0, 1, 1, 2, 5, 5], "u1").reshape(2, 2, 2))
        return d.Volume(np.linspace(0, last, 1000).reshape(10, 10, 10).astype("i2"), mapping=(1.0, 0.0, "HU"))


class Cropped(Processor):
    """A part of a cube, as geometry that rays are made of."""

    volume = Input(d.Volume, doc="The cube.")
    image = Output(d.Image, doc="Entry and exit.")
    crop = params.Box(None, unit="", handle="box", doc="Part of the volume, 0..1.")

    def process(self, volume, crop):
        return d.Image(np.zeros((2, 2, 2), "f4"))


class Shading(Processor):
    """Colours a volume: the colour of the value 500, everywhere."""

    volume = Input(d.Volume, required=False, doc="What the transfer function is for.")
    interval = Input(d.Image, required=False, doc="Where.")
    image = Output(d.Image, doc="A picture.")

    interpolation = Choice("linear", "nearest", doc="How values between voxels are found.")
    table = params.TransferFunction(
        d.TransferFunction([(0.0, RED, 0.0), (500.0, GREEN, 0.5), (900.0, BLUE, 1.0)]), doc="Values to optics."
    )

    def process(self, volume, interval, interpolation, table, *, size):
        row = table.evaluate([500.0])[0].astype("f4")
        return d.Image(np.broadcast_to(np.append(row[:3], 1.0).astype("f4"), (size[1], size[0], 4)).copy())


find = finder(Values, Cropped, Shading)


@pytest.fixture
def session(qapp: QApplication) -> Iterator[Session]:
    yield from session_with(find, cube="values", all="shading", other="shading")


@pytest.fixture
def panel(session: Session, qtbot: Any) -> ParameterPanel:
    """The panel with the first node."""
    return panel_of(session, qtbot, 600)


@pytest.fixture
def field(panel: ParameterPanel, qtbot: Any) -> Any:
    """The editor of the first node, with its histogram there."""
    found = panel.row("all", "table").field
    qtbot.waitUntil(lambda: found.canvas.plot.histogram is not None, timeout=10000)
    QApplication.processEvents()
    return found


@pytest.fixture
def at(field: Any) -> Callable[[float, float], QPoint]:
    """Where a value and an opacity lie on the plot."""
    plot = field.canvas.plot
    return lambda value, opacity: QPointF(plot.x(value), plot.y(opacity)).toPoint()


@pytest.fixture
def drag(field: Any, qtbot: Any) -> Callable[..., None]:
    """Drag on the plot from a point over others."""

    def act(start: QPoint, *stops: QPoint) -> None:
        qtbot.mousePress(field.canvas, Qt.MouseButton.LeftButton, pos=start)
        for stop in stops:
            qtbot.mouseMove(field.canvas, stop)
        qtbot.mouseRelease(field.canvas, Qt.MouseButton.LeftButton, pos=stops[-1])

    return act


@pytest.fixture
def table(session: Session) -> Callable[[], d.TransferFunction]:
    """What the document has."""
    return lambda: session.network.get("all.table")
