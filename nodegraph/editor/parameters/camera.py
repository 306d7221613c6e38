"""The field of a Camera: eye, target, up and lens, and the ways to a camera that need no numbers."""

from __future__ import annotations

import json
from functools import partial
from typing import Any

from PySide6.QtCore import QEvent, QSize, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QHBoxLayout, QMenu, QPushButton, QSizePolicy, QToolButton, QWidget

from nodegraph import data, links
from nodegraph.animation import shared_place
from nodegraph.editor import theme
from nodegraph.editor.parameters.look import GAP, ROW_HEIGHT, icon, ink
from nodegraph.editor.parameters.numbers import NumberField
from nodegraph.editor.parameters.place import Place
from nodegraph.editor.parameters.preset_menu import PresetMenu
from nodegraph.editor.parameters.simple import ChoiceField
from nodegraph.editor.parameters.values import Parts
from nodegraph.editor.views import navigation as nav
from nodegraph.errors import GraphError, ParameterError
from nodegraph.params import Choice, Float, Parameter
from nodegraph.pictures import views_of
from nodegraph.subjects import subject_of


class CameraField(Parts):
    """The six views along the axes of the world; the camera of a view, a preset, or the clipboard; and the numbers."""

    def __init__(self, declaration: Parameter, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.buttons: dict[str, QPushButton] = {}
        line = QHBoxLayout()
        line.setSpacing(3)
        for axis, (label, _, _) in nav.AXES.items():
            button = QPushButton(label)
            button.setFixedHeight(ROW_HEIGHT)
            button.setMinimumWidth(24)
            button.setToolTip(f"Look from the {axis}, at the same distance")
            button.setStyleSheet("padding: 0 2px")
            button.clicked.connect(partial(self._look, axis))
            self.buttons[axis] = button
            line.addWidget(button)
        self.rows.addLayout(line, self.rows.rowCount(), 0, 1, 2)
        self.rows.addLayout(self._sources(), self.rows.rowCount(), 0, 1, 2)
        projection = Choice(*data.camera.PROJECTIONS, doc="Projection.")
        self.add_field("projection", "Projection", ChoiceField(projection))
        angle = Float(30.0, min=1e-3, max=179.0, soft_min=5.0, soft_max=120.0, unit="deg", doc="Field of view.")
        self.add_field("field_of_view", "Field of view", NumberField(angle))
        height = Float(300.0, min=1e-9, unit="mm", doc="Height of an orthographic picture.")
        self.add_field("height", "Height", NumberField(height))
        self.add_vector("eye", "Eye", "mm")
        self.add_vector("target", "Target", "mm")
        self.add_vector("up", "Up")

    def _sources(self) -> QHBoxLayout:
        """Where a camera can come from as a whole, and go to."""
        line = QHBoxLayout()
        line.setSpacing(GAP)
        self.from_view = QPushButton("From view")
        self.from_view.setFixedHeight(ROW_HEIGHT)
        self.from_view.setStyleSheet("padding: 0 6px")
        self.from_view.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.from_view.setToolTip("Take the camera that a view has now")
        self.views = QMenu(self.from_view)
        self.views.aboutToShow.connect(self.fill_views)
        self.from_view.setMenu(self.views)
        line.addWidget(self.from_view, 1)
        self.presets = self._tool("Presets")
        if isinstance(self.place, Place):
            self.presets.setMenu(PresetMenu(self.place, self.refused.emit, self.presets))
            self.presets.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.copy = self._tool("Copy the camera as JSON")
        self.copy.clicked.connect(self.copy_json)
        self.paste = self._tool("Paste a camera from JSON")
        self.paste.clicked.connect(self.paste_json)
        for button in (self.presets, self.copy, self.paste):
            line.addWidget(button)
        if self.place is None:
            self.from_view.hide()
            self.presets.hide()
        self._draw_icons()
        return line

    def _tool(self, name: str) -> QToolButton:
        button = QToolButton()
        button.setFixedSize(ROW_HEIGHT, ROW_HEIGHT)
        button.setIconSize(QSize(16, 16))
        button.setAutoRaise(True)
        button.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        button.setToolTip(name)
        button.setAccessibleName(name)
        button.setStyleSheet("QToolButton::menu-indicator { image: none; }")
        return button

    def _draw_icons(self) -> None:
        self.presets.setIcon(icon("presets", ink(self.palette(), 0.8)))
        self.copy.setIcon(theme.icon("copy", self.palette()))
        self.paste.setIcon(theme.icon("paste", self.palette()))

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "paste"):
            self._draw_icons()

    def show_value(self, value: Any) -> None:
        super().show_value(value)
        if value is not None:
            self.show_row("field_of_view", not value.orthographic)
            self.show_row("height", value.orthographic)

    # -- whole cameras --------------------------------------------------------------------------------------------

    def _look(self, axis: str, _: bool = False) -> None:
        self.offer(lambda: nav.along(self.value, axis))

    def fill_views(self) -> None:
        """List the views that look through another camera than this one."""
        self.views.clear()
        for view, camera in self._others().items():
            self.views.addAction(view, partial(self.edited.emit, camera))
        if self.views.isEmpty():
            self.views.addAction("No other view has a camera").setEnabled(False)

    def _others(self) -> dict[str, data.Camera]:
        if not isinstance(self.place, Place):
            return {}
        network, found = self.place.session.network, {}
        try:
            mine = shared_place(network, self.place.target)
            for view in views_of(network.flatten(), None):
                for target in subject_of(network, view).cameras[:1]:
                    if shared_place(network, target) != mine:
                        found[view] = links.value_of(network, target)
        except GraphError:
            pass  # what is wrong there, its own node says
        return found

    def copy_json(self) -> None:
        """Put the camera on the clipboard."""
        QGuiApplication.clipboard().setText(json.dumps(self.value.to_json()))

    def paste_json(self) -> None:
        """Take the camera from the clipboard."""
        text = QGuiApplication.clipboard().text()
        self.offer(lambda: camera_of(text))


def camera_of(text: str) -> data.Camera:
    """The camera that JSON describes. Raises ParameterError."""
    try:
        described = json.loads(text)
    except (ValueError, RecursionError):
        raise ParameterError("the clipboard holds no camera; copy one as JSON first") from None
    return data.Camera.from_json(described, "clipboard")
