"""The tools of a view: their buttons in its bar, their menus, and what the commands of the window call."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QPoint
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QHBoxLayout, QMenu, QToolButton

from nodegraph.editor.views import cameras
from nodegraph.editor.views.crosshair import CrossHair
from nodegraph.editor.views.cuts import CutInteractor
from nodegraph.editor.views.fly import Fly
from nodegraph.editor.views.icons import IconButton, icon
from nodegraph.editor.views.interactors import CameraInteractor
from nodegraph.editor.views.labels import LabelPick
from nodegraph.editor.views.measures import REGIONS
from nodegraph.editor.views.measuring import Measuring
from nodegraph.editor.views.navigation import AXES

if TYPE_CHECKING:
    from nodegraph.editor.views.navigation import Point
    from nodegraph.editor.views.view import ViewWidget

MEASURES = {
    "distance": ("Measure a distance", "D"),
    "angle": ("Measure an angle", "A"),
    "rectangle": ("Measure a rectangle", "R"),
    "polygon": ("Measure a polygon", "P"),
}


class Toolbox(QObject):
    """The tools of one view, in the order in which they get the mouse."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self.view = view
        self.session = view.session
        self.flying = Fly(view)
        self.measuring = Measuring(view)
        self.cross = CrossHair(view)
        self.labels = LabelPick(view)
        view.tools = [self.flying, self.measuring, *view.tools, self.cross, self.labels]
        self.look, self.look_menu = self._menu_button("axes", "Look along an axis", self._fill_look)
        self._measure, _ = self._menu_button("measure", "Measure", self._fill_measures)
        self._measure.setCheckable(True)
        self._cross = IconButton("crosshair", "Cross-hair (X)", view, checkable=True)
        self._cross.clicked.connect(self.crosshair)
        self._handles = IconButton("handles", "Handles of the selection (H)", view, checkable=True)
        self._handles.clicked.connect(self.handles)
        self._fly = IconButton("fly", "Fly (Shift+F)", view, checkable=True)
        self._fly.clicked.connect(self.fly)

    def fill_bar(self, bar: QHBoxLayout) -> None:
        """Put the buttons into the bar of the view."""
        for button in (self._fly, self._cross, self._handles, self._measure):
            bar.addWidget(button)

    def refresh(self) -> None:
        """Show what is on, and what this view can do."""
        self._fly.setVisible(isinstance(self.view.interactor, CameraInteractor))
        self._fly.setChecked(self.flying.on)
        self._cross.setVisible(self.view.interactor is not None)
        self._cross.setChecked(self.cross.shown)
        self._handles.setVisible(isinstance(self.view.interactor, CameraInteractor))
        self._handles.setChecked(self.view.handles.shown)
        self._measure.setVisible(self.view.interactor is not None)
        self._measure.setChecked(bool(self.measuring.kind))
        self.view.area.update()

    # -- what the commands do -----------------------------------------------------------------------------------------

    def fly(self) -> None:
        """Fly, or stop flying."""
        self.flying.toggle()

    def crosshair(self) -> None:
        """Show the cross-hair, or take it away."""
        self.cross.toggle()
        self.refresh()

    def handles(self) -> None:
        """Show the handles of what is selected, or none."""
        self.view.handles.toggle()

    def distance(self) -> None:
        self._begin("distance")

    def angle(self) -> None:
        self._begin("angle")

    def rectangle(self) -> None:
        self._begin("rectangle")

    def polygon(self) -> None:
        self._begin("polygon")

    def link_cameras(self) -> None:
        """Let all views with cameras turn with this one."""
        cameras.share(self.session, self.view.path, list(cameras.others(self.session, self.view.path)))

    def own_camera(self) -> None:
        """Let this view turn alone."""
        cameras.part(self.session, self.view.path)

    def copy_place(self) -> None:
        """Copy what the line below the picture says."""
        self.view.readout.copy()

    def _begin(self, kind: str) -> None:
        self.view.setFocus()
        self.measuring.begin(kind)

    # -- menus --------------------------------------------------------------------------------------------------------

    def _menu_button(self, sign: str, tip: str, fill: Callable[[QMenu], None]) -> tuple[IconButton, QMenu]:
        button, menu = IconButton(sign, tip, self.view), QMenu(self.view)

        def show() -> None:
            menu.clear()
            fill(menu)

        menu.aboutToShow.connect(show)
        button.setMenu(menu)
        button.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        return button, menu

    def _fill_look(self, menu: QMenu) -> None:
        hand = self.view.interactor
        keys = {"front": "1", "back": "Ctrl+1", "left": "3", "right": "Ctrl+3", "top": "7", "bottom": "Ctrl+7"}
        names = {"front": "Coronal", "left": "Sagittal", "top": "Axial"}
        for axis, (label, _, _) in AXES.items():
            text = names.get(axis, "") if isinstance(hand, CutInteractor) else f"From the {label.lower()}"
            if text:
                self._entry(menu, f"{text}\t{keys[axis]}", partial(self.view.look, axis), hand is not None)
        menu.addSeparator()
        self._entry(menu, "Fit\tF", self.view.fit, hand is not None)
        if isinstance(hand, CutInteractor) and self.view.subject.window:
            self._entry(menu, "All values from black to white", hand.reset_window)
        if isinstance(hand, CameraInteractor):
            camera = hand.camera()
            entry = self._entry(menu, "Orthographic\t5", self.view.switch_projection)
            entry.setCheckable(True)
            entry.setChecked(camera is not None and camera.orthographic)
            self._fill_cameras(menu)

    def _fill_cameras(self, menu: QMenu) -> None:
        others = cameras.others(self.session, self.view.path)
        if not others:
            return
        menu.addSeparator()
        for path, shared in others.items():
            entry = self._entry(menu, f"Turns with {path}", partial(self._share, path, shared))
            entry.setCheckable(True)
            entry.setChecked(shared)

    def _share(self, path: str, shared: bool) -> None:
        if shared:
            cameras.part(self.session, self.view.path)
        else:
            cameras.share(self.session, self.view.path, [path])

    def menu_at(self, at: Point, globally: QPoint) -> None:
        """Offer what can be done at a place of the picture."""
        menu = QMenu(self.view)
        menu.aboutToHide.connect(menu.deleteLater)
        found = self.view.pick_at(at)
        seen = found is not None and found.world is not None
        self._entry(menu, "Copy value and position\tCtrl+C", self.copy_place, bool(self.view.status))
        self._entry(menu, "Put the cross-hair here\tC", partial(self.cross.put_at, at), seen)
        if isinstance(self.view.interactor, CameraInteractor):
            self._entry(menu, "Turn about this\tDouble-click", partial(self.view.interactor.double_click, at), seen)
        menu.addSeparator()
        self._fill_measures(menu)
        menu.popup(globally)

    def _fill_measures(self, menu: QMenu) -> None:
        cut = not isinstance(self.view.interactor, CameraInteractor)
        for kind, (words, key) in MEASURES.items():
            entry = self._entry(menu, f"{words}\t{key}", partial(self._begin, kind), cut or kind not in REGIONS)
            entry.setIcon(icon(kind, self.view.palette()))
        menu.addSeparator()
        mine = [entry for entry in self.measuring.all.entries() if entry.view == self.view.path]
        self._entry(menu, "Delete the measures of this view", partial(self.measuring.all.remove, mine), bool(mine))

    def _entry(self, menu: QMenu, words: str, act: Callable[[], object], enabled: bool = True) -> QAction:
        entry = menu.addAction(words)
        entry.triggered.connect(lambda _=False: act())
        entry.setEnabled(enabled)
        return entry
