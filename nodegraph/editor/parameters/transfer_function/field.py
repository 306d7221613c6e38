"""The widget of a transfer function: presets and scales above the plot, the selected key below it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QEvent, QPoint, QSize, Qt, Signal
from PySide6.QtGui import QIcon, QKeyEvent, QShowEvent
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from nodegraph.data import TransferFunction
from nodegraph.editor.parameters.color import ColorPicker, Swatch, to_qcolor
from nodegraph.editor.parameters.field import Field, is_shortcut
from nodegraph.editor.parameters.look import GAP, ROW_HEIGHT, caption, icon, ink
from nodegraph.editor.parameters.numbers import NumberEntry, stepped
from nodegraph.editor.parameters.simple import Options
from nodegraph.editor.parameters.transfer_function import keys
from nodegraph.editor.parameters.transfer_function.axes import SCALES
from nodegraph.editor.parameters.transfer_function.canvas import Canvas
from nodegraph.editor.parameters.transfer_function.histogram import Histogram, HistogramOf
from nodegraph.editor.parameters.transfer_function.presets import Preset, presets, thumbnail
from nodegraph.errors import ParameterError
from nodegraph.params import Float

if TYPE_CHECKING:
    from nodegraph.params import Parameter

_VALUE = Float(0.0, doc="Value of a key.")
_OPACITY = Float(0.0, min=0.0, max=1.0, doc="Opacity of a key.")
_LENGTH = Float(1.0, min=1e-9, doc="Reference length.")


class PresetList(QFrame):
    """A popup with all presets and what they look like."""

    picked = Signal(object)  # Preset

    def __init__(self, offered: list[Preset], parent: QWidget | None = None) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self.list = QListWidget()
        self.list.setFrameShape(QFrame.Shape.NoFrame)
        self.list.setIconSize(QSize(88, 18))
        self.list.setUniformItemSizes(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        for preset in offered:
            unit = f" ({preset.unit})" if preset.unit else ""
            group = f"{preset.group}: " if preset.group else ""
            item = QListWidgetItem(QIcon(thumbnail(preset.value, 88, 18)), f"{group}{preset.name}")
            item.setToolTip(f"{group}{preset.name}{unit or ', over the range of the data'}")
            item.setSizeHint(QSize(240, 26))
            item.setData(Qt.ItemDataRole.UserRole, preset)
            self.list.addItem(item)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.addWidget(self.list)
        self.setFixedSize(288, min(14, max(1, len(offered))) * 26 + 12)
        self.list.itemClicked.connect(self._take)
        self.list.itemActivated.connect(self._take)

    def _take(self, item: QListWidgetItem) -> None:
        if self.isVisible():
            self.hide()
            self.picked.emit(item.data(Qt.ItemDataRole.UserRole))
            self.close()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self.list.currentItem() is not None:
            self._take(self.list.currentItem())
        else:
            super().keyPressEvent(event)


class TransferFunctionField(Field):
    """The editor of a TransferFunction."""

    wide = True

    def __init__(self, declaration: Parameter, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.function: TransferFunction = declaration.default or TransferFunction()
        self.canvas = Canvas()
        self.scale, self.histogram_scale = Options(), Options()
        self.value, self.opacity, self.length = NumberEntry(), NumberEntry(), NumberEntry("mm")
        self.swatch = Swatch()
        self.list: PresetList | None = None
        self.picker: ColorPicker | None = None
        self._fitted = False
        self._arrange()
        self._connect()
        self.source: HistogramOf | None = None
        if place is not None:
            self.source = HistogramOf(place.session, place.path, self)
            self.source.found.connect(self._show_histogram)
        self.show_value(self.function)
        self._show_key()

    def _arrange(self) -> None:
        self.presets = self._button("presets", "Presets")
        self.fit = self._button("fit", "Show all keys and the usual values of the data (Home)")
        self.step = self._button("step", "Make a step of the selected key, or one key of a step")
        self.delete = self._button("bin", "Delete the selected key (Del)")
        for scale in SCALES:
            self.scale.addItem(scale, scale)
        for scale in ("logarithmic", "linear"):
            self.histogram_scale.addItem(scale, scale)
        self.scale.setToolTip("Scale of the opacity")
        self.scale.setAccessibleName("Scale of the opacity")
        self.histogram_scale.setToolTip("Scale of the histogram")
        self.histogram_scale.setAccessibleName("Scale of the histogram")
        top = QHBoxLayout()
        top.setSpacing(4)
        for widget in (self.presets, self.fit):
            top.addWidget(widget)
        top.addStretch(1)
        for name, tip, options in (
            ("opacity", "Scale of the opacity", self.scale),
            ("histogram", "Scale of the histogram", self.histogram_scale),
        ):
            mark = QLabel()
            mark.setPixmap(icon(name, ink(self.palette(), 0.7)).pixmap(16, 16))
            mark.setToolTip(tip)
            options.setFixedWidth(104)
            top.addWidget(mark)
            top.addWidget(options)
            top.addSpacing(2)
        bottom = QHBoxLayout()
        bottom.setSpacing(4)
        self.swatch.setFixedWidth(40)
        self.value.setAccessibleName("Value of the selected key")
        self.opacity.setAccessibleName("Opacity of the selected key")
        for name, entry in (("Value", self.value), ("Opacity", self.opacity)):
            bottom.addWidget(caption(name))
            bottom.addWidget(entry, 1)
        for button in (self.swatch, self.step, self.delete):
            bottom.addWidget(button)
        last = QHBoxLayout()
        last.setSpacing(GAP)
        self.length.setFixedWidth(92)
        self.length.setAccessibleName("Reference length")
        self.length.setToolTip("An opacity is what this length of the material hides.")
        last.addWidget(caption("Opacity is what is hidden by"))
        last.addStretch(1)
        last.addWidget(self.length)
        outer = QVBoxLayout(self)
        outer.setContentsMargins(0, 0, 0, 0)
        outer.setSpacing(4)
        outer.addLayout(top)
        outer.addWidget(self.canvas, 1)
        outer.addLayout(bottom)
        outer.addLayout(last)
        self.setFocusProxy(self.canvas)

    def _connect(self) -> None:
        canvas = self.canvas
        canvas.edited.connect(self.edited)
        canvas.stepped.connect(self.step_to)
        canvas.began.connect(self.began)
        canvas.ended.connect(self.ended)
        canvas.cancelled.connect(self.cancelled)
        canvas.chosen.connect(self._show_key)
        canvas.color_wanted.connect(self.pick_color)
        canvas.installEventFilter(self)
        self.presets.clicked.connect(self.open_presets)
        self.fit.clicked.connect(canvas.fit)
        self.step.clicked.connect(canvas.toggle_step)
        self.delete.clicked.connect(canvas.delete)
        self.scale.activated.connect(lambda index: canvas.set_scale(self.scale.itemData(index)))
        self.histogram_scale.activated.connect(
            lambda index: canvas.set_histogram_scale(self.histogram_scale.itemData(index))
        )
        self.swatch.clicked.connect(
            lambda: self.pick_color(self.swatch.mapToGlobal(QPoint(0, self.swatch.height() + 2)))
        )
        for entry, put, declared in (
            (self.value, self._put_value, _VALUE),
            (self.opacity, self._put_opacity, _OPACITY),
            (self.length, self._put_length, _LENGTH),
        ):
            entry.entered.connect(put)
            entry.misread.connect(self.refused)
            entry.installEventFilter(self)
            entry.stepped.connect(
                lambda notches, e=entry, p=put, d=declared: p(stepped(d, e.value, notches), step=True)
            )

    def _button(self, name: str, tip: str) -> QToolButton:
        button = QToolButton()
        button.setIcon(icon(name, ink(self.palette(), 0.85)))
        button.setFixedSize(ROW_HEIGHT, ROW_HEIGHT)
        button.setAutoRaise(True)
        button.setToolTip(tip)
        button.setAccessibleName(tip)
        return button

    # -- showing ------------------------------------------------------------------------------------------------

    def show_value(self, value: Any) -> None:
        self.function = value
        self.canvas.show_function(value)
        self.length.show_number(value.reference_length)
        self._show_key()
        if not self._fitted:
            self._fitted = True
            self.canvas.fit()
        if self.source is not None:
            self.source.look()

    def _show_histogram(self, histogram: Histogram | None) -> None:
        first = self.canvas.plot.histogram is None
        self.canvas.show_histogram(histogram)
        if first:
            self.canvas.fit()
        self.value.unit = histogram.unit if histogram is not None else ""
        self._show_key()

    def _show_key(self, *_: Any) -> None:
        place = self.canvas.selected
        key = self.function.keys[place] if place is not None and place < len(self.function.keys) else None
        for widget in (self.value, self.opacity, self.swatch, self.step, self.delete):
            widget.setEnabled(key is not None)
        if key is None:
            self.value.clear()
            self.opacity.clear()
            self.swatch.set_color(self.palette().window().color())
            return
        self.value.show_number(key.value)
        self.opacity.show_number(key.opacity)
        self.swatch.set_color(to_qcolor(key.color))

    # -- changing -----------------------------------------------------------------------------------------------

    def open_presets(self) -> None:
        """Open the list of presets."""
        histogram = self.canvas.plot.histogram
        self.list = PresetList(presets(histogram.unit if histogram is not None else ""), self)
        self.list.picked.connect(self._take_preset)
        self.list.destroyed.connect(self._forget_list)
        self.list.move(self.presets.mapToGlobal(QPoint(0, self.presets.height() + 2)))
        self.list.show()
        self.list.list.setFocus()

    def pick_color(self, at: QPoint) -> None:
        """Open the colour picker for the selected key."""
        place = self.canvas.selected
        if place is None:
            return
        self.picker = ColorPicker(self.function.keys[place].color, self)
        self.picker.picked.connect(self._put_color)
        self.picker.pressed.connect(self.began)
        self.picker.released.connect(self.ended)
        self.picker.destroyed.connect(self._forget_picker)
        self.picker.adjustSize()
        self.picker.show_at(at)

    def _forget_list(self) -> None:
        self.list = None

    def _forget_picker(self) -> None:
        self.picker = None

    def _take_preset(self, preset: Preset) -> None:
        histogram = self.canvas.plot.histogram
        low, high = histogram.usual() if histogram is not None else self.function.domain
        self.canvas.select(None)
        self.edited.emit(preset.over(low, high))
        self.canvas.fit()

    def _put_value(self, value: Any, step: bool = False) -> None:
        place = self.canvas.selected
        if place is not None:
            self._offer(lambda: keys.move(self.function, place, float(value), self.function.keys[place].opacity), step)

    def _put_opacity(self, value: Any, step: bool = False) -> None:
        place = self.canvas.selected
        if place is None:
            return
        if not 0.0 <= value <= 1.0:
            self.refused.emit(f"opacity: {value:g} is outside 0..1")
            self._show_key()
            return
        self._offer(lambda: keys.move(self.function, place, self.function.keys[place].value, float(value)), step)

    def _put_length(self, value: Any, step: bool = False) -> None:
        self._offer(lambda: TransferFunction(self.function.keys, value), step)

    def _put_color(self, color: Any) -> None:
        place = self.canvas.selected
        if place is not None and place < len(self.function.keys):
            self.edited.emit(keys.recolor(self.function, place, color))

    def _offer(self, make: Any, step: bool) -> None:
        try:
            function = make()
        except ParameterError as error:
            self.refused.emit(str(error))
            self.show_value(self.function)
            return
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
