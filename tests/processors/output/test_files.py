"""The processors that write."""

import json

import numpy as np
import pytest

from nodegraph import formats, registry, workspace
from nodegraph.data import Image, Mapping, Volume
from nodegraph.engine import Engine
from nodegraph.errors import FormatError, ParameterError
from nodegraph.formats import exr, png
from tests.support.calls import call

VOLUME = Volume(np.arange(24, dtype=np.int16).reshape(2, 3, 4), np.diag([1.0, 2.0, 3.0, 1.0]), Mapping(2.0, 1.0))


@pytest.fixture
def image(rng):
    alpha = rng.random((5, 6, 1)).astype(np.float32)
    return Image(
        np.concatenate([rng.random((5, 6, 3)).astype(np.float32) * alpha, alpha], 2), np.ones((5, 6), np.float32)
    )


def test_both_change_the_world_and_give_nothing():
    for id in ("output.image_file", "output.volume_file"):
        processor = registry.find(id)
        assert processor.effect
        assert not processor.outputs
        assert processor.params["path"].write


def test_png_and_exr(tmp_path, image):
    assert call("output.image_file", image=image, path=str(tmp_path / "a.png"), bits="16") is None
    assert np.abs(formats.read(tmp_path / "a.png").color - image.color).max() < 1e-4
    call("output.image_file", image=image, path=str(tmp_path / "a.exr"))
    again = formats.read(tmp_path / "a.exr")
    assert np.array_equal(again.color, image.color)
    assert np.array_equal(again.depth, image.depth)
    call("output.image_file", image=image, path=str(tmp_path / "h.exr"), half=True)
    assert formats.info(tmp_path / "h.exr")["type"] == "half"


def test_over_a_colour(tmp_path, image):
    call("output.image_file", image=image, path=str(tmp_path / "a.PNG"), background="color", color=(0.0, 0.0, 1.0))
    again = formats.read(tmp_path / "a.PNG").color
    assert (again[..., 3] == 1.0).all()
    assert np.abs(again[..., :3] - image.over((0.0, 0.0, 1.0))).max() < 0.01


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd", ".npy", ".npz"])
def test_volumes(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    call("output.volume_file", volume=VOLUME, path=str(path))
    again = formats.read(path)
    assert np.array_equal(again.real(), VOLUME.real())
    if suffix != ".npy":
        assert np.allclose(again.index_to_world, VOLUME.index_to_world)


def test_compression_is_a_choice(tmp_path):
    volume = Volume(np.zeros((32, 32, 32), np.float32))
    for suffix in (".nrrd", ".npz"):
        for compress in (True, False):
            path = tmp_path / f"{compress}{suffix}"
            call("output.volume_file", volume=volume, path=str(path), compress=compress)
            assert (path.stat().st_size < 10_000) is compress


def test_refusals(tmp_path, image):
    with pytest.raises(ParameterError, match="path: no file is named"):
        call("output.image_file", image=image)
    with pytest.raises(ParameterError, match="path: no file is named"):
        call("output.volume_file", volume=VOLUME)
    with pytest.raises(FormatError, match="holds volumes"):
        call("output.image_file", image=image, path=str(tmp_path / "a.nii"))
    with pytest.raises(FormatError, match="holds pictures"):
        call("output.volume_file", volume=VOLUME, path=str(tmp_path / "a.png"))
    with pytest.raises(FormatError, match="does not exist"):
        call("output.image_file", image=image, path=str(tmp_path / "no" / "a.png"))
    assert not list(tmp_path.iterdir())


def test_in_a_network(tmp_path):
    """The whole way: a file in, a file out, through the engine."""
    import nodegraph

    formats.write(VOLUME, tmp_path / "in.nii.gz")
    net = nodegraph.Network()
    net.add("source.volume", "source", path=str(tmp_path / "in.nii.gz"))
    net.add("output.volume_file", "sink", path=str(tmp_path / "out.nrrd"))
    net.connect("source.volume", "sink.volume")
    net.run()
    assert np.array_equal(formats.read(tmp_path / "out.nrrd").data, VOLUME.real())


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_a_picture_carries_the_workspace_with_paths_relative_to_it(tmp_path, suffix):
    (tmp_path / "data").mkdir()
    formats.write(VOLUME, tmp_path / "data" / "volume.npz")
    nodes = {
        "ct": {"type": "source.volume", "params": {"path": str(tmp_path / "data" / "volume.npz")}},
        "slice": {"type": "render.slice", "inputs": {"volume": "ct.volume"}},
        "file": {
            "type": "output.image_file",
            "params": {"path": str(tmp_path / f"a{suffix}"), "width": 4, "height": 4, "bits": "16"},
            "inputs": {"image": "slice.image"},
        },
    }
    network = workspace.loads(json.dumps({"nodegraph": 1, "nodes": nodes}))
    with Engine(disk=False) as engine:
        evaluation = engine.submit(network, ["file"])
        network["file"].bits = "8"  # later edits are not part of what made the picture
        evaluation.result().raise_first()
    carried = {".png": png, ".exr": exr}[suffix].read_workspace(tmp_path / f"a{suffix}")
    assert "volume.npz" in carried
    assert str(tmp_path) not in carried
    again = workspace.load(tmp_path / f"a{suffix}")
    assert again["ct"].path == str(tmp_path / "data" / "volume.npz")
    assert again["file"].bits == "16"
