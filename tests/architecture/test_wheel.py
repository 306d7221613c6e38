"""The wheel holds everything: installed into an empty environment, away from the repository, it runs a workspace."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

WORKSPACE = {
    "nodegraph": 1,
    "nodes": {
        "field": {"type": "source.synthetic", "version": 1},
        "raycast": {"type": "render.raycast", "version": 1, "inputs": {"volume": "field.volume"}},
        "view": {"type": "output.view", "version": 1, "inputs": {"image": "raycast.image"}},
    },
}


def command(*arguments: object, **options: object) -> str:
    """Run a program and return what it prints; what it says on the way shows when it fails."""
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True, **options)  # type: ignore[call-overload]
    assert done.returncode == 0, f"{arguments}:\n{done.stdout}\n{done.stderr}"
    return str(done.stdout)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    options = ("--no-deps", "--no-build-isolation", "--quiet", "--wheel-dir")
    command(sys.executable, "-m", "pip", "wheel", *options, folder, ROOT)
    (built,) = folder.glob("nodegraph-*.whl")
    return built


def test_the_wheel_holds_processors_shaders_workspaces_and_nothing_of_the_repository(wheel: Path) -> None:
    names = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    share = "nodegraph/share/"
    for folder, home in (("nodegraph", ""), ("processors", share), ("shaders", share), ("workspaces", share)):
        tracked = command("git", "-c", "safe.directory=*", "ls-files", folder, cwd=ROOT).split("\n")
        missing = {f"{home}{name}" for name in tracked if name} - names
        assert missing == set()
    assert {name.partition("/")[0] for name in names} == {"nodegraph"}
    assert "nodegraph/py.typed" in names
    assert not [name for name in names if "__pycache__" in name or "/tests/" in name]


def test_the_wheel_runs_a_workspace_in_an_empty_environment(wheel: Path, tmp_path: Path) -> None:
    # Neither a pip of its own nor compiled modules: both take longer than all that follows, which needs neither.
    command(sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv")
    python = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin") / "python"
    pip = (sys.executable, "-m", "pip", "--python", python)
    command(*pip, "install", "--quiet", "--disable-pip-version-check", "--no-compile", wheel)
    environment = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "NODEGRAPH_PATH")}
    code = "import nodegraph; print(nodegraph.__file__, nodegraph.processors.filter.GaussianBlur.id, sep='\\n')"
    where, id = command(python, "-c", code, cwd=tmp_path, env=environment).splitlines()
    assert Path(where).is_relative_to(tmp_path)
    assert id == "filter.gaussian_blur"
    (tmp_path / "mine.json").write_text(json.dumps(WORKSPACE))
    run = (python.with_name("nodegraph"), "run", "mine.json", "--size", "32x32", "--json")
    told = json.loads(command(*run, cwd=tmp_path, env=environment))
    assert told["ok"] is True
    assert (tmp_path / "view.png").stat().st_size > 100
    listed = json.loads(command(python.with_name("nodegraph"), "list", "--json", cwd=tmp_path, env=environment))
    assert [entry["id"] for entry in listed if "unavailable" in entry] == []
    shipped = command(python, "-c", "from nodegraph import locations; print(locations.workspaces())", env=environment)
    names = sorted(path.name for path in Path(shipped.strip()).glob("*.json"))
    assert names == sorted(path.name for path in (ROOT / "workspaces").glob("*.json"))
