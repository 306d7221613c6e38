"""Which widget shows which kind of parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from PySide6.QtWidgets import QHBoxLayout, QVBoxLayout, QWidget

from nodegraph import params
from nodegraph.editor.parameters.camera import CameraField
from nodegraph.editor.parameters.color import ColorField
from nodegraph.editor.parameters.field import Field
from nodegraph.editor.parameters.look import GAP, LABEL_WIDTH
from nodegraph.editor.parameters.numbers import NumberField, SeedField
from nodegraph.editor.parameters.paths import PathField
from nodegraph.editor.parameters.several import BoxField, IntervalField, MatrixField, VectorField
from nodegraph.editor.parameters.simple import BoolField, ChoiceField, JsonField, Switch, TextField
from nodegraph.editor.parameters.transfer_function.field import TransferFunctionField
from nodegraph.editor.parameters.transfer_function_2d.field import TransferFunction2DField
from nodegraph.editor.parameters.values import LightField, PlaneField

if TYPE_CHECKING:
    from nodegraph.editor.parameters.place import Place

WIDGETS: dict[type[params.Parameter], type[Field]] = {
    params.Float: NumberField,
    params.Int: NumberField,
    params.Seed: SeedField,
    params.Bool: BoolField,
    params.Choice: ChoiceField,
    params.Text: TextField,
    params.File: PathField,
    params.Folder: PathField,
    params.Color: ColorField,
    params.Vector: VectorField,
    params.Interval: IntervalField,
    params.Matrix: MatrixField,
    params.Box: BoxField,
    params.Camera: CameraField,
    params.Light: LightField,
    params.Plane: PlaneField,
    params.TransferFunction: TransferFunctionField,
    params.TransferFunction2D: TransferFunction2DField,
}


def widget_for(declaration: params.Parameter) -> type[Field]:
    """The class of the widget for a declaration: that of its kind, or of the nearest kind it is derived from.

    A kind of a plug-in that is derived from none of ours shows its JSON.
    """
    return next((WIDGETS[kind] for kind in type(declaration).__mro__ if kind in WIDGETS), JsonField)


def make_field(declaration: params.Parameter, place: Place | None = None) -> Field:
    """The widget for a declaration, with a switch in front where the value may be none at all."""
    made = OptionalField if getattr(declaration, "optional", False) else widget_for(declaration)
    return made(declaration, place)


class OptionalField(Field):
    """A value that may be missing: a switch, and below it the widget of the value while there is one."""

    wide = True

    def __init__(self, declaration: Any, place: Place | None = None, parent: QWidget | None = None) -> None:
        super().__init__(declaration, place, parent)
        self.given = Switch()
        self.given.setAccessibleName(f"{declaration.name}: given")
        self.given.setToolTip("Off: none.")
        self.given.clicked.connect(lambda on: self.edited.emit(declaration.value_type() if on else None))
        self.inner = widget_for(declaration)(declaration, place)
        for signal in ("edited", "began", "ended", "cancelled", "refused"):
            getattr(self.inner, signal).connect(getattr(self, signal))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        line = QHBoxLayout()
        line.addSpacing(LABEL_WIDTH + GAP)
        line.addWidget(self.given)
        line.addStretch(1)
        layout.addLayout(line)
        layout.addWidget(self.inner)
        self.setFocusProxy(self.given)

    def show_value(self, value: Any) -> None:
        self.given.setChecked(value is not None)
        self.inner.setVisible(value is not None)
        if value is not None:
            self.inner.show_value(value)
