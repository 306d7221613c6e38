"""What has no picture is refused in one sentence, never with a traceback."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from nodegraph.cli import main
from nodegraph.errors import GraphError
from tests.extremes.refusals import COMMANDS, REFUSALS, Command, Refusal


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_what_has_no_picture_is_refused(refusal: Refusal) -> None:
    with pytest.raises(GraphError) as caught:
        refusal.make()
    text = str(caught.value)
    assert refusal.said in text
    assert "\n" not in text


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A tiny volume, a ray-caster and a view."""
    nodes = {
        "source": {"type": "source.synthetic", "version": 1, "params": {"voxels": [4, 4, 4], "extent": [4, 4, 4]}},
        "raycast": {"type": "render.raycast", "version": 1, "inputs": {"volume": "source.volume"}},
        "view": {"type": "output.view", "version": 1, "inputs": {"image": "raycast.image"}},
    }
    path = tmp_path / "tiny.json"
    path.write_text(json.dumps({"nodegraph": 1, "variables": {}, "nodes": nodes, "ui": {}}))
    return path


@pytest.mark.parametrize("command", COMMANDS, ids=str)
def test_the_command_line_says_it_in_one_sentence(
    command: Command, workspace: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    try:
        code = main(["run", str(workspace), "--out", str(tmp_path / "out"), *command.arguments])
    except SystemExit as left:
        code = int(left.code or 0)
    told = capsys.readouterr()
    assert code == command.code, told.err
    assert command.said in told.err
    assert "Traceback" not in told.err
    assert told.out == ""
    assert not list(tmp_path.glob("out/*"))
