"""The line below a picture: what is known of the place under the cursor, kept up to date and ready to be copied."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QPointF
from PySide6.QtWidgets import QApplication

from nodegraph.editor.views.pick import Pick, pick
from nodegraph.editor.views.status_line import StatusLine

if TYPE_CHECKING:
    from nodegraph.editor.views.view import ViewWidget


class Readout(QObject):
    """Follows the cursor. The picture's own numbers are said at once, the value of the data as soon as it is read."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self.view = view
        self.line = StatusLine(view)
        self._cursor: tuple[int, int] | None = None
        self._found: Pick | None = None
        self._asked = 0
        view.area.hovered.connect(self._hover)

    @property
    def place(self) -> tuple[float, float] | None:
        """The place of the picture area that the cursor is over, or None."""
        if self._cursor is None or self.view.area.picture is None:
            return None
        area = self.view.area
        at = area.target().topLeft() + QPointF(self._cursor[0] + 0.5, self._cursor[1] + 0.5) * area.scale
        return at.x(), at.y()

    def refresh(self) -> None:
        """Say anew what is under the cursor: the picture is another one."""
        self._found = pick(self.view, self._cursor) if self._cursor is not None else None
        self.line.setText(self._found.text() if self._found is not None else "")
        if self._found is not None and self._found.read is not None:
            self._asked += 1
            number, found, read = self._asked, self._found, self._found.read
            self.view.session.work(read, lambda value: self._take(number, found, value), self.line)

    def copy(self) -> bool:
        """Put the line on the clipboard. False where it is empty."""
        text = self.line.text()
        if text:
            QApplication.clipboard().setText(text)
            self.view.session.tell("info", f"copied: {text}", self.view.path)
        return bool(text)

    def _hover(self, pixel: tuple[int, int] | None) -> None:
        self._cursor = pixel
        self.refresh()

    def _take(self, number: int, found: Pick, value: float | None) -> None:
        if number == self._asked and self._found is found and value is not None:
            self.line.setText(found.text(value, self.view.toolbox.labels.text(value)))
