"""Random actions all over the window: nothing raises, Qt warns of nothing, and the document is its history."""

from __future__ import annotations

import os
import random
from collections.abc import Iterator
from pathlib import Path

import pytest

from nodegraph import Network, locations, registry, workspace
from nodegraph.editor.app import application
from nodegraph.editor.shader_editor import ShaderPanel
from nodegraph.editor.window import Window
from tests.editor.conftest import MakeWindow
from tests.editor.proof.mistakes import Mistakes
from tests.editor.proof.monkey import Monkey
from tests.editor.test_session import small

SEEDS = [int(seed) for seed in os.environ.get("NODEGRAPH_MONKEY_SEEDS", "1").split(",")]
STEPS = int(os.environ.get("NODEGRAPH_MONKEY_STEPS", "2000"))


def cast() -> Network:
    """volume -> raycast -> view, with a box around it; 12 voxels a side."""
    network = Network()
    network.add("source.synthetic", "volume", voxels=(12, 12, 12))
    network.add("geometry.proxy_box", "box")
    network.add("render.entry_exit_points", "rays")
    network.add("render.raycast", "raycast")
    network.add("output.view", "view")
    for source, target in (
        ("volume.volume", "box.volume"),
        ("box.geometry", "rays.geometry"),
        ("volume.volume", "raycast.volume"),
        ("rays.interval", "raycast.interval"),
        ("raycast.image", "view.image"),
    ):
        network.connect(source, target)
    network.link("rays.camera", "camera")
    network.link("raycast.camera", "camera")
    network.history.clear()
    return network


def _is_ours(panel: ShaderPanel) -> bool:
    return panel.path is None or panel.path.is_relative_to(locations.home())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Home, working place, examples, plug-ins and cache of the monkey, who may not write into our own shaders."""
    made = tmp_path / "home"
    (made / "workspaces").mkdir(parents=True)
    for name, network in (("slice", small()), ("cast", cast())):
        workspace.save(network, made / f"{name}.json")
        workspace.save(network, made / "workspaces" / f"{name}.json")
    monkeypatch.setenv("HOME", str(made))
    monkeypatch.setenv("NODEGRAPH_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(made)
    monkeypatch.setattr(locations, "workspaces", lambda: made / "workspaces")
    (made / "plugins").mkdir()
    monkeypatch.setenv("NODEGRAPH_PATH", str(made / "plugins"))
    monkeypatch.setattr(ShaderPanel, "read_only", property(_is_ours))
    yield made
    registry.default.cache_clear()


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
def test_random_actions_anywhere(make_window: MakeWindow, folder: Path, seed: int) -> None:
    random.seed(seed)
    window: Window = make_window()
    window.resize(1000, 700)
    window.open_file(folder / "cast.json")
    window.docks["shader"].setEnabled(False)  # what is typed there is written into the program's own files
    monkey = Monkey(window, folder, seed)
    with Mistakes() as mistakes:
        try:
            for _ in range(STEPS):
                monkey.step()
                if mistakes.heard:
                    break
        finally:
            monkey.end()
        monkey.check_history()
    told = "\n".join(monkey.log[-25:])
    assert not mistakes.heard, f"step {len(monkey.log)}, after\n{told}\n" + "\n".join(mistakes.heard)
    assert monkey.documents > 2
    application().setStyleSheet("")
