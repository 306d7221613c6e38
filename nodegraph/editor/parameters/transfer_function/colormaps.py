"""Colour maps made from published formulas, as presets that change colours and leave opacities alone.

The tables in ``nodegraph/editor/presets/maps.json`` join them there; it says whose they are.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nodegraph.data.image import srgb_encode
from nodegraph.formats import srgb

TOLERANCE = 2.0 / 255.0
"""What keys may miss of a colour, as the screen encodes it."""
_SAMPLES = 257

Colors = NDArray[np.float64]


def colormaps() -> list[dict[str, Any]]:
    """Descriptions of presets."""
    made = (("Grey, even", grey), ("Cube helix", cube_helix), ("Cool to warm", cool_to_warm))
    return [describe(name, make(np.linspace(0.0, 1.0, _SAMPLES))) for name, make in made]


def describe(name: str, linear: Colors) -> dict[str, Any]:
    """A preset of equally spaced colours, linear RGB (n, 3), with as few keys as they need."""
    keys = [
        [round(float(place), 5), [round(float(part), 5) for part in color], round(float(place) * 0.5, 5)]
        for place, color in reduced(linear)
    ]
    value = {"keys": keys, "reference_length": 1.0}
    return {"name": name, "kind": "TransferFunction", "group": "Colours", "relative": True, "colors": True} | {
        "value": value
    }


def reduced(linear: Colors) -> list[tuple[float, Colors]]:
    """Places 0..1 and colours between which linear light is within `TOLERANCE` of what was given."""
    places = np.linspace(0.0, 1.0, len(linear))
    screen = srgb_encode(np.clip(linear, 0.0, 1.0))
    kept = [0]
    while kept[-1] < len(linear) - 1:
        start = end = kept[-1] + 1
        while end < len(linear) and _near(places, linear, screen, kept[-1], end):
            start = end
            end += 1
        kept.append(start)
    return [(float(places[place]), linear[place]) for place in kept]


def _near(places: Colors, linear: Colors, screen: Colors, first: int, last: int) -> bool:
    inside = slice(first, last + 1)
    share = ((places[inside] - places[first]) / (places[last] - places[first]))[:, None]
    made = linear[first] * (1.0 - share) + linear[last] * share
    return bool(np.abs(srgb_encode(np.clip(made, 0.0, 1.0)) - screen[inside]).max() <= TOLERANCE)


def grey(t: Colors) -> Colors:
    """Black to white in even steps of CIE lightness L* (CIE 15:2004)."""
    lightness = 100.0 * t
    y = np.where(lightness > 8.0, ((lightness + 16.0) / 116.0) ** 3, lightness / 903.2963)
    return np.repeat(y[:, None], 3, axis=1)


def cube_helix(t: Colors) -> Colors:
    """Around the grey diagonal while brightness grows evenly: start 0.5, -1.5 turns, hue 1, gamma 1.

    Source: Green 2011, "A colour scheme for the display of astronomical intensity images".
    """
    angle = 2.0 * math.pi * (0.5 / 3.0 + 1.0 - 1.5 * t)
    depth = t * (1.0 - t) / 2.0
    across, along = np.cos(angle), np.sin(angle)
    screen = t[:, None] + depth[:, None] * np.stack(
        [-0.14861 * across + 1.78277 * along, -0.29227 * across - 0.90649 * along, 1.97294 * across], axis=1
    )
    return np.asarray(srgb.decode(np.clip(screen, 0.0, 1.0)), np.float64)


def cool_to_warm(t: Colors) -> Colors:
    """Blue over light grey to red, even on either side of the middle, for values around a centre.

    Source: Moreland 2009, "Diverging color maps for scientific visualization": the polar form Msh of CIELAB.
    """
    ends = [_to_msh(np.array(color) / 255.0) for color in ((59.0, 76.0, 192.0), (180.0, 4.0, 38.0))]
    middle = 88.0
    made = np.empty((len(t), 3))
    for place, share in enumerate(t):
        (m, s, h), twice = (ends[0], 2.0 * share) if share < 0.5 else (ends[1], 2.0 - 2.0 * share)
        hue = h + _spin(m, s, middle) * (1.0 if h > -math.pi / 3.0 else -1.0) * twice
        made[place] = _from_msh(m + (middle - m) * twice, s * (1.0 - twice), hue)
    return made


def _spin(m: float, s: float, middle: float) -> float:
    """How far the hue turns on the way to the unsaturated middle, so that differences stay even."""
    return s * math.sqrt(max(0.0, middle**2 - m**2)) / (m * math.sin(s)) if m < middle else 0.0


_WHITE = np.array([0.95047, 1.0, 1.08883])
_TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])


def lab(linear: Colors) -> Colors:
    """CIELAB of linear sRGB, white D65."""
    xyz = np.asarray(linear) @ _TO_XYZ.T / _WHITE
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.stack(
        [116.0 * f[..., 1] - 16.0, 500.0 * (f[..., 0] - f[..., 1]), 200.0 * (f[..., 1] - f[..., 2])], axis=-1
    )


def _to_msh(screen: Colors) -> tuple[float, float, float]:
    light, a, b = lab(np.asarray(srgb.decode(screen), np.float64))
    m = math.sqrt(light**2 + a**2 + b**2)
    return m, math.acos(light / m), math.atan2(b, a)


def _from_msh(m: float, s: float, h: float) -> Colors:
    light, a, b = m * math.cos(s), m * math.sin(s) * math.cos(h), m * math.sin(s) * math.sin(h)
    fy = (light + 16.0) / 116.0
    f = np.array([fy + a / 500.0, fy, fy - b / 200.0])
    xyz = np.where(f > 0.2069, f**3, (f - 16.0 / 116.0) / 7.787) * _WHITE
    return np.asarray(np.clip(np.linalg.solve(_TO_XYZ, xyz), 0.0, 1.0))
