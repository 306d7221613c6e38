"""Networks to begin with, made from the nature of a data file: what it holds decides what is offered, and how.

    first, *others = offers("chest.nii.gz")   # ray-casting, slices, a surface, ... as they suit the file
    network = first.network()                 # a network like any other, that shows a picture

A few slices of the file are looked at, however large it is.
"""

from __future__ import annotations

import colorsys
import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from nodegraph import formats
from nodegraph.data import Camera, Plane, TransferFunction, Volume
from nodegraph.errors import FormatError, near_miss_or_all
from nodegraph.network import ID, Network

SAMPLES = 1 << 20
"""About as many voxels are looked at."""
MOST_LABELS = 4096
RADIOLOGICAL = {"axial": (0.0, 0.0, -1.0), "coronal": (0.0, -1.0, 0.0), "sagittal": (1.0, 0.0, 0.0)}
"""Normals, in LPS: seen from the feet, from the front, from the patient's left."""
BLEND = {"pattern": "radial", "color": (0.085, 0.1, 0.125), "second_color": (0.008, 0.01, 0.013)}


@dataclass(frozen=True)
class Nature:
    """What a volume file is like. kind: "ct" (Hounsfield units), "labels" (few whole numbers, in patches), or "field".

    low and high hold most values between them; threshold parts dark from bright (Otsu); ids of labels without 0.
    """

    path: Path
    kind: str
    centre: NDArray[np.float64]
    corners: NDArray[np.float64]
    components: int
    low: float
    high: float
    threshold: float
    ids: tuple[int, ...] = ()

    @property
    def diagonal(self) -> float:
        """Of the volume's box, mm."""
        return float(np.linalg.norm(np.ptp(self.corners, axis=0)))

    @property
    def window(self) -> tuple[float, float]:
        """Values that cuts show black and white: soft tissue in a CT, else what most values lie between."""
        return (-160.0, 240.0) if self.kind == "ct" else (self.low, self.high)


@dataclass(frozen=True)
class Offer:
    """One network that a file can be shown by. doc: one sentence, also of what was chosen after the file's values."""

    name: str
    title: str
    doc: str
    network: Callable[[], Network]


def offers(path: str | Path) -> list[Offer]:
    """What suits a file, the likeliest first. Raises FormatError for what cannot be read or holds no volume."""
    nature = survey(path)
    bright = f"values above {nature.threshold:.4g}"
    if nature.kind == "labels":
        count = f"{len(nature.ids)} label{'s' if len(nature.ids) != 1 else ''}"
        return [
            Offer("labels", "Labels on slices", f"{count} in colours, on three planes", partial(_slices, nature)),
            Offer("surface", "Surface of the labels", f"{count} as one body", partial(_surface, nature)),
        ]
    seen = (
        "Bone and contrast agent; air and soft tissue are clear" if nature.kind == "ct" else f"Light through {bright}"
    )
    level = "Bone, at 250 HU" if nature.kind == "ct" else f"Where the value is {nature.threshold:.4g}"
    window = "in a window for soft tissue" if nature.kind == "ct" else f"from {nature.low:.4g} to {nature.high:.4g}"
    return [
        Offer("raycast", "Ray-casting", seen, partial(_raycast, nature)),
        Offer("slices", "Three slices", f"Axial, coronal and sagittal, {window}", partial(_slices, nature)),
        Offer("surface", "Surface", level, partial(_surface, nature)),
        Offer("maximum", "Maximum projection", "The brightest value along each ray", partial(_maximum, nature)),
    ]


def offer(name: str, path: str | Path) -> Offer:
    """The offer of that name for a file. Raises FormatError where there is none."""
    found = {each.name: each for each in offers(path)}
    if name not in found:
        raise FormatError(f"nothing called {name!r} is offered for it{near_miss_or_all(name, found)}", file=str(path))
    return found[name]


def survey(path: str | Path) -> Nature:
    """Look at a file. Raises FormatError."""
    path = Path(path).absolute()
    volume = formats.read(path)
    if not isinstance(volume, Volume):
        raise FormatError(f"holds {volume.kind}, not a volume; networks begin with a volume file", file=str(path))
    return nature_of(volume, path)


def nature_of(volume: Volume, path: Path) -> Nature:
    """Look at what a file held. Raises FormatError where nothing in it is a number."""
    components = volume.components
    if components > 1:
        volume = volume.component(0)
    slices = _some_slices(volume)
    values = slices[np.isfinite(slices)]
    if not values.size:
        raise FormatError("has no voxel that is a number, so there is nothing to see", file=str(path))
    low, high = (float(value) for value in np.percentile(values, (1.0, 99.5)))
    if not high / 2 - low / 2 > 1e-12 * abs(low):  # nearly all of it has one value, which is then to be seen
        around = max(1.0, 1e-3 * abs(low))
        low, high = low - around, high + around
    ids = _label_ids(volume, slices) if volume.dtype.kind in "iu" else ()
    threshold = _otsu(values, low, high)
    air = ((values > -1100) & (values < -900)).mean()
    kind = "labels" if ids else "ct" if air > 0.01 and values.min() > -5000 and values.max() > 200 else "field"
    return Nature(path, kind, volume.centre, volume.corners, components, low, high, threshold, ids)


def in_patches(edges: float, there: float) -> bool:
    """Whether whole numbers lie in patches, as labels do: few of the voxels that are ``there`` differ from the left."""
    return edges <= 0.3 * there


def label_ids(volume: Volume) -> tuple[int, ...]:
    """The ids of a volume of labels: whole numbers that lie in patches. Nothing for any other. Reads the volume."""
    whole = volume.dtype.kind in "iu" and volume.components == 1
    return _label_ids(volume, _some_slices(volume)) if whole else ()


# -- looking ------------------------------------------------------------------------------------------------------


def _some_slices(volume: Volume) -> NDArray[Any]:
    """Evenly spaced slices (n, y, x) in real values, of large ones not every voxel."""
    width, height, depth = volume.dims
    stride = max(1, int(np.sqrt(width * height / (SAMPLES / 8))))
    count = int(np.clip(SAMPLES * stride**2 // (width * height), 1, depth))
    places = np.unique(
        np.linspace(0, depth - 1, count + 2).round().astype(int)[1:-1] if depth > 2 else np.arange(depth)
    )
    parts = [volume.part((0, 0, z), (width, height, z + 1)).real(np.float64)[0, ::stride, ::stride] for z in places]
    return np.stack(parts)


def _label_ids(volume: Volume, slices: NDArray[Any]) -> tuple[int, ...]:
    """The ids, where whole numbers lie in patches as those of a segmentation do; else nothing.

    Of a volume of moderate size no label is missed, of a larger one those that the slices do not meet.
    """
    there = slices > 0
    if slices.min() < 0 or not there.any():
        return ()
    edges = (slices[:, :, 1:] != slices[:, :, :-1]) & there[:, :, 1:]
    if not in_patches(edges.sum(), there.sum()) or len(np.unique(slices[there])) > MOST_LABELS:
        return ()
    found = set(np.unique(slices[there]).tolist())
    if np.prod(volume.dims) <= 32 * SAMPLES and volume.mapping[:2] == (1.0, 0.0):
        for _, part in volume.buffer.slabs():
            found.update(np.unique(part).tolist())
    return tuple(sorted(int(id) for id in found if id > 0))


def _otsu(values: NDArray[Any], low: float, high: float) -> float:
    """The value that parts two classes best. Source: Otsu 1979."""
    unit = max(abs(low), abs(high))  # squares of what a double may hold are more than it may
    counts, edges = np.histogram(np.clip(values, low, high) / unit, bins=256, range=(low / unit, high / unit))
    middles = (edges[1:] + edges[:-1]) / 2
    below, total = np.cumsum(counts), counts.sum()
    above = total - below
    sums = np.cumsum(counts * middles)
    with np.errstate(divide="ignore", invalid="ignore"):
        between = below * above * (sums / below - (sums[-1] - sums) / above) ** 2
    parted = np.nan_to_num(between[:-1])
    return unit * float(edges[1:][parted.argmax()]) if parted.any() else (3.0 * low + high) / 4.0


# -- building -----------------------------------------------------------------------------------------------------


def _begin(nature: Nature) -> tuple[Network, str]:
    """A network with the file, and the id of its node."""
    network = Network()
    plain = unicodedata.normalize("NFKD", nature.path.name.partition(".")[0]).encode("ascii", "ignore").decode()
    name = re.sub(r"\W", "_", plain).strip("_") or "data"
    name = name if ID.fullmatch(name) else f"data_{name}"
    options = {"component": 0} if nature.components > 1 else {}
    network.add("source.volume", name, path=str(nature.path), **options)
    return network, name


def _camera(nature: Nature) -> Camera:
    """From the front, a little from the left and above, with nearly all of the volume's box in sight."""
    direction = np.array([0.45, -1.0, 0.3])
    field_of_view = 30.0
    distance = 0.42 * nature.diagonal / np.sin(np.radians(field_of_view / 2))
    eye = nature.centre + direction / np.linalg.norm(direction) * distance
    return Camera(eye=tuple(eye), target=tuple(nature.centre), field_of_view=field_of_view)


def _cast(nature: Nature, backdrop: str = "blend", /, **params: Any) -> Network:
    """The file through a ray-caster, cropped by a box."""
    network, file = _begin(nature)
    network.add("geometry.proxy_box", "crop")
    network.add("render.entry_exit_points", "rays")
    network.add("render.raycast", "raycast", camera=_camera(nature), **params)
    for node in ("raycast", "rays"):
        network.link(f"{node}.camera", "camera")
    network.connect(f"{file}.volume", "crop.volume")
    network.connect("crop.geometry", "rays.geometry")
    network.connect(f"{file}.volume", "raycast.volume")
    network.connect("rays.interval", "raycast.interval")
    _show(network, "raycast", "background", "view", backdrop)
    network.link("view.camera", "camera")
    return network


def _show(network: Network, rendered: str, background: str, view: str, backdrop: str = "blend") -> None:
    """A picture on a backdrop, dark grey or black, in a view."""
    look = {"color": (0.0, 0.0, 0.0)} if backdrop == "black" else BLEND
    network.add("image.background", background, **look)
    network.add("output.view", view)
    network.connect(f"{rendered}.image", f"{background}.image")
    network.connect(f"{background}.composed", f"{view}.image")


def _raycast(nature: Nature) -> Network:
    length = nature.diagonal / 200.0
    if nature.kind == "ct":
        keys = [
            (100.0, (0.5, 0.03, 0.015), 0.0),
            (180.0, (0.55, 0.035, 0.02), 0.12),
            (320.0, (0.7, 0.1, 0.05), 0.3),
            (480.0, (0.86, 0.6, 0.36), 0.45),
            (900.0, (0.96, 0.88, 0.72), 0.8),
        ]
    else:
        start, end = nature.threshold, max(nature.high, nature.threshold)
        keys = [
            (start, (0.25, 0.1, 0.06), 0.0),
            (start + 0.25 * (end - start), (0.5, 0.22, 0.12), 0.06),
            (start + 0.6 * (end - start), (0.8, 0.5, 0.3), 0.25),
            (end, (0.98, 0.9, 0.75), 0.6),
        ]
    return _cast(nature, transfer_function=TransferFunction(keys, length))


def _surface(nature: Nature) -> Network:
    value = nature.ids[0] / 2 if nature.ids else 250.0 if nature.kind == "ct" else nature.threshold
    return _cast(nature, mode="iso", iso_value=value)


def _maximum(nature: Nature) -> Network:
    low, high = (0.0, 600.0) if nature.kind == "ct" else (nature.low, nature.high)
    grey = TransferFunction([(low, (0.0, 0.0, 0.0), 1.0), (high, (1.0, 1.0, 1.0), 1.0)])
    return _cast(nature, "black", mode="maximum", transfer_function=grey)


def _slices(nature: Nature) -> Network:
    network, file = _begin(nature)
    for name, normal in RADIOLOGICAL.items():
        plane = Plane(origin=tuple(nature.centre), normal=normal)
        if nature.ids:
            look: dict[str, Any] = {"coloring": "transfer_function", "interpolation": "nearest"}
            look["transfer_function"] = _label_colors(nature.ids)
        else:
            look = {"window": nature.window}
        network.add("render.slice", name, plane=plane, **look)
        network.connect(f"{file}.volume", f"{name}.volume")
        _show(network, name, f"{name}_background", f"{name}_view", "blend" if nature.ids else "black")
    return network


def _label_colors(ids: tuple[int, ...]) -> TransferFunction:
    """Each id in a colour of its own, and nothing where there is none: steps half way between whole numbers."""
    keys: list[tuple[float, tuple[float, ...], float]] = [(0.5, (0.0, 0.0, 0.0), 0.0)]
    for place, id in enumerate(ids):
        color = colorsys.hsv_to_rgb(0.02 + 0.618034 * place, 0.65, 0.85)
        if keys[-1][0] != id - 0.5:
            keys += [(keys[-1][0], (0.0, 0.0, 0.0), 0.0)] * (len(keys) > 1) + [(id - 0.5, (0.0, 0.0, 0.0), 0.0)]
        keys += [(id - 0.5, color, 1.0), (id + 0.5, color, 1.0)]
    return TransferFunction(keys)
