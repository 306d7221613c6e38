"""Labels under the cursor: which one it is, what it is called, how large it is, and where else it is seen.

Labels are the ids of a picture, a value of kind `Labels`, or whole numbers that lie in patches, as in a file of a
segmentation (`nodegraph.offers.label_ids`). Names are those of the labels, or of the table of a transfer function.
"""

from __future__ import annotations

import weakref
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QImage, QKeyEvent, QMouseEvent, QPainter

from nodegraph.data import Image, Labels, Volume
from nodegraph.data.space import transform_points
from nodegraph.data.volume import Grid
from nodegraph.editor.views.marks import MARK
from nodegraph.editor.views.measures import volume_text
from nodegraph.editor.views.sight import Sight
from nodegraph.editor.views.tools import Tool
from nodegraph.offers import label_ids
from nodegraph.subjects import upstream

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.editor.views.view import ViewWidget

TABLE = "labels"
"""Key of the ``ui`` of a node in which the table of a transfer function keeps names."""
BEHIND = np.arange(5) / 2.0
"""How far behind what is seen a label is looked for, in least spacings: a surface lies between it and nothing."""
TINT, RIM = 70, 235

_known: weakref.WeakKeyDictionary[Volume, frozenset[int]] = weakref.WeakKeyDictionary()


@dataclass(frozen=True, slots=True)
class Found:
    """A label: id, voxels and mm^3 that it has where that is known, and its name or nothing."""

    id: int
    name: str = ""
    voxels: int = 0
    size: float = 0.0

    def text(self) -> str:
        """One line."""
        named = f"label {self.id} ({self.name})" if self.name else f"label {self.id}"
        return f"{named}: {self.voxels:,} voxels, {volume_text(self.size)}" if self.voxels else named


class LabelSelection(QObject):
    """The label that was picked, one for each session, made by `of`. ``changed`` also when none is picked any more."""

    changed = Signal()

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.label: Found | None = None
        session.replaced.connect(lambda: self.select(None))

    @classmethod
    def of(cls, session: Session) -> LabelSelection:
        """The one of a session."""
        found = session.findChild(cls)
        return found if isinstance(found, LabelSelection) else cls(session)

    def select(self, label: Found | None) -> None:
        """Mark a label, or none."""
        if label != self.label:
            self.label = label
            self.changed.emit()


class LabelPick(Tool):
    """A click picks the label that is seen there; it is then tinted in every view of it. Esc lets it go."""

    def __init__(self, view: ViewWidget) -> None:
        super().__init__(view)
        self.chosen = LabelSelection.of(self.session)
        self.chosen.changed.connect(self._tint)
        view.drawn.connect(self._learn)
        view.drawn.connect(self._tint)
        self._newest = 0
        self._veil: tuple[Sight, QImage] | None = None
        self._asked: weakref.ref[Grid] | None = None

    # -- picking ------------------------------------------------------------------------------------------------------

    def click(self, event: QMouseEvent) -> bool:
        if event.button() != Qt.MouseButton.LeftButton:
            return False
        place = event.position()
        found, field = self.view.pick_at((place.x(), place.y())), self._field()
        if found is None or (not found.id and (field is None or found.world is None)):
            self.chosen.select(None)
            return False
        names, id, path = self.names(), found.id, self.view.path
        points = self._behind(found.world) if found.world is not None else np.empty((0, 3))

        def look() -> Found | None:
            one = id or (id_at(field, points) if field is not None else 0)
            if not one:
                return None
            voxels, size = extent(field, one) if field is not None and holds(field, one) else (0, 0.0)
            return Found(one, names.get(one, ""), voxels, size)

        def take(label: Found | None) -> None:
            self.chosen.select(label)
            if label is not None:
                self.session.tell("info", label.text(), path)

        self.session.work(look, take)
        return False

    def key(self, event: QKeyEvent) -> bool:
        if event.key() == Qt.Key.Key_Escape and self.chosen.label is not None:
            self.chosen.select(None)
            return True
        return False

    def _learn(self) -> None:
        """Find out, once for each volume, whether it holds labels, so that the line below the picture can say them."""
        field = self._field()
        if isinstance(field, Volume) and (self._asked is None or self._asked() is not field):
            self._asked = weakref.ref(field)
            self.session.work(lambda: ids_of(field), lambda _: None)

    def names(self) -> dict[int, str]:
        """Names of labels that somebody upstream of the view knows; the nearest one decides."""
        found: dict[int, str] = {}
        flat = self.session.network.flatten()
        for node in upstream(flat, self.view.path):
            kept = self.session.network.node(node.path).ui.get(TABLE)
            for table in kept.values() if isinstance(kept, dict) else ():
                found = {**_noted(table), **found}
        field = self._field()
        return {**found, **field.names} if isinstance(field, Labels) else found

    def text(self, value: float) -> str:
        """What the line below the picture says of a value: a label with its name, where it is known to be one."""
        field = self._field()
        ids = _known.get(field) if isinstance(field, Volume) else None
        if not ids or value not in ids:
            return ""
        name = self.names().get(int(value), "")
        return f"label {int(value)} ({name})" if name else f"label {int(value)}"

    def _field(self) -> Grid | None:
        """The labels that the view shows: the nearest upstream, else the volume whose values it shows."""
        if not self.view.alive:
            return None
        for node in upstream(self.session.network.flatten(), self.view.path):
            for name in node.processor.outputs if node.processor is not None else ():
                value = self.session.value(node.path, name)
                if isinstance(value, Labels):
                    return value
        return self.view.volume()

    def _behind(self, world: NDArray[np.float64]) -> NDArray[np.float64]:
        """A point that is seen and some behind it; on a cut the point alone."""
        sight, field = self.view.sight(), self._field()
        if sight is None or sight.camera is None or field is None:
            return world[None]
        camera = sight.camera
        way = camera.basis[2] if camera.orthographic else world - np.asarray(camera.eye)
        step = float(field.spacing.min()) / float(np.linalg.norm(way))
        points: NDArray[np.float64] = world + BEHIND[:, None] * step * way
        return points

    # -- showing it ---------------------------------------------------------------------------------------------------

    def _tint(self) -> None:
        """Work out anew which pixels show the label."""
        self._newest += 1
        label, sight, shown, field = self.chosen.label, self.view.sight(), self.view.shown, self._field()
        if label is None or sight is None or shown is None:
            if self._veil is not None:
                self._veil = None
                self.view.area.update()
            return
        number, image, id = self._newest, shown.image, label.id

        def take(veil: QImage | None) -> None:
            if number == self._newest:
                self._veil = (sight, veil) if veil is not None else None
                self.view.area.update()

        self.session.work(lambda: veil_of(image, sight, field, id), take)

    def forget(self) -> None:
        self._veil = None

    def paint(self, painter: QPainter) -> None:
        if self._veil is not None and self._veil[0] == self.view.sight():
            painter.drawImage(self.view.area.target(), self._veil[1])


def ids_of(field: Grid) -> frozenset[int] | None:
    """The ids of a volume of labels, none where it holds none; None for `Labels`, where any id may be."""
    if not isinstance(field, Volume):
        return None
    if field not in _known:
        _known[field] = frozenset(label_ids(field))
    return _known[field]


def holds(field: Grid, id: int) -> bool:
    """Whether an id is one of a field's labels."""
    ids = ids_of(field)
    return ids is None or id in ids


def id_at(field: Grid, points: NDArray[np.float64]) -> int:
    """The first id other than 0 at some points (n, 3) of the world, 0 where there is none or where no labels are."""
    ids = ids_of(field)
    if ids is not None and not ids:
        return 0
    found = _ids(field, points)
    seen = found[found > 0]
    return int(seen[0]) if len(seen) else 0


def extent(field: Grid, id: int) -> tuple[int, float]:
    """Voxels and mm^3 of a label."""
    voxels = sum(int(np.count_nonzero(part == id)) for _, part in field.buffer.slabs())
    return voxels, voxels * abs(float(np.linalg.det(field.index_to_world[:3, :3])))


def veil_of(image: Image, sight: Sight, field: Grid | None, id: int) -> QImage | None:
    """A picture of where a label is seen: tinted, with a rim; None where it is nowhere."""
    width, height = image.size
    if image.ids is not None:
        mask = image.ids == id
    elif field is None or not holds(field, id):
        return None
    else:
        x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
        mask = _seen(field, id, sight, image, x, y)
    if not mask.any():
        return None
    inner = np.pad(mask, 1)
    inner = inner[1:-1, :-2] & inner[1:-1, 2:] & inner[:-2, 1:-1] & inner[2:, 1:-1]
    veil = np.zeros((height, width, 4), np.uint8)
    veil[mask] = MARK.red(), MARK.green(), MARK.blue(), TINT
    veil[mask & ~inner, 3] = RIM
    return QImage(veil.data, width, height, 4 * width, QImage.Format.Format_RGBA8888).copy()


def _seen(
    field: Grid, id: int, sight: Sight, image: Image, x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Which pixels, whose middles lie at x and y, show a label."""
    width, height = image.size
    if sight.plane is not None:
        right, up = sight.plane.axes
        pixel = sight.height / height
        across, along = (x - width / 2) * pixel, (height / 2 - y) * pixel
        points = sight.plane.origin + across[..., None] * right + along[..., None] * up
        return np.asarray(_ids(field, points) == id)
    camera, mask = sight.camera, np.zeros((height, width), bool)
    if camera is None or image.depth is None:
        return mask
    there = np.isfinite(image.depth)
    right, up, forward = camera.basis
    half = camera.rays(image.size)["half_size"]
    sx, sy = (x[there] / width * 2 - 1) * half[0], (1 - y[there] / height * 2) * half[1]
    offset = sx[:, None] * right + sy[:, None] * up
    deep = image.depth[there].astype(np.float64)[:, None]
    ways = np.broadcast_to(forward, offset.shape) if camera.orthographic else forward + offset
    points = np.asarray(camera.eye) + (offset if camera.orthographic else 0.0) + deep * ways
    found = np.zeros(len(points), np.int64)
    step = float(field.spacing.min()) / np.linalg.norm(ways, axis=1, keepdims=True)
    for far in BEHIND:
        found = np.where(found > 0, found, _ids(field, points + far * step * ways))
    mask[there] = found == id
    return mask


def _ids(field: Grid, points: NDArray[np.float64]) -> NDArray[np.int64]:
    """Ids of the voxels in which points (..., 3) of the world lie, 0 outside."""
    index = np.floor(transform_points(field.world_to_index, points) + 0.5).astype(np.int64)
    inside = ((index >= 0) & (index < np.asarray(field.dims))).all(axis=-1)
    found = np.zeros(index.shape[:-1], np.int64)
    if inside.any():
        x, y, z = index[inside].T
        low, high = index[inside].min(axis=0), index[inside].max(axis=0) + 1
        block = field.buffer.part(low[::-1], high[::-1])
        found[inside] = block[z - low[2], y - low[1], x - low[0]]
    return found


def _noted(table: Any) -> dict[int, str]:
    names = table.get("names") if isinstance(table, Mapping) else None
    if not isinstance(names, Mapping):
        return {}
    return {int(id): name for id, name in names.items() if str(id).isdigit() and isinstance(name, str)}
