"""Small fields that come up on the canvas: choose a processor, find a node, type a name."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from PySide6.QtCore import (
    QEvent,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    QPoint,
    QRect,
    QRectF,
    QSize,
    Qt,
    Signal,
)
from PySide6.QtGui import QKeyEvent, QPainter, QPaintEvent, QPalette
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QPlainTextEdit,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from nodegraph.editor.canvas.look import font

Choice = tuple[str, str, str]
"""Key, what is shown first, what stands in the second line."""


def matches(words: str, *texts: str) -> bool:
    """Whether every word occurs in one of the texts."""
    lowered = " ".join(texts).lower()
    return all(word in lowered for word in words.lower().split())


SECOND = Qt.ItemDataRole.UserRole + 1


class _TwoLines(QStyledItemDelegate):
    """A name and, paler, what it does."""

    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        palette, rect = option.palette, option.rect
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if chosen:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(palette.color(QPalette.ColorRole.Highlight))
            painter.drawRoundedRect(rect.adjusted(0, 1, 0, -1), 4, 4)
        color = palette.color(QPalette.ColorRole.HighlightedText if chosen else QPalette.ColorRole.Text)
        painter.setPen(color)
        second = index.data(SECOND)
        box = rect.adjusted(8, 4, -8, -4)
        top = Qt.AlignmentFlag.AlignLeft | (Qt.AlignmentFlag.AlignTop if second else Qt.AlignmentFlag.AlignVCenter)
        painter.drawText(box, top, index.data(Qt.ItemDataRole.DisplayRole))
        if second:
            color.setAlphaF(0.65 if not chosen else 0.85)
            painter.setPen(color)
            painter.setFont(font(11))
            text = painter.fontMetrics().elidedText(second, Qt.TextElideMode.ElideRight, box.width())
            painter.drawText(box, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom, text)
        painter.restore()


class Chooser(QFrame):
    """A list that a few typed letters narrow down. Comes up at a point; Enter or a click chooses, Escape leaves."""

    chosen = Signal(str)
    closed = Signal()

    def __init__(self, parent: QWidget, hint: str, choices: Iterable[Choice]) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self.setFrameShape(QFrame.Shape.StyledPanel)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.choices = list(choices)
        self.field = QLineEdit(placeholderText=hint, clearButtonEnabled=True)
        self.list = QListWidget()
        self.list.setItemDelegate(_TwoLines(self.list))
        self.list.setFrameShape(QFrame.Shape.NoFrame)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.list.setMouseTracking(True)
        self.empty = QLabel("Nothing fits these words.")
        self.empty.setAlignment(Qt.AlignmentFlag.AlignCenter)
        box = QVBoxLayout(self)
        box.setContentsMargins(8, 8, 8, 8)
        box.setSpacing(6)
        for widget in (self.field, self.list, self.empty):
            box.addWidget(widget)
        self.resize(300, 320)
        self.field.textChanged.connect(self._narrow)
        self.field.installEventFilter(self)
        self.list.itemClicked.connect(self._take)
        self.list.itemEntered.connect(self.list.setCurrentItem)
        self._narrow("")

    def open_at(self, point: QPoint) -> None:
        """Come up at a point of the screen, inside of it."""
        screen = self.screen().availableGeometry()
        x = min(point.x(), screen.right() - self.width())
        y = min(point.y(), screen.bottom() - self.height())
        self.move(max(screen.left(), x), max(screen.top(), y))
        self.show()
        self.field.setFocus()

    def shown(self) -> list[str]:
        """Keys of what is listed now."""
        return [self.list.item(i).data(Qt.ItemDataRole.UserRole) for i in range(self.list.count())]

    def _narrow(self, words: str) -> None:
        self.list.clear()
        found = [choice for choice in self.choices if matches(words, *choice)]
        # What begins with the words comes first, then what has them in its name.
        lowered = words.lower()
        found.sort(key=lambda choice: (not choice[1].lower().startswith(lowered), lowered not in choice[1].lower()))
        for key, name, second in found:
            item = QListWidgetItem(name)
            item.setData(Qt.ItemDataRole.UserRole, key)
            item.setData(SECOND, second)
            item.setToolTip(second)
            item.setSizeHint(QSize(100, 40 if second else 26))
            self.list.addItem(item)
        self.list.setCurrentRow(0)
        self.list.setVisible(bool(found))
        self.empty.setVisible(not found)

    def _take(self, item: QListWidgetItem) -> None:
        self.chosen.emit(item.data(Qt.ItemDataRole.UserRole))
        self.close()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            row = self.list.currentRow()
            if event.key() in (Qt.Key.Key_Down, Qt.Key.Key_Up):
                step = 1 if event.key() == Qt.Key.Key_Down else -1
                self.list.setCurrentRow(max(0, min(self.list.count() - 1, row + step)))
                return True
            if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                if self.list.currentItem() is not None:
                    self._take(self.list.currentItem())
                return True
        return super().eventFilter(watched, event)

    def hideEvent(self, event: QEvent) -> None:
        self.closed.emit()


class NameField(QLineEdit):
    """Renames in place: Enter or leaving takes the text, Escape does not."""

    def __init__(self, parent: QWidget, text: str, place: QRect, done: Callable[[str], object]) -> None:
        super().__init__(text, parent)
        self._done: Callable[[str], object] | None = done
        self.setGeometry(QRect(place.topLeft(), QSize(max(120, place.width()), max(24, place.height()))))
        self.editingFinished.connect(self._finish)
        self.selectAll()
        self.show()
        self.setFocus()

    def _finish(self) -> None:
        done, self._done = self._done, None
        if done is not None:
            self.hide()
            done(self.text())
            self.deleteLater()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() == Qt.Key.Key_Escape:
            self._done = None
            self.hide()
            self.deleteLater()
            self.clearFocus()
        else:
            super().keyPressEvent(event)


class NoteField(QPlainTextEdit):
    """Edits the text of a note in place: leaving or Ctrl+Enter takes it, Escape does not."""

    def __init__(self, parent: QWidget, text: str, place: QRect, done: Callable[[str], object]) -> None:
        super().__init__(text, parent)
        self._done: Callable[[str], object] | None = done
        self.setGeometry(QRect(place.topLeft(), QSize(max(120, place.width()), max(60, place.height()))))
        self.selectAll()
        self.show()
        self.setFocus()

    def finish(self, take: bool = True) -> None:
        """Close, and take the text or not."""
        done, self._done = self._done, None
        if done is not None:
            self.hide()
            if take:
                done(self.toPlainText())
            self.deleteLater()

    def focusOutEvent(self, event: QEvent) -> None:
        self.finish()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        enter = event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter)
        if event.key() == Qt.Key.Key_Escape:
            self.finish(take=False)
        elif enter and event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            self.finish()
        else:
            super().keyPressEvent(event)


class FindBar(QFrame):
    """Typed words on top of the canvas; Enter and Shift+Enter go through what was found, Escape leaves."""

    typed = Signal(str)
    stepped = Signal(int)
    closed = Signal()

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.field = QLineEdit(placeholderText="Find a node by name or kind")
        self.field.setMinimumWidth(220)
        self.count = QLabel()
        self.count.setMinimumWidth(60)
        self.count.setAlignment(Qt.AlignmentFlag.AlignCenter)
        row = QHBoxLayout(self)
        row.setContentsMargins(6, 6, 6, 6)
        row.setSpacing(4)
        row.addWidget(self.field)
        row.addWidget(self.count)
        for arrow, step, tip in (
            (Qt.ArrowType.UpArrow, -1, "Previous (Shift+Enter)"),
            (Qt.ArrowType.DownArrow, 1, "Next (Enter)"),
        ):
            button = QToolButton(arrowType=arrow, autoRaise=True)
            button.setToolTip(tip)
            button.clicked.connect(lambda _=False, step=step: self.stepped.emit(step))
            row.addWidget(button)
        self.field.textChanged.connect(self.typed)
        self.field.installEventFilter(self)
        self.hide()

    def paintEvent(self, event: QPaintEvent) -> None:
        """A card, told apart from the canvas below in light and dark."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(self.palette().color(QPalette.ColorRole.Mid))
        painter.setBrush(self.palette().color(QPalette.ColorRole.Button))
        painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 6, 6)

    def open(self) -> None:
        self.adjustSize()
        self.show()
        self.raise_()
        self.field.setFocus()
        self.field.selectAll()
        self.typed.emit(self.field.text())

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if event.type() == QEvent.Type.KeyPress and isinstance(event, QKeyEvent):
            if event.key() == Qt.Key.Key_Escape:
                self.hide()
                self.closed.emit()
                return True
            if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
                self.stepped.emit(-1 if event.modifiers() & Qt.KeyboardModifier.ShiftModifier else 1)
                return True
        return super().eventFilter(watched, event)
