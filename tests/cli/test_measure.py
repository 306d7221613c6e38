"""`nodegraph measure` on the command line: what is printed, what is written, what is refused."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def scene(workspace: Callable[..., Path]) -> Path:
    """A field, cast with rays, 12 x 9 pixels."""
    return workspace(
        picture=None,
        field={"type": "source.synthetic", "version": 1, "params": {"voxels": [8, 8, 8]}},
        raycast={"type": "render.raycast", "version": 1, "inputs": {"volume": "field.volume"}},
        view={
            "type": "output.view",
            "version": 1,
            "params": {"width": 12, "height": 9},
            "inputs": {"image": "raycast.image"},
        },
    )


@pytest.mark.slow
def test_a_picture_is_measured_on_two_settings(cli: Callable[..., Any], scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "front"
    ran = cli(
        "measure", scene, "--view", "view", "--vary", "raycast.step=1,4", "--repeats", "2", "--out", out, "--flip"
    )
    assert ran.code == 0, ran.err
    head, first, _ = ran.out.splitlines()
    assert head.split()[:3] == ["raycast.step", "device", "ms"]
    assert "flip" in head
    assert first.startswith("*  1 "), "the finer of the two is on the front"
    assert "reference" in ran.err
    told = json.loads((out / "measure.json").read_text())
    fine, coarse = told["points"]
    assert (fine["settings"], coarse["settings"]) == ({"raycast.step": 1.0}, {"raycast.step": 4.0})
    assert 0.0 < fine["errors"]["rmse"] < coarse["errors"]["rmse"]
    assert fine["front"]
    assert told["timed"] == ["raycast", "view"]
    assert told["name"] == "grey"
    assert len(fine["runs"]) == 2
    assert {file.name for file in out.iterdir()} == {"measure.json", "measure.csv", "measure.html", "measure.png"}
    with open(out / "measure.csv", newline="") as file:
        assert [row["raycast.step"] for row in csv.DictReader(file)] == ["1", "4"]


def test_a_volume_on_every_device_as_json(cli: Callable[..., Any], workspace: Callable[..., Path]) -> None:
    file = workspace(
        picture=None,
        view=None,
        field={"type": "source.synthetic", "version": 1, "params": {"voxels": [12, 12, 12]}},
        gradient={"type": "filter.gradient", "version": 1, "inputs": {"volume": "field.volume"}},
    )
    ran = cli("measure", file, "--view", "gradient", "--device", "all", "--repeats", "1", "--json")
    assert ran.code == 0, ran.err
    assert ran.json["ok"] is True
    assert ran.json["files"] == []
    single, other, double = ran.json["points"]
    assert [point["device"] for point in ran.json["points"]] == ["gl", "cl", "cl64"]
    assert double["errors"]["max"] == 0.0, "it is the reference"
    assert 0.0 < single["errors"]["max"] < 1e-3
    assert 0.0 < other["errors"]["max"] < 1e-3
    assert double["front"]


def test_a_setting_that_fails_leaves_the_others_and_ends_with_1(
    cli: Callable[..., Any], workspace: Callable[..., Path]
) -> None:
    file = workspace(
        faulty={"type": "trial.faulty", "version": 1, "params": {"divisor": 2}, "inputs": {"image": "picture.image"}},
        view={"type": "output.view", "version": 1, "inputs": {"image": "faulty.same"}},
    )
    ran = cli("measure", file, "--vary", "faulty.divisor=0,1", "--size", "8x8", "--repeats", "1", "--json")
    assert ran.code == 1
    bad, good = ran.json["points"]
    assert "ZeroDivisionError" in bad["failure"]
    assert bad["errors"] == {}
    assert not good["failure"]
    assert good["errors"]["max"] == 0.0
    assert "faulty.divisor=0 on" in ran.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--vary", "raycast.step=9e9"], "raycast.step: 9000000000.0 voxel is outside"),
        (["--vary", "raycast.stepp=1"], "raycast.stepp"),
        (["--vary", "cast.step=1"], "cast: no such node"),
        (["--vary", "raycast.step"], "not of the form node.param=values"),
        (["--vary", "raycast.step=1", "--vary", "raycast.step=2"], "raycast.step: varied twice"),
        (["--view", "vieww"], "vieww: no such node (did you mean 'view'?)"),
        (["--view", "raycast.picture"], "no output 'picture'"),
        (["--error", "maximum"], "maximum: no such error of view"),
        (["--error", "flip"], "say --flip as well"),
        (["--repeats", "0"], "not a number of repeats"),
        (["--bound", "2"], "not a bound between 0 and 1"),
        (["--device", "vulkan"], "vulkan"),
        (["--colour", "red"], "--colour"),
    ],
)
def test_what_makes_no_sense_is_one_sentence(
    cli: Callable[..., Any], scene: Path, arguments: list[str], message: str
) -> None:
    ran = cli("measure", scene, *arguments)
    assert ran.code == 2
    assert ran.out == ""
    assert message in ran.err
    assert len(ran.err.strip().splitlines()) == 1
    assert "Traceback" not in ran.err


def test_what_changes_the_world_is_not_measured(
    cli: Callable[..., Any], workspace: Callable[..., Path], tmp_path: Path
) -> None:
    target = str(tmp_path / "note.txt")
    note = {"type": "trial.note", "version": 1, "params": {"path": target}, "inputs": {"image": "picture.image"}}
    ran = cli("measure", workspace(note=note), "--view", "note")
    assert ran.code == 2
    assert "note: it changes the world, so it is not measured; name what it reads, picture.image" in ran.err
    assert not (tmp_path / "note.txt").exists()


def test_without_double_precision_there_is_one_sentence(
    cli: Callable[..., Any], scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import importlib

    from nodegraph.errors import DeviceMissing

    reference = importlib.import_module("nodegraph.accuracy.reference")

    def missing(*_: Any, **__: Any) -> Any:
        raise DeviceMissing("cl64: no OpenCL device here computes in double precision")

    monkeypatch.setattr(reference, "reference", missing)
    ran = cli("measure", scene, "--vary", "raycast.step=1,2")
    assert ran.code == 2
    assert ran.err.strip() == "nodegraph: cl64: no OpenCL device here computes in double precision"


def test_without_flip_evaluator_nothing_runs(
    cli: Callable[..., Any], scene: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import importlib.util

    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *a: None if name == "flip_evaluator" else found(name, *a)
    )
    ran = cli("measure", scene, "--flip")
    assert ran.code == 2
    assert "pip install 'nodegraph[accuracy]'" in ran.err


def test_several_views_ask_for_a_name(cli: Callable[..., Any], workspace: Callable[..., Path]) -> None:
    other = {"type": "output.view", "version": 1, "inputs": {"image": "picture.image"}}
    ran = cli("measure", workspace(other=other))
    assert ran.code == 2
    assert "name what shall be measured with --view (there are view, other)" in ran.err


@pytest.mark.parametrize("json", [(), ("--json",)])
def test_what_was_measured_is_printed_where_it_cannot_be_written(
    cli: Callable[..., Any], scene: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, json: tuple[str, ...]
) -> None:
    import nodegraph.accuracy.report as report
    from nodegraph.errors import FormatError

    def full(*_: Any) -> Any:
        raise FormatError("cannot be written: the disk is full", file="front")

    monkeypatch.setattr(report, "write_all", full)
    ran = cli("measure", scene, "--size", "8x8", "--repeats", "1", "--out", tmp_path / "front", *json)
    assert ran.code == 2
    assert "the disk is full" in ran.err
    if json:
        assert ran.json["points"][0]["errors"]
        assert ran.json["ok"] is False
    else:
        assert "max" in ran.out
