"""A view as a dock of the window."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QDockWidget, QWidget

from nodegraph.editor.views.view import ViewWidget

if TYPE_CHECKING:
    from nodegraph.editor.session import Session


class ViewDock(QDockWidget):
    """A view as a dock; its name is the node's, and it closes with the node."""

    def __init__(self, session: Session, node_path: str, parent: QWidget | None = None) -> None:
        super().__init__(node_path, parent)
        self.setObjectName(f"view {node_path}")
        self.view = ViewWidget(session, node_path, self)
        self.setWidget(self.view)
        self.view.gone.connect(self.close)
        session.changed.connect(self._name)

    def _name(self) -> None:
        if self.view.alive:
            self.setWindowTitle(self.view.path)
            self.setObjectName(f"view {self.view.path}")
