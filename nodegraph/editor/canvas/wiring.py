"""The wires of the level that a scene shows: which there are, what they look like, and where they run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF

from nodegraph.bends import bends_of
from nodegraph.editor.canvas.faces import Wire, output_port, wires_of
from nodegraph.editor.canvas.wires import BendItem, WireItem

if TYPE_CHECKING:
    from nodegraph.editor.canvas.scene import CanvasScene
    from nodegraph.network import Network


class Wiring:
    """The wire items of a scene. Several wires between the same ports, as in a broken file, are numbered."""

    def __init__(self, scene: CanvasScene) -> None:
        self.scene = scene
        self.items: dict[tuple[Wire, int], WireItem] = {}
        self._at: dict[str, list[WireItem]] = {}

    def forget(self) -> None:
        """The scene was cleared."""
        self.items, self._at = {}, {}

    def sync(self, level: Network) -> None:
        """Make items for new wires, remove those of wires that are gone, and lead all."""
        scene = self.scene
        wanted: dict[tuple[Wire, int], None] = {}
        for wire in wires_of(level):
            twin = 0
            while (wire, twin) in wanted:
                twin += 1
            wanted[wire, twin] = None
        for key in [key for key in self.items if key not in wanted]:
            scene.removeItem(self.items.pop(key))
        colors: dict[str, tuple[str, bool]] = {}
        self._at = {id: [] for id in scene.nodes}
        for key in wanted:
            wire = key[0]
            item = self.items.get(key)
            if item is None:
                item = self.items[key] = WireItem(wire, scene.look)
                scene.addItem(item)
            source = wire[0]
            id, _, output = source.rpartition(".")
            if source not in colors:
                port = output_port(level.nodes[id], output) if id in level.nodes else None
                there = port is not None and any(one.name == output for one in scene.nodes[id].face.outputs)
                colors[source] = (port.color if port is not None else "#d9534f", not there)
            item.color, item.broken = colors[source]
            item.muted = id in level.nodes and level.nodes[id].muted
            for end in {id, wire[1]}:
                if end in self._at:
                    self._at[end].append(item)
            self._bend(item)
            self._lead(item)
            item.dress()

    def lead(self, *ids: str) -> None:
        """Lead the wires of nodes to where these are now."""
        for item in dict.fromkeys(item for id in ids for item in self._at.get(id, ())):
            self._lead(item)

    def bend(self, *ids: str) -> None:
        """Let the wires of nodes bend where the document says."""
        for item in dict.fromkeys(item for id in ids for item in self._at.get(id, ())):
            self._bend(item)

    def between(self, ids: set[str]) -> list[WireItem]:
        """The wires that run from one of these nodes to another."""
        return [item for (wire, _), item in self.items.items() if wire[1] in ids and wire[0].rpartition(".")[0] in ids]

    def dots(self) -> list[BendItem]:
        """All dots at which wires bend."""
        return [dot for item in self.items.values() for dot in item.dots]

    def _bend(self, item: WireItem) -> None:
        source, target, name = item.wire
        node = self.scene.level.nodes.get(target)
        item.show_bends([QPointF(x, y) for x, y in bends_of(node, name, source)] if node is not None else [])

    def _lead(self, item: WireItem) -> None:
        nodes = self.scene.nodes
        source, target, name = item.wire
        id, _, output = source.rpartition(".")
        if target not in nodes:
            return
        end = nodes[target].anchor(False, name)
        start = nodes[id].anchor(True, output) if id in nodes else end - QPointF(60, 0)
        item.lead(start, end)
