"""The quad view: four views of one volume, added as one step or taken from those that are there."""

from __future__ import annotations

from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from nodegraph import Network, workspace
from nodegraph.data import Plane
from nodegraph.editor.window import Window
from tests.editor.conftest import MakeWindow
from tests.editor.proof.test_monkey import cast
from tests.editor.test_session import small


def opened(make_window: MakeWindow, folder: Path, network: Network) -> Window:
    workspace.save(network, folder / "one.json")
    window = make_window()
    window.open_file(folder / "one.json")
    return window


def places(window: Window) -> dict[str, tuple[int, int]]:
    QApplication.processEvents()
    return {dock.view.path: (dock.x(), dock.y()) for dock in window.views}


def two_by_two(window: Window, paths: list[str]) -> bool:
    at = places(window)
    cast, axial, coronal, sagittal = (at[path] for path in paths)
    rows = cast[1] == axial[1] < coronal[1] == sagittal[1]
    return rows and cast[0] == coronal[0] < axial[0] == sagittal[0]


@pytest.mark.slow
def test_what_is_missing_is_added_as_one_step(make_window: MakeWindow, tmp_path: Path, qtbot: QtBot) -> None:
    window = opened(make_window, tmp_path, cast())
    session = window.session
    qtbot.waitUntil(lambda: session.value("volume", "volume") is not None, timeout=20000)
    before = workspace.dumps(session.network)
    window.actions_by_name["quad_view"].trigger()
    assert two_by_two(window, ["view", "axial", "coronal", "sagittal"])
    planes = [session.network[f"{name}_cut"].plane for name in ("axial", "coronal", "sagittal")]
    assert [plane.normal for plane in planes] == [(0, 0, -1), (0, -1, 0), (1, 0, 0)]
    middle = session.value("volume", "volume").corners.mean(axis=0).tolist()
    assert all(isinstance(plane, Plane) and list(plane.origin) == middle for plane in planes)
    low, high = session.network["axial_cut"].window
    assert low < high, "the cuts show what most values lie between"
    names = ("view", "axial", "coronal", "sagittal")
    qtbot.waitUntil(lambda: all(str(session.state(name)) == "clean" for name in names), timeout=20000)
    session.undo()
    assert workspace.dumps(session.network) == before
    assert [dock.view.path for dock in window.views] == ["view"]


def test_views_that_are_there_are_laid_out(make_window: MakeWindow, tmp_path: Path) -> None:
    window = opened(make_window, tmp_path, cast())
    window.quad_view()
    window.reset_layout()
    assert not two_by_two(window, ["view", "axial", "coronal", "sagittal"])
    before = workspace.dumps(window.session.network)
    window.quad_view()
    assert two_by_two(window, ["view", "axial", "coronal", "sagittal"])
    assert workspace.dumps(window.session.network) == before


def test_a_network_without_a_ray_caster_gets_one(make_window: MakeWindow, tmp_path: Path, qtbot: QtBot) -> None:
    window = opened(make_window, tmp_path, small())
    window.session.select("volume")
    window.quad_view()
    assert window.session.network.node("axial_cut").inputs == {"volume": ("volume.volume",)}
    assert window.session.network.node("raycast").inputs["volume"] == ("volume.volume",)
    qtbot.waitUntil(lambda: str(window.session.state("raycast")) == "clean", timeout=20000)


def test_without_a_volume_it_says_so(window: Window) -> None:
    window.quad_view()
    assert [message.text for message in window.messages.messages()] == [
        "There is no volume to show: add one, or select its node."
    ]
    assert not window.session.history.undo_name
