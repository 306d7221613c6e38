"""The window: files, commands, panels, theme, and that closing it leaves nothing behind."""

from __future__ import annotations

import json
import shutil
import threading
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox, QTabBar
from pytestqt.qtbot import QtBot

from nodegraph import workspace
from nodegraph.commands import Rename, Set
from nodegraph.editor import actions, theme
from nodegraph.editor.app import application
from nodegraph.editor.arrangement import LAYOUT
from nodegraph.editor.messages import parts
from nodegraph.editor.session import Message
from nodegraph.editor.settings import Settings
from nodegraph.editor.views.toolbox import Toolbox
from nodegraph.editor.window import Window
from tests.editor.conftest import MakeWindow, left_of
from tests.editor.test_session import small


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A workspace of four small nodes."""
    path = tmp_path / "small.json"
    workspace.save(small(), path)
    return path


@pytest.fixture
def opened(window: Window, file: Path, qtbot: QtBot) -> Window:
    """A window with that workspace, its picture drawn."""
    with qtbot.waitSignal(window.session.answered, timeout=20000):
        window.open_file(file)
    return window


def test_every_command_exists_and_has_an_icon_that_is_there(window: Window) -> None:
    told = [entry for entries in actions.MENUS.values() for entry in entries if entry is not None]
    owners = {"": window, "canvas": window.canvas, "view": Toolbox}
    keys = [entry.key for entry in told if entry.key]
    assert len(set(keys)) == len(keys)
    for entry in told:
        if entry.act not in actions.SUBMENUS:
            assert callable(getattr(owners[entry.on], entry.act))
        if entry.icon:
            assert not theme.icon(entry.icon, window.palette()).isNull()


def test_opening_shows_the_network_its_view_and_its_name(opened: Window, file: Path) -> None:
    assert opened.middle.currentWidget() is opened.canvas
    assert [dock.view.path for dock in opened.views] == ["view"]
    assert opened.windowTitle() == "small.json[*] - nodegraph"
    assert not opened.isWindowModified()
    assert opened.settings.recent == [file]
    opened.session.do(Set("blur.sigma", 3.0))
    assert opened.isWindowModified()
    assert opened.actions_by_name["undo"].text() == "Undo set sigma"
    opened.undo()
    assert not opened.isWindowModified()


def test_views_come_and_go_with_their_nodes(opened: Window, qtbot: QtBot) -> None:
    opened.session.network.add("output.view", "second")
    assert [dock.view.path for dock in opened.views] == ["view", "second"]
    opened.session.network.rename("second", "other")
    assert [dock.view.path for dock in opened.views] == ["view", "other"]
    opened.session.network.remove("view")
    assert [dock.view.path for dock in opened.views] == ["other"]
    opened.undo()
    assert {dock.view.path for dock in opened.views} == {"view", "other"}


def test_a_file_that_cannot_be_opened_leaves_what_is_there(opened: Window, tmp_path: Path) -> None:
    bad = tmp_path / "bad.json"
    bad.write_text("{")
    opened.open_file(bad)
    assert opened.windowTitle().startswith("small.json")
    assert [message.level for message in opened.messages.messages()][-1] == "error"


def test_where_panels_are_is_kept_in_the_workspace_and_is_no_step(
    opened: Window, file: Path, make_window: MakeWindow
) -> None:
    opened.docks["palette"].hide()
    opened.save()
    assert not opened.session.modified
    assert opened.session.history.undo_name == ""
    assert LAYOUT in json.loads(file.read_text())["ui"]
    other = make_window()
    assert not other.docks["palette"].isHidden()
    other.open_file(file)
    assert other.docks["palette"].isHidden()
    other.reset_layout()
    assert not other.docks["palette"].isHidden()


def test_the_network_is_seen_whole_once_its_panels_have_their_places(opened: Window, file: Path, qtbot: QtBot) -> None:
    opened.resize(1200, 900)
    qtbot.wait(50)
    opened.show_compare()
    qtbot.waitUntil(lambda: opened.docks["compare"].height() > 0.25 * opened.height(), timeout=5000)
    opened.save()
    opened.new()
    opened.reset_layout()
    opened.open_file(file)
    view = opened.canvas.view

    def seen() -> bool:
        return view.mapToScene(view.viewport().rect()).boundingRect().contains(opened.canvas.scene.content())

    qtbot.waitUntil(seen, timeout=5000)
    qtbot.wait(50)
    assert seen()


def test_a_layout_that_somebody_damaged_is_passed_over(window: Window, file: Path) -> None:
    keys = json.loads(file.read_text())
    keys["ui"] = {LAYOUT: {"layout": "no base64 *"}}
    file.write_text(json.dumps(keys))
    window.open_file(file)
    assert window.middle.currentWidget() is window.canvas


@pytest.mark.parametrize("answer", ["Discard", "Cancel"])
def test_unsaved_changes_are_asked_about(opened: Window, qtbot: QtBot, answer: str) -> None:
    opened.session.do(Set("blur.sigma", 3.0))
    opened.new()
    box = opened.box
    assert isinstance(box, QMessageBox)
    box.button(QMessageBox.StandardButton[answer]).click()
    assert (len(opened.session.network) == 0) == (answer == "Discard")


def test_the_command_palette_does_what_it_lists(opened: Window, qtbot: QtBot) -> None:
    qtbot.waitUntil(lambda: len(opened.palette_panel.ids()) > 5, timeout=10000)
    opened.open_commands()
    qtbot.keyClicks(opened.commands.field, "proxy box")
    assert opened.commands.found()[0] == "Proxy box"
    qtbot.keyClick(opened.commands.field, Qt.Key.Key_Return)
    assert "proxy_box" in opened.session.network
    assert not opened.commands.isVisible()
    opened.open_commands()
    qtbot.keyClicks(opened.commands.field, "go to blur")
    qtbot.keyClick(opened.commands.field, Qt.Key.Key_Return)
    assert opened.session.selection == ("blur",)
    opened.open_commands()
    qtbot.keyClick(opened.commands.field, Qt.Key.Key_Escape)
    assert not opened.commands.isVisible()


def test_light_and_dark(window: Window, qtbot: QtBot) -> None:
    for _ in range(2):
        before = theme.theme_of(window.palette())
        window.toggle_theme()
        qtbot.waitUntil(lambda before=before: theme.theme_of(window.palette()) is not before)
        kept = Settings().get("theme")
        assert theme.THEMES[kept] is theme.theme_of(window.palette())
        seen = window.grab().toImage().pixelColor(5, window.height() - 3)
        assert (seen.lightness() < 128) == (kept == "dark")
    application().setStyleSheet("")


def test_text_is_legible_in_both_themes() -> None:
    def luminance(color: str) -> float:
        parts = [int(color[at : at + 2], 16) / 255 for at in (1, 3, 5)]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    for one in theme.THEMES.values():
        for ink in (one.text, one.dim, one.error, one.warning):
            for paper in (one.window, one.field):
                light, dark = sorted((luminance(ink), luminance(paper)), reverse=True)
                assert (light + 0.05) / (dark + 0.05) >= 4.5, (ink, paper)


def test_the_welcome_page_shows_the_shipped_workspaces(window: Window, root: Path, qtbot: QtBot) -> None:
    names = [card.path.name for card in window.welcome.cards]
    assert names == sorted(path.name for path in (root / "workspaces").glob("*.json"))
    card = window.welcome.cards[0]
    with qtbot.waitSignal(window.welcome.wants_file) as wanted:
        qtbot.mouseClick(card, Qt.MouseButton.LeftButton)
    assert wanted.args == [card.path]


def test_thumbnails_are_rendered_once(window: Window, file: Path, qtbot: QtBot) -> None:
    from nodegraph.editor.welcome import thumbnail

    first = thumbnail(window.session, file)
    assert first is not None
    assert first.width() > 100
    window.session.engine.close()
    again = thumbnail(window.session, file)
    assert again is not None
    assert again.size() == first.size()


def test_recent_files_that_are_gone_are_not_offered(tmp_path: Path, file: Path) -> None:
    settings = Settings(tmp_path)
    other = tmp_path / "other.json"
    shutil.copy(file, other)
    settings.add_recent(file)
    settings.add_recent(other)
    settings.add_recent(file)
    assert Settings(tmp_path).recent == [file, other]
    other.unlink()
    assert Settings(tmp_path).recent == [file]


def test_closing_ends_the_engine_and_its_threads(make_window: MakeWindow, file: Path, qtbot: QtBot) -> None:
    before = set(threading.enumerate())
    window = make_window()
    with qtbot.waitSignal(window.session.answered, timeout=20000):
        window.open_file(file)
    assert any(thread.name == "nodegraph-engine" for thread in threading.enumerate())
    window.close()
    assert window.session.engine.closed
    assert left_of(before) == []


def test_panels_that_share_a_place_have_their_tabs_after_every_move(opened: Window, qtbot: QtBot) -> None:
    def shown() -> list[set[str]]:
        bars = opened.findChildren(QTabBar, options=Qt.FindChildOption.FindDirectChildrenOnly)
        return [{bar.tabText(place) for place in range(bar.count())} for bar in bars if bar.isVisible()]

    right = {"Parameters", "Help"}
    below = {"Messages", "Profile", "Images", "Compare", "Timeline", "Python"}
    for _ in range(3):
        opened.reset_layout()
        qtbot.waitUntil(lambda: all(any(wanted <= tabs for tabs in shown()) for wanted in (right, below)), timeout=8000)
        assert len(shown()) == 2, shown()


def test_the_welcome_page_has_the_window_for_itself(opened: Window) -> None:
    opened.docks["palette"].hide()
    opened.docks["help"].setFloating(True)
    before = {name: dock.isHidden() for name, dock in opened.docks.items()}
    opened.show_welcome()
    assert {name for name, dock in opened.docks.items() if not dock.isHidden()} == {"help"}
    assert opened.views[0].isHidden()
    opened.save()
    assert {name: dock.isHidden() for name, dock in opened.docks.items()} == before
    assert not opened.views[0].isHidden()
    opened.show_welcome()
    opened.add_processor("filter.gradient")
    assert {name: dock.isHidden() for name, dock in opened.docks.items()} == before


def test_what_a_message_begins_with_is_written_as_it_is_called() -> None:
    said = Message("error", "mri", "mri: data/lost.nii.gz: there is no such file; check the path")
    assert parts(said) == ("mri", "data/lost.nii.gz: there is no such file", "Check the path")


def test_a_gesture_that_ended_can_be_undone_from_the_menu(opened: Window) -> None:
    undo = opened.actions_by_name["undo"]
    assert not undo.isEnabled()
    with opened.session.gesture("drag"):
        opened.session.do(Set("blur.sigma", 3.0))
    assert undo.isEnabled()
    assert undo.text() == "Undo drag"


def test_a_view_comes_back_from_the_full_screen(opened: Window, qtbot: QtBot) -> None:
    dock = opened.views[0]
    place, inside = dock.geometry(), dock.view.geometry()
    for key in (Qt.Key.Key_Escape, Qt.Key.Key_F11):
        qtbot.keyClick(dock.view, Qt.Key.Key_F11)
        qtbot.waitUntil(dock.view.isFullScreen)
        assert dock.view.isWindow()
        qtbot.keyClick(dock.view, key)
        qtbot.waitUntil(lambda: dock.geometry() == place and dock.view.geometry() == inside)
        assert not dock.view.isWindow()
        assert not dock.isFloating()


def test_views_stand_where_their_workspace_says(opened: Window, file: Path, tmp_path: Path) -> None:
    opened.views[0].setFloating(True)
    opened.session.do(Rename("view", "other"))
    opened.save()
    opened.open_file(shutil.copy(file, tmp_path / "again.json"))
    assert [dock.isFloating() for dock in opened.views] == [True]
    opened.reset_layout()
    opened.open_file(file)
    assert [dock.isFloating() for dock in opened.views] == [True]
