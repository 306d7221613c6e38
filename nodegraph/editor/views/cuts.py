"""What the mouse and the keys do in a view of a cut: move its plane, and set which values are black and white."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent

from nodegraph import links
from nodegraph.commands import Reset, Set
from nodegraph.data import Plane, Volume
from nodegraph.editor.views import crosshair
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.interactors import ZOOM_STEP, Interactor
from nodegraph.editor.views.sight import Sight
from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.editor.views.view import ViewWidget


class CutInteractor(Interactor):
    """Scrolls the plane of a cut, shifts and zooms it, and sets its window."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self._plane = Plane()
        self._height = 0.0
        self._window = (0.0, 0.0)
        self._whole: tuple[float, float] | None = None
        self._asked: Any = None

    def wheel_name(self, modifiers: Qt.KeyboardModifier) -> str:
        return "zoom" if modifiers & Qt.KeyboardModifier.ControlModifier else "scroll"

    def plane(self) -> Plane | None:
        """The plane as the document has it."""
        found: Plane | None = self._read(self.subject.plane, Plane)
        return found

    def volume(self) -> Volume | None:
        """The volume that is cut, as far as it is known. Its numbers may lie on a device."""
        path, _, output = self.subject.source.rpartition(".")
        value = self.session.value(path, output) if path else None
        if isinstance(value, Volume) and value is not self._asked:
            self._asked, self._whole = value, None
            self.session.work(lambda: value.range, self._keep_range)
        return value if isinstance(value, Volume) else None

    def height(self) -> float:
        """What the picture covers from bottom to top, mm; 0 where that is not known."""
        stored = self._read(self.subject.height, float) or 0.0
        plane, volume = self.plane(), self.volume()
        if stored > 0.0 or plane is None or volume is None:
            return stored
        return nav.cut_height(plane, volume.corners, self.size)

    def sight(self) -> Sight | None:
        plane, height = self.plane(), self.height()
        return Sight(self.size, plane=plane, height=height) if plane is not None and height > 0.0 else None

    def gesture_of(self, event: QMouseEvent) -> str:
        if event.button() == Qt.MouseButton.RightButton:
            return "window" if self.subject.window else ""
        if event.button() == Qt.MouseButton.MiddleButton or (
            event.button() == Qt.MouseButton.LeftButton and event.modifiers() & Qt.KeyboardModifier.ShiftModifier
        ):
            return "shift"
        return "scroll" if event.button() == Qt.MouseButton.LeftButton else ""

    def take(self, kind: str) -> bool:
        plane, volume = self.plane(), self.volume()
        if plane is None or volume is None:
            return False
        self._plane, self._height = plane, self.height()
        if kind == "window":
            window = self._read(self.subject.window, tuple) or (0.0, 0.0)
            self._window = self._whole if window == (0.0, 0.0) and self._whole is not None else window
            return self._window != (0.0, 0.0)
        return True

    def drag(self, kind: str, start: nav.Point, end: nav.Point) -> None:
        volume = self.volume()
        if volume is None:
            return
        if kind == "window":
            self.session.do(Set(self.subject.window, nav.windowed(self._window, self.size, start, end)))
        elif kind == "scroll":
            steps = round((start[1] - end[1]) / 4.0)
            self._move(nav.scrolled(self._plane, volume.world_to_index, steps))
        elif kind == "shift":
            places = [nav.on_plane(self._plane, self._height, self.size, place) for place in (start, end)]
            origin = self._plane.origin + (places[0] - places[1])
            self.session.do(Set(self.subject.plane, Plane(tuple(origin.tolist()), self._plane.normal)))

    def roll_wheel(self, steps: float, at: nav.Point, modifiers: Qt.KeyboardModifier) -> None:
        volume = self.volume()
        if modifiers & Qt.KeyboardModifier.ControlModifier and self.subject.height:
            self._zoom(ZOOM_STEP**-steps, at)
        elif volume is not None:
            far = 10.0 if modifiers & Qt.KeyboardModifier.ShiftModifier else 1.0
            self._move(nav.scrolled(self._plane, volume.world_to_index, steps * far))

    def _move(self, plane: Plane) -> None:
        """Move the plane along its normal, and the cross-hair with it."""
        before = self.plane()
        if self.session.do(Set(self.subject.plane, plane)) and before is not None:
            crosshair.carry(self.session, before, plane)

    def _zoom(self, factor: float, at: nav.Point) -> None:
        fixed = nav.on_plane(self._plane, self._height, self.size, at)
        origin = fixed + factor * (self._plane.origin - fixed)
        self.session.do(Set(self.subject.height, self._height * factor))
        self.session.do(Set(self.subject.plane, Plane(tuple(origin.tolist()), self._plane.normal)))

    def key(self, event: QKeyEvent) -> bool:
        plane, volume = self.plane(), self.volume()
        if plane is None:
            return False
        if self.look_by_key(event):
            return True
        key = Qt.Key(event.key())
        ups = {Qt.Key.Key_Up: 1, Qt.Key.Key_Down: -1, Qt.Key.Key_PageUp: 10, Qt.Key.Key_PageDown: -10}
        if key in ups and volume is not None:
            self.end()
            with self.session.gesture("scroll"):
                self._move(nav.scrolled(plane, volume.world_to_index, ups[key]))
        elif key in (Qt.Key.Key_F, Qt.Key.Key_Home):
            self.fit()
        else:
            return False
        return True

    def look(self, axis: str) -> None:
        plane = self.plane()
        if plane is not None:
            self.end()
            through = crosshair.place(self.session.network)
            turned = Plane(plane.origin, nav.AXES[axis][1])
            with self.session.gesture(f"look from the {axis}"):
                self.session.do(Set(self.subject.plane, turned if through is None else nav.through(turned, through)))

    def fit(self) -> None:
        """Show all of the volume. A plane that does not meet it goes through its middle."""
        plane, volume = self.plane(), self.volume()
        if plane is None or volume is None:
            return
        self.end()
        corners = volume.corners
        middle = (corners.min(axis=0) + corners.max(axis=0)) / 2
        offs = (corners - plane.origin) @ plane.unit_normal
        meets = float(offs.min()) <= 0.0 <= float(offs.max())
        # Only within the plane, where it meets the volume: who scrolled to a place stays there.
        away = plane.unit_normal * float((plane.origin - middle) @ plane.unit_normal) if meets else 0.0
        origin = middle + away
        with self.session.gesture("fit"):
            self.session.do(Set(self.subject.plane, Plane(tuple(origin.tolist()), plane.normal)))
            if self.subject.height:
                self.session.do(Reset(self.subject.height))

    def reset_window(self) -> None:
        """Show all values from black to white."""
        if self.subject.window:
            self.end()
            self.session.do(Reset(self.subject.window))

    def _keep_range(self, found: tuple[float, float] | None) -> None:
        self._whole = found

    def _read(self, target: str, kind: type) -> Any:
        try:
            value = links.value_of(self.session.network, target) if target else None
        except GraphError:
            return None
        return value if isinstance(value, kind) else None
