"""A view: the picture of one node, kept up to date, to be turned, measured and saved."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, QPointF, Qt, QTimer, Signal
from PySide6.QtGui import QColor, QFocusEvent, QKeyEvent, QMouseEvent, QPainter, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QDockWidget, QHBoxLayout, QVBoxLayout, QWidget

from nodegraph.data import Image, Volume
from nodegraph.editor.views.cuts import CutInteractor
from nodegraph.editor.views.handles import Handles
from nodegraph.editor.views.icons import IconButton
from nodegraph.editor.views.interactors import CameraInteractor, Interactor
from nodegraph.editor.views.pick import Pick, pick
from nodegraph.editor.views.picture_area import PictureArea
from nodegraph.editor.views.progress_strip import ProgressStrip
from nodegraph.editor.views.readout import Readout
from nodegraph.editor.views.shown import VIEWPORT, Shown, linear, shown
from nodegraph.editor.views.sight import Sight
from nodegraph.editor.views.status_line import StatusLine
from nodegraph.editor.views.toolbox import Toolbox
from nodegraph.editor.views.tools import CLICK, Tool, mouse_inside, wheel_inside
from nodegraph.errors import CommandError, GraphError
from nodegraph.requests import coarseness
from nodegraph.subjects import Subject, subject_of, things_of

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.network import Node
    from nodegraph.report import Report

SETTLE = 80
"""Milliseconds that a size must stay before it is asked for, so that a drag of the window's edge asks once."""


class ViewWidget(QWidget):
    """The picture of a node at the widget's own size.

    The node is held itself, so a rename changes nothing; `gone` says that it was removed.
    """

    gone = Signal()
    drawn = Signal()  # another picture is on the screen

    def __init__(self, session: Session, node_path: str, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.node: Node = session.network.node(node_path)
        self.shown: Shown | None = None
        self.subject = Subject()
        self.interactor: Interactor | None = None
        self._channel = object()
        self._newest = 0
        self._told = ""
        self.tools: list[Tool] = []
        self.used = 0.0  # when it had the keyboard last
        self._taker: Tool | None = None
        self._pressed: tuple[Qt.MouseButton, QPointF] | None = None
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.area = PictureArea(self, zooming=False)
        self.area.setMouseTracking(True)
        self.setMouseTracking(True)
        self.area.overlays.append(self._paint)
        self.handles = Handles(self)
        self.tools.append(self.handles)
        self.readout = Readout(self)
        self._facts = StatusLine(self, quiet=True)
        self.toolbox = Toolbox(self)
        self._lay_out()
        self._settle = QTimer(self, singleShot=True, interval=SETTLE)
        self._settle.timeout.connect(self._watch)
        self.progress = ProgressStrip(session, self._channel, self.area)
        session.answered.connect(self._answered)
        session.previewed.connect(self._previewed)
        session.changed.connect(self._changed)
        session.replaced.connect(self._replaced)
        session.states_changed.connect(self._show_state)
        self._find_subject()
        self._show_state()

    @property
    def path(self) -> str:
        """Path of the node now."""
        return self.node.path

    @property
    def alive(self) -> bool:
        """Whether the node is still part of the document."""
        try:
            return self.session.network.node(self.path) is self.node
        except CommandError:
            return False

    # -- what it is made of ---------------------------------------------------------------------------------------

    def _lay_out(self) -> None:
        fit = IconButton("fit", "Fit (F)", self)
        fit.clicked.connect(self.fit)
        self._projection = IconButton("perspective", "Orthographic (5)", self)
        self._projection.clicked.connect(self.switch_projection)
        save = IconButton("camera", "Save a picture (Ctrl+Shift+S)", self)
        save.clicked.connect(self.open_screenshot)
        self._full = IconButton("fullscreen", "Full screen (F11)", self)
        self._full.clicked.connect(self.toggle_full_screen)
        bar = QHBoxLayout()
        bar.setContentsMargins(4, 2, 4, 2)
        bar.setSpacing(2)
        for button in (self.toolbox.look, fit, self._projection):
            bar.addWidget(button)
        self.toolbox.fill_bar(bar)
        bar.addWidget(self._facts, 1)
        bar.addWidget(save)
        bar.addWidget(self._full)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(bar)
        layout.addWidget(self.area, 1)
        layout.addWidget(self.readout.line)

    # -- asking and showing ---------------------------------------------------------------------------------------

    @property
    def pixels(self) -> tuple[int, int]:
        """Size of the picture to ask for, in pixels of the screen."""
        ratio = self.area.devicePixelRatioF()
        return max(1, round(self.area.width() * ratio)), max(1, round(self.area.height() * ratio))

    def _watch(self) -> None:
        if self.isVisible() and self.alive:
            self._told = self.path
            self.session.watch(self._channel, self.path, self.pixels)

    def _answered(self, channel: object, report: Report) -> None:
        if channel is not self._channel or not self.alive:
            return
        coarse = coarseness(self.session.quality(channel))
        taken = sum(report.timings.values())
        facts = [f"draft 1/{coarse}"] if coarse > 1 else []
        if taken >= 0.0005:
            facts.append(f"{taken * 1000:.0f} ms")
        self._show_state()
        self._show_values(report.shown.get(self.path, {}), facts)

    def _previewed(self, channel: object, values: dict[str, Any]) -> None:
        if channel is self._channel and self.alive:
            self._show_values(values, ["not finished"])

    def _show_values(self, values: dict[str, Any], facts: list[str]) -> None:
        image = next((value for value in values.values() if isinstance(value, Image)), None)
        if image is None:
            return
        self._newest += 1
        if self.shown is not None and self.shown.image is image:
            return  # something was changed that this view does not depend on
        number, background = self._newest, linear(QColor(VIEWPORT))
        self.session.work(
            lambda: shown(image, background),
            lambda made: self._take(number, made, facts) if made else None,
            self.area,
        )

    def _take(self, number: int, made: Shown, facts: list[str]) -> None:
        if number != self._newest:
            return  # a newer one is being made
        self.shown = made
        made.picture.setDevicePixelRatio(1.0)
        self.area.show_picture(made.picture)
        self._facts.setText("  ·  ".join([f"{made.size[0]} × {made.size[1]}", *facts]))
        if isinstance(self.interactor, CutInteractor):
            self.interactor.volume()  # asks for its range before a drag needs it
        self.readout.refresh()
        self.drawn.emit()

    def _show_state(self) -> None:
        if not self.alive:
            self.area.show_note("The node of this view was removed.")
            return
        state = self.session.state(self.path)
        if state in ("failed", "blocked"):
            self.area.show_note(state.reason or "There is nothing to show yet.")
        else:
            self.area.show_note("")

    def _changed(self, commands: list[Any]) -> None:
        if not self.alive:
            self.session.unwatch(self._channel)
            self._show_state()
            self.gone.emit()
            return
        if self._told and self._told != self.path:
            self._watch()
        if commands and not any(command.touched or command.structural for command in commands):
            self.refresh_tools()  # only what editors look at has changed
        else:
            self._find_subject()

    def _replaced(self) -> None:
        self._taker = None
        for part in self._parts():
            part.forget()
        self._changed([])

    def _busy(self) -> bool:
        return any(part.active for part in self._parts())

    def _parts(self) -> list[Tool | Interactor]:
        """Whoever may have a gesture, in the order in which they are asked."""
        return [*self.tools, *([self.interactor] if self.interactor is not None else [])]

    def _find_subject(self) -> None:
        if not self.alive or self._busy():
            return
        try:
            found = subject_of(self.session.network, self.path)
        except GraphError:
            found = Subject()
        if found != self.subject or self.interactor is None:
            self.subject = found
            if self.interactor is not None:
                self.interactor.deleteLater()
            self.interactor = CameraInteractor(self) if found.cameras else CutInteractor(self) if found.plane else None
        turns = isinstance(self.interactor, CameraInteractor)
        self._projection.setVisible(turns)
        if isinstance(self.interactor, CameraInteractor):
            camera = self.interactor.camera()
            flat = camera is not None and camera.orthographic
            self._projection.show_icon("orthographic" if flat else "perspective")
            self._projection.setToolTip("To perspective (5)" if flat else "To orthographic (5)")
        self.refresh_tools()

    def refresh_tools(self) -> None:
        """Show anew what the tools draw and which of them are on."""
        self.toolbox.refresh()

    # -- what can be done -----------------------------------------------------------------------------------------

    def look(self, axis: str) -> None:
        """Look along an axis, a key of `navigation.AXES`."""
        if self.interactor is not None:
            self.interactor.look(axis)

    def fit(self) -> None:
        """Show everything."""
        if self.interactor is not None:
            self.interactor.fit()

    def switch_projection(self) -> None:
        """Change between perspective and orthographic."""
        if isinstance(self.interactor, CameraInteractor):
            self.interactor.switch()

    def open_screenshot(self) -> None:
        """Ask for a file and a size, and save a picture."""
        from nodegraph.editor.views.screenshot import ScreenshotDialog

        dialog = ScreenshotDialog(self.session, self.path, self.pixels, self)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    def toggle_full_screen(self) -> None:
        """Fill the screen, or go back to where it was. The dock keeps its place meanwhile."""
        dock = self.parentWidget()
        if not isinstance(dock, QDockWidget):
            self.showNormal() if self.isFullScreen() else self.showFullScreen()
        elif self.isFullScreen():
            self.setWindowState(self.windowState() & ~Qt.WindowState.WindowFullScreen)
            self.setWindowFlags(Qt.WindowType.Widget)
            dock.setWidget(self)
            self.show()
            dock.setMinimumSize(0, 0)
        else:
            dock.setMinimumSize(dock.size())  # an empty dock would shrink
            self.setWindowFlags(Qt.WindowType.Window)
            self.showFullScreen()
            self.setFocus()

    # -- picking --------------------------------------------------------------------------------------------------

    def pick_at(self, at: tuple[float, float]) -> Pick | None:
        """What is known of a place of the picture area."""
        pixel = self.area.pixel_at(QPointF(*at))
        return pick(self, pixel) if pixel is not None and self.shown is not None else None

    def volume(self) -> Volume | None:
        """The scalar volume whose values this view shows, as far as it is known: what is cut, or the nearest one."""
        if isinstance(self.interactor, CutInteractor):
            return self.interactor.volume()
        for name in things_of(self.session.network, self.path) if self.alive else ():
            path, _, output = name.rpartition(".")
            value = self.session.value(path, output)
            if isinstance(value, Volume) and value.components == 1:
                return value
        return None

    @property
    def status(self) -> str:
        """What the line below the picture says of the place under the cursor."""
        return self.readout.line.text()

    def sight(self) -> Sight | None:
        """How the document has it that this view looks at the world; None where that is not known."""
        return self.interactor.sight() if self.interactor is not None else None

    def _paint(self, painter: QPainter) -> None:
        for tool in reversed(self.tools):
            painter.save()
            tool.paint(painter)
            painter.restore()

    # -- events ---------------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        if not self.area.geometry().contains(event.position().toPoint()):
            return
        inside = mouse_inside(event, self, self.area)
        self._pressed = event.button(), inside.position()
        if self._taker is not None:
            self._taker.press(inside)
            return
        self._taker = next((tool for tool in self.tools if not self._dragged() and tool.press(inside)), None)
        if self._taker is None and self.interactor is not None:
            self.interactor.press(inside)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        inside = mouse_inside(event, self, self.area)
        if self._taker is not None:
            self._taker.move(inside)
        elif (self._dragged() or not any(tool.move(inside) for tool in self.tools)) and self.interactor is not None:
            self.interactor.move(inside)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        inside = mouse_inside(event, self, self.area)
        pressed, self._pressed = self._pressed, None
        if self._taker is not None:
            pressed = None
            self._taker.release(inside)
            if not event.buttons():
                self._taker = None
        elif self.interactor is not None:
            self.interactor.release(inside)
        self._find_subject()
        if pressed is not None and pressed[0] == event.button():
            if (inside.position() - pressed[1]).manhattanLength() < CLICK:
                self._click(inside)

    def _click(self, event: QMouseEvent) -> None:
        place = event.position()
        if event.button() == Qt.MouseButton.RightButton and self.interactor is not None:
            self.toolbox.menu_at((place.x(), place.y()), event.globalPosition().toPoint())
        else:
            any(tool.click(event) for tool in self.tools)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        inside = mouse_inside(event, self, self.area)
        if any(tool.double_click(inside) for tool in self.tools):
            return
        place = inside.position()
        if self.interactor is not None and event.button() == Qt.MouseButton.LeftButton:
            self.interactor.double_click((place.x(), place.y()))

    def _dragged(self) -> bool:
        """Whether the camera or the plane follows the mouse right now."""
        return self.interactor is not None and self.interactor.dragging

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.interactor is not None:
            inside = wheel_inside(event, self, self.area)
            if self._dragged() or not any(tool.wheel(inside) for tool in self.tools):
                self.interactor.wheel(inside)
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key, control = Qt.Key(event.key()), event.modifiers() & Qt.KeyboardModifier.ControlModifier
        if key == Qt.Key.Key_F11:
            self.toggle_full_screen()
        elif not self._dragged() and any(tool.key(event) for tool in self.tools):
            pass
        elif key == Qt.Key.Key_Escape and self.interactor is not None and self.interactor.cancel():
            pass
        elif key == Qt.Key.Key_Escape and self.window().isFullScreen():
            self.toggle_full_screen()
        elif key == Qt.Key.Key_S and control and event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            self.open_screenshot()
        elif key == Qt.Key.Key_C and control and self.readout.copy():
            pass
        elif self.interactor is None or self.interactor.dragging or not self.interactor.key(event):
            super().keyPressEvent(event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        if not any(tool.key_up(event) for tool in self.tools):
            super().keyReleaseEvent(event)

    def focusInEvent(self, event: QFocusEvent) -> None:
        self.used = time.monotonic()
        super().focusInEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._settle.start()

    def set_in_front(self, front: bool) -> None:
        """Compute while it can be seen, and not else."""
        if front:
            self._settle.start()
            return
        self._settle.stop()
        for part in self._parts():
            part.end()
        self.session.unwatch(self._channel)

    def showEvent(self, event: QEvent) -> None:
        self.set_in_front(True)

    def hideEvent(self, event: QEvent) -> None:
        self.set_in_front(False)
