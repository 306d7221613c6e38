"""Labels under the cursor: which one it is, what it is called, how large it is, and where else it is seen.

Labels are the ids of a picture, a value of kind `Labels`, or whole numbers that lie in patches, as in a file of a
segmentation (`nodegraph.offers.label_ids`). Names are those of the labels, or of the table of a transfer function.
"""

from __future__ import annotations

import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QImage, QKeyEvent, QMouseEvent, QPainter

from nodegraph.data import Camera, Image, Labels, Volume
from nodegraph.data.buffer import Array
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
BAND = 32
"""Rows of a picture that are looked at in one go."""

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
        self._working = self._again = False
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
        label, sight, shown, field = self.chosen.label, self.view.sight(), self.view.shown, self._field()
        if label is None or sight is None or shown is None:
            if self._veil is not None:
                self._veil = None
                self.view.area.update()
            return
        self._again = self._working
        if self._working:
            return  # one at a time, so that a drag is not held up
        self._working = True
        image, id = shown.image, label.id

        def take(veil: QImage | None) -> None:
            self._working = False
            if self._again or self.chosen.label is None:
                self._tint()
                return
            self._veil = (sight, veil) if veil is not None else None
            self.view.area.update()

        self.session.work(lambda: veil_of(image, sight, field, id), take, self.view.area)

    def forget(self) -> None:
        self._veil = None

    def paint(self, painter: QPainter) -> None:
        if self._veil is not None and self._veil[0] == self.view.sight():
            painter.drawImage(self.view.area.target(), self._veil[1])


def ids_of(field: Grid) -> frozenset[int] | None:
    """The ids of a volume of labels, none where it holds none; None for `Labels`, where any id may be.

    A volume that lies in chunks of a file is not looked through, and so never taken for labels.
    """
    if not isinstance(field, Volume):
        return None
    if field not in _known:
        _known[field] = frozenset(label_ids(field) if field.buffer.chunks is None else ())
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
    found = _ids(field, list(transform_points(field.world_to_index, points).T))
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
        mask = _seen(field, id, sight, image)
    if not mask.any():
        return None
    inner = np.pad(mask, 1)
    inner = inner[1:-1, :-2] & inner[1:-1, 2:] & inner[:-2, 1:-1] & inner[2:, 1:-1]
    veil = np.zeros((height, width, 4), np.uint8)
    veil[mask] = MARK.red(), MARK.green(), MARK.blue(), TINT
    veil[mask & ~inner, 3] = RIM
    return QImage(veil.data, width, height, 4 * width, QImage.Format.Format_RGBA8888).copy()


def _seen(field: Grid, id: int, sight: Sight, image: Image) -> NDArray[np.bool_]:
    """Which pixels show a label. Band by band, so that no other thread waits long for its turn."""
    width, height = image.size
    mask = np.zeros((height, width), bool)
    for top in range(0, height, BAND):
        rows = slice(top, min(top + BAND, height))
        x, y = np.arange(width) + 0.5, np.arange(rows.start, rows.stop)[:, None] + 0.5
        if sight.plane is not None:
            mask[rows] = _cut(field, sight, height, x - width / 2, height / 2 - y) == id
        elif sight.camera is not None and image.depth is not None:
            mask[rows] = _in_depth(field, sight.camera, image.size, image.depth[rows], x, y) == id
    return mask


def _cut(field: Grid, sight: Sight, height: int, x: Array, y: Array) -> NDArray[np.int64]:
    """Ids at pixels of a cut; x to the right and y up from its middle."""
    assert sight.plane is not None
    linear, pixel = field.world_to_index[:3, :3], sight.height / height
    right, up = (linear @ axis * pixel for axis in sight.plane.axes)
    origin = transform_points(field.world_to_index, sight.plane.origin)
    return _ids(field, [origin[i] + x * right[i] + y * up[i] for i in range(3)])


def _in_depth(
    field: Grid, camera: Camera, size: tuple[int, int], depth: Array, x: Array, y: Array
) -> NDArray[np.int64]:
    """Ids at, or a little behind, the points that are seen at pixels of columns x and rows y; 0 where nothing is."""
    linear = field.world_to_index[:3, :3]
    there = np.isfinite(depth)
    half = camera.rays(size)["half_size"]
    sx = np.broadcast_to((x / size[0] * 2 - 1) * half[0], depth.shape)[there]
    sy = np.broadcast_to((1 - y / size[1] * 2) * half[1], depth.shape)[there]
    eye = transform_points(field.world_to_index, camera.eye)
    right, up, forward = (linear @ axis for axis in camera.basis)
    sideways = [sx * right[i] + sy * up[i] for i in range(3)]
    deep = depth[there].astype(np.float64)
    if camera.orthographic:
        begins = [eye[i] + sideways[i] for i in range(3)]
        ways = [np.full(len(sx), forward[i]) for i in range(3)]
        lengths = np.ones(len(sx))
    else:
        begins = [np.full(len(sx), eye[i]) for i in range(3)]
        ways = [forward[i] + sideways[i] for i in range(3)]
        lengths = np.sqrt(1.0 + sx * sx + sy * sy)
    found, open_ = np.zeros(len(sx), np.int64), np.arange(len(sx))
    for far in BEHIND * float(field.spacing.min()):
        along = deep[open_] + far / lengths[open_]
        found[open_] = _ids(field, [begins[i][open_] + along * ways[i][open_] for i in range(3)])
        open_ = open_[found[open_] == 0]
    ids = np.zeros(depth.shape, np.int64)
    ids[there] = found
    return ids


def _ids(field: Grid, index: Sequence[Array]) -> NDArray[np.int64]:
    """Ids of the voxels in which index coordinates x, y, z lie, 0 outside."""
    whole = [np.floor(np.asarray(one) + 0.5).astype(np.int64) for one in index]
    inside = np.ones(whole[0].shape, bool)
    for one, count in zip(whole, field.dims, strict=True):
        inside &= (one >= 0) & (one < count)
    found = np.zeros(inside.shape, np.int64)
    if inside.any():
        x, y, z = (one[inside] for one in whole)
        low = [int(one.min()) for one in (z, y, x)]
        block = field.buffer.part(low, [int(one.max()) + 1 for one in (z, y, x)])
        found[inside] = block[z - low[0], y - low[1], x - low[2]]
    return found


def _noted(table: Any) -> dict[int, str]:
    names = table.get("names") if isinstance(table, Mapping) else None
    if not isinstance(names, Mapping):
        return {}
    return {int(id): name for id, name in names.items() if str(id).isdigit() and isinstance(name, str)}
