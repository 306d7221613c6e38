"""The report page of a measurement: one file that carries everything it shows."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from html import escape
from importlib import resources
from typing import TYPE_CHECKING

from nodegraph.accuracy.points import Measured, Point, text
from nodegraph.accuracy.report_pictures import amplified, data_url, png_url, shown

if TYPE_CHECKING:
    from nodegraph.data import Image

MOST_PICTURES = 40
"""More would make a page that no browser likes; those on the front come first."""


def write_html(measured: Measured, path: str | os.PathLike[str]) -> None:
    """Write the page. Raises FormatError where the file cannot be written."""
    from nodegraph.formats.atomic import replacing

    page = render(measured)
    with replacing(path) as part:
        part.write_text(page, encoding="utf-8")


def render(measured: Measured) -> str:
    """The page as text: summary, plot, table, pictures with amplified differences, and how it was measured."""
    title = escape(f"{measured.name or 'Network'}: {measured.view}")
    parts = [
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<style>\n{_resource('report.css')}</style></head><body><main>",
        f"<header><h1>{title}</h1><p>{escape(_facts(measured))}</p></header>",
        *_summary(measured),
        *_plot(measured),
        *_table(measured),
        *_pictures(measured),
        *_method(measured),
        f"</main><script>\n{_resource('report.js')}</script></body></html>\n",
    ]
    return "\n".join(parts)


def _resource(name: str) -> str:
    return resources.files("nodegraph.accuracy").joinpath(name).read_text(encoding="utf-8")


def _facts(measured: Measured) -> str:
    size = f"{measured.size[0]} x {measured.size[1]} pixels, " if measured.size else ""
    settings = len({point.label for point in measured.points})
    devices = ", ".join(measured.devices)
    return f"{size}{settings} setting{'s' if settings != 1 else ''} on {devices}; {measured.machine}"


def _summary(measured: Measured) -> Iterator[str]:
    good = [point for point in measured.points if point.runs and measured.error in point.errors]
    sign = -1.0 if measured.error in measured.rising else 1.0
    if good:
        fastest = min(good, key=lambda point: point.seconds)
        best = min(good, key=lambda point: (sign * _comparable(point.errors[measured.error]), point.seconds))
        yield '<section class="cards">'
        for name, point in (("Fastest", fastest), ("Most accurate", best)):
            figure = number(point.errors[measured.error], measured.units.get(measured.error, ""))
            yield (
                f'<div class="card"><h2>{name}</h2><p class="big">{milliseconds(point.seconds)} ms</p>'
                f"<p>{escape(measured.error)} {escape(figure)}</p><p>{escape(_told(measured, point))}</p></div>"
            )
        fronts = sum(point.front for point in good)
        rivals = " with the same reference" if len(measured.references) > 1 else ""
        yield (
            f'<div class="card"><h2>On the front</h2><p class="big">{fronts} of {len(measured.points)}</p>'
            f"<p>no other{rivals} is both faster and more accurate ({escape(measured.error)})</p></div>"
        )
        yield "</section>"
    for note in measured.references:
        unsure = "" if note.converged else ' class="warning"'
        which = ", ".join(f"{place}={text(value)}" for place, value in note.settings.items())
        told = note.failure or note.summary
        yield f"<p{unsure}>{escape(f'{which}: ' if which else '')}{escape(told[:1].upper() + told[1:])}.</p>"
    for text_ in dict.fromkeys([*measured.notes, *(n for note in measured.references for n in note.notes)]):
        yield f'<p class="warning">{escape(text_)}</p>'


def _plot(measured: Measured) -> Iterator[str]:
    from nodegraph.accuracy.report_plot import can_plot, plot

    yield "<h2>Error over time</h2>"
    if can_plot():
        yield f'<img class="plot" alt="{escape(measured.error)} over time" src="{png_url(plot(measured))}">'
    else:
        yield "<p class=\"warning\">There is no plot without matplotlib: pip install 'nodegraph[plot]'.</p>"


# -- the table --------------------------------------------------------------------------------------------------------


def _table(measured: Measured) -> Iterator[str]:
    yield "<h2>All settings</h2><p>Rows on the front are marked. A click on a heading sorts.</p>"
    heads = [*(place for place in measured.places), "device", "ms", "device ms", "prepare ms", "KiB"]
    for figure in measured.figures:
        unit = measured.units.get(figure, "")
        heads.append(f"{figure}, {unit}" if unit else figure)
    yield '<div class="scroll"><table><thead><tr><th></th>'
    words = len(measured.places) + 1  # columns that are no numbers
    yield "".join(f"<th{' class=n' if i >= words else ''}>{escape(head)}</th>" for i, head in enumerate(heads))
    yield "</tr></thead><tbody>"
    for place, point in enumerate(measured.points):
        yield _row(measured, place, point)
    yield "</tbody></table></div>"


def _row(measured: Measured, place: int, point: Point) -> str:
    kind = "failed" if point.failure else "front" if point.front else ""
    mark = f'<td><a href="#p{place}">&#9679;</a></td>' if point.front else "<td></td>"
    cells = [
        f"<td>{escape(text(point.settings[name])) if name in point.settings else ''}</td>" for name in measured.places
    ]
    cells.append(f"<td>{escape(point.device)}</td>")
    if point.runs:
        for seconds in (point.seconds, point.device_seconds, point.prepare_seconds):
            cells.append(f'<td class="n" data-v="{seconds!r}">{milliseconds(seconds)}</td>')
        cells.append(f'<td class="n" data-v="{point.bytes}">{point.bytes / 1024:,.0f}</td>')
    if point.failure:
        span = len(measured.figures) + (0 if point.runs else 4)
        cells.append(f'<td colspan="{max(1, span)}">{escape(point.failure)}</td>')
    else:
        for figure in measured.figures:
            error = point.errors.get(figure, math.nan)
            main = " main" if figure == measured.error else ""
            cells.append(f'<td class="n{main}" data-v="{error!r}">{number(error)}</td>')
    return f'<tr class="{kind}">{mark}{"".join(cells)}</tr>'


# -- the pictures -----------------------------------------------------------------------------------------------------


def _pictures(measured: Measured) -> Iterator[str]:
    pictures = [
        (place, point) for place, point in enumerate(measured.points) if point.image is not None and not point.failure
    ]
    if not pictures:
        return
    chosen = sorted(pictures, key=lambda one: not one[1].front)[:MOST_PICTURES]
    yield "<h2>Pictures</h2><p>Left what was rendered, right how far it lies from the reference: the greatest"
    yield "difference over the channels of each pixel, times the factor that is told, from black (none) to pale"
    yield "yellow (1 and more). The pointer over a picture shows the reference in its place.</p>"
    if len(chosen) < len(pictures):
        yield f"<p>{len(chosen)} of {len(pictures)} are shown, those on the front first.</p>"
    yield '<div class="pictures">'
    references = {place for _, point in chosen for place in [point.reference]}
    urls: dict[int, str] = {}
    for place in sorted(references):
        image = measured.references[place].image
        if image is not None:
            urls[place] = data_url(shown(image))
            yield _reference(measured, place, urls[place])
    # Each reference is held once, by the style; the pictures that turn into it only name it.
    yield "<style>" + "".join(f".r{place}{{background-image:url({url})}}" for place, url in urls.items()) + "</style>"
    for place, point in sorted(chosen):
        reference = measured.references[point.reference].image
        if point.image is not None and reference is not None:
            yield _figure(measured, place, point, point.image, reference)
    yield "</div>"


def _reference(measured: Measured, place: int, url: str) -> str:
    note = measured.references[place]
    which = ", ".join(f"{name}={text(value)}" for name, value in note.settings.items())
    left_out, told = "", f"{note.rounds} round{'' if note.rounds == 1 else 's'}"
    if note.left_out > 0.0 and note.image is not None and note.mask is not None:
        still, _ = amplified(note.image, note.image, note.mask)
        left_out = f'<img alt="what did not converge" src="{data_url(still)}">'
        told += f"; {number(100 * note.left_out)} % did not converge (right, in blue) and count nowhere"
    return (
        f'<figure><div class="pair"><img alt="reference" src="{url}">{left_out}</div>'
        f"<figcaption><b>Reference</b>{escape(f' for {which}' if which else '')}: {told}</figcaption></figure>"
    )


def _figure(measured: Measured, place: int, point: Point, image: Image, reference: Image) -> str:
    difference, factor = amplified(image, reference, measured.references[point.reference].mask)
    told = f"difference x {factor:,.6g}" if factor else "no difference"
    figures = ", ".join(
        f"{name} {number(point.errors[name], measured.units.get(name, ''))}"
        for name in dict.fromkeys((measured.error, "rmse", "flip"))
        if name in point.errors
    )
    label = escape(_told(measured, point))
    return (
        f'<figure id="p{place}" class="{"front" if point.front else ""}"><div class="pair">'
        f'<span class="swap r{point.reference}"><img alt="{label}" src="{data_url(shown(image))}"></span>'
        f'<img alt="{escape(told)}" src="{data_url(difference)}"></div>'
        f"<figcaption><b>{label}</b><br>{milliseconds(point.seconds)} ms; {escape(figures)}; {escape(told)}"
        "</figcaption></figure>"
    )


def _told(measured: Measured, point: Point) -> str:
    device = f" on {point.device}" if len(measured.devices) > 1 else ""
    return point.label + device


def _method(measured: Measured) -> Iterator[str]:
    devices = "".join(f"<li>{escape(name)}: {escape(told)}</li>" for name, told in measured.devices.items())
    repeats = f"{measured.repeats} repeats" if measured.repeats > 1 else "1 run"
    yield (
        "<h2>How it was measured</h2><ul>"
        f"<li>Timed: {escape(', '.join(measured.timed))}. What stands above, and what these keep by memo, was there "
        "already; making the memos is told as <i>prepare</i>.</li>"
        f"<li>Time: the median of {repeats}, from the request until the result lies on the host, after a run that does "
        "not count. Within a repeat all settings take turns.</li>"
        f"<li>Bytes: the distinct memory of the results and memos of the timed nodes.</li>{devices}</ul>"
    )
    notes = list(
        dict.fromkeys(f"{point.label} on {point.device}: {note}" for point in measured.points for note in point.notes)
    )
    if notes:
        yield "<h3>Notes</h3><ul>" + "".join(f"<li>{escape(note)}</li>" for note in notes) + "</ul>"


# -- numbers ----------------------------------------------------------------------------------------------------------


def number(value: float, unit: str = "") -> str:
    """Three digits, and a unit."""
    if not math.isfinite(value):
        return {math.inf: "∞", -math.inf: "-∞"}.get(value, "-")
    told = f"{value:.3g}" if value == 0.0 or 1e-4 <= abs(value) < 1e5 else f"{value:.2e}"
    return f"{told} {unit}".rstrip()


def milliseconds(seconds: float) -> str:
    """Three digits, never a power of ten."""
    if not math.isfinite(seconds):
        return "-"
    value = 1000 * seconds
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def _comparable(error: float) -> float:
    return math.inf if math.isnan(error) else error
