"""The visual editor. The only part of nodegraph that imports PySide6; see docs/decisions/0011-editor.md."""
