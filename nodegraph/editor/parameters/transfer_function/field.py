"""The widget of a transfer function: tools above the plot, what is chosen below it; or a table of labels."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, QPoint
from PySide6.QtGui import QShowEvent
from PySide6.QtWidgets import QFileDialog, QHBoxLayout, QToolButton, QVBoxLayout, QWidget

from nodegraph.data import TransferFunction
from nodegraph.editor.instead import decided_with
from nodegraph.editor.parameters.color import ColorPicker, open_picker
from nodegraph.editor.parameters.field import Field, is_shortcut
from nodegraph.editor.parameters.look import caption
from nodegraph.editor.parameters.numbers import NumberEntry, stepped
from nodegraph.editor.parameters.transfer_function import grips, menus, presets, remembered
from nodegraph.editor.parameters.transfer_function.bells import Shape
from nodegraph.editor.parameters.transfer_function.canvas import Canvas
from nodegraph.editor.parameters.transfer_function.chosen import ChosenRow, button
from nodegraph.editor.parameters.transfer_function.grips import Grip
from nodegraph.editor.parameters.transfer_function.highlight import highlight
from nodegraph.editor.parameters.transfer_function.histogram import Histogram, HistogramOf
from nodegraph.editor.parameters.transfer_function.label_table import LabelTable
from nodegraph.editor.parameters.transfer_function.preset_list import PresetList, json_name
from nodegraph.editor.parameters.transfer_function.presets import Preset
from nodegraph.errors import GraphError, ParameterError
from nodegraph.params import Float

if TYPE_CHECKING:
    from nodegraph.editor.parameters.place import Place
    from nodegraph.params import Parameter

_LENGTH = Float(1.0, min=1e-9, doc="Reference length.")
MOST_KEYS = 64
"""Functions with more keys than that are no places to catch on."""


class TransferFunctionField(Field):
    """The editor of a TransferFunction."""

    wide = True

    def __init__(self, declaration: Parameter, place: Place | None = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.function: TransferFunction = declaration.default or TransferFunction()
        self.canvas = Canvas()
        self.row = ChosenRow(self.canvas)
        self.length = NumberEntry("mm")
        self.table = LabelTable(place)
        self.list: PresetList | None = None
        self.picker: ColorPicker | None = None
        self._painted: frozenset[Grip] = frozenset()
        self._fitted = False
        self._putting = False
        self.source: HistogramOf | None = None
        if place is not None:
            self.source = HistogramOf(place.session, place.path, self)
            self.source.found.connect(self._show_histogram)
            place.session.changed.connect(self._follow)
        self._arrange()
        self._connect()
        self.show_value(self.function)
        self._fitted = False  # what the document has is to be seen whole, before anything is known of the data

    @property
    def value(self) -> NumberEntry:
        return self.row.value

    @property
    def opacity(self) -> NumberEntry:
        return self.row.opacity

    @property
    def step(self) -> QToolButton:
        return self.row.step

    @property
    def delete(self) -> QToolButton:
        return self.row.delete

    def _arrange(self) -> None:
        self.presets = button("presets", "Presets and colour maps")
        self.bell = button("bell", "Add a bell (B)")
        self.tools = button("tools", "What can be done with keys and bells")
        self.fit = button("fit", "Which values are seen")
        self.labels = button("table", "A row for each whole number: for labels")
        self.labels.setCheckable(True)
        self.show_me = button("show", "Show in the views what has the values under the mouse (or hold Space)")
        self.show_me.setCheckable(True)
        self.scale = button("opacity", "Scale of the opacity")
        self.histogram_scale = button("histogram", "The histogram")
        top = QHBoxLayout()
        top.setSpacing(4)
        for widget in (self.presets, self.bell, self.tools, self.fit):
            top.addWidget(widget)
        top.addStretch(1)
        for widget in (self.labels, self.show_me, self.scale, self.histogram_scale):
            top.addWidget(widget)
        self.length.setFixedWidth(100)
        self.length.setAccessibleName("Reference length")
        self.length.setToolTip("An opacity is what this length of the material hides.")
        per = caption("Opacity per")
        per.setToolTip(self.length.toolTip())
        last = QHBoxLayout()
        last.setContentsMargins(0, 0, 0, 0)
        last.setSpacing(6)
        last.addWidget(per)
        last.addWidget(self.length)
        self.row.rest.addLayout(last)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(4)
        outer.addLayout(top)
        outer.addWidget(self.canvas, 1)
        outer.addWidget(self.table, 1)
        outer.addWidget(self.row)
        self.table.hide()
        self.labels.hide()
        self.show_me.setVisible(self.place is not None)
        self.setFocusProxy(self.canvas)

    def _connect(self) -> None:
        canvas = self.canvas
        canvas.other_values = self._other_values
        canvas.edited.connect(self.put)
        canvas.stepped.connect(partial(self.put, step=True))
        canvas.began.connect(self.began)
        canvas.ended.connect(self.ended)
        canvas.cancelled.connect(self.cancelled)
        canvas.color_wanted.connect(lambda at: self.pick_color(at))
        canvas.pointed.connect(self._point)
        canvas.refused.connect(self.refused)
        canvas.installEventFilter(self)
        self.row.color_wanted.connect(lambda grip, at: self.pick_color(at, grip))
        self.row.refused.connect(self.refused)
        self.table.edited.connect(lambda function: self.put(Shape(function)))
        self.table.began.connect(self.began)
        self.table.ended.connect(self.ended)
        self.presets.clicked.connect(self.open_presets)
        self.bell.clicked.connect(lambda: canvas.add_bell())
        self.labels.toggled.connect(self.show_labels)
        self.show_me.toggled.connect(canvas.set_pointing)
        for one, fill in (
            (self.tools, menus.tools),
            (self.fit, menus.fit),
            (self.scale, menus.scale),
            (self.histogram_scale, menus.histogram),
        ):
            one.clicked.connect(lambda _=False, b=one, f=fill: f(self).popup(b.mapToGlobal(QPoint(0, b.height() + 2))))
        for entry in (*self.row.entries, self.length):
            entry.installEventFilter(self)
        self.length.entered.connect(self._put_length)
        self.length.misread.connect(self.refused)
        self.length.stepped.connect(
            lambda notches: self._put_length(stepped(_LENGTH, self.length.value, notches), step=True)
        )

    # -- showing ------------------------------------------------------------------------------------------------

    def show_value(self, value: Any) -> None:
        self.function = value
        loose = self.place is None and value == self.canvas.function
        self.canvas.show_shape(self.canvas.shape if loose else remembered.recall(self.place, value))
        self.length.show_number(value.reference_length)
        self.row.refresh()
        self.table.show_function(value)
        if not self._fitted:
            self._fitted = True
            self.canvas.fit()
        if self.source is not None:
            self.source.look()

    def show_labels(self, on: bool) -> None:
        """Show the table of labels, or the plot."""
        self.table.setVisible(on)
        self.canvas.setVisible(not on)
        self.row.show_entries(not on)
        for one in (self.bell, self.tools, self.fit, self.show_me, self.scale, self.histogram_scale):
            one.setEnabled(not on)
        if self.labels.isChecked() != on:
            self.labels.setChecked(on)
        if on:
            self.show_me.setChecked(False)

    def _show_histogram(self, histogram: Histogram | None) -> None:
        first = self.canvas.plot.histogram is None
        self.canvas.show_histogram(histogram)
        if first:
            self.canvas.fit()
        self.row.refresh()
        self.table.show_ids(histogram.ids if histogram is not None else {})
        self.labels.setVisible(bool(self.table.ids))
        if not self.table.ids:
            self.show_labels(False)

    def _follow(self, commands: Any) -> None:
        """What is remembered of bells and labels may have changed while the function stayed as it was."""
        there = self.place is not None and self.place.path in self.place.session.network
        if (
            there
            and not self._putting
            and any(getattr(command, "key", "") in (remembered.KEY, self.table.KEY) for command in commands)
        ):
            self.show_value(self.function)

    # -- changing -----------------------------------------------------------------------------------------------

    def put(self, shape: Shape, step: bool = False) -> None:
        """Let the document have a shape: its keys as the value, its bells in the ``ui``, in one step."""
        place, function = self.place, shape.function
        noted = remembered.note(place, shape) if place is not None else None
        if place is None:
            self.canvas.show_shape(shape)
        if noted is None or place is None:
            (self.step_to if step else self.edited.emit)(function)
            return
        session = place.session
        if step and not self._burst.isActive():
            self.began.emit()
        if step:
            self._burst.start()
        self._putting = True
        try:
            with session.gesture(f"set {place.name}"):
                session.do(noted)  # first, so that who sees the new keys knows the bells in them
                self.edited.emit(function)
        finally:
            self._putting = False
        if self.canvas.shape != shape:  # the function is as it was, and nobody was told
            self.show_value(self.function)

    def open_presets(self) -> None:
        """Open the list of presets."""
        self.list = PresetList(self.canvas.shape, self.canvas.unit, self)
        self.list.picked.connect(self.take_preset)
        self.list.import_wanted.connect(self.import_file)
        self.list.export_wanted.connect(self.export_file)
        self.list.refused.connect(self.refused)
        self.list.destroyed.connect(self._forget_list)
        self.list.move(self.presets.mapToGlobal(QPoint(0, self.presets.height() + 2)))
        self.list.show()
        self.list.list.setFocus()

    def take_preset(self, preset: Preset, colors: bool = False) -> None:
        """Use a preset, or its colours alone."""
        histogram, shape = self.canvas.plot.histogram, self.canvas.shape
        low, high = histogram.usual() if histogram is not None else self.function.domain
        if not colors:
            self.canvas.choose([])
            self.put(preset.over(low, high))
            self.canvas.fit()
            return
        if not shape.function.keys:
            shape = Shape(preset.over(low, high).function)
        by_value = preset.over(*shape.function.domain).function
        self.put(grips.painted(shape, by_value))

    def import_file(self) -> None:
        """Ask for a JSON file and use the function in it."""
        name, _ = QFileDialog.getOpenFileName(self, "Read a transfer function", "", "JSON (*.json)")
        if name:
            try:
                self.take_preset(presets.load(Path(name)))
            except GraphError as error:
                self.refused.emit(str(error))

    def export_file(self) -> None:
        """Ask for a JSON file and write the function to it."""
        name, _ = QFileDialog.getSaveFileName(self, "Write the transfer function", "", "JSON (*.json)")
        if name:
            file, shape = json_name(name), self.canvas.shape
            try:
                presets.write(Preset(file.stem, "", self.canvas.unit, False, shape.function, shape=shape), file)
            except OSError as error:
                self.refused.emit(f"{file}: could not be written: {error.strerror or error}")

    def bake(self) -> None:
        """Forget that some keys are bells: from now on each can be moved."""
        self.canvas.choose([])
        self.put(Shape(self.canvas.function))

    def pick_color(self, at: QPoint, grip: Grip | None = None) -> None:
        """Open the colour picker for what is chosen, or for one key or bell."""
        self._painted = frozenset([grip]) if grip is not None else self.canvas.plot.chosen
        if not self._painted:
            return
        open_picker(self, grips.color(self.canvas.shape, min(self._painted)), self._put_color).show_at(at)

    def _forget_list(self) -> None:
        self.list = None

    def _put_color(self, color: Any) -> None:
        painted = grips.there(self.canvas.shape, self._painted)
        if painted:
            self.put(grips.recolor(self.canvas.shape, painted, color))

    def _put_length(self, value: Any, step: bool = False) -> None:
        shape = self.canvas.shape
        self._offer(lambda: Shape(TransferFunction(shape.base.keys, value), shape.bells), step)

    def _offer(self, make: Callable[[], Shape], step: bool) -> None:
        try:
            shape = make()
        except ParameterError as error:
            self.refused.emit(str(error))
            self.show_value(self.function)
            return
        self.put(shape, step)

    # -- what the rest of the document has to do with it ------------------------------------------------------------

    def _point(self, band: tuple[float, float] | None) -> None:
        """Let the views show which parts have the values of a range, or the document again."""
        if self.place is not None:
            which = decided_with(self.place.node, self.place.name) if band is not None else []
            shown = highlight(self.function, *band) if band is not None else None
            self.place.session.show_instead(dict.fromkeys(which, shown))

    def _other_values(self) -> Iterator[float]:
        """Where other functions of the document have keys."""
        if self.place is None:
            return
        own = set(decided_with(self.place.node, self.place.name))
        for path, node in self.place.session.network.flatten().nodes.items():
            for name, value in node.values.items():
                if isinstance(value, TransferFunction) and (path, name) not in own and len(value.keys) <= MOST_KEYS:
                    yield from (key.value for key in value.keys)

    def showEvent(self, event: QShowEvent) -> None:
        super().showEvent(event)
        if self.source is not None:
            self.source.resume()

    def leave(self) -> None:
        super().leave()
        self._stop_pointing()
        if self.source is not None:
            self.source.stop()

    def hideEvent(self, event: Any) -> None:
        self._stop_pointing()
        super().hideEvent(event)

    def _stop_pointing(self) -> None:
        if self.canvas.plot.band is not None:
            self.canvas.show_band(None)
            self._point(None)

    def eventFilter(self, watched: Any, event: QEvent) -> bool:
        if is_shortcut(event) or event.type() == QEvent.Type.FocusOut:
            self.settle()
        return super().eventFilter(watched, event)
