"""The commands of the window: their words, icons, keys, and what they do. Menus and the command palette list them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QToolBar

from nodegraph.editor import theme
from nodegraph.editor.canvas.menus import ACTIONS as CANVAS
from nodegraph.editor.canvas.menus import ALIGN
from nodegraph.editor.command_palette import Entry

if TYPE_CHECKING:
    from nodegraph.editor.window import Window


@dataclass(frozen=True, slots=True)
class Told:
    """One command. act: a method of the window, or of ``on``: the canvas, or the tools of the view used last."""

    act: str
    text: str
    icon: str = ""
    key: str = ""
    on: str = ""


def _on_canvas(act: str, icon: str = "") -> Told:
    words, key = CANVAS[act]
    return Told(act, words, icon, key, "canvas")


def _in_view(act: str, words: str, key: str = "") -> Told:
    return Told(act, words, "", key, "view")


MENUS: dict[str, tuple[Told | None, ...]] = {
    "&File": (
        Told("new", "New", "new", "Ctrl+N"),
        Told("new_from_data", "New from data ...", "data", "Ctrl+Shift+N"),
        Told("open_dialog", "Open ...", "open", "Ctrl+O"),
        Told("recent", "Open recent"),
        None,
        Told("save", "Save", "save", "Ctrl+S"),
        Told("save_as", "Save as ...", "", "Ctrl+Alt+S"),
        None,
        Told("show_welcome", "Examples"),
        None,
        Told("close", "Quit", "", "Ctrl+Q"),
    ),
    "&Edit": (
        Told("undo", "Undo", "undo", "Ctrl+Z"),
        Told("redo", "Redo", "redo", "Ctrl+Shift+Z"),
        None,
        _on_canvas("cut", "cut"),
        _on_canvas("copy", "copy"),
        _on_canvas("paste", "paste"),
        _on_canvas("duplicate", "duplicate"),
        _on_canvas("delete_selection", "delete"),
        None,
        _on_canvas("select_all"),
        _on_canvas("find", "search"),
    ),
    "&Network": (
        _on_canvas("add_node", "node"),
        _on_canvas("add_note"),
        _on_canvas("add_frame"),
        None,
        _on_canvas("mute", "mute"),
        _on_canvas("rename_selection"),
        _on_canvas("group", "group"),
        _on_canvas("ungroup", "ungroup"),
        _on_canvas("pull_out"),
        _on_canvas("accept_proposals"),
        _on_canvas("bend"),
        _on_canvas("straighten"),
        None,
        _on_canvas("layout_all"),
        Told("show_shader", "Edit the shader"),
        Told("show_recorder", "Show the recorder"),
        Told("retry", "Try again what failed", "retry", "F5"),
    ),
    "&View": (
        _on_canvas("fit", "fit"),
        _on_canvas("toggle_minimap"),
        _on_canvas("toggle_arcs"),
        None,
        Told("quad_view", "Quad view", "quad", "Ctrl+Alt+Q"),
        Told("show_compare", "Compare views"),
        Told("show_quality", "Errors and times of a view"),
        None,
        Told("panels", "Panels"),
        Told("reset_layout", "Put the panels back"),
        None,
        Told("toggle_theme", "Light or dark", "theme", "Ctrl+Shift+L"),
        Told("toggle_full_screen", "Full screen", "full_screen", "Ctrl+F11"),
    ),
    "&Picture": (
        _in_view("crosshair", "Cross-hair", "X"),
        _in_view("fly", "Fly", "Shift+F"),
        _in_view("handles", "Handles of the selection", "H"),
        None,
        _in_view("distance", "Measure a distance", "D"),
        _in_view("angle", "Measure an angle", "A"),
        _in_view("rectangle", "Measure a rectangle", "R"),
        _in_view("polygon", "Measure a polygon", "P"),
        None,
        _in_view("link_cameras", "Turn all views together"),
        _in_view("own_camera", "Turn this view alone"),
        None,
        _in_view("copy_place", "Copy value and position"),
    ),
    "&Help": (
        Told("open_commands", "All commands ...", "commands", "Ctrl+K"),
        Told("show_help", "Help", "info", "F1"),
    ),
}
SUBMENUS = ("recent", "panels")
BAR = ("new", "open_dialog", "save", None, "undo", "redo", None, "mute", "group", "fit", None, "retry")


def make(window: Window) -> dict[str, QAction]:
    """Make the actions and fill the menu bar. The canvas and the views hear their own keys, while they are used."""
    made: dict[str, QAction] = {}
    for title, entries in MENUS.items():
        menu = window.menuBar().addMenu(title)
        for told in entries:
            if told is None:
                menu.addSeparator()
            elif told.act in SUBMENUS:
                window.submenus[told.act] = menu.addMenu(told.text)
            else:
                action = made[told.act] = menu.addAction(told.text)
                action.setObjectName(told.act)
                action.setProperty("icon_name", told.icon)
                if told.key:
                    action.setShortcut(QKeySequence(told.key))
                if told.on:
                    action.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
                action.triggered.connect(_call(window, told))
    made["close"].setMenuRole(QAction.MenuRole.QuitRole)
    return made


def make_bar(window: Window, actions: dict[str, QAction]) -> QToolBar:
    """Make the bar of the commands that are wanted most."""
    bar = QToolBar("Toolbar", window)
    bar.setObjectName("toolbar")
    bar.setMovable(False)
    bar.setIconSize(QSize(16, 16))
    for name in BAR:
        if name is None:
            bar.addSeparator()
        else:
            bar.addAction(actions[name])
    window.addToolBar(bar)
    return bar


def paint(window: Window, actions: dict[str, QAction]) -> None:
    """Give every action its icon in the colours of the theme."""
    for action in actions.values():
        if name := action.property("icon_name"):
            action.setIcon(theme.icon(name, window.palette()))


def entries(window: Window) -> list[Entry]:
    """What the command palette lists: commands that can be done now, processors to add, nodes to go to."""
    found = []
    for action in window.actions_by_name.values():
        if action.isEnabled():
            found.append(
                Entry("Command", action.text(), action.trigger, action.shortcut().toString(), "", action.icon())
            )
    if len(window.session.selection) > 1:
        found += [
            Entry("Command", f"Align: {words}", partial(window.canvas.align, edge)) for edge, words in ALIGN.items()
        ]
        found.append(Entry("Command", CANVAS["layout_selection"][0], window.canvas.layout_selection))
    sign = theme.icon("node", window.palette())
    for id in window.palette_panel.ids():
        category, _, name = id.rpartition(".")
        text = name.replace("_", " ")
        act = partial(window.add_processor, id)
        found.append(Entry("Add", text[:1].upper() + text[1:], act, category, id, sign))
    for node in window.session.network.walk():
        found.append(Entry("Go to", node.path, partial(window.go_to, node.path), node.type))
    return found


def fill_recent(window: Window) -> None:
    """List the recent files in their menu."""
    menu = window.submenus["recent"]
    menu.clear()
    for path in window.settings.recent:
        menu.addAction(str(path)).triggered.connect(lambda _=False, path=path: window.open_file(path))
    if menu.isEmpty():
        menu.addAction("No file was open yet").setEnabled(False)


def fill_panels(window: Window) -> None:
    """List the panels in their menu, with a tick where they are shown."""
    menu = window.submenus["panels"]
    menu.clear()
    for dock in (*window.docks.values(), *window.views):
        menu.addAction(dock.toggleViewAction())


def _call(window: Window, told: Told) -> Callable[[], None]:
    def act() -> None:
        if told.on == "view":
            view = window.view_docks.current()
            if view is not None:
                getattr(view.toolbox, told.act)()
        else:
            getattr(window.canvas if told.on == "canvas" else window, told.act)()

    return act
