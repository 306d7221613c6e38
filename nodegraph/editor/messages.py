"""What the editor has to say: errors and warnings with their node and their cure, and what happened."""

from __future__ import annotations

import re
from pathlib import Path

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRect, QSize, Qt, Signal
from PySide6.QtGui import QGuiApplication, QKeySequence, QPainter, QPalette, QShortcut
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from nodegraph.editor import theme
from nodegraph.editor.buttons import flat_button
from nodegraph.editor.session import Message, Session
from nodegraph.report import Report

KEPT = 500
_MESSAGE = Qt.ItemDataRole.UserRole
_COUNT = Qt.ItemDataRole.UserRole + 1
_KERNEL = re.compile(r"(.*\.glsl)(?::(\d+))?")
_MARGIN, _ICON, _GAP = 10, 16, 3

Index = QModelIndex | QPersistentModelIndex


def parts(message: Message) -> tuple[str, str, str]:
    """Place, what is wrong, and the cure, of which the first and the last may be empty.

    Errors are written "place: what is wrong; cure".
    """
    text, place = message.text, message.path
    if place and text.startswith(place) and text[len(place) : len(place) + 1] in (":", "."):
        front, _, rest = text.partition(": ")
        place, text = front, rest
    what, _, cure = text.partition("; ")
    return place, _sentence(what), _sentence(cure)


def _sentence(text: str) -> str:
    """A text as a sentence begins, unless it begins with the name of something."""
    return text[:1].upper() + text[1:] if text.partition(" ")[0].rstrip(",:").isalpha() else text


class Messages(QWidget):
    """The list, newest at the end. A click selects the node. An error goes when its node is well again."""

    kernel_chosen = Signal(object, int)  # Path, line or 0
    counted = Signal(int)  # how many errors stand there

    def __init__(self, session: Session) -> None:
        super().__init__()
        self.session = session
        self.list = QListWidget()
        self.list.setWordWrap(True)
        self.list.setItemDelegate(_Delegate(self.list))
        self.list.setVerticalScrollMode(QListWidget.ScrollMode.ScrollPerPixel)
        self.list.setResizeMode(QListWidget.ResizeMode.Adjust)
        self.summary = QLabel()
        self.summary.setProperty("dim", True)
        self.again = flat_button("Try again", "Run again what failed, with nothing changed", session.retry)
        clear = flat_button("Clear", "Forget all messages", self.clear)
        row = QHBoxLayout()
        row.setContentsMargins(10, 4, 6, 4)
        row.addWidget(self.summary, 1)
        row.addWidget(self.again)
        row.addWidget(clear)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(row)
        layout.addWidget(self.list, 1)
        copy = QShortcut(QKeySequence(QKeySequence.StandardKey.Copy), self.list)
        copy.setContext(Qt.ShortcutContext.WidgetShortcut)
        copy.activated.connect(self._copy)
        self.list.itemClicked.connect(self._go)
        self.list.itemActivated.connect(self._go)
        session.message.connect(self.add)
        session.finished.connect(self._drop_mended)
        session.replaced.connect(self.clear)
        self._sum_up()

    def add(self, message: Message) -> None:
        """Show a message; one that says the same as the last is counted instead."""
        last = self.list.item(self.list.count() - 1)
        if last is not None and last.data(_MESSAGE) == message:
            last.setData(_COUNT, last.data(_COUNT) + 1)
            return
        item = QListWidgetItem(self.list)
        item.setData(_MESSAGE, message)
        item.setData(_COUNT, 1)
        item.setData(Qt.ItemDataRole.AccessibleTextRole, f"{message.level}: {message.text}")
        while self.list.count() > KEPT:
            self.list.takeItem(0)
        self.list.scrollToBottom()
        self._sum_up()

    def clear(self) -> None:
        """Forget all messages."""
        self.list.clear()
        self._sum_up()

    def forget(self, place: str) -> None:
        """Take away what is said about a place that is no node: a file, or a line of one."""
        for row in reversed(range(self.list.count())):
            if self.list.item(row).data(_MESSAGE).path == place:
                self.list.takeItem(row)
        self._sum_up()

    def messages(self) -> list[Message]:
        """What is shown, oldest first."""
        return [self.list.item(row).data(_MESSAGE) for row in range(self.list.count())]

    def _drop_mended(self, report: Report) -> None:
        for row in reversed(range(self.list.count())):
            message = self.list.item(row).data(_MESSAGE)
            state = report.states.get(message.path)
            if message.level == "error" and state == "clean":
                self.list.takeItem(row)
        self._sum_up()

    def _sum_up(self) -> None:
        levels = [message.level for message in self.messages()]
        errors, warnings = levels.count("error"), levels.count("warning")
        told = [f"{n} {word}{'s' if n > 1 else ''}" for n, word in ((errors, "error"), (warnings, "warning")) if n]
        self.summary.setText(", ".join(told) or "No errors")
        self.again.setVisible(errors > 0)
        self.counted.emit(errors)

    def _go(self, item: QListWidgetItem) -> None:
        path = item.data(_MESSAGE).path
        if path in self.session.network:
            self.session.enter(path.rpartition("/")[0])
            self.session.select(path)
        elif match := _KERNEL.match(path):
            self.kernel_chosen.emit(Path(match[1]), int(match[2] or 0))

    def _copy(self) -> None:
        item = self.list.currentItem()
        if item is not None:
            QGuiApplication.clipboard().setText(item.data(_MESSAGE).text)


class _Delegate(QStyledItemDelegate):
    """An icon for the level; what is wrong, with its place in front; the cure, paler, below."""

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        message, count = index.data(_MESSAGE), index.data(_COUNT)
        palette, rect = option.palette, option.rect
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        colors = theme.theme_of(palette)
        painter.save()
        if chosen:
            painter.fillRect(rect, palette.color(QPalette.ColorRole.Highlight))
        elif option.state & QStyle.StateFlag.State_MouseOver:
            painter.fillRect(rect, palette.color(QPalette.ColorRole.Midlight))
        ink = {"error": colors.error, "warning": colors.warning}.get(message.level, colors.dim)
        sign = theme.drawn(message.level, colors.on_accent if chosen else ink, _ICON * 2)
        painter.drawPixmap(QRect(rect.left() + _MARGIN, rect.top() + _MARGIN // 2 + 1, _ICON, _ICON), sign)
        place, what, cure = parts(message)
        text, times = self._head(place, what), f"   ×{count}" if count > 1 else ""
        box = self._box(rect.width(), rect.topLeft().x(), rect.top())
        painter.setPen(palette.color(QPalette.ColorRole.HighlightedText if chosen else QPalette.ColorRole.Text))
        used = painter.drawText(box, int(Qt.TextFlag.TextWordWrap), text + times)
        if cure:
            painter.setPen(palette.color(QPalette.ColorRole.HighlightedText) if chosen else colors.dim)
            below = box.translated(0, used.height() + _GAP)
            painter.drawText(below, int(Qt.TextFlag.TextWordWrap), cure)
        painter.restore()

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        view = self.parent()
        width = view.viewport().width() if isinstance(view, QListWidget) else option.rect.width()
        place, what, cure = parts(index.data(_MESSAGE))
        box, flags = self._box(width, 0, 0), int(Qt.TextFlag.TextWordWrap)
        height = option.fontMetrics.boundingRect(box, flags, self._head(place, what)).height()
        if cure:
            height += _GAP + option.fontMetrics.boundingRect(box, flags, cure).height()
        return QSize(width, height + _MARGIN)

    @staticmethod
    def _head(place: str, what: str) -> str:
        return f"{place}   {what}" if place else what

    @staticmethod
    def _box(width: int, left: int, top: int) -> QRect:
        start = _MARGIN + _ICON + 8
        return QRect(left + start, top + _MARGIN // 2, max(40, width - start - _MARGIN), 10000)
