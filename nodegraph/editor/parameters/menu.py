"""The menu of one parameter."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QMenu

from nodegraph.editor.parameters.place import DERIVABLE

if TYPE_CHECKING:
    from nodegraph.editor.parameters.row import ParameterRow


class ParameterMenu(QMenu):
    """Reset, copy, paste, link, unlink, expression: for one row of the panel. It deletes itself when it closes."""

    def __init__(self, row: ParameterRow) -> None:
        super().__init__(row)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.row = row
        place = row.place
        tie = place.tie()
        reset = self.addAction("Reset to default", row.reset)
        reset.setEnabled(not tie.locked and not place.is_default())
        self.addSeparator()
        self.addAction("Copy value", self._copy)
        paste = self.addAction("Paste value", self._paste)
        paste.setEnabled(not tie.locked and bool(QGuiApplication.clipboard().text()))
        self.addSeparator()
        if tie.kind != "wire":
            self._add_links(tie.source if tie.kind == "variable" else "")
        if place.name in place.node.links:
            self.addAction(f"Unlink from {tie.source}", lambda: row.finish(place.unlink()))
        if place.declared.kind in DERIVABLE and tie.kind != "wire":
            text = "Edit expression" if tie.kind == "expression" else "Expression …"
            self.addAction(text, row.start_expression)

    def _add_links(self, present: str) -> None:
        place = self.row.place
        links = self.addMenu("Link to")
        for name in place.variables():
            action = links.addAction(name, partial(self._link, name))
            action.setCheckable(True)
            action.setChecked(name == present)
            action.setEnabled(name != present)
        if links.actions():
            links.addSeparator()
        fresh = place.fresh_variable()
        links.addAction(f"New variable “{fresh}”", partial(self._link, fresh))

    def _link(self, variable: str) -> None:
        self.row.finish(self.row.place.link(variable))

    def _copy(self) -> None:
        QGuiApplication.clipboard().setText(self.row.place.text())

    def _paste(self) -> None:
        self.row.finish(self.row.place.paste(QGuiApplication.clipboard().text()))
