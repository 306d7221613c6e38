"""Light, Plane, and what Camera shares with them: values made of several parts, each with an entry of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLabel, QPushButton, QWidget

from nodegraph import data
from nodegraph.editor.parameters.color import ColorField
from nodegraph.editor.parameters.field import Field, is_shortcut
from nodegraph.editor.parameters.look import GAP, LABEL_WIDTH, ROW_HEIGHT, caption
from nodegraph.editor.parameters.numbers import NumberEntry, NumberField, stepped
from nodegraph.editor.parameters.place import Place
from nodegraph.editor.parameters.simple import ChoiceField
from nodegraph.errors import GraphError
from nodegraph.params import Choice, Color, Float, Parameter


class Parts(Field):
    """A field made of rows, each for one attribute of an immutable value."""

    wide = True

    def __init__(self, declaration: Parameter, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.value: Any = declaration.default
        self.rows = QGridLayout(self)
        self.rows.setContentsMargins(0, 0, 0, 0)
        self.rows.setHorizontalSpacing(GAP)
        self.rows.setVerticalSpacing(4)
        self.rows.setColumnStretch(1, 1)
        self.captions: dict[str, QLabel] = {}
        self.fields: dict[str, Field] = {}
        self.vectors: dict[str, list[NumberEntry]] = {}

    def add_row(self, name: str, text: str, widget: QWidget | QHBoxLayout) -> None:
        label = caption(text)
        label.setFixedSize(LABEL_WIDTH, ROW_HEIGHT)
        label.setIndent(12)
        self.captions[name] = label
        row = self.rows.rowCount()
        self.rows.addWidget(label, row, 0)
        if isinstance(widget, QWidget):
            self.rows.addWidget(widget, row, 1)
        else:
            self.rows.addLayout(widget, row, 1)

    def add_field(self, name: str, text: str, field: Field) -> None:
        """A row whose widget is that of another kind."""
        field.edited.connect(lambda value: self._replace(name, value))
        for signal in ("began", "ended", "cancelled", "refused"):
            getattr(field, signal).connect(getattr(self, signal))
        self.fields[name] = field
        self.add_row(name, text, field)

    def add_vector(self, name: str, text: str, unit: str = "") -> None:
        """A row of three numbers."""
        line = QHBoxLayout()
        line.setSpacing(4)
        self.vectors[name] = []
        for place, axis in enumerate("xyz"):
            entry = NumberEntry()
            entry.setAccessibleName(f"{text} {axis}")
            entry.entered.connect(lambda value, place=place: self._replace_number(name, place, value))
            entry.stepped.connect(lambda notches, place=place: self._step(name, place, notches))
            entry.misread.connect(self.refused)
            entry.installEventFilter(self)
            self.vectors[name].append(entry)
            line.addWidget(entry)
        self.add_row(name, f"{text}, {unit}" if unit else text, line)

    def show_value(self, value: Any) -> None:
        self.value = value
        if value is None:
            return
        for name, field in self.fields.items():
            field.show_value(getattr(value, name))
        for name, entries in self.vectors.items():
            for entry, number in zip(entries, getattr(value, name), strict=True):
                entry.show_number(number)

    def offer(self, make: Callable[[], Any], step: bool = False) -> None:
        """Report the value that ``make`` makes, or why there is none."""
        try:
            value = make()
        except GraphError as error:
            self.refused.emit(str(error))
            self.show_value(self.value)
            return
        (self.step_to if step else self.edited.emit)(value)

    def changed(self, **attributes: Any) -> Any:
        """The value with other attributes."""
        return type(self.value)(**{**self.value.to_json(), **attributes}, where=self.declaration.name or "value")

    def _replace(self, name: str, value: Any) -> None:
        self.offer(lambda: self.changed(**{name: value}))

    def _replace_number(self, name: str, place: int, value: Any, step: bool = False) -> None:
        numbers = list(getattr(self.value, name))
        numbers[place] = value
        self.offer(lambda: self.changed(**{name: numbers}), step)

    def _step(self, name: str, place: int, notches: float) -> None:
        self._replace_number(name, place, stepped(_FREE, getattr(self.value, name)[place], notches), step=True)

    def eventFilter(self, watched: Any, event: QEvent) -> bool:
        if is_shortcut(event) or event.type() == QEvent.Type.FocusOut:
            self.settle()
        return super().eventFilter(watched, event)

    def show_row(self, name: str, visible: bool) -> None:
        """Show or hide the row of an attribute."""
        self.captions[name].setVisible(visible)
        for widget in (self.fields.get(name), *self.vectors.get(name, ())):
            if widget is not None:
                widget.setVisible(visible)


_FREE = Float(0.0, doc="A number without limits.")


class LightField(Parts):
    """Kind of lamp, what it is fixed to, where it is, its colour and intensity."""

    def __init__(self, declaration: Parameter, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.add_field("type", "Lamp", ChoiceField(Choice(*data.light.KINDS, doc="Kind of lamp.")))
        self.add_field("frame", "Fixed to", ChoiceField(Choice(*data.light.FRAMES, doc="What it is fixed to.")))
        self.add_vector("position", "From")
        self.add_field("color", "Colour", ColorField(Color((1.0, 1.0, 1.0), max=None, doc="Colour.")))
        intensity = Float(1.0, min=0.0, soft_max=2.0, doc="Intensity.")
        self.add_field("intensity", "Intensity", NumberField(intensity))

    def show_value(self, value: Any) -> None:
        super().show_value(value)
        if value is not None:
            self.captions["position"].setText("From, mm" if value.type == "point" else "From")


class PlaneField(Parts):
    """A point of the plane, its normal, the three planes of the patient, and the middle of the volume."""

    def __init__(self, declaration: Parameter, place: Any = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.buttons: dict[str, QPushButton] = {}
        line = QHBoxLayout()
        line.setSpacing(4)
        for name, normal in (("Axial", (0, 0, -1)), ("Coronal", (0, -1, 0)), ("Sagittal", (1, 0, 0))):
            button = QPushButton(name)
            button.setFixedHeight(ROW_HEIGHT)
            button.clicked.connect(
                lambda _=False, n=normal: self.offer(lambda: self.changed(normal=[float(part) for part in n]))
            )
            self.buttons[name] = button
            line.addWidget(button)
        if isinstance(self.place, Place):
            button = self.buttons["Centre"] = QPushButton("Centre")
            button.setFixedHeight(ROW_HEIGHT)
            button.setToolTip("Through the middle of the volume")
            button.clicked.connect(self._centre)
            line.addWidget(button)
        self.rows.addLayout(line, self.rows.rowCount(), 0, 1, 2)
        self.add_vector("origin", "Through", "mm")
        self.add_vector("normal", "Normal")

    def _centre(self) -> None:
        volume = self.place.volume() if self.place is not None else None
        if volume is None:
            self.refused.emit("the volume is not known yet; show a view of it first")
        else:
            self.offer(lambda: self.changed(origin=[float(f"{part:.9g}") for part in volume.centre]))
