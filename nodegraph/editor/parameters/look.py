"""Measures and colours that the widgets of parameters share; colours come from the palette, so a theme reaches them."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from PySide6.QtCore import QByteArray, QRectF, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPalette, QPixmap
from PySide6.QtWidgets import QLabel

ROW_HEIGHT = 26
LABEL_WIDTH = 116
GAP = 6
RADIUS = 4.0

_ICONS = Path(__file__).parent / "icons"


def blend(a: QColor, b: QColor, share: float) -> QColor:
    """``share`` of ``b`` in ``a``."""
    keep = 1.0 - share
    return QColor.fromRgbF(
        a.redF() * keep + b.redF() * share, a.greenF() * keep + b.greenF() * share, a.blueF() * keep + b.blueF() * share
    )


def ink(palette: QPalette, share: float = 1.0, enabled: bool = True) -> QColor:
    """The colour of text; with a share below 1 it fades into what it stands on."""
    group = QPalette.ColorGroup.Active if enabled else QPalette.ColorGroup.Disabled
    text = palette.color(group, QPalette.ColorRole.WindowText)
    return blend(palette.color(QPalette.ColorRole.Window), text, share)


def accent(palette: QPalette, enabled: bool = True) -> QColor:
    """What marks the part that the user holds."""
    color = palette.color(QPalette.ColorGroup.Active, QPalette.ColorRole.Highlight)
    return color if enabled else blend(color, palette.color(QPalette.ColorRole.Window), 0.6)


def caption(text: str = "") -> QLabel:
    """A label that stays behind what it names."""
    label = QLabel(text)
    label.setForegroundRole(QPalette.ColorRole.PlaceholderText)
    return label


def complaint() -> QLabel:
    """A label for errors, hidden until there is one."""
    label = QLabel()
    label.setForegroundRole(QPalette.ColorRole.BrightText)
    label.setWordWrap(True)
    label.hide()
    return label


def icon(name: str, color: QColor, size: int = 16) -> QIcon:
    """One of the SVG icons in ``icons/``, drawn in a colour: they are written with ``currentColor``."""
    return _icon(name, color.name(), size)


@lru_cache(maxsize=256)
def _icon(name: str, color: str, size: int) -> QIcon:
    from PySide6.QtSvg import QSvgRenderer

    svg = (_ICONS / f"{name}.svg").read_text(encoding="utf-8").replace("currentColor", color)
    renderer = QSvgRenderer(QByteArray(svg.encode()))
    made = QIcon()
    for scale in (1, 2):
        pixmap = QPixmap(size * scale, size * scale)
        pixmap.fill(Qt.GlobalColor.transparent)
        painter = QPainter(pixmap)
        renderer.render(painter, QRectF(pixmap.rect()))
        painter.end()
        pixmap.setDevicePixelRatio(scale)
        made.addPixmap(pixmap)
    return made


def name_text(name: str) -> str:
    """``reference_length`` as a person would write it."""
    text = name.replace("_", " ").strip()
    return text[:1].upper() + text[1:]
