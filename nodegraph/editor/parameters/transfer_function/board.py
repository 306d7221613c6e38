"""The plot as a widget: what is shown, what is chosen, and which part of the values is seen. It changes nothing."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from PySide6.QtCore import QPointF, Signal
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from nodegraph.data import TransferFunction
from nodegraph.editor.parameters.function_board import FunctionBoard
from nodegraph.editor.parameters.transfer_function import grips, keys
from nodegraph.editor.parameters.transfer_function.bells import Shape
from nodegraph.editor.parameters.transfer_function.grips import Grip
from nodegraph.editor.parameters.transfer_function.histogram import Histogram
from nodegraph.editor.parameters.transfer_function.plot import Plot


class Board(FunctionBoard):
    """Shows a shape over a histogram. ``chosen()`` says that other keys or bells are chosen."""

    chosen = Signal()
    plot: Plot

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__("Transfer function", 216, parent)
        self.plot = Plot()
        self._aside = False  # whether the readout is told at the left, away from the mouse

    # -- what is shown ------------------------------------------------------------------------------------------

    @property
    def shape(self) -> Shape:
        return self.plot.shape

    @property
    def function(self) -> TransferFunction:
        return self.plot.function

    @property
    def unit(self) -> str:
        return self.plot.histogram.unit if self.plot.histogram is not None else ""

    def show_shape(self, shape: Shape) -> None:
        if shape == self.plot.shape:
            return
        before = self.plot.chosen
        self.plot.show(shape)
        if self.plot.chosen != before:
            self.chosen.emit()
        self.update()

    def show_function(self, function: TransferFunction) -> None:
        """Show a function of keys alone."""
        self.show_shape(Shape(function))

    def show_histogram(self, histogram: Histogram | None) -> None:
        self.plot.histogram = histogram
        self.update()

    def set_scale(self, scale: str) -> None:
        """The scale of the opacity: "linear", "power" or "logarithmic"."""
        self.plot.scale = scale
        self.update()

    def set_histogram_scale(self, scale: str) -> None:
        """The scale of the histogram: "linear" or "logarithmic"."""
        self.plot.histogram_scale = scale
        self.update()

    def show_band(self, band: tuple[float, float] | None) -> None:
        """Mark a range of values."""
        if band != self.plot.band:
            self.plot.band = band
            self.update()

    # -- what is chosen -----------------------------------------------------------------------------------------

    @property
    def current(self) -> Grip | None:
        """The one key or bell that is chosen."""
        return next(iter(self.plot.chosen)) if len(self.plot.chosen) == 1 else None

    @property
    def selected(self) -> int | None:
        """Place of the one key that is chosen."""
        current = self.current
        return current.place if current is not None and current.kind == "key" else None

    def select(self, place: int | None) -> None:
        """Choose one key, or nothing."""
        self.choose([grips.key(place)] if place is not None else [])

    def choose(self, wanted: Iterable[Grip]) -> None:
        """Choose keys and bells."""
        chosen = grips.there(self.shape, wanted)
        if chosen != self.plot.chosen:
            self.plot.chosen = chosen
            self.chosen.emit()
            self.update()

    def choose_all(self) -> None:
        """Choose all keys and bells."""
        self.choose(grips.every(self.shape))

    def step_choice(self, by: int) -> None:
        """Choose the next key or bell, or the one before."""
        order = grips.in_order(self.shape)
        if order:
            here = [place for place, grip in enumerate(order) if grip in self.plot.chosen]
            place = (here[-1 if by > 0 else 0] + by) if here else 0 if by > 0 else len(order) - 1
            self.choose([order[min(len(order) - 1, max(0, place))]])

    # -- which values are seen ----------------------------------------------------------------------------------

    def fit(self) -> None:
        """Show all keys and the usual values of the data."""
        self._show([*self._key_ends(), *self._data_ends()])

    def fit_data(self) -> None:
        """Show the usual values of the data."""
        self._show(self._data_ends() or self._key_ends())

    def fit_keys(self) -> None:
        """Show all keys and bells."""
        self._show(self._key_ends() or self._data_ends())

    def zoom(self, factor: float, x: float | None = None) -> None:
        """Show less of the values, or with a factor below 1 more; what is at a place of the widget stays there."""
        middle = self.plot.area.center().x() if x is None else x
        self.plot.axis.zoom(factor, self.plot.value(middle))
        self.update()

    def pan(self, pixels: float) -> None:
        """Move the values to the right."""
        self.plot.axis.pan(self.plot.value(0.0) - self.plot.value(pixels))
        self.update()

    def _show(self, ends: list[float]) -> None:
        low, high = (min(ends), max(ends)) if ends else (0.0, 1.0)
        self.plot.axis.show(low, high, 0.03)
        self.update()

    def _key_ends(self) -> list[float]:
        return list(self.function.domain) if self.function.keys else []

    def _data_ends(self) -> list[float]:
        return list(self.plot.histogram.usual()) if self.plot.histogram is not None else []

    def place_of(self, place: int) -> QPointF:
        """Where a key lies on this widget."""
        return self.plot.at(grips.key(place))

    # -- drawing ------------------------------------------------------------------------------------------------

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        self.plot.draw(painter, self.palette(), self.isEnabled())
        if self.readout:
            self.draw_readout(painter, self._aside)
        elif not self.function.keys:
            self.draw_hint(painter, "Double-click to add a key")

    def read(self, point: QPointF, held: Grip | None = None) -> None:
        """Say which value the mouse is at, or value and opacity of what it holds, and what that caught on."""
        self._aside = point.x() > self.plot.area.center().x()
        unit = f" {self.unit}" if self.unit else ""
        grip = held if held is not None else self.plot.hovered
        if grip is not None and grips.there(self.shape, [grip]):
            value, up = grips.position(self.shape, grip)
            caught = ", ".join(guide.what for guide in self.plot.guides if guide is not None and guide.what)
            self.readout = f"{value:.6g}{unit}, {keys.legible(up)}" + (f"  ({caught})" if caught else "")
        elif self.plot.area.contains(point):
            self.readout = f"{self.plot.rounded(point.x()):.6g}{unit}"
        else:
            self.readout = ""

    def changeEvent(self, event: Any) -> None:
        super().changeEvent(event)
        self.update()
