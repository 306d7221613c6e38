"""output.view: the picture as it came, at the size that the view asks for."""

from __future__ import annotations

import numpy as np

import nodegraph
from nodegraph import registry
from nodegraph.data import Image


def test_it_shows_the_very_picture_that_it_got(rng: np.random.Generator) -> None:
    image = Image(rng.random((3, 5, 4), np.float32), depth=np.full((3, 5), 7.0, np.float32))
    assert nodegraph.run(registry.find("output.view"), image=image) is image


def test_its_size_is_asked_of_what_feeds_it_and_its_camera_changes_nothing() -> None:
    network = nodegraph.Network()
    network.add("source.synthetic", "field")
    network.add("render.raycast", "raycast")
    network.connect("field.volume", "raycast.volume")
    network.add("output.view", "view", width=40, height=20)
    network.connect("raycast.image", "view.image")
    (task,) = [task for task in nodegraph.engine().plan(network).tasks if task.path == "raycast"]
    assert task.size == (40, 20)
    before = nodegraph.engine().plan(network).tasks[-1].fingerprint
    network["view"].camera = network["view"].camera.with_(field_of_view=11.0)
    after = nodegraph.engine().plan(network).tasks
    assert [task.fingerprint for task in after if task.path == "raycast"] == [task.fingerprint]
    assert after[-1].fingerprint != before
