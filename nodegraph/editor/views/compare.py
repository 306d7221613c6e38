"""Two pictures against each other: side by side, behind a curtain that is drawn, or their measured difference."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QColor, QImage, QResizeEvent
from PySide6.QtWidgets import QButtonGroup, QComboBox, QHBoxLayout, QLabel, QSlider, QVBoxLayout, QWidget

from nodegraph.accuracy.measures import errors
from nodegraph.accuracy.settings import snapshot
from nodegraph.data import Image
from nodegraph.data.buffer import Array
from nodegraph.editor.quality.measuring import bounded, referred
from nodegraph.editor.quality.words import said
from nodegraph.editor.views.curtain import Curtain
from nodegraph.editor.views.front import in_front
from nodegraph.editor.views.icons import IconButton
from nodegraph.editor.views.shown import VIEWPORT, Shown, encoded, linear, opaque, shown
from nodegraph.editor.views.status_line import StatusLine
from nodegraph.errors import Cancelled, one_sentence
from nodegraph.pictures import views_of

if TYPE_CHECKING:
    from nodegraph.accuracy.reference import Reference
    from nodegraph.commands import Command
    from nodegraph.editor.mailbox import Task
    from nodegraph.editor.session import Session
    from nodegraph.flat import Flat
    from nodegraph.report import Report

KEPT, REFERENCE = "\0kept", "\0reference"
"""Stand for the kept picture, and for the reference of A, among the views."""
SIDE = 192
"""Longest side, in pixels, of what is compared with a reference, which takes seconds."""
LATER = 600
"""Milliseconds without a change before a reference is begun."""

MODES = {"side": "Side by side", "wipe": "Wipe", "difference": "Difference"}
FIGURES = {"max": "max {:.4g}", "rmse": "RMSE {:.4g}", "psnr": "PSNR {:.1f} dB", "p999": "99.9 % below {:.4g}"}


class CompareView(QWidget):
    """Compares A with B. Each is a view or another picture of the network; B may be a picture of A that was kept, so
    that a change can be judged, or the reference of A in double precision.
    """

    def __init__(self, session: Session, first: str = "", second: str = "", parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.pictures: list[Shown | None] = [None, None]
        self.kept: Image | None = None
        self.figures: dict[str, float] = {}
        self._channels = (object(), object())
        self._newest = [0, 0, 0]
        self._drafts = [False, False]
        self._difference: QImage | None = None
        self._reference: Reference | None = None
        self._task: Task[Reference] | None = None
        self._lay_out()
        self._settle = QTimer(self, singleShot=True, interval=80)
        self._settle.timeout.connect(self._watch)
        self._later = QTimer(self, singleShot=True, interval=LATER)
        self._later.timeout.connect(self._refer)
        session.answered.connect(self._answered)
        session.changed.connect(self._changed)
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
        flat = self.session.network.flatten()
        there, views = pictures_in(flat), len(views_of(flat, None))
        for place, box in enumerate(self.boxes):
            entries = [(path, path) for path in there]
            if place == 1 and self.kept is not None:
                entries.append(("Kept picture", KEPT))
            if place == 1 and there:
                entries.append(("Reference of A", REFERENCE))
            if [(box.itemText(i), box.itemData(i)) for i in range(box.count())] == entries:
                continue
            before = box.currentData()
            box.blockSignals(True)
            box.clear()
            for label, data in entries:
                box.addItem(label, data)
            found = box.findData(before)
            box.setCurrentIndex(found if found >= 0 else min(place, views - 1))
            box.blockSignals(False)
            self._settle.start()

    def _restart(self) -> None:
        self.kept, self.pictures = None, [None, None]
        self._fill()
        self._settle.start()

    def _sources(self) -> list[str]:
        return [str(box.currentData() or "") for box in self.boxes]

    def _changed(self, commands: list[Command]) -> None:
        self._fill()
        if any(command.touched or command.structural for command in commands):
            self._drop_reference()

    def _watch(self) -> None:
        if not in_front(self):
            return
        a, b = self._sources()
        ratio = self.devicePixelRatioF()
        width = self.area.width() / 2 if self.mode == "side" else self.area.width()
        size = (max(1, round(width * ratio)), max(1, round(self.area.height() * ratio)))
        if self.kept is not None and b == KEPT:
            size = self.kept.size  # what is compared has one size
        if b == REFERENCE:
            size = bounded(size, SIDE)
        for place, source in enumerate((a, b)):
            if source in (KEPT, REFERENCE):
                self.session.unwatch(self._channels[place])
                self._drafts[place] = False
                self._make(place, self.kept if source == KEPT else None)
            elif source in self.session.network or isinstance(self.session.network.flatten().source(source), tuple):
                self.session.watch(self._channels[place], source, size)
        self.area.show_note("" if a else "There is no picture to compare.")
        self._drop_reference()

    def _answered(self, channel: object, report: Report) -> None:
        for place, own in enumerate(self._channels):
            if channel is own:
                values = report.shown.get(self._sources()[place], {}).values()
                self._drafts[place] = self.session.quality(channel) != "final"
                self._make(place, next((value for value in values if isinstance(value, Image)), None))

    # -- the reference ----------------------------------------------------------------------------------------------

    def _drop_reference(self) -> None:
        """Forget the reference, and make another one when nothing changes for a moment."""
        if self._task is not None:
            self._task.cancel()
            self._task = None
        self._reference = None
        if self._sources()[1] == REFERENCE and in_front(self):
            self._make(1, None)
            self._later.start()

    def _refer(self) -> None:
        a, b = self._sources()
        picture = self.pictures[0]
        if b != REFERENCE or not in_front(self) or self.session.in_gesture or picture is None or self._drafts[0]:
            if b == REFERENCE and in_front(self):
                self._later.start()  # what it is compared with is not there yet
            return
        work = partial(referred, snapshot(self.session.network), a, picture.size, self.session.precise)

        def take(outcome: Reference | BaseException) -> None:
            if task is not self._task:
                return
            self._task = None
            if isinstance(outcome, BaseException):
                self.area.show_note("" if isinstance(outcome, Cancelled) else said(one_sentence(outcome)))
                self.status.setText("")
                return
            self._reference = outcome
            self._make(1, outcome.value if isinstance(outcome.value, Image) else None)

        def tell(text: str, _: float | None) -> None:
            if task is self._task:
                self.status.setText(said(text))

        task = self._task = self.session.begin_task(work, tell, take)

    def _make(self, place: int, image: Image | None) -> None:
        self._newest[place] += 1
        number = self._newest[place]
        if image is None:
            self._take(place, number, None)
            return
        background = linear(QColor(VIEWPORT))
        self.session.work(lambda: shown(image, background), lambda made: self._take(place, number, made), self.area)

    def _take(self, place: int, number: int, made: Shown | None) -> None:
        if number == self._newest[place]:
            self.pictures[place] = made
            if made is not None and self.area.note and (place == 1 or self._sources()[1] != REFERENCE):
                self.area.show_note("")
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
        if a is None or b is None:
            self._difference = None
        if self.mode == "difference":
            self.area.show_pictures(self.mode, self._difference, None)
        else:
            self.area.show_pictures(self.mode, a.picture if a else None, b.picture if b else None)
        self.figures = {}
        if a is None or b is None:
            awaited = a is not None and self._sources()[1] == REFERENCE and not self.area.note
            self.status.setText("The reference is being made ..." if awaited else "")
            return
        if any(self._drafts):
            self.status.setText("Being refined ...")
            return
        if a.size != b.size or a.image.channels != b.image.channels:
            self.status.setText("These pictures have no common size, so they cannot be measured.")
            return
        self._newest[2] += 1
        number = self._newest[2]
        found = self._reference if self._sources()[1] == REFERENCE else None
        mask = found.mask if found is not None and found.mask is not None and found.mask.any() else None
        self.session.work(
            lambda: measured(a.image, b.image, factor, mask), lambda made: self._told(number, made), self.area
        )

    def _told(self, number: int, found: tuple[dict[str, float], QImage] | None) -> None:
        if number != self._newest[2] or found is None:
            return
        self.figures, self._difference = found
        against = "A against B"
        if self._reference is not None and self.pictures[0] is not None:
            width, height = self.pictures[0].size
            against = f"A against its reference, at {width} × {height}"
            if self._reference.left_out:
                against += f", {100 * self._reference.share_left_out:.2g} % left out"
        self.status.setText(f"{against}:   {figures_text(self.figures)}")
        if self.mode == "difference":
            self.area.show_pictures(self.mode, self._difference, None)

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._settle.start()

    def set_in_front(self, front: bool) -> None:
        """Compute while it can be seen, and not else."""
        if front:
            self._settle.start()
            return
        self._settle.stop()
        self._later.stop()
        self._drop_reference()
        for channel in self._channels:
            self.session.unwatch(channel)

    def showEvent(self, event: QEvent) -> None:
        self.set_in_front(True)

    def hideEvent(self, event: QEvent) -> None:
        self.set_in_front(False)


def pictures_in(flat: Flat) -> list[str]:
    """What can be compared: the views, then all other outputs that are pictures, ``node.output``."""
    views = views_of(flat, None)
    others = [
        f"{path}.{name}"
        for path, node in flat.nodes.items()
        if node.processor is not None and path not in views
        for name, port in node.processor.outputs.items()
        if isinstance(port.type, type) and issubclass(port.type, Image)
    ]
    return [*views, *others]


def measured(a: Image, b: Image, gain: float, mask: Array | None = None) -> tuple[dict[str, float], QImage]:
    """The errors of ``a`` against ``b``, and their absolute difference times ``gain`` as a picture.

    mask: (h, w), True where to look, None everywhere; the rest is black.
    """
    difference: Array = np.abs(np.asarray(a.color, np.float32) - np.asarray(b.color, np.float32)) * np.float32(gain)
    seen = difference[..., :3] if a.channels == 4 else np.repeat(difference[..., :1], 3, axis=2)
    if mask is not None:
        seen = np.where(mask[..., None], seen, np.float32(0.0))
    return errors(a, b, mask), opaque(encoded(seen))


def figures_text(figures: dict[str, float]) -> str:
    """The figures of an image measure, in words."""
    if figures.get("max") == 0.0:
        return "equal, bit by bit"
    told = [form.format(figures[name]) for name, form in FIGURES.items() if math.isfinite(figures.get(name, math.nan))]
    return "   ".join(told)
