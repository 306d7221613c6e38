"""Errors of a value against a reference, by the type of the value; so any output of any processor has some.

Plug-ins bring measures of their own types as `Measure` objects in the entry-point group ``nodegraph.measures``.
What a number means and how it is computed is told in docs/accuracy.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from nodegraph import data
from nodegraph.accuracy.differences import Differences, distance
from nodegraph.data.buffer import Array
from nodegraph.data.volume import Grid, slabs
from nodegraph.errors import PortError
from nodegraph.ports import article, port_type

Errors = dict[str, float]
Compare = Callable[[Any, Any, Array | None], Errors]


class Measure(NamedTuple):
    """How values of one type are compared.

    compare(value, reference, mask) returns figures by name, 0 where there is no error; it may assume that both values
    are of ``type``, and raises PortError where they cannot be compared. mask (or None) is True where to look.
    figures: the names of all that it may return; the first is meant by "the error" where none is named.
    rising: figures of which more is better. units: of figures that have one.
    """

    type: type
    compare: Compare
    figures: tuple[str, ...]
    rising: frozenset[str] = frozenset()
    units: Mapping[str, str] = {}

    @property
    def first(self) -> str:
        """The figure that is meant where none is named."""
        return self.figures[0]


def errors(value: Any, reference: Any, mask: Array | None = None, *, flip: bool = False) -> Errors:
    """How far ``value`` lies from ``reference``, figures by name.

    mask: of grids and pictures, True where to look; the rest is left out. flip: of pictures, also the mean FLIP, which
    takes about a second for each million pixels and needs the extra ``accuracy``.
    Raises PortError for values that cannot be compared: of two types, of two sizes, of a type without a measure.
    """
    value, reference = _plain(value), _plain(reference)
    measure = measure_of(value)
    if not isinstance(reference, measure.type):
        raise PortError(
            f"measure: {article(port_type(type(value)).name)} cannot be compared with "
            f"{article(port_type(type(reference)).name)}; compare results of one output"
        )
    found = measure.compare(value, reference, mask)
    if flip and isinstance(value, data.Image) and isinstance(reference, data.Image) and value.channels == 4:
        found["flip"] = mean_flip(value, reference, mask)
    return found


def _plain(value: Any) -> Any:
    """Numbers of numpy as plain ones, whole ones as real ones: what a port of the one kind may pass to the other."""
    value = value.item() if isinstance(value, np.generic) else value
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def measure_of(value: Any) -> Measure:
    """The measure of a value's type, or of its nearest ancestor that has one. Raises PortError where there is none."""
    return measure_for(type(value))


def measure_for(cls: type) -> Measure:
    """The measure of a type of ports. Raises PortError where there is none."""
    known = _measures()
    for ancestor in cls.__mro__:
        if ancestor in known:
            return known[ancestor]
    name = port_type(cls).name
    raise PortError(
        f"measure: there is no measure for {article(name)}; a plug-in may bring one in the group nodegraph.measures"
    )


def _measures() -> dict[type, Measure]:
    from nodegraph import plugins

    known = dict(_OWN)
    for plugin in plugins.discover("nodegraph.measures"):
        offered = plugin.object if isinstance(plugin.object, list) else [plugin.object]
        for measure in offered:
            if isinstance(measure, Measure):  # the types of this package keep their measures
                known.setdefault(measure.type, measure)
    return known


# -- pictures --------------------------------------------------------------------------------------------------------


def compare_images(value: data.Image, reference: data.Image, mask: Array | None) -> Errors:
    """max, rmse, p999 of linear premultiplied colour, psnr (dB, peak 1; not of distances); of depth and ids if known.

    max and p999 take the worst channel of a pixel. depth_max and depth_rmse (mm) look where both see something,
    depth_missed is the share of pixels where only one does, ids_wrong the share whose ids differ.
    """
    if value.size != reference.size or value.channels != reference.channels:
        raise PortError(
            f"measure: pictures of {_picture_text(value)} and {_picture_text(reference)} cannot be compared; "
            "render both in one size"
        )
    look = _mask(mask, reference.color.shape[:2])
    colors = _count(value.color[look], reference.color[look])
    found = {"max": colors.max, "rmse": colors.rmse}
    if value.channels != 2:
        found["psnr"] = colors.psnr(1.0)
    found["p999"] = colors.p999
    if value.depth is not None and reference.depth is not None:
        found |= _compare_depths(value.depth[look], reference.depth[look])
    if value.ids is not None and reference.ids is not None:
        found["ids_wrong"] = _share(value.ids[look] != reference.ids[look])
    return found


def _compare_depths(value: Array, reference: Array) -> Errors:
    seen, expected = ~np.isposinf(value), ~np.isposinf(reference)
    both = _count(value[seen & expected, None], reference[seen & expected, None])
    return {"depth_max": both.max, "depth_rmse": both.rmse, "depth_missed": _share(seen != expected)}


def mean_flip(value: data.Image, reference: data.Image, mask: Array | None = None) -> float:
    """The mean FLIP, 0..1, of RGBA pictures over black as an sRGB display shows them, 67 pixels to a degree.

    Source: Andersson et al., FLIP: A Difference Evaluator for Alternating Images, HPG 2020.
    Raises PortError where flip-evaluator is not installed or the sizes differ.
    """
    try:
        import flip_evaluator
    except ImportError:
        raise PortError("measure: FLIP needs the package flip-evaluator: pip install 'nodegraph[accuracy]'") from None
    if value.size != reference.size:
        raise PortError("measure: FLIP compares pictures of one size only")
    look = _mask(mask, reference.color.shape[:2])
    if not look.any():
        return math.nan
    each, _, _ = flip_evaluator.evaluate(
        display(reference), display(value), "LDR", inputsRGB=True, applyMagma=False, computeMeanError=False
    )
    return float(np.asarray(each, np.float64).reshape(look.shape)[look].mean())


def display(image: data.Image) -> Array:
    """What a display shows of an RGBA picture over black: sRGB (h, w, 3) float32 in 0..1; nan becomes black."""
    color = image.color[..., :3]  # premultiplied, so this is what it is over black, whatever its alpha
    return np.ascontiguousarray(data.image.srgb_encode(np.nan_to_num(color)), np.float32)


def _picture_text(image: data.Image) -> str:
    return f"{image.size[0]}x{image.size[1]} with {image.channels} channels"


# -- grids -----------------------------------------------------------------------------------------------------------


def compare_volumes(value: data.Volume, reference: data.Volume, mask: Array | None) -> Errors:
    """max, rmse, p999 of real values, in the volume's unit; psnr with the range of the reference as the peak, dB."""
    _require_one_grid(value, reference)
    if value.components != reference.components:
        raise PortError(f"measure: volumes of {value.components} and {reference.components} components differ in kind")
    look = _mask(mask, reference.data.shape[:3])
    differences = Differences(int(look.sum()))
    for slab in slabs(reference.data):
        inside = look[slab]
        pair = (_real(volume, slab)[inside].reshape(int(inside.sum()), -1) for volume in (value, reference))
        differences.add(distance(*pair))
    low, high = reference.range
    return {
        "max": differences.max,
        "rmse": differences.rmse,
        "psnr": differences.psnr(high - low),
        "p999": differences.p999,
    }


def compare_labels(value: data.Labels, reference: data.Labels, mask: Array | None) -> Errors:
    """wrong: the share of voxels whose ids differ."""
    _require_one_grid(value, reference)
    look = _mask(mask, reference.data.shape)
    return {"wrong": _share(value.data[look] != reference.data[look])}


def _real(volume: data.Volume, slab: slice) -> Array:
    real: Array = volume.data[slab].astype(np.float64) * volume.mapping.scale + volume.mapping.offset
    return real


def _require_one_grid(value: Grid, reference: Grid) -> None:
    if not value.is_same_grid(reference):
        raise PortError(
            f"measure: the grids differ ({value.summary()} and {reference.summary()}); resample one to the other first"
        )


# -- meshes, tables, numbers -----------------------------------------------------------------------------------------


def compare_meshes(value: data.Mesh, reference: data.Mesh, mask: Array | None) -> Errors:
    """max and rmse, mm, of the distance of each one's vertices to the other one's surface, both ways."""
    from nodegraph.accuracy.surfaces import distances_to_surface, vertices_of_surface

    _refuse_mask(mask, "Mesh")
    ways = [
        distances_to_surface(vertices_of_surface(one), other) for one, other in ((value, reference), (reference, value))
    ]
    apart = np.concatenate(ways)
    differences = Differences(len(apart))
    differences.add(apart[:, None])
    # Two meshes without a triangle are equal.
    return {"max": differences.max, "rmse": differences.rmse} if len(apart) else {"max": 0.0, "rmse": 0.0}


def compare_tables(value: data.Table, reference: data.Table, mask: Array | None) -> Errors:
    """absolute and relative: the greatest over all columns of numbers; text_wrong: the share of texts that differ."""
    _refuse_mask(mask, "Table")
    if value.columns != reference.columns or len(value) != len(reference):
        raise PortError(
            f"measure: tables of {value.summary()} and of {reference.summary()} cannot be compared; "
            "they need the same columns and rows"
        )
    found = {"absolute": 0.0, "relative": 0.0}
    texts = []
    for name in reference.columns:
        ours, theirs = value[name], reference[name]
        if "U" in (ours.dtype.kind, theirs.dtype.kind):
            texts.append(ours.astype(str) != theirs.astype(str))
            continue
        for figure, apart in _absolute_and_relative(ours, theirs).items():
            found[figure] = max(found[figure], apart)
    if texts:
        found["text_wrong"] = _share(np.concatenate(texts))
    return found


def compare_numbers(value: Any, reference: Any, mask: Array | None) -> Errors:
    """absolute, and relative to the reference (inf where that is 0 and the value is not); of several the greatest."""
    _refuse_mask(mask, "Number")
    ours, theirs = np.atleast_1d(np.asarray(value)), np.atleast_1d(np.asarray(reference))
    if ours.shape != theirs.shape:
        raise PortError(f"measure: {ours.size} and {theirs.size} numbers cannot be compared")
    if "U" in (ours.dtype.kind, theirs.dtype.kind) or "O" in (ours.dtype.kind, theirs.dtype.kind):
        raise PortError("measure: only numbers can be compared, and there is something else among these")
    return _absolute_and_relative(ours, theirs)


def compare_words(value: Any, reference: Any, mask: Array | None) -> Errors:
    """wrong: 1 where two texts or two switches differ, else 0."""
    _refuse_mask(mask, "Text")
    return {"wrong": float(value != reference)}


def _absolute_and_relative(value: Array, reference: Array) -> Errors:
    apart = distance(value, reference)
    size = np.abs(np.asarray(reference, np.float64))
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(apart == 0.0, 0.0, apart / size)
    # inf apart from an inf, or anything from a nan, has no ratio: it stays as far away as it is.
    relative = np.where(np.isnan(relative), np.inf, relative)
    return {"absolute": float(apart.max(initial=0.0)), "relative": float(relative.max(initial=0.0))}


# -- shared ----------------------------------------------------------------------------------------------------------


def _count(value: Array, reference: Array) -> Differences:
    """Statistics of arrays (n, c)."""
    differences = Differences(len(reference))
    differences.add(distance(value, reference))
    return differences


def _mask(mask: Array | None, shape: tuple[int, ...]) -> Array:
    if mask is None:
        return np.ones(shape, bool)
    mask = np.asarray(mask, bool)
    if mask.shape != shape:
        raise PortError(f"measure: the mask has the shape {mask.shape}, what it masks {shape}")
    return mask


def _refuse_mask(mask: Array | None, name: str) -> None:
    if mask is not None:
        raise PortError(f"measure: {article(name)} has no places that a mask could leave out")


def _share(wrong: Array) -> float:
    return float(wrong.mean()) if wrong.size else math.nan


_PSNR = frozenset({"psnr"})
_GRID = ("max", "rmse", "psnr", "p999")
_PICTURE = (*_GRID, "depth_max", "depth_rmse", "depth_missed", "ids_wrong", "flip")
_RATIO = ("absolute", "relative")

_OWN: dict[type, Measure] = {
    measure.type: measure
    for measure in (
        Measure(data.Image, compare_images, _PICTURE, _PSNR, {"psnr": "dB", "depth_max": "mm", "depth_rmse": "mm"}),
        Measure(data.Volume, compare_volumes, _GRID, _PSNR, {"psnr": "dB"}),
        Measure(data.Labels, compare_labels, ("wrong",)),
        Measure(data.Mesh, compare_meshes, ("max", "rmse"), units={"max": "mm", "rmse": "mm"}),
        Measure(data.Table, compare_tables, (*_RATIO, "text_wrong")),
        Measure(float, compare_numbers, _RATIO),
        Measure(int, compare_numbers, _RATIO),
        Measure(tuple, compare_numbers, _RATIO),
        Measure(bool, compare_words, ("wrong",)),
        Measure(str, compare_words, ("wrong",)),
    )
}
