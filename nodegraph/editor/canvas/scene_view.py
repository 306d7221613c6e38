"""The canvas as it is looked at: zoom and pan, the ground below, and what is at a point."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QPointF, QRect, QRectF, Qt, Signal
from PySide6.QtGui import QPainter, QPixmapCache, QResizeEvent
from PySide6.QtWidgets import QGraphicsView

from nodegraph.editor.canvas.faces import Wire
from nodegraph.editor.canvas.items import BoxItem
from nodegraph.editor.canvas.look import GRID, dotted
from nodegraph.editor.canvas.node_item import NodeItem
from nodegraph.editor.canvas.scene import CanvasScene, Item
from nodegraph.editor.canvas.wires import BendItem, WireItem

LEAST, MOST = 0.08, 3.0


class SceneView(QGraphicsView):
    """Shows a part of a `CanvasScene`."""

    moved = Signal()  # another part is seen

    def __init__(self, scene: CanvasScene) -> None:
        super().__init__(scene)
        self.canvas_scene = scene
        self.setRenderHint(QPainter.RenderHint.Antialiasing)
        self.setTransformationAnchor(QGraphicsView.ViewportAnchor.NoAnchor)
        self.setResizeAnchor(QGraphicsView.ViewportAnchor.NoAnchor)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setViewportUpdateMode(QGraphicsView.ViewportUpdateMode.SmartViewportUpdate)
        self.setOptimizationFlag(QGraphicsView.OptimizationFlag.DontSavePainterState, False)
        self.setFrameShape(QGraphicsView.Shape.NoFrame)
        self.setCacheMode(QGraphicsView.CacheModeFlag.CacheBackground)
        # What the nodes seen on a large, dense screen take; the default would paint them anew all the time.
        QPixmapCache.setCacheLimit(max(QPixmapCache.cacheLimit(), 96 * 1024))
        self.setSceneRect(QRectF(-50000, -50000, 100000, 100000))

    # -- where ----------------------------------------------------------------------------------------------------

    @property
    def zoom(self) -> float:
        return self.transform().m11()

    def pixels(self, away: QPointF) -> float:
        """Length in pixels of a way in the scene."""
        return float((away.x() ** 2 + away.y() ** 2) ** 0.5 * self.zoom)

    def zoom_by(self, factor: float, at: QPointF | None = None) -> None:
        """Zoom so that a pixel of the viewport, by default the middle, keeps what it shows."""
        where = at if at is not None else QPointF(self.viewport().rect().center())
        new = max(LEAST, min(MOST, self.zoom * factor))
        before = self.mapToScene(where.toPoint())
        self.scale(new / self.zoom, new / self.zoom)
        after = self.mapToScene(where.toPoint())
        away = (after - before) * self.zoom
        self.pan(-away.x(), -away.y())

    def pan(self, x: float, y: float) -> None:
        """Move what is seen by pixels."""
        self.horizontalScrollBar().setValue(self.horizontalScrollBar().value() + round(x))
        self.verticalScrollBar().setValue(self.verticalScrollBar().value() + round(y))
        self.moved.emit()

    def show_rect(self, rect: QRectF) -> None:
        """Zoom and pan so that a rectangle of the scene is seen, never larger than life."""
        if rect.isEmpty():
            return
        room = rect.adjusted(-40, -40, 40, 40)
        view = self.viewport().rect()
        factor = min(view.width() / room.width(), view.height() / room.height(), 1.0)
        self.resetTransform()
        self.scale(max(LEAST, factor), max(LEAST, factor))
        self.centerOn(room.center())
        self.moved.emit()

    def fit(self) -> None:
        """Show what is selected, or everything."""
        scene = self.canvas_scene
        scene.flush()
        area = QRectF()
        for id in scene.chosen():
            area = area.united(scene.nodes[id].body_in_scene())
        self.show_rect(area if not area.isEmpty() else scene.content())

    def seen(self) -> QRectF:
        """The rectangle of the scene that is seen."""
        return self.mapToScene(self.viewport().rect()).boundingRect()

    def cursor_point(self) -> QPointF:
        """The point of the scene below the mouse; the middle of what is seen while the mouse is elsewhere."""
        here = self.viewport().mapFromGlobal(self.cursor().pos())
        return self.mapToScene(here) if self.viewport().rect().contains(here) else self.seen().center()

    # -- what is there ----------------------------------------------------------------------------------------------

    def node_at(self, point: QPointF, reach: float = 10.0) -> NodeItem | None:
        """The node at a point, or whose port is near."""
        near = QRectF(point.x() - reach, point.y() - reach, 2 * reach, 2 * reach)
        found = [
            item
            for item in self.canvas_scene.items(near, Qt.ItemSelectionMode.IntersectsItemBoundingRect)
            if isinstance(item, NodeItem)
        ]
        for item in found:
            if item.body().contains(point - item.pos()):
                return item
        return next((item for item in found if item.port_at(point, reach) is not None), None)

    def item_at(self, point: QPointF) -> Item | None:
        """The uppermost thing at a point."""
        node = self.node_at(point)
        if node is not None:
            return node
        near = QRectF(point.x() - 5, point.y() - 5, 10, 10)
        near_by = self.canvas_scene.items(near, Qt.ItemSelectionMode.IntersectsItemBoundingRect)
        for item in near_by:
            if isinstance(item, BendItem):
                return item
        for item in near_by:
            if isinstance(item, WireItem) and item.touches(near):
                return item
            if isinstance(item, BoxItem) and item.contains(point - item.pos()):
                return item
        return None

    def wire_below(self, body: QRectF, fits: Callable[[Wire], bool]) -> WireItem | None:
        """A wire that runs below a node's rectangle and that the node fits into."""
        middle = body.adjusted(10, 0, -10, 0)
        for item in self.canvas_scene.items(middle, Qt.ItemSelectionMode.IntersectsItemBoundingRect):
            if isinstance(item, WireItem) and item.touches(middle) and fits(item.wire):
                return item
        return None

    # -- painting ---------------------------------------------------------------------------------------------------

    def drawBackground(self, painter: QPainter, rect: QRectF | QRect) -> None:
        look = self.canvas_scene.look
        painter.fillRect(rect, look.background)
        step = GRID if self.zoom > 0.6 else GRID * 5 if self.zoom > 0.2 else 0.0
        if not step:
            return
        painter.fillRect(rect, dotted(look.grid, step, self.zoom))

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.moved.emit()
