"""What is under the cursor: the colour, the depth, the place in the world, the value of a cut."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from nodegraph.data import Volume
from nodegraph.data.space import Vector, transform_points
from nodegraph.editor.views import navigation as nav
from nodegraph.editor.views.cuts import CutInteractor
from nodegraph.editor.views.interactors import CameraInteractor

if TYPE_CHECKING:
    from nodegraph.editor.views.view import ViewWidget

GAP = "   "


@dataclass(frozen=True, slots=True, eq=False)
class Pick:
    """A pixel of a picture.

    pixel: column and row. color: linear, as the picture has it. depth: mm along the view axis, None where nothing is
    seen or it is not known. id: of a label, None without ids. world: mm, None where it is not known. read: reads the
    value of the data there, off the window's thread. unit: of that value.
    """

    pixel: tuple[int, int]
    color: tuple[float, ...]
    depth: float | None = None
    id: int | None = None
    world: Vector | None = None
    read: Callable[[], float | None] | None = None
    unit: str = ""

    def text(self, value: float | None = None, label: str = "") -> str:
        """One line. label: what the value means, where it is more than a number."""
        parts = [label] if label else []
        if value is not None and not label:
            parts.append(f"value {value:.6g} {self.unit}".rstrip())
        if self.id is not None:
            parts.append(f"id {self.id}")
        if self.world is not None:
            parts.append(f"at {_places(self.world)} mm")
        if self.depth is not None:
            parts.append(f"depth {self.depth:.1f} mm")
        parts.append(f"pixel {self.pixel[0]}, {self.pixel[1]}")
        parts.append(f"{color_name(len(self.color))} {_numbers(self.color, 2 if len(self.color) == 4 else 3)}")
        return GAP.join(parts)


def color_name(channels: int) -> str:
    """What the numbers of a pixel are called."""
    return {1: "value", 2: "entry, exit"}.get(channels, "RGBA")


def pick(view: ViewWidget, pixel: tuple[int, int]) -> Pick | None:
    """What a view knows of a pixel of its picture."""
    if view.shown is None:
        return None
    image, size = view.shown.image, view.shown.size
    column, row = pixel
    if not (0 <= column < size[0] and 0 <= row < size[1]):
        return None
    color = tuple(float(number) for number in image.color[row, column])
    id = int(image.ids[row, column]) if image.ids is not None else None
    depth = float(image.depth[row, column]) if image.depth is not None else None
    if depth is not None and not np.isfinite(depth):
        depth = None
    world = _world(view, (column + 0.5, row + 0.5), depth)
    volume = view.volume()
    if world is None or volume is None:
        return Pick(pixel, color, depth, id, world)
    return Pick(pixel, color, depth, id, world, lambda: value_at(volume, world), volume.mapping.unit)


def _world(view: ViewWidget, place: nav.Point, depth: float | None) -> Vector | None:
    """The point of the world under a place of the picture, in pixels of the picture."""
    assert view.shown is not None
    size = view.shown.size
    if isinstance(view.interactor, CameraInteractor):
        camera = view.interactor.camera()
        return nav.world_at(camera, size, place, depth) if camera is not None and depth is not None else None
    if isinstance(view.interactor, CutInteractor):
        plane, height = view.interactor.plane(), view.interactor.height()
        return nav.on_plane(plane, height, size, place) if plane is not None and height > 0.0 else None
    return None


def value_at(volume: Volume, world: Vector) -> float | None:
    """The real value of the voxel that a point of the world (mm) lies in; None outside. Reads that voxel only."""
    index = np.floor(transform_points(volume.world_to_index, world) + 0.5).astype(int)
    if (index < 0).any() or (index >= volume.dims).any():
        return None
    return float(volume.part(index, index + 1).real(np.float64)[0, 0, 0])


def _places(world: Vector) -> str:
    """A point of the world with digits that suit: a tenth of a millimetre, or more where all is small."""
    small = float(np.abs(world).max()) < 1.0
    return _numbers(world.tolist(), 5 if small else 1)


def _numbers(numbers: tuple[float, ...] | list[float], digits: int) -> str:
    return ", ".join(f"{number:.{digits}f}".replace("-", "\N{MINUS SIGN}") for number in numbers)
