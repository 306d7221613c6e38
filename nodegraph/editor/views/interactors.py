"""What the mouse and the keys do in a view, and that they turn its cameras; cuts have their own page, `cuts`.

An interactor belongs to one view. It reads the document when a gesture begins and changes it by commands only; from
press to release all of them are one step of the history.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QPointF, Qt, QTimer
from PySide6.QtGui import QKeyEvent, QMouseEvent, QWheelEvent

from nodegraph import links
from nodegraph.camera_path import rotated, rotation
from nodegraph.commands import Set
from nodegraph.data import Camera
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.sight import Sight
from nodegraph.errors import GraphError
from nodegraph.subjects import Subject, things_of

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.editor.views.view import ViewWidget

ZOOM_STEP = 1.15
KEY_TURN = 15.0
IDLE = 300
"""Milliseconds without a notch after which the next notch of the wheel is a gesture of its own."""


class Interactor(QObject):
    """Gestures of one view. ``end`` closes whatever is open; the view calls it when it is hidden."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self.view = view
        self.session: Session = view.session
        self.subject: Subject = view.subject
        self._drag = ""
        self._button = Qt.MouseButton.NoButton
        self._start: nav.Point = (0.0, 0.0)
        self._wheeling = False
        self._idle = QTimer(self, singleShot=True, interval=IDLE)
        self._idle.timeout.connect(self.end)

    @property
    def size(self) -> nav.Size:
        area = self.view.area
        return max(area.width(), 1), max(area.height(), 1)

    @property
    def active(self) -> bool:
        """Whether a gesture is open."""
        return bool(self._drag) or self._wheeling

    @property
    def dragging(self) -> bool:
        """Whether a button is held."""
        return bool(self._drag)

    def press(self, event: QMouseEvent) -> None:
        """Begin the gesture of a button, if it has one."""
        if self._drag:
            return
        self.end()
        kind = self.gesture_of(event)
        if kind and self.take(kind):
            self._drag, self._button = kind, event.button()
            self._start = _point(event.position())
            self.session.begin(kind)

    def move(self, event: QMouseEvent) -> None:
        if self._drag:
            self.drag(self._drag, self._start, _point(event.position()))

    def release(self, event: QMouseEvent) -> None:
        if self._drag and event.button() == self._button:
            self.end()

    def wheel(self, event: QWheelEvent) -> None:
        """A notch; those that follow closely are one gesture."""
        steps = (event.angleDelta().y() or event.angleDelta().x()) / 120.0
        if self._drag or not steps or not self.take("wheel"):
            return
        if not self._wheeling:
            self.session.begin(self.wheel_name(event.modifiers()))
            self._wheeling = True
        self._idle.start()
        self.roll_wheel(steps, _point(event.position()), event.modifiers())

    def end(self) -> None:
        """End the gesture and keep it."""
        if self.active:
            self._drag, self._wheeling = "", False
            self._idle.stop()
            self.session.end()

    def cancel(self) -> bool:
        """End the gesture and take it back. False where there is none."""
        if not self.active:
            return False
        self._drag, self._wheeling = "", False
        self._idle.stop()
        self.session.cancel()
        return True

    def forget(self) -> None:
        """Another document is open, so there is no gesture any more."""
        self._drag, self._wheeling = "", False
        self._idle.stop()

    def wheel_name(self, modifiers: Qt.KeyboardModifier) -> str:
        """What notches of the wheel do."""
        return "zoom"

    @abstractmethod
    def sight(self) -> Sight | None:
        """How the view looks at the world, by the document as it is now; None where that is not known."""

    @abstractmethod
    def gesture_of(self, event: QMouseEvent) -> str:
        """Name of the gesture that a press begins, empty for none."""

    @abstractmethod
    def take(self, kind: str) -> bool:
        """Read the document for a gesture. False where there is nothing to move."""

    @abstractmethod
    def drag(self, kind: str, start: nav.Point, end: nav.Point) -> None:
        """Change the document for a drag that is at ``end`` now."""

    @abstractmethod
    def roll_wheel(self, steps: float, at: nav.Point, modifiers: Qt.KeyboardModifier) -> None:
        """Change the document for notches of the wheel."""

    @abstractmethod
    def key(self, event: QKeyEvent) -> bool:
        """Do what a key says. False for a key without a meaning."""

    @abstractmethod
    def look(self, axis: str) -> None:
        """Look along an axis of the world, a key of `navigation.AXES`."""

    @abstractmethod
    def fit(self) -> None:
        """Show everything."""

    def double_click(self, at: nav.Point) -> None:
        """Do what a double click says."""

    def look_by_key(self, event: QKeyEvent) -> bool:
        """1, 3 and 7 look from the front, the left and the top; with Ctrl from the other side."""
        axes = {Qt.Key.Key_1: ("front", "back"), Qt.Key.Key_3: ("left", "right"), Qt.Key.Key_7: ("top", "bottom")}
        pair = axes.get(Qt.Key(event.key()))
        if pair is not None:
            self.look(pair[bool(event.modifiers() & Qt.KeyboardModifier.ControlModifier)])
        return pair is not None


class CameraInteractor(Interactor):
    """Turns, pans, zooms and rolls the cameras of a view."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self._camera: Camera = Camera()

    def camera(self) -> Camera | None:
        """The camera as the document has it; None where it has none that can be read."""
        try:
            value = links.value_of(self.session.network, self.subject.cameras[0])
        except (GraphError, IndexError):
            return None
        return value if isinstance(value, Camera) else None

    def sight(self) -> Sight | None:
        camera = self.camera()
        return Sight(self.size, camera=camera) if camera is not None else None

    def set(self, camera: Camera) -> None:
        """Set all cameras of the view."""
        for target in self.subject.cameras:
            if not self.session.do(Set(target, camera)):
                return

    def set_at_once(self, name: str, camera: Camera) -> None:
        """Set all cameras as one step of its own."""
        self.end()
        with self.session.gesture(name):
            self.set(camera)

    def gesture_of(self, event: QMouseEvent) -> str:
        modifiers = event.modifiers()
        if event.button() == Qt.MouseButton.MiddleButton:
            return "pan"
        if event.button() == Qt.MouseButton.RightButton:
            return "zoom"
        if event.button() != Qt.MouseButton.LeftButton:
            return ""
        if modifiers & Qt.KeyboardModifier.ShiftModifier:
            return "pan"
        return "roll" if modifiers & Qt.KeyboardModifier.ControlModifier else "turn"

    def take(self, kind: str) -> bool:
        camera = self.camera()
        if camera is not None:
            self._camera = camera
        return camera is not None

    def drag(self, kind: str, start: nav.Point, end: nav.Point) -> None:
        if kind == "zoom":
            factor = ZOOM_STEP ** ((end[1] - start[1]) / 20.0)
            self.set(nav.zoom(self._camera, self.size, start, factor))
        else:
            move = {"turn": nav.turn, "pan": nav.pan, "roll": nav.roll}[kind]
            self.set(move(self._camera, self.size, start, end))

    def roll_wheel(self, steps: float, at: nav.Point, modifiers: Qt.KeyboardModifier) -> None:
        self.set(nav.zoom(self._camera, self.size, at, ZOOM_STEP**-steps))

    def key(self, event: QKeyEvent) -> bool:
        camera = self.camera()
        if camera is None:
            return False
        if self.look_by_key(event):
            return True
        middle = (self.size[0] / 2, self.size[1] / 2)
        key = Qt.Key(event.key())
        arrows = {Qt.Key.Key_Left: (-1, 0), Qt.Key.Key_Right: (1, 0), Qt.Key.Key_Up: (0, 1), Qt.Key.Key_Down: (0, -1)}
        if key in arrows:
            x, y = arrows[key]
            right, up, _ = camera.basis
            axis = up * -x + right * y
            self.set_at_once("turn", rotated(camera, rotation(axis, math.radians(KEY_TURN))))
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal, Qt.Key.Key_Minus):
            factor = ZOOM_STEP if key == Qt.Key.Key_Minus else 1 / ZOOM_STEP
            self.set_at_once("zoom", nav.zoom(camera, self.size, middle, factor))
        elif key in (Qt.Key.Key_BracketLeft, Qt.Key.Key_BracketRight):
            self.set_at_once("roll", nav.rolled(camera, KEY_TURN if key == Qt.Key.Key_BracketLeft else -KEY_TURN))
        elif key == Qt.Key.Key_5:
            self.switch()
        elif key in (Qt.Key.Key_F, Qt.Key.Key_Home):
            self.fit()
        else:
            return False
        return True

    def look(self, axis: str) -> None:
        camera = self.camera()
        if camera is not None:
            self.set_at_once(f"look from the {axis}", nav.along(camera, axis))

    def switch(self) -> None:
        """Change between perspective and orthographic."""
        camera = self.camera()
        if camera is not None:
            self.set_at_once("projection", nav.switched(camera))

    def fit(self) -> None:
        camera, corners = self.camera(), corners_of(self.session, self.view.path)
        if camera is None:
            return
        if not corners:
            self.session.tell("info", "nothing to fit yet: the data of this view is not computed", self.view.path)
            return
        self.set_at_once("fit", nav.fitted(camera, corners, self.size))

    def double_click(self, at: nav.Point) -> None:
        """Put the focus where something is seen."""
        camera, found = self.camera(), self.view.pick_at(at)
        if camera is not None and found is not None and found.world is not None:
            self.set_at_once("focus", nav.centred(camera, found.world))


def corners_of(session: Session, view: str) -> list[list[float]]:
    """Corners, world mm, of the boxes around the nearest thing that a view shows and that is known."""
    for name in things_of(session.network, view):
        path, _, output = name.rpartition(".")
        value = session.value(path, output)
        corners = getattr(value, "corners", None)
        if corners is not None:
            found: list[list[float]] = corners.tolist()
            return found
    return []


def _point(place: QPointF) -> nav.Point:
    return place.x(), place.y()
