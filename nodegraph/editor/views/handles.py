"""Handles over the picture of a view: the boxes, planes, lights and cameras of the selected nodes, to be dragged.

They are drawn with the view's camera over its picture; what the picture hides is dimmed. From press to release all
changes are one step of the history; Escape takes them back.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter, QWheelEvent

from nodegraph.commands import Set
from nodegraph.data.space import Vector
from nodegraph.editor.parameters.look import name_text
from nodegraph.editor.views.handles_found import Handle, handles_of
from nodegraph.editor.views.handles_geometry import Lens
from nodegraph.editor.views.handles_paint import paint_grip, paint_label, paint_lines
from nodegraph.editor.views.handles_shapes import Grip, Line
from nodegraph.editor.views.interactors import CameraInteractor
from nodegraph.editor.views.tools import Tool
from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.editor.views.view import ViewWidget

REACH = 10.0
"""Pixels within which a grip is held."""
SAME_PLACE = 4.0
LINE_REACH = 6.0
SLACK = 5e-3
"""What lies so far behind what is seen, in distances from the eye to the focus, still counts as seen."""


class Handles(Tool):
    """The handles of one view."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self.shown = True
        self._found: list[Handle] | None = None
        self._lit: tuple[str, str] | None = None  # target and grip
        self._held: tuple[Handle, Grip, Lens, tuple[float, float]] | None = None
        self.session.selected.connect(self.refresh)
        self.session.changed.connect(self.refresh)
        self.session.values_changed.connect(self.refresh)
        view.area.hovered.connect(self._leave)

    # -- what there is --------------------------------------------------------------------------------------------

    @property
    def active(self) -> bool:
        """Whether a grip is held."""
        return self._held is not None

    @property
    def lens(self) -> Lens | None:
        """The view's camera and size; None for a view without a camera."""
        interactor = self.view.interactor
        camera = interactor.camera() if isinstance(interactor, CameraInteractor) else None
        area = self.view.area
        return Lens(camera, (max(area.width(), 1), max(area.height(), 1))) if camera is not None else None

    def found(self) -> list[Handle]:
        """The handles that are shown now."""
        lens = self.lens
        if not self.shown or lens is None or not self.view.alive:
            return []
        if self._found is None:
            self._found = handles_of(self.session, self.view.path, self.view.subject.cameras, lens.camera)
        return self._found

    def toggle(self) -> None:
        """Show handles in this view, or none."""
        self.cancel()
        self.shown = not self.shown
        self._lit = None
        self.view.refresh_tools()

    def refresh(self, _: object = None) -> None:
        """The selection, the document or what is known of its values is another one now."""
        self._found = None
        self.view.area.update()

    def forget(self) -> None:
        """Another document is open, so nothing is held any more."""
        self._held = self._lit = None
        self.refresh()

    # -- the mouse ------------------------------------------------------------------------------------------------

    def press(self, event: QMouseEvent) -> bool:
        """Take hold of what is under the cursor. False where that is nothing."""
        if self.active:
            return True
        plain = event.button() == Qt.MouseButton.LeftButton and not event.modifiers()
        at, lens = _point(event.position()), self.lens
        hit = self.at(at) if plain and lens is not None else None
        if hit is None or lens is None:
            return False
        handle, grip = hit
        if self.view.interactor is not None:
            self.view.interactor.end()
        self._held = (handle, handle.shape.grip(lens, grip), lens, at)
        self._lit = (handle.place.target, grip)
        self.session.begin(f"drag {handle.place.name}")
        self.view.area.update()
        return True

    def move(self, event: QMouseEvent) -> bool:
        """Drag what is held, or light what could be. False where nothing is held."""
        if self._held is None:
            if not event.buttons():
                self._light(_point(event.position()))
            return False
        handle, grip, lens, start = self._held
        try:
            value = handle.shape.moved(lens, grip, start, _point(event.position()))
            handle.place.declared.check(value, handle.place.target)
        except GraphError:
            return True  # no such value, as a camera whose eye is at its target: stay at the last
        self.session.do(Set(handle.place.target, value))
        return True

    def release(self, event: QMouseEvent) -> bool:
        """Let go. False where nothing was held."""
        if self._held is None:
            return False
        if event.button() == Qt.MouseButton.LeftButton:
            self.end()
            self._light(_point(event.position()))
        return True

    def end(self) -> None:
        """Let go of what is held and keep what it became."""
        if self._held is not None:
            self._held = None
            self.session.end()
            self.view.area.update()

    def cancel(self) -> bool:
        """Let go of what is held and take the drag back. False where nothing is held."""
        if self._held is None:
            return False
        self._held = None
        self.session.cancel()
        self.view.area.update()
        return True

    def wheel(self, event: QWheelEvent) -> bool:
        """Nothing turns or zooms while a grip is held: it would become part of the drag."""
        return self.active

    def key(self, event: QKeyEvent) -> bool:
        """Escape takes a drag back, H shows or hides."""
        if self.active:
            if event.key() == Qt.Key.Key_Escape:
                self.cancel()
            return True
        plain = event.key() == Qt.Key.Key_H and event.modifiers() == Qt.KeyboardModifier.NoModifier
        if plain and self.lens is not None:
            self.toggle()
            return True
        return False

    def _leave(self, pixel: object) -> None:
        if pixel is None and not self.active:
            self._show_lit(None)

    def at(self, at: tuple[float, float]) -> tuple[Handle, str] | None:
        """The handle and the grip under a place of the area: a point before a line, of two at one place the nearer."""
        lens = self.lens
        if lens is None:
            return None
        points: list[tuple[tuple[int, float], Handle, str]] = []
        lines: list[tuple[float, Handle, str]] = []
        for handle in self.found():
            if handle.locked:
                continue
            for grip in handle.shape.grips(lens):
                place = lens.place(grip.at)
                pixels = math.dist(place, at) if place is not None else math.inf
                if pixels <= REACH:
                    points.append(((round(pixels / SAME_PLACE), lens.depth(grip.at)), handle, grip.name))
            held = [line for line in handle.shape.lines(lens) if line.grip]
            if held:
                far = _distances(lens, held, at)
                lines += [(far[i], handle, held[i].grip) for i in np.flatnonzero(far <= LINE_REACH)]
        if points:
            return min(points, key=lambda one: one[0])[1:]
        return min(lines, key=lambda one: one[0])[1:] if lines else None

    def _light(self, at: tuple[float, float]) -> None:
        hit = self.at(at)
        self._show_lit((hit[0].place.target, hit[1]) if hit is not None else None)

    def _show_lit(self, lit: tuple[str, str] | None) -> None:
        if lit == self._lit:
            return
        self._lit = lit
        if lit is None:
            self.view.area.unsetCursor()
        else:
            self.view.area.setCursor(Qt.CursorShape.PointingHandCursor)
        self.view.area.update()

    # -- drawing --------------------------------------------------------------------------------------------------

    def paint(self, painter: QPainter) -> None:
        """Draw over the picture."""
        lens = self.lens
        handles = self.found() if lens is not None else []
        if not handles or lens is None:
            return
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        hides = partial(self._hides, lens)
        for handle in handles:
            lit = self._lit[1] if self._lit is not None and self._lit[0] == handle.place.target else ""
            paint_lines(painter, lens, handle.shape.lines(lens), lit, hides)
            if handle.locked:
                continue
            grips = handle.shape.grips(lens)
            places, depths = lens.places(np.array([grip.at for grip in grips]))
            hidden = hides(places, depths)
            for i in np.argsort(-depths):
                if depths[i] >= lens.near:
                    paint_grip(painter, QPointF(*places[i]), grips[i], grips[i].name == lit, bool(hidden[i]))
            place = lens.place(handle.shape.grip(lens, lit).at) if lit else None
            if place is not None:
                text = f"{name_text(handle.place.name)}: {handle.shape.says(lit)}"
                paint_label(painter, QPointF(*place), text, QRectF(self.view.area.rect()))

    def _hides(self, lens: Lens, places: Vector, depths: Vector) -> Any:
        """Which of some places (..., 2) of the area at depths (...), mm, lie behind what the picture shows."""
        shown = self.view.shown
        seen = shown.image.depth if shown is not None else None
        if seen is None:
            return np.zeros(depths.shape, bool)
        target, sides = self.view.area.target(), seen.shape[::-1]
        scale = np.divide(sides, (max(target.width(), 1.0), max(target.height(), 1.0)))
        pixels = np.floor((places - (target.left(), target.top())) * scale).astype(int)
        inside = np.asarray(((pixels >= 0) & (pixels < sides)).all(axis=-1))
        pixels = np.where(inside[..., None], pixels, 0)
        return inside & (depths > np.asarray(seen)[pixels[..., 1], pixels[..., 0]] + SLACK * lens.distance)


def _point(place: QPointF) -> tuple[float, float]:
    return place.x(), place.y()


def _distances(lens: Lens, lines: list[Line], at: tuple[float, float]) -> Vector:
    """Pixels (n,) from a place to lines as they are seen; endless for those that are not."""
    a, b, there = lens.clipped(np.array([line.a for line in lines]), np.array([line.b for line in lines]))
    far = np.full(len(lines), np.inf)
    start, end = lens.places(a[there])[0], lens.places(b[there])[0]
    way, here = end - start, np.asarray(at) - start
    square = np.maximum((way * way).sum(axis=1), 1e-12)
    along = np.clip((here * way).sum(axis=1) / square, 0.0, 1.0)
    far[there] = np.linalg.norm(here - along[:, None] * way, axis=1)
    return far
