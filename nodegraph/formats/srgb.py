"""The transfer curve of sRGB (IEC 61966-2-1), between linear light and what files and screens store."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def encode(linear: Any) -> NDArray[Any]:
    """Linear light to sRGB, both 0..1; what lies outside is clipped, NaN becomes 0. float32 stays float32."""
    x = np.asarray(linear)
    x = np.clip(np.nan_to_num(x, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    stored: NDArray[Any] = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    return stored.astype(x.dtype, copy=False)


def decode(stored: Any) -> NDArray[Any]:
    """sRGB to linear light, both 0..1."""
    x = np.asarray(stored)
    linear: NDArray[Any] = np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4)
    return linear.astype(x.dtype, copy=False)
