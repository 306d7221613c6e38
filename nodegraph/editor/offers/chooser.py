"""A choice of networks for a data file, each with a small picture. Enter takes the first."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QPoint, QRect, QSize, Qt, Signal
from PySide6.QtGui import QColor, QImage, QPainter, QPalette, QPen
from PySide6.QtWidgets import (
    QButtonGroup,
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QLabel,
    QListView,
    QListWidget,
    QListWidgetItem,
    QRadioButton,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QVBoxLayout,
    QWidget,
)

from nodegraph.editor import theme
from nodegraph.editor.offers.pictures import picture_of_offer
from nodegraph.editor.session import Session
from nodegraph.offers import Offer

PICTURE = QSize(168, 126)
GAP = 6
CARD = PICTURE + QSize(2 * GAP, 2 * GAP + 24)
_PICTURE = Qt.ItemDataRole.UserRole

Index = QModelIndex | QPersistentModelIndex


class Chooser(QDialog):
    """Shows what is offered for a file. ``others``: how many more files get the same."""

    chosen = Signal(str, bool)  # name of the offer; whether it becomes a document of its own

    def __init__(self, session: Session, path: Path, offers: list[Offer], others: int, parent: QWidget) -> None:
        super().__init__(parent)
        self.session = session
        self.offers = offers
        self.setWindowTitle("New from data")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        more = f" and {others} more file{'s' if others > 1 else ''}" if others else ""
        title = QLabel(f"Show {path.name}{more} by")
        font = title.font()
        font.setBold(True)
        title.setFont(font)
        title.setToolTip(str(path))
        self.list = QListWidget()
        self.list.setObjectName("offers")
        self.list.setStyleSheet("#offers { background: transparent; }")
        self.list.setAccessibleName("Networks")
        self.list.setViewMode(QListView.ViewMode.IconMode)
        self.list.setMovement(QListView.Movement.Static)
        self.list.setWrapping(False)
        self.list.setUniformItemSizes(True)
        self.list.setItemDelegate(_Card(self.list))
        self.list.setMouseTracking(True)
        self.list.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.list.setFixedSize(len(offers) * CARD.width() + 2, CARD.height() + 2)
        for offer in offers:
            item = QListWidgetItem(offer.title, self.list)
            item.setToolTip(offer.doc)
        self.doc = QLabel()
        self.doc.setProperty("dim", True)
        self.doc.setWordWrap(True)
        self.afresh = QRadioButton("As a new network")
        self.beside = QRadioButton("Beside what is there")
        self.afresh.setChecked(True)
        where = QButtonGroup(self)
        row = QHBoxLayout()
        for button in (self.afresh, self.beside):
            where.addButton(button)
            row.addWidget(button)
            button.setVisible(bool(session.network.nodes))
        row.addStretch(1)
        buttons = QDialogButtonBox(QDialogButtonBox.StandardButton.Ok | QDialogButtonBox.StandardButton.Cancel)
        buttons.button(QDialogButtonBox.StandardButton.Ok).setText("Build")
        buttons.accepted.connect(self.accept)
        buttons.rejected.connect(self.reject)
        row.addWidget(buttons)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(16, 14, 16, 14)
        layout.setSpacing(10)
        layout.addWidget(title)
        layout.addWidget(self.list)
        layout.addWidget(self.doc)
        layout.addLayout(row)
        self.list.currentRowChanged.connect(self._tell)
        self.list.itemActivated.connect(lambda _item: self.accept())
        self.list.setCurrentRow(0)
        self.list.setFocus()
        self.accepted.connect(self._choose)
        self._picture_next(0)

    def _choose(self) -> None:
        # An empty document is filled; there is nothing to keep it apart from.
        afresh = self.afresh.isChecked() and bool(self.session.network.nodes)
        self.chosen.emit(self.offers[self.list.currentRow()].name, afresh)

    def _tell(self, row: int) -> None:
        self.doc.setText(f"{self.offers[row].doc}." if row >= 0 else "")

    def _picture_next(self, place: int) -> None:
        """Make the pictures one after the other, beside the window."""
        if place < len(self.offers):
            make = partial(picture_of_offer, self.session.engine, self.offers[place], PICTURE * 1.5)
            self.session.work(make, partial(self._show_picture, place))

    def _show_picture(self, place: int, picture: QImage | None) -> None:
        try:
            item = self.list.item(place)
        except RuntimeError:
            return  # the dialog was closed meanwhile
        item.setData(_PICTURE, picture)
        self._picture_next(place + 1)


class _Card(QStyledItemDelegate):
    """A picture, cropped to the size of all, with its title below; a frame says which is chosen."""

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        return CARD

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        palette, colors = option.palette, theme.theme_of(option.palette)
        frame = QRect(option.rect.topLeft() + QPoint(GAP, GAP), PICTURE)
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        picture = index.data(_PICTURE)
        painter.fillRect(frame, palette.base())
        if isinstance(picture, QImage):
            wide = picture.size().scaled(PICTURE, Qt.AspectRatioMode.KeepAspectRatioByExpanding)
            place = QRect(QPoint(0, 0), wide)
            place.moveCenter(frame.center())
            painter.setClipRect(frame)
            painter.drawImage(place, picture)
            painter.setClipping(False)
        chosen = bool(option.state & QStyle.StateFlag.State_Selected)
        lit = chosen or bool(option.state & QStyle.StateFlag.State_MouseOver)
        painter.setPen(QPen(palette.highlight().color() if lit else QColor(colors.line), 3 if chosen else 1))
        painter.drawRect(frame.adjusted(0, 0, -1, -1))
        painter.setPen(palette.color(QPalette.ColorRole.WindowText))
        below = QRect(frame.left(), frame.bottom() + 4, frame.width(), 24)
        painter.drawText(below, int(Qt.AlignmentFlag.AlignCenter), index.data())
        painter.restore()
