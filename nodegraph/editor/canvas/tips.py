"""Tooltips of the canvas: words at once, and a picture of the value as soon as it is made."""

from __future__ import annotations

from PySide6.QtCore import QBuffer, QByteArray, QIODevice, QObject, QPoint
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QToolTip, QWidget

from nodegraph.editor.canvas.faces import Port
from nodegraph.editor.canvas.scene import CanvasScene
from nodegraph.editor.canvas.told import node_tip, port_tip, shown_value

SIZE = (288, 192)


class Tips(QObject):
    """Shows the tooltips of one view."""

    def __init__(self, scene: CanvasScene, viewport: QWidget) -> None:
        super().__init__(viewport)
        self.scene = scene
        self.viewport = viewport
        self.text = ""

    def show(self, where: QPoint, id: str, port: Port | None) -> None:
        """Show the tooltip of a node or of one of its ports at a point of the screen."""
        node = self.scene.level.nodes[id]
        session = self.scene.session
        if port is None:
            self.say(where, node_tip(session, node, self.scene.standing))
            return
        text = port_tip(session, node, port)
        self.say(where, text)
        value = shown_value(session, node, port)
        if value is not None:
            session.picture(value, lambda picture: self._add(where, text, picture), SIZE)

    def say(self, where: QPoint, text: str) -> None:
        self.text = text
        if text:
            QToolTip.showText(where, text, self.viewport)
        else:
            QToolTip.hideText()

    def _add(self, where: QPoint, text: str, picture: QImage | None) -> None:
        """Put the picture below the words, unless the mouse has gone on meanwhile."""
        if picture is not None and self.text == text and QToolTip.isVisible():
            self.text = with_picture(text, picture)
            QToolTip.showText(where, self.text, self.viewport)


def with_picture(text: str, picture: QImage) -> str:
    """Rich text with a picture below."""
    data = QByteArray()
    buffer = QBuffer(data)
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    picture.save(buffer, "PNG")  # type: ignore[call-overload]
    source = bytes(data.toBase64().data()).decode()
    return f'{text}<br><img width="{picture.width()}" height="{picture.height()}" src="data:image/png;base64,{source}">'
