"""Icons of the views and the timeline: own SVG, drawn in the colour of the text around them."""

from __future__ import annotations

from functools import cache
from pathlib import Path

from PySide6.QtCore import QByteArray, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QIcon, QImage, QPainter, QPalette, QPixmap
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QStyleOptionToolButton, QToolButton, QWidget

SIZE = 20


@cache
def _drawn(name: str, color: str, scale: int) -> QImage:
    text = (Path(__file__).parent / f"{name}.svg").read_text("utf-8").replace("currentColor", color)
    image = QImage(SIZE * scale, SIZE * scale, QImage.Format.Format_ARGB32_Premultiplied)
    image.fill(Qt.GlobalColor.transparent)
    painter = QPainter(image)
    QSvgRenderer(QByteArray(text.encode())).render(painter, QRectF(0, 0, SIZE * scale, SIZE * scale))
    painter.end()
    return image


def icon(name: str, palette: QPalette) -> QIcon:
    """An icon in the colours of a palette, for what is usable and for what is not."""
    made = QIcon()
    for mode, group in (
        (QIcon.Mode.Normal, QPalette.ColorGroup.Active),
        (QIcon.Mode.Disabled, QPalette.ColorGroup.Disabled),
    ):
        color: QColor = palette.color(group, QPalette.ColorRole.ButtonText)
        for scale in (1, 2):
            pixmap = QPixmap.fromImage(_drawn(name, color.name(), scale))
            pixmap.setDevicePixelRatio(scale)
            made.addPixmap(pixmap, mode)
    return made


class IconButton(QToolButton):
    """A flat button with an icon of its own that follows the theme. ``shown`` may be set to another icon's name."""

    def __init__(self, name: str, tip: str, parent: QWidget | None = None, *, checkable: bool = False) -> None:
        super().__init__(parent)
        self._name = name
        self.setAutoRaise(True)
        self.setCheckable(checkable)
        self.setToolTip(tip)
        self.setAccessibleName(tip.partition(" (")[0])
        self.setIconSize(QSize(SIZE, SIZE))
        self.setFixedHeight(28)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setIcon(icon(name, self.palette()))

    def show_icon(self, name: str) -> None:
        """Show another icon."""
        if name != self._name:
            self._name = name
            self.setIcon(icon(name, self.palette()))

    def initStyleOption(self, option: QStyleOptionToolButton) -> None:
        super().initStyleOption(option)
        option.features &= ~QStyleOptionToolButton.ToolButtonFeature.HasMenu  # no arrow in the corner of the icon

    def changeEvent(self, event: object) -> None:
        from PySide6.QtCore import QEvent

        if isinstance(event, QEvent):
            if event.type() in (QEvent.Type.PaletteChange, QEvent.Type.StyleChange):
                self.setIcon(icon(self._name, self.palette()))
            super().changeEvent(event)
