"""Context menus of the canvas, and its keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import QMenu

from nodegraph.editor.canvas.items import BoxItem
from nodegraph.editor.canvas.node_item import NodeItem
from nodegraph.editor.canvas.wires import BendItem, WireItem
from nodegraph.errors import GraphError
from nodegraph.group_commands import Face, HidePort, ShowPort
from nodegraph.network import unique

if TYPE_CHECKING:
    from nodegraph.editor.canvas.canvas import CanvasView

# Method of `CanvasView`: its words and its key.
ACTIONS: dict[str, tuple[str, str]] = {
    "add_node": ("Add a processor", "Shift+A"),
    "add_note": ("Add a note", "N"),
    "add_frame": ("Frame the selection", "Ctrl+Alt+F"),
    "cut": ("Cut", "Ctrl+X"),
    "copy": ("Copy", "Ctrl+C"),
    "paste": ("Paste", "Ctrl+V"),
    "duplicate": ("Duplicate with its wires", "Ctrl+D"),
    "mute": ("Mute or unmute", "M"),
    "rename_selection": ("Rename", "F2"),
    "pull_out": ("Pull out of its wires", "Shift+X"),
    "accept_proposals": ("Wire and share as proposed", "Ctrl+Return"),
    "bend": ("Bend the wire here", "B"),
    "straighten": ("Straighten the wire", "Shift+B"),
    "delete_selection": ("Delete", "Del"),
    "group": ("Group", "Ctrl+G"),
    "ungroup": ("Ungroup", "Ctrl+Shift+G"),
    "enter_group": ("Open the group", "Return"),
    "leave_group": ("Leave the group", "Backspace"),
    "layout_all": ("Lay out everything", "L"),
    "layout_selection": ("Lay out the selection", "Shift+L"),
    "fit": ("Show the selection, or everything", "F"),
    "find": ("Find a node", "Ctrl+F"),
    "select_all": ("Select everything", "Ctrl+A"),
    "toggle_minimap": ("Minimap", "Ctrl+M"),
    "toggle_arcs": ("Arcs between nodes that share", "K"),
}
KEYS: dict[str, str] = {QKeySequence(key).toString(): name for name, (_, key) in ACTIONS.items()}
"""Method of `CanvasView` by key, as Qt writes it."""

ALIGN = {
    "left": "Left edges",
    "right": "Right edges",
    "top": "Upper edges",
    "bottom": "Lower edges",
    "columns": "One column, equal gaps",
}


def menu_for(canvas: CanvasView, item: object) -> QMenu:
    """The menu of a node, a wire, a frame, a note, or (None) of the canvas."""
    menu = QMenu(canvas)
    if isinstance(item, NodeItem):
        _node_menu(canvas, menu, item)
    elif isinstance(item, WireItem):
        _add(canvas, menu, "bend", *(("straighten",) if item.dots else ()))
        menu.addSeparator()
        _add(canvas, menu, "delete_selection")
    elif isinstance(item, BendItem):
        _add(canvas, menu, "straighten", "delete_selection")
    elif isinstance(item, BoxItem):
        _add(canvas, menu, "rename_selection", "delete_selection")
        if item.kind == "frames":
            colors = menu.addMenu("Colour")
            for name, color in FRAME_COLORS.items():
                action = colors.addAction(name)
                action.triggered.connect(lambda _=False, color=color: _tint(canvas, item.kind, item.key, color))
    else:
        _add(canvas, menu, "add_node", "add_note")
        menu.addSeparator()
        _add(canvas, menu, "paste", "select_all")
        menu.addSeparator()
        if canvas.session.level:
            _add(canvas, menu, "leave_group")
        _add(canvas, menu, "layout_all", "fit", "find", "toggle_minimap", "toggle_arcs")
    return menu


FRAME_COLORS = {
    "Grey": "",
    "Blue": "#4f9bd9",
    "Green": "#5fb878",
    "Yellow": "#d9a441",
    "Red": "#d9534f",
    "Violet": "#8e6fd1",
}


def _add(canvas: CanvasView, menu: QMenu, *names: str) -> None:
    for name in names:
        words, key = ACTIONS[name]
        action = menu.addAction(words)
        action.setShortcut(QKeySequence(key))
        action.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)  # shown here; the canvas hears the key
        action.setShortcutVisibleInContextMenu(True)
        action.triggered.connect(lambda _=False, name=name: getattr(canvas, name)())


def _node_menu(canvas: CanvasView, menu: QMenu, item: NodeItem) -> None:
    several = len(canvas.scene.chosen()) > 1
    if item.face.group:
        _add(canvas, menu, "enter_group")
        menu.addSeparator()
    _add(canvas, menu, "cut", "copy", "duplicate")
    menu.addSeparator()
    _add(canvas, menu, "mute", *(() if several else ("rename_selection",)), "delete_selection")
    if not several:
        _add(canvas, menu, "pull_out")
    menu.addSeparator()
    _add(canvas, menu, "group")
    if item.face.group:
        _add(canvas, menu, "ungroup")
    _add(canvas, menu, "add_frame")
    if several:
        _add(canvas, menu, "layout_selection")
        align = menu.addMenu("Align")
        for edge, words in ALIGN.items():
            align.addAction(words).triggered.connect(lambda _=False, edge=edge: canvas.align(edge))
    if canvas.session.level and not several:
        _face_menu(canvas, menu.addMenu("On the group's face"), item)


def _face_menu(canvas: CanvasView, menu: QMenu, item: NodeItem) -> None:
    """Which ports of a node the group around it shows."""
    tags = dict(item.face.tags)
    for port in (*item.face.inputs, *item.face.outputs):
        side = "out" if port.output else "in"
        shown = tags.get(f"{side}.{port.name}")
        action = menu.addAction(f"{port.name} (output)" if port.output else port.name)
        action.setCheckable(True)
        action.setChecked(shown is not None)
        action.triggered.connect(
            lambda _=False, port=port, shown=shown: show_on_face(
                canvas, item.face.id, port.name, port.output, port.parameter, shown
            )
        )


def show_on_face(canvas: CanvasView, id: str, name: str, output: bool, parameter: bool, shown: str | None) -> None:
    """Show a port on the face of the group around it, or hide it where it is ``shown`` under a name."""
    group = canvas.session.level
    side: Face = "outputs" if output else "params" if parameter else "inputs"
    try:
        expose = canvas.session.network.node(group).expose
    except GraphError:
        return
    if shown is not None:
        canvas.session.do(HidePort(group, side, shown))
    else:
        taken = expose.outputs if output else [*expose.inputs, *expose.params]
        canvas.session.do(ShowPort(group, side, unique(name, taken), f"{id}.{name}"))


def _tint(canvas: CanvasView, kind: str, key: str, color: str) -> None:
    with canvas.session.gesture("colour"):
        canvas.edits.change_box(kind, key, color=color)
