"""Colours for the words of the kernel language."""

from __future__ import annotations

import re

from PySide6.QtGui import QColor, QPalette, QSyntaxHighlighter, QTextCharFormat, QTextDocument

from nodegraph.editor import theme

_WORDS = (
    (
        "type",
        r"\b(void|bool|u?int|float|[biu]?vec[234]|mat[234]|Camera|field[123][uv]?|struct|const|uniform|inout|out)\b",
    ),
    ("word", r"\b(if|else|for|while|do|break|continue|return|switch|case|default|discard|true|false)\b"),
    ("number", r"\b(\d+\.?\d*([eE][-+]?\d+)?[uUfF]?|\.\d+([eE][-+]?\d+)?[fF]?)"),
    ("entry", r"\b(pixel|voxel)(?=\s*\()"),
    ("rule", r"^\s*#.*"),
)
_COLORS = {
    "dark": {"type": "#6cb6ff", "word": "#dcbdfb", "number": "#f0b37e", "entry": "#ffd866", "rule": "#b0a0e0"},
    "light": {"type": "#0550ae", "word": "#7d2aa8", "number": "#953800", "entry": "#7a5900", "rule": "#5a4a9c"},
}
_COMMENT = 1


class Highlighter(QSyntaxHighlighter):
    """Paints types, words, numbers, entries, preprocessor lines and comments in the colours of the theme."""

    def __init__(self, document: QTextDocument, palette: QPalette) -> None:
        super().__init__(document)
        self._patterns = [(name, re.compile(pattern)) for name, pattern in _WORDS]
        self._formats: dict[str, QTextCharFormat] = {}
        self.repaint_in(palette)

    def repaint_in(self, palette: QPalette) -> None:
        """Take the colours of a palette's theme."""
        colors = theme.theme_of(palette)
        named = {**_COLORS["dark" if colors is theme.DARK else "light"], "comment": colors.dim}
        self._formats = {name: _format(color) for name, color in named.items()}
        self.rehighlight()

    def highlightBlock(self, text: str) -> None:
        for name, pattern in self._patterns:
            for match in pattern.finditer(text):
                self.setFormat(match.start(), match.end() - match.start(), self._formats[name])
        at = 0
        if self.previousBlockState() != _COMMENT:
            at = self._line_comment(text, 0)
        self.setCurrentBlockState(0)
        while 0 <= at < len(text) or (self.previousBlockState() == _COMMENT and at == 0):
            inside = at == 0 and self.previousBlockState() == _COMMENT
            end = text.find("*/", at if inside else at + 2)
            length = len(text) - at if end < 0 else end + 2 - at
            self.setFormat(at, length, self._formats["comment"])
            if end < 0:
                self.setCurrentBlockState(_COMMENT)
                return
            at = self._line_comment(text, end + 2)

    def _line_comment(self, text: str, start: int) -> int:
        """Paint a comment to the end of the line; returns where a block comment opens before it, or -1."""
        line, block = text.find("//", start), text.find("/*", start)
        if line >= 0 and (block < 0 or line < block):
            self.setFormat(line, len(text) - line, self._formats["comment"])
            return -1
        return block


def _format(color: str) -> QTextCharFormat:
    made = QTextCharFormat()
    made.setForeground(QColor(color))
    return made
