"""Two views against each other: side by side, behind a curtain that is drawn, or their difference and its measure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtCore import QEvent, QLineF, QPointF, QRectF, Qt, QTimer
from PySide6.QtGui import QColor, QImage, QMouseEvent, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QButtonGroup, QComboBox, QHBoxLayout, QLabel, QSlider, QVBoxLayout, QWidget

from nodegraph.accuracy.measures import errors
from nodegraph.data import Image
from nodegraph.data.buffer import Array
from nodegraph.editor.views.icons import IconButton
from nodegraph.editor.views.shown import VIEWPORT, Shown, encoded, linear, opaque, shown
from nodegraph.editor.views.status_line import StatusLine
from nodegraph.pictures import views_of

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.report import Report

KEPT = "\0kept"
"""Stands for the kept picture among the views."""

MODES = {"side": "Side by side", "wipe": "Wipe", "difference": "Difference"}
FIGURES = {"max": "max {:.4g}", "rmse": "RMSE {:.4g}", "psnr": "PSNR {:.1f} dB", "p999": "99.9 % below {:.4g}"}
GRIP = 8


class CompareView(QWidget):
    """Compares A with B. Each is a view, or B the picture of A that was kept, so that a change can be judged."""

    def __init__(self, session: Session, first: str = "", second: str = "", parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.pictures: list[Shown | None] = [None, None]
        self.kept: Image | None = None
        self.figures: dict[str, float] = {}
        self._channels = (object(), object())
        self._newest = [0, 0, 0]
        self._lay_out()
        self._settle = QTimer(self, singleShot=True, interval=80)
        self._settle.timeout.connect(self._watch)
        session.answered.connect(self._answered)
        session.changed.connect(self._fill)
        session.replaced.connect(self._restart)
        self._fill()
        for box, path in zip(self.boxes, (first, second), strict=True):
            if path:
                box.setCurrentIndex(max(box.findData(path), 0))

    def _lay_out(self) -> None:
        self.boxes = (QComboBox(self), QComboBox(self))
        bar = QHBoxLayout()
        bar.setContentsMargins(8, 2, 8, 2)
        bar.setSpacing(4)
        for letter, box in zip("AB", self.boxes, strict=True):
            bar.addWidget(QLabel(letter, self))
            box.setMinimumWidth(110)
            box.currentIndexChanged.connect(lambda _: self._settle.start())
            bar.addWidget(box)
            bar.addSpacing(8)
        self._keep = IconButton("keep", "Keep the picture of A, to compare with", self)
        self._keep.clicked.connect(self.keep)
        bar.addWidget(self._keep)
        bar.addStretch(1)
        self._modes = QButtonGroup(self)
        for name, label in MODES.items():
            button = IconButton(name, label, self, checkable=True)
            button.setProperty("mode", name)
            self._modes.addButton(button)
            bar.addWidget(button)
        self._modes.buttons()[0].setChecked(True)
        self._modes.buttonClicked.connect(lambda _: self._show_mode())
        self.gain = QSlider(Qt.Orientation.Horizontal, self)
        self.gain.setRange(0, 30)  # decibels: 1 to 1000 times
        self.gain.setValue(10)
        self.gain.setFixedWidth(110)
        self.gain.valueChanged.connect(lambda _: self._compare())
        self._gain_text = QLabel(self)
        self._gain_text.setMinimumWidth(44)
        bar.addSpacing(8)
        bar.addWidget(self.gain)
        bar.addWidget(self._gain_text)
        self.area = Curtain(self)
        self.status = StatusLine(self)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addLayout(bar)
        layout.addWidget(self.area, 1)
        layout.addWidget(self.status)
        self._show_mode()

    # -- what is compared -----------------------------------------------------------------------------------------

    @property
    def mode(self) -> str:
        """A key of MODES."""
        checked = self._modes.checkedButton()
        return str(checked.property("mode")) if checked is not None else "side"

    def set_mode(self, mode: str) -> None:
        """Show another way to compare, a key of MODES."""
        for button in self._modes.buttons():
            button.setChecked(button.property("mode") == mode)
        self._show_mode()

    def keep(self) -> None:
        """Keep the picture that A shows, and compare with it."""
        picture = self.pictures[0]
        if picture is None:
            return
        self.kept = picture.image
        self._fill()
        self.boxes[1].setCurrentIndex(self.boxes[1].findData(KEPT))
        self._settle.start()

    def _fill(self, _: Any = None) -> None:
        views = views_of(self.session.network.flatten(), None)
        for place, box in enumerate(self.boxes):
            entries = [(path, path) for path in views]
            if place == 1 and self.kept is not None:
                entries.append(("Kept picture", KEPT))
            if [(box.itemText(i), box.itemData(i)) for i in range(box.count())] == entries:
                continue
            before = box.currentData()
            box.blockSignals(True)
            box.clear()
            for label, data in entries:
                box.addItem(label, data)
            found = box.findData(before)
            box.setCurrentIndex(found if found >= 0 else min(place, len(entries) - 1))
            box.blockSignals(False)
            self._settle.start()

    def _restart(self) -> None:
        self.kept, self.pictures = None, [None, None]
        self._fill()
        self._settle.start()

    def _sources(self) -> list[str]:
        return [str(box.currentData() or "") for box in self.boxes]

    def _watch(self) -> None:
        if not self.isVisible():
            return
        ratio = self.devicePixelRatioF()
        width = self.area.width() / 2 if self.mode == "side" else self.area.width()
        size = (max(1, round(width * ratio)), max(1, round(self.area.height() * ratio)))
        if self.kept is not None and KEPT in self._sources():
            size = self.kept.size  # what is compared has one size
        for place, source in enumerate(self._sources()):
            if source == KEPT:
                self.session.unwatch(self._channels[place])
                self._make(place, self.kept)
            elif source and source in self.session.network:
                self.session.watch(self._channels[place], source, size)

    def _answered(self, channel: object, report: Report) -> None:
        for place, own in enumerate(self._channels):
            if channel is own:
                values = report.shown.get(self._sources()[place], {}).values()
                self._make(place, next((value for value in values if isinstance(value, Image)), None))

    def _make(self, place: int, image: Image | None) -> None:
        self._newest[place] += 1
        number = self._newest[place]
        if image is None:
            self._take(place, number, None)
            return
        background = linear(QColor(VIEWPORT))
        self.session.work(lambda: shown(image, background), lambda made: self._take(place, number, made))

    def _take(self, place: int, number: int, made: Shown | None) -> None:
        if number == self._newest[place]:
            self.pictures[place] = made
            self._compare()

    def _show_mode(self) -> None:
        difference = self.mode == "difference"
        self.gain.setVisible(difference)
        self._gain_text.setVisible(difference)
        if hasattr(self, "_settle"):
            self._settle.start()
            self._compare()

    # -- how they differ ------------------------------------------------------------------------------------------

    def _compare(self) -> None:
        a, b = self.pictures
        factor = 10.0 ** (self.gain.value() / 10.0)
        self._gain_text.setText(f"× {factor:.3g}")
        self.area.show_pictures(self.mode, a.picture if a else None, b.picture if b else None)
        self.figures = {}
        if a is None or b is None:
            self.status.setText("")
            return
        if a.size != b.size or a.image.channels != b.image.channels:
            self.status.setText("These pictures have no common size, so they cannot be measured.")
            return
        self._newest[2] += 1
        number = self._newest[2]
        self.session.work(lambda: measured(a.image, b.image, factor), lambda found: self._told(number, found))

    def _told(self, number: int, found: tuple[dict[str, float], QImage] | None) -> None:
        if number != self._newest[2] or found is None:
            return
        self.figures, picture = found
        self.status.setText("A against B:   " + figures_text(self.figures))
        if self.mode == "difference":
            self.area.show_pictures(self.mode, picture, None)

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._settle.start()

    def showEvent(self, event: QEvent) -> None:
        self._settle.start()

    def hideEvent(self, event: QEvent) -> None:
        self._settle.stop()
        for channel in self._channels:
            self.session.unwatch(channel)


class Curtain(QWidget):
    """Two pictures beside each other, or the one drawn over the other as far as the grip is pulled."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.mode = "side"
        self.split = 0.5
        self._pictures: tuple[QImage | None, QImage | None] = (None, None)
        self.setMinimumSize(96, 64)
        self.setMouseTracking(True)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)

    def show_pictures(self, mode: str, a: QImage | None, b: QImage | None) -> None:
        """Show two pictures in a mode of `CompareView`."""
        self.mode, self._pictures = mode, (a, b)
        self.setCursor(Qt.CursorShape.SplitHCursor if mode == "wipe" else Qt.CursorShape.ArrowCursor)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        painter.fillRect(self.rect(), QColor(VIEWPORT))
        whole = QRectF(self.rect())
        a, b = self._pictures
        if self.mode == "side":
            half = whole.width() / 2
            self._draw(painter, a, QRectF(0, 0, half - 1, whole.height()), "A")
            self._draw(painter, b, QRectF(half + 1, 0, half - 1, whole.height()), "B")
        elif self.mode == "wipe":
            place = whole.width() * self.split
            painter.setClipRect(QRectF(0, 0, place, whole.height()))
            self._draw(painter, a, whole, "A")
            painter.setClipRect(QRectF(place, 0, whole.width() - place, whole.height()))
            self._draw(painter, b, whole, "B", right=True)
            painter.setClipping(False)
            painter.setPen(QColor(255, 255, 255, 200))
            painter.drawLine(QLineF(place, 0, place, whole.height()))
            painter.setRenderHint(QPainter.RenderHint.Antialiasing)
            painter.setBrush(QColor(255, 255, 255, 230))
            painter.setPen(QColor(0, 0, 0, 120))
            painter.drawEllipse(QPointF(place, whole.height() / 2), GRIP, GRIP)
        else:
            self._draw(painter, a, whole, "")

    def _draw(self, painter: QPainter, picture: QImage | None, room: QRectF, letter: str, right: bool = False) -> None:
        if picture is not None and not picture.isNull():
            scale = min(room.width() / picture.width(), room.height() / picture.height())
            size = (picture.width() * scale, picture.height() * scale)
            corner = room.center() - QPointF(size[0] / 2, size[1] / 2)
            painter.drawImage(QRectF(corner.x(), corner.y(), *size), picture)
        if letter:
            tag = QRectF(room.right() - 30 if right else room.left() + 8, room.top() + 8, 22, 22)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(0, 0, 0, 150))
            painter.drawRoundedRect(tag, 4, 4)
            painter.setPen(QColor(255, 255, 255))
            painter.drawText(tag, Qt.AlignmentFlag.AlignCenter, letter)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._pull(event)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        self._pull(event)

    def _pull(self, event: QMouseEvent) -> None:
        if self.mode == "wipe" and event.buttons() & Qt.MouseButton.LeftButton:
            self.split = min(max(event.position().x() / max(self.width(), 1), 0.0), 1.0)
            self.update()


def measured(a: Image, b: Image, gain: float) -> tuple[dict[str, float], QImage]:
    """The errors of ``a`` against ``b``, and their absolute difference times ``gain`` as a picture."""
    difference: Array = np.abs(np.asarray(a.color, np.float32) - np.asarray(b.color, np.float32)) * np.float32(gain)
    seen = difference[..., :3] if a.channels == 4 else np.repeat(difference[..., :1], 3, axis=2)
    return errors(a, b), opaque(encoded(seen))


def figures_text(figures: dict[str, float]) -> str:
    """The figures of an image measure, in words."""
    if figures.get("max") == 0.0:
        return "equal, bit by bit"
    told = [form.format(figures[name]) for name, form in FIGURES.items() if math.isfinite(figures.get(name, math.nan))]
    return "   ".join(told)
