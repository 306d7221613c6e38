"""What the README shows, done: its plug-ins in a folder, its script, on each device."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import nodegraph
from nodegraph.data import Image, Volume
from nodegraph.registry import Registry

ROOT = Path(__file__).resolve().parent.parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```(python|glsl)\n(.*?)```", README, re.DOTALL)
PLUGINS = {match.group(1): text for _, text in BLOCKS if (match := re.match(r"(?:#|//) plugins/(\S+)\n", text))}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plugins")
    for name, text in PLUGINS.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text.split("\n", 1)[1], encoding="utf-8")
    return folder


def test_the_plug_ins_are_short():
    assert set(PLUGINS) == {"filter/threshold.py", "image/vignette.glsl"}
    lengths = {name: len([line for line in text.split("\n")[1:] if line.strip()]) for name, text in PLUGINS.items()}
    assert lengths["filter/threshold.py"] <= 15
    assert lengths["image/vignette.glsl"] <= 12


@pytest.mark.parametrize("device", ["gl", "cl", "cl64"])
def test_the_plug_ins_run(folder, device, monkeypatch):
    monkeypatch.setenv("NODEGRAPH_PATH", str(folder))
    registry = Registry()
    volume = Volume(np.linspace(-1, 1, 27, dtype=np.float32).reshape(3, 3, 3))
    cut = nodegraph.run(registry.find("filter.threshold"), volume=volume, level=0.25, device=device)
    assert np.array_equal(cut.data, np.maximum(volume.data, np.float32(0.25)))
    white = Image(np.ones((4, 6, 4), np.float32))
    dark = nodegraph.run(registry.find("image.vignette"), image=white, strength=1.0, device=device).color
    y, x = np.mgrid[:4, :6]
    p2 = ((x + 0.5) / 3 - 1) ** 2 + ((y + 0.5) / 2 - 1) ** 2
    assert np.abs(dark[..., 0] - (1 - 0.5 * p2)).max() < 1e-6
    assert np.all(dark[..., 3] == 1)


def test_the_script_runs(monkeypatch):
    monkeypatch.chdir(ROOT)
    (script,) = [text for kind, text in BLOCKS if kind == "python" and "nodegraph.load" in text]
    names: dict = {}
    exec(compile(script.replace("size=(256, 256)", "size=(24, 24)"), "README.md", "exec"), names)
    assert names["image"].color.shape == (24, 24, 4)
    assert names["smooth"].shape == (1, 24, 24)


def test_the_page_on_scripting_runs(tmp_path, monkeypatch):
    (tmp_path / "workspaces").symlink_to(ROOT / "workspaces")
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs/scripting.md").read_text(encoding="utf-8")
    names: dict = {}
    for script in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(compile(re.sub(r"size=\(\d+, \d+\)", "size=(16, 16)", script), "scripting.md", "exec"), names)
    assert names["net"]["second"].step == 0.5
    assert np.array_equal(names["again"].depth, names["image"].depth)
    assert names["image"].color[..., 3].any()
    assert names["smooth"].shape == names["data"].shape
    assert names["measures"]["maximum"][0] > 0
    again = nodegraph.load("head.json")
    assert np.array_equal(again.run("view", size=(16, 16)).color, names["image"].color)


def test_every_link_leads_somewhere():
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]:
        for target in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), f"{page.relative_to(ROOT)}: {target}"
