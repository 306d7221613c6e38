"""Workspaces: what is read is kept, what is written is stable, and a file is never lost."""

from __future__ import annotations

import errno
import json
import math
import os
from pathlib import Path

import pytest

from nodegraph.data import Camera
from nodegraph.errors import GraphError, WorkspaceError
from nodegraph.network import Network
from nodegraph.workspace import dumps, load, loads, save
from tests.support.document import Blur, chain, find

FULL = """{
  "nodegraph": 1,
  "comment": "unknown at the top",
  "variables": {
    "coarse": {"kind": "Float", "note": [1, {"a": null}], "value": 2.0},
    "fine": {"kind": "Float", "expression": "coarse / 2"},
    "odd": {"kind": "Spline", "value": {"keys": [[0, 1], [1, 0.25]]}}
  },
  "nodes": {
    "ct": {
      "type": "source",
      "version": 1,
      "params": {"path": "data/ct.nii"}
    },
    "gone": {
      "first": true,
      "type": "filter.gone",
      "version": 12,
      "colour": "red",
      "params": {"b": 1e-07, "a": [1, 2.5, "inf"], "nested": {"z": false, "y": null}},
      "links": {"b": "odd"},
      "inputs": {"volume": ["ct.volume"], "mask": "nobody.out", "many": ["ct.volume", "ct.volume"]},
      "muted": true,
      "last": {"deep": [[]]}
    },
    "blur": {
      "type": "blur",
      "version": 2,
      "params": {"sigma": 2.0, "sgima": 3, "iterations": 4, "mode": "sideways"},
      "links": {"unknown": "coarse"},
      "inputs": {"volume": "ct.volume", "mask": ["gone.out"]}
    },
    "finish": {
      "type": "group",
      "kept": 1,
      "inputs": {"volume": "blur.smoothed"},
      "nodes": {
        "raycast": {
          "type": "raycast",
          "version": 1,
          "params": {"step": 0.1, "quality_limit": "nan"},
          "inputs": {"volume": "more.smoothed"}
        },
        "more": {"type": "blur", "version": 2}
      },
      "variables": {
        "inner": {"kind": "Int", "value": 3}
      },
      "expose": {
        "inputs": {"volume": ["more.volume"]},
        "params": {"step": ["raycast.step"]},
        "outputs": {"image": "raycast.image"},
        "icon": "x.png"
      }
    }
  },
  "after": [],
  "ui": {
    "nodes": {
      "ct": {"position": [0, 1.5]},
      "nobody": {"position": [3, 4]}
    },
    "zoom": 0.5
  }
}
"""


def test_a_file_survives_load_and_save_byte_for_byte(tmp_path: Path) -> None:
    path = tmp_path / "full.json"
    path.write_text(FULL)
    net = load(path, find=find)
    save(net)
    assert path.read_text() == FULL


def test_unknown_things_stay_in_place_through_edits(tmp_path: Path) -> None:
    net = loads(FULL, find=find)
    net["finish/more"].sigma = 3.0
    net.mute("gone", False)
    net.rename("blur", "smooth")
    text = dumps(net)
    keys = json.loads(text)
    assert list(keys) == ["nodegraph", "comment", "variables", "nodes", "after", "ui"]
    assert list(keys["nodes"]["gone"]) == ["first", "type", "version", "colour", "params", "links", "inputs", "last"]
    assert list(keys["nodes"]["smooth"]["params"]) == ["sigma", "sgima", "iterations", "mode"]
    assert keys["nodes"]["smooth"]["inputs"]["mask"] == ["gone.out"]
    assert keys["nodes"]["finish"]["inputs"] == {"volume": "smooth.smoothed"}
    assert dumps(loads(text, find=find)) == text


def test_only_what_differs_is_written_in_the_order_of_declarations() -> None:
    net = chain()
    net["raycast"].title = "x"
    net["raycast"].step = 0.5
    net["blur"].sigma = 1.0
    keys = json.loads(dumps(net))
    assert list(keys["nodes"]["raycast"]["params"]) == ["step", "title"]
    assert "params" not in keys["nodes"]["blur"]
    assert "variables" not in keys
    assert "ui" not in keys


def test_floats_are_written_by_repr_and_infinities_as_strings() -> None:
    net = chain()
    for value in (0.1, 1 / 3, 5e-324, 1.7976931348623157e308, math.inf, -math.inf, -0.0):
        net["raycast"].quality_limit = value
        back = loads(dumps(net), find=find)["raycast"].quality_limit
        assert repr(back) == repr(value)
    net["raycast"].quality_limit = math.nan
    assert '"quality_limit": "nan"' in dumps(net)
    assert math.isnan(loads(dumps(net), find=find)["raycast"].quality_limit)


def test_values_of_every_kind_survive() -> None:
    net = chain()
    net["raycast"].camera = Camera(eye=(1.0, -2.0, 0.1))
    net["raycast"].title = 'ö "quoted" \\ \ud800 \u2028'
    net["raycast"].up = (0.0, 1.0, 0.0)
    net.link("raycast.camera", "camera")
    again = loads(dumps(net), find=find)
    assert again["raycast"].title == net["raycast"].title
    assert again["raycast"].camera.eye == (1.0, -2.0, 0.1)
    assert again["raycast"].up == (0.0, 1.0, 0.0)
    assert dumps(again) == dumps(net)
    dumps(net).encode()


@pytest.mark.parametrize(
    ("text", "pointer", "says"),
    [
        ("{", "", "line 1, column 2: this is not JSON"),
        ('{"nodegraph": 1,\n "nodes": {"a": 1;}}', "", "line 2, column 18: this is not JSON"),
        ("[]", "", "expected an object, found an array"),
        ("{}", "", "the key 'nodegraph' with the version of the format is missing"),
        ('{"nodegraph": 2}', "/nodegraph", "format 2 is newer than 1, the newest known; update nodegraph"),
        ('{"nodegraph": "1"}', "/nodegraph", "a version is a whole number from 1, found a string"),
        ('{"nodegraph": true}', "/nodegraph", "a version is a whole number from 1"),
        ('{"nodegraph": 1, "nodegraph": 1}', "/", "the key 'nodegraph' comes twice"),
        ('{"nodegraph": 1, "ui": {"a/b": {"x": 1, "x": 2}}}', "/ui/a~1b", "the key 'x' comes twice"),
        ('{"nodegraph": 1, "nodes": []}', "/nodes", "expected an object, found an array"),
        ('{"nodegraph": 1, "nodes": {"a b": {"type": "blur"}}}', "/nodes/a b", "an id has letters, digits and _"),
        ('{"nodegraph": 1, "nodes": {"a": {}}}', "/nodes/a", "the node has no 'type'"),
        ('{"nodegraph": 1, "nodes": {"a": {"type": 3}}}', "/nodes/a/type", "expected a string, found the number 3"),
        (
            '{"nodegraph": 1, "nodes": {"a": {"type": "blur", "version": 3}}}',
            "/nodes/a/version",
            "a is version 3 of blur",
        ),
        ('{"nodegraph": 1, "nodes": {"a": {"type": "blur", "version": 0}}}', "/nodes/a/version", "whole number from 1"),
        ('{"nodegraph": 1, "nodes": {"a": {"type": "blur", "muted": 1}}}', "/nodes/a/muted", "expected true or false"),
        (
            '{"nodegraph": 1, "nodes": {"a": {"type": "blur", "inputs": {"volume": 1}}}}',
            "/nodes/a/inputs/volume",
            "a string",
        ),
        ('{"nodegraph": 1, "nodes": {"a": {"type": "blur", "links": {"x": null}}}}', "/nodes/a/links/x", "found null"),
        ('{"nodegraph": 1, "variables": {"v": {"value": 1}}}', "/variables/v", "the variable has no 'kind'"),
        ('{"nodegraph": 1, "ui": {"x": 1e999}}', "/ui/x", "write infinity as the string 'inf'"),
        ('{"nodegraph": 1, "ui": {"x": NaN}}', "", "NaN is no JSON number; write it as the string 'nan'"),
        ('{"nodegraph": 1, "ui": ' + "[" * 300 + "]" * 300 + "}", None, "nested more than 200 levels deep"),
        ("[" * 100000 + "]" * 100000, None, "nested more than 200 levels deep"),
        ('{"nodegraph": 1, "ui": ' + "9" * 5000 + "}", "", "a number cannot be read"),
        (
            '{"nodegraph": 1, "nodes": {"g": {"type": "group", "params": {"step": 1}}}}',
            "/nodes/g/params",
            "a group has no values of its own",
        ),
        (
            '{"nodegraph": 1, "nodes": {"g": {"type": "group", "expose": {"outputs": {"o": "a.b"}}}}}',
            "/nodes/g/expose/outputs/o",
            "'a.b' is no port inside the group",
        ),
    ],
)
def test_what_is_no_workspace_is_refused_in_one_sentence(text: str, pointer: str | None, says: str) -> None:
    with pytest.raises(WorkspaceError) as caught:
        loads(text, file="x.json", find=find)
    assert says in str(caught.value)
    assert str(caught.value).startswith("x.json: ")
    assert "\n" not in str(caught.value)
    assert pointer is None or caught.value.pointer == pointer
    assert caught.value.exit_code == 2


def test_deeply_nested_groups_are_refused() -> None:
    text = '{"type": "group", "nodes": {}}'
    for _ in range(40):
        text = f'{{"type": "group", "nodes": {{"g": {text}}}}}'
    with pytest.raises(WorkspaceError, match="groups are nested more than 32 deep"):
        loads(f'{{"nodegraph": 1, "nodes": {{"g": {text}}}}}', find=find)


def test_an_older_node_is_migrated_and_an_old_name_is_found() -> None:
    net = loads(
        '{"nodegraph": 1, "nodes": {"a": {"type": "smooth", "version": 1, "params": {"variance": 4}}}}', find=find
    )
    assert net["a"].sigma == 4.0
    assert json.loads(dumps(net))["nodes"]["a"] == {"type": "blur", "version": 2, "params": {"sigma": 4.0}}


def test_a_migration_that_fails_keeps_the_node_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    def migrate(params: dict[str, object], version: int) -> dict[str, object]:
        params.clear()
        raise KeyError("variance")

    monkeypatch.setattr(Blur, "migrate", staticmethod(migrate))
    text = """{
  "nodegraph": 1,
  "nodes": {
    "a": {
      "type": "blur",
      "version": 1,
      "params": {"other": 4}
    }
  }
}
"""
    net = loads(text, find=find)
    assert net.flatten().nodes["a"].blocked.startswith("a: blur: cannot bring parameters of version 1 up to 2")
    assert dumps(net) == text


def test_paths_below_the_folder_are_relative_and_others_absolute(tmp_path: Path) -> None:
    folder = tmp_path / "project"
    (folder / "data").mkdir(parents=True)
    net = chain()
    net["ct"].path = str(folder / "data" / "ct.nii")
    save(net, folder / "x.json")
    assert json.loads((folder / "x.json").read_text())["nodes"]["ct"]["params"] == {"path": "data/ct.nii"}
    assert load(folder / "x.json", find=find)["ct"].path == str(folder / "data" / "ct.nii")
    net["ct"].path = str(tmp_path / "projects" / "ct.nii")
    save(net)
    assert json.loads((folder / "x.json").read_text())["nodes"]["ct"]["params"] == {
        "path": str(tmp_path / "projects" / "ct.nii")
    }
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    net["ct"].path = str(folder / "data" / "ct.nii")
    save(net)
    os.rename(folder / "x.json", moved / "x.json")
    assert load(moved / "x.json", find=find)["ct"].path == str(moved / "data" / "ct.nii")
    net["ct"].path = "https://example.org/ct.nii"
    assert load_text(net, folder) == "https://example.org/ct.nii"


def load_text(net: Network, folder: Path) -> str:
    return str(loads(dumps(net, folder=folder), folder=folder, find=find)["ct"].path)


def test_a_linked_path_is_relative_too(tmp_path: Path) -> None:
    net = chain()
    net["ct"].path = str(tmp_path / "a.nii")
    net.link("ct.path", "file")
    save(net, tmp_path / "x.json")
    assert '"value": "a.nii"' in (tmp_path / "x.json").read_text()
    assert load(tmp_path / "x.json", find=find)["ct"].path == str(tmp_path / "a.nii")


def test_saving_is_atomic(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    net = chain()
    path = tmp_path / "x.json"
    save(net, path)
    os.chmod(path, 0o640)
    before = path.read_bytes()
    net["raycast"].step = 0.5

    def full(fd: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(WorkspaceError, match="No space left on device; the old file is untouched"):
        save(net)
    assert path.read_bytes() == before
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.json"]
    assert net.history.modified
    monkeypatch.undo()
    save(net)
    assert b'"step": 0.5' in path.read_bytes()
    assert path.stat().st_mode & 0o777 == 0o640
    assert not net.history.modified


def test_missing_folders_and_files_are_named(tmp_path: Path) -> None:
    with pytest.raises(WorkspaceError, match=r"nowhere/x.json: cannot be written"):
        save(chain(), tmp_path / "nowhere" / "x.json")
    with pytest.raises(WorkspaceError, match=r"y.json: there is no such file"):
        load(tmp_path / "y.json")
    with pytest.raises(WorkspaceError, match="no file yet"):
        save(chain())
    (tmp_path / "z.json").write_bytes(b'{"nodegraph": "\xff"}')
    with pytest.raises(WorkspaceError, match="not UTF-8"):
        load(tmp_path / "z.json")
    with pytest.raises(WorkspaceError, match="cannot be read"):
        load(tmp_path)


def test_a_picture_carries_its_workspace(tmp_path: Path) -> None:
    import numpy as np

    from nodegraph.data import Image
    from nodegraph.formats import png

    net = chain()
    path = tmp_path / "view.png"
    png.write(Image(np.zeros((2, 2, 4), "f4")), path, workspace=dumps(net, folder=tmp_path))
    again = load(path, find=find)
    assert dumps(again) == dumps(net)
    assert again.file is None
    png.write(Image(np.zeros((2, 2, 4), "f4")), path)
    with pytest.raises(WorkspaceError, match="carries no workspace"):
        load(path, find=find)


def test_loading_writes_nothing_and_resets_history(tmp_path: Path) -> None:
    (tmp_path / "x.json").write_text(FULL)
    net = load(tmp_path / "x.json", find=find)
    assert [entry.name for entry in tmp_path.iterdir()] == ["x.json"]
    assert net.history.undo_name == ""
    assert not net.history.modified


def test_a_byte_order_mark_is_no_obstacle(tmp_path: Path) -> None:
    (tmp_path / "x.json").write_bytes(b"\xef\xbb\xbf" + dumps(chain()).encode())
    assert len(load(tmp_path / "x.json", find=find)) == 3


def test_broken_text_never_gives_more_than_a_graph_error() -> None:
    import random

    draw = random.Random(7)
    marks = '{}[]",:1e9 nodes"type".\\u0000\n-'
    for _ in range(400):
        text = list(FULL)
        for _ in range(draw.randint(1, 4)):
            at = draw.randrange(len(text))
            text[at : at + draw.randint(0, 3)] = draw.choice(marks)
        try:
            net = loads("".join(text), find=find)
        except GraphError:
            continue
        net.flatten()
        assert dumps(loads(dumps(net), find=find)) == dumps(net)


ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("path", sorted((ROOT / "workspaces").glob("*.json")), ids=lambda path: path.stem)
def test_shipped_workspaces_are_read_whole(path: Path) -> None:
    net = load(path)
    assert {node.path: node.blocked for node in net.flatten().nodes.values() if node.problem is not None} == {}
    again = loads(dumps(net, folder=path.parent), folder=path.parent)
    assert dumps(again) == dumps(net)


def test_the_example_of_the_docs_is_a_workspace() -> None:
    page = (ROOT / "docs" / "workspace-format.md").read_text("utf-8")
    net = loads(page.partition("```json\n")[2].partition("```")[0])
    flat = net.flatten()
    assert flat.nodes["view"].sources["image"] == (("finish/raycast", "image"),)
    assert flat.nodes["finish/raycast"].values["step"] == 0.5
    assert net["finish"].sigma == 0.8
