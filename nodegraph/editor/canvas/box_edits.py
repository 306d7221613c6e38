"""What the canvas does to frames and notes, each as one undo step of commands."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import QRectF

from nodegraph.commands import SetUI
from nodegraph.editor.canvas.items import rect_json
from nodegraph.editor.canvas.level_edits import LevelEdits
from nodegraph.network import unique


class BoxEdits(LevelEdits):
    """Frames around nodes, and notes."""

    def put_box(self, kind: str, key: str, value: dict[str, Any] | None) -> None:
        """Write one frame or note of the level; None removes it."""
        stored = self.scene.ui.get(kind)
        boxes = dict(stored) if isinstance(stored, dict) else {}
        if value is None:
            boxes.pop(key, None)
        else:
            boxes[key] = value
        self.session.do(SetUI(self.scene.owner_path, kind, boxes or None))

    def change_box(self, kind: str, key: str, **changes: Any) -> None:
        """Write some entries of a frame or note."""
        stored = self.scene.ui.get(kind, {}).get(key)
        if isinstance(stored, dict):
            self.put_box(kind, key, {**stored, **changes})

    def add_frame(self, title: str = "Frame") -> str:
        """Draw a frame around what is selected."""
        area = QRectF()
        for id in self.scene.chosen():
            area = area.united(self.scene.nodes[id].body_in_scene())
        return self.add_box("frames", area.adjusted(-20, -44, 20, 20), title)

    def add_box(self, kind: str, rect: QRectF, text: str) -> str:
        """Add a frame or a note and return its key."""
        stored = self.scene.ui.get(kind)
        key = unique("frame" if kind == "frames" else "note", stored if isinstance(stored, dict) else ())
        with self.session.gesture("frame" if kind == "frames" else "note"):
            self.put_box(kind, key, {"text": text, "rect": rect_json(rect)})
        return key
