"""Somebody's first session, by what the window shows alone: a mouse, a keyboard, menus and dialogs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QImage
from PySide6.QtWidgets import QApplication, QComboBox, QDialog, QFileDialog, QLineEdit, QListWidget, QSpinBox, QWidget
from pytestqt.qtbot import QtBot

from nodegraph import formats
from nodegraph.data import Volume
from nodegraph.editor.views.icons import IconButton
from nodegraph.editor.views.view import ViewWidget
from nodegraph.editor.window import Window
from tests.editor.conftest import MakeWindow
from tests.editor.proof import hand
from tests.editor.proof.mistakes import Mistakes

CONTROL, SHIFT = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.ShiftModifier
W = TypeVar("W", bound=QWidget)


class User:
    """Sees the window, and finds things by what they say of themselves."""

    def __init__(self, window: Window, qtbot: QtBot) -> None:
        self.window, self.qtbot = window, qtbot

    def wait(self, holds: Callable[[], object]) -> None:
        self.qtbot.waitUntil(lambda: bool(holds()), timeout=60_000)

    def seen(self, kind: type[W], says: str = "", inside: QWidget | None = None) -> W:
        """The widget of a kind that is seen and says this in its tip, its text or its name."""
        found = [
            one
            for one in (inside or self.window).findChildren(kind)
            if one.isVisible() and says in (one.toolTip() + one.accessibleName() + one.objectName())
        ]
        assert found, f"no {kind.__name__} says {says!r}"
        return found[0]

    def menu(self, *words: str) -> None:
        """Open a menu of the menu bar and choose an entry, by mouse."""
        bar = self.window.menuBar()
        title = next(one for one in bar.actions() if one.text().replace("&", "") == words[0])
        hand.click(bar, bar.actionGeometry(title).center())
        menu = QApplication.activePopupWidget()
        assert menu is not None
        entry = next(one for one in menu.actions() if one.text() == words[1])
        assert entry.isEnabled()
        hand.click(menu, menu.actionGeometry(entry).center())

    def dialog(self, kind: type[W]) -> W:
        self.wait(lambda: isinstance(QApplication.activeModalWidget(), kind))
        found = QApplication.activeModalWidget()
        assert isinstance(found, kind)
        return found

    def name_file(self, file: Path) -> None:
        """Type a name into the dialog for files that is open."""
        box = self.dialog(QFileDialog)
        field = box.findChild(QLineEdit, "fileNameEdit")
        assert field is not None
        field.setText(str(file))
        hand.click(field)
        hand.key(box, Qt.Key.Key_Return)

    def type_over(self, field: QWidget, text: str) -> None:
        """Click into a field, and replace all of it."""
        hand.click(field)
        hand.key(field, Qt.Key.Key_A, CONTROL)
        hand.write(field, text)

    def at_rest(self) -> None:
        """Wait until all views show their final pictures."""
        session = self.window.session
        views = [dock.view for dock in self.window.views if dock.view.isVisible()]
        self.wait(lambda: all(str(session.state(view.path)) == "clean" and view.shown for view in views))
        self.wait(lambda: session._channels.at_rest and not session.in_gesture)
        QApplication.processEvents()

    def picture(self, view: ViewWidget) -> np.ndarray:
        """What a view shows, as bytes."""
        self.at_rest()
        image = view.area.grab().toImage().convertToFormat(QImage.Format.Format_RGB888)
        return np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), -1)[:, : image.width() * 3].copy()


@pytest.fixture
def chest(root: Path, tmp_path: Path) -> Path:
    """The shipped chest at a quarter of its resolution, as a file of the user's own."""
    whole = formats.read(root / "workspaces" / "data" / "cta_chest.nii.gz")
    assert isinstance(whole, Volume)
    small = whole.data[::4, ::4, ::4]
    path = tmp_path / "my data" / "chest.nii.gz"
    path.parent.mkdir()
    formats.write(Volume(np.ascontiguousarray(small), whole.index_to_world @ np.diag([4.0, 4.0, 4.0, 1.0])), path)
    return path


def drop(window: Window, file: Path) -> None:
    """Let a file that is dragged from elsewhere fall into the middle of the window."""
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(file))])
    there, copy = QPointF(window.rect().center()), Qt.DropAction.CopyAction
    enter = QDragEnterEvent(there.toPoint(), copy, data, hand.LEFT, hand.NONE)
    QApplication.sendEvent(window, enter)
    assert enter.isAccepted()
    QApplication.sendEvent(window, QDropEvent(there, copy, data, hand.LEFT, hand.NONE))


@pytest.mark.slow
def test_a_first_session(
    make_window: MakeWindow, chest: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, qtbot: QtBot
) -> None:
    monkeypatch.setenv("NODEGRAPH_CACHE", str(tmp_path / "cache"))
    window = make_window()
    window.resize(1000, 760)
    user = User(window, qtbot)
    with Mistakes() as mistakes:
        session = window.session
        first_look(user, chest)
        view = window.views[0].view
        pick_a_preset(user, view)
        turn(user, view)
        cut(user)
        file = save_and_reopen(user, tmp_path)
        export_a_picture(user, tmp_path / "chest.png")
        export_a_turntable(user, file)
        assert [message.text for message in window.messages.messages() if message.level == "error"] == []
        assert not session.report.errors
    assert mistakes.heard == []


def first_look(user: User, chest: Path) -> None:
    """Drop the file, take the first network that is offered."""
    drop(user.window, chest)
    user.wait(lambda: user.window.beginning.chooser is not None)
    chooser = user.window.beginning.chooser
    assert chooser is not None
    user.wait(chooser.isVisible)
    hand.key(chooser, Qt.Key.Key_Return)
    user.wait(lambda: user.window.views)
    user.at_rest()
    assert user.picture(user.window.views[0].view).std() > 10  # something is seen


def pick_a_preset(user: User, view: ViewWidget) -> None:
    before = user.picture(view)
    hand.click(user.seen(QWidget, "Presets and colour maps", user.window.parameters))
    listed = QApplication.activePopupWidget()
    assert listed is not None
    presets = user.seen(QListWidget, "Presets", listed)
    for row in range(1, presets.count()):
        item = presets.item(row)
        if item.flags() & Qt.ItemFlag.ItemIsSelectable:
            presets.scrollToItem(item)
            QApplication.processEvents()
            hand.click(presets.viewport(), presets.visualItemRect(item).center())
            break
    user.wait(lambda: user.window.session.history.undo_name)
    assert not np.array_equal(user.picture(view), before)


def turn(user: User, view: ViewWidget) -> None:
    before = user.picture(view)
    middle = view.area.rect().center()
    hand.drag(view.area, middle, middle + QPoint(90, 30))
    assert not np.array_equal(user.picture(view), before)


def cut(user: User) -> None:
    """Three planes beside the body; the axial one is scrolled."""
    user.menu("View", "Quad view")
    user.wait(lambda: len(user.window.views) == 4)
    axial = next(dock.view for dock in user.window.views if dock.view.path == "axial")
    before = user.picture(axial)
    assert before.std() > 10
    middle = axial.area.rect().center()
    hand.wheel(axial.area, middle, 6)
    assert not np.array_equal(user.picture(axial), before)


def save_and_reopen(user: User, folder: Path) -> Path:
    window, file = user.window, folder / "chest.json"
    hand.key(window, Qt.Key.Key_S, CONTROL)
    user.name_file(file)
    user.wait(lambda: file.exists() and not window.session.modified)
    nodes = set(window.session.network.nodes)
    hand.key(window, Qt.Key.Key_N, CONTROL)
    assert not window.session.network.nodes
    hand.key(window, Qt.Key.Key_O, CONTROL)
    user.name_file(file)
    user.wait(lambda: set(window.session.network.nodes) == nodes)
    user.at_rest()
    assert len(window.views) == 4
    return file


def export_a_picture(user: User, file: Path) -> None:
    view = next(dock.view for dock in user.window.views if dock.view.path not in ("axial", "coronal", "sagittal"))
    hand.click(user.seen(IconButton, "Save a picture", view))
    box = user.dialog(QDialog)
    name, (width, height) = box.findChildren(QLineEdit)[0], box.findChildren(QSpinBox)
    name.setText("")
    user.type_over(name, str(file))
    user.type_over(width, "120")
    user.type_over(height, "120")
    hand.key(box, Qt.Key.Key_Return)
    user.wait(file.exists)
    saved = QImage(str(file))
    assert saved.height() == 120


def export_a_turntable(user: User, document: Path) -> None:
    user.window.docks["timeline"].raise_()
    QApplication.processEvents()
    timeline = user.window.timeline
    hand.click(user.seen(IconButton, "Turn the camera once round", timeline))
    last = user.seen(QSpinBox, "Last", timeline)
    user.type_over(last, "3")
    hand.key(last, Qt.Key.Key_Return)
    hand.click(user.seen(IconButton, "Render to files", timeline))
    box = user.dialog(QDialog)
    assert user.seen(QComboBox, "", box).count() == 4
    width, height = box.findChildren(QSpinBox)
    user.type_over(width, "64")
    user.type_over(height, "48")
    hand.key(box, Qt.Key.Key_Return)
    frames = document.with_name("chest_frames")
    user.wait(lambda: frames.is_dir() and len(list(frames.glob("*.png"))) == 4)
    user.wait(lambda: "rendered" in user.window.status.text.text())
