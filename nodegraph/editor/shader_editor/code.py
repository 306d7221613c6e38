"""A text editor for code: line numbers, and marks for the lines that somebody complains about."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QEvent, QPoint, QRect, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFontDatabase,
    QHelpEvent,
    QKeyEvent,
    QKeySequence,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QTextCursor,
    QTextFormat,
)
from PySide6.QtWidgets import QPlainTextEdit, QTextEdit, QToolTip, QWidget

from nodegraph.editor import theme
from nodegraph.editor.shader_editor.highlight import Highlighter

INDENT = 4


class CodeEdit(QPlainTextEdit):
    """Text in a fixed font. Tab indents by spaces, Enter keeps the indent; a marked line tells its error on hover."""

    save_asked = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setFont(QFontDatabase.systemFont(QFontDatabase.SystemFont.FixedFont))
        self.setLineWrapMode(QPlainTextEdit.LineWrapMode.NoWrap)
        self.setAcceptDrops(False)
        self.errors: dict[int, str] = {}
        self.highlighter = Highlighter(self.document(), self.palette())
        self.numbers = _Numbers(self)
        self.blockCountChanged.connect(self._make_room)
        self.updateRequest.connect(self._scroll_numbers)
        self._make_room()

    def mark(self, errors: Mapping[int, str]) -> None:
        """Mark lines (from 1) with what is wrong there, and no others."""
        self.errors = {line: text for line, text in errors.items() if 1 <= line <= self.blockCount()}
        marks = []
        color = QColor(theme.theme_of(self.palette()).error)
        color.setAlpha(48)
        for line in self.errors:
            mark = QTextEdit.ExtraSelection()
            mark.format.setBackground(color)
            mark.format.setProperty(QTextFormat.Property.FullWidthSelection, True)
            mark.cursor = QTextCursor(self.document().findBlockByNumber(line - 1))
            marks.append(mark)
        self.setExtraSelections(marks)
        self.numbers.update()

    def go_to(self, line: int) -> None:
        """Put the cursor on a line (from 1) and show it."""
        self.setTextCursor(QTextCursor(self.document().findBlockByNumber(max(0, line - 1))))
        self.centerCursor()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        cursor = self.textCursor()
        if event.matches(QKeySequence.StandardKey.Save):
            self.save_asked.emit()
        elif event.key() == Qt.Key.Key_Tab and not cursor.hasSelection() and not self.isReadOnly():
            cursor.insertText(" " * (INDENT - cursor.positionInBlock() % INDENT))
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not self.isReadOnly():
            before = cursor.block().text()[: cursor.positionInBlock()]
            deeper = INDENT if before.rstrip().endswith("{") else 0
            cursor.insertText("\n" + " " * (len(before) - len(before.lstrip(" ")) + deeper))
            self.ensureCursorVisible()
        else:
            super().keyPressEvent(event)

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            if event.matches(QKeySequence.StandardKey.Save):
                event.accept()  # while one types here it is this text that is saved, not the network
                return True
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            line = self.cursorForPosition(event.pos() - QPoint(self.numbers.width(), 0)).blockNumber() + 1
            QToolTip.showText(event.globalPos(), self.errors.get(line, ""), self)
            return True
        return super().event(event)

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and hasattr(self, "numbers"):
            self.highlighter.repaint_in(self.palette())
            self.mark(self.errors)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        area = self.contentsRect()
        self.numbers.setGeometry(QRect(area.left(), area.top(), self.numbers.wide(), area.height()))

    def _make_room(self) -> None:
        self.setViewportMargins(self.numbers.wide(), 0, 0, 0)

    def _scroll_numbers(self, rect: QRect, dy: int) -> None:
        if dy:
            self.numbers.scroll(0, dy)
        else:
            self.numbers.update(0, rect.y(), self.numbers.width(), rect.height())

    def lines_seen(self) -> list[tuple[int, int, int]]:
        """The lines on the screen: number from 1, top and height in pixels."""
        block, found = self.firstVisibleBlock(), []
        while block.isValid():
            rect = self.blockBoundingGeometry(block).translated(self.contentOffset())
            if rect.top() > self.viewport().height():
                break
            found.append((block.blockNumber() + 1, round(rect.top()), round(rect.height())))
            block = block.next()
        return found


class _Numbers(QWidget):
    """The numbers beside the lines, in the colour of errors where there is one."""

    def __init__(self, code: CodeEdit) -> None:
        super().__init__(code)
        self.code = code

    def wide(self) -> int:
        digits = max(3, len(str(self.code.blockCount())))
        return 14 + self.code.fontMetrics().horizontalAdvance("9") * digits

    def sizeHint(self) -> QSize:
        return QSize(self.wide(), 0)

    def paintEvent(self, event: QPaintEvent) -> None:
        colors = theme.theme_of(self.palette())
        painter = QPainter(self)
        painter.setFont(self.code.font())
        painter.fillRect(event.rect(), QColor(colors.window))
        for line, top, height in self.code.lines_seen():
            painter.setPen(QColor(colors.error if line in self.code.errors else colors.dim))
            painter.drawText(0, top, self.width() - 7, height, int(Qt.AlignmentFlag.AlignRight), str(line))
