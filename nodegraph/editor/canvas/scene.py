"""One level of the document as a scene. It follows ``session.changed`` and holds nothing that the document has."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QPointF, QRectF, QTimer, Signal
from PySide6.QtGui import QColor, QPalette
from PySide6.QtWidgets import QGraphicsScene

from nodegraph.bends import BENDS
from nodegraph.commands import SetUI
from nodegraph.editor.canvas.arcs import Arcs
from nodegraph.editor.canvas.faces import Wire, as_position, face_of, wires_of
from nodegraph.editor.canvas.items import BoxItem
from nodegraph.editor.canvas.layout import layered
from nodegraph.editor.canvas.look import Look
from nodegraph.editor.canvas.node_item import NodeItem
from nodegraph.editor.canvas.standing import Standing
from nodegraph.editor.canvas.wires import BendItem, WireItem
from nodegraph.editor.canvas.wiring import Wiring

if TYPE_CHECKING:
    from nodegraph.commands import Command
    from nodegraph.editor.session import Session
    from nodegraph.network import Network, Node

Item = NodeItem | WireItem | BendItem | BoxItem

BOXES = ("frames", "notes")


class CanvasScene(QGraphicsScene):
    """The nodes, wires, frames and notes of ``session.level``.

    Nodes that have no position in the document stand where the automatic layout puts them, until something of their
    level is moved (`unplaced` says which these are).
    """

    leaving = Signal()  # what is shown goes at once
    rebuilt = Signal()  # another level or document is shown
    synced = Signal()  # what is shown changed

    def __init__(self, session: Session, palette: QPalette) -> None:
        super().__init__()
        self.session = session
        self.look = Look.of(palette)
        self.nodes: dict[str, NodeItem] = {}  # by id on this level
        self.wiring = Wiring(self)
        self.boxes: dict[tuple[str, str], BoxItem] = {}
        self.standing = Standing(session)
        # Where the layout put nodes that the document has no position for; kept for when an undo takes theirs.
        self._provisional: dict[str, tuple[float, float]] = {}
        self._selecting = False
        self.arcs = Arcs(self)
        self._soon = QTimer(self, singleShot=True, interval=0)
        self._soon.timeout.connect(self.sync)
        session.changed.connect(self._on_change)
        session.replaced.connect(self._start_over)
        session.finished.connect(self.standing.learn)
        session.entered.connect(self.rebuild)
        session.selected.connect(self._show_selection)
        session.states_changed.connect(self.restate)
        session.started.connect(self._restate_one)
        session.progressed.connect(self._restate_one)
        self.selectionChanged.connect(self._tell_selection)
        self.rebuild()

    @property
    def wires(self) -> dict[tuple[Wire, int], WireItem]:
        return self.wiring.items

    # -- the level ----------------------------------------------------------------------------------------------

    @property
    def level(self) -> Network:
        """The network that is shown: the document, or the inside of a group."""
        network = self.session.network
        path = self.session.level
        inside = network.node(path).network if path and path in network else None
        return inside if inside is not None else network

    @property
    def ui(self) -> dict[str, Any]:
        """Where the frames and notes of the level are kept."""
        owner = self.level.owner
        return owner.ui if owner is not None else self.level.ui

    @property
    def owner_path(self) -> str:
        """The path that `SetUI` takes for `ui`."""
        owner = self.level.owner
        return owner.path if owner is not None else ""

    def path_of(self, id: str) -> str:
        return self.level.prefix + id

    def rebuild(self, *_: object) -> None:
        """Show the level from nothing."""
        self.leaving.emit()
        self._selecting = True
        self.clear()
        self._selecting = False
        self.nodes, self.boxes, self._provisional = {}, {}, {}
        self.wiring.forget()
        self.sync()
        self.rebuilt.emit()

    # -- following the document ---------------------------------------------------------------------------------

    def _on_change(self, commands: list[Command]) -> None:
        if all(isinstance(command, SetUI) for command in commands):
            for command in commands:
                assert isinstance(command, SetUI)
                self._arrange(command)
            return
        if any(command.structural for command in commands):
            self._soon.start()

    def _arrange(self, command: SetUI) -> None:
        """Follow one change of what only editors look at."""
        if command.key in BOXES:
            if command.path == self.owner_path:
                self._sync_boxes()
        elif command.key in ("position", BENDS):
            prefix = self.level.prefix
            id = command.path.removeprefix(prefix)
            item = self.nodes.get(id)
            if command.path.startswith(prefix) and item is not None and id in self.level.nodes:
                if command.key == BENDS:
                    self.wiring.bend(id)
                    return
                self._place(self.level.nodes[id], item)
                self.follow(id)

    def flush(self) -> None:
        """Bring what waits to be shown up to date now."""
        if self._soon.isActive():
            self.sync()

    def sync(self) -> None:
        """Make items for what is new, remove those of what is gone, and show the rest as it is now."""
        self._soon.stop()
        level = self.level
        self._selecting = True
        for id in [id for id in self.nodes if id not in level.nodes]:
            self.removeItem(self.nodes.pop(id))
            self._provisional.pop(id, None)
        for id, node in level.nodes.items():
            item = self.nodes.get(id)
            if item is None:
                item = self.nodes[id] = NodeItem(node.path, face_of(node), self.look, self.standing.status)
                self.addItem(item)
            else:
                item.path = node.path
                item.show_face(face_of(node))
        self._find_places(level)
        for id, node in level.nodes.items():
            self._place(node, self.nodes[id])
        self.wiring.sync(level)
        self._sync_boxes()
        self._selecting = False
        self._show_selection(self.session.selection)
        self.synced.emit()

    def _sync_boxes(self) -> None:
        ui = self.ui
        wanted: dict[tuple[str, str], dict[str, Any]] = {}
        for kind in BOXES:
            stored = ui.get(kind)
            if isinstance(stored, dict):
                wanted.update({(kind, key): value for key, value in stored.items() if isinstance(value, dict)})
        for gone in [key for key in self.boxes if key not in wanted]:
            self.removeItem(self.boxes.pop(gone))
        for place, value in wanted.items():
            item = self.boxes.get(place)
            if item is None:
                item = self.boxes[place] = BoxItem(*place, self.look)
                self.addItem(item)
            item.show_value(value)

    def restate(self) -> None:
        """Ask how all nodes stand, when they are painted next."""
        for item in self.nodes.values():
            item.restate()

    def _start_over(self) -> None:
        self.standing.forget()
        self.rebuild()

    def _restate_one(self, path: str, *_: object) -> None:
        prefix = self.level.prefix
        if path.startswith(prefix):
            item = self.nodes.get(path.removeprefix(prefix).partition("/")[0])
            if item is not None:
                item.restate()

    # -- places -------------------------------------------------------------------------------------------------

    def unplaced(self) -> list[str]:
        """Ids of the nodes that have no position in the document."""
        return [id for id, node in self.level.nodes.items() if as_position(node.ui.get("position")) is None]

    def sizes(self) -> dict[str, tuple[float, float]]:
        return {id: item.size for id, item in self.nodes.items()}

    def edges(self) -> list[tuple[str, str]]:
        return [(wire[0].rpartition(".")[0], wire[1]) for wire, _ in self.wires] or [
            (source.rpartition(".")[0], target) for source, target, _ in wires_of(self.level)
        ]

    def _find_places(self, level: Network) -> None:
        """Find places for the nodes that have none in the document and were not seen before."""
        new = [id for id in self.unplaced() if id not in self._provisional]
        if not new:
            return
        edges = [(source.rpartition(".")[0], target) for source, target, _ in wires_of(level)]
        if len(new) == len(level.nodes):
            self._provisional.update(layered(self.sizes(), edges))
            return
        drawn = layered({id: self.nodes[id].size for id in new}, edges)
        settled = [id for id in level.nodes if id not in new]
        area = QRectF()
        for id in settled:
            place = self._stored(level.nodes[id])
            area = area.united(QRectF(QPointF(*place), QPointF(*place) + QPointF(*self.nodes[id].size)))
        left, top = area.left(), area.bottom() + 60
        self._provisional.update({id: (x + left, y + top) for id, (x, y) in drawn.items()})

    def _stored(self, node: Node) -> tuple[float, float]:
        return as_position(node.ui.get("position")) or self._provisional.get(node.id, (0.0, 0.0))

    def _place(self, node: Node, item: NodeItem) -> None:
        x, y = self._stored(node)
        if item.pos() != QPointF(x, y):
            item.setPos(x, y)

    def follow(self, *ids: str) -> None:
        """Lead what hangs on nodes to where these are now."""
        self.wiring.lead(*ids)
        self.arcs.lead()

    def place_again(self) -> None:
        """Put everything back to where the document has it, after a drag that came to nothing."""
        for id, node in self.level.nodes.items():
            if id in self.nodes:
                self._place(node, self.nodes[id])
        self.wiring.bend(*self.nodes)
        self.follow(*self.nodes)
        self._sync_boxes()

    def content(self) -> QRectF:
        """The rectangle around everything."""
        area = QRectF()
        for item in self.nodes.values():
            area = area.united(item.body_in_scene())
        for box in self.boxes.values():
            area = area.united(box.rect_in_scene())
        for dot in self.wiring.dots():
            area = area.united(dot.rect().translated(dot.pos()))
        return area

    # -- selection ----------------------------------------------------------------------------------------------

    def chosen(self) -> list[str]:
        """Ids of the selected nodes of this level, in the order of the document."""
        return [id for id, item in self.nodes.items() if item.isSelected()]

    def chosen_wires(self) -> list[Wire]:
        return [item.wire for item in self.wires.values() if item.chosen]

    def chosen_dots(self) -> list[BendItem]:
        return [dot for dot in self.wiring.dots() if dot.chosen]

    def chosen_boxes(self) -> list[tuple[str, str]]:
        return [key for key, item in self.boxes.items() if item.isSelected()]

    def chosen_items(self) -> list[Item]:
        """All that is selected."""
        nodes: list[Item] = [item for item in self.nodes.values() if item.isSelected()]
        boxes = [box for box in self.boxes.values() if box.isSelected()]
        return [*nodes, *boxes, *(wire for wire in self.wires.values() if wire.chosen), *self.chosen_dots()]

    def choose(self, items: Iterable[Item]) -> None:
        """Select these items and no others."""
        wanted = set(items)
        self._selecting = True
        for box in (*self.nodes.values(), *self.boxes.values()):
            if box.isSelected() != (box in wanted):
                box.setSelected(box in wanted)
        lines: list[WireItem | BendItem] = [*self.wires.values(), *self.wiring.dots()]
        for line in lines:
            if line.chosen != (line in wanted):
                line.chosen = line in wanted
                line.dress()
        self._selecting = False
        self._tell_selection()

    def _tell_selection(self) -> None:
        if not self._selecting:
            self.session.select(*[self.path_of(id) for id in self.chosen()])

    def _show_selection(self, paths: tuple[str, ...]) -> None:
        if self._selecting:
            return
        prefix = self.level.prefix
        wanted = {path.removeprefix(prefix) for path in paths if path.startswith(prefix)}
        self._selecting = True
        for id, item in self.nodes.items():
            if item.isSelected() != (id in wanted):
                item.setSelected(id in wanted)
        self._selecting = False

    # -- appearance ---------------------------------------------------------------------------------------------

    def repaint_in(self, palette: QPalette) -> None:
        """Take the colours of another palette."""
        self.look = Look.of(palette)
        items: list[NodeItem | WireItem | BoxItem] = [*self.nodes.values(), *self.wires.values(), *self.boxes.values()]
        for item in items:
            item.look = self.look
            item.update()
        for wire in self.wires.values():
            wire.dress()
        self.arcs.dress()

    def light(self, legal: set[tuple[str, str]] | None, output: bool = False) -> None:
        """Light the ports that a wire may be led to, (id, port), and fade the rest; None ends it."""
        for id, item in self.nodes.items():
            if legal is None:
                item.lit, item.faded = None, False
            else:
                item.lit = frozenset((output, port) for owner, port in legal if owner == id)
                item.faded = not item.lit
            item.update()

    def find_nodes(self, ids: set[str] | None) -> None:
        """Fade all nodes but these; None ends it."""
        for id, item in self.nodes.items():
            item.faded = ids is not None and id not in ids
            item.update()

    def background_color(self) -> QColor:
        return self.look.background
