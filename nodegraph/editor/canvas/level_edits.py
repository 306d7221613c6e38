"""What all edits of the canvas have in common: the level they are made on, and that each is one undo step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nodegraph.editor.canvas.scene import CanvasScene
    from nodegraph.editor.session import Session
    from nodegraph.network import Network


class Refused(Exception):
    """A command of a gesture was refused; the gesture is taken back. The session has told why."""


class LevelEdits:
    """Edits of the level that a scene shows."""

    def __init__(self, scene: CanvasScene) -> None:
        self.scene = scene

    @property
    def session(self) -> Session:
        return self.scene.session

    @property
    def level(self) -> Network:
        return self.scene.level

    def must(self, command: Any) -> None:
        """Do a command. Raises Refused, which takes the gesture around it back."""
        if not self.session.do(command):
            raise Refused
