"""A driver may give up a context at any time; the next picture comes all the same."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from nodegraph import Network
from nodegraph.engine import Engine

CONTEXT_LOST = 0x0507


def scene() -> Network:
    network = Network()
    for type, path in (
        ("source.synthetic", "source"),
        ("geometry.proxy_box", "box"),
        ("render.entry_exit_points", "points"),
        ("render.raycast", "raycast"),
        ("output.view", "view"),
    ):
        network.add(type, path)
    network["source"].voxels = (8, 8, 8)
    for start, end in (
        ("source.volume", "box.volume"),
        ("box.geometry", "points.geometry"),
        ("points.interval", "raycast.interval"),
        ("source.volume", "raycast.volume"),
        ("raycast.image", "view.image"),
    ):
        network.connect(start, end)
    return network


def picture(report: Any) -> np.ndarray:
    assert not report.errors
    (image,) = report.shown["view"].values()
    color: np.ndarray = image.color
    return color


@pytest.mark.parametrize("name", ["auto", "gl"])
def test_a_lost_context_is_replaced_and_what_lay_there_is_made_anew(name: str) -> None:
    network = scene()
    with Engine(device=name, disk=False) as engine:
        whole = picture(engine.evaluate(network, size=(12, 10)))
        device = engine.devices.choose("gl").device if name == "gl" else engine.devices.opened[0]
        assert device.name == "gl"
        # The entry and exit points lie on this device alone when it is lost.
        engine.call(lambda: setattr(device.calls, "get_error", lambda: CONTEXT_LOST))
        network["raycast"].step = 0.25
        report = engine.evaluate(network, size=(12, 10))
        assert picture(report).shape == whole.shape
        assert any("gl was lost" in note for note in report.notes)
        assert device not in engine.devices.opened
        network["raycast"].step = 0.5
        again = engine.evaluate(network, size=(12, 10))
        assert np.array_equal(picture(again), whole)
        assert not any("instead" in note for note in again.notes)


def test_a_texture_limit_moves_the_node_to_the_next_device_with_a_note() -> None:
    network = Network()
    network.add("source.synthetic", "source")
    network.add("render.slice", "slice")
    network.add("output.view", "view")
    network.connect("source.volume", "slice.volume")
    network.connect("slice.image", "view.image")
    with Engine(device="gl", disk=False) as engine:
        network["source"].voxels = (texture_limit(engine) + 1, 2, 2)
        report = engine.evaluate(network, size=(12, 10))
        assert np.isfinite(picture(report)).all()
        (note,) = [note for note in report.notes if note.startswith("slice: ")]
        assert "texture limit" in note
        assert note.endswith("running on cl instead")
        network["slice"].height = 1.0
        picture(engine.evaluate(network, size=(12, 10)))


def test_the_ray_caster_goes_block_by_block_beyond_a_texture_limit() -> None:
    network = scene()
    with Engine(device="gl", disk=False) as engine:
        network["source"].voxels = (texture_limit(engine) + 1, 2, 2)
        report = engine.evaluate(network, size=(12, 10))
        blocks = picture(report)
        assert not any("instead" in note for note in report.notes)
    with Engine(device="cl64", disk=False) as engine:
        whole = picture(engine.evaluate(network, size=(12, 10)))
    assert whole[..., 3].max() > 0.5
    np.testing.assert_allclose(blocks, whole, atol=1e-5)


def texture_limit(engine: Engine) -> int:
    device = engine.devices.choose("gl").device if engine.device_in_use else engine.call(engine._main_device)
    limit: int = device.limits["texture_3d"]
    return limit
