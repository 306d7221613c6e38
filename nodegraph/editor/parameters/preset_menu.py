"""The menu of the presets of one parameter: choose, save, delete."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QInputDialog, QMenu, QWidget

from nodegraph.editor.parameters import presets
from nodegraph.editor.parameters.place import Place
from nodegraph.editor.parameters.presets import Preset
from nodegraph.errors import GraphError


class PresetMenu(QMenu):
    """Reads what there is when it opens. ``finish`` is told after a choice why it was refused, or an empty text."""

    def __init__(self, place: Place, finish: Callable[[str], object], parent: QWidget) -> None:
        super().__init__("Presets", parent)
        self.place = place
        self.finish = finish
        self.aboutToShow.connect(self.fill)
        self.fill()

    def fill(self) -> None:
        """List the presets that suit."""
        self.clear()
        found = presets.presets_for(self.place)
        for preset in found:
            self.addAction(preset.name, partial(self._choose, preset))
        if found:
            self.addSeparator()
        self.addAction("Save as a preset …", self.ask_name)
        own = [preset for preset in found if preset.file is not None]
        if own:
            delete = self.addMenu("Delete")
            for preset in own:
                delete.addAction(preset.name, partial(self._drop, preset))

    def ask_name(self) -> QInputDialog:
        """Ask for a name beside the window; the menu is gone when it is answered."""
        parent = self.parentWidget()
        dialog = QInputDialog(parent.window() if parent is not None else None)
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.setWindowTitle("Save as a preset")
        dialog.setLabelText("Name")
        dialog.textValueSelected.connect(partial(save, self.place))
        dialog.open()
        return dialog

    def _choose(self, preset: Preset) -> None:
        self.finish(self.place.set(preset.value))

    def _drop(self, preset: Preset) -> None:
        try:
            presets.drop(preset)
        except OSError as error:
            self.finish(f"{preset.name}: {error.strerror or error}")


def save(place: Place, name: str) -> None:
    """Save the value of a parameter as a preset; without a name nothing is saved."""
    if not name.strip():
        return
    try:
        presets.keep(place, name.strip())
    except OSError as error:
        place.session.tell("error", f"the preset was not saved: {error.strerror or error}", place.path)
    except GraphError as error:
        place.session.tell("error", f"the preset was not saved: {error}", place.path)
