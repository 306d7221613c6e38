"""A view: the picture of one node, kept up to date, to be turned, measured and saved."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, QPointF, Qt, QTimer, Signal
from PySide6.QtGui import QAction, QColor, QKeyEvent, QMouseEvent, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QDockWidget, QHBoxLayout, QMenu, QToolButton, QVBoxLayout, QWidget

from nodegraph.data import Image
from nodegraph.editor.views.icons import IconButton
from nodegraph.editor.views.interactors import CameraInteractor, CutInteractor, Interactor
from nodegraph.editor.views.navigation import AXES
from nodegraph.editor.views.pick import Pick, pick
from nodegraph.editor.views.picture_area import PictureArea
from nodegraph.editor.views.shown import VIEWPORT, Shown, linear, shown
from nodegraph.editor.views.status_line import StatusLine
from nodegraph.errors import CommandError, GraphError
from nodegraph.subjects import Subject, subject_of

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
        self._cursor: QPointF | None = None
        self._found: Pick | None = None
        self._picks = 0
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.area = PictureArea(self, zooming=False)
        self.area.setMouseTracking(True)
        self.setMouseTracking(True)
        self._status = StatusLine(self)
        self._facts = StatusLine(self, quiet=True)
        self._lay_out()
        self._settle = QTimer(self, singleShot=True, interval=SETTLE)
        self._settle.timeout.connect(self._watch)
        self.area.hovered.connect(self._hover)
        session.answered.connect(self._answered)
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
        self._menu = QMenu(self)
        self._menu.aboutToShow.connect(self._fill_menu)
        look = IconButton("axes", "Look along an axis", self)
        look.setMenu(self._menu)
        look.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
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
        for button in (look, fit, self._projection):
            bar.addWidget(button)
        bar.addWidget(self._facts, 1)
        bar.addWidget(save)
        bar.addWidget(self._full)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(bar)
        layout.addWidget(self.area, 1)
        layout.addWidget(self._status)

    def _fill_menu(self) -> None:
        self._menu.clear()
        cut = isinstance(self.interactor, CutInteractor)
        keys = {"front": "1", "back": "Ctrl+1", "left": "3", "right": "Ctrl+3", "top": "7", "bottom": "Ctrl+7"}
        names = {"front": "Coronal", "left": "Sagittal", "top": "Axial"}
        for axis, (label, _, _) in AXES.items():
            text = names.get(axis, "") if cut else f"From the {label.lower()}"
            if text:
                self._entry(f"{text}\t{keys[axis]}", partial(self.look, axis))
        self._menu.addSeparator()
        self._entry("Fit\tF", self.fit)
        if isinstance(self.interactor, CutInteractor) and self.subject.window:
            self._entry("All values from black to white", self.interactor.reset_window)
        if isinstance(self.interactor, CameraInteractor):
            camera = self.interactor.camera()
            entry = self._entry("Orthographic\t5", self.switch_projection)
            entry.setCheckable(True)
            entry.setChecked(camera is not None and camera.orthographic)

    def _entry(self, text: str, act: Callable[[], object]) -> QAction:
        entry = self._menu.addAction(text)
        entry.triggered.connect(lambda _=False: act())
        entry.setEnabled(self.interactor is not None)
        return entry

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
        image = next((v for v in report.shown.get(self.path, {}).values() if isinstance(v, Image)), None)
        seconds = sum(report.timings.values())
        self._show_state()
        if image is None:
            return
        self._newest += 1
        number, background = self._newest, linear(QColor(VIEWPORT))
        self.session.work(
            lambda: shown(image, background), lambda made: self._take(number, made, seconds) if made else None
        )

    def _take(self, number: int, made: Shown, seconds: float) -> None:
        if number != self._newest:
            return  # a newer one is being made
        self.shown = made
        ratio = self.pixels[0] / max(made.size[0], 1)
        made.picture.setDevicePixelRatio(1.0)
        self.area.show_picture(made.picture)
        part = "" if 0.99 < ratio < 1.01 else " while moving"
        time = f"  ·  {seconds * 1000:.0f} ms" if seconds >= 0.0005 else ""
        self._facts.setText(f"{made.size[0]} × {made.size[1]}{part}{time}")
        if isinstance(self.interactor, CutInteractor):
            self.interactor.volume()  # asks for its range before a drag needs it
        self._show_pick()
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
        self._find_subject()

    def _replaced(self) -> None:
        if self.interactor is not None:
            self.interactor.forget()
        self._changed([])

    def _busy(self) -> bool:
        return self.interactor is not None and self.interactor.active

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
        """Fill the screen, or go back to where it was."""
        dock = self.parentWidget()
        if not isinstance(dock, QDockWidget):
            self.showNormal() if self.isFullScreen() else self.showFullScreen()
        elif dock.isFullScreen():
            dock.showNormal()
            dock.setFloating(bool(dock.property("floated")))
        else:
            dock.setProperty("floated", dock.isFloating())
            dock.setFloating(True)
            dock.showFullScreen()

    # -- picking --------------------------------------------------------------------------------------------------

    def pick_at(self, at: tuple[float, float]) -> Pick | None:
        """What is known of a place of the picture area."""
        pixel = self.area.pixel_at(QPointF(*at))
        return pick(self, pixel) if pixel is not None and self.shown is not None else None

    def _hover(self, pixel: tuple[int, int] | None) -> None:
        self._cursor = QPointF(*pixel) if pixel is not None else None
        self._show_pick()

    def _show_pick(self) -> None:
        if self._cursor is None or self.shown is None:
            self._status.setText("")
            self._found = None
            return
        found = pick(self, (int(self._cursor.x()), int(self._cursor.y())))
        self._found = found
        self._status.setText(found.text() if found is not None else "")
        if found is not None and found.read is not None:
            self._picks += 1
            number, read = self._picks, found.read
            self.session.work(read, lambda value: self._take_value(number, found, value))

    def _take_value(self, number: int, found: Pick, value: float | None) -> None:
        if number == self._picks and self._found is found and value is not None:
            self._status.setText(found.text(value))

    @property
    def status(self) -> str:
        """What the line below the picture says of the place under the cursor."""
        return self._status.text()

    # -- events ---------------------------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self.setFocus(Qt.FocusReason.MouseFocusReason)
        if self.interactor is not None and self.area.geometry().contains(event.position().toPoint()):
            self.interactor.press(self._inside(event))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self.interactor is not None:
            self.interactor.move(self._inside(event))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if self.interactor is not None:
            self.interactor.release(self._inside(event))
            self._find_subject()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        place = self._inside(event).position()
        if self.interactor is not None and event.button() == Qt.MouseButton.LeftButton:
            self.interactor.double_click((place.x(), place.y()))

    def wheelEvent(self, event: QWheelEvent) -> None:
        if self.interactor is not None:
            place = self.area.mapFrom(self, event.position())
            inside = QWheelEvent(
                place,
                event.globalPosition(),
                event.pixelDelta(),
                event.angleDelta(),
                event.buttons(),
                event.modifiers(),
                event.phase(),
                event.inverted(),
            )
            self.interactor.wheel(inside)
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key, control = Qt.Key(event.key()), event.modifiers() & Qt.KeyboardModifier.ControlModifier
        if key == Qt.Key.Key_F11:
            self.toggle_full_screen()
        elif key == Qt.Key.Key_Escape and self.interactor is not None and self.interactor.cancel():
            pass
        elif key == Qt.Key.Key_Escape and self.window().isFullScreen():
            self.toggle_full_screen()
        elif key == Qt.Key.Key_S and control and event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            self.open_screenshot()
        elif self.interactor is None or self.interactor.dragging or not self.interactor.key(event):
            super().keyPressEvent(event)

    def _inside(self, event: QMouseEvent) -> QMouseEvent:
        """The event with its place in the picture area."""
        return QMouseEvent(
            event.type(),
            self.area.mapFrom(self, event.position()),
            event.globalPosition(),
            event.button(),
            event.buttons(),
            event.modifiers(),
        )

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._settle.start()

    def showEvent(self, event: QEvent) -> None:
        self._settle.start()

    def hideEvent(self, event: QEvent) -> None:
        self._settle.stop()
        if self.interactor is not None:
            self.interactor.end()
        self.session.unwatch(self._channel)


class ViewDock(QDockWidget):
    """A view as a dock; its name is the node's, and it closes with the node."""

    def __init__(self, session: Session, node_path: str, parent: QWidget | None = None) -> None:
        super().__init__(node_path, parent)
        self.setObjectName(f"view {node_path}")
        self.view = ViewWidget(session, node_path, self)
        self.setWidget(self.view)
        self.view.gone.connect(self.close)
        session.changed.connect(self._name)

    def _name(self) -> None:
        if self.view.alive:
            self.setWindowTitle(self.view.path)
