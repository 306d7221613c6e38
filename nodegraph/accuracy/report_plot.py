"""The plot of a measurement: error over time, the front through the points that no other beats."""

from __future__ import annotations

import importlib.util
import io
import math
import os
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from nodegraph.accuracy.points import Measured, Point, text
from nodegraph.errors import FormatError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Colours that people with every kind of colour vision tell apart. Source: Okabe and Ito 2008.
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c6d31")
MARKERS = "osD^vP*X"
DPI = 150
MOST_INSIDE = 8
"""A longer legend stands beside the axes."""


def can_plot() -> bool:
    """Whether matplotlib is installed."""
    return importlib.util.find_spec("matplotlib") is not None


def write_plot(measured: Measured, path: str | os.PathLike[str]) -> None:
    """Write the plot as PNG. Raises FormatError without matplotlib, or where the file cannot be written."""
    from nodegraph.formats.atomic import replacing

    picture = plot(measured)
    with replacing(path) as part:
        part.write_bytes(picture)


def plot(measured: Measured) -> bytes:
    """The plot as the bytes of a PNG file. Raises FormatError without matplotlib.

    A line joins the points of one device that differ in one number only. What has no error at all stands at the lower
    edge of a logarithmic axis, as a triangle that points down.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise FormatError("a plot needs the package matplotlib: pip install 'nodegraph[plot]'") from None

    figure = Figure(figsize=(8.6, 5.2), dpi=DPI, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    points = [point for point in measured.points if point.runs and math.isfinite(_error(measured, point))]
    heights = _heights(measured, points)
    _draw_series(axes, measured, points, heights)
    _draw_front(axes, measured, points, heights)
    _dress(axes, measured, points)
    _label_front(axes, points, heights)
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    return stream.getvalue()


def series_of(measured: Measured, points: Sequence[Point]) -> Iterator[tuple[str, str, list[Point]]]:
    """(settings, device, points) of what belongs together: one device, and all settings but the first number alike."""
    numeric = next(
        (
            place
            for place in measured.places
            if len({text(point.settings.get(place)) for point in measured.points}) > 1
            and all(_is_number(point.settings.get(place)) for point in measured.points)
        ),
        "",
    )
    groups: dict[tuple[str, ...], list[Point]] = {}
    several = {
        place for place in measured.places if len({text(point.settings.get(place)) for point in measured.points}) > 1
    }
    for point in points:
        own = [_named(place, value) for place, value in point.settings.items() if place != numeric and place in several]
        groups.setdefault((point.device, *own), []).append(point)
    for (device, *own), members in groups.items():
        ordered = sorted(members, key=lambda point: point.settings.get(numeric, 0) if numeric else 0)
        yield ", ".join(own), device, ordered


def _named(place: str, value: Any) -> str:
    if isinstance(value, str):
        return value
    return f"{place.rpartition('.')[2]} {text(value)}"


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _error(measured: Measured, point: Point) -> float:
    error = point.errors.get(measured.error, math.nan)
    # A psnr of inf is no error at all; it gets the place that 0 has.
    return 0.0 if error == math.inf and measured.error in measured.rising else error


def _heights(measured: Measured, points: Sequence[Point]) -> dict[int, float]:
    """Where each point stands, by its identity: what cannot stand on a logarithmic axis stands below all others."""
    errors = {id(point): _error(measured, point) for point in points}
    if measured.error in measured.rising:
        top = max((error for error in errors.values() if error != 0.0), default=1.0)
        return {key: error if error != 0.0 else 1.1 * top for key, error in errors.items()}
    least = min((error for error in errors.values() if error > 0.0), default=1.0)
    return {key: error if error > 0.0 else least / 10 for key, error in errors.items()}


def _draw_series(axes: Axes, measured: Measured, points: Sequence[Point], heights: dict[int, float]) -> None:
    devices = list(measured.devices) or [""]
    groups = list(series_of(measured, points))
    several = len({own for own, _, _ in groups}) > 1
    names: dict[str, int] = {}
    for own, device, members in groups:
        label = ", ".join(part for part in (own, device if len(devices) > 1 or not own else "") if part)
        color = COLORS[names.setdefault(own if several else device, len(names)) % len(COLORS)]
        marker = MARKERS[(devices.index(device) if device in devices else 0) % len(MARKERS)]
        times = [1000 * point.seconds for point in members]
        axes.plot(times, [heights[id(point)] for point in members], color=color, lw=0.9, alpha=0.45, zorder=2)
        for exact in (False, True):
            chosen = [point for point in members if (_error(measured, point) == 0.0) == exact]
            told = "no error" in axes.get_legend_handles_labels()[1]
            axes.plot(
                [1000 * point.seconds for point in chosen],
                [heights[id(point)] for point in chosen],
                linestyle="none",
                marker="v" if exact else marker,
                color=color,
                ms=6 if not exact else 8,
                mec="white",
                mew=0.6,
                zorder=3,
                label=label if not exact else "no error" if chosen and not told else None,
            )


def _draw_front(axes: Axes, measured: Measured, points: Sequence[Point], heights: dict[int, float]) -> None:
    for number, reference in enumerate(sorted({point.reference for point in points})):
        chosen = [point for point in points if point.front and point.reference == reference]
        front = sorted(chosen, key=lambda point: point.seconds)
        times, errors = [1000 * point.seconds for point in front], [heights[id(point)] for point in front]
        # Between two points of the front, what can be had in that time is the left one.
        label = "front" if number == 0 else None
        axes.plot(times, errors, color="#222222", lw=1.4, drawstyle="steps-post", zorder=1, label=label)
        axes.plot(times, errors, linestyle="none", marker="o", ms=12, mfc="none", mec="#222222", mew=1.1, zorder=4)


def _label_front(axes: Axes, points: Sequence[Point], heights: dict[int, float]) -> None:
    """Write the settings beside the points of the front, of several that lie close together beside the first."""
    front = sorted((point for point in points if point.front), key=lambda point: point.seconds)
    taken: list[Any] = []
    for point in front:
        at = axes.transData.transform((1000 * point.seconds, heights[id(point)]))
        if any(abs(at[0] - other[0]) < 0.9 * DPI and abs(at[1] - other[1]) < 0.12 * DPI for other in taken):
            continue
        taken.append(at)
        told = ", ".join(
            text(value) if isinstance(value, str) else f"{place.rpartition('.')[2]} {text(value)}"
            for place, value in point.settings.items()
        )
        axes.annotate(
            told,
            (1000 * point.seconds, heights[id(point)]),
            xytext=(8, 7),
            textcoords="offset points",
            fontsize=7,
            color="#333333",
            zorder=5,
            bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": "none", "alpha": 0.75},
        )


def _dress(axes: Axes, measured: Measured, points: Sequence[Point]) -> None:
    unit = measured.units.get(measured.error, "")
    axes.set_xlabel("time, ms (median)")
    axes.set_ylabel(f"{measured.error}{f', {unit}' if unit else ''}")
    title = f"{measured.name or 'network'}: {measured.view}"
    axes.set_title(f"{title}, {measured.size[0]}x{measured.size[1]}" if measured.size else title, fontsize=11)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(True, which="major", color="#dddddd", lw=0.7)
    axes.grid(True, which="minor", color="#eeeeee", lw=0.4)
    axes.set_axisbelow(True)
    if not points:
        axes.text(0.5, 0.5, "nothing could be measured", transform=axes.transAxes, ha="center", color="#666666")
        return
    axes.set_xscale("log")
    if measured.error not in measured.rising:
        axes.set_yscale("log")
    axes.margins(x=0.12, y=0.1)
    for axis in (axes.xaxis, axes.yaxis):
        if axis.get_scale() == "log":
            low, high = sorted(axis.get_view_interval())
            axis.set_major_formatter(_plain)
            axis.set_minor_formatter(_plain if high < 4 * low else _sparse if high < 300 * low else _nothing)
    axes.tick_params(which="both", labelsize=8)
    if len(axes.get_legend_handles_labels()[1]) <= MOST_INSIDE:
        axes.legend(fontsize=8, frameon=False, loc="best")
    else:
        axes.figure.legend(fontsize=8, frameon=False, loc="outside right upper")


def _nothing(value: float, place: float) -> str:
    return ""


def _plain(value: float, place: float) -> str:
    return f"{value:g}"


def _sparse(value: float, place: float) -> str:
    """Of the minor ticks of a logarithmic axis, only 2 and 5 are written: more would run into one another."""
    digit = round(value / 10 ** math.floor(math.log10(value))) if value > 0 else 0
    return f"{value:g}" if digit in (2, 5) else ""
