"""Presets of one's own, files of JSON, colour maps."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog

from nodegraph.data import TransferFunction
from nodegraph.data.image import srgb_encode
from nodegraph.editor.parameters import preset_files
from nodegraph.editor.parameters.transfer_function import colormaps, grips, keys, presets
from nodegraph.editor.parameters.transfer_function.bells import Bell, Shape
from nodegraph.errors import FormatError

LEFT = Qt.MouseButton.LeftButton
RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
FUNCTION = TransferFunction([(0.0, RED, 0.0), (500.0, GREEN, 0.5), (900.0, BLUE, 1.0)])


@pytest.fixture(autouse=True)
def fresh(config: Path) -> Any:
    """Nobody's presets are remembered from or for other tests."""
    presets.forget()
    yield
    presets.forget()


def row_of(listed: Any, text: str) -> int:
    return next(i for i in range(listed.count()) if listed.item(i).text() == text)


def test_one_of_ones_own_is_saved_used_and_deleted(field: Any, session: Any, qtbot: Any, table: Any) -> None:
    field.canvas.add_bell(300.0)
    shape = field.canvas.shape
    qtbot.mouseClick(field.presets, LEFT)
    qtbot.keyClicks(field.list.name, "Two hills/1")
    qtbot.keyClick(field.list.name, Qt.Key.Key_Return)
    assert field.list.list.item(0).text() == "Own: Two hills/1", "one's own come first"
    field.list.close()
    file = preset_files.own_folder() / "Two_hills_1.json"
    assert json.loads(file.read_text())["unit"] == "HU"
    session.network.set("all.table", FUNCTION)
    assert not field.canvas.shape.bells
    qtbot.mouseClick(field.presets, LEFT)
    field.list.list.setCurrentRow(0)
    qtbot.keyClick(field.list.list, Qt.Key.Key_Return)
    assert table() == shape.function
    assert field.canvas.shape == shape, "bells are part of it"
    qtbot.mouseClick(field.presets, LEFT)
    count = field.list.list.count()
    field.list.list.setCurrentRow(count - 1)
    qtbot.keyClick(field.list.list, Qt.Key.Key_Delete)
    assert field.list.list.count() == count, "those that were shipped stay"
    field.list.list.setCurrentRow(0)
    qtbot.keyClick(field.list.list, Qt.Key.Key_Delete)
    assert field.list.list.count() == count - 1
    assert not file.exists()
    field.list.close()


def test_what_cannot_be_saved_is_said(field: Any, session: Any, qtbot: Any, config: Path) -> None:
    config.parent.mkdir(parents=True, exist_ok=True)
    config.write_text("a file where a folder should be")
    said: list[str] = []
    field.refused.connect(said.append)
    qtbot.mouseClick(field.presets, LEFT)
    qtbot.keyClicks(field.list.name, "Lost")
    qtbot.keyClick(field.list.name, Qt.Key.Key_Return)
    field.list.close()
    assert said
    assert said[0].startswith("Lost: could not be saved")


def test_export_and_import(field: Any, session: Any, tmp_path: Path, table: Any, monkeypatch: Any) -> None:
    field.canvas.add_bell(300.0)
    shape = field.canvas.shape
    file = tmp_path / "hills.json"
    monkeypatch.setattr(QFileDialog, "getSaveFileName", lambda *_: (str(tmp_path / "hills"), ""))
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: (str(file), ""))
    field.export_file()
    session.network.set("all.table", TransferFunction())
    field.import_file()
    assert field.canvas.shape == shape
    assert table() == shape.function
    file.write_text(json.dumps(FUNCTION.to_json()))
    field.import_file()
    assert table() == FUNCTION, "an encoded value alone is read, too"
    said: list[str] = []
    field.refused.connect(said.append)
    for text in ("{", "[]", "3", '{"name": "x", "kind": "Camera", "value": {}}', '{"keys": [[1]]}'):
        file.write_text(text)
        field.import_file()
        with pytest.raises(FormatError):
            presets.load(file)
    assert len(said) == 5
    assert table() == FUNCTION


def test_bells_of_a_preset_hold_only_for_its_keys() -> None:
    shape = Shape(FUNCTION, (Bell(300.0, 20.0, 0.5, RED),))
    made = presets.Preset("a", "", "HU", False, shape.function, shape=shape).to_json()
    assert presets.read(made).over(0.0, 1.0) == shape  # type: ignore[union-attr]
    made["value"]["keys"].pop()
    assert not presets.read(made).over(0.0, 1.0).bells  # type: ignore[union-attr]


def test_a_colour_map_leaves_opacities_alone(field: Any, session: Any, qtbot: Any, table: Any) -> None:
    values = np.linspace(-50.0, 950.0, 500)
    before = table().evaluate(values)[:, 3]
    qtbot.mouseClick(field.presets, LEFT)
    field.list.list.setCurrentRow(row_of(field.list.list, "Colours: Viridis"))
    qtbot.keyClick(field.list.list, Qt.Key.Key_Return)
    assert table().evaluate(values)[:, 3] == pytest.approx(before, rel=1e-9, abs=1e-12)
    assert table().keys[0].color == pytest.approx((0.0582, 0.0003, 0.0890), abs=2e-3), "viridis begins dark violet"
    assert len(table().keys) > 10
    session.undo()
    assert table() == FUNCTION


def test_the_colours_of_any_preset(field: Any, session: Any, qtbot: Any, table: Any) -> None:
    qtbot.mouseClick(field.presets, LEFT)
    qtbot.mouseClick(field.list.colors, LEFT)
    field.list.list.setCurrentRow(row_of(field.list.list, "CT: Bone"))
    qtbot.keyClick(field.list.list, Qt.Key.Key_Return)
    bone = next(one for one in presets.presets() if one.name == "Bone").value
    assert table().evaluate([450.0])[0, :3] == pytest.approx(bone.evaluate([450.0])[0, :3], abs=1e-4)
    assert keys.opacity_at(table(), [500.0, 900.0]) == pytest.approx([0.5, 1.0])


def test_a_colour_map_begins_an_empty_function(field: Any, session: Any, table: Any) -> None:
    session.network.set("all.table", TransferFunction())
    field.take_preset(next(one for one in presets.presets() if one.colors), True)
    assert table().domain == field.canvas.plot.histogram.usual()
    assert keys.opacity_at(table(), [table().domain[1]])[0] == pytest.approx(0.5)


def test_maps_made_from_formulas_are_even() -> None:
    t = np.linspace(0.0, 1.0, 257)
    steps = np.linalg.norm(np.diff(colormaps.lab(colormaps.grey(t)), axis=0), axis=1)
    assert steps.max() / steps.min() < 1.01
    steps = np.linalg.norm(np.diff(colormaps.lab(colormaps.cool_to_warm(t)), axis=0), axis=1)
    assert steps.max() / steps.min() < 1.05
    assert srgb_encode(colormaps.cool_to_warm(t)[[0, 128, 256]]) * 255 == pytest.approx(
        np.array([[59, 76, 192], [221, 221, 221], [180, 4, 38]]), abs=1.0
    )
    light = colormaps.lab(colormaps.cube_helix(t))[:, 0]
    assert (np.diff(light) > 0.0).all()
    assert colormaps.cube_helix(t)[[0, -1]].ravel() == pytest.approx([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


@pytest.mark.parametrize("name", ["Viridis", "Magma", "Inferno", "Plasma"])
def test_shipped_maps_get_lighter_evenly(name: str) -> None:
    one = next(one for one in presets.presets() if one.name == name)
    light = colormaps.lab(one.value.evaluate(np.linspace(0.0, 1.0, 101))[:, :3])[:, 0]
    assert (np.diff(light) > 0.0).all()
    assert np.diff(light).max() < 4.0 * np.diff(light).mean()
    assert one.colors


def test_few_keys_are_enough() -> None:
    t = np.linspace(0.0, 1.0, 257)
    exact = colormaps.cube_helix(t)
    kept = colormaps.reduced(exact)
    made = np.stack([np.interp(t, [p for p, _ in kept], [c[i] for _, c in kept]) for i in range(3)], axis=1)
    assert len(kept) < 30
    assert np.abs(srgb_encode(made) - srgb_encode(exact)).max() <= colormaps.TOLERANCE + 1e-9


def test_fresh_colours_differ() -> None:
    colors = [grips.fresh_color(place) for place in range(8)]
    assert min(np.abs(np.subtract(a, b)).max() for i, a in enumerate(colors) for b in colors[:i]) > 0.15
