"""A node as it is painted: title, ports, and a foot line that says how it stands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter, QPainterPath, QPen
from PySide6.QtWidgets import QGraphicsItem, QStyleOptionGraphicsItem, QWidget

from nodegraph.editor.canvas.faces import Face, Port
from nodegraph.editor.canvas.look import FOOTER, HEADER, MARGIN, PORT, RADIUS, ROW, Look, font, port_path

LEGIBLE = 0.45
"""Below this zoom no text is painted."""
PLAIN = 0.25
"""Below this zoom a node is a rectangle in the colour of its state."""

_path = cache(port_path)


@dataclass(frozen=True, slots=True)
class Status:
    """How a node stands: state, the words of the foot line, what its last run took, and the fraction that is done."""

    state: str = "dirty"
    text: str = ""
    last: str = ""
    fraction: float | None = None


class NodeItem(QGraphicsItem):
    """One node. ``status`` is asked for when the item is painted after `restate`."""

    def __init__(self, path: str, face: Face, look: Look, status: Callable[[str], Status]) -> None:
        super().__init__()
        self.path = path
        self.face = face
        self.look = look
        self.lit: frozenset[tuple[bool, str]] | None = None  # ports that a wire may go to, while one is dragged
        self.faded = False
        self._ask = status
        self._status: Status | None = None
        self._width = 0.0
        self._height = 0.0
        self._bounds = QRectF()
        self._places: dict[tuple[bool, str], QPointF] = {}
        self.setFlag(QGraphicsItem.GraphicsItemFlag.ItemIsSelectable)
        # Panning then copies pixels instead of painting texts anew.
        self.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)
        self.setZValue(10)
        self.measure()

    # -- shape --------------------------------------------------------------------------------------------------

    def show_face(self, face: Face) -> None:
        """Show what the node is now."""
        if face != self.face:
            self.prepareGeometryChange()
            self.face = face
            self.measure()
        self.restate()

    def measure(self) -> None:
        """Set size and places of ports from the texts."""
        small, bold = _metrics(11, False), _metrics(13, True)
        names = max(bold.horizontalAdvance(self.face.id), small.horizontalAdvance(self.face.title)) + 20
        left = max((small.horizontalAdvance(port.name) for port in self.face.inputs), default=0.0)
        right = max((small.horizontalAdvance(port.name) for port in self.face.outputs), default=0.0)
        self._width = min(340.0, 10 * round(max(150.0, names + 2 * MARGIN, left + right + 4 * MARGIN + 8) / 10))
        rows = max(len(self.face.inputs), len(self.face.outputs), 1)
        self._height = HEADER + rows * ROW + 6 + FOOTER
        tags = 90.0 if self.face.tags else 0.0
        self._bounds = self.body().adjusted(-12 - tags, -4, 12 + tags, 5)
        self._places = {}
        for i, port in enumerate(self.face.inputs):
            self._places[False, port.name] = QPointF(0, HEADER + 4 + (i + 0.5) * ROW)
        for i, port in enumerate(self.face.outputs):
            self._places[True, port.name] = QPointF(self._width, HEADER + 4 + (i + 0.5) * ROW)

    @property
    def size(self) -> tuple[float, float]:
        return self._width, self._height

    def body(self) -> QRectF:
        """The node's rectangle in its own coordinates."""
        return QRectF(0, 0, self._width, self._height)

    def body_in_scene(self) -> QRectF:
        return self.body().translated(self.pos())

    def boundingRect(self) -> QRectF:
        return self._bounds

    def shape(self) -> QPainterPath:
        path = QPainterPath()
        path.addRect(self.body())
        return path

    def anchor(self, output: bool, name: str) -> QPointF:
        """Where the wires of a port end, in the scene; the middle of the side for a port that is not shown."""
        here = self._places.get((output, name))
        if here is None:
            here = QPointF(self._width if output else 0.0, HEADER + 4 + 0.5 * ROW)
        return self.pos() + here

    def port_at(self, point: QPointF, reach: float = 10.0) -> Port | None:
        """The port at a point of the scene."""
        here = point - self.pos()
        for ports in (self.face.outputs, self.face.inputs):
            for port in ports:
                away = here - self._places[port.output, port.name]
                if away.x() ** 2 + away.y() ** 2 <= reach**2:
                    return port
        return None

    def port_row_at(self, point: QPointF) -> Port | None:
        """The port whose plug or name is at a point of the scene."""
        found = self.port_at(point)
        here = point - self.pos()
        if found is not None or not self.body().contains(here):
            return found
        row = int((here.y() - HEADER - 4) // ROW)
        small = _metrics(11, False)
        for ports, near in ((self.face.inputs, here.x()), (self.face.outputs, self._width - here.x())):
            if 0 <= row < len(ports) and near < small.horizontalAdvance(ports[row].name) + 14:
                return ports[row]
        return None

    def title_rect(self) -> QRectF:
        """Where the id stands, for the field that renames."""
        return QRectF(MARGIN - 4, 5, self._width - 2 * MARGIN + 8, 20)

    # -- status -------------------------------------------------------------------------------------------------

    def restate(self) -> None:
        """Ask for the status anew at the next painting."""
        self._status = None
        self.update()

    @property
    def status(self) -> Status:
        if self._status is None:
            self._status = self._ask(self.path)
        return self._status

    # -- painting -----------------------------------------------------------------------------------------------

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        zoom = option.levelOfDetailFromTransform(painter.worldTransform())
        look, status = self.look, self.status
        painter.setOpacity(0.35 if self.faded else 0.6 if self.face.muted else 1.0)
        if zoom < PLAIN:
            painter.fillRect(self.body(), look.accent if self.isSelected() else look.state(status.state))
            return
        border = look.border
        if not self.face.known or status.state == "failed":
            border = look.failed
        elif status.state == "running":
            border = look.running
        pen = QPen(look.accent if self.isSelected() else border, 2.0 if self.isSelected() else 1.0)
        if self.face.muted:
            pen.setStyle(Qt.PenStyle.DashLine)
        if not self.face.known:
            pen.setStyle(Qt.PenStyle.DotLine if not self.isSelected() else Qt.PenStyle.DashLine)
        if self.face.group:
            painter.setPen(QPen(border, 1))
            painter.setBrush(look.header)
            painter.drawRoundedRect(self.body().translated(4, 4), RADIUS, RADIUS)
        painter.setPen(pen)
        painter.setBrush(look.node)
        painter.drawRoundedRect(self.body(), RADIUS, RADIUS)
        self._paint_header(painter, pen)
        if zoom >= LEGIBLE:
            self._paint_texts(painter, status)
        if status.fraction is not None:
            self._paint_progress(painter, status.fraction)
        self._paint_ports(painter, zoom)

    def _paint_header(self, painter: QPainter, pen: QPen) -> None:
        half = pen.widthF() / 2
        band = QPainterPath()
        band.addRoundedRect(self.body().adjusted(half, half, -half, -half), RADIUS - half, RADIUS - half)
        top = QPainterPath()
        top.addRect(QRectF(0, 0, self._width, HEADER))
        painter.fillPath(band.intersected(top), self.look.header)
        stripe = QPainterPath()
        stripe.addRect(QRectF(0, 0, self._width, 3.5))
        painter.fillPath(band.intersected(stripe), self._color())

    def _color(self) -> QColor:
        """The colour of what the node makes, or takes where it makes nothing."""
        ports = self.face.outputs or self.face.inputs
        return self.look.wire(ports[0].color) if ports else self.look.border

    def _paint_texts(self, painter: QPainter, status: Status) -> None:
        look, wide = self.look, self._width - 2 * MARGIN
        left = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
        right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        middle = Qt.TextElideMode.ElideRight
        painter.setPen(look.text)
        painter.setFont(_font(13, True))
        title = _metrics(13, True).elidedText(self.face.id, middle, wide)
        painter.drawText(QRectF(MARGIN, 6, wide, 18), left, title)
        small, metrics = _font(11, False), _metrics(11, False)
        painter.setFont(small)
        painter.setPen(look.dim)
        kind = f"{self.face.title}, muted" if self.face.muted else self.face.title
        painter.drawText(QRectF(MARGIN, 22, wide, 15), left, metrics.elidedText(kind, middle, wide))
        for port in (*self.face.inputs, *self.face.outputs):
            place = self._places[port.output, port.name]
            lit = self.lit is not None and (port.output, port.name) in self.lit
            painter.setPen(look.text if lit else look.dim)
            box = QRectF(MARGIN + 2, place.y() - ROW / 2, wide - 4, ROW)
            painter.drawText(box, right if port.output else left, port.name)
        foot = QRectF(MARGIN, self._height - FOOTER - 1, wide, FOOTER)
        painter.setPen(QPen(look.grid, 1))
        painter.drawLine(QPointF(1, foot.top()), QPointF(self._width - 1, foot.top()))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(look.state(status.state))
        painter.drawEllipse(QPointF(MARGIN + 4, foot.center().y()), 3.5, 3.5)
        loud = status.state in ("failed", "blocked", "running")
        painter.setPen(look.state(status.state) if loud else look.dim)
        taken = metrics.horizontalAdvance(status.last) + 8 if status.last else 0.0
        text = metrics.elidedText(status.text, middle, wide - 14 - taken)
        painter.drawText(foot.adjusted(14, 0, 0, 0), left, text)
        if status.last:
            painter.setPen(look.dim)
            painter.drawText(foot, right, status.last)
        for name, shown in self.face.tags:
            self._paint_tag(painter, name, shown)

    def _paint_tag(self, painter: QPainter, name: str, shown: str) -> None:
        """The name under which the group around shows a port, beside the port."""
        output = name.startswith("out.")
        place = self._places.get((output, name.partition(".")[2]))
        if place is None:
            return
        text = _metrics(11, False).elidedText(shown, Qt.TextElideMode.ElideRight, 70)
        width = _metrics(11, False).horizontalAdvance(text) + 12
        x = place.x() + 10 if output else place.x() - 10 - width
        box = QRectF(x, place.y() - 8, width, 16)
        painter.setPen(QPen(self.look.border, 1))
        painter.setBrush(self.look.header)
        painter.drawRoundedRect(box, 8, 8)
        painter.setPen(self.look.text)
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, text)

    def _paint_progress(self, painter: QPainter, fraction: float) -> None:
        bar = QRectF(RADIUS, self._height - 3.5, (self._width - 2 * RADIUS) * max(0.0, min(1.0, fraction)), 2.5)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(self.look.running)
        painter.drawRoundedRect(bar, 1.2, 1.2)

    def _paint_ports(self, painter: QPainter, zoom: float) -> None:
        look, opacity = self.look, painter.opacity()
        for port in (*self.face.inputs, *self.face.outputs):
            place = self._places[port.output, port.name]
            lit = self.lit is not None and (port.output, port.name) in self.lit
            if self.lit is not None:
                painter.setOpacity(1.0 if lit else 0.35)
            color = look.wire(port.color)
            painter.translate(place)
            if lit:
                halo = QColor(look.accent)
                halo.setAlpha(110)
                painter.setPen(Qt.PenStyle.NoPen)
                painter.setBrush(halo)
                painter.drawEllipse(QPointF(0, 0), PORT * 2, PORT * 2)
            painter.setPen(QPen(look.node if zoom >= LEGIBLE else color, 1.2))
            painter.setBrush(color)
            painter.drawPath(_path(port.shape))
            painter.translate(-place)
            painter.setOpacity(opacity)


@cache
def _font(size: int, bold: bool) -> QFont:
    return font(size, bold=bold)


@cache
def _metrics(size: int, bold: bool) -> QFontMetricsF:
    return QFontMetricsF(font(size, bold=bold))
