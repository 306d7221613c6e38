"""The network canvas: `CanvasView` shows one level of the document and edits it by commands."""

from nodegraph.editor.canvas.canvas import CanvasView

__all__ = ["CanvasView"]
