"""The menus behind the buttons of the transfer-function editors. Each deletes itself when it closes."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMenu, QWidget

from nodegraph.editor.parameters.function_board import ZOOM
from nodegraph.editor.parameters.transfer_function.axes import SCALES

if TYPE_CHECKING:
    from nodegraph.editor.parameters.transfer_function.field import TransferFunctionField
    from nodegraph.editor.parameters.transfer_function_2d.field import TransferFunction2DField


def tools(field: TransferFunctionField) -> QMenu:
    """What can be done with keys and bells."""
    menu = field.canvas.menu()
    menu.addAction("Turn bells into keys", field.bake).setEnabled(bool(field.canvas.shape.bells))
    return menu


def fit(field: TransferFunctionField) -> QMenu:
    """Which values are seen."""
    menu, canvas = _menu(field), field.canvas
    menu.addAction("Keys and data\tHome", canvas.fit)
    menu.addAction("Fit to the data", canvas.fit_data).setEnabled(canvas.plot.histogram is not None)
    menu.addAction("Fit to the keys", canvas.fit_keys).setEnabled(bool(canvas.function.keys))
    menu.addSeparator()
    menu.addAction("Zoom in\t+", partial(canvas.zoom, ZOOM))
    menu.addAction("Zoom out\t-", partial(canvas.zoom, 1.0 / ZOOM))
    return menu


def scale(field: TransferFunctionField) -> QMenu:
    """The scale of the opacity."""
    menu, canvas = _menu(field), field.canvas
    for name in SCALES:
        action = menu.addAction(f"Opacity {name}", partial(canvas.set_scale, name))
        action.setCheckable(True)
        action.setChecked(name == canvas.plot.scale)
    return menu


def histogram(field: TransferFunctionField | TransferFunction2DField) -> QMenu:
    """The scale of the histogram, and of what it is."""
    menu, canvas, source = _menu(field), field.canvas, field.source
    for name in ("logarithmic", "linear"):
        action = menu.addAction(f"Counts {name}", partial(canvas.set_histogram_scale, name))
        action.setCheckable(True)
        action.setChecked(name == canvas.plot.histogram_scale)
    if source is not None:
        menu.addSeparator()
        action = menu.addAction("Of the crop alone")
        action.setCheckable(True)
        action.setChecked(source.cropped)
        action.setEnabled(source.crop() is not None)
        action.toggled.connect(source.set_cropped)
    return menu


def _menu(field: QWidget) -> QMenu:
    menu = QMenu(field)
    menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    return menu
