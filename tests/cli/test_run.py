"""`nodegraph run`: what it writes, what it says, and with which exit code it ends."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from nodegraph import formats, registry
from nodegraph.data import Image
from nodegraph.errors import FormatError

Cli = Callable[..., "tuple[int, str, str]"]


def picture(path: Path) -> Image:
    image = formats.read(path)
    assert isinstance(image, Image)
    return image


def test_every_view_becomes_a_picture_named_after_its_node(cli, workspace, tmp_path) -> None:
    other = {"type": "output.view", "version": 1, "inputs": {"image": "picture.image"}}
    ran = cli("run", workspace(other=other), "--size", "12x6", "--out", tmp_path / "out")
    assert ran.code == 0
    assert sorted(os.listdir(tmp_path / "out")) == ["other.png", "view.png"]
    assert ran.out.splitlines() == [str(tmp_path / "out" / name) for name in ("view.png", "other.png")]
    image = picture(tmp_path / "out" / "view.png")
    assert image.color.shape == (6, 12, 4)
    np.testing.assert_allclose(image.color[..., 0], 0.5, atol=0.5 / 255 * 2)


def test_a_view_has_its_own_size_unless_another_is_asked_for(cli, workspace, tmp_path) -> None:
    cli("run", workspace(), "--out", tmp_path / "own.png")
    assert picture(tmp_path / "own.png").color.shape == (8, 16, 4)


def test_one_file_needs_exactly_one_view(cli, workspace, tmp_path) -> None:
    other = {"type": "output.view", "version": 1, "inputs": {"image": "picture.image"}}
    file = workspace(other=other)
    ran = cli("run", file, "--out", tmp_path / "a.png")
    assert ran.code == 2
    assert "2 views (view, other)" in ran.err
    assert "--view" in ran.err
    assert not (tmp_path / "a.png").exists()
    assert cli("run", file, "--view", "other", "--out", tmp_path / "a.exr").code == 0
    np.testing.assert_allclose(picture(tmp_path / "a.exr").color[0, 0], [0.5, 0.5, 0.5, 1.0])


def test_a_place_that_cannot_be_written_to_is_refused_before_anything_runs(cli, workspace, tmp_path) -> None:
    (tmp_path / "file").write_text("mine")
    file = workspace(picture={"type": "trial.faulty", "version": 1})
    for out in ("file", "file/deeper", "file/a.png"):
        ran = cli("run", file, "--view", "picture", "--out", tmp_path / out)
        assert (ran.code, ran.out) == (2, "")
        assert f"{tmp_path / 'file'} is no folder" in ran.err
        assert len(ran.err.splitlines()) == 1
    assert cli("sweep", workspace(), "--vary", "picture.level=0,1", "--out", tmp_path / "file").code == 2
    assert (tmp_path / "file").read_text() == "mine"


def test_a_folder_that_turns_into_a_file_meanwhile_is_one_sentence(tmp_path) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(FormatError, match="file/deeper: a file is in the way of this folder; choose another place"):
        formats.make_folder(tmp_path / "file" / "deeper")


def test_a_workspace_without_nodes_is_nothing_to_run(cli, tmp_path) -> None:
    (tmp_path / "bare.json").write_text('{"nodegraph": 1}')
    ran = cli("run", tmp_path / "bare.json")
    assert ran.code == 2
    assert "no nodes" in ran.err


@pytest.mark.parametrize(
    ("body", "said"),
    [
        ("return 3", "wrong.image: expected an Image, got an int"),
        ("return None", "wrong.image: process() returned nothing for this output"),
        ("raise ValueError('two\\n lines')", "wrong: ValueError: two lines (wrong.py, line 8)"),
        ("raise Mute", "wrong: Mute: no message (wrong.py, line 8)"),
    ],
)
def test_a_processor_that_breaks_its_own_word_gives_1(tmp_path, workspace, cli, monkeypatch, body, said) -> None:
    (tmp_path / "own" / "trial").mkdir(parents=True)
    (tmp_path / "own" / "trial" / "wrong.py").write_text(WRONG.format(body=body))
    monkeypatch.setenv("NODEGRAPH_PATH", str(tmp_path / "own"))
    registry.default.cache_clear()
    node = {"type": "trial.wrong", "version": 1}
    ran = cli(
        "run", workspace(picture=None, wrong=node, view={"type": "output.view", "inputs": {"image": "wrong.image"}})
    )
    assert ran.code == 1
    assert ran.err.splitlines()[0] == f"nodegraph: {said}"


WRONG = '''"""Wrong."""
from nodegraph import Output, Processor
from nodegraph.data import Image
class Wrong(Processor):
    """Wrong."""
    image = Output(Image, doc="A picture.")
    def process(self):
        {body}
class Mute(Exception):
    def __str__(self):
        raise RuntimeError
'''


def test_pictures_of_other_kinds_are_refused_before_anything_runs(cli, workspace, tmp_path) -> None:
    ran = cli("run", workspace(), "--out", tmp_path / "a.jpg")
    assert (ran.code, ran.out) == (2, "")
    assert ".png or .exr, not .jpg" in ran.err


def test_without_out_pictures_go_to_the_current_folder(cli, workspace, tmp_path, monkeypatch) -> None:
    with monkeypatch.context() as patch:
        patch.chdir(tmp_path)
        assert cli("run", workspace()).out == "view.png\n"
        assert (tmp_path / "view.png").is_file()


@pytest.mark.parametrize(
    ("setting", "color"),
    [
        ("picture.level=0.25", (0.25, 0.25, 0.25)),
        ("picture.level=1e-1", (0.1, 0.1, 0.1)),
        ("picture.inverted=yes", (0.5, 0.5, 0.5)),
        ("picture.shade=ramp", (0.0, 0.0, 0.0)),
        ("picture.offset=0.25,-0.25", (0.75, 0.25, 0.5)),
        ("picture.offset=[0, 0.5]", (0.5, 1.0, 0.5)),
        ("shared=0.125", (0.125, 0.125, 0.125)),
    ],
)
def test_set_reads_text_by_the_kind_of_the_parameter(cli, workspace, tmp_path, setting, color) -> None:
    linked = {"picture": {"type": "trial.picture", "version": 1}}
    if setting.startswith("shared"):
        linked["picture"]["links"] = {"level": "shared"}
    file = workspace(variables={"shared": {"kind": "Float", "value": 0.5}} if "shared" in setting else {}, **linked)
    assert cli("run", file, "--set", setting, "--out", tmp_path / "a.exr").code == 0
    np.testing.assert_allclose(picture(tmp_path / "a.exr").color[0, 0, :3], color, atol=1e-6)


def test_setting_a_linked_parameter_sets_its_variable(cli, workspace, tmp_path) -> None:
    nodes = {
        "picture": {"type": "trial.picture", "version": 1, "links": {"level": "grey"}},
        "second": {"type": "trial.picture", "version": 1, "links": {"level": "grey"}},
        "other": {"type": "output.view", "version": 1, "inputs": {"image": "second.image"}},
    }
    file = workspace(variables={"grey": {"kind": "Float", "value": 0.5}}, **nodes)
    cli("run", file, "--set", "picture.level=0.25", "--view", "other", "--out", tmp_path / "a.exr")
    assert picture(tmp_path / "a.exr").color[0, 0, 0] == 0.25


def test_paths_that_are_set_are_relative_to_the_current_folder(cli, workspace, tmp_path, monkeypatch) -> None:
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "level.txt").write_text("0.75")
    file = workspace()
    with monkeypatch.context() as patch:
        patch.chdir(tmp_path / "here")
        assert cli("run", file, "--set", "picture.table=level.txt", "--out", "a.exr").code == 0
    assert picture(tmp_path / "here" / "a.exr").color[0, 0, 0] == 0.75


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("picture.levle=1", "did you mean 'level'"),
        ("pictrue.level=1", "did you mean 'picture'"),
        ("picture.level=2", "picture.level"),
        ("picture.level=many", "picture.level"),
        ("picture.inverted=perhaps", "true or false"),
        ("picture.shade=rampp", "did you mean 'ramp'"),
        ("picture.number=1.5", "picture.number"),
        ("picture.offset=1,2,3", "picture.offset"),
        pytest.param("picture.offset=" + "[" * 100_000, "picture.offset", id="nested"),
        ("picture.shade=RAMP", "did you mean 'ramp'"),
        ("/picture.level=1", "/picture: no such group"),
        ("picture=1", "node.param"),
        ("picture.level", "node.param=value"),
        ("=1", "node.param=value"),
    ],
)
def test_a_wrong_setting_is_one_sentence_and_writes_nothing(cli, workspace, tmp_path, setting, said) -> None:
    ran = cli("run", workspace(), "--set", setting, "--out", tmp_path / "out")
    assert ran.code == 2
    assert said in ran.err
    assert ran.err.startswith("nodegraph: ")
    assert len(ran.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("size", ["12", "12x", "0x5", "axb", "100000x5", "-4x4"])
def test_a_wrong_size_is_refused(cli, workspace, size) -> None:
    ran = cli("run", workspace(), f"--size={size}")
    assert ran.code == 2
    assert len(ran.err.splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("run", "nowhere.json"), "no such file"),
        (("run", "."), "directory"),
        (("run",), "FILE"),
        (("runn",), "did you mean 'run'"),
        (("run", "a.json", "--devise", "gl"), "--devise"),
        (("run", "a.json", "--device", "vulkan"), "vulkan"),
    ],
)
def test_a_wrong_command_line_is_one_sentence(cli, arguments, said) -> None:
    ran = cli(*arguments)
    assert ran.code == 2
    assert said in ran.err
    assert len(ran.err.splitlines()) == 1


@pytest.mark.parametrize("text", ["", "{", "[]", '{"nodegraph": 99}', '{"nodegraph": 1, "nodes": 3}', "\x00\x01"])
def test_a_broken_workspace_is_one_sentence(cli, tmp_path, text) -> None:
    (tmp_path / "bad.json").write_text(text)
    ran = cli("run", tmp_path / "bad.json")
    assert ran.code == 2
    assert "bad.json" in ran.err
    assert len(ran.err.splitlines()) == 1


def test_an_unknown_view_names_the_near_miss(cli, workspace) -> None:
    ran = cli("run", workspace(), "--view", "veiw")
    assert ran.code == 2
    assert "did you mean 'view'" in ran.err


def test_a_failing_processor_gives_1_and_the_other_branches_go_on(cli, workspace, tmp_path) -> None:
    nodes = {
        "faulty": {"type": "trial.faulty", "version": 1, "inputs": {"image": "picture.image"}},
        "other": {"type": "output.view", "version": 1, "inputs": {"image": "faulty.same"}},
    }
    ran = cli("run", workspace(**nodes), "--out", tmp_path / "out")
    assert ran.code == 1
    assert os.listdir(tmp_path / "out") == ["view.png"]
    assert "faulty: ZeroDivisionError" in ran.err
    assert "not run because of that: other" in ran.err
    assert "Traceback" not in ran.err


@pytest.mark.parametrize(
    ("node", "said"),
    [
        ({"type": "trial.pictur", "version": 1}, "did you mean 'trial.picture'"),
        ({"type": "trial.broken", "version": 1}, "a_package_that_nobody_has"),
        ({"type": "trial.picture", "version": 1, "params": {"level": 7}}, "level"),
        ({"type": "trial.picture", "version": 1, "params": {"table": "missing.txt"}}, "missing.txt"),
        (None, "picture"),
    ],
)
def test_what_cannot_run_blocks_and_says_why(cli, workspace, tmp_path, node, said) -> None:
    ran = cli("run", workspace(picture=node), "--out", tmp_path / "out")
    assert ran.code in (1, 2)
    assert said in ran.err
    assert "Traceback" not in ran.err
    assert not (tmp_path / "out").exists()


def test_json_is_one_document_with_states_timings_bytes_and_files(cli, workspace, tmp_path) -> None:
    ran = cli("run", workspace(), "--json", "--out", tmp_path / "out")
    told = ran.json
    assert told["ok"] is True
    assert told["files"] == [str(tmp_path / "out" / "view.png")]
    assert told["nodes"]["picture"]["state"] == "clean"
    assert told["nodes"]["picture"]["seconds"] >= 0.0
    assert told["nodes"]["picture"]["bytes"] == 16 * 8 * 4 * 4
    assert set(told["ran"]) == {"picture", "view"}


def test_json_of_a_failure_names_the_nodes(cli, workspace, tmp_path) -> None:
    nodes = {
        "faulty": {"type": "trial.faulty", "version": 1, "inputs": {"image": "picture.image"}},
        "view": {"type": "output.view", "version": 1, "inputs": {"image": "faulty.same"}},
    }
    ran = cli("run", workspace(**nodes), "--json", "--out", tmp_path / "out")
    told = ran.json
    assert (ran.code, told["exit_code"], told["ok"], told["files"]) == (1, 1, False, [])
    assert told["nodes"]["faulty"]["state"] == "failed"
    assert told["nodes"]["view"]["state"] == "blocked"
    assert "ZeroDivisionError" in told["errors"]["faulty"]


def test_effects_run_and_are_not_pictures(cli, workspace, tmp_path) -> None:
    path = str(tmp_path / "mean.txt")
    note = {"type": "trial.note", "version": 1, "params": {"path": path}, "inputs": {"image": "picture.image"}}
    ran = cli("run", workspace(note=note), "--out", tmp_path / "a.png")
    assert ran.code == 0
    assert (tmp_path / "mean.txt").read_text() == "0.6250"


def test_a_picture_carries_the_workspace_that_made_it(cli, workspace, tmp_path) -> None:
    cli("run", workspace(), "--set", "picture.level=0.25", "--out", tmp_path / "first")
    ran = cli("run", tmp_path / "first" / "view.png", "--out", tmp_path / "second")
    assert ran.code == 0
    first, second = (picture(tmp_path / name / "view.png") for name in ("first", "second"))
    np.testing.assert_array_equal(first.color, second.color)
    assert first.color.shape == (8, 16, 4)


def test_an_exr_carries_it_as_well(cli, workspace, tmp_path) -> None:
    cli("run", workspace(), "--set", "picture.level=0.25", "--out", tmp_path / "first.exr")
    assert cli("run", tmp_path / "first.exr", "--out", tmp_path / "second.exr").code == 0
    np.testing.assert_array_equal(*(formats.read(tmp_path / name).color for name in ("first.exr", "second.exr")))
    assert "views and effects" in cli("info", tmp_path / "first.exr").out
    formats.write(Image(np.zeros((2, 2, 4), np.float32)), tmp_path / "plain.exr")
    assert "plain.exr: this picture carries no workspace" in cli("run", tmp_path / "plain.exr").err


def test_a_picture_without_anything_in_it_is_told(cli, workspace, tmp_path) -> None:
    nodes = {
        "nothing": {"type": "source.synthetic"},
        "away": {
            "type": "render.raycast",
            "params": {"camera": {"eye": [0, -900, 0], "target": [0, -1800, 0]}},
            "inputs": {"volume": "nothing.volume"},
        },
    }
    ran = cli("run", workspace(**nodes), "--view", "away", "--size", "4x4", "--out", tmp_path)
    assert ran.code == 0
    assert "away: every pixel is transparent" in ran.err
    assert "transparent" not in cli("run", workspace(), "--out", tmp_path).err


def test_a_picture_of_others_carries_no_workspace(cli, tmp_path) -> None:
    formats.write(Image(np.zeros((2, 2, 4), np.float32)), tmp_path / "plain.png")
    ran = cli("run", tmp_path / "plain.png")
    assert ran.code == 2
    assert "carries no workspace" in ran.err


def test_a_folder_that_cannot_be_written_is_one_sentence(cli, workspace, tmp_path) -> None:
    (tmp_path / "taken").write_text("a file")
    ran = cli("run", workspace(), "--out", tmp_path / "taken" / "below")
    assert ran.code == 2
    assert "taken" in ran.err
    assert "Traceback" not in ran.err


def test_a_mistake_of_ours_shows_its_traceback(cli, workspace, monkeypatch) -> None:
    from nodegraph import pictures

    monkeypatch.setattr(pictures, "views_of", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        cli("run", workspace())


SLEEPY = '''
"""Takes its time."""
import time
import numpy as np
from nodegraph import Output, Processor
from nodegraph.data import Image

class Sleepy(Processor):
    """Reports progress for a minute."""

    image = Output(Image, doc="Black.")

    def process(self, *, size, progress):
        for i in range(3000):
            time.sleep(0.02)
            progress(i / 3000)
        return Image(np.zeros((size[1], size[0], 4), np.float32))
'''


def test_an_interrupt_ends_with_130_and_leaves_no_file(workspace, tmp_path) -> None:
    (tmp_path / "plugins" / "trial").mkdir(parents=True)
    (tmp_path / "plugins" / "trial" / "sleepy.py").write_text(SLEEPY)
    file = workspace(picture={"type": "trial.sleepy", "version": 1})
    out = tmp_path / "out"
    environment = os.environ | {"NODEGRAPH_PATH": str(tmp_path / "plugins"), "PYTHONUNBUFFERED": "1"}
    command = [sys.executable, "-m", "nodegraph", "run", str(file), "--out", str(out)]
    with subprocess.Popen(
        command, env=environment, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        time.sleep(1.5)
        assert process.poll() is None
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert err.strip().splitlines()[-1] == "nodegraph: interrupted"
    assert "Traceback" not in err
    assert not out.exists()


def test_python_m_nodegraph_is_quiet_in_a_pipe(workspace, plugins, tmp_path) -> None:
    command = [sys.executable, "-m", "nodegraph", "run", str(workspace()), "--out", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout == f"{tmp_path / 'out' / 'view.png'}\n"
    assert done.stderr == ""


def test_output_into_a_closed_pipe_is_no_failure(plugins) -> None:
    command = f"{sys.executable} -m nodegraph list --json | head -n 1"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=True)
    assert json.loads(done.stdout.strip() + "]") == []
    assert done.stderr == ""
