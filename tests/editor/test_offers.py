"""A data file becomes a network: dropped, chosen from a dialog, named at the start; one step that can be undone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from nodegraph import formats, workspace
from nodegraph.data import Image, Volume
from nodegraph.editor.window import Window
from nodegraph.network import Network


@pytest.fixture
def blob(tmp_path: Path) -> Path:
    z, y, x = np.mgrid[-1:1:12j, -1:1:14j, -1:1:16j]
    formats.write(Volume((1.5 - np.sqrt(x * x + y * y + z * z)).astype("f4")), tmp_path / "blob.nrrd")
    return tmp_path / "blob.nrrd"


def drop(window: Window, *paths: Path) -> None:
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(path)) for path in paths])
    action, button, keys = Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    # The mouse is over what stands in the middle, which has drops of its own and passes these on.
    below = window.canvas.view.viewport() if window.canvas.isVisible() else window.welcome.viewport()
    entering = QDragEnterEvent(QPoint(30, 30), action, data, button, keys)
    QApplication.sendEvent(below, entering)
    assert entering.isAccepted()
    QApplication.sendEvent(below, QDropEvent(QPointF(30, 30), action, data, button, keys))


def offered(window: Window, qtbot: QtBot):
    qtbot.waitUntil(lambda: window.beginning.chooser is not None, timeout=20000)
    chooser = window.beginning.chooser
    assert chooser is not None
    return chooser


def errors(window: Window) -> list[str]:
    return [message.text for message in window.messages.messages() if message.level == "error"]


def test_a_dropped_file_is_shown_by_what_enter_chooses_and_that_is_one_step(
    window: Window, blob: Path, qtbot: QtBot
) -> None:
    drop(window, blob)
    chooser = offered(window, qtbot)
    assert [chooser.list.item(row).text() for row in range(chooser.list.count())] == [
        "Ray-casting",
        "Three slices",
        "Surface",
        "Maximum projection",
    ]
    assert not chooser.afresh.isVisible()  # the document is empty
    qtbot.keyClick(chooser.list, Qt.Key.Key_Return)
    net = window.session.network
    qtbot.waitUntil(lambda: "raycast" in window.session.network, timeout=20000)
    assert net is window.session.network
    assert Path(net.get("blob.path")) == blob
    assert len(window.views) == 1
    qtbot.waitUntil(lambda: window.session.state("view") == "clean", timeout=30000)
    assert window.session.history.undo_name == "new from blob.nrrd"
    window.session.undo()
    assert not net.nodes
    assert not net.variables
    assert not window.session.history.undo_name


@pytest.mark.slow
def test_pictures_come_and_the_arrows_choose(window: Window, blob: Path, qtbot: QtBot) -> None:
    window.open_files([blob])
    chooser = offered(window, qtbot)
    qtbot.waitUntil(lambda: chooser.list.item(3).data(Qt.ItemDataRole.UserRole) is not None, timeout=30000)
    qtbot.keyClick(chooser.list, Qt.Key.Key_Right)
    assert chooser.doc.text().startswith("Axial, coronal and sagittal")
    qtbot.keyClick(chooser.list, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: len(window.views) == 3, timeout=20000)


@pytest.mark.slow
def test_beside_what_is_there_or_as_a_new_network(window: Window, blob: Path, tmp_path: Path, qtbot: QtBot) -> None:
    net = Network()
    net.add("output.view", "view")
    workspace.save(net, tmp_path / "there.json")
    window.open_file(tmp_path / "there.json")
    for afresh, nodes in ((False, 7), (True, 6)):
        drop(window, blob)
        chooser = offered(window, qtbot)
        (chooser.afresh if afresh else chooser.beside).setChecked(True)
        chooser.accept()
        if afresh:
            qtbot.waitUntil(lambda: window.box is not None, timeout=20000)  # what is there is not saved
            window.box.button(window.box.StandardButton.Discard).click()
        qtbot.waitUntil(lambda nodes=nodes: len(window.session.network.nodes) == nodes, timeout=20000)
        qtbot.waitUntil(lambda: window.beginning.chooser is None, timeout=20000)
    assert window.session.path is None


@pytest.mark.slow
def test_several_files_come_in_one_step(window: Window, blob: Path, tmp_path: Path, qtbot: QtBot) -> None:
    labels = np.zeros((8, 8, 8), "u1")
    labels[2:6, 2:6, 2:6] = 3
    formats.write(Volume(labels), tmp_path / "labels.nrrd")
    (tmp_path / "broken.nrrd").write_text("NRRD0004\nencoding: none\n")
    drop(window, blob, tmp_path / "labels.nrrd", tmp_path / "broken.nrrd")
    chooser = offered(window, qtbot)
    (told,) = errors(window)
    assert told.startswith(str(tmp_path / "broken.nrrd"))
    chooser.list.setCurrentRow(2)
    chooser.accept()
    qtbot.waitUntil(lambda: len(window.session.network.nodes) == 12, timeout=20000)
    modes = {node.params.get("mode") for node in window.session.network.walk() if node.type == "render.raycast"}
    assert modes == {"iso"}
    window.session.undo()
    assert not window.session.network.nodes


def test_what_cannot_be_used_says_one_sentence(window: Window, tmp_path: Path, qtbot: QtBot) -> None:
    (tmp_path / "notes.txt").write_text("hello")
    drop(window, tmp_path / "notes.txt")
    qtbot.waitUntil(lambda: len(errors(window)) == 1, timeout=20000)
    assert "no format has the suffix '.txt'" in errors(window)[0]
    formats.write(Image(np.zeros((2, 2, 4), "f4")), tmp_path / "plain.png")
    drop(window, tmp_path / "plain.png")
    qtbot.waitUntil(lambda: len(errors(window)) == 2, timeout=20000)
    assert "carries no workspace" in errors(window)[1]
    assert window.beginning.chooser is None
