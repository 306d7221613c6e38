"""`nodegraph docs` and `nodegraph new`: what is generated is current, complete, and works."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from nodegraph import docs_pages, registry

ROOT = Path(__file__).resolve().parents[2]


def test_the_pages_of_the_repository_are_current(cli) -> None:
    ran = cli("docs", "--check", "--out", ROOT / "docs")
    assert ran == (0, "", "")


def test_pages_are_written_found_stale_and_removed(cli, tmp_path) -> None:
    first = cli("docs", "--out", tmp_path).out.splitlines()
    assert len(first) == len(docs_pages.pages())
    assert cli("docs", "--out", tmp_path).out == ""
    page = tmp_path / "processors" / "render.raycast.md"
    page.write_text(page.read_text() + "by hand\n")
    (tmp_path / "processors" / "gone.md").write_text("a processor of yesterday")
    stale = cli("docs", "--check", "--out", tmp_path)
    assert stale.code == 1
    assert [line.split("/")[-1].split()[0] for line in stale.err.splitlines()] == ["render.raycast.md", "gone.md"]
    cli("docs", "--out", tmp_path)
    assert "by hand" not in page.read_text()
    assert not (tmp_path / "processors" / "gone.md").exists()


def test_a_page_tells_every_port_and_parameter_and_no_plugin_has_one(cli, plugins) -> None:
    pages = docs_pages.pages()
    for entry in registry.catalogue():
        name = f"processors/{entry['id']}.md"
        if entry["origin"] != "nodegraph":
            assert name not in pages
            continue
        text = pages[name]
        for told in (entry["inputs"], entry["outputs"], entry["params"]):
            for port, declared in told.items():
                assert f"| `{port}` |" in text
                assert declared["doc"].replace("|", "\\|") in text
        assert f"[{entry['id']}]({entry['id']}.md)" in pages["processors/index.md"]
        rows = [line for line in text.splitlines() if line.startswith("|")]
        assert {len(re.findall(r"(?<!\\)\|", row)) for row in rows} <= {4, 6}


@pytest.mark.slow
@pytest.mark.parametrize("form", [(), ("--glsl",)], ids=["python", "glsl"])
def test_a_new_processor_is_found_documented_and_tested(cli, tmp_path, monkeypatch, form) -> None:
    ran = cli("new", "processor", "filter.sharpen", "--folder", tmp_path, *form)
    assert ran.code == 0
    files = [Path(line) for line in ran.out.splitlines()]
    assert len(files) == 2
    assert all(file.is_file() for file in files)
    monkeypatch.setenv("NODEGRAPH_PATH", str(tmp_path))
    registry.default.cache_clear()
    entry = next(entry for entry in cli("list", "--json").json if entry["id"] == "filter.sharpen")
    assert "unavailable" not in entry
    (test,) = [file for file in files if file.name.startswith("test_")]
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(test)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("name", ["Sharpen", "filter.", "a b", "../escape"])
def test_a_name_that_is_none_is_refused(cli, tmp_path, name) -> None:
    ran = cli("new", "processor", name, "--folder", tmp_path)
    assert ran.code == 2
    assert len(ran.err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_overwritten(cli, tmp_path) -> None:
    first = cli("new", "processor", "filter.sharpen", "--folder", tmp_path)
    again = cli("new", "processor", "filter.sharpen", "--folder", tmp_path)
    assert (first.code, again.code) == (0, 2)
    assert "sharpen" in again.err
