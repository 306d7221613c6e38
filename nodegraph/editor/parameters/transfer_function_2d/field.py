"""The widget of a transfer function over value and gradient magnitude: the plane, and the numbers of the selection."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, QPoint
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QVBoxLayout, QWidget

from nodegraph.data import Gaussian, TransferFunction2D, Trapezoid
from nodegraph.data.transfer_function_2d import Area
from nodegraph.editor.parameters.color import ColorPicker, Swatch, open_picker, to_qcolor
from nodegraph.editor.parameters.field import Field, is_shortcut
from nodegraph.editor.parameters.look import GAP, caption
from nodegraph.editor.parameters.numbers import NumberEntry, stepped
from nodegraph.editor.parameters.transfer_function import menus
from nodegraph.editor.parameters.transfer_function.chosen import button
from nodegraph.editor.parameters.transfer_function.histogram import HistogramOf
from nodegraph.editor.parameters.transfer_function_2d import areas
from nodegraph.editor.parameters.transfer_function_2d.canvas import Canvas
from nodegraph.editor.parameters.transfer_function_2d.joint import JointHistogram, count
from nodegraph.errors import ParameterError
from nodegraph.params import Float

if TYPE_CHECKING:
    from nodegraph.params import Parameter

_PLACE = Float(0.0, doc="A value or a magnitude.")
_SHARE = Float(0.0, min=0.0, max=1.0, doc="Opacity or softness of an area.")
_LENGTH = Float(1.0, min=1e-9, doc="Reference length.")

_PAIRS: dict[type[Area], tuple[tuple[str, str], ...]] = {
    Trapezoid: (
        ("Values, bottom", "Least and greatest value at the lower magnitude"),
        ("Values, top", "Least and greatest value at the upper magnitude"),
        ("Gradients", "Lower and upper magnitude"),
    ),
    Gaussian: (
        ("Centre", "Value and magnitude of the middle"),
        ("Deviation", "Standard deviation of the value and of the magnitude"),
    ),
}
"""What the pairs of numbers are that each kind of area begins with."""


class TransferFunction2DField(Field):
    """The editor of a TransferFunction2D."""

    wide = True

    def __init__(self, declaration: Parameter, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.function: TransferFunction2D = declaration.default or TransferFunction2D()
        self.canvas = Canvas()
        self.pairs = [(caption(told), NumberEntry(), NumberEntry()) for told, _ in _PAIRS[Trapezoid]]
        self.opacity, self.softness, self.length = NumberEntry(), NumberEntry(), NumberEntry("mm")
        self.soft = caption("Softness")
        self.swatch = Swatch()
        self.picker: ColorPicker | None = None
        self._fitted = False
        self._arrange()
        self._connect()
        self.source: HistogramOf | None = None
        if place is not None:
            self.source = HistogramOf(place.session, place.path, self, count)
            self.source.found.connect(self._show_histogram)
        self.show_value(self.function)
        self._fitted = False  # what the document has is to be seen whole, before anything is known of the data

    def _arrange(self) -> None:
        self.rectangle = button("rectangle", "Add a rectangle (R, or double-click)")
        self.gaussian = button("gaussian", "Add a Gaussian (G)")
        self.fit = button("fit", "Show all areas and the usual values of the data (Home)")
        self.delete = button("bin", "Delete the selected area (Del)")
        self.histogram = button("histogram", "The histogram")
        top = _line(4, self.rectangle, self.gaussian, self.fit, None, self.histogram)
        grid = QGridLayout()
        grid.setSpacing(4)
        grid.setColumnStretch(1, 1)
        grid.setColumnStretch(2, 1)
        for row, widgets in enumerate(self.pairs):
            for column, widget in enumerate(widgets):
                grid.addWidget(widget, row, column)
        for widget in (*(widget for widgets in self.pairs for widget in widgets), self.soft, self.softness):
            # Nothing moves when another kind of area is selected.
            policy = widget.sizePolicy()
            policy.setRetainSizeWhenHidden(True)
            widget.setSizePolicy(policy)
        widest = self.pairs[0][0]
        widest.setMinimumWidth(widest.sizeHint().width())
        self.opacity.setAccessibleName("Opacity of the selected area")
        self.softness.setAccessibleName("Softness of the selected area")
        self.softness.setToolTip("The share of half the width and height over which the edges fade.")
        self.swatch.setFixedWidth(40)
        self.length.setFixedWidth(100)
        self.length.setAccessibleName("Reference length")
        self.length.setToolTip("An opacity is what this length of the material hides.")
        per = caption("Opacity per")
        per.setToolTip(self.length.toolTip())
        matter = _line(4, caption("Opacity"), self.opacity, self.soft, self.softness)
        last = _line(GAP, self.swatch, self.delete, None, per, self.length)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(4)
        outer.addLayout(top)
        outer.addWidget(self.canvas, 1)
        for layout in (grid, matter, last):
            outer.addLayout(layout)
        self.setFocusProxy(self.canvas)

    def _connect(self) -> None:
        canvas = self.canvas
        canvas.edited.connect(self.edited)
        canvas.stepped.connect(self.step_to)
        canvas.began.connect(self.began)
        canvas.ended.connect(self.ended)
        canvas.cancelled.connect(self.cancelled)
        canvas.chosen.connect(self._show_area)
        canvas.color_wanted.connect(self.pick_color)
        canvas.installEventFilter(self)
        self.rectangle.clicked.connect(lambda: canvas.add_rectangle())
        self.gaussian.clicked.connect(canvas.add_gaussian)
        self.fit.clicked.connect(canvas.fit)
        self.delete.clicked.connect(canvas.delete)
        self.histogram.clicked.connect(
            lambda: menus.histogram(self).popup(self.histogram.mapToGlobal(QPoint(0, self.histogram.height() + 2)))
        )
        self.swatch.clicked.connect(
            lambda: self.pick_color(self.swatch.mapToGlobal(QPoint(0, self.swatch.height() + 2)))
        )
        for row, (_, *entries) in enumerate(self.pairs):
            for end, entry in enumerate(entries):
                self._listen(entry, _PLACE, partial(self._with_end, row, end))
        self._listen(self.opacity, _SHARE, lambda value: self._with("opacity", value))
        self._listen(self.softness, _SHARE, lambda value: self._with("softness", value))
        self._listen(self.length, _LENGTH, lambda value: TransferFunction2D(self.function.areas, value))

    def _listen(self, entry: NumberEntry, declared: Float, make: Callable[[float], TransferFunction2D | None]) -> None:
        """``make`` the function of what is typed into an entry, or stepped by a key in it."""
        entry.entered.connect(lambda value: self._offer(make, value, False))
        entry.stepped.connect(lambda notches: self._offer(make, stepped(declared, entry.value, notches), True))
        entry.misread.connect(self.refused)
        entry.installEventFilter(self)

    # -- showing ------------------------------------------------------------------------------------------------

    def show_value(self, value: Any) -> None:
        self.function = value
        self.canvas.show_function(value)
        self.length.show_number(value.reference_length)
        self._show_area()
        if not self._fitted:
            self._fitted = True
            self.canvas.fit()
        if self.source is not None:
            self.source.look()

    def _show_histogram(self, histogram: JointHistogram | None) -> None:
        first = self.canvas.plot.histogram is None
        self.canvas.show_histogram(histogram)
        if first:
            self.canvas.fit()
        self._show_area()

    def _show_area(self, *_: Any) -> None:
        area = self.canvas.area
        histogram = self.canvas.plot.histogram
        value = histogram.unit if histogram is not None else ""
        slope = f"{value}/mm" if value else ""
        names = _PAIRS[Trapezoid if area is None else type(area)]
        for row, (told, *entries) in enumerate(self.pairs):
            for widget in (told, *entries):
                widget.setVisible(row < len(names))
            if row >= len(names):
                continue
            told.setText(names[row][0])
            for end, entry in enumerate(entries):
                # Pairs of a Gaussian are a value and a magnitude, those of a trapezoid two of a kind.
                entry.unit = slope if (end if isinstance(area, Gaussian) else row == 2) else value
                entry.setToolTip(names[row][1])
                entry.setAccessibleName(f"{names[row][1]}: {('first', 'second')[end]}")
                entry.setEnabled(area is not None)
                entry.clear() if area is None else entry.show_number(_pair(area, row)[end])
        soft = not isinstance(area, Gaussian)
        for widget in (self.soft, self.softness):
            widget.setVisible(soft)
        for widget in (self.opacity, self.softness, self.swatch, self.delete):
            widget.setEnabled(area is not None)
        if area is None:
            self.opacity.clear()
            self.softness.clear()
            self.swatch.set_color(self.palette().window().color())
            return
        self.opacity.show_number(area.opacity)
        self.softness.show_number(getattr(area, "softness", 0.0))
        self.swatch.set_color(to_qcolor(area.color))

    # -- changing -----------------------------------------------------------------------------------------------

    def pick_color(self, at: QPoint) -> None:
        """Open the colour picker for the selected area."""
        area = self.canvas.area
        if area is None:
            return
        open_picker(self, area.color, self._put_color).show_at(at)

    def _put_color(self, color: Any) -> None:
        self._offer(lambda value: self._with("color", value), color, False)

    def _with(self, name: str, value: Any) -> TransferFunction2D | None:
        """The function with something of the selected area changed."""
        place, area = self.canvas.selected, self.canvas.area
        if place is None or area is None:
            return None
        return areas.replaced(self.function, place, area._replace(**{name: value}))

    def _with_end(self, row: int, end: int, value: float) -> TransferFunction2D | None:
        """The function with one number of a pair of the selected area changed."""
        area = self.canvas.area
        if area is None:
            return None
        pair = _pair(area, row)
        return self._with(area._fields[row], (value, pair[1]) if end == 0 else (pair[0], value))

    def _offer(self, make: Callable[[Any], TransferFunction2D | None], value: Any, step: bool) -> None:
        try:
            function = make(value)
        except ParameterError as error:
            self.refused.emit(str(error))
            self.show_value(self.function)
            return
        if function is not None:
            (self.step_to if step else self.edited.emit)(function)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if self.source is not None:
            self.source.resume()

    def leave(self) -> None:
        super().leave()
        if self.source is not None:
            self.source.stop()

    def eventFilter(self, watched: Any, event: QEvent) -> bool:
        if is_shortcut(event) or event.type() == QEvent.Type.FocusOut:
            self.settle()
        return super().eventFilter(watched, event)


def _pair(area: Area, row: int) -> tuple[float, float]:
    """A pair of numbers of an area, in the order of its fields."""
    pair: tuple[float, float] = getattr(area, area._fields[row])
    return pair


def _line(spacing: int, *widgets: QWidget | None) -> QHBoxLayout:
    """Widgets beside each other; None is room that grows."""
    line = QHBoxLayout()
    line.setSpacing(spacing)
    for widget in widgets:
        if widget is None:
            line.addStretch(1)
        else:
            line.addWidget(widget, 1 if isinstance(widget, NumberEntry) and widget.maximumWidth() > 1000 else 0)
    return line
