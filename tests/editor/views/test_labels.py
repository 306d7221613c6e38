"""Picking labels: in a cut, in depth, from ids of a picture; where they are tinted, and what the table says."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QPointF, Qt
from PySide6.QtTest import QTest

from nodegraph import data
from nodegraph.commands import Add, Connect, Set, SetUI
from nodegraph.data import Camera, Image, Plane, Volume
from nodegraph.editor.parameters.transfer_function.label_table import LabelTable
from nodegraph.editor.views.labels import LabelSelection, extent, id_at, ids_of, veil_of
from nodegraph.editor.views.sight import Sight
from nodegraph.editor.views.view import ViewWidget
from nodegraph.offers import label_ids
from tests.editor.views.hands import click, move, opened

SPACING = np.diag([1.0, 2.0, 0.5, 1.0])


def patches() -> np.ndarray:
    """Two boxes, 3 and 7, in a volume of zeros (z, y, x)."""
    ids = np.zeros((16, 16, 16), np.uint8)
    ids[4:12, 2:8, 2:8] = 3
    ids[4:12, 9:14, 9:14] = 7
    return ids


@pytest.fixture
def labels(session, qtbot, until, tmp_path) -> ViewWidget:
    """A cut through the middle of a file of labels, as large as the volume."""
    from nodegraph import formats

    formats.write(Volume(patches(), SPACING), tmp_path / "ids.nrrd")
    session.do(Add("source.volume", "file", {"path": str(tmp_path / "ids.nrrd")}))
    session.do(Add("trial.cut", "slice", {"plane": Plane((7.5, 15, 4), (0, 0, 1)), "height": 32.0}))
    session.do(Add("output.view", "patches"))
    session.do(Connect("file.volume", "slice.volume"))
    session.do(Connect("slice.image", "patches.image"))
    widget = opened(qtbot, session, "patches", 220, 240)
    until(lambda: widget.shown is not None and widget.volume() is not None)
    until(lambda: widget.shown.size == widget.pixels)
    return widget


def at(view: ViewWidget, *world: float) -> tuple[float, float]:
    return view.sight().seen(world)


def test_a_click_tells_number_name_and_size(labels, session, until) -> None:
    chosen = LabelSelection.of(session)
    session.do(SetUI("slice", "labels", {"transfer_function": {"names": {"3": "liver"}}}))
    click(labels, *at(labels, 5, 10, 4))
    until(lambda: chosen.label is not None)
    assert (chosen.label.id, chosen.label.name, chosen.label.voxels) == (3, "liver", 8 * 6 * 6)
    assert chosen.label.size == pytest.approx(8 * 6 * 6 * 1.0)
    assert session.told[-1].text == "label 3 (liver): 288 voxels, 288.0 mm³"
    assert session.told[-1].path == "patches"
    click(labels, *at(labels, 11, 22, 4))
    until(lambda: chosen.label.id == 7)
    click(labels, *at(labels, 14.5, 4, 4))  # nothing there
    until(lambda: chosen.label is None)


def test_the_line_below_says_the_label(labels, session, until) -> None:
    session.do(SetUI("slice", "labels", {"transfer_function": {"names": {"3": "liver"}}}))
    until(lambda: labels.toolbox.labels.text(3.0) != "")
    move(labels, QPointF(*at(labels, 5, 10, 4)))
    until(lambda: labels.status.startswith("label 3 (liver)"))
    move(labels, QPointF(*at(labels, 11, 22, 4)))
    until(lambda: labels.status.startswith("label 7   at"))


def test_the_label_is_tinted_where_it_is(labels, session, until) -> None:
    before = labels.area.grab().toImage()
    click(labels, *at(labels, 5, 10, 4))
    tool = labels.toolbox.labels
    until(lambda: tool._veil is not None)
    after = labels.area.grab().toImage()

    def differs(*world: float) -> bool:
        x, y = (int(number) for number in at(labels, *world))
        return before.pixelColor(x, y) != after.pixelColor(x, y)

    assert differs(5, 10, 4)
    assert not differs(11, 22, 4)
    session.do(Set("slice.plane", Plane((7.5, 15, 0), (0, 0, 1))))  # below the box
    until(lambda: tool._veil is None)
    session.undo()
    until(lambda: tool._veil is not None)
    QTest.keyClick(labels, Qt.Key.Key_Escape)
    assert LabelSelection.of(session).label is None


def test_values_that_are_no_labels_are_not_taken_for_some(section, session, until) -> None:
    done = []
    LabelSelection.of(session).changed.connect(lambda: done.append(1))
    click(section, 60, 60)
    session.work(lambda: None, lambda _: done.append(2))
    until(lambda: 2 in done)
    assert LabelSelection.of(session).label is None
    assert section.toolbox.labels.text(3.0) == ""
    assert label_ids(Volume(np.random.default_rng(1).integers(0, 50, (9, 9, 9)))) == ()


def test_ids_of_a_picture_are_labels(view, session, until) -> None:
    width, height = view.area.width(), view.area.height()
    click(view, width * 0.75, height * 0.5)
    until(lambda: LabelSelection.of(session).label is not None)
    assert LabelSelection.of(session).label.id == 7
    assert session.told[-1].text == "label 7"


def test_in_depth_the_label_behind_the_surface_is_meant() -> None:
    field = Volume(patches(), SPACING)
    surface = np.array([5.0, 3.2, 4.0])  # a voxel of nothing, in front of the box that begins at y = 3
    assert id_at(field, surface[None] - [[0, 0.5, 0]]) == 0
    assert id_at(field, np.array([[5, 2.5, 4], [5, 3.5, 4], [5, 20.0, 4]])) == 3
    assert extent(field, 7) == (8 * 5 * 5, 8 * 5 * 5 * 1.0)
    camera = Camera((5, -100, 4), (5, 0, 4), projection="orthographic", height=32)
    size = (32, 32)
    depth = np.full(size[::-1], 102.9, np.float32)  # a plane just before the boxes' front
    image = Image(np.zeros((32, 32, 4), np.float32), depth)
    veil = veil_of(image, Sight(size, camera=camera), field, 3)
    seen = np.array([[veil.pixelColor(x, y).alpha() > 0 for x in range(32)] for y in range(32)])
    rows, columns = np.nonzero(seen)
    # World x 1.5..7.5 around 5, world z 1.75..5.75 around 4, a pixel for a millimetre.
    assert (columns.min(), columns.max()) == (12, 17)
    assert (rows.min(), rows.max()) == (14, 17)
    perspective = camera.with_(projection="perspective", field_of_view=20.0)
    assert veil_of(image, Sight(size, camera=perspective), field, 3) is not None
    assert veil_of(image, Sight(size, camera=perspective), field, 99) is None


def test_names_of_labels_that_bring_them_are_known() -> None:
    ids = data.Labels(patches(), SPACING, {3: "liver"})
    assert ids_of(ids) is None  # any id may be there
    assert id_at(ids, np.array([[5.0, 10.0, 4.0]])) == 3


def test_the_table_follows_the_view_and_the_view_the_table(session, qtbot, network) -> None:
    from types import SimpleNamespace

    session.do(Add("render.slice", "colored"))
    node = session.network.node("colored")
    place = SimpleNamespace(session=session, node=node, path="colored", name="transfer_function")
    table = LabelTable(place)
    qtbot.addWidget(table)
    table.show_ids({0: 9, 3: 288, 7: 200})
    chosen = LabelSelection.of(session)
    from nodegraph.editor.views.labels import Found

    chosen.select(Found(7))
    assert table._rows() == {2}
    table.table.selectRow(1)
    assert chosen.label.id == 3
