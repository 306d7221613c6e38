"""What the mouse takes hold of: keys, the tops of bells, and their flanks; and what becomes of it when it is moved."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

from PySide6.QtGui import QColor

from nodegraph.data import TransferFunction
from nodegraph.editor.parameters.color import to_linear
from nodegraph.editor.parameters.transfer_function import keys
from nodegraph.editor.parameters.transfer_function.axes import height, opacity
from nodegraph.editor.parameters.transfer_function.bells import Bell, Shape, least_width


class Grip(NamedTuple):
    """One thing to hold. kind: "key", "bell" (its top), "left" or "right" (its flanks). place: which one."""

    kind: str
    place: int


def key(place: int) -> Grip:
    return Grip("key", place)


def bell(place: int) -> Grip:
    return Grip("bell", place)


def every(shape: Shape) -> frozenset[Grip]:
    """All keys and tops of bells."""
    return frozenset([*map(key, range(len(shape.base.keys))), *map(bell, range(len(shape.bells)))])


def in_order(shape: Shape) -> list[Grip]:
    """All keys and tops of bells, from left to right."""
    return sorted(every(shape), key=lambda grip: (position(shape, grip)[0], grip))


def there(shape: Shape, grips: Iterable[Grip]) -> frozenset[Grip]:
    """Those that a shape still has."""
    count = {"key": len(shape.base.keys)}
    return frozenset(grip for grip in grips if grip.place < count.get(grip.kind, len(shape.bells)))


def position(shape: Shape, grip: Grip) -> tuple[float, float]:
    """Value and opacity of a grip. Flanks lie a width from the centre, on the bell."""
    if grip.kind == "key":
        return shape.base.keys[grip.place].value, shape.base.keys[grip.place].opacity
    held = shape.bells[grip.place]
    if grip.kind == "bell":
        return held.center, held.opacity
    side = -1.0 if grip.kind == "left" else 1.0
    return held.center + side * held.width, keys.dense(held.opacity, 0.60653)  # exp(-1/2) of its extinction


def color(shape: Shape, grip: Grip) -> tuple[float, float, float]:
    """Linear RGB of a grip."""
    return shape.base.keys[grip.place].color if grip.kind == "key" else shape.bells[grip.place].color


def places(grips: Iterable[Grip], kind: str) -> list[int]:
    """Which keys, or which bells, are among some grips."""
    return sorted(grip.place for grip in grips if grip.kind == kind)


@dataclass(frozen=True)
class Move:
    """Takes what was there when a drag began to where the mouse is; nothing adds up on the way.

    shape: at the beginning. grips: what moves, ``held`` among them. gap: between neighbouring keys, in values.
    scale: of the opacity; several grips move by the same height of that axis.
    """

    shape: Shape
    grips: frozenset[Grip]
    held: Grip
    gap: float
    scale: str

    def to(self, value: float, up: float) -> Shape:
        """The shape when the held grip is moved to a value and an opacity."""
        if self.held.kind in ("left", "right"):
            return self._widen(value)
        start_value, start_opacity = position(self.shape, self.held)
        by = value - start_value
        rise = float(height(up, self.scale)) - float(height(start_opacity, self.scale))
        chosen = {grip: self._raised(grip, rise, up) for grip in self.grips if grip.kind in ("key", "bell")}
        opacities = {grip.place: found for grip, found in chosen.items() if grip.kind == "key"}
        made = self.shape.with_base(keys.shift(self.shape.base, opacities, by, self.gap) if opacities else self._base)
        for grip, found in chosen.items():
            if grip.kind == "bell":
                old = made.bells[grip.place]
                made = made.with_bell(grip.place, old._replace(center=old.center + by, opacity=found))
        return made

    @property
    def _base(self) -> TransferFunction:
        return self.shape.base

    def _raised(self, grip: Grip, rise: float, up: float) -> float:
        if grip == self.held:
            return min(1.0, max(0.0, up))
        start = float(height(position(self.shape, grip)[1], self.scale))
        return float(f"{opacity(start + rise, self.scale):.3g}") if rise else position(self.shape, grip)[1]

    def _widen(self, value: float) -> Shape:
        old = self.shape.bells[self.held.place]
        least = max(least_width(old.center), self.gap)
        return self.shape.with_bell(self.held.place, old._replace(width=max(least, abs(value - old.center))))


def remove(shape: Shape, grips: Iterable[Grip]) -> Shape:
    """A shape without some keys and bells."""
    gone = set(grips)
    kept = [one for place, one in enumerate(shape.base.keys) if key(place) not in gone]
    bells = tuple(one for place, one in enumerate(shape.bells) if bell(place) not in gone)
    return Shape(TransferFunction(kept, shape.base.reference_length), bells)


def recolor(shape: Shape, grips: Iterable[Grip], linear: tuple[float, float, float]) -> Shape:
    """Give keys and bells a colour."""
    for grip in grips:
        if grip.kind == "key":
            shape = shape.with_base(keys.recolor(shape.base, grip.place, linear))
        else:
            shape = shape.with_bell(grip.place, shape.bells[grip.place]._replace(color=linear))
    return shape


def painted(shape: Shape, colors: TransferFunction) -> Shape:
    """Keys and bells in the colours that another function has at their values."""
    base = keys.painted(shape.base, colors)
    bells = (bell._replace(color=keys.color_at(colors, bell.center)) for bell in shape.bells)
    return Shape(base, tuple(bells))


def change(shape: Shape, grips: Iterable[Grip], tool: str, factor: float = 1.0) -> Shape:
    """Do something to keys and bells.

    tool: "mirror" (left side right), "turn_over" (opaque is transparent; keys alone), "reverse_colors", or "thicker":
    ``factor`` times the extinction. Raises ParameterError where keys would change their order with others.
    """
    chosen = list(grips)
    which, bumps = places(chosen, "key"), places(chosen, "bell")
    base, bells = shape.base, list(shape.bells)
    if tool == "mirror":
        values = [position(shape, grip)[0] for grip in chosen]
        ends = min(values) + max(values)
        if which:
            base = keys.mirror(base, which, ends)
        for place in bumps:
            bells[place] = bells[place]._replace(center=ends - bells[place].center)
    elif tool == "turn_over" and which:
        base = keys.turn_over(base, which)
    elif tool == "reverse_colors":
        base = keys.reverse_colors(base, which)
        for place, other in zip(bumps, reversed(bumps), strict=True):
            bells[place] = bells[place]._replace(color=shape.bells[other].color)
    elif tool == "thicker":
        base = keys.thicker(base, which, factor)
        for place in bumps:
            bells[place] = bells[place]._replace(opacity=keys.dense(bells[place].opacity, factor))
    return Shape(base, tuple(bells))


def fresh_color(count: int) -> tuple[float, float, float]:
    """The colour of one more bell: around the colour circle by the golden angle, so that neighbours differ most."""
    return to_linear(QColor.fromHsvF((0.02 + count * 0.381966) % 1.0, 0.65, 0.95))


def new_bell(center: float, width: float, up: float, linear: tuple[float, float, float]) -> Bell:
    """A bell for somebody to drag."""
    return Bell(center, max(width, least_width(center)), min(1.0, max(0.0, up)), linear)
