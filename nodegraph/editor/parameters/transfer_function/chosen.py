"""The numbers and colours of what is chosen in the plot, below it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QEvent, QPoint, Qt, Signal
from PySide6.QtWidgets import QHBoxLayout, QToolButton, QVBoxLayout, QWidget

from nodegraph.editor.parameters.color import Swatch, to_qcolor
from nodegraph.editor.parameters.look import ROW_HEIGHT, caption, icon, ink
from nodegraph.editor.parameters.numbers import NumberEntry, stepped
from nodegraph.editor.parameters.transfer_function import grips, keys
from nodegraph.editor.parameters.transfer_function.bells import Shape, least_width
from nodegraph.editor.parameters.transfer_function.canvas import Canvas
from nodegraph.editor.parameters.transfer_function.grips import Grip, Move
from nodegraph.params import Float

_FREE = Float(0.0, doc="Value of a key.")
_OPACITY = Float(0.0, min=0.0, max=1.0, doc="Opacity of a key.")


class ChosenRow(QWidget):
    """Value, opacity and colour of the one key or bell that is chosen; both colours of a step, the width of a bell.

    color_wanted(grip, point): one of the swatches was clicked; None for all that is chosen.
    """

    color_wanted = Signal(object, QPoint)
    refused = Signal(str)

    def __init__(self, canvas: Canvas, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.canvas = canvas
        self.value, self.opacity, self.width_entry = NumberEntry(), NumberEntry(), NumberEntry()
        self.swatch, self.right = Swatch(), Swatch()
        self.captions = {name: caption(text) for name, text in (("value", "Value"), ("width", "Width"))}
        self.step = button("step", "Split the chosen key into a step, or join its step")
        self.delete = button("bin", "Delete what is chosen (Del)")
        self.numbers, self.looks, self.rest = QWidget(), QWidget(), QHBoxLayout()
        numbers, looks = QHBoxLayout(self.numbers), QHBoxLayout(self.looks)
        layout = QVBoxLayout(self)
        for line in (numbers, looks, self.rest, layout):
            line.setContentsMargins(0, 0, 0, 0)
            line.setSpacing(4)
        layout.addWidget(self.numbers)
        layout.addLayout(self.rest)
        self.rest.addWidget(self.looks)
        self.rest.addStretch(1)
        self.value.setAccessibleName("Value of the chosen key or bell")
        self.opacity.setAccessibleName("Opacity of the chosen key or bell")
        self.width_entry.setAccessibleName("Width of the chosen bell")
        self.width_entry.setToolTip("Standard deviation of the bell")
        for widget, stretch in (
            (self.captions["value"], 0),
            (self.value, 3),
            (self.captions["width"], 0),
            (self.width_entry, 2),
            (caption("Opacity"), 0),
            (self.opacity, 2),
        ):
            numbers.addWidget(widget, stretch)
        for one in (self.swatch, self.right, self.step, self.delete):
            looks.addWidget(one)
        for swatch in (self.swatch, self.right):
            swatch.setFixedWidth(40)
            swatch.clicked.connect(lambda _=False, s=swatch: self._ask(s))
        self.step.clicked.connect(canvas.toggle_step)
        self.delete.clicked.connect(canvas.delete)
        canvas.chosen.connect(self.refresh)
        for entry, put, declared in (
            (self.value, self._put_value, _FREE),
            (self.opacity, self._put_opacity, _OPACITY),
            (self.width_entry, self._put_width, _FREE),
        ):
            entry.setMinimumWidth(38)
            entry.entered.connect(put)
            entry.misread.connect(self.refused)
            entry.stepped.connect(
                lambda notches, e=entry, p=put, d=declared: p(stepped(d, e.value, notches), step=True)
            )
        self.refresh()

    @property
    def entries(self) -> tuple[NumberEntry, ...]:
        return self.value, self.opacity, self.width_entry

    def show_entries(self, on: bool) -> None:
        """Show what is chosen, or only what others put at the end of ``rest``."""
        self.numbers.setVisible(on)
        self.looks.setVisible(on)

    def refresh(self) -> None:
        """Show what is chosen now."""
        canvas = self.canvas
        grip, shape = canvas.current, canvas.shape
        bell = grip is not None and grip.kind == "bell"
        place = canvas.selected
        other = keys.partner(shape.base, place) if place is not None else None
        self.captions["value"].setText("Centre" if bell else "Value")
        for widget in (self.captions["width"], self.width_entry):
            widget.setVisible(bell)
        self.step.setVisible(not bell)
        self.right.setVisible(other is not None)
        for one in (self.value, self.opacity):
            one.setEnabled(grip is not None)
        self.swatch.setEnabled(bool(canvas.plot.chosen))
        self.step.setEnabled(place is not None)
        self.delete.setEnabled(bool(canvas.plot.chosen))
        self.value.unit = canvas.unit
        sides = self._sides()
        self.swatch.setToolTip("Colour left of the step" if other is not None else "Colour")
        self.right.setToolTip("Colour right of the step")
        for swatch, side in zip((self.swatch, self.right), (*sides, None, None), strict=False):
            color = to_qcolor(grips.color(shape, side)) if side is not None else self.palette().window().color()
            swatch.set_color(color)
        if grip is None:
            for entry in self.entries:
                entry.clear()
            if len(canvas.plot.chosen) > 1:
                self.value.setPlaceholderText(f"{len(canvas.plot.chosen)} chosen")
            else:
                self.value.setPlaceholderText("")
            return
        value, up = grips.position(shape, grip)
        self.value.show_number(value)
        self.opacity.show_number(up)
        if bell:
            self.width_entry.show_number(shape.bells[grip.place].width)

    def _sides(self) -> list[Grip]:
        """What the swatches are for: the chosen one, or both halves of its step; of several the first."""
        grip, place = self.canvas.current, self.canvas.selected
        if grip is None:
            return sorted(self.canvas.plot.chosen)[:1]
        other = keys.partner(self.canvas.shape.base, place) if place is not None else None
        return sorted([grip, grips.key(other)]) if other is not None else [grip]

    def _ask(self, swatch: Swatch) -> None:
        sides = self._sides()
        place = 1 if swatch is self.right else 0
        if place < len(sides):
            one = sides[place] if self.canvas.current is not None else None
            self.color_wanted.emit(one, swatch.mapToGlobal(QPoint(0, swatch.height() + 2)))

    def _put_value(self, value: Any, step: bool = False) -> None:
        self._move(lambda old: (float(value), old[1]), step)

    def _put_opacity(self, value: Any, step: bool = False) -> None:
        if not 0.0 <= value <= 1.0:
            self._refuse(f"opacity: {value:g} is outside 0..1")
        else:
            self._move(lambda old: (old[0], float(value)), step)

    def _move(self, to: Callable[[tuple[float, float]], tuple[float, float]], step: bool) -> None:
        grip, shape = self.canvas.current, self.canvas.shape
        if grip is None:
            return
        move = Move(shape, frozenset([grip]), grip, 0.0, self.canvas.plot.scale)
        value, up = to(grips.position(shape, grip))
        if not abs(value) < float("inf"):
            self._refuse(f"value: {value:g} is no finite number")
        elif not self.canvas.offer(lambda: move.to(value, up), step):
            self.refresh()

    def _put_width(self, value: Any, step: bool = False) -> None:
        grip, shape = self.canvas.current, self.canvas.shape
        if grip is None or grip.kind != "bell":
            return
        old = shape.bells[grip.place]
        if not least_width(old.center) <= value < float("inf"):
            self._refuse(f"width: expected a number above 0, got {value:g}")
            return

        def make() -> Shape:
            return shape.with_bell(grip.place, old._replace(width=float(value)))

        self.canvas.offer(make, step)

    def _refuse(self, text: str) -> None:
        self.refused.emit(text)
        self.refresh()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.EnabledChange and self.isEnabled():
            self.refresh()


def button(name: str, tip: str) -> QToolButton:
    """A flat button with one of the icons."""
    made = QToolButton()
    made.setIcon(icon(name, ink(made.palette(), 0.85)))
    made.setFixedSize(ROW_HEIGHT, ROW_HEIGHT)
    made.setAutoRaise(True)
    made.setToolTip(tip)
    made.setAccessibleName(tip)
    made.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return made
