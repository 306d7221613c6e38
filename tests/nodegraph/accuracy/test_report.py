"""What a measurement is written to: JSON, CSV, a plot, a page that stands alone."""

from __future__ import annotations

import base64
import csv
import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nodegraph import formats
from nodegraph.accuracy import report_plot
from nodegraph.accuracy.points import Measured, Point, ReferenceNote
from nodegraph.accuracy.report import document, write_all, write_csv, write_json
from nodegraph.accuracy.report_html import milliseconds, number, render
from nodegraph.accuracy.report_pictures import HOLE, LEFT_OUT, WIDEST, amplified, reduce, shown
from nodegraph.accuracy.report_plot import plot, series_of
from nodegraph.data import Image
from nodegraph.data.image import srgb_encode
from nodegraph.errors import FormatError

pytestmark = pytest.mark.slow


def picture(level: float, width: int = 16, height: int = 8) -> Image:
    color = np.full((height, width, 4), level)
    color[..., 3] = 1.0
    return Image(color)


def point(step: float, integrator: str, seconds: float, error: float, **more: Any) -> Point:
    settings = {"raycast.step": step, "raycast.integrator": integrator}
    figures = {"max": error, "psnr": -20 * math.log10(error) if error else math.inf}
    runs = (0.9 * seconds, seconds, 1.2 * seconds)
    image = picture(0.5 + error)
    return Point(settings, "gl", seconds, seconds / 2, 0.001, 2048, runs, figures, image=image, **more)


def measured(*points: Point, **more: Any) -> Measured:
    points = points or (
        point(1.0, "midpoint", 0.010, 0.1),
        point(0.5, "midpoint", 0.020, 0.025),
        point(1.0, "gauss2", 0.030, 0.05),
        point(0.5, "gauss2", 0.040, 0.0),
        Point({"raycast.step": 0.25, "raycast.integrator": "gauss2"}, "gl", failure="raycast: <out> of memory"),
    )
    told = {
        "name": "brain & co", "view": "view", "size": (16, 8), "repeats": 3, "error": "max", "units": {"psnr": "dB"},
        "rising": frozenset({"psnr"}), "timed": ("raycast", "view"), "devices": {"gl": "llvmpipe"}, "machine": "2",
        "references": (ReferenceNote({}, "reference in 3 rounds", True, 1e-6, 1e-5, 3, image=picture(0.5)),),
    }  # fmt: skip
    return Measured(points=points, **{**told, **more}).with_front()


# -- JSON and CSV ----------------------------------------------------------------------------------------------------


def test_json_holds_everything_and_no_number_that_json_has_not(tmp_path: Path) -> None:
    write_json(measured(), tmp_path / "m.json")
    text = (tmp_path / "m.json").read_text()
    told = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert told == document(measured())
    assert [p["front"] for p in told["points"]] == [True, True, False, True, False]
    assert told["points"][3]["errors"] == {"max": 0.0, "psnr": "inf"}
    assert told["points"][4]["failure"] == "raycast: <out> of memory"
    assert told["points"][4]["seconds"] == "nan"
    assert told["references"][0]["rounds"] == 3
    assert told["size"] == [16, 8]


def test_csv_has_a_line_for_each_point(tmp_path: Path) -> None:
    write_csv(measured(), tmp_path / "m.csv")
    with open(tmp_path / "m.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        "raycast.step", "raycast.integrator", "device", "seconds", "device_seconds", "prepare_seconds", "bytes",
        "max", "psnr", "front", "failure",
    ]  # fmt: skip
    assert [float(row["seconds"]) for row in rows[:4]] == [0.010, 0.020, 0.030, 0.040]
    assert float(rows[1]["max"]) == 0.025
    assert [row["front"] for row in rows] == ["yes", "yes", "no", "yes", "no"]
    assert rows[4]["seconds"] == rows[4]["max"] == ""
    assert rows[4]["failure"] == "raycast: <out> of memory"


def test_a_file_that_cannot_be_written_is_told_and_none_is_left(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(FormatError, match="taken"):
        write_all(measured(), tmp_path / "taken")
    with pytest.raises(FormatError, match="does not exist"):
        write_json(measured(), tmp_path / "nowhere" / "m.json")


# -- pictures --------------------------------------------------------------------------------------------------------


def test_a_difference_is_amplified_by_a_power_of_two_that_fits() -> None:
    reference = picture(0.5, 100, 20)
    value = reference.color.copy()
    value[3, 4, 1] += 0.9  # one pixel of 2000 does not decide
    value[5, :, 0] += 0.03
    found = amplified(Image(value), reference)
    assert found.factor == 32.0, "0.03 * 32 fits, 0.03 * 64 does not"
    light = found.image.color[..., :3].sum(axis=2)
    assert light[3, 4] == light.max()
    assert light[0, 0] < 0.01
    assert light[0, 0] < light[5, 0] <= light[3, 4]
    assert amplified(reference, reference).factor == 0.0


def test_one_bad_pixel_alone_decides_after_all() -> None:
    value = picture(0.5, 100, 20).color.copy()
    value[3, 4, 1] += 0.25
    assert amplified(Image(value), picture(0.5, 100, 20)).factor == 4.0


def test_holes_and_what_is_left_out_have_colours_of_their_own() -> None:
    value = picture(0.5).color.copy()
    value[0, 0] = np.nan
    value[1, 1] = 0.6
    mask = np.ones((8, 16), bool)
    mask[1, 1] = False
    found = amplified(Image(value), picture(0.5), mask)
    assert found.factor == 0.0, "what is left out does not count"
    assert found.image.color[0, 0, :3] == pytest.approx(HOLE)
    assert found.image.color[1, 1, :3] == pytest.approx(LEFT_OUT)


def test_large_pictures_are_reduced_and_a_bad_pixel_stays_visible() -> None:
    plane = np.zeros((2 * WIDEST + 1, 100))
    plane[-1, -1] = 1.0
    assert reduce(plane, np.max).shape == (math.ceil((2 * WIDEST + 1) / 3), 34)
    assert reduce(plane, np.max)[-1, -1] == 1.0
    assert reduce(plane + 1.0, np.mean)[0, 0] == 1.0
    assert reduce(plane[:10], np.max).shape == (10, 100)


def test_distances_are_shown_as_the_length_between_them() -> None:
    distances = np.full((2, 2, 2), np.inf)
    distances[0] = [[10.0, 12.0], [30.0, 38.0]]
    distances[1, 0] = [5.0, 2.0]
    seen = shown(Image(distances)).color[..., 0]
    assert seen.tolist() == [[0.25, 1.0], [0.0, 0.0]]
    assert shown(Image(np.full((2, 2, 1), 0.25))).color[0, 0].tolist() == [0.25, 0.25, 0.25, 1.0]


# -- the plot --------------------------------------------------------------------------------------------------------


def test_the_plot_is_a_picture_with_something_in_it(tmp_path: Path) -> None:
    report_plot.write_plot(measured(), tmp_path / "plot.png")
    drawn = formats.read(tmp_path / "plot.png")
    assert isinstance(drawn, Image)
    assert drawn.size == (1290, 780)
    assert drawn.color[..., :3].std() > 0.02


@pytest.mark.parametrize("error", ["max", "psnr"])
def test_whatever_was_found_can_be_plotted(error: str) -> None:
    """Warnings are errors here, so a logarithm of nothing would fail."""
    failed = Point({"raycast.step": 1.0}, "gl", failure="no")
    exact = point(1.0, "midpoint", 0.01, 0.0)
    for points in ((failed,), (exact, point(2.0, "midpoint", 0.01, 1e-9))):
        assert plot(measured(*points).with_front(error)).startswith(b"\x89PNG")


def test_a_line_joins_what_differs_in_one_number() -> None:
    found = measured()
    groups = [
        (own, device, [p.settings["raycast.step"] for p in members])
        for own, device, members in series_of(found, found.points[:4])
    ]
    assert groups == [("midpoint", "gl", [0.5, 1.0]), ("gauss2", "gl", [0.5, 1.0])]


# -- the page --------------------------------------------------------------------------------------------------------


@pytest.fixture
def no_plot(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages without their plot, which takes longer than all else."""
    monkeypatch.setattr(report_plot, "can_plot", lambda: False)


class Page(HTMLParser):
    """Checks that every element is closed, and collects what the page would fetch."""

    EMPTY = ("meta", "img", "br", "link", "input")

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []
        self.targets: list[str] = []
        self.ids: list[str] = []
        self.words: list[str] = []
        self.rows: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        if tag not in self.EMPTY:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append(found.get("class") or "")
        self.sources += [value for name, value in attrs if name in ("src", "href") and value]
        self.ids += [value for name, value in attrs if name == "id" and value]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def read(page: str) -> Page:
    parsed = Page()
    parsed.feed(page)
    parsed.close()
    assert not parsed.open
    return parsed


def test_the_page_stands_alone() -> None:
    page = render(measured())
    parsed = read(page)
    assert all(source.startswith(("data:image/png;base64,", "#")) for source in parsed.sources)
    assert "http" not in page
    assert {source[1:] for source in parsed.sources if source.startswith("#")} <= set(parsed.ids)
    pictures = [source for source in parsed.sources if source.startswith("data:")]
    assert len(pictures) == 1 + 1 + 2 * 4, "plot, reference, a picture and a difference of each"
    for url in (*pictures, *re.findall(r"url\((data:[^)]*)\)", page)):
        assert base64.b64decode(url.partition(",")[2]).startswith(b"\x89PNG")


@pytest.mark.usefixtures("no_plot")
def test_the_page_tells_rows_front_failures_and_names_as_they_are() -> None:
    page = render(measured())
    parsed = read(page)
    assert parsed.rows == ["", "front", "front", "", "front", "failed"]
    words = " ".join(parsed.words)
    assert "brain & co: view" in words
    assert "raycast: <out> of memory" in words
    assert "<out>" not in page
    assert "Reference in 3 rounds" in words
    assert "difference x 8" in words  # 0.1 * 8 fits
    assert "no difference" in words


@pytest.mark.usefixtures("no_plot")
def test_the_page_warns_of_a_reference_that_did_not_converge_and_shows_where() -> None:
    mask = np.ones((8, 16), bool)
    mask[0] = False
    note = ReferenceNote({}, "the reference did not converge", False, 0.1, 1e-5, 9, 0.125, picture(0.5), mask)
    page = render(measured(references=(note,)))
    assert '<p class="warning">The reference did not converge.</p>' in page
    assert "12.5 % did not converge" in page


@pytest.mark.usefixtures("no_plot")
def test_a_page_without_pictures_or_without_any_result() -> None:
    bare = Point({}, "gl", 0.01, 0.0, 0.0, 10, (0.01,), {"absolute": 0.5})
    page = render(
        measured(bare, error="absolute", size=None, references=(ReferenceNote({}, failure="no reference: x"),))
    )
    read(page)
    assert "Pictures" not in page
    read(render(measured(Point({}, "gl", failure="no"))))


@pytest.mark.usefixtures("no_plot")
def test_a_page_shows_so_many_pictures_and_those_on_the_front_first() -> None:
    points = [point(1.0 + i, "midpoint", 1.0 + i, 0.5 if i != 59 else 0.001) for i in range(60)]
    page = render(measured(*points))
    assert "40 of 60 are shown, those on the front first" in page
    assert {"p0", "p59"} <= set(read(page).ids)


def test_without_matplotlib_there_is_all_but_the_plot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(report_plot, "can_plot", lambda: False)
    files = write_all(measured(), tmp_path / "new" / "folder")
    assert [file.name for file in files] == ["measure.json", "measure.csv", "measure.html"]
    assert "pip install 'nodegraph[plot]'" in files[2].read_text()
    monkeypatch.undo()
    assert [file.name for file in write_all(measured(), tmp_path)][-1] == "measure.png"
    assert all(file.stat().st_size > 100 for file in tmp_path.glob("measure.*"))


def test_numbers_have_three_digits() -> None:
    assert [number(v) for v in (0.0, 0.012345, 1.5e-7, 123456.0, math.inf, -math.inf, math.nan)] == [
        "0", "0.0123", "1.50e-07", "1.23e+05", "∞", "-∞", "-",
    ]  # fmt: skip
    assert number(2.0, "mm") == "2 mm"
    assert [milliseconds(v) for v in (1.2345, 0.0123456, 1e-5, math.nan)] == ["1,234", "12.3", "0.01", "-"]


def test_the_scale_begins_dark_and_grows_lighter() -> None:
    from nodegraph.accuracy.report_pictures import SCALE

    from_srgb = SCALE / 255.0
    linear = np.where(from_srgb <= 0.04045, from_srgb / 12.92, ((from_srgb + 0.055) / 1.055) ** 2.4)
    light = linear @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(light) > 0).all()
    assert srgb_encode(light[:1])[0] < 0.05
