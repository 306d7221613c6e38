"""Every picture that flows through the network: its channels, its pixels, at any zoom."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QListWidget,
    QListWidgetItem,
    QSplitter,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from nodegraph.data import Image
from nodegraph.editor.views.front import in_front
from nodegraph.editor.views.icons import IconButton
from nodegraph.editor.views.pick import color_name
from nodegraph.editor.views.picture_area import PictureArea
from nodegraph.editor.views.shown import Shown, channels_of, shown
from nodegraph.editor.views.status_line import StatusLine

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

PORT = Qt.ItemDataRole.UserRole
NAMES = {"color": "Colour", "alpha": "Alpha", "depth": "Depth", "ids": "Ids"}


class ImageBrowser(QWidget):
    """A list of all outputs that are pictures, and the chosen one. It asks for nothing: it shows what is kept."""

    def __init__(self, session: Session, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.session = session
        self.shown: Shown | None = None
        self._image: Image | None = None
        self._newest = 0
        self._lay_out()
        self._soon = QTimer(self, singleShot=True, interval=0)
        self._soon.timeout.connect(self.refresh)
        self.list.currentItemChanged.connect(lambda *_: self._show())
        self.channel.currentIndexChanged.connect(lambda _: self._show_channel())
        self.area.hovered.connect(self._hover)
        for signal in (session.changed, session.replaced, session.values_changed):
            signal.connect(self._later)
        session.selected.connect(self._follow)
        self.refresh()

    def _lay_out(self) -> None:
        self.list = QListWidget(self)
        self.list.setUniformItemSizes(True)
        self.list.setMinimumWidth(120)
        self.channel = QComboBox(self)
        self.channel.setMinimumWidth(100)
        self.area = PictureArea(self)
        fit = IconButton("fit", "Fit (F)", self)
        fit.clicked.connect(self.area.fit)
        actual = QToolButton(self)
        actual.setText("1:1")
        actual.setAutoRaise(True)
        actual.setFixedHeight(28)
        actual.setToolTip("One pixel of the picture as one of the screen")
        actual.clicked.connect(self.area.actual_size)
        self.facts = StatusLine(self, quiet=True)
        self.status = StatusLine(self)
        bar = QHBoxLayout()
        bar.setContentsMargins(4, 2, 8, 2)
        bar.setSpacing(4)
        bar.addWidget(self.channel)
        bar.addWidget(fit)
        bar.addWidget(actual)
        bar.addWidget(self.facts, 1)
        right = QWidget(self)
        column = QVBoxLayout(right)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        column.addLayout(bar)
        column.addWidget(self.area, 1)
        column.addWidget(self.status)
        splitter = QSplitter(Qt.Orientation.Horizontal, self)
        splitter.addWidget(self.list)
        splitter.addWidget(right)
        splitter.setStretchFactor(1, 1)
        splitter.setSizes([160, 480])
        splitter.setChildrenCollapsible(False)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(splitter)

    # -- the list -------------------------------------------------------------------------------------------------

    def refresh(self) -> None:
        """List the outputs anew; the chosen one stays chosen."""
        names = image_ports(self.session)
        if names != [self.list.item(row).data(PORT) for row in range(self.list.count())]:
            before = self.port
            self.list.blockSignals(True)
            self.list.clear()
            for name in names:
                item = QListWidgetItem(name)
                item.setData(PORT, name)
                self.list.addItem(item)
            if names:
                self.list.setCurrentRow(names.index(before) if before in names else len(names) - 1)
            self.list.blockSignals(False)
        self._show()

    @property
    def port(self) -> str:
        """``node.output`` of what is shown, empty for none."""
        item = self.list.currentItem()
        return str(item.data(PORT)) if item is not None else ""

    def choose(self, port: str) -> None:
        """Show an output."""
        for row in range(self.list.count()):
            if self.list.item(row).data(PORT) == port:
                self.list.setCurrentRow(row)

    def _follow(self, selection: tuple[str, ...]) -> None:
        """Show the picture of the node that was selected."""
        for port in image_ports(self.session):
            if selection and port.rpartition(".")[0] == selection[0] and self.port.rpartition(".")[0] != selection[0]:
                self.choose(port)

    def _later(self, _: Any = None) -> None:
        if in_front(self):
            self._soon.start()

    def set_in_front(self, front: bool) -> None:
        """Look anew when it comes to the front."""
        if front:
            self._soon.start()

    def showEvent(self, event: object) -> None:
        self._soon.start()

    # -- the picture ----------------------------------------------------------------------------------------------

    def _show(self) -> None:
        path, _, output = self.port.rpartition(".")
        value = self.session.value(path, output) if path and path in self.session.network else None
        if not isinstance(value, Image):
            self._image, self.shown = None, None
            self._newest += 1
            self.area.show_picture(None)
            self.area.show_note("No picture of this output is kept." if path else "No node has a picture.")
            self.facts.setText("")
            self.channel.setEnabled(False)
            return
        if value is self._image:
            return
        self._image = value
        self.channel.setEnabled(True)
        there = channels_of(value)
        before = self.channel.currentData()
        self.channel.blockSignals(True)
        self.channel.clear()
        for name in there:
            self.channel.addItem("Value" if name == "color" and value.channels != 4 else NAMES[name], name)
        self.channel.setCurrentIndex(there.index(before) if before in there else 0)
        self.channel.blockSignals(False)
        self._show_channel()

    def _show_channel(self) -> None:
        image, channel = self._image, str(self.channel.currentData() or "color")
        if image is None:
            return
        self._newest += 1
        number = self._newest
        self.session.work(
            lambda: shown(image, None, channel), lambda made: self._take(number, channel, made), self.area
        )

    def _take(self, number: int, channel: str, made: Shown | None) -> None:
        if number != self._newest:
            return
        self.shown = made
        if made is None:
            self.area.show_note("The numbers of this picture could not be read.")
            return
        self.area.show_note("")
        self.area.show_picture(made.picture)
        text = f"{made.size[0]} × {made.size[1]}"
        if channel != "alpha" and (channel != "color" or made.image.channels != 4):
            text += f"   black {made.low:.5g}   white {made.high:.5g}"
        self.facts.setText(text)

    def _hover(self, pixel: tuple[int, int] | None) -> None:
        self.status.setText(pixel_text(self.shown.image, pixel) if pixel is not None and self.shown is not None else "")

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_F, Qt.Key.Key_Home):
            self.area.fit()
        else:
            super().keyPressEvent(event)


def image_ports(session: Session) -> list[str]:
    """All outputs ``node.output`` that are pictures, in the order in which they are computed."""
    found = []
    for path, node in session.network.flatten().nodes.items():
        for name, port in (node.processor.outputs if node.processor is not None else {}).items():
            if isinstance(port.type, type) and issubclass(port.type, Image):
                found.append(f"{path}.{name}")
    return found


def pixel_text(image: Image, pixel: tuple[int, int]) -> str:
    """What an image has at a pixel, in full."""
    column, row = pixel
    if not (0 <= column < image.size[0] and 0 <= row < image.size[1]):
        return ""
    numbers = ", ".join(f"{float(number):.5g}" for number in np.asarray(image.color)[row, column])
    text = f"{column}, {row}   {color_name(image.channels)} {numbers}"
    if image.depth is not None:
        text += f"   depth {float(image.depth[row, column]):.5g} mm"
    if image.ids is not None:
        text += f"   id {int(image.ids[row, column])}"
    return text
