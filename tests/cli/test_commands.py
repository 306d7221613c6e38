"""The commands that look at things: list, info, check, explain, why, convert, docs, and the overview."""

from __future__ import annotations

import io

import numpy as np
import pytest

import nodegraph
from nodegraph import formats
from nodegraph.cli import COMMANDS
from nodegraph.cli.terminal import Progress
from nodegraph.data import Labels, Volume
from nodegraph.data.space import affine


def test_the_overview_lists_every_command(cli) -> None:
    for arguments in ((), ("--help",), ("help",)):
        ran = cli(*arguments)
        assert ran.code == 0
        assert all(f"\n  {name} " in ran.out for name in COMMANDS)
    assert cli("--version").out == f"nodegraph {nodegraph.__version__}\n"


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command, capsys) -> None:
    from nodegraph.cli import main

    with pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert f"nodegraph {command}" in text
    assert len(text.splitlines()) > 5


def test_list_names_processors_and_why_one_is_unavailable(cli) -> None:
    ran = cli("list")
    assert ran.code == 0
    lines = dict(line.split(None, 1) for line in ran.out.splitlines())
    assert lines["trial.picture"] == "One grey."
    assert "a_package_that_nobody_has" in lines["trial.broken"]
    assert "render.raycast" in lines
    assert [line.split()[0] for line in cli("list", "trial", "grey").out.splitlines()] == ["trial.picture"]


def test_list_json_holds_every_declaration(cli) -> None:
    entries = {entry["id"]: entry for entry in cli("list", "--json").json}
    picture = entries["trial.picture"]
    assert picture["params"]["level"]["min"] == 0.0
    assert picture["params"]["shade"]["choices"] == ["plain", "ramp"]
    assert picture["outputs"]["image"]["type"] == "Image"
    assert "unavailable" in entries["trial.broken"]


def test_check_lists_devices_and_requires_them(cli) -> None:
    told = cli("check", "--json").json
    assert {device["name"] for device in told["devices"]} >= {"gl", "cl", "cl64"}
    assert "trial.broken" in told["unavailable"]
    required = cli("check", "--require", "gl", "--require", "cl", "--require", "cl64", "--quiet")
    assert required == (0, "", "")
    assert "trial.broken is unavailable" in cli("check").out


def test_check_says_which_package_brings_a_missing_device(cli, monkeypatch) -> None:
    from nodegraph import compute
    from nodegraph.compute.survey import Finding

    monkeypatch.setattr(
        compute, "survey", lambda: [Finding("gl", False, "gl: no OpenGL library was found", cure="apt install libegl1")]
    )
    ran = cli("check", "--require", "gl", "--quiet")
    assert ran == (2, "", "nodegraph: gl: no OpenGL library was found (apt install libegl1)\n")
    assert "missing" in cli("check").out


def test_explain_prints_every_task_with_its_size_and_who_asked(cli, workspace) -> None:
    ran = cli("explain", workspace(), "--size", "20x10")
    assert ran.code == 0
    assert "20x10" in ran.out
    assert "asked by view" in ran.out


def test_why_names_what_would_run_a_node_again(cli, workspace) -> None:
    changed = cli("why", workspace(), "view", "--set", "picture.level=0.25").out
    assert changed.startswith("view: runs again: ")
    assert "level" in changed
    assert cli("why", workspace(), "picture", "--set", "view.height=4", "--size", "8x8").out.startswith(
        "picture: stays clean"
    )
    assert "has not run" in cli("why", workspace(), "picture").out
    unknown = cli("why", workspace(), "pictur")
    assert unknown.code == 2
    assert "did you mean 'picture'" in unknown.err


def test_info_tells_a_header_and_a_workspace(cli, workspace, tmp_path) -> None:
    volume = Volume(np.arange(24, dtype=np.int16).reshape(2, 3, 4), affine((1.0, 2.0, 3.0)))
    formats.write(volume, tmp_path / "small.nrrd")
    told = cli("info", tmp_path / "small.nrrd", "--json").json
    assert told["kind"] == "Volume"
    assert "4" in cli("info", tmp_path / "small.nrrd").out
    told = cli("info", workspace(), "--json").json
    assert told["nodes"] == {"picture": "trial.picture", "view": "output.view"}
    assert told["views and effects"] == ["view"]
    cli("run", workspace(), "--out", tmp_path)
    assert cli("info", tmp_path / "view.png", "--json").json["nodes"] == told["nodes"]
    missing = cli("info", tmp_path / "smal.nrrd")
    assert missing.code == 2
    assert "small.nrrd" in missing.err


def test_info_names_the_problems_of_a_workspace(cli, workspace) -> None:
    ran = cli("info", workspace(picture=None), "--json")
    assert "view" in ran.json["problems"]


def test_convert_keeps_values_and_places(cli, tmp_path) -> None:
    volume = Volume(np.arange(24, dtype=np.int16).reshape(2, 3, 4) - 7, affine((1.0, 2.0, 3.0), (5.0, 6.0, 7.0)))
    formats.write(volume, tmp_path / "a.nrrd")
    ran = cli("convert", tmp_path / "a.nrrd", tmp_path / "b.nii.gz")
    assert (ran.code, ran.out) == (0, f"{tmp_path / 'b.nii.gz'}\n")
    back = formats.read(tmp_path / "b.nii.gz")
    assert isinstance(back, Volume)
    points = [np.append(np.asarray(index, float), 1.0) for index in ((0, 0, 0), (3, 2, 1))]
    for point in points:
        world = volume.index_to_world @ point
        nearest = np.rint((back.world_to_index @ world)[:3]).astype(int)
        assert back.real()[tuple(nearest[::-1])] == volume.real()[tuple(point[2::-1].astype(int))]


def test_convert_reads_ids_as_ids(cli, tmp_path) -> None:
    labels = Labels(np.array([[[0, 70000]]], np.uint32))
    formats.write(labels, tmp_path / "a.nrrd")
    assert cli("convert", "--labels", tmp_path / "a.nrrd", tmp_path / "b.nrrd").code == 0
    assert formats.read_labels(tmp_path / "b.nrrd").data.max() == 70000


@pytest.mark.parametrize(
    ("source", "target", "said"),
    [("nowhere.nrrd", "b.nrrd", "no such file"), ("a.xyz", "b.nrrd", ".xyz"), ("a.nrrd", "b.xyz", ".xyz")],
)
def test_convert_refuses_in_one_sentence(cli, tmp_path, source, target, said) -> None:
    ran = cli("convert", tmp_path / source, tmp_path / target)
    assert ran.code == 2
    assert said in ran.err
    assert len(ran.err.splitlines()) == 1


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_is_drawn_over_itself_on_a_terminal_only(monkeypatch) -> None:
    monkeypatch.setenv("TERM", "xterm")
    terminal, pipe = Terminal(), io.StringIO()
    for stream in (terminal, pipe):
        with Progress(stream, every=0.0) as progress:
            progress.show("raycast", 0.5)
            progress.show("x" * 500, 2.0)
    assert terminal.getvalue().startswith("\r\x1b[Kraycast  50 %")
    assert terminal.getvalue().endswith("100 %\r\x1b[K")
    assert max(map(len, terminal.getvalue().split("\r"))) < 90
    assert pipe.getvalue() == ""


def test_a_list_of_nothing_says_so_with_the_near_miss(cli) -> None:
    ran = cli("list", "gausian")
    assert (ran.code, ran.out) == (0, "")
    assert ran.err == "nodegraph: no processor has gausian in its id or text (did you mean 'gaussian'?)\n"
