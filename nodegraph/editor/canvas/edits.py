"""What the canvas does to the document, each as one undo step of commands."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QPointF, QRectF

from nodegraph import clipboard
from nodegraph.commands import Add, Connect, Disconnect, Mute, Remove, Rename, SetUI
from nodegraph.editor.canvas.faces import Wire, fitting_inputs, fitting_output, inputs_of, output_port
from nodegraph.editor.canvas.items import rect_json
from nodegraph.editor.canvas.layout import layered
from nodegraph.errors import GraphError
from nodegraph.group_commands import Group, Ungroup
from nodegraph.network import Network, Node, unique
from nodegraph.ports import connects
from nodegraph.wires import is_many, pass_through

if TYPE_CHECKING:
    from nodegraph.editor.canvas.scene import CanvasScene
    from nodegraph.editor.session import Session

STEP = 30.0
"""How far a copy stands from what it was copied from."""


class Refused(Exception):
    """A command of a gesture was refused; the gesture is taken back. The session has told why."""


class CanvasEdits:
    """Edits of the level that a scene shows."""

    def __init__(self, scene: CanvasScene) -> None:
        self.scene = scene

    @property
    def session(self) -> Session:
        return self.scene.session

    @property
    def level(self) -> Network:
        return self.scene.level

    def _must(self, command: Any) -> None:
        if not self.session.do(command):
            raise Refused

    # -- places -------------------------------------------------------------------------------------------------

    def place(self, places: Mapping[str, tuple[float, float]], name: str = "move") -> None:
        """Write positions of nodes, by id; with them those of all nodes of the level that have none yet."""
        unplaced = {id: _xy(self.scene.nodes[id].pos()) for id in self.scene.unplaced() if id not in places}
        with self.session.gesture(name):
            for id, (x, y) in {**unplaced, **places}.items():
                if id in self.level.nodes:
                    self.session.do(SetUI(self.scene.path_of(id), "position", [round(x), round(y)]))

    def layout(self, ids: Iterable[str] = ()) -> None:
        """Draw these nodes, or all of the level, in layers. Chosen ones keep the corner of their surroundings."""
        self.scene.flush()
        chosen = list(ids)
        sizes = {id: size for id, size in self.scene.sizes().items() if not chosen or id in chosen}
        if not sizes:
            return
        places = layered(sizes, self.scene.edges())
        if chosen:
            corner = self._corner(chosen)
            places = {id: (x + corner.x(), y + corner.y()) for id, (x, y) in places.items()}
        self.place(places, "auto-layout")

    def _corner(self, ids: Iterable[str]) -> QPointF:
        area = QRectF()
        for id in ids:
            area = area.united(self.scene.nodes[id].body_in_scene())
        return area.topLeft()

    def align(self, edge: str) -> None:
        """Bring the selected nodes to one line, "left", "right", "top", "bottom", or "columns": equal gaps below."""
        self.scene.flush()
        chosen = [self.scene.nodes[id] for id in self.scene.chosen()]
        if len(chosen) < 2:
            return
        rects = {item.face.id: item.body_in_scene() for item in chosen}
        left, top = min(r.left() for r in rects.values()), min(r.top() for r in rects.values())
        right, bottom = max(r.right() for r in rects.values()), max(r.bottom() for r in rects.values())
        places: dict[str, tuple[float, float]] = {}
        y = top
        for id, rect in sorted(rects.items(), key=lambda item: item[1].top()):
            places[id] = {
                "left": (left, rect.top()),
                "right": (right - rect.width(), rect.top()),
                "top": (rect.left(), top),
                "bottom": (rect.left(), bottom - rect.height()),
                "columns": (left, y),
            }[edge]
            y += rect.height() + 26
        self.place(places, "align")

    # -- nodes --------------------------------------------------------------------------------------------------

    def add(self, type: str, at: QPointF) -> str | None:
        """Add a node with its title at a point and return its id; None where it is refused."""
        while any((item.pos() - at).manhattanLength() < STEP / 2 for item in self.scene.nodes.values()):
            at += QPointF(STEP, STEP)  # never exactly on another node
        command = Add(type, group=self.level.prefix.rstrip("/"))
        with self.session.gesture("add"):
            if not self.session.do(command):
                return None
            self.session.do(SetUI(command.path, "position", [round(at.x()), round(at.y())]))
        self.scene.sync()
        self.session.select(command.path)
        return command.path.removeprefix(self.level.prefix)

    def delete(self) -> None:
        """Remove what is selected: nodes, wires, frames and notes."""
        nodes, wires, boxes = self.scene.chosen(), self.scene.chosen_wires(), self.scene.chosen_boxes()
        if not (nodes or wires or boxes):
            return
        with self.session.gesture("delete"):
            for source, target, name in wires:
                if target not in nodes and source in self.level.nodes[target].inputs.get(name, ()):
                    self.session.do(Disconnect(self._port(target, name), source))
            if nodes:
                self.session.do(Remove([self.scene.path_of(id) for id in nodes]))
            for kind, key in boxes:
                self.put_box(kind, key, None)
        self.scene.flush()

    def rename(self, id: str, new: str) -> bool:
        """Give a node another id."""
        done = self.session.do(Rename(self.scene.path_of(id), new.strip()))
        self.scene.flush()
        return done

    def mute(self) -> None:
        """Mute the selected nodes; wake them up where all are muted."""
        chosen = self.scene.chosen()
        muted = not all(self.level.nodes[id].muted for id in chosen)
        with self.session.gesture("mute" if muted else "unmute"):
            for id in chosen:
                self.session.do(Mute(self.scene.path_of(id), muted))
        self.scene.flush()

    def copied(self) -> str:
        """The selected nodes as JSON text; empty where none is."""
        chosen = self.scene.chosen()
        if not chosen:
            return ""
        self._remember_places(copied := clipboard.copy(self.session.network, map(self.scene.path_of, chosen)), chosen)
        return json.dumps(copied, indent=2)

    def _remember_places(self, copied: dict[str, Any], ids: Iterable[str]) -> None:
        """Give nodes that the layout has placed their place in the copy."""
        unplaced = self.scene.unplaced()
        for id in ids:
            if id in unplaced:
                place = [round(part) for part in _xy(self.scene.nodes[id].pos())]
                ui = dict(copied.setdefault("ui", {}).get("nodes", {}))
                ui[id] = {**ui.get(id, {}), "position": place}
                copied["ui"]["nodes"] = ui

    def paste(self, text: str, at: QPointF | None = None) -> list[str]:
        """Add what was copied, its middle at a point or a little off its old place; returns the new ids."""
        command = clipboard.Paste(text, group=self.level.prefix.rstrip("/"))
        try:
            with self.session.gesture("paste"):
                self._must(command)
                self.scene.sync()
                ids = [path.removeprefix(self.level.prefix) for path in command.paths]
                self._shift(ids, at)
        except Refused:
            return []
        self.session.select(*command.paths)
        return ids

    def _shift(self, ids: list[str], at: QPointF | None) -> None:
        area = QRectF()
        for id in ids:
            area = area.united(self.scene.nodes[id].body_in_scene())
        away = QPointF(STEP, STEP) if at is None else at - area.center()
        away = QPointF(round(away.x()), round(away.y()))  # together, or the nodes would shift against each other
        self.place({id: _xy(self.scene.nodes[id].pos() + away) for id in ids}, "paste")

    def duplicate(self) -> list[str]:
        """Copy the selected nodes with the wires into them and the variables that they follow."""
        chosen = self.scene.chosen()
        text = self.copied()
        if not text:
            return []
        try:
            with self.session.gesture("duplicate"):
                command = clipboard.Paste(text, group=self.level.prefix.rstrip("/"))
                self._must(command)
                self.scene.sync()
                ids = [path.removeprefix(self.level.prefix) for path in command.paths]
                # Paste keeps the order of the document, and so does `chosen`.
                for old, new in zip(chosen, ids, strict=True):
                    self._wire_like(self.level.nodes[old], new, chosen)
                self._shift(ids, None)
        except Refused:
            return []
        self.session.select(*command.paths)
        return ids

    def _wire_like(self, old: Node, new: str, chosen: list[str]) -> None:
        """Wire a copy to what the original reads of the nodes that were not copied."""
        for name, sources in list(old.inputs.items()):
            for place, source in enumerate(sources):
                if source.rpartition(".")[0] not in chosen:
                    many = place if is_many(old, name) else None
                    self.session.do(Connect(self._source(source), self._port(new, name), place=many))

    def group(self) -> str | None:
        """Put the selected nodes into a group, which stands in their middle; returns its id."""
        chosen = self.scene.chosen()
        if not chosen:
            return None
        area = QRectF()
        for id in chosen:
            area = area.united(self.scene.nodes[id].body_in_scene())
        command = Group([self.scene.path_of(id) for id in chosen])
        try:
            with self.session.gesture("group"):
                self.place({id: _xy(self.scene.nodes[id].pos()) for id in chosen}, "group")
                self._must(command)
                id = command.path.removeprefix(self.level.prefix)
                self.scene.sync()
                width, height = self.scene.nodes[id].size
                middle = area.center()
                self.place({id: (middle.x() - width / 2, middle.y() - height / 2)}, "group")
        except Refused:
            return None
        self.session.select(command.path)
        return id

    def ungroup(self) -> list[str]:
        """Dissolve the selected groups; their nodes come to stand around the group's place. Returns their ids."""
        groups = [id for id in self.scene.chosen() if self.level.nodes[id].network is not None]
        paths: list[str] = []
        try:
            with self.session.gesture("ungroup"):
                for id in groups:
                    middle = self.scene.nodes[id].body_in_scene().center()
                    command = Ungroup(self.scene.path_of(id))
                    self._must(command)
                    self.scene.sync()
                    ids = [path.removeprefix(self.level.prefix) for path in command.paths]
                    if ids:
                        self._shift(ids, middle)
                    paths += command.paths
        except Refused:
            self.scene.sync()
            return []
        if paths:
            self.session.select(*paths)
        return [path.removeprefix(self.level.prefix) for path in paths]

    # -- wires --------------------------------------------------------------------------------------------------

    def _port(self, id: str, name: str) -> str:
        return f"{self.scene.path_of(id)}.{name}"

    def _source(self, source: str) -> str:
        return self.level.prefix + source

    def connect(self, source: str, target: str, name: str) -> bool:
        """Wire ``node.output`` to an input; a single input gives up the wire that it has."""
        node = self.level.nodes[target]
        replace = not is_many(node, name)
        if not replace and source in node.inputs.get(name, ()):
            return True
        done = self.session.do(Connect(self._source(source), self._port(target, name), replace=replace))
        self.scene.flush()
        return done

    def disconnect(self, wire: Wire) -> bool:
        """Take one wire out."""
        source, target, name = wire
        done = self.session.do(Disconnect(self._port(target, name), source))
        self.scene.flush()
        return done

    def can_insert(self, id: str, wire: Wire) -> tuple[str, str] | None:
        """The input and output by which a node would go into a wire; None where it does not fit."""
        source, target, name = wire
        node = self.level.nodes.get(id)
        giver, _, output = source.rpartition(".")
        if node is None or giver not in self.level.nodes or id in (giver, target) or any(node.inputs.values()):
            return None
        given = output_port(self.level.nodes[giver], output).type
        wanted = next((port.type for port in inputs_of(self.level.nodes[target]) if port.name == name), None)
        if given is None or wanted is None:
            return None
        into = next(iter(fitting_inputs(node, given)), None)
        out = fitting_output(node, lambda type: connects(type, wanted))
        return (into, out) if into is not None and out is not None else None

    def insert(self, id: str, wire: Wire) -> bool:
        """Put a node into a wire."""
        fits = self.can_insert(id, wire)
        if fits is None:
            return False
        source, target, name = wire
        many = is_many(self.level.nodes[target], name)
        try:
            with self.session.gesture("insert"):
                place = self.level.nodes[target].inputs[name].index(source)
                self._must(Disconnect(self._port(target, name), source))
                self._must(Connect(self._source(source), self._port(id, fits[0])))
                end = f"{self._port(id, fits[1])}"
                self._must(Connect(end, self._port(target, name), place=place if many else None))
        except Refused:
            return False
        self.scene.flush()
        return True

    def pull_out(self, id: str) -> bool:
        """Take a node out of its wires: its readers read what it would hand on if it were muted."""
        node = self.level.nodes[id]
        readers = [
            (source, other.id, name, place)
            for other in self.level.nodes.values()
            for name, sources in other.inputs.items()
            for place, source in enumerate(sources)
            if source.rpartition(".")[0] == id
        ]
        if not readers and not any(node.inputs.values()):
            return False
        try:
            with self.session.gesture("pull out"):
                for source, target, name, place in readers:
                    stand_in = self._stand_in(node, source.rpartition(".")[2])
                    self._must(Disconnect(self._port(target, name), source))
                    reader = self.level.nodes[target]
                    if stand_in is None or stand_in in reader.inputs.get(name, ()):
                        continue
                    at = place if is_many(reader, name) else None
                    self._must(Connect(self._source(stand_in), self._port(target, name), place=at))
                for name in [name for name, sources in node.inputs.items() if sources]:
                    self._must(Disconnect(self._port(id, name)))
        except Refused:
            return False
        self.scene.flush()
        return True

    def _stand_in(self, node: Node, output: str) -> str | None:
        """What a muted node hands on as an output: the source of an input of the same type."""
        name = pass_through(node, output)
        sources = node.inputs.get(name, ()) if name is not None else ()
        if not sources:
            return None
        giver, _, given = sources[0].rpartition(".")
        return sources[0] if giver in self.level.nodes and self._makes(giver, given) else None

    def _makes(self, id: str, output: str) -> bool:
        try:
            return output_port(self.level.nodes[id], output).type is not None
        except GraphError:
            return False

    # -- frames and notes ---------------------------------------------------------------------------------------

    def put_box(self, kind: str, key: str, value: dict[str, Any] | None) -> None:
        """Write one frame or note of the level; None removes it."""
        stored = self.scene.ui.get(kind)
        boxes = dict(stored) if isinstance(stored, dict) else {}
        if value is None:
            boxes.pop(key, None)
        else:
            boxes[key] = value
        self.session.do(SetUI(self.scene.owner_path, kind, boxes or None))

    def change_box(self, kind: str, key: str, **changes: Any) -> None:
        """Write some entries of a frame or note."""
        stored = self.scene.ui.get(kind, {}).get(key)
        if isinstance(stored, dict):
            self.put_box(kind, key, {**stored, **changes})

    def add_frame(self, title: str = "Frame") -> str:
        """Draw a frame around what is selected."""
        area = QRectF()
        for id in self.scene.chosen():
            area = area.united(self.scene.nodes[id].body_in_scene())
        return self.add_box("frames", area.adjusted(-20, -44, 20, 20), title)

    def add_box(self, kind: str, rect: QRectF, text: str) -> str:
        """Add a frame or a note and return its key."""
        stored = self.scene.ui.get(kind)
        key = unique("frame" if kind == "frames" else "note", stored if isinstance(stored, dict) else ())
        with self.session.gesture("frame" if kind == "frames" else "note"):
            self.put_box(kind, key, {"text": text, "rect": rect_json(rect)})
        return key


def _xy(point: QPointF) -> tuple[float, float]:
    return point.x(), point.y()
