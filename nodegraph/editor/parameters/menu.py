"""The menu of one parameter."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QAction, QGuiApplication
from PySide6.QtWidgets import QMenu

from nodegraph.editor.parameters.place import DERIVABLE, Tie
from nodegraph.editor.parameters.preset_menu import PresetMenu
from nodegraph.editor.parameters.presets import ELSEWHERE
from nodegraph.errors import GraphError

if TYPE_CHECKING:
    from nodegraph.editor.parameters.row import ParameterRow


class ParameterMenu(QMenu):
    """What can be done with the parameter of one row of the panel. It deletes itself when it closes."""

    def __init__(self, row: ParameterRow) -> None:
        super().__init__(row)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.row = row
        self.place = place = row.place
        tie = place.tie()
        self._offer("Reset to default", place.reset, not tie.locked and not place.is_default())
        self.addSeparator()
        self.addAction("Copy value", partial(self._copy, place.text))
        self.addAction("Copy as Python", partial(self._copy, place.as_python))
        clipboard = QGuiApplication.clipboard().text()
        self._offer("Paste value", partial(place.paste, clipboard), not tie.locked and bool(clipboard))
        if place.declared.kind not in ELSEWHERE and not tie.locked:
            self.addMenu(PresetMenu(place, row.finish, self))
        self.addSeparator()
        if tie.kind != "wire":
            self._add_links(tie)
        if place.declared.kind in DERIVABLE and tie.kind != "wire":
            self.addAction("Edit expression" if tie.kind == "expression" else "Expression …", row.start_expression)
        self._add_face(tie)
        if tie.kind not in ("wire", "expression"):
            self.addSeparator()
            self._add_keys()

    def _offer(self, text: str, act: Callable[[], str], enabled: bool = True, menu: QMenu | None = None) -> QAction:
        """An entry that edits the document and says where it cannot."""
        action = (menu or self).addAction(text, lambda: self.row.finish(act()))
        action.setEnabled(enabled)
        return action

    def _copy(self, text: Callable[[], str]) -> None:
        try:
            QGuiApplication.clipboard().setText(text())
        except GraphError as error:
            self.row.finish(str(error))

    # -- variables, expressions, groups ---------------------------------------------------------------------------

    def _add_links(self, tie: Tie) -> None:
        place, present = self.place, tie.source if tie.kind == "variable" else ""
        links = self.addMenu("Link to")
        for name in place.variables():
            action = self._offer(name, partial(place.link, name), name != present, links)
            action.setCheckable(True)
            action.setChecked(name == present)
        if links.actions():
            links.addSeparator()
        fresh = place.fresh_variable()
        self._offer(f"New variable “{fresh}”", partial(place.link, fresh), menu=links)
        if place.name in place.node.links:
            self._offer(f"Unlink from {tie.source}", place.unlink)

    def _add_face(self, tie: Tie) -> None:
        face = self.place.face()
        if face is None:
            return
        group, shown = face
        if shown:
            self._offer(f"Take off the face of “{group}”", self.place.hide_from_face)
        elif tie.kind != "wire":
            self._offer(f"Show on the face of “{group}”", self.place.show_on_face)

    # -- time -----------------------------------------------------------------------------------------------------

    def _add_keys(self) -> None:
        frame, keys = self.place.session.frame, self.place.keys()
        self._offer(f"{'Replace the' if frame in keys else 'Add a'} key at frame {frame}", self.place.add_key)
        if frame in keys:
            self._offer(f"Remove the key at frame {frame}", self.place.remove_key)
