"""`nodegraph tune` and `nodegraph run --error`: what they say, what they write, and what they leave alone."""

from __future__ import annotations

import functools
import importlib
import json
import os
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from nodegraph import formats, registry, workspace
from tests.support import slab_file

pytestmark = pytest.mark.slow

QUICK = ("--cameras", 2, "--held-out", 2, "--repeats", 2)


@pytest.fixture
def slab(tmp_path, monkeypatch):
    """A workspace whose errors have a closed form."""
    monkeypatch.setenv("NODEGRAPH_PATH", str(slab_file.write_plugin(tmp_path / "plugins")))
    registry.default.cache_clear()
    yield slab_file.write_workspace(tmp_path / "slab.json", step=0.125)
    registry.default.cache_clear()


@pytest.fixture
def quick_reference(monkeypatch):
    """References of `run` with a bound that samples at the beginnings of pieces reach."""
    module = importlib.import_module("nodegraph.accuracy.reference")
    monkeypatch.setattr(module, "reference", functools.partial(module.reference, bound=1e-3))


@pytest.mark.usefixtures("quick_reference")
def test_it_prints_the_cheapest_setting_as_set_takes_it(cli, slab) -> None:
    before = slab.read_bytes()
    ran = cli("tune", slab, "--max-error", 0.05, *QUICK)
    # The given view has an error of 0.0490 at 1/8 and 0.0237 at 1/16; 0.8 of 0.05 is allowed to the search.
    assert slab_file.error(0.125) > 0.04 > slab_file.error(0.0625)
    assert (ran.code, ran.out) == (0, "slab.step=0.0625\n")
    assert "over 2 cameras that had no part in the search: max" in ran.err
    assert "front:" in ran.err
    assert slab.read_bytes() == before
    again = cli("run", slab, "--set", ran.out.strip(), "--error", "--device", "cl64", "--out", slab.parent, "--json")
    assert again.json["accuracy"]["view"]["max"] == pytest.approx(slab_file.error(0.0625), abs=2e-3)


def test_json_tells_everything(cli, slab) -> None:
    ran = cli("tune", slab, "--max-error", 0.1, "--json", *QUICK)
    told = ran.json
    assert ran.code == told["exit_code"] == 0
    assert told["ok"] is True
    assert told["settings"] == {}  # 1/8 is what it is, and 1/4 errs by 0.104
    assert told["best"]["errors"]["max"] == pytest.approx(slab_file.error(0.125), abs=2e-3)
    assert told["held_out"]["cameras"] == [2, 3]
    assert told["error"] <= 0.1
    assert told["measure"] == "max"
    assert told["size"] == [6, 4]
    assert any(one["front"] for one in told["tried"])
    assert told["written"] is False


def test_write_puts_the_settings_into_the_workspace_and_leaves_the_rest(cli, slab) -> None:
    before = json.loads(slab.read_text())
    ran = cli("tune", slab, "--max-error", 0.05, "--write", *QUICK)
    assert ran.code == 0
    assert f"written into {slab}" in ran.err
    after = json.loads(slab.read_text())
    assert after["nodes"]["slab"]["params"].pop("step") == 0.0625
    before["nodes"]["slab"]["params"].pop("step")
    camera = before["variables"]["camera"]["value"]
    assert camera.items() <= after["variables"]["camera"].pop("value").items()
    del before["variables"]["camera"]["value"]
    assert after == before
    assert list(after) == list(before)
    assert workspace.load(slab).get("slab.step") == 0.0625
    assert sorted(os.listdir(slab.parent)) == ["plugins", "slab.json"]
    # What was found is the best there is, so a second time changes nothing.
    text = slab.read_bytes()
    assert cli("tune", slab, "--max-error", 0.05, "--write", *QUICK).out == ""
    assert slab.read_bytes() == text


def test_what_cannot_be_kept_is_offered_and_not_written(cli, slab) -> None:
    before = slab.read_bytes()
    ran = cli("tune", slab, "--budget-ms", 1e-4, "--write", "--cameras", 1, "--held-out", 0, "--repeats", 1)
    assert ran.code == 3
    assert "no setting that was tried keeps 0.0001 ms; the best of them has max" in ran.err
    assert ran.out.startswith("slab.step=")
    assert "is left as it was" in ran.err
    assert slab.read_bytes() == before


def test_what_cannot_be_written_is_said_before_the_search(cli, slab) -> None:
    before = slab.read_bytes()
    ran = cli("tune", slab, "--max-error", 0.05, "--set", "slab.step=0.5", "--write")
    assert (ran.code, ran.out) == (2, "")
    assert "leave one of them out" in ran.err
    slab.chmod(0o444)
    ran = cli("tune", slab, "--max-error", 0.05, "--write")
    assert (ran.code, ran.out) == (2, "")
    assert "cannot be written to" in ran.err
    assert slab.read_bytes() == before


def test_settings_are_printed_where_writing_them_fails(cli, slab, monkeypatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(workspace, "_replace", full)
    before = slab.read_bytes()
    ran = cli("tune", slab, "--max-error", 0.05, "--write", "--cameras", 1, "--held-out", 0, "--repeats", 1)
    assert (ran.code, ran.out) == (2, "slab.step=0.0625\n")
    assert "No space left on device" in ran.err
    assert slab.read_bytes() == before


def test_a_workspace_that_changed_meanwhile_is_not_overwritten(cli, slab, monkeypatch) -> None:
    module = importlib.import_module("nodegraph.accuracy.tune")
    real = module.tune

    def slow(*arguments, **options):
        found = real(*arguments, **options)
        slab.write_text(slab.read_text() + " ")
        return found

    monkeypatch.setattr(module, "tune", slow)
    ran = cli("tune", slab, "--max-error", 0.05, "--write", "--cameras", 1, "--held-out", 0, "--repeats", 1)
    assert ran.code == 2
    assert "was changed while this ran" in ran.err
    assert workspace.load(slab).get("slab.step") == 0.125


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "--max-error"),
        (("--max-error", "0"), "above 0"),
        (("--max-error", "0.1", "--view", "veiw"), "did you mean 'view'"),
        (("--max-error", "0.1", "--measure", "rsme"), "did you mean 'rmse'"),
        (("--max-error", "much"), "--max-error"),
        (("--max-error", "0.1", "--set", "slab.setp=1"), "did you mean 'step'"),
        (("--max-error", "0.1", "--cameras", "0"), "at least 1 camera"),
    ],
)
def test_a_mistake_is_one_sentence(cli, slab, arguments, message) -> None:
    ran = cli("tune", slab, *arguments)
    assert ran.code == 2
    assert message in ran.err
    assert ran.err.count("\n") == 1


def test_several_views_want_a_name_and_a_picture_cannot_be_written_to(cli, slab, tmp_path) -> None:
    content = json.loads(slab.read_text())
    content["nodes"]["second"] = content["nodes"]["view"]
    two = tmp_path / "two.json"
    two.write_text(json.dumps(content))
    ran = cli("tune", two, "--max-error", 0.1)
    assert (ran.code, "2 views (view, second); name one with --view" in ran.err) == (2, True)
    ran = cli("tune", tmp_path / "picture.png", "--max-error", 0.1, "--write")
    assert (ran.code, "--write needs a workspace file" in ran.err) == (2, True)


def test_ctrl_c_leaves_the_workspace_untouched(slab) -> None:
    before = slab.read_bytes()
    code = "from nodegraph.cli import main; print('ready', flush=True); raise SystemExit(main())"
    command = [sys.executable, "-c", code, "tune", str(slab), "--max-error", "1e-9", "--write", "--repeats", "1000"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(3.0)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert err.splitlines()[-1] == "nodegraph: interrupted"
    assert slab.read_bytes() == before


@pytest.mark.usefixtures("quick_reference")
def test_run_tells_the_error_of_what_it_rendered(cli, slab, tmp_path) -> None:
    out = tmp_path / "view.exr"
    ran = cli("run", slab, "--error", "--out", out)
    assert ran.code == 0
    assert ran.out == f"{out}\n"
    line = next(line for line in ran.err.splitlines() if line.startswith("nodegraph: view: error"))
    expected = slab_file.error(0.125)
    told = float(re.search(r"max ([0-9.]+)", line)[1])
    assert told == pytest.approx(expected, abs=2e-3)
    assert "0 % left out" in line
    assert "RMSE" in line
    assert "PSNR" in line
    assert "99.9 percentile" in line
    # The picture that was written has that error.
    alpha = formats.read(out).color[..., 3]
    np.testing.assert_allclose(1.0 - np.exp(-1.0) - alpha, expected, atol=1e-6)


def test_run_tells_a_reference_that_does_not_converge(cli, slab, monkeypatch, tmp_path) -> None:
    module = importlib.import_module("nodegraph.accuracy.reference")
    real = module.reference
    monkeypatch.setattr(module, "reference", lambda *a, **o: real(*a, **o, bound=1e-7, max_rounds=3))
    ran = cli("run", slab, "--view", "view", "--error", "--json", "--out", tmp_path)
    told = ran.json["accuracy"]["view"]
    assert ran.code == 0
    assert told["reference"]["converged"] is False
    assert told["left_out"] == 1.0
    assert told["max"] == pytest.approx(slab_file.error(0.125) - slab_file.error(0.03125), rel=1e-5)
    assert told["reference"]["difference"] == pytest.approx(
        slab_file.error(0.0625) - slab_file.error(0.03125), rel=1e-6
    )
