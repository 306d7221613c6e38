"""What the canvas does to the document, each as one undo step of commands."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from PySide6.QtCore import QPointF, QRectF

from nodegraph import clipboard
from nodegraph.commands import Add, Connect, Disconnect, Mute, Remove, Rename, SetUI
from nodegraph.editor.canvas.box_edits import BoxEdits
from nodegraph.editor.canvas.layout import layered
from nodegraph.editor.canvas.level_edits import Refused
from nodegraph.editor.canvas.wire_edits import WireEdits
from nodegraph.group_commands import Group, Ungroup
from nodegraph.network import Node
from nodegraph.wires import is_many

STEP = 30.0
"""How far a copy stands from what it was copied from."""


class CanvasEdits(WireEdits, BoxEdits):
    """Edits of the level that a scene shows."""

    # -- places -------------------------------------------------------------------------------------------------

    def place(self, places: Mapping[str, tuple[float, float]], name: str = "move") -> None:
        """Write positions of nodes, by id; with them those of all nodes of the level that have none yet."""
        unplaced = {id: _xy(self.scene.nodes[id].pos()) for id in self.scene.unplaced() if id not in places}
        with self.session.gesture(name):
            for id, (x, y) in {**unplaced, **places}.items():
                if id in self.level.nodes:
                    self.session.do(SetUI(self.scene.path_of(id), "position", [round(x), round(y)]))

    def shift(self, ids: Iterable[str], away: QPointF, name: str = "move") -> None:
        """Move nodes, and the bends of the wires between them."""
        chosen = list(ids)
        with self.session.gesture(name):
            self.place({id: _xy(self.scene.nodes[id].pos() + away) for id in chosen}, name)
            self.shift_bends(chosen, away)

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
        with self.session.gesture("auto-layout"):
            self.place(places, "auto-layout")
            for item in self.scene.wiring.between(set(places)):
                if item.dots:
                    self.bend(item.wire, [])  # it has room of its own now

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
        """Remove what is selected: nodes, wires, bends, frames and notes."""
        nodes, wires, boxes = self.scene.chosen(), self.scene.chosen_wires(), self.scene.chosen_boxes()
        dots = self.scene.chosen_dots()
        if not (nodes or wires or boxes or dots):
            return
        with self.session.gesture("delete"):
            self.remove_bends(dots)
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
                self.must(command)
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
        self.shift(ids, away, "paste")

    def duplicate(self) -> list[str]:
        """Copy the selected nodes with the wires into them and the variables that they follow."""
        chosen = self.scene.chosen()
        text = self.copied()
        if not text:
            return []
        try:
            with self.session.gesture("duplicate"):
                command = clipboard.Paste(text, group=self.level.prefix.rstrip("/"))
                self.must(command)
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
                self.must(command)
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
                    self.must(command)
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


def _xy(point: QPointF) -> tuple[float, float]:
    return point.x(), point.y()
