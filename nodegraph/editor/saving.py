"""What dialogs share that ask where a picture or a film goes, and how large it is."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QFormLayout,
    QHBoxLayout,
    QLineEdit,
    QPushButton,
    QSpinBox,
    QVBoxLayout,
)

LARGEST = 16384


def add_place(form: QFormLayout, label: str, text: str, browse: Callable[[], None]) -> QLineEdit:
    """Add a row for a path, typed or browsed for; returns its field."""
    field = QLineEdit(text)
    field.setMinimumWidth(320)
    button = QPushButton("Browse…")
    button.clicked.connect(lambda: browse())
    row = QHBoxLayout()
    row.addWidget(field, 1)
    row.addWidget(button)
    form.addRow(label, row)
    return field


def add_size(form: QFormLayout, size: tuple[int, int], least: int = 1) -> tuple[QSpinBox, QSpinBox]:
    """Add a row for width and height in pixels; returns its two fields."""
    row = QHBoxLayout()
    width, height = QSpinBox(), QSpinBox()
    for box, side in ((width, size[0]), (height, size[1])):
        box.setRange(least, LARGEST)
        box.setSuffix(" pixels")
        box.setValue(side)
        box.setFixedWidth(130)
        row.addWidget(box)
    row.addStretch(1)
    form.addRow("Size", row)
    return width, height


def finish(dialog: QDialog, form: QFormLayout, accept: QDialogButtonBox.StandardButton) -> QPushButton:
    """Lay out a dialog: its form, and a button to accept, which is returned, beside Cancel."""
    buttons = QDialogButtonBox(accept | QDialogButtonBox.StandardButton.Cancel, dialog)
    buttons.accepted.connect(dialog.accept)
    buttons.rejected.connect(dialog.reject)
    layout = QVBoxLayout(dialog)
    layout.setSpacing(12)
    layout.addLayout(form)
    layout.addWidget(buttons)
    return buttons.button(accept)
