"""The page that an empty editor shows: what there is to open, with pictures."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import QEvent, QPoint, QRect, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QEnterEvent,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPalette,
    QPen,
    QPixmap,
)
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QLabel,
    QLayout,
    QLayoutItem,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QVBoxLayout,
    QWidget,
)

from nodegraph import locations, workspace
from nodegraph.data import Image
from nodegraph.editor import theme
from nodegraph.editor.previews import picture_of
from nodegraph.editor.session import Session
from nodegraph.errors import GraphError
from nodegraph.requests import default_sinks

THUMBNAIL = QSize(208, 156)


class Welcome(QScrollArea):
    """Buttons to begin with, the shipped workspaces as pictures, and files that were open lately."""

    wants_new = Signal()
    wants_data = Signal()
    wants_dialog = Signal()
    wants_file = Signal(object)  # Path

    def __init__(self, session: Session, recent: Callable[[], list[Path]]) -> None:
        super().__init__()
        self.session = session
        self._recent = recent
        self._asked = False
        self.cards: list[Card] = []
        self.setWidgetResizable(True)
        self.setFrameShape(QFrame.Shape.NoFrame)
        page = QWidget()
        self.setWidget(page)
        column = QVBoxLayout(page)
        column.setContentsMargins(40, 36, 40, 36)
        column.setSpacing(12)
        title = QLabel("nodegraph")
        font = title.font()
        font.setPointSizeF(font.pointSizeF() * 2.0)
        font.setBold(True)
        title.setFont(font)
        what = QLabel(
            "Wire processors into a network and see the volume change. Drop a data file here to begin with it."
        )
        what.setProperty("dim", True)
        column.addWidget(title)
        column.addWidget(what)
        buttons = QHBoxLayout()
        buttons.setSpacing(8)
        for text, signal in (
            ("New network", self.wants_new),
            ("New from data ...", self.wants_data),
            ("Open a file ...", self.wants_dialog),
        ):
            button = QPushButton(text)
            button.setMinimumWidth(140)
            button.clicked.connect(signal.emit)
            buttons.addWidget(button)
        buttons.addStretch(1)
        column.addSpacing(8)
        column.addLayout(buttons)
        column.addSpacing(20)
        column.addWidget(_heading("Examples"))
        shelf = QWidget()
        flow = Flow(shelf)
        for path in sorted(locations.workspaces().glob("*.json")):
            card = Card(path)
            card.clicked.connect(partial(self.wants_file.emit, path))
            flow.addWidget(card)
            self.cards.append(card)
        column.addWidget(shelf)
        column.addSpacing(20)
        self._recent_title = _heading("Recent files")
        column.addWidget(self._recent_title)
        self._recent_column = QVBoxLayout()
        self._recent_column.setSpacing(2)
        column.addLayout(self._recent_column)
        column.addStretch(1)
        self.refresh()

    def refresh(self) -> None:
        """List the recent files anew."""
        while (item := self._recent_column.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.deleteLater()
        shown = self._recent()[:8]
        self._recent_title.setVisible(bool(shown))
        for path in shown:
            link = QLabel(f"<a href='#' style='text-decoration: none'>{path.name}</a>")
            link.setToolTip(str(path))
            link.linkActivated.connect(lambda _href, path=path: self.wants_file.emit(path))
            folder = QLabel(str(path.parent))
            folder.setProperty("dim", True)
            row = QHBoxLayout()
            row.setSpacing(12)
            row.addWidget(link)
            row.addWidget(folder)
            row.addStretch(1)
            home = QWidget()
            row.setContentsMargins(0, 0, 0, 0)
            home.setLayout(row)
            self._recent_column.addWidget(home)

    def show_pictures(self) -> None:
        """Bring the thumbnails, one after the other: kept ones at once, others rendered small beside the window."""
        if not self._asked:
            self._asked = True
            self._next(list(self.cards))

    def _next(self, cards: list[Card]) -> None:
        if not cards or not self.isVisible():
            self._asked = not cards
            return
        card, *rest = cards

        def done(picture: QImage | None) -> None:
            card.show_picture(picture)
            self._next(rest)

        self.session.work(partial(thumbnail, self.session, card.path), done)


def thumbnail(session: Session, path: Path) -> QImage | None:
    """A small picture of the first view of a workspace, kept in the cache folder until the file changes. Any thread."""
    from nodegraph.disk_cache import default_folder

    stamp = os.stat(path)
    key = hashlib.blake2b(f"{path} {stamp.st_mtime_ns} {THUMBNAIL}".encode(), digest_size=12).hexdigest()
    kept = default_folder() / "thumbnails" / f"{key}.png"
    if kept.is_file():
        return QImage(str(kept))
    try:
        flat = workspace.load(path).flatten()
        sinks = [sink for sink in default_sinks(flat) if not getattr(flat.nodes[sink].processor, "effect", False)]
        size = (THUMBNAIL.width() * 3 // 2, THUMBNAIL.height() * 3 // 2)
        report = session.engine.submit(flat, sinks[:1], size=size, quality="interactive").result()
    except GraphError:
        return None
    shown = [value for values in report.shown.values() for value in values.values() if isinstance(value, Image)]
    picture = picture_of(shown[0]) if shown else None
    if picture is not None:
        kept.parent.mkdir(parents=True, exist_ok=True)
        picture.save(str(kept))
    return picture


class Card(QWidget):
    """A workspace as a picture with its name. A click, Enter or the space bar opens it."""

    clicked = Signal()

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.path = path
        self.title = path.stem.replace("_", " ").title()
        self._picture: QPixmap | None = None
        self.setFixedSize(THUMBNAIL + QSize(0, 34))
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setAccessibleName(self.title)
        self.setToolTip(str(path))

    def show_picture(self, picture: QImage | None) -> None:
        """Show a picture, cropped to the card; None leaves the card plain."""
        self._picture = QPixmap.fromImage(picture) if picture is not None else None
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHints(QPainter.RenderHint.Antialiasing | QPainter.RenderHint.SmoothPixmapTransform)
        colors = theme.theme_of(self.palette())
        frame = QRect(QPoint(0, 0), THUMBNAIL)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(self.palette().base())
        painter.drawRect(frame)
        if self._picture is not None:
            wide = self._picture.size().scaled(THUMBNAIL, Qt.AspectRatioMode.KeepAspectRatioByExpanding)
            left, top = (THUMBNAIL.width() - wide.width()) // 2, (THUMBNAIL.height() - wide.height()) // 2
            painter.setClipRect(frame)
            painter.drawPixmap(QRect(QPoint(left, top), wide), self._picture)
            painter.setClipping(False)
        lit = self.underMouse() or self.hasFocus()
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(self.palette().highlight().color() if lit else QColor(colors.line), 2 if lit else 1))
        painter.drawRect(frame.adjusted(1, 1, -1, -1))
        painter.setPen(self.palette().color(QPalette.ColorRole.WindowText))
        below = QRect(2, THUMBNAIL.height() + 8, THUMBNAIL.width() - 4, 24)
        painter.drawText(below, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignTop, self.title)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton and self.rect().contains(event.position().toPoint()):
            self.clicked.emit()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter, Qt.Key.Key_Space):
            self.clicked.emit()
        else:
            super().keyPressEvent(event)

    def enterEvent(self, event: QEnterEvent) -> None:
        self.update()

    def leaveEvent(self, event: QEvent) -> None:
        self.update()


class Flow(QLayout):
    """Lays widgets in rows, as words on a page."""

    GAP = 20

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._items: list[QLayoutItem] = []
        self.setContentsMargins(0, 0, 0, 0)
        policy = QSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Preferred)
        policy.setHeightForWidth(True)
        parent.setSizePolicy(policy)

    def addItem(self, item: QLayoutItem) -> None:
        self._items.append(item)

    def count(self) -> int:
        return len(self._items)

    def itemAt(self, index: int) -> QLayoutItem | None:
        return self._items[index] if 0 <= index < len(self._items) else None

    def takeAt(self, index: int) -> QLayoutItem | None:
        return self._items.pop(index) if 0 <= index < len(self._items) else None

    def hasHeightForWidth(self) -> bool:
        return True

    def heightForWidth(self, width: int) -> int:
        return self._place(QRect(0, 0, width, 0), False)

    def setGeometry(self, rect: QRect) -> None:
        super().setGeometry(rect)
        self._place(rect, True)

    def sizeHint(self) -> QSize:
        return self.minimumSize()

    def minimumSize(self) -> QSize:
        size = QSize()
        for item in self._items:
            size = size.expandedTo(item.minimumSize())
        return size

    def _place(self, rect: QRect, move: bool) -> int:
        x, y, tall = rect.x(), rect.y(), 0
        for item in self._items:
            size = item.sizeHint()
            if x > rect.x() and x + size.width() > rect.right() + 1:
                x, y, tall = rect.x(), y + tall + self.GAP, 0
            if move:
                item.setGeometry(QRect(QPoint(x, y), size))
            x, tall = x + size.width() + self.GAP, max(tall, size.height())
        return y + tall - rect.y()


def _heading(text: str) -> QLabel:
    label = QLabel(text)
    font = label.font()
    font.setBold(True)
    label.setFont(font)
    return label
