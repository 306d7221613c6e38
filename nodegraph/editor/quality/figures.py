"""The measured error of a view and the time of its frame, as numbers."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QLabel, QVBoxLayout, QWidget

from nodegraph.editor.profile import seconds_text
from nodegraph.editor.quality.measuring import Errors
from nodegraph.editor.quality.words import dim, said, sentence

FIGURES = {
    "max": ("Max", "The worst channel of the worst pixel, linear light"),
    "rmse": ("RMSE", "The root of the mean square over all pixels and channels"),
    "p999": ("99.9 %", "What 99.9 % of the pixels do not exceed"),
    "flip": ("FLIP", "What a person sees when the two alternate: 0 nothing, 1 the most"),
}


class Figures(QWidget):
    """Four errors, a time, and what they were measured against."""

    def __init__(self) -> None:
        super().__init__()
        self.numbers = {name: QLabel() for name in FIGURES}
        self.frame = QLabel()
        self.told = sentence()
        grid = QGridLayout()
        grid.setHorizontalSpacing(12)
        grid.setVerticalSpacing(2)
        for i, (name, label) in enumerate(self.numbers.items()):
            words, tip = FIGURES[name]
            title = dim(words)
            for one in (title, label):
                one.setToolTip(tip)
            label.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            grid.addWidget(title, i // 2, 2 * (i % 2))
            grid.addWidget(label, i // 2, 2 * (i % 2) + 1)
        frame = dim("Frame")
        frame.setToolTip("What all nodes took that ran for the last final picture on the screen")
        grid.addWidget(frame, 2, 0)
        grid.addWidget(self.frame, 2, 1, 1, 3)
        grid.setColumnStretch(1, 1)
        grid.setColumnStretch(3, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        layout.addLayout(grid)
        layout.addWidget(self.told)

    def show_frame(self, seconds: float, size: tuple[int, int] | None) -> None:
        """Show how long the picture on the screen took; nothing where there is none."""
        self.frame.setText("–" if size is None else f"{seconds_text(seconds)} at {size[0]} × {size[1]}")

    def show_errors(self, found: Errors | None, stale: bool) -> None:
        """Show errors, paler where the network was changed since."""
        for name, label in self.numbers.items():
            number = found.figures.get(name) if found is not None else None
            label.setText("–" if number is None else f"{number:.3g}")
            label.setEnabled(not stale)
        if found is None:
            self.told.setText("Errors are measured against a reference in double precision.")
            self.told.setToolTip("")
            return
        share = found.reference.share_left_out
        left_out = f" {100 * share:.3g} % of it did not converge and is left out." if 0.0 < share < 1.0 else ""
        text = f"{found.size[0]} × {found.size[1]} pixels of the view.{left_out}"
        whole = "\n".join((text, said(found.reference.summary()), *(said(note) for note in found.notes)))
        self.told.setText(text if found.reference.converged or share < 1.0 else said(found.reference.summary()))
        self.told.setToolTip(whole)
