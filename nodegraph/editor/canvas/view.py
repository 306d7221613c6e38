"""The canvas as it is worked on: mouse, keys, drops."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPoint, QPointF, Qt, Signal
from PySide6.QtGui import (
    QContextMenuEvent,
    QDragEnterEvent,
    QDragLeaveEvent,
    QDragMoveEvent,
    QDropEvent,
    QHelpEvent,
    QKeyEvent,
    QMouseEvent,
    QWheelEvent,
)

from nodegraph.editor.canvas.drags import BandDrag, BendDrag, Drag, MoveDrag, PanDrag, PullDrag, ResizeDrag, WireDrag
from nodegraph.editor.canvas.edits import CanvasEdits
from nodegraph.editor.canvas.faces import Port
from nodegraph.editor.canvas.items import BoxItem
from nodegraph.editor.canvas.look import GRID
from nodegraph.editor.canvas.node_item import NodeItem
from nodegraph.editor.canvas.proposing import Proposing
from nodegraph.editor.canvas.scene import CanvasScene, Item
from nodegraph.editor.canvas.scene_view import SceneView
from nodegraph.editor.canvas.tips import Tips
from nodegraph.editor.canvas.wires import BendItem, WireItem

MIME = "application/x-nodegraph-processor"
HANDLE = QPointF(70, 18)
"""Where a node that is dragged in is held, from its corner."""


class GraphView(SceneView):
    """Shows a `CanvasScene`. What needs a menu or a field is asked for by signals; `CanvasView` answers them."""

    wants_menu = Signal(QPoint, object)  # where on the screen, the item there or None
    wants_processors = Signal(QPointF, object)  # where in the scene; (id, port, whether an output) or None
    wants_parameters = Signal(QPointF, str, str, object)  # where, source, target id, names
    wants_rename = Signal(object)  # node or box item
    wants_find = Signal()

    def __init__(self, scene: CanvasScene, edits: CanvasEdits) -> None:
        super().__init__(scene)
        self.edits = edits
        self.drag: Drag | None = None
        self.setMouseTracking(True)
        self.setAcceptDrops(True)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.tips = Tips(scene, self.viewport())
        self.proposing = Proposing(self)
        self._pan: PanDrag | None = None
        self._space = False
        scene.synced.connect(self._end_drag)
        scene.leaving.connect(self._end_drag)

    def wire_for(self, id: str, pulled: bool = False) -> WireItem | None:
        """The wire below a node that the node fits into; ``pulled``: when it has left its own."""
        body = self.canvas_scene.nodes[id].body_in_scene()
        return self.wire_below(body, lambda wire: self.edits.can_insert(id, wire, pulled) is not None)

    def offer_processors(self, point: QPointF, id: str, port: str, output: bool) -> None:
        self.wants_processors.emit(point, (id, port, output))

    def offer_parameters(self, point: QPointF, source: str, target: str, names: list[str]) -> None:
        self.wants_parameters.emit(point, source, target, names)

    # -- mouse ----------------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.canvas_scene.flush()
        point = self.mapToScene(event.position().toPoint())
        middle = event.button() == Qt.MouseButton.MiddleButton
        left = event.button() == Qt.MouseButton.LeftButton
        if middle or (left and self._space):
            self._pan = PanDrag(self, event.position())
            self.viewport().setCursor(Qt.CursorShape.ClosedHandCursor)
        elif left and self.drag is None:
            self.drag = self._begin(point, event.modifiers())
        event.accept()

    def _begin(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> Drag:
        """The drag that a press begins; what it selects is selected now."""
        add = bool(modifiers & (Qt.KeyboardModifier.ShiftModifier | Qt.KeyboardModifier.ControlModifier))
        alt = bool(modifiers & Qt.KeyboardModifier.AltModifier)
        scene, item = self.canvas_scene, self.item_at(point)
        if isinstance(item, NodeItem):
            port = item.port_at(point)
            if port is not None:
                return self._begin_wire(item, port.name, port.output, point)
            self._press_on(item, add)
            if alt:
                scene.choose([item])
                return PullDrag(self, point, item.face.id)
            return MoveDrag(self, point)
        if isinstance(item, WireItem):
            if alt:
                return BendDrag(self, point, item)
            self._press_on(item, add)
            return Drag(self, point)
        if isinstance(item, BendItem):
            self._press_on(item, add)
            return MoveDrag(self, point)
        if isinstance(item, BoxItem):
            self._press_on(item, add)
            return ResizeDrag(self, point, item) if item.is_grip(point) else MoveDrag(self, point)
        if not add:
            scene.choose(())
        return BandDrag(self, point, add)

    def _press_on(self, item: Item, add: bool) -> None:
        chosen = self.canvas_scene.chosen_items()
        if add:
            others = [other for other in chosen if other is not item]
            self.canvas_scene.choose(others if len(others) < len(chosen) else [*chosen, item])
        elif item not in chosen:
            self.canvas_scene.choose([item])

    def _begin_wire(self, item: NodeItem, name: str, output: bool, point: QPointF) -> Drag:
        """From an output or an empty input a new wire; from a wired input its last wire is picked up."""
        sources = () if output else self.canvas_scene.level.nodes[item.face.id].inputs.get(name, ())
        if sources:
            id, _, port = sources[-1].rpartition(".")
            if id in self.canvas_scene.nodes:
                return WireDrag(self, point, id, port, True, taken=(sources[-1], item.face.id, name))
        return WireDrag(self, point, item.face.id, name, output)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._pan is not None:
            self._pan.pan(event.position())
        elif self.drag is not None:
            self.drag.move(self.mapToScene(event.position().toPoint()), event.modifiers())
        else:
            point = self.mapToScene(event.position().toPoint())
            self._show_cursor(point)
            if self.tips.subject is not None:
                self.tips.stay(self._subject_at(point))
        event.accept()

    def _show_cursor(self, point: QPointF) -> None:
        item = self.item_at(point)
        shape = Qt.CursorShape.ArrowCursor
        if self._space:
            shape = Qt.CursorShape.OpenHandCursor
        elif isinstance(item, NodeItem) and item.port_at(point) is not None:
            shape = Qt.CursorShape.CrossCursor
        elif isinstance(item, BendItem):
            shape = Qt.CursorShape.SizeAllCursor
        elif isinstance(item, BoxItem) and item.is_grip(point):
            shape = Qt.CursorShape.SizeFDiagCursor
        self.viewport().setCursor(shape)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self._pan is not None and event.button() in (Qt.MouseButton.MiddleButton, Qt.MouseButton.LeftButton):
            self._pan = None
            self.viewport().setCursor(Qt.CursorShape.ArrowCursor)
        elif self.drag is not None and event.button() == Qt.MouseButton.LeftButton:
            drag, self.drag = self.drag, None
            drag.drop(self.mapToScene(event.position().toPoint()), event.modifiers())
        event.accept()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        point = self.mapToScene(event.position().toPoint())
        item = self.item_at(point)
        if event.button() != Qt.MouseButton.LeftButton:
            return
        if isinstance(item, NodeItem) and item.port_at(point) is None:
            if item.face.group and not item.title_rect().contains(point - item.pos()):
                self.edits.session.enter(item.path)
            else:
                self.wants_rename.emit(item)
        elif isinstance(item, BoxItem):
            self.wants_rename.emit(item)
        elif isinstance(item, WireItem):
            self.edits.add_bend(item.wire, point)
        elif isinstance(item, BendItem):
            self.edits.remove_bends([item])
        elif item is None:
            self.wants_processors.emit(point, None)
        event.accept()

    def wheelEvent(self, event: QWheelEvent) -> None:
        if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            step = event.angleDelta()
            self.pan(-(step.x() or step.y()), 0)
        else:
            self.zoom_by(1.0015 ** event.angleDelta().y(), event.position())
        event.accept()

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        self.canvas_scene.flush()
        item = self.item_at(self.mapToScene(event.pos()))
        if item is not None and item not in self.canvas_scene.chosen_items():
            self.canvas_scene.choose([item])
        self.wants_menu.emit(event.globalPos(), item)
        event.accept()

    def _end_drag(self) -> None:
        """The document changed below a drag: what it was about may be gone."""
        if self.drag is not None:
            drag, self.drag = self.drag, None
            drag.cancel()

    # -- keys -------------------------------------------------------------------------------------------------------

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape and self.drag is not None:
            self._end_drag()
        elif event.key() == Qt.Key.Key_Escape and self.proposing.id:
            self.proposing.dismiss()
        elif event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            self._space = True
            self.viewport().setCursor(Qt.CursorShape.OpenHandCursor)
        elif event.key() in _ARROWS:
            self._arrow(*_ARROWS[event.key()], event.modifiers())
        else:
            event.ignore()

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Space and not event.isAutoRepeat():
            self._space = False
            self.viewport().setCursor(Qt.CursorShape.ArrowCursor)
        else:
            event.ignore()

    def _arrow(self, x: int, y: int, modifiers: Qt.KeyboardModifier) -> None:
        """Move what is selected by a step of the grid; with Alt choose the next node that way; else pan."""
        scene = self.canvas_scene
        chosen = scene.chosen()
        if modifiers & Qt.KeyboardModifier.AltModifier:
            self._choose_next(x, y)
        elif chosen:
            away = QPointF(x, y) * (1.0 if modifiers & Qt.KeyboardModifier.ShiftModifier else GRID)
            self.edits.shift(chosen, away)
        else:
            self.pan(60 * x, 60 * y)

    def _choose_next(self, x: int, y: int) -> None:
        """Select the nearest node in a direction from the selected one, or from the middle."""
        scene = self.canvas_scene
        chosen = scene.chosen()
        start = scene.nodes[chosen[0]].body_in_scene().center() if chosen else self.seen().center()
        best: tuple[float, NodeItem] | None = None
        for id, item in scene.nodes.items():
            away = item.body_in_scene().center() - start
            ahead, aside = away.x() * x + away.y() * y, abs(away.x() * y) + abs(away.y() * x)
            if id in chosen or ahead <= 0:
                continue
            cost = ahead + 2 * aside
            if best is None or cost < best[0]:
                best = (cost, item)
        if best is not None:
            scene.choose([best[1]])
            self.ensureVisible(best[1].body_in_scene(), 40, 40)
            self.moved.emit()

    # -- drops from the palette -------------------------------------------------------------------------------------

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        self._welcome(event)

    def dragMoveEvent(self, event: QDragMoveEvent) -> None:
        self._welcome(event)

    def dragLeaveEvent(self, event: QDragLeaveEvent) -> None:
        self.proposing.leave()

    def _welcome(self, event: QDragMoveEvent) -> None:
        if event.mimeData().hasFormat(MIME):
            self.proposing.hover(_processor_in(event), self.mapToScene(event.position().toPoint()) - HANDLE)
            event.setDropAction(Qt.DropAction.CopyAction)
            event.accept()
        else:
            event.ignore()

    def dropEvent(self, event: QDropEvent) -> None:
        self.proposing.leave()
        if not event.mimeData().hasFormat(MIME):
            event.ignore()
            return
        wired = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        self.drop_processor(_processor_in(event), self.mapToScene(event.position().toPoint()), wired)
        event.setDropAction(Qt.DropAction.CopyAction)
        event.accept()

    def drop_processor(self, type: str, point: QPointF, wired: bool = False) -> str | None:
        """Add a node with its title under a point; over a wire that it fits into, it goes into the wire.

        What suggests itself beside that is proposed in a bar, or done in the same step where it shall be ``wired``.
        """
        with self.edits.session.gesture("add"):
            id = self.edits.add(type, point - HANDLE)
            if id is not None:
                over = self.wire_for(id)
                if over is not None:
                    self.edits.insert(id, over.wire)
                if wired:
                    self.proposing.follow(self.proposing.found(id))
        if id is not None and not wired:
            self.proposing.offer(id)
        self.setFocus()
        return id

    # -- the rest -----------------------------------------------------------------------------------------------------

    def viewportEvent(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            self._show_tip(self.mapToScene(event.pos()), event.globalPos())
            return True
        return super().viewportEvent(event)

    def tip_at(self, point: QPointF) -> str:
        """Show the tooltip of what is at a point of the scene, and return its words."""
        self._show_tip(point, self.viewport().mapToGlobal(self.mapFromScene(point)))
        return self.tips.text

    def _show_tip(self, point: QPointF, where: QPoint) -> None:
        subject, nodes = self._subject_at(point), self.canvas_scene.nodes
        if self.drag is not None or (subject is not None and subject == self.tips.subject):
            return
        if isinstance(subject, WireItem):
            id, _, output = subject.wire[0].rpartition(".")
            outputs = nodes[id].face.outputs if id in nodes else ()
            port = next((port for port in outputs if port.name == output), None)
            if port is not None:
                self.tips.show(where, subject, id, port)
            else:
                self.tips.say(where, subject, f"This wire leads from {subject.wire[0]}, which does not exist.")
        elif subject is not None:
            self.tips.show(where, subject, *subject)
        else:
            self.tips.hide()

    def _subject_at(self, point: QPointF) -> tuple[str, Port | None] | WireItem | None:
        """What a tip at a point would be about: a node, a port of it, or a wire."""
        item = self.item_at(point)
        if isinstance(item, NodeItem):
            return item.face.id, item.port_row_at(point)
        return item if isinstance(item, WireItem) else None


def _processor_in(event: QDropEvent) -> str:
    """The id of the processor that is dragged."""
    return bytes(event.mimeData().data(MIME).data()).decode()


_ARROWS: dict[int, tuple[int, int]] = {
    Qt.Key.Key_Left: (-1, 0),
    Qt.Key.Key_Right: (1, 0),
    Qt.Key.Key_Up: (0, -1),
    Qt.Key.Key_Down: (0, 1),
}
