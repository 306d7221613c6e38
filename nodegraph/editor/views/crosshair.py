"""The cross-hair: one point of the world that all cuts go through, and that every view shows.

It is kept in the document's ``ui`` as ``{"at": [x, y, z]}``, world mm, while it is shown; so it is saved, and undone
together with the planes that it moved.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QPainter

from nodegraph import links
from nodegraph.commands import Set, SetUI
from nodegraph.data import Plane, Volume
from nodegraph.data.space import Vector, transform_points
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.marks import MARK, line
from nodegraph.editor.views.sight import Sight
from nodegraph.editor.views.tools import Tool
from nodegraph.errors import GraphError
from nodegraph.pictures import views_of
from nodegraph.subjects import subject_of

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.editor.views.view import ViewWidget
    from nodegraph.network import Network

KEY = "crosshair"
"""Key of the document's ``ui``."""
GAP, ARM = 6.0, 12.0
"""Pixels that the middle is left free, and length of an arm where a camera looks."""


def place(network: Network) -> Vector | None:
    """Where the cross-hair is, world mm; None while it is not shown."""
    kept = network.ui.get(KEY)
    at = kept.get("at") if isinstance(kept, dict) else None
    if not isinstance(at, list) or len(at) != 3 or not all(isinstance(x, int | float) for x in at):
        return None  # somebody edited the file
    point = np.array(at, np.float64)
    return point if np.isfinite(point).all() else None


def planes(network: Network) -> dict[str, Plane]:
    """The planes of all cuts that a view shows: parameter ``node.parameter`` and value, each once."""
    found: dict[str, Plane] = {}
    for view in views_of(network.flatten(), None):
        try:
            target = subject_of(network, view).plane
            value = links.value_of(network, target) if target else None
        except GraphError:
            continue
        if isinstance(value, Plane):
            found[target] = value
    return found


def put(session: Session, point: Vector, there: dict[str, Plane] | None = None, *, but: str = "") -> None:
    """Show the cross-hair at a point and move all planes through it, except the one of the parameter ``but``."""
    for target, plane in (planes(session.network) if there is None else there).items():
        if target != but:
            session.do(Set(target, nav.through(plane, point)))
    session.do(SetUI("", KEY, {"at": point.tolist()}))


def carry(session: Session, before: Plane, after: Plane) -> None:
    """A plane was moved from one place to the other: the cross-hair goes with it, if it lay on it."""
    point = place(session.network)
    if point is None:
        return
    step = float((np.subtract(after.origin, before.origin)) @ after.unit_normal)
    if abs(float((point - before.origin) @ before.unit_normal)) <= 1e-6 * max(abs(step), 1.0):
        session.do(SetUI("", KEY, {"at": (point + step * after.unit_normal).tolist()}))


def toggle(session: Session, near: Vector, volume: Volume | None = None) -> None:
    """Show the cross-hair where all planes meet, the nearest such point to ``near``, or take it away.

    Where that is outside of the volume, it comes to ``near`` and the planes come along.
    """
    shown = place(session.network) is not None
    with session.gesture("hide the cross-hair" if shown else "show the cross-hair"):
        if shown:
            session.do(SetUI("", KEY, None))
        else:
            point = nav.common_point(planes(session.network).values(), near)
            put(session, point if volume is None or is_inside(volume, point) else near)


def is_inside(volume: Volume, point: Vector) -> bool:
    """Whether a point of the world lies in a voxel of a volume."""
    index = transform_points(volume.world_to_index, point)
    return bool((index >= -0.5).all() and (index <= np.asarray(volume.dims) - 0.5).all())


class CrossHair(Tool):
    """Draws the cross-hair in one view; in a cut, the left button puts it elsewhere."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self._there: dict[str, Plane] | None = None

    @property
    def shown(self) -> bool:
        """Whether the document has a cross-hair."""
        return place(self.session.network) is not None

    @property
    def active(self) -> bool:
        return self._there is not None

    def toggle(self) -> None:
        """Show it, or take it away."""
        volume, sight = self.view.volume(), self.view.sight()
        near = np.zeros(3)
        if volume is not None:
            near = volume.centre
        elif sight is not None:
            near = sight.world((sight.size[0] / 2, sight.size[1] / 2))
        toggle(self.session, near, volume)

    def put_at(self, at: nav.Point) -> None:
        """Put it where something is seen under a place of the picture, and move all planes there."""
        found = self.view.pick_at(at)
        if found is None or found.world is None:
            self.session.tell("info", "nothing is seen there, so the cross-hair has no place", self.view.path)
            return
        with self.session.gesture("cross-hair"):
            put(self.session, found.world, but=self.view.subject.plane)

    def press(self, event: QMouseEvent) -> bool:
        sight = self.view.sight()
        if (
            not self.shown
            or event.button() != Qt.MouseButton.LeftButton
            or event.modifiers() != Qt.KeyboardModifier.NoModifier
            or sight is None
            or sight.plane is None
        ):
            return False
        if not self.active:
            self.session.begin("cross-hair")
            self._there = planes(self.session.network)
        self._drag(sight, event)
        return True

    def move(self, event: QMouseEvent) -> bool:
        sight = self.view.sight()
        if self.active and sight is not None:
            self._drag(sight, event)
        return self.active

    def release(self, event: QMouseEvent) -> bool:
        if self.active and event.button() == Qt.MouseButton.LeftButton:
            self.end()
        return True

    def key(self, event: QKeyEvent) -> bool:
        key = Qt.Key(event.key())
        if key == Qt.Key.Key_Escape and self.active:
            self._there = None
            self.session.cancel()
        elif event.modifiers() != Qt.KeyboardModifier.NoModifier or self.active:
            return False
        elif key == Qt.Key.Key_X:
            self.toggle()
        elif key == Qt.Key.Key_C and self.view.readout.place is not None:
            self.put_at(self.view.readout.place)
        else:
            return False
        return True

    def end(self) -> None:
        if self.active:
            self._there = None
            self.session.end()

    def forget(self) -> None:
        self._there = None

    def paint(self, painter: QPainter) -> None:
        point, sight = place(self.session.network), self.view.sight()
        at = sight.seen(point) if point is not None and sight is not None else None
        if at is None or sight is None or point is None:
            return
        middle = QPointF(math.floor(at[0]) + 0.5, math.floor(at[1]) + 0.5)  # thin lines are sharp there
        on_it = self._in_front(sight, point, at)
        far = ARM if sight.plane is None else float(max(sight.size)) + abs(middle.x()) + abs(middle.y())
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            way = QPointF(x, y)
            line(painter, [middle + way * GAP, middle + way * far], MARK, faint=not on_it)

    def _in_front(self, sight: Sight, point: Vector, at: nav.Point) -> bool:
        """Whether the point lies on the plane of a cut, to a pixel; or whether nothing hides it from a camera."""
        if sight.plane is not None:
            return abs(sight.off(point)) <= sight.height / sight.size[1]
        found, camera = self.view.pick_at(at), sight.camera
        if found is None or found.depth is None or camera is None:
            return True
        away = float((point - camera.eye) @ camera.basis[2])
        return away <= found.depth + 0.01 * abs(away)

    def _drag(self, sight: Sight, event: QMouseEvent) -> None:
        point = sight.world((event.position().x(), event.position().y()))
        put(self.session, point, self._there, but=self.view.subject.plane)
