"""A small picture of a file and a line on its nature, made beside the window."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtGui import QPixmap
from PySide6.QtWidgets import QBoxLayout, QLabel, QSizePolicy, QWidget
from shiboken6 import isValid

from nodegraph.editor.parameters.file_look import Look, look_at
from nodegraph.editor.parameters.look import GAP, caption, complaint

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

SMALL = 56
LARGE = 176
WAIT = 120
"""Milliseconds that a path must stay before its file is opened: who goes through a list opens none but the last."""


class FilePreview(QWidget):
    """Shows what ``find`` finds. ``tall``: the picture above the text, as beside a list of files."""

    def __init__(
        self,
        session: Session,
        find: Callable[[Path], Look] = look_at,
        tall: bool = False,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.finder = find
        self.session = session
        self.found = Look()
        self._path: Path | None = None
        self._newest = 0
        self._wait = QTimer(self, singleShot=True, interval=WAIT)
        self._wait.timeout.connect(self._ask)
        self._side = LARGE if tall else SMALL
        self.picture = QLabel()
        self.picture.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self.text = caption()
        self.text.setWordWrap(True)
        self.text.setAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop)
        self.trouble = complaint()
        for label in (self.text, self.trouble):
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.MinimumExpanding)
        direction = QBoxLayout.Direction.TopToBottom if tall else QBoxLayout.Direction.LeftToRight
        layout = QBoxLayout(direction, self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(GAP)
        layout.addWidget(self.picture)
        words = QBoxLayout(QBoxLayout.Direction.TopToBottom)
        words.setSpacing(0)
        words.addWidget(self.text)
        words.addWidget(self.trouble)
        layout.addLayout(words, 1)
        if tall:
            self.setFixedWidth(LARGE + 16)
            layout.addStretch(1)
        self._tall = tall
        if not tall:
            self.hide()

    def look(self, path: Path | None) -> None:
        """Show what a path names, soon; nothing for None."""
        self._path = path
        self._newest += 1
        if path is None:
            self._wait.stop()
            self.show_look(Look())
        else:
            self._wait.start()

    def show_look(self, look: Look) -> None:
        """Show what was found."""
        self.found = look
        self.picture.setVisible(look.picture is not None)
        if look.picture is not None:
            ratio = self.devicePixelRatioF()
            size = QSize(self._side, self._side) * ratio
            scaled = QPixmap.fromImage(look.picture).scaled(
                size, Qt.AspectRatioMode.KeepAspectRatio, Qt.TransformationMode.SmoothTransformation
            )
            scaled.setDevicePixelRatio(ratio)
            self.picture.setPixmap(scaled)
        self.text.setText(look.text.replace(", ", ",\n", 2) if self._side == LARGE else look.text)
        self.text.setVisible(bool(look.text))
        self.trouble.setText(look.trouble)
        self.trouble.setVisible(bool(look.trouble))
        self.setVisible(self._tall or bool(look.text or look.trouble))

    def _ask(self) -> None:
        if self._path is not None:
            number, path = self._newest, self._path
            self.session.work(partial(self._made, number, path), partial(self._take, number))

    def _made(self, number: int, path: Path) -> Look | None:
        """Off the window's thread: look, unless another path is asked for already."""
        return self.finder(path) if number == self._newest else None

    def _take(self, number: int, look: Look | None) -> None:
        if isValid(self) and number == self._newest and look is not None:
            self.show_look(look)
