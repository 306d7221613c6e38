"""`nodegraph new processor`: what it writes works at once."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from nodegraph import locations, scaffold
from nodegraph.errors import CommandError, FormatError
from nodegraph.registry import Registry

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("glsl", [False, True], ids=["python", "glsl"])
def test_the_written_test_passes(tmp_path: Path, glsl: bool) -> None:
    source, test = scaffold.new_processor("filter.make_bright", tmp_path, glsl=glsl)
    assert source == tmp_path / "filter" / ("make_bright.glsl" if glsl else "make_bright.py")
    result = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--rootdir", str(tmp_path), str(test)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, result.stdout + result.stderr
    assert " passed" in result.stdout
    found = Registry([locations.plugin_folder(tmp_path, "test")])
    assert found.ids() == ["filter.make_bright"]
    assert found.find("filter.make_bright").__name__ == "MakeBright"


def test_it_fits_on_a_page(tmp_path: Path) -> None:
    for glsl in (False, True):
        source, _ = scaffold.new_processor(f"filter.{'kernel' if glsl else 'code'}", tmp_path, glsl=glsl)
        assert len([line for line in source.read_text().splitlines() if line.strip()]) <= 15


@pytest.mark.parametrize(
    "name", ["Filter.sharpen", "filter.Sharpen", "filter.2d", "", "filter.", "a b", "tests.x", "x.id"]
)
def test_names_that_cannot_be_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(CommandError, match=r"^new processor"):
        scaffold.new_processor(name, tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("glsl", [False, True])
def test_nothing_is_overwritten(tmp_path: Path, glsl: bool) -> None:
    source, _ = scaffold.new_processor("filter.sharpen", tmp_path)
    source.write_text("mine")
    with pytest.raises(CommandError, match="exists already; nothing was written"):
        scaffold.new_processor("filter.sharpen", tmp_path, glsl=glsl)
    assert source.read_text() == "mine"


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "filter").write_text("a file is in the way")
    with pytest.raises(FormatError, match="filter: a file is in the way of this folder; choose another place"):
        scaffold.new_processor("filter.sharpen", tmp_path)


@pytest.mark.parametrize(
    "name",
    [
        "filter.test_x",
        "filter.conftest",
        "build.x",
        "a.data.x",
        "a.b.c.d.e.f.g.h",
        "filter.volume",
        "filter.gaussian_blur",
    ],
)
def test_names_that_would_not_be_found_or_work_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(CommandError, match=f"new processor {name}: "):
        scaffold.new_processor(name, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_written_leaves_no_half_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Path, "write_text", refuse)
    with pytest.raises(FormatError, match=r"sharpen.py: cannot be written: the disk is full"):
        scaffold.new_processor("filter.sharpen", tmp_path)
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []
