"""What the canvas does to wires, each as one undo step of commands."""

from __future__ import annotations

from collections.abc import Iterable

from PySide6.QtCore import QPointF

from nodegraph.bends import BENDS, bends_of, with_bends
from nodegraph.commands import Connect, Disconnect, SetUI
from nodegraph.editor.canvas.faces import Wire, fitting_inputs, fitting_output, inputs_of, output_port
from nodegraph.editor.canvas.level_edits import LevelEdits, Refused
from nodegraph.editor.canvas.wires import BendItem
from nodegraph.errors import GraphError
from nodegraph.network import Node
from nodegraph.ports import connects
from nodegraph.wires import is_many, pass_through


class WireEdits(LevelEdits):
    """Wires of the level: drawn, bent, taken out; nodes put into them and pulled out of them."""

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

    # -- bends --------------------------------------------------------------------------------------------------

    def bend(self, wire: Wire, places: Iterable[QPointF]) -> None:
        """Let a wire bend at these points of the scene, from its source on."""
        source, target, name = wire
        node = self.level.nodes.get(target)
        if node is None:
            return
        points = [(place.x(), place.y()) for place in places]
        self.session.do(SetUI(self.scene.path_of(target), BENDS, with_bends(node, name, source, points)))

    def add_bend(self, wire: Wire, at: QPointF) -> None:
        """Let a wire bend at one more point."""
        item = next(item for (other, _), item in self.scene.wires.items() if other == wire)
        piece = item.piece_at(at)
        with self.session.gesture("bend"):
            self.bend(wire, [*item.bends[:piece], at, *item.bends[piece:]])

    def straighten(self, wires: Iterable[Wire]) -> None:
        """Take all bends out of these wires."""
        with self.session.gesture("straighten"):
            for wire in wires:
                self.bend(wire, [])

    def remove_bends(self, dots: Iterable[BendItem]) -> None:
        """Take single bends out of their wires."""
        gone = set(dots)
        with self.session.gesture("straighten"):
            for item in {dot.item for dot in gone}:
                self.bend(item.wire, [dot.pos() for dot in item.dots if dot not in gone])

    def shift_bends(self, ids: Iterable[str], away: QPointF) -> None:
        """Move the bends of all wires between these nodes along with them."""
        for item in self.scene.wiring.between(set(ids)):
            if item.dots:
                self.bend(item.wire, [place + away for place in item.bends])

    # -- nodes in wires -----------------------------------------------------------------------------------------

    def can_insert(self, id: str, wire: Wire, pulled: bool = False) -> tuple[str, str] | None:
        """The input and output by which a node would go into a wire; None where it does not fit.

        ``pulled``: it comes out of its own wires first.
        """
        node = self.level.nodes.get(id)
        if node is None or (any(node.inputs.values()) and not pulled):
            return None
        return self.fits_into(node, wire)

    def fits_into(self, node: Node, wire: Wire) -> tuple[str, str] | None:
        """The input and output by which a node that reads nothing would go into a wire; None where it does not fit."""
        source, target, name = wire
        giver, _, output = source.rpartition(".")
        if giver not in self.level.nodes or node.id in (giver, target):
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
        bends = [QPointF(x, y) for x, y in bends_of(self.level.nodes[target], name, source)]
        item = next((item for (other, _), item in self.scene.wires.items() if other == wire), None)
        piece = item.piece_at(self.scene.nodes[id].body_in_scene().center()) if item is not None else 0
        try:
            with self.session.gesture("insert"):
                place = self.level.nodes[target].inputs[name].index(source)
                self.must(Disconnect(self._port(target, name), source))
                self.must(Connect(self._source(source), self._port(id, fits[0])))
                end = f"{self._port(id, fits[1])}"
                self.must(Connect(end, self._port(target, name), place=place if many else None))
                self.bend((source, id, fits[0]), bends[:piece])
                self.bend((f"{id}.{fits[1]}", target, name), bends[piece:])
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
                    self.must(Disconnect(self._port(target, name), source))
                    reader = self.level.nodes[target]
                    if stand_in is None or stand_in in reader.inputs.get(name, ()):
                        continue
                    at = place if is_many(reader, name) else None
                    self.must(Connect(self._source(stand_in), self._port(target, name), place=at))
                for name in [name for name, sources in node.inputs.items() if sources]:
                    self.must(Disconnect(self._port(id, name)))
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
