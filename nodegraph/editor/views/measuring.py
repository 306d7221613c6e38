"""Measuring in one view: points are put with the mouse, and what was measured is drawn and can be changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QKeyEvent, QMouseEvent, QPainter, QPolygonF

from nodegraph.data.space import Vector
from nodegraph.editor.views import measures as m
from nodegraph.editor.views.marks import MARK, MEASURE, dot, line, plate
from nodegraph.editor.views.measured import Entry, Measured, article
from nodegraph.editor.views.measures import Measure
from nodegraph.editor.views.sight import Sight
from nodegraph.editor.views.tools import Tool

if TYPE_CHECKING:
    from nodegraph.editor.views.view import ViewWidget

KEYS = {
    Qt.Key.Key_D: "distance",
    Qt.Key.Key_A: "angle",
    Qt.Key.Key_R: "rectangle",
    Qt.Key.Key_P: "polygon",
}
NEAR = 7.0
"""Pixels within which a point is taken hold of."""
FAR = 4.0
"""Pixels that the mouse goes before a press is a drag."""
HINTS = {
    "distance": ("Click the first end", "Click the other end"),
    "angle": ("Click the end of one leg", "Click the corner", "Click the end of the other leg"),
    "rectangle": ("Drag a rectangle, or click a corner", "Click the corner across"),
    "polygon": ("Click the corners", "Click the corners", "Click the corners", "Double-click or Enter ends it"),
}


class Measuring(Tool):
    """A measure is begun with `begin`; each click puts a point, Backspace takes one back and Esc gives up."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self.kind = ""
        self._points: list[Vector] = []
        self._cursor: QPointF | None = None
        self._pressed: QPointF | None = None
        self._held: tuple[Entry, int] | None = None
        self._over: tuple[Entry, int] | None = None
        self.all = Measured.of(self.session)
        self.all.changed.connect(view.area.update)

    @property
    def active(self) -> bool:
        return self._held is not None

    # -- beginning and ending -----------------------------------------------------------------------------------------

    def begin(self, kind: str) -> None:
        """Measure something, a key of `measures.POINTS`; the same again gives up."""
        sight = self.view.sight()
        if kind in m.REGIONS and (sight is None or sight.plane is None):
            self.session.tell("info", f"{article(kind)} is measured in a slice view", self.view.path)
            return
        if sight is None:
            self.session.tell("info", "this view has no place in the world, so nothing can be measured", self.view.path)
            return
        self._set_kind("" if kind == self.kind else kind)

    def _set_kind(self, kind: str) -> None:
        self.kind, self._points, self._pressed = kind, [], None
        if kind:
            self.view.area.setCursor(Qt.CursorShape.CrossCursor)
        else:
            self.view.area.unsetCursor()
        self.view.refresh_tools()

    def end(self) -> None:
        self._let_go()
        if self.kind:
            self._set_kind("")

    def forget(self) -> None:
        self._held = self._over = None
        if self.kind:
            self._set_kind("")

    def _finish(self) -> None:
        points = tuple(tuple(point.tolist()) for point in self._points)
        measure = Measure(self.kind, points)
        self._set_kind("")
        self.all.add(self.view.path, measure)

    # -- the mouse and the keys ---------------------------------------------------------------------------------------

    def press(self, event: QMouseEvent) -> bool:
        self._cursor = event.position()
        if event.button() != Qt.MouseButton.LeftButton or event.modifiers() != Qt.KeyboardModifier.NoModifier:
            return False
        if self.kind:
            self._pressed = event.position()
            self._put(event.position())
            return True
        self._held = self._at(event.position())
        if self._held is not None:
            self.all.mark(self._held[0][:2])
            self.session.begin("change a measure")
        return self._held is not None

    def move(self, event: QMouseEvent) -> bool:
        self._cursor = event.position()
        if self._held is not None:
            point = self._world(event.position())
            entry = self.all.entry(*self._held[0][:2])
            if point is not None and entry is not None:
                self.all.replace(entry, m.moved(self._held[0].measure, self._held[1], point))
            return True
        if self.kind:
            self.view.area.update()
            return True
        over = None if event.buttons() else self._at(event.position())
        if over != self._over:
            self._over = over
            self.view.area.update()
        return False

    def release(self, event: QMouseEvent) -> bool:
        self._let_go()
        pressed, self._pressed = self._pressed, None
        if self.kind in ("distance", "rectangle") and pressed is not None:
            if (event.position() - pressed).manhattanLength() > FAR:
                self._put(event.position())  # drawn with one pull instead of two clicks
        return True

    def double_click(self, event: QMouseEvent) -> bool:
        if self.kind == "polygon":
            self._close()
        elif self.kind:
            self._put(event.position())
        else:
            return False
        return True

    def key(self, event: QKeyEvent) -> bool:
        key = Qt.Key(event.key())
        if self._held is not None and key == Qt.Key.Key_Escape:
            self._held = None
            self.session.cancel()
        elif event.modifiers() != Qt.KeyboardModifier.NoModifier:
            return False
        elif key in KEYS:
            self.begin(KEYS[key])
        elif self.kind and key == Qt.Key.Key_Escape:
            self._set_kind("")
        elif self.kind and key == Qt.Key.Key_Backspace:
            self._points = self._points[:-1]
            self.view.area.update()
        elif self.kind == "polygon" and key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._close()
        elif key == Qt.Key.Key_Delete and self._meant() is not None:
            self.all.remove([self._meant()])  # type: ignore[list-item]
        else:
            return False
        return True

    def _put(self, at: QPointF) -> None:
        point = self._world(at)
        if point is None:
            self.session.tell("info", "nothing is seen there that could be measured", self.view.path)
            return
        sight = self.view.sight()
        if self.kind == "polygon" and len(self._points) >= 3 and sight is not None:
            first = sight.seen(self._points[0])
            if first is not None and (QPointF(*first) - at).manhattanLength() < NEAR:
                self._close()
                return
        if self.kind == "rectangle" and self._points and sight is not None and sight.plane is not None:
            corners = m.corners_of(sight.plane, self._points[0], point)
            if m.area(corners) > 0.0:
                self._points = list(corners)
                self._finish()
            return
        self._points.append(point)
        if self.kind in ("distance", "angle") and len(self._points) == m.POINTS[self.kind]:
            self._finish()
        self.view.area.update()

    def _close(self) -> None:
        if len(self._points) >= 3:
            self._finish()

    def _let_go(self) -> None:
        if self._held is not None:
            self._held = None
            self.session.end()

    def _world(self, at: QPointF) -> Vector | None:
        """The point of the world that is seen under a place: of a cut, on its plane; else where the depth says."""
        sight = self.view.sight()
        if sight is not None and sight.plane is not None:
            return sight.world((at.x(), at.y()))
        found = self.view.pick_at((at.x(), at.y()))
        return found.world if found is not None else None

    def _meant(self) -> Entry | None:
        """The measure under the cursor, else the marked one."""
        if self._over is not None:
            return self.all.entry(*self._over[0][:2])
        return self.all.entry(*self.all.marked) if self.all.marked is not None else None

    def _at(self, at: QPointF) -> tuple[Entry, int] | None:
        """The measure whose point lies under a place, and which of its points."""
        sight = self.view.sight()
        for entry in reversed(self.all.entries()) if sight is not None else ():
            assert sight is not None
            if not here(sight, entry.measure):
                continue
            for place, point in enumerate(entry.measure.points):
                seen = sight.seen(point)
                if seen is not None and (QPointF(*seen) - at).manhattanLength() < NEAR:
                    return entry, place
        return None

    # -- drawing ------------------------------------------------------------------------------------------------------

    def paint(self, painter: QPainter) -> None:
        sight = self.view.sight()
        if sight is None:
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        shown = [entry for entry in self.all.entries() if here(sight, entry.measure)]
        for entry in shown:
            over = self._over[1] if self._over is not None and self._over[0][:2] == entry[:2] else -1
            draw(painter, sight, entry.measure, self._color(entry), over)
        taken: list[QRectF] = []
        for entry in sorted(shown, key=self._is_marked, reverse=True):
            found = self.all.statistics(entry) if self._is_marked(entry) and entry.view == self.view.path else None
            rows = [m.value_text(entry.measure), *(m.statistics_rows(found) if found is not None else [])]
            tell(painter, sight, entry.measure, rows, self._color(entry), taken)
        if self.kind:
            self._paint_begun(painter, sight)

    def _is_marked(self, entry: Entry) -> bool:
        return entry[:2] == self.all.marked

    def _color(self, entry: Entry) -> QColor:
        return MARK if self._is_marked(entry) else MEASURE

    def _paint_begun(self, painter: QPainter, sight: Sight) -> None:
        points = list(self._points)
        cursor = self._world(self._cursor) if self._cursor is not None else None
        if cursor is not None:
            points.append(cursor)
        if self.kind == "rectangle" and len(points) == 2 and sight.plane is not None:
            points = list(m.corners_of(sight.plane, *points))
        rows = [HINTS[self.kind][min(len(self._points), len(HINTS[self.kind]) - 1)]]
        if self._points and len(points) >= m.POINTS[self.kind]:
            rows.insert(0, m.value_text(Measure(self.kind, tuple(tuple(point.tolist()) for point in points))))
        measure = Measure(self.kind, tuple(tuple(point.tolist()) for point in points))
        if self._points:
            draw(painter, sight, measure, MARK)
            tell(painter, sight, measure, rows, MARK, [])
        else:
            room = QRectF(self.view.area.rect())
            plate(painter, QPointF(0.0, room.bottom()), rows, room.adjusted(6, 6, -6, -6), MARK)


def here(sight: Sight, measure: Measure) -> bool:
    """Whether a measure is drawn: everything before a camera, and in a cut what lies on its plane, to two pixels."""
    if sight.plane is None:
        return True
    return all(abs(sight.off(point)) <= 2 * sight.height / sight.size[1] for point in measure.points)


def draw(painter: QPainter, sight: Sight, measure: Measure, color: QColor, over: int = -1) -> None:
    """Draw a measure. over: the point that the cursor is over."""
    places = _places(sight, measure)
    if not places:
        return
    if measure.is_region and len(places) >= 3:
        fill = QColor(color)
        fill.setAlphaF(0.12)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(fill)
        painter.drawPolygon(QPolygonF(places))
    line(painter, places, color, closed=measure.is_region)
    if measure.kind == "angle" and len(places) == 3:
        _arc(painter, sight, measure, color)
    for place, at in enumerate(places):
        dot(painter, at, color, large=place == over)


def tell(
    painter: QPainter, sight: Sight, measure: Measure, rows: list[str], color: QColor, taken: list[QRectF]
) -> None:
    """Say something beside a measure, off what is taken already; what it covers is added to that."""
    places = _places(sight, measure)
    if places:
        taken.append(plate(painter, _beside(measure, places), rows, QRectF(0, 0, *sight.size), color, taken))


def _places(sight: Sight, measure: Measure) -> list[QPointF]:
    """Where its points are seen; none where a part of it lies behind the eye."""
    seen = [sight.seen(point) for point in measure.points]
    places = [QPointF(*place) for place in seen if place is not None]
    return places if len(places) == len(seen) else []


def _beside(measure: Measure, places: list[QPointF]) -> QPointF:
    """Where the text goes: the middle of a distance, the corner of an angle, the upper right of a region."""
    if measure.kind == "distance" and len(places) == 2:
        return (places[0] + places[1]) / 2
    if measure.kind == "angle":
        return places[min(1, len(places) - 1)]
    return QPointF(max(place.x() for place in places), min(place.y() for place in places))


def _arc(painter: QPainter, sight: Sight, measure: Measure, color: QColor) -> None:
    """The arc between the legs of an angle, in the plane of both, as far as a third of the shorter one."""
    points = measure.array
    a, b = points[0] - points[1], points[2] - points[1]
    lengths = float(np.linalg.norm(a)), float(np.linalg.norm(b))
    if not min(lengths) > 0.0:
        return
    radius, whole = min(lengths) / 3, np.radians(m.angle(points))
    across = b / lengths[1] - a / lengths[0] * float(a @ b) / (lengths[0] * lengths[1])
    if not np.isfinite(whole) or float(np.linalg.norm(across)) < 1e-9:
        return
    across /= np.linalg.norm(across)
    turns = np.linspace(0.0, whole, 25)
    seen = [sight.seen(points[1] + radius * (np.cos(t) * a / lengths[0] + np.sin(t) * across)) for t in turns]
    if all(place is not None for place in seen):
        line(painter, [QPointF(*place) for place in seen if place is not None], color)
