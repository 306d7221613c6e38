"""What happens between a press and a release of the mouse on the canvas.

While it lasts only the picture changes; the document is changed on release, as one step, and not at all on Escape.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QPen
from PySide6.QtWidgets import QGraphicsPathItem

from nodegraph.editor.canvas.faces import Wire, fitting_inputs, fitting_parameters, legal_sources, legal_targets
from nodegraph.editor.canvas.items import BoxItem, rect_json
from nodegraph.editor.canvas.look import GRID, wire_path
from nodegraph.editor.canvas.node_item import NodeItem
from nodegraph.editor.canvas.wires import WireItem

if TYPE_CHECKING:
    from nodegraph.editor.canvas.view import GraphView

FAR = 4
"""Pixels that the mouse moves before a press is a drag."""


class Drag:
    """A drag that began at a point of the scene."""

    def __init__(self, view: GraphView, start: QPointF) -> None:
        self.view = view
        self.scene = view.canvas_scene
        self.start = start

    def move(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        """The mouse is at a point of the scene."""

    def drop(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        """The button was released."""

    def cancel(self) -> None:
        """Escape was pressed, or the document changed below."""


class MoveDrag(Drag):
    """Moves nodes, bends of wires, frames with what is in them, and notes. One node over a wire is inserted there.

    A wire whose two ends move takes its bends along.
    """

    name = "move"

    def __init__(self, view: GraphView, start: QPointF) -> None:
        super().__init__(view, start)
        scene = self.scene
        self.nodes = {id: scene.nodes[id].pos() for id in scene.chosen()}
        self.boxes = {key: scene.boxes[key].rect_in_scene() for key in scene.chosen_boxes()}
        for key in list(self.boxes):
            if key[0] == "frames":
                self._take_along(self.boxes[key])
        # By wire: where all its bends were, and which of them move.
        self.bends: dict[WireItem, tuple[list[QPointF], set[int]]] = {}
        for item in scene.wiring.between(set(self.nodes)):
            if item.dots:
                self.bends[item] = (item.bends, set(range(len(item.dots))))
        for dot in scene.chosen_dots():
            self.bends.setdefault(dot.item, (dot.item.bends, set()))[1].add(dot.place)
        self.moved = False
        self.over: WireItem | None = None

    def _take_along(self, frame: QRectF) -> None:
        """A frame moves what lies in it."""
        for id, item in self.scene.nodes.items():
            if frame.contains(item.body_in_scene()):
                self.nodes.setdefault(id, item.pos())
        for key, box in self.scene.boxes.items():
            if frame.contains(box.rect_in_scene()):
                self.boxes.setdefault(key, box.rect_in_scene())

    def move(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        away = point - self.start
        if not self.moved and self.view.pixels(away) < FAR:
            return
        self.moved = True
        snap = bool(modifiers & Qt.KeyboardModifier.ControlModifier)
        for id, place in self.nodes.items():
            if id in self.scene.nodes:
                self.scene.nodes[id].setPos(_snapped(place + away) if snap else place + away)
        for key, rect in self.boxes.items():
            if key in self.scene.boxes:
                self.scene.boxes[key].show_rect(rect.translated(away))
        for item, (places, moving) in self.bends.items():
            shifted = [_snapped(place + away) if snap else place + away for place in places]
            item.show_bends([shifted[i] if i in moving else place for i, place in enumerate(places)])
        self.scene.follow(*self.nodes)
        self._mark()

    def _mark(self) -> None:
        """Mark the wire that the node would be inserted into."""
        over = self.wire_below()
        if over is not self.over:
            for item, marked in ((self.over, False), (over, True)):
                if item is not None:
                    item.marked = marked
                    item.dress()
            self.over = over

    def wire_below(self) -> WireItem | None:
        """The wire that a single node fits into where it is now."""
        return self.view.wire_for(next(iter(self.nodes))) if len(self.nodes) == 1 and not self.boxes else None

    def drop(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        self.move(point, modifiers)
        if not self.moved:
            return
        into = self.over.wire if self.over is not None else None
        self._unmark()
        # An edit may lead the wires anew from the document, so everything is read from the picture first.
        places = {id: self.scene.nodes[id].pos() for id in self.nodes if id in self.scene.nodes}
        rects = {key: self.scene.boxes[key].rect_in_scene() for key in self.boxes if key in self.scene.boxes}
        bends = {item.wire: item.bends for item in self.bends}
        with self.view.edits.session.gesture(self.name):
            self.write(places, rects, bends)
            if into is not None:
                self.view.edits.insert(next(iter(self.nodes)), into)

    def write(
        self,
        places: dict[str, QPointF],
        rects: dict[tuple[str, str], QRectF],
        bends: dict[Wire, list[QPointF]],
    ) -> None:
        """Write into the document where everything is now."""
        edits = self.view.edits
        if places:
            edits.place({id: (place.x(), place.y()) for id, place in places.items()})
        for (kind, key), rect in rects.items():
            edits.change_box(kind, key, rect=rect_json(rect))
        for wire, points in bends.items():
            edits.bend(wire, points)

    def _unmark(self) -> None:
        if self.over is not None:
            self.over.marked = False
            self.over.dress()
            self.over = None

    def cancel(self) -> None:
        self._unmark()
        self.scene.place_again()


class PullDrag(MoveDrag):
    """Takes a node out of its wires while it is moved away: its readers then read what it would hand on muted."""

    name = "pull out"

    def __init__(self, view: GraphView, start: QPointF, id: str) -> None:
        super().__init__(view, start)
        self.id = id

    def move(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        super().move(point, modifiers)
        self._fade(self.moved)

    def wire_below(self) -> WireItem | None:
        return self.view.wire_for(self.id, pulled=True)

    def write(
        self,
        places: dict[str, QPointF],
        rects: dict[tuple[str, str], QRectF],
        bends: dict[Wire, list[QPointF]],
    ) -> None:
        self._fade(False)
        super().write(places, rects, {})
        self.view.edits.pull_out(self.id)

    def cancel(self) -> None:
        self._fade(False)
        super().cancel()

    def _fade(self, faded: bool) -> None:
        for (wire, _), item in self.scene.wires.items():
            if self.id in (wire[1], wire[0].rpartition(".")[0]) and item.faded != faded:
                item.faded = faded
                item.dress()


class BendDrag(MoveDrag):
    """Adds a bend to a wire where it is pressed and drags it; it is there even if the mouse does not move."""

    name = "bend"

    def __init__(self, view: GraphView, start: QPointF, item: WireItem) -> None:
        piece = item.piece_at(start)
        item.show_bends([*item.bends[:piece], start, *item.bends[piece:]])
        view.canvas_scene.choose([item.dots[piece]])
        super().__init__(view, start)
        self.moved = True


class ResizeDrag(Drag):
    """Drags the corner of a frame or a note."""

    def __init__(self, view: GraphView, start: QPointF, box: BoxItem) -> None:
        super().__init__(view, start)
        self.box = box
        self.rect = box.rect_in_scene()

    def move(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        corner = self.rect.bottomRight() + point - self.start
        width, height = max(80.0, corner.x() - self.rect.x()), max(50.0, corner.y() - self.rect.y())
        self.box.show_rect(QRectF(self.rect.x(), self.rect.y(), width, height))

    def drop(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        self.move(point, modifiers)
        with self.view.edits.session.gesture("resize"):
            rect = rect_json(self.box.rect_in_scene())
            self.view.edits.change_box(self.box.kind, self.box.key, rect=rect)

    def cancel(self) -> None:
        self.scene.place_again()


class WireDrag(Drag):
    """Draws a wire from a port, or takes the end of a wire elsewhere; ports that may take it are lit.

    ``taken``: the wire whose end was picked up. Dropped on nothing, a new wire offers the processors that fit, and a
    wire that was picked up is removed.
    """

    def __init__(
        self, view: GraphView, start: QPointF, id: str, port: str, output: bool, taken: Wire | None = None
    ) -> None:
        super().__init__(view, start)
        self.id, self.port, self.output, self.taken = id, port, output, taken
        level = self.scene.level
        self.legal = legal_targets(level, f"{id}.{port}") if output else legal_sources(level, id, port)
        given = next((p.type for p in self.scene.nodes[id].face.outputs if output and p.name == port), None)
        self.given = given
        if taken is not None:
            self.legal.add((taken[1], taken[2]))
        face = self.scene.nodes[id].face
        color = next((p.color for p in (face.outputs if output else face.inputs) if p.name == port), "#cccccc")
        self.item = QGraphicsPathItem()
        pen = QPen(self.scene.look.wire(color), 2.5)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        self.item.setPen(pen)
        self.item.setZValue(20)
        self.scene.addItem(self.item)
        self.scene.light(self.legal, output=not output)
        self.fade_taken(True)

    def fade_taken(self, faded: bool) -> None:
        for (wire, _), item in self.scene.wires.items():
            if wire == self.taken:
                item.faded = faded
                item.dress()

    def target(self, point: QPointF) -> tuple[str, str] | None:
        """The legal port at a point: that which is hit, or on a node the first that fits."""
        item = self.view.node_at(point, reach=14.0)
        if item is None:
            return None
        port = item.port_at(point, 14.0) or item.port_row_at(point)
        if port is not None and port.output != self.output and (item.face.id, port.name) in self.legal:
            return item.face.id, port.name
        if port is not None and item.port_at(point, 14.0) is not None:
            return None
        if not item.body().contains(point - item.pos()):
            return None
        fitting = [name for id, name in self.legal if id == item.face.id]
        if self.output and self.given is not None:
            ordered = fitting_inputs(self.scene.level.nodes[item.face.id], self.given)
            fitting = [name for name in ordered if name in fitting]
        return (item.face.id, fitting[0]) if fitting else None

    def move(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        fixed = self.scene.nodes[self.id].anchor(self.output, self.port)
        hit = self.target(point)
        end = self.scene.nodes[hit[0]].anchor(not self.output, hit[1]) if hit is not None else point
        self.item.setPath(wire_path(fixed, end) if self.output else wire_path(end, fixed))

    def drop(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        hit = self.target(point)
        self.cancel()
        edits, view = self.view.edits, self.view
        if hit is not None:
            if self.taken is not None:
                self._lead_elsewhere(hit)
            elif self.output:
                edits.connect(f"{self.id}.{self.port}", *hit)
            else:
                edits.connect(f"{hit[0]}.{hit[1]}", self.id, self.port)
            return
        item = view.node_at(point)
        if item is not None:
            self._offer_parameters(item, point)
        elif self.taken is not None:
            edits.disconnect(self.taken)
        elif view.pixels(point - self.start) >= FAR:
            view.offer_processors(point, self.id, self.port, self.output)

    def _lead_elsewhere(self, hit: tuple[str, str]) -> None:
        assert self.taken is not None
        if hit == (self.taken[1], self.taken[2]):
            return
        with self.view.edits.session.gesture("reconnect"):
            self.view.edits.disconnect(self.taken)
            self.view.edits.connect(self.taken[0], *hit)

    def _offer_parameters(self, item: NodeItem, point: QPointF) -> None:
        """On the body of a node with no input that fits: the parameters that can follow the wire."""
        if self.given is None or item.face.id == self.id:
            return
        names = fitting_parameters(self.scene.level.nodes[item.face.id], self.given)
        if names:
            self.view.offer_parameters(point, f"{self.id}.{self.port}", item.face.id, names)

    def cancel(self) -> None:
        if self.item.scene() is not None:
            self.scene.removeItem(self.item)
        self.scene.light(None)
        self.fade_taken(False)


class BandDrag(Drag):
    """Selects what a rectangle touches; with Shift or Ctrl in addition to what is selected."""

    def __init__(self, view: GraphView, start: QPointF, add: bool) -> None:
        super().__init__(view, start)
        self.before = self.scene.chosen_items() if add else []
        self.item = QGraphicsPathItem()
        accent = self.scene.look.accent
        pen = QPen(accent, 1)
        pen.setCosmetic(True)
        self.item.setPen(pen)
        fill = accent.toRgb()
        fill.setAlpha(40)
        self.item.setBrush(fill)
        self.item.setZValue(30)
        self.scene.addItem(self.item)

    def move(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        path = self.item.path().__class__()
        path.addRect(QRectF(self.start, point).normalized())
        self.item.setPath(path)

    def drop(self, point: QPointF, modifiers: Qt.KeyboardModifier) -> None:
        rect = QRectF(self.start, point).normalized()
        self.cancel()
        hit = [item for item in self.scene.nodes.values() if rect.intersects(item.body_in_scene())]
        boxes = [box for box in self.scene.boxes.values() if rect.contains(box.rect_in_scene())]
        dots = [dot for dot in self.scene.wiring.dots() if rect.contains(dot.pos())]
        self.scene.choose([*self.before, *hit, *boxes, *dots])

    def cancel(self) -> None:
        if self.item.scene() is not None:
            self.scene.removeItem(self.item)


class PanDrag(Drag):
    """Moves what is seen. The start is in pixels of the viewport, since the scene moves below the mouse."""

    def pan(self, pixels: QPointF) -> None:
        away = pixels - self.start
        self.start = pixels
        self.view.pan(-away.x(), -away.y())


def _snapped(point: QPointF) -> QPointF:
    return QPointF(GRID * round(point.x() / GRID), GRID * round(point.y() / GRID))
