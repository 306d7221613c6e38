"""A processor with a parameter of every kind, a source of volumes, and a session with both."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication

from nodegraph import Input, Output, Processor, params
from nodegraph import data as d
from nodegraph.editor.parameters import ParameterPanel
from nodegraph.editor.parameters.place import Place
from nodegraph.editor.parameters.row import ParameterRow
from nodegraph.editor.session import Session
from tests.editor.parameters.networks import finder, panel_of, session_with


class Values(Processor):
    """A cube with the values 0..999 HU."""

    volume = Output(d.Volume, doc="The cube.")
    last = params.Int(999, min=1, max=10000, doc="The last value.")

    def process(self, last):
        return d.Volume(np.linspace(0, last, 1000).reshape(10, 10, 10).astype("i2"), mapping=(1.0, 0.0, "HU"))


class Number(Processor):
    """A number."""

    number = Output(float, doc="The number.")

    def process(self):
        return 0.25


class Everything(Processor):
    """Has a parameter of every kind."""

    volume = Input(d.Volume, required=False, doc="What the transfer function is for.")
    image = Output(d.Image, doc="A picture.")

    amount = params.Float(1.0, min=0.0, max=100.0, soft_max=10.0, unit="mm", doc="A number with a soft range.")
    free = params.Float(0.5, doc="A number without ends.")
    tiny = params.Float(1e-3, min=1e-7, max=1.0, doc="A number over several powers of ten.")
    count = params.Int(3, min=1, max=12, doc="A whole number.")
    seed = params.Seed(doc="Where randomness starts.")
    on = params.Bool(False, doc="A switch.")
    mode = params.Choice("one", "two", "three_words", doc="One of three.")
    title = params.Text("", doc="A line.")
    notes = params.Text("", multiline=True, doc="Lines.")
    path = params.File("", suffixes=(".nii",), doc="A file.")
    folder = params.Folder("", doc="A folder.")
    color = params.Color((1.0, 0.5, 0.0), doc="A colour.")
    glass = params.Color((1.0, 0.5, 0.0, 0.5), doc="A colour with alpha.")
    vector = params.Vector((1.0, 2.0, 3.0), unit="mm", doc="Three numbers.")
    matrix = params.Matrix(doc="Sixteen numbers.")
    interval = params.Interval((10.0, 20.0), soft_min=0.0, soft_max=100.0, unit="HU", doc="Low and high.")
    box = params.Box(doc="Part of the world.")
    camera = params.Camera(doc="A camera.")
    light = params.Light(doc="A lamp.")
    plane = params.Plane(doc="A plane.")
    maybe = params.Plane(optional=True, doc="A plane or none.")
    table = params.TransferFunction(
        d.TransferFunction([(0.0, (1.0, 0.0, 0.0), 0.0), (500.0, (0.0, 1.0, 0.0), 0.5), (900.0, (0.0, 0.0, 1.0), 1.0)]),
        doc="Values to optics.",
    )
    areas = params.TransferFunction2D(
        d.TransferFunction2D(
            [
                d.Trapezoid.rectangle((100.0, 400.0), (0.0, 40.0), (1.0, 0.0, 0.0), 0.5, 0.25),
                d.Gaussian((600.0, 60.0), (60.0, 12.0), (0.0, 1.0, 0.0), 0.8),
            ]
        ),
        doc="Values and gradient magnitudes to optics.",
    )
    only_two = params.Float(0.0, visible_if={"mode": "two"}, doc="Means something in one mode.")

    def process(
        self, volume, amount, free, tiny, count, seed, on, mode, title, notes, path, folder, color, glass, vector,
        matrix, interval, box, camera, light, plane, maybe, table, areas, only_two,
    ):  # fmt: skip
        return d.Image(np.zeros((2, 2, 4), "f4"))


find = finder(Values, Number, Everything)


@pytest.fixture
def session(qapp: QApplication) -> Iterator[Session]:
    yield from session_with(find, cube="values", number="number", all="everything", other="everything")


@pytest.fixture
def panel(session: Session, qtbot: Any) -> ParameterPanel:
    """The panel with the node of every kind."""
    return panel_of(session, qtbot, 900)


@pytest.fixture
def row(panel: ParameterPanel) -> Any:
    """A function that gives the row of a parameter, scrolled into view."""

    def get(name: str) -> ParameterRow:
        found = panel.row("all", name)
        QApplication.processEvents()
        panel.ensureWidgetVisible(found)
        return found

    return get


@pytest.fixture
def alone(session: Session, qtbot: Any) -> Any:
    """A function that gives the row of a parameter without a panel around it, which takes a while to make."""

    made: dict[str, ParameterRow] = {}

    def get(name: str) -> ParameterRow:
        if name not in made:
            row = made[name] = ParameterRow(Place(session, "all", name))
            qtbot.addWidget(row)
            session.changed.connect(row.refresh)
            row.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
            row.resize(360, row.sizeHint().height())
            row.show()
            row.setFocus()
        made[name].activateWindow()
        QApplication.processEvents()
        return made[name]

    return get
