"""Arcs between nodes that share a variable, drawn over the canvas where they are wanted."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF, QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPainterPath, QPen
from PySide6.QtWidgets import QGraphicsItem, QGraphicsPathItem, QStyleOptionGraphicsItem, QWidget

from nodegraph.editor.canvas.look import Look, font
from nodegraph.editor.canvas.node_item import LEGIBLE
from nodegraph.editor.canvas.sharing import Shared, shared

if TYPE_CHECKING:
    from nodegraph.commands import Command
    from nodegraph.editor.canvas.scene import CanvasScene

APART = 12.0
"""Distance of the feet of arcs of different variables on one node."""


class ArcLabel(QGraphicsItem):
    """The name of a variable at the top of its arc; hidden where no text is legible."""

    def __init__(self, text: str, parent: QGraphicsItem) -> None:
        super().__init__(parent)
        self.text = text
        self.color = QColor("#cccccc")
        self.look: Look | None = None
        width = QFontMetricsF(font(11)).horizontalAdvance(text) + 14
        self._box = QRectF(-width / 2, -9, width, 18)

    def boundingRect(self) -> QRectF:
        return self._box.adjusted(-1, -1, 1, 1)

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        if self.look is None or option.levelOfDetailFromTransform(painter.worldTransform()) < LEGIBLE:
            return
        painter.setPen(QPen(self.color, 1))
        painter.setBrush(self.look.node)
        painter.drawRoundedRect(self._box, 9, 9)
        painter.setPen(self.look.text)
        painter.setFont(font(11))
        painter.drawText(self._box, Qt.AlignmentFlag.AlignCenter, self.text)


class ArcItem(QGraphicsPathItem):
    """From one node to the next that follows the same variable, or from a variable's node to that of a derived one."""

    def __init__(self, variable: str, start: str, end: str, label: str, derived: bool) -> None:
        super().__init__()
        self.variable, self.start, self.end, self.derived = variable, start, end, derived
        self.label = ArcLabel(label, self) if label else None
        self.setZValue(15)

    def dress(self, look: Look, color: str, loud: bool) -> None:
        """Take colours and width."""
        tint = look.wire(color)
        pen = QPen(tint, 3.0 if loud else 1.8, Qt.PenStyle.DotLine if self.derived else Qt.PenStyle.SolidLine)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        self.setPen(pen)
        if self.label is not None:
            self.label.look, self.label.color = look, tint
            self.label.update()

    def lead(self, start: QRectF, end: QRectF, step: float) -> None:
        """Run in an arch from the upper edge of one node to that of another; ``step`` keeps several apart."""
        a = QPointF(start.center().x() + step, start.top())
        b = QPointF(end.center().x() + step, end.top())
        height = 46 + 0.16 * abs(b.x() - a.x()) + abs(step)
        top = min(a.y(), b.y()) - height
        path = QPainterPath(a)
        path.cubicTo(QPointF(a.x(), top), QPointF(b.x(), top), b)
        for foot in (a, b):
            path.addEllipse(foot, 2.5, 2.5)
        self.setPath(path)
        if self.label is not None:
            middle = (a + b) * 0.125 + (QPointF(a.x(), top) + QPointF(b.x(), top)) * 0.375
            self.label.setPos(middle)


class Arcs:
    """The arcs of the level that a scene shows. ``wanted``: all are drawn; else only those of the variable marked."""

    def __init__(self, scene: CanvasScene) -> None:
        self.scene = scene
        self.wanted = False
        self.marked = ""
        self.items: list[ArcItem] = []
        self._colors: dict[str, str] = {}
        self._soon = QTimer(scene, singleShot=True, interval=0)
        self._soon.timeout.connect(self.sync)
        scene.leaving.connect(self.clear)
        scene.synced.connect(self.sync)
        scene.session.changed.connect(self._on_change)

    def show_all(self, wanted: bool) -> None:
        """Draw all arcs, or none but those of the variable that is marked."""
        self.wanted = wanted
        self.sync()

    def mark(self, variable: str) -> None:
        """Draw the arcs of one variable louder, by its path; an empty path ends that."""
        if variable != self.marked:
            self.marked = variable
            self.sync()

    def clear(self) -> None:
        """Take all arcs away."""
        for item in self.items:
            self.scene.removeItem(item)
        self.items = []

    def sync(self) -> None:
        """Draw what the document has now."""
        self._soon.stop()
        self.clear()
        if not self.wanted and not self.marked:
            return
        variables = shared(self.scene.session.network)
        at = {one.path: self._nodes(one) for one in variables}
        self._colors = {one.path: one.color for one in variables}
        for one in variables:
            if not self.wanted and one.path != self.marked:
                continue
            label = f"{one.name} = {one.expression}" if one.expression else one.name
            chain = list(pairwise(at[one.path]))
            for i, (start, end) in enumerate(chain):
                self._add(one.path, start, end, label if i == len(chain) // 2 else "", False)
            for operand in one.operands:
                ends = [(a, b) for a in at.get(operand, ())[:1] for b in at[one.path][:1] if a != b]
                for start, end in ends:
                    self._add(one.path, start, end, "" if chain else label, True)
        self.lead()
        self.dress()

    def lead(self) -> None:
        """Lead all arcs to where the nodes are now."""
        if not self.items:
            return
        order = list(dict.fromkeys(item.variable for item in self.items))
        for item in self.items:
            step = (order.index(item.variable) - (len(order) - 1) / 2) * APART
            start, end = (self.scene.nodes.get(id) for id in (item.start, item.end))
            if start is not None and end is not None:
                room = min(start.size[0], end.size[0]) / 2 - APART
                item.lead(start.body_in_scene(), end.body_in_scene(), max(-room, min(room, step)))

    def dress(self) -> None:
        """Take the colours of the look that the scene has now."""
        for item in self.items:
            item.dress(self.scene.look, self._colors.get(item.variable, "#b0b0b0"), item.variable == self.marked)

    def _add(self, variable: str, start: str, end: str, label: str, derived: bool) -> None:
        item = ArcItem(variable, start, end, label, derived)
        self.scene.addItem(item)
        self.items.append(item)

    def _nodes(self, one: Shared) -> list[str]:
        """The nodes of the level that follow a variable, from left to right; a group stands for what is in it."""
        prefix = self.scene.level.prefix
        ids = [
            user.removeprefix(prefix).partition("/")[0].partition(".")[0]
            for user in one.users
            if user.startswith(prefix)
        ]
        known = [id for id in dict.fromkeys(ids) if id in self.scene.nodes]
        return sorted(known, key=lambda id: self.scene.nodes[id].x())

    def _on_change(self, commands: list[Command]) -> None:
        if (self.wanted or self.marked) and any(command.touched or command.structural for command in commands):
            self._soon.start()
