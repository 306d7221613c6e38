"""The network editor's middle: the canvas with its path of groups, minimap, finder and menus."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, QPoint, QPointF, QRectF, Qt
from PySide6.QtGui import QGuiApplication, QKeyEvent, QKeySequence
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QMenu, QToolButton, QVBoxLayout, QWidget

from nodegraph.editor.canvas import catalogue
from nodegraph.editor.canvas.choosers import Choice, Chooser, FindBar, NameField, NoteField, matches
from nodegraph.editor.canvas.edits import CanvasEdits
from nodegraph.editor.canvas.faces import face_of, title_of
from nodegraph.editor.canvas.items import BoxItem
from nodegraph.editor.canvas.menus import KEYS, menu_for
from nodegraph.editor.canvas.minimap import Minimap
from nodegraph.editor.canvas.node_item import NodeItem
from nodegraph.editor.canvas.scene import CanvasScene
from nodegraph.editor.canvas.view import GraphView

if TYPE_CHECKING:
    from PySide6.QtGui import QResizeEvent, QShowEvent

    from nodegraph.editor.session import Session


class CanvasView(QWidget):
    """Shows and edits the network of a session. The methods without arguments are what menus of a window call."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.scene = CanvasScene(session, self.palette())
        self.edits = CanvasEdits(self.scene)
        self.view = GraphView(self.scene, self.edits)
        self.minimap = Minimap(self.view)
        self.finder = FindBar(self.view)
        self.chooser: Chooser | None = None
        self.field: NameField | NoteField | None = None
        self.menu: QMenu | None = None
        self._found: list[str] = []
        self._place = 0
        self._fitted = False
        self._crumbs = QFrame()
        self._crumb_row = QHBoxLayout(self._crumbs)
        self._crumb_row.setContentsMargins(8, 3, 8, 3)
        self._crumb_row.setSpacing(2)
        box = QVBoxLayout(self)
        box.setContentsMargins(0, 0, 0, 0)
        box.setSpacing(0)
        box.addWidget(self._crumbs)
        box.addWidget(self.view)
        self.setFocusProxy(self.view)
        self._hint = QLabel(
            "An empty network.\nDouble-click or press Tab to add a processor, or drag one here from the palette.",
            self.view,
        )
        self._hint.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._hint.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        view, scene = self.view, self.scene
        view.moved.connect(self.minimap.refresh)
        view.wants_menu.connect(self._open_menu)
        view.wants_processors.connect(self._offer_processors)
        view.wants_parameters.connect(self._offer_parameters)
        view.wants_rename.connect(self.rename)
        scene.synced.connect(self._refresh)
        scene.rebuilt.connect(self._arrive)
        for changed in (scene.selectionChanged, session.states_changed, session.changed):
            changed.connect(self.minimap.renew_soon)
        self.finder.typed.connect(self._find)
        self.finder.stepped.connect(self._step)
        self.finder.closed.connect(self._end_find)
        self._arrive()

    # -- what the menus call ----------------------------------------------------------------------------------------

    def fit(self) -> None:
        """Show the selected nodes, or the whole level."""
        self.view.fit()

    def fit_all(self) -> None:
        """Show the whole level, whatever is selected."""
        self.scene.flush()
        self.view.show_rect(self.scene.content())

    def layout_all(self) -> None:
        """Draw the whole level in layers and show it."""
        self.edits.layout()
        self.view.show_rect(self.scene.content())

    def layout_selection(self) -> None:
        """Draw the selected nodes in layers where they are."""
        self.edits.layout(self.scene.chosen())

    def find(self) -> None:  # type: ignore[override]
        """Open the finder."""
        self._place_overlays()
        self.finder.open()

    def delete_selection(self) -> None:
        self.edits.delete()

    def copy(self) -> None:
        """Put the selected nodes on the clipboard, as JSON text."""
        text = self.edits.copied()
        if text:
            QGuiApplication.clipboard().setText(text)

    def cut(self) -> None:
        """Copy and delete."""
        self.copy()
        self.edits.delete()

    def paste(self) -> None:
        """Add the nodes that are on the clipboard, where the mouse is."""
        text = QGuiApplication.clipboard().text()
        if text.strip():
            self.edits.paste(text, self.view.cursor_point())

    def duplicate(self) -> None:
        self.edits.duplicate()

    def mute(self) -> None:
        self.edits.mute()

    def pull_out(self) -> None:
        """Take the selected nodes out of their wires, each reader led on to what the node would hand on muted."""
        with self.session.gesture("pull out"):
            for id in self.scene.chosen():
                self.edits.pull_out(id)

    def accept_proposals(self) -> None:
        """Do what is proposed for the node that was added last."""
        self.view.proposing.accept()

    def bend(self) -> None:
        """Let the selected wires bend below the mouse, or in their middle where it is elsewhere."""
        at = self.view.cursor_point()
        for item in [item for item in self.scene.wires.values() if item.chosen]:
            near = item.touches(QRectF(at.x() - 8, at.y() - 8, 16, 16))
            self.edits.add_bend(item.wire, at if near else item.path().pointAtPercent(0.5))

    def straighten(self) -> None:
        """Take the bends out of the selected wires, and out of those of which a bend is selected."""
        self.edits.straighten({*self.scene.chosen_wires(), *(dot.item.wire for dot in self.scene.chosen_dots())})

    def group(self) -> None:
        self.edits.group()

    def ungroup(self) -> None:
        self.edits.ungroup()

    def align(self, edge: str) -> None:
        """Bring the selected nodes to one line: "left", "right", "top", "bottom" or "columns"."""
        self.edits.align(edge)

    def select_all(self) -> None:
        self.scene.choose([*self.scene.nodes.values(), *self.scene.boxes.values()])

    def add_node(self) -> None:
        """Open the list of processors where the mouse is."""
        self._offer_processors(self.view.cursor_point(), None)

    def add_frame(self) -> None:
        """Draw a frame around the selected nodes and ask for its title."""
        if self.scene.chosen():
            self.rename(self.scene.boxes["frames", self.edits.add_frame()])

    def add_note(self) -> None:
        """Add a note where the mouse is and ask for its text."""
        at = self.view.cursor_point()
        key = self.edits.add_box("notes", QRectF(at.x(), at.y(), 200, 100), "")
        self.rename(self.scene.boxes["notes", key])

    def enter_group(self) -> None:
        """Show the inside of the selected group."""
        for id in self.scene.chosen():
            if self.scene.level.nodes[id].network is not None:
                self.session.enter(self.scene.path_of(id))
                return

    def leave_group(self) -> None:
        """Show the level around this one, the group selected."""
        here = self.session.level
        if here:
            self.session.enter(here.rpartition("/")[0])
            self.session.select(here)

    def toggle_minimap(self) -> None:
        self.minimap.wanted = not self.minimap.wanted
        self.minimap.refresh()

    def toggle_arcs(self) -> None:
        """Draw arcs between the nodes that share a variable, or no longer."""
        self.scene.arcs.show_all(not self.scene.arcs.wanted)

    def rename_selection(self) -> None:
        """Open the field that renames the selected node, frame or note."""
        items: list[NodeItem | BoxItem] = [self.scene.nodes[id] for id in self.scene.chosen()]
        items += [self.scene.boxes[key] for key in self.scene.chosen_boxes()]
        if len(items) == 1:
            self.rename(items[0])

    # -- fields and menus ---------------------------------------------------------------------------------------------

    def rename(self, item: NodeItem | BoxItem) -> None:
        """Open the field that renames a node or a frame, or edits a note, where it stands."""
        self.view.ensureVisible(item.sceneBoundingRect(), 10, 10)
        rect = self.view.mapFromScene(item.title_rect().translated(item.pos())).boundingRect()
        if isinstance(item, NodeItem):
            id = item.face.id
            self.field = NameField(self.view.viewport(), id, rect, lambda text: self._rename_node(id, text))
            return
        kind, key = item.kind, item.key
        field = NameField if kind == "frames" else NoteField
        self.field = field(self.view.viewport(), item.text, rect, lambda text: self._retext(kind, key, text))

    def _rename_node(self, id: str, text: str) -> None:
        self.view.setFocus()
        if text.strip() and text.strip() != id and id in self.scene.level.nodes:
            self.edits.rename(id, text)

    def _retext(self, kind: str, key: str, text: str) -> None:
        self.view.setFocus()
        with self.session.gesture("edit text"):
            self.edits.change_box(kind, key, text=text)

    def _open_menu(self, where: QPoint, item: object) -> None:
        self.menu = menu_for(self, item)
        self.menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.menu.popup(where)

    def _offer_processors(self, point: QPointF, port: tuple[str, str, bool] | None) -> None:
        """Open the list of processors; those that fit the port that a wire was dropped from."""
        network = self.session.network
        if port is None:
            self._choose("Add a processor", catalogue.all_processors(network), point, lambda key: self._add(key, point))
            return
        id, name, output = port
        face = face_of(self.scene.level.nodes[id])
        type = next((one.type for one in (face.outputs if output else face.inputs) if one.name == name), None)
        if type is None:
            return
        choices = catalogue.accepting(network, type) if output else catalogue.giving(network, type)
        hint = f"Add what takes {name}" if output else f"Add what gives {name}"
        self._choose(hint, choices, point, lambda key: self._add_wired(key, point, port))

    def _choose(self, hint: str, choices: list[Choice], point: QPointF, take: Any) -> None:
        self.chooser = Chooser(self, hint, choices)
        self.chooser.chosen.connect(take)
        self.chooser.closed.connect(self._forget_chooser)
        self.chooser.open_at(self.view.viewport().mapToGlobal(self.view.mapFromScene(point)))

    def _forget_chooser(self) -> None:
        self.chooser = None
        self.view.setFocus()

    def _add(self, type: str, point: QPointF) -> None:
        self.view.drop_processor(type, point)

    def _add_wired(self, key: str, point: QPointF, port: tuple[str, str, bool]) -> None:
        """Add the chosen processor with its port where the wire was dropped, and wire it."""
        type, _, name = key.rpartition(".")
        id, own, output = port
        with self.session.gesture("add"):
            new = self.edits.add(type, point)
            if new is None or id not in self.scene.nodes:
                return
            item = self.scene.nodes[new]
            place = point - (item.anchor(not output, name) - item.pos())
            self.edits.place({new: (place.x(), place.y())})
            if output:
                self.edits.connect(f"{id}.{own}", new, name)
            else:
                self.edits.connect(f"{new}.{name}", id, own)
        self.view.proposing.offer(new)

    def _offer_parameters(self, point: QPointF, source: str, target: str, names: list[str]) -> None:
        choices = [(name, name, "") for name in names]
        self._choose(f"Parameter of {target}", choices, point, lambda name: self.edits.connect(source, target, name))

    # -- finding ------------------------------------------------------------------------------------------------------

    def _find(self, words: str) -> None:
        walk = self.session.network.walk()
        found = [node.path for node in walk if words.strip() and matches(words, node.path, node.type, title_of(node))]
        self._found, self._place = found, -1
        prefix = self.scene.level.prefix
        here = {path.removeprefix(prefix) for path in found if path.startswith(prefix)}
        self.scene.find_nodes(here if words.strip() else None)
        self._count()
        if found:
            self._step(1)

    def _step(self, step: int) -> None:
        if not self._found:
            return
        self._place = (self._place + step) % len(self._found)
        path = self._found[self._place]
        if path not in self.session.network:
            return
        self.session.enter(path.rpartition("/")[0])
        self.session.select(path)
        item = self.scene.nodes[path.rpartition("/")[2]]
        self.view.centerOn(item.body_in_scene().center())
        self.view.moved.emit()
        self._count()

    def _count(self) -> None:
        typed = bool(self.finder.field.text().strip())
        told = f"{self._place + 1} of {len(self._found)}" if self._found else "none" if typed else ""
        self.finder.count.setText(told)

    def _end_find(self) -> None:
        self.scene.find_nodes(None)
        self.view.setFocus()

    # -- keeping up ---------------------------------------------------------------------------------------------------

    def _arrive(self) -> None:
        """Another level or document is shown."""
        self._show_crumbs()
        self._fitted = False
        self._refresh()
        if self.isVisible():
            self._fit_once()

    def _fit_once(self) -> None:
        self._fitted = True
        self.view.show_rect(self.scene.content())

    def _refresh(self) -> None:
        self._hint.setVisible(not self.scene.nodes and not self.scene.boxes)
        self._place_overlays()
        self.minimap.renew()

    def _show_crumbs(self) -> None:
        """The way from the whole document to the group that is shown."""
        while (item := self._crumb_row.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.deleteLater()
        parts = self.session.level.split("/") if self.session.level else []
        self._crumbs.setVisible(bool(parts))
        if not parts:
            return
        for i in range(len(parts) + 1):
            path, text = "/".join(parts[:i]), parts[i - 1] if i else "Network"
            if i:
                self._crumb_row.addWidget(QLabel("\u203a"))
            button = QToolButton()
            button.setText(text)
            button.setAutoRaise(True)
            button.setEnabled(i < len(parts))
            button.clicked.connect(lambda _=False, path=path: self.session.enter(path))
            self._crumb_row.addWidget(button)
        self._crumb_row.addStretch(1)

    def _place_overlays(self) -> None:
        self.finder.adjustSize()
        self.finder.move(self.view.width() - self.finder.width() - 12, 12)
        self._hint.setGeometry(self.view.rect())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        name = KEYS.get(QKeySequence(event.keyCombination()).toString())
        if name is None:
            event.ignore()
        else:
            getattr(self, name)()

    def event(self, event: QEvent) -> bool:
        # Tab would move the focus before it becomes a key.
        if event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent) and event.key() == Qt.Key.Key_Tab:
            self.add_node()
            return True
        return super().event(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._place_overlays()
        self.minimap.refresh()

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if not self._fitted:
            self._fit_once()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() in (QEvent.Type.PaletteChange, QEvent.Type.FontChange) and hasattr(self, "scene"):
            self.scene.repaint_in(self.palette())
            self.view.resetCachedContent()
            self.minimap.renew()
