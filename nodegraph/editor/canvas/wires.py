"""Wires as they are painted, with the dots at which they bend."""

from __future__ import annotations

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QPainterPath, QPainterPathStroker, QPen
from PySide6.QtWidgets import QGraphicsEllipseItem, QGraphicsPathItem

from nodegraph.editor.canvas.faces import Wire
from nodegraph.editor.canvas.look import Look, wire_path

DOT = 4.5
"""Radius of a dot at which a wire bends."""
SAMPLES = 24
"""Points of a piece of a wire that are looked at to find out which piece is near."""


class WireItem(QGraphicsPathItem):
    """One wire. ``color`` is that of the output's type; a wire that leads from nowhere is red and dotted.

    Nothing of it is painted in Python, so that a thousand wires are panned smoothly; its own selection, too, since
    that of Qt would draw a box.
    """

    def __init__(self, wire: Wire, look: Look) -> None:
        super().__init__()
        self.wire = wire
        self.look = look
        self.color = "#cccccc"
        self.broken = False
        self.muted = False
        self.faded = False
        self.chosen = False
        self.marked = False  # a node would be inserted here
        self.dots: list[BendItem] = []
        self._ends: tuple[QPointF, QPointF] | None = None
        self._stroke: QPainterPath | None = None
        self._worn: tuple[object, ...] = ()
        self.setZValue(5)

    def lead(self, start: QPointF, end: QPointF) -> None:
        """Run from an output to an input, through the bends."""
        if self._ends != (start, end):
            self._ends = (start, end)
            self._draw()

    @property
    def bends(self) -> list[QPointF]:
        return [dot.pos() for dot in self.dots]

    def show_bends(self, places: list[QPointF]) -> None:
        """Bend at these points of the scene, from the source on."""
        if places == self.bends:
            return
        for dot in self.dots[len(places) :]:
            self.scene().removeItem(dot)
        del self.dots[len(places) :]
        while len(self.dots) < len(places):
            self.dots.append(BendItem(self))
        for dot, place in zip(self.dots, places, strict=True):
            dot.setPos(place)
        self._draw()
        self.dress()

    def touches(self, area: QRectF) -> bool:
        """Whether the line itself runs through an area of the scene; Qt would count what it encloses, too."""
        if self._stroke is None:
            stroker = QPainterPathStroker()
            stroker.setWidth(4.0)
            self._stroke = stroker.createStroke(self.path())
        return self._stroke.intersects(area)

    def piece_at(self, point: QPointF) -> int:
        """Which piece of the wire is nearest to a point: 0 before the first bend, then one after each."""
        if self._ends is None or not self.dots:
            return 0
        stops = [self._ends[0], *self.bends, self._ends[1]]
        best = (float("inf"), 0)
        for i in range(len(stops) - 1):
            piece = wire_path(stops[i], stops[i + 1], before=stops[:i], after=stops[i + 2 :])
            for step in range(SAMPLES + 1):
                away = piece.pointAtPercent(step / SAMPLES) - point
                best = min(best, (away.x() ** 2 + away.y() ** 2, i))
        return best[1]

    def dress(self) -> None:
        """Take the pen that goes with how the wire stands now."""
        for dot in self.dots:
            dot.dress()
        loud = self.chosen or self.marked
        worn = (self.look, self.color, self.broken, self.muted, self.faded, loud)
        if worn == self._worn:
            return  # most wires stand as before, and pens take time
        self._worn = worn
        color = self.look.failed if self.broken else self.look.accent if loud else self.look.wire(self.color)
        pen = QPen(color, 3.5 if loud else 2.0)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        if self.broken:
            pen.setStyle(Qt.PenStyle.DotLine)
        elif self.muted:
            pen.setStyle(Qt.PenStyle.DashLine)
        self.setPen(pen)
        self.setOpacity(0.25 if self.faded else 1.0)

    def _draw(self) -> None:
        if self._ends is None:
            return
        start, end = self._ends
        stops = [start, *self.bends, end]
        path = QPainterPath(start)
        for i in range(len(stops) - 1):
            path.connectPath(wire_path(stops[i], stops[i + 1], before=stops[:i], after=stops[i + 2 :]))
        self._stroke = None
        self.setPath(path)


class BendItem(QGraphicsEllipseItem):
    """A dot at which a wire bends. It is dragged, and removed, like a node; the wire follows."""

    def __init__(self, item: WireItem) -> None:
        super().__init__(QRectF(-DOT, -DOT, 2 * DOT, 2 * DOT), item)
        self.item = item
        self.chosen = False

    @property
    def place(self) -> int:
        """Which bend of its wire it is."""
        return self.item.dots.index(self)

    def dress(self) -> None:
        """Take the colours that go with how the wire and the dot stand now."""
        look, item = self.item.look, self.item
        color = look.failed if item.broken else look.accent if self.chosen else look.wire(item.color)
        self.setBrush(color)
        self.setPen(QPen(look.text if self.chosen else look.background, 1.5))
