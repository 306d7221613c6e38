"""A transfer function that shows which parts have the values of a range."""

from __future__ import annotations

import math

import numpy as np
from PySide6.QtGui import QColor

from nodegraph.data import TransferFunction
from nodegraph.data.transfer_function import Key
from nodegraph.editor.parameters.color import to_linear
from nodegraph.editor.parameters.transfer_function.marks import BAND

FAINT = 0.1
"""Part of its extinction that everything else keeps, in grey."""
OPACITY = 0.6
"""What a reference length of the range hides."""


def highlight(function: TransferFunction, low: float, high: float) -> TransferFunction:
    """The range in one strong colour, and the rest of the function faint and grey."""
    color = to_linear(QColor(BAND))

    def ghost(value: float, row: np.ndarray) -> Key:
        grey = float(row[:3] @ (0.2126, 0.7152, 0.0722))
        return Key(value, (grey, grey, grey), -math.expm1(-FAINT * row[3] * function.reference_length))

    def rows(keys: list[Key]) -> list[Key]:
        return [ghost(k.value, np.array([*k.color, float(function.extinction(k.opacity))])) for k in keys]

    before, after = function.evaluate([np.nextafter(low, -math.inf), np.nextafter(high, math.inf)])
    strong = [Key(low, color, OPACITY), Key(high, color, OPACITY)]
    return TransferFunction(
        [
            *rows([key for key in function.keys if key.value < low]),
            ghost(low, before),
            *strong,
            ghost(high, after),
            *rows([key for key in function.keys if key.value > high]),
        ],
        function.reference_length,
    )
