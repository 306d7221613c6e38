"""Light and dark: one palette and one style sheet for the whole program, and icons in the colour of text.

Widgets take their colours from the palette and repaint when it changes; nobody asks for the theme's name.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

from PySide6.QtCore import QByteArray, QRectF, Qt
from PySide6.QtGui import QColor, QIcon, QPainter, QPalette, QPixmap
from PySide6.QtWidgets import QApplication

_ICONS = Path(__file__).parent / "icons"


@dataclass(frozen=True, slots=True)
class Theme:
    """The colours of one theme, each "#rrggbb".

    window: of docks and bars. field: where one types and lists stand. raised: buttons. line: between things.
    """

    window: str
    field: str
    raised: str
    hover: str
    line: str
    text: str
    dim: str
    accent: str
    on_accent: str
    error: str
    warning: str


DARK = Theme(
    window="#22252a",
    field="#1a1c20",
    raised="#30343b",
    hover="#3a3f48",
    line="#3a3e46",
    text="#e4e6ea",
    dim="#979ea9",
    accent="#3d8fd6",
    on_accent="#ffffff",
    error="#ff8a80",
    warning="#e6b450",
)
LIGHT = Theme(
    window="#f4f5f7",
    field="#ffffff",
    raised="#ffffff",
    hover="#e7eaef",
    line="#d3d7dd",
    text="#1d2025",
    dim="#626a75",
    accent="#1f6fb8",
    on_accent="#ffffff",
    error="#b3261e",
    warning="#8a5a00",
)
THEMES = {"dark": DARK, "light": LIGHT}


def theme_of(palette: QPalette) -> Theme:
    """The theme that a palette belongs to."""
    window, text = palette.color(QPalette.ColorRole.Window), palette.color(QPalette.ColorRole.WindowText)
    return DARK if window.lightness() < text.lightness() else LIGHT


def system_theme() -> str:
    """ "dark" or "light", as the desktop wishes; dark where it does not say."""
    hints = QApplication.styleHints()
    return "light" if hints.colorScheme() == Qt.ColorScheme.Light else "dark"


def apply(app: QApplication, name: str) -> None:
    """Dress the program: "dark", "light", or "system"."""
    theme = THEMES[system_theme() if name == "system" else name]
    if app.property("dressed") is None:
        app.setStyle("Fusion")
        app.setProperty("dressed", True)
    app.setPalette(palette_of(theme))
    app.setStyleSheet(_sheet(theme))


def palette_of(theme: Theme) -> QPalette:
    """The palette of a theme."""
    role, made = QPalette.ColorRole, QPalette()
    colors = {
        role.Window: theme.window,
        role.WindowText: theme.text,
        role.Base: theme.field,
        role.AlternateBase: theme.window,
        role.Text: theme.text,
        role.PlaceholderText: theme.dim,
        role.Button: theme.raised,
        role.ButtonText: theme.text,
        role.ToolTipBase: theme.raised,
        role.ToolTipText: theme.text,
        role.Highlight: theme.accent,
        role.HighlightedText: theme.on_accent,
        role.Link: theme.accent,
        role.Mid: theme.line,
        role.Midlight: theme.hover,
        role.Light: theme.hover,
        role.Dark: theme.line,
        role.Shadow: "#000000",
        role.BrightText: theme.error,
    }
    for one, color in colors.items():
        made.setColor(one, QColor(color))
    for one in (role.WindowText, role.Text, role.ButtonText):
        faded = QColor(theme.dim)
        faded.setAlphaF(0.6)
        made.setColor(QPalette.ColorGroup.Disabled, one, faded)
    return made


def icon(name: str, palette: QPalette, size: int = 16) -> QIcon:
    """One of the SVG icons in ``icons/``, in the colour of text, and paler where it is disabled."""
    return _icon(name, theme_of(palette), size)


@cache
def _icon(name: str, theme: Theme, size: int) -> QIcon:
    made, modes = QIcon(), QIcon.Mode
    for mode, color in ((modes.Normal, theme.text), (modes.Selected, theme.on_accent), (modes.Disabled, theme.line)):
        for scale in (1, 2):
            pixmap = drawn(name, color, size * scale)
            pixmap.setDevicePixelRatio(scale)
            made.addPixmap(pixmap, mode)
    return made


def drawn(name: str, color: str, pixels: int) -> QPixmap:
    """An icon in one colour; the files are written with ``currentColor``."""
    from PySide6.QtSvg import QSvgRenderer

    svg = (_ICONS / f"{name}.svg").read_text(encoding="utf-8").replace("currentColor", color)
    pixmap = QPixmap(pixels, pixels)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    QSvgRenderer(QByteArray(svg.encode())).render(painter, QRectF(pixmap.rect()))
    painter.end()
    return pixmap


def _sheet(theme: Theme) -> str:
    name = next(name for name, one in THEMES.items() if one is theme)
    arrows = _ICONS.as_posix()  # a style sheet takes pictures from files only
    return f"""
QMainWindow::separator {{ background: {theme.line}; width: 1px; height: 1px; }}
QMainWindow::separator:hover {{ background: {theme.accent}; }}
QDockWidget {{ color: {theme.text}; }}
QDockWidget::title {{ background: {theme.window}; padding: 6px 10px; border-bottom: 1px solid {theme.line};
    text-align: left; }}
QMenuBar {{ background: {theme.window}; border-bottom: 1px solid {theme.line}; padding: 1px 4px; }}
QMenuBar::item {{ padding: 4px 9px; border-radius: 4px; }}
QMenuBar::item:selected {{ background: {theme.hover}; }}
QMenu {{ background: {theme.window}; border: 1px solid {theme.line}; padding: 4px; }}
QMenu::item {{ padding: 5px 28px 5px 10px; border-radius: 4px; }}
QMenu::item:selected {{ background: {theme.accent}; color: {theme.on_accent}; }}
QMenu::item:disabled {{ color: {theme.dim}; background: transparent; }}
QMenu::icon {{ padding-left: 8px; }}
QMenu::separator {{ height: 1px; background: {theme.line}; margin: 4px 6px; }}
QToolBar {{ background: {theme.window}; border: none; border-bottom: 1px solid {theme.line}; padding: 3px 6px;
    spacing: 2px; }}
QToolBar::separator {{ background: {theme.line}; width: 1px; margin: 4px 6px; }}
QToolBar QToolButton {{ padding: 5px; border-radius: 4px; border: none; background: transparent; }}
QToolBar QToolButton:hover {{ background: {theme.hover}; }}
QToolBar QToolButton:pressed, QToolBar QToolButton:checked {{ background: {theme.line}; }}
QStatusBar {{ background: {theme.window}; border-top: 1px solid {theme.line}; color: {theme.dim}; }}
QStatusBar::item {{ border: none; }}
QStatusBar QLabel {{ color: {theme.dim}; padding: 0 6px; }}
QPushButton {{ background: {theme.raised}; color: {theme.text}; border: 1px solid {theme.line}; border-radius: 5px;
    padding: 5px 10px; }}
QPushButton:hover {{ background: {theme.hover}; }}
QPushButton:pressed {{ background: {theme.line}; }}
QPushButton:focus {{ border-color: {theme.accent}; }}
QPushButton:disabled {{ color: {theme.dim}; }}
QProgressBar {{ background: {theme.line}; border: none; border-radius: 3px; }}
QProgressBar::chunk {{ background: {theme.accent}; border-radius: 3px; }}
QTabBar {{ qproperty-drawBase: 0; background: {theme.window}; }}
QTabBar::tab {{ background: transparent; color: {theme.dim}; padding: 6px 12px; border: none;
    border-bottom: 2px solid transparent; }}
QTabBar::tab:hover {{ color: {theme.text}; }}
QTabBar::tab:selected {{ color: {theme.text}; border-bottom: 2px solid {theme.accent}; }}
QTreeView, QListView, QTableView, QTextBrowser, QPlainTextEdit {{ background: {theme.field}; border: none;
    outline: none; selection-background-color: {theme.accent}; selection-color: {theme.on_accent}; }}
QTreeView::item, QListView::item {{ padding: 3px 4px; }}
QTreeView::item:hover:!selected, QListView::item:hover:!selected {{ background: {theme.hover}; }}
QTreeView::item:selected, QListView::item:selected {{ background: {theme.accent}; color: {theme.on_accent}; }}
QHeaderView {{ background: {theme.window}; }}
QHeaderView::section {{ background: {theme.window}; color: {theme.dim}; padding: 5px 8px; border: none;
    border-bottom: 1px solid {theme.line}; }}
QToolTip {{ background: {theme.raised}; color: {theme.text}; border: 1px solid {theme.line}; padding: 4px 6px; }}
QLineEdit, QComboBox, QSpinBox, QDoubleSpinBox {{ background: {theme.field}; color: {theme.text};
    border: 1px solid {theme.line}; border-radius: 4px; padding: 2px 6px; min-height: 18px;
    selection-background-color: {theme.accent}; selection-color: {theme.on_accent}; }}
QLineEdit:focus, QComboBox:focus, QSpinBox:focus, QDoubleSpinBox:focus {{ border-color: {theme.accent}; }}
QLineEdit:disabled, QComboBox:disabled, QSpinBox:disabled, QDoubleSpinBox:disabled {{ color: {theme.dim};
    background: {theme.window}; }}
QComboBox {{ background: {theme.raised}; }}
QComboBox:hover {{ background: {theme.hover}; }}
QComboBox::drop-down {{ border: none; width: 18px; }}
QComboBox::down-arrow, QSpinBox::down-arrow, QDoubleSpinBox::down-arrow {{ width: 10px; height: 10px;
    image: url({arrows}/down_{name}.svg); }}
QSpinBox::up-arrow, QDoubleSpinBox::up-arrow {{ width: 10px; height: 10px; image: url({arrows}/up_{name}.svg); }}
QComboBox QAbstractItemView {{ background: {theme.raised}; border: 1px solid {theme.line}; padding: 2px; outline: none;
    selection-background-color: {theme.accent}; selection-color: {theme.on_accent}; }}
QSpinBox::up-button, QSpinBox::down-button, QDoubleSpinBox::up-button, QDoubleSpinBox::down-button {{ border: none;
    background: transparent; width: 16px; }}
QLineEdit#search {{ background: {theme.field}; border: 1px solid {theme.line}; border-radius: 5px; padding: 5px 8px; }}
QLineEdit#search:focus {{ border-color: {theme.accent}; }}
QFrame#command_palette {{ background: {theme.window}; border: 1px solid {theme.line}; border-radius: 8px; }}
QFrame#banner {{ background: {theme.raised}; border: none; border-bottom: 1px solid {theme.line}; }}
QLabel[dim="true"] {{ color: {theme.dim}; }}
QFrame#line {{ background: {theme.line}; border: none; max-height: 1px; min-height: 1px; }}
QScrollBar:vertical {{ background: transparent; width: 10px; margin: 0; }}
QScrollBar:horizontal {{ background: transparent; height: 10px; margin: 0; }}
QScrollBar::handle {{ background: {theme.line}; border-radius: 4px; margin: 1px; min-height: 24px; min-width: 24px; }}
QScrollBar::handle:hover {{ background: {theme.dim}; }}
QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; }}
QScrollBar::add-page, QScrollBar::sub-page {{ background: transparent; }}
"""


def disc(color: str, pixels: int) -> QPixmap:
    """A filled disc, as the plug of a port looks."""
    pixmap = QPixmap(pixels * 2, pixels * 2)
    pixmap.fill(Qt.GlobalColor.transparent)
    painter = QPainter(pixmap)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(color))
    painter.drawEllipse(QRectF(3, 3, pixels * 2 - 6, pixels * 2 - 6))
    painter.end()
    pixmap.setDevicePixelRatio(2)
    return pixmap
