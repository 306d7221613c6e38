"""``explain --scene`` on the command line: it runs the views, says what that required, and writes nothing."""

from __future__ import annotations

import pytest


def test_scene_runs_the_views_and_writes_nothing(cli, workspace, tmp_path) -> None:
    file = workspace()
    before = sorted(path.name for path in tmp_path.rglob("*"))
    ran = cli("explain", file, "--scene", "--size", "20x10")
    assert ran.code == 0
    assert ran.out.startswith("view: 2 nodes, 2 ran")
    assert "picture  20x10 final, asked by view" in ran.out
    assert "why            it has not run before in this engine" in ran.out
    assert f"host {20 * 10 * 16 / 1000:g} kB" in ran.out
    assert sorted(path.name for path in tmp_path.rglob("*")) == before
    plain = cli("explain", file, "--size", "20x10")
    assert "2 to run" in plain.out, "without --scene nothing runs"


def test_scene_tells_failures_and_ends_with_their_code(cli, workspace) -> None:
    ran = cli("explain", workspace(), "--scene", "--size", "4x4", "--set", "picture.table=no_such_file.txt")
    assert ran.code == 1
    assert "no_such_file.txt" in ran.err
    assert "picture" in ran.out
    assert "Traceback" not in ran.err


def test_the_help_says_that_scene_runs_something(cli, capsys) -> None:
    with pytest.raises(SystemExit):
        cli("explain", "--help")
    told = " ".join(capsys.readouterr().out.split())
    assert "Nothing is run, unless --scene" in told
    assert "writes no file" in told
