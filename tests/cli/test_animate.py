"""`nodegraph animate`: pictures and films of what moves."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np

from nodegraph import formats, workspace
from nodegraph.data import Camera


def animated(file: Path, keys: list[object], **more: object) -> Path:
    document = json.loads(file.read_text())
    document["ui"] = {"nodes": {"picture": {"animation": {"level": keys}}}, **more}
    file.write_text(json.dumps(document))
    return file


def levels(folder: Path) -> list[float]:
    return [float(formats.read(folder / name).color[0, 0, 0]) for name in sorted(os.listdir(folder))]


def test_each_frame_becomes_a_picture_that_carries_its_workspace(cli, workspace, tmp_path) -> None:
    file = animated(workspace(), [[0, 0.0, "linear"], [4, 1.0, "smooth"]], animation={"frames": [0, 4], "rate": 10})
    ran = cli("animate", file, "--out", tmp_path / "out")
    assert ran.code == 0
    assert ran.out.splitlines() == [str(tmp_path / "out" / f"view_{i:04d}.png") for i in range(5)]
    np.testing.assert_allclose(levels(tmp_path / "out"), [0.0, 0.25, 0.5, 0.75, 1.0], atol=0.01)
    from nodegraph import workspace as workspaces

    assert workspaces.load(tmp_path / "out" / "view_0002.png").get("picture.level") == 0.5


def test_the_variable_frame_counts(cli, workspace, tmp_path) -> None:
    variables = {
        "frame": {"kind": "Int", "value": 7},
        "grey": {"kind": "Float", "expression": "frame / 10"},
    }
    picture = {"type": "trial.picture", "version": 1, "links": {"level": "grey"}}
    file = workspace(variables=variables, picture=picture)
    assert cli("animate", file, "--frames", "2..4", "--out", tmp_path / "out").code == 0
    assert sorted(os.listdir(tmp_path / "out"))[0] == "view_0002.png"
    np.testing.assert_allclose(levels(tmp_path / "out"), [0.2, 0.3, 0.4], atol=0.01)


def test_a_film_has_every_frame(cli, workspace, tmp_path) -> None:
    import av

    file = animated(workspace(), [[0, 0.0, "linear"], [4, 1.0, "smooth"]])
    ran = cli("animate", file, "--frames", "0..4", "--size", "33x16", "--rate", "5", "--out", tmp_path / "a.mp4")
    assert (ran.code, ran.out.split()) == (0, [str(tmp_path / "a.mp4")])
    with av.open(str(tmp_path / "a.mp4")) as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
        assert film.streams.video[0].average_rate == 5
    assert [frame.shape for frame in frames] == [(16, 32, 3)] * 5
    assert [int(frame[8, 8, 0]) for frame in frames] == sorted(int(frame[8, 8, 0]) for frame in frames)
    assert frames[0][8, 8, 0] < 8
    assert frames[-1][8, 8, 0] > 247


def test_a_film_without_the_extra_says_what_to_install(cli, workspace, tmp_path, monkeypatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    ran = cli("animate", workspace(), "--frames", "0..1", "--out", tmp_path / "a.mp4")
    assert ran.code == 2
    assert "nodegraph[animation]" in ran.err
    assert not os.path.exists(tmp_path / "a.mp4")


def test_a_turntable_turns_the_camera_of_the_view(cli, tmp_path) -> None:
    from nodegraph.network import Network

    net = Network()
    net.add("source.synthetic", "made", voxels=(8, 8, 8))
    net.add("render.raycast", "raycast")
    net.add("output.view", "view")
    net.connect("made.volume", "raycast.volume")
    net.connect("raycast.image", "view.image")
    net.set("raycast.camera", Camera((0, -60, 10), (0, 0, 0)))
    net.save(tmp_path / "scene.json")
    out = tmp_path / "out"
    ran = cli(
        "animate", tmp_path / "scene.json", "--frames", "0..3", "--turntable", "360", "--size", "8x8", "--out", out
    )
    assert ran.code == 0
    eyes = [workspace.load(out / f"view_{i:04d}.png").get("raycast.camera").eye for i in range(4)]
    np.testing.assert_allclose(eyes, [(0, -60, 10), (60, 0, 10), (0, 60, 10), (-60, 0, 10)], atol=1e-9)


def test_what_cannot_be_filmed_is_one_sentence(cli, workspace, tmp_path) -> None:
    other = {"type": "output.view", "version": 1, "inputs": {"image": "picture.image"}}
    cases = [
        (["--frames", "5..2"], "not a range of frames"),
        (["--frames", "0..1", "--out", "a.gif"], "ends in .mp4"),
        (["--frames", "0..1", "--turntable", "90"], "has a camera"),
        (["--frames", "0..1", "--view", "nobody"], "nobody"),
    ]
    for options, word in cases:
        ran = cli("animate", workspace(), *options)
        assert ran.code == 2, options
        assert word in ran.err
        assert len(ran.err.strip().splitlines()) == 1
    ran = cli("animate", workspace(other=other), "--frames", "0..1", "--out", tmp_path)
    assert ran.code == 2
    assert "2 (view, other)" in ran.err


def test_a_node_that_fails_ends_the_animation(cli, workspace, tmp_path) -> None:
    faulty = {"type": "trial.faulty", "version": 1, "inputs": {"image": "picture.image"}}
    view = {"type": "output.view", "version": 1, "inputs": {"image": "faulty.same"}}
    ran = cli("animate", workspace(faulty=faulty, view=view), "--frames", "0..2", "--out", tmp_path / "out")
    assert ran.code == 1
    assert "faulty" in ran.err


def test_nothing_that_moves_is_told(cli, workspace, tmp_path) -> None:
    ran = cli("animate", workspace(), "--frames", "0..1", "--out", tmp_path / "out")
    assert ran.code == 0
    assert "nothing in it moves" in ran.err
