"""Flying: the keys move the camera of a view, the mouse turns it in its place, the wheel makes it faster."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QEvent, QObject, QPointF, QRectF, Qt, QTimer
from PySide6.QtGui import QCursor, QKeyEvent, QMouseEvent, QPainter, QWheelEvent

from nodegraph.data import Camera
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.interactors import CameraInteractor, corners_of
from nodegraph.editor.views.marks import MARK, plate
from nodegraph.editor.views.tools import Tool

if TYPE_CHECKING:
    from nodegraph.editor.views.view import ViewWidget

WAYS = {
    Qt.Key.Key_W: (0.0, 0.0, 1.0),
    Qt.Key.Key_S: (0.0, 0.0, -1.0),
    Qt.Key.Key_A: (-1.0, 0.0, 0.0),
    Qt.Key.Key_D: (1.0, 0.0, 0.0),
    Qt.Key.Key_E: (0.0, 1.0, 0.0),
    Qt.Key.Key_Q: (0.0, -1.0, 0.0),
}
"""Where a key leads: right, up, forward, as the camera sees them."""
TURN = 0.15
"""Degrees that the camera turns with a pixel of the mouse."""
KEYS = ("W A S D, Q down, E up; the mouse looks", "Wheel: speed   Shift: faster   Esc: leaves")
"""What is said while one flies."""
FASTER = 1.25
SPRINT = 4.0
TICK = 16
LONGEST = 0.1
"""Seconds that one step stands for at most, so that a machine that was busy does not throw the camera far."""
IDLE = 300
"""Milliseconds without a movement after which the picture is refined, and the next movement is a step of its own."""


class Fly(Tool):
    """Flying in one view. Movements that follow closely are one step of the history; at rest the picture is final."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self.on = False
        self.speed = 0.0
        self._held: set[Qt.Key] = set()
        self._sprints = False
        self._last: QPointF | None = None
        self._warped: QPointF | None = None
        self._moving = False
        self._then = 0.0
        self._tick = QTimer(self, interval=TICK)
        self._tick.timeout.connect(self._step)
        self._idle = QTimer(self, singleShot=True, interval=IDLE)
        self._idle.timeout.connect(self._rest)
        view.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.FocusOut and self.on:
            self.leave()  # the keys go elsewhere now
        return False

    @property
    def active(self) -> bool:
        return self._moving

    # -- entering and leaving -----------------------------------------------------------------------------------------

    def toggle(self) -> None:
        """Enter, or leave."""
        if self.on:
            self.leave()
        else:
            self.enter()

    def enter(self) -> None:
        """Take keys and mouse, where the view has a camera. An orthographic one becomes a perspective one."""
        eyes = self._eyes()
        camera = eyes.camera() if eyes is not None else None
        if eyes is None or camera is None:
            self.session.tell("info", "this view has no camera to fly with", self.view.path)
            return
        eyes.end()
        if camera.orthographic:
            eyes.switch()
        corners = np.asarray(corners_of(self.session, self.view.path))
        far = float(np.linalg.norm(np.ptp(corners, axis=0))) if len(corners) else 2 * _distance(camera)
        self.speed = self.speed or far / 6  # as if one crossed what is shown in six seconds
        self.on = True
        self._last = None
        self.view.setFocus(Qt.FocusReason.OtherFocusReason)
        self.view.area.setCursor(Qt.CursorShape.BlankCursor)
        self.view.refresh_tools()

    def leave(self) -> None:
        """Give keys and mouse back; where one has flown to stays."""
        if not self.on:
            return
        self._rest()
        self.on = False
        self._held.clear()
        self._tick.stop()
        self.view.area.unsetCursor()
        self.view.refresh_tools()

    def end(self) -> None:
        self.leave()

    def forget(self) -> None:
        self._moving = False
        self.leave()

    # -- moving -------------------------------------------------------------------------------------------------------

    def key(self, event: QKeyEvent) -> bool:
        key, modifiers = Qt.Key(event.key()), event.modifiers()
        if key == Qt.Key.Key_F and modifiers == Qt.KeyboardModifier.ShiftModifier:
            self.toggle()
            return True
        if not self.on or modifiers & (Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.AltModifier):
            return False
        if key in (Qt.Key.Key_Escape, Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.leave()
        elif key == Qt.Key.Key_Shift:
            self._sprints = True
        elif key in WAYS:
            self._sprints = bool(modifiers & Qt.KeyboardModifier.ShiftModifier)
            self._held.add(key)
            if not self._tick.isActive():
                self._then = time.monotonic()
                self._tick.start()
        else:
            return False
        return True

    def key_up(self, event: QKeyEvent) -> bool:
        if not self.on or event.isAutoRepeat():
            return self.on
        if event.key() == Qt.Key.Key_Shift:
            self._sprints = False
        self._held.discard(Qt.Key(event.key()))
        return True

    def wheel(self, event: QWheelEvent) -> bool:
        if self.on:
            self.speed *= FASTER ** (event.angleDelta().y() / 120.0)
            self.view.area.update()
        return self.on

    def press(self, event: QMouseEvent) -> bool:
        if self.on:
            self.leave()
            return True
        return False

    def release(self, event: QMouseEvent) -> bool:
        return True

    def double_click(self, event: QMouseEvent) -> bool:
        return self.on

    def move(self, event: QMouseEvent) -> bool:
        if not self.on:
            return False
        place, last = event.position(), self._last
        self._last = place
        if self._warped is not None and (place - self._warped).manhattanLength() < 2.0:
            self._warped = None  # our own doing
            return True
        if last is None or place == last:
            return True
        eyes, way = self._eyes(), place - last
        camera = eyes.camera() if eyes is not None else None
        if eyes is not None and camera is not None:
            self._begin()
            eyes.set(nav.looked(camera, (way.x() * TURN, -way.y() * TURN)))
        self._back_to_middle(place)
        return True

    def advance(self, seconds: float) -> None:
        """Move as far as the keys that are held lead in a time."""
        eyes = self._eyes()
        camera = eyes.camera() if eyes is not None else None
        way = np.sum([WAYS[key] for key in self._held], axis=0) if self._held else np.zeros(3)
        length = float(np.linalg.norm(way))
        if eyes is None or camera is None or length == 0.0:
            return
        far = self.speed * seconds * (SPRINT if self._sprints else 1.0)
        self._begin()
        eyes.set(nav.flown(camera, way / length * far))

    def _step(self) -> None:
        now = time.monotonic()
        seconds, self._then = min(now - self._then, LONGEST), now
        if self._held:
            self.advance(seconds)
        else:
            self._tick.stop()

    def _begin(self) -> None:
        if not self._moving:
            self._moving = True
            self.session.begin("fly")
        self._idle.start()

    def _rest(self) -> None:
        self._idle.stop()
        if self._moving:
            self._moving = False
            self.session.end()

    def _back_to_middle(self, place: QPointF) -> None:
        """Keep the cursor away from the edges, where it could go no further."""
        area = self.view.area
        room = QRectF(area.rect())
        edge = min(room.width(), room.height()) / 8
        if not room.adjusted(edge, edge, -edge, -edge).contains(place):
            middle = room.center().toPoint()
            self._warped = self._last = QPointF(middle)
            QCursor.setPos(area.mapToGlobal(middle))

    def _eyes(self) -> CameraInteractor | None:
        eyes = self.view.interactor
        return eyes if isinstance(eyes, CameraInteractor) else None

    def paint(self, painter: QPainter) -> None:
        if self.on:
            room = QRectF(self.view.area.rect())
            rows = [f"Flying at {self.speed:.3g} mm/s", *KEYS]
            plate(painter, QPointF(0.0, room.bottom()), rows, room.adjusted(6, 6, -6, -6), MARK)


def _distance(camera: Camera) -> float:
    return float(np.linalg.norm(np.subtract(camera.eye, camera.target)))
