"""The card that shows what is at a port: words at once, a picture or the first rows as soon as they are made."""

from __future__ import annotations

from html import escape

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QPainter, QPaintEvent, QPalette, QPixmap
from PySide6.QtWidgets import QFrame, QLabel, QSizePolicy, QVBoxLayout, QWidget

from nodegraph.editor.previews import Preview

AWAY = QPoint(18, 18)
"""From the mouse to the corner of the card."""
WIDE = 288


class PreviewCard(QFrame):
    """Floats beside the mouse, which passes through it."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.ToolTip | Qt.WindowType.FramelessWindowHint)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        self.setAttribute(Qt.WidgetAttribute.WA_ShowWithoutActivating)
        self.setAttribute(Qt.WidgetAttribute.WA_TranslucentBackground)
        self.words, self.picture, self.rest = QLabel(), QLabel(), QLabel()
        for label in (self.words, self.rest):
            label.setTextFormat(Qt.TextFormat.RichText)
            label.setWordWrap(True)
            label.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Minimum)
        self.picture.setAlignment(Qt.AlignmentFlag.AlignCenter)
        box = QVBoxLayout(self)
        box.setContentsMargins(12, 10, 12, 10)
        box.setSpacing(8)
        for part in (self.words, self.picture, self.rest):
            box.addWidget(part)
        self._where = QPoint()

    def show_words(self, where: QPoint, text: str) -> None:
        """Come up at a point of the screen with these words alone."""
        self._where = where
        self.words.setText(text)
        self.picture.hide()
        self.rest.hide()
        self._settle()
        self.show()

    def add(self, preview: Preview) -> None:
        """Put what was made below the words."""
        if preview.picture is not None:
            self.picture.setPixmap(QPixmap.fromImage(preview.picture))
        self.picture.setVisible(preview.picture is not None)
        lines = "<br>".join(map(escape, preview.lines))
        self.rest.setText(_table(preview.rows) if preview.rows else lines)
        self.rest.setVisible(bool(preview.rows or preview.lines))
        self._settle()

    def _settle(self) -> None:
        """Take the size that the words need, and stay on the screen."""
        self.words.setFixedWidth(WIDE)
        rows = self.rest.text().startswith("<table")
        self.rest.setWordWrap(not rows)
        self.rest.setMinimumWidth(0 if rows else WIDE)
        self.rest.setMaximumWidth(16777215 if rows else WIDE)
        self.layout().activate()  # type: ignore[union-attr]
        self.adjustSize()
        screen = self.screen().availableGeometry()
        corner = self._where + AWAY
        if corner.x() + self.width() > screen.right():
            corner.setX(max(screen.left(), self._where.x() - AWAY.x() - self.width()))
        if corner.y() + self.height() > screen.bottom():
            corner.setY(max(screen.top(), self._where.y() - AWAY.y() - self.height()))
        self.move(corner)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(self.palette().color(QPalette.ColorRole.Mid))
        painter.setBrush(self.palette().color(QPalette.ColorRole.ToolTipBase))
        painter.drawRoundedRect(self.rect().adjusted(0, 0, -1, -1), 6, 6)


def _table(rows: tuple[tuple[str, ...], ...]) -> str:
    cells = [
        "".join(f"<{tag} align='left' style='padding-right: 14px'>{escape(cell)}</{tag}>" for cell in row)
        for row, tag in zip(rows, ["th", *["td"] * (len(rows) - 1)], strict=True)
    ]
    return "<table cellspacing='0' cellpadding='2'>" + "".join(f"<tr>{row}</tr>" for row in cells) + "</table>"
