"""Only what the scene requires: what nobody sees is not computed, not compiled and not kept, on real networks.

Each test states the law on what ran, on the translated text of the kernels, or on the bytes that lie about.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from nodegraph import Input, Output, Processor, data
from nodegraph.compute import language
from nodegraph.data import Camera, Labels, Light, TransferFunction, Volume
from nodegraph.data.space import centred
from nodegraph.engine import Engine
from nodegraph.explain import Scene, scene
from nodegraph.network import Network

pytestmark = pytest.mark.slow

SIZE = (24, 20)
FRONT = Camera(eye=(0.0, -400.0, 0.0), target=(0.0, 0.0, 0.0), field_of_view=20.0)
SIDE = Camera(eye=(-400.0, 0.0, 0.0), target=(0.0, 0.0, 0.0), field_of_view=20.0)


@pytest.fixture
def own() -> Iterator[Engine]:
    """An engine of the test's own: nothing is cached, nothing lies on its device."""
    with Engine(device="gl", disk=False) as engine:
        yield engine


def scenery(**raycast: object) -> Network:
    """field -> smooth -> raycast -> background -> view, and slope, a gradient volume that raycast may read."""
    network = Network()
    network.add("source.synthetic", "field", kind="torus", voxels=(16, 16, 16))
    network.add("filter.gaussian_blur", "smooth", sigma=4.0)
    network.add("filter.gradient", "slope")
    network.add("render.raycast", "raycast", camera=FRONT, **raycast)
    network.add("image.background", "background")
    network.add("output.view", "view")
    network.connect("field.volume", "smooth.volume")
    network.connect("smooth.smoothed", "slope.volume")
    network.connect("smooth.smoothed", "raycast.volume")
    network.connect("raycast.image", "background.image")
    network.connect("background.composed", "view.image")
    return network


def lying_on(engine: Engine) -> tuple[int, int, int]:
    """Device objects, device bytes and host bytes of an engine, when what died is cleared away."""

    def look() -> tuple[int, int]:
        memories = [device.memory for device in engine.devices.opened]
        for memory in memories:
            memory.drain()
        return sum(memory.objects for memory in memories), sum(memory.bytes for memory in memories)

    return (*engine.call(look), engine.cache.host_bytes())


class Translated:
    """All kernels of a node as they were translated: their text, and the uniforms that they read."""

    def __init__(self, told: Scene, node: str) -> None:
        assert told.report.ok, told.report.errors
        runs = [kernel.run for kernel in told.nodes[node].kernels]
        self.text = "\n".join(run.text for run in runs)
        modules = [language.compile(run.source, run.defines) for run in runs]
        self.uniforms = {uniform.name for module in modules for uniform in module.uniforms if uniform.used}


def fields_of(told: Scene, node: str = "raycast") -> set[str]:
    """Names of the fields that the kernels of a node read."""
    return {field.name for kernel in told.nodes[node].kernels for field in kernel.run.fields}


@pytest.mark.parametrize("mode", ["composite", "first_hit", "iso"])
def test_an_unlit_scene_holds_no_gradient_code_and_no_light(engine_on_each, mode) -> None:
    told = scene(engine_on_each, scenery(mode=mode, lit=False), size=SIZE)
    unlit = Translated(told, "raycast")
    lit = Translated(scene(engine_on_each, scenery(mode=mode, lit=True, gradients="on_the_fly"), size=SIZE), "raycast")
    for name in ("gradient_central", "shade_phong"):
        assert name in lit.text, "what is looked for is there when it is needed"
        assert name not in unlit.text
    assert {"light", "material", "to_eye"} <= lit.uniforms
    assert not {"light", "material", "to_eye"} & unlit.uniforms
    switches = {switch.name: switch for kernel in told.nodes["raycast"].kernels for switch in kernel.switches}
    assert not switches["LIT"].held
    assert not switches["GRADIENT"].matters


@pytest.mark.parametrize("mode", ["composite", "iso"])
def test_a_matte_scene_computes_no_gloss(engine_on_each, mode) -> None:
    for specular in (0.0, 0.3):
        told = scene(engine_on_each, scenery(mode=mode, lit=True, specular=specular), size=SIZE)
        switches = {switch.name: switch for kernel in told.nodes["raycast"].kernels for switch in kernel.switches}
        assert switches["GLOSS"].matters
        assert switches["GLOSS"].held == (specular > 0.0)
        assert ("pow(" in Translated(told, "raycast").text) == (specular > 0.0)


def test_an_unlit_scene_makes_no_gradient_volume(own) -> None:
    told = scene(own, scenery(lit=False), size=SIZE)
    assert told.idle["slope"] == "nothing that is shown reads it"
    assert "slope" not in told.report.ran
    assert "gradient" not in fields_of(told)
    network = scenery(lit=True)
    network.connect("slope.gradient", "raycast.gradient")
    lit = scene(own, network, size=SIZE)
    assert "gradient" in fields_of(lit)
    assert lit.nodes["slope"].device["output"] == 16**3 * 16, "where light asks for it, it is there"


def test_an_opaque_wall_ends_the_rays(engine_on_each) -> None:
    """What lies behind is not looked at: however bright, it changes nothing. Without termination it would."""
    function = TransferFunction([(0.0, (1, 1, 1), 0.0), (1.0, (0.5, 0.4, 0.3), 0.43), (2.0, (1e5, 1e5, 1e5), 0.9)])
    camera = Camera(eye=(0.0, -200.0, 0.0), target=(0.0, 0.0, 0.0), projection="orthographic", height=20.0)

    def picture(behind: float, termination: float) -> np.ndarray:
        values = np.zeros((16, 16, 16), "f4")
        values[:, :5] = 1.0  # the wall: 20 mm that hide 0.99999
        values[:, 9:13] = behind
        network = Network()
        network.add("render.raycast", "raycast", camera=camera, lit=False, transfer_function=function)
        network["raycast"].termination = termination
        network.add(Given, "given")
        network.connect("given.value", "raycast.volume")
        wall = Volume(values, centred((16, 16, 16), (4.0, 4.0, 4.0)))
        report = engine_on_each.evaluate(network, "raycast", size=(8, 8), given={"given": wall})
        report.raise_first()
        return report.values["raycast", "image"].color

    assert picture(0.0, 0.999)[..., 3].min() > 0.999
    assert np.abs(picture(0.0, 0.999) - picture(2.0, 0.999)).max() < 1e-6
    assert np.abs(picture(0.0, 1.0) - picture(2.0, 1.0)).max() > 0.1


class Given(Processor):
    """Stands for a volume that the test brings."""

    value = Output(Volume, doc="The volume.")

    def process(self):
        raise AssertionError("the given value stands for this node")


def test_a_camera_moves_and_no_filter_runs(own) -> None:
    network = scenery()
    network.connect("slope.gradient", "raycast.gradient")
    first = own.evaluate(network, "view", size=SIZE)
    assert {"field", "smooth", "slope", "raycast", "background", "view"} <= set(first.ran)
    network["raycast"].camera = SIDE
    moved = own.evaluate(network, "view", size=SIZE)
    assert moved.ran == ["raycast", "background", "view"], "no filter, and nothing that a memo keeps"
    assert not np.array_equal(first.values["view", "shown"].color, moved.values["view", "shown"].color)


@pytest.mark.parametrize("mode", ["composite", "first_hit"])
def test_a_light_moves_and_nothing_is_classified_anew(own, monkeypatch, mode) -> None:
    network = scenery(mode=mode, lit=True)
    first = own.evaluate(network, "view", size=SIZE)
    calls = []
    evaluate = data.TransferFunction.evaluate
    monkeypatch.setattr(
        data.TransferFunction, "evaluate", lambda self, values: (calls.append(len(values)), evaluate(self, values))[1]
    )
    network["raycast"].light = Light(position=(1.0, 0.2, 0.1))
    moved = own.evaluate(network, "view", size=SIZE)
    assert moved.ran == ["raycast", "background", "view"]
    assert calls == [], "the table is not made again"
    assert not np.array_equal(first.values["view", "shown"].color, moved.values["view", "shown"].color)
    network["raycast"].transfer_function = TransferFunction(
        [(0.0, (1, 0, 0), 0.0), (1.0, (1, 1, 0), 0.3 if mode == "composite" else 0.4)]
    )
    own.evaluate(network, "view", size=SIZE)
    assert calls, "another function does make one"


def test_hidden_parameters_of_the_light_run_nothing(own) -> None:
    network = scenery(lit=False)
    own.evaluate(network, "view", size=SIZE)
    before = lying_on(own)
    network["raycast"].light = Light(position=(1.0, 0.2, 0.1))
    network["raycast"].specular = 0.9
    assert own.evaluate(network, "view", size=SIZE).ran == []
    assert lying_on(own) == before


def test_a_muted_branch_allocates_nothing(own) -> None:
    network = scenery(lit=False)
    network.add("image.depth_darkening", "darken")
    network.disconnect("background.image")
    network.connect("raycast.image", "darken.image")
    network.connect("darken.darkened", "background.image")
    network.mute("darken")
    network.mute("smooth")
    told = scene(own, network, size=SIZE)
    assert told.report.ok
    assert {"darken": "muted", "smooth": "muted"}.items() <= told.idle.items()
    muted = lying_on(own)
    own.evaluate(network, "view", size=SIZE)
    assert lying_on(own) == muted
    with Engine(device="gl", disk=False) as other:
        bare = scenery(lit=False)
        bare.disconnect("raycast.volume")
        bare.connect("field.volume", "raycast.volume")
        other.evaluate(bare, "view", size=SIZE)
        assert lying_on(other) == muted, "as if the muted nodes were not there"
    network.mute("darken", False)
    own.evaluate(network, "view", size=SIZE)
    objects, on_device, on_host = lying_on(own)
    assert objects > muted[0]
    assert on_device > muted[1]
    assert on_host >= muted[2], "what is counted here does see a branch that runs"


class Organs(Processor):
    """Labels that are dear to make."""

    labels = Output(Labels, doc="Ids.")

    def process(self, *, device):
        made.append("organs")
        ids = device.run("organs", (16, 16, 16))
        return Labels(ids)


class Outline(Processor):
    """Pass a field on, and look at labels where there are some."""

    volume = Input(Volume, doc="The field.")
    labels = Input(Labels, required=False, doc="Ids that are drawn where they are wired.")
    out = Output(Volume, doc="The same field.")

    def process(self, volume, labels):
        made.append("outline of nothing" if labels is None else "outline of labels")
        return volume


made: list[str] = []


@pytest.fixture
def organs(tmp_path, monkeypatch) -> type[Processor]:
    """`Organs` with its kernel in a folder of the test."""
    (tmp_path / "organs.glsl").write_text("uint voxel(ivec3 at) { return uint(at.x / 8); }\n")
    monkeypatch.setattr(Organs, "kernels", ("organs",))
    monkeypatch.setattr(Organs, "shader_roots", (str(tmp_path),))
    made.clear()
    return Organs


@pytest.mark.parametrize("hidden_by", ["nobody reads it", "its reader is muted", "not wired"])
def test_a_hidden_label_costs_nothing(own, organs, hidden_by) -> None:
    def network(with_labels: bool) -> Network:
        found = scenery(lit=False)
        found.add(Outline, "outline")
        found.disconnect("raycast.volume")
        found.connect("smooth.smoothed", "outline.volume")
        found.connect("outline.out", "raycast.volume")
        if hidden_by == "its reader is muted":
            found.mute("outline")
        if with_labels:
            found.add(organs, "organs")
        return found

    shown = network(True)
    if hidden_by != "not wired":
        shown.connect("organs.labels", "outline.labels")
    sink = "raycast" if hidden_by != "nobody reads it" else "slope"
    told = scene(own, shown, sink, size=SIZE)
    assert told.report.ok, told.report.errors
    assert "organs" in told.idle
    assert "organs" not in made
    here = lying_on(own)
    with Engine(device="gl", disk=False) as other:
        other.evaluate(network(False), sink, size=SIZE)
        assert lying_on(other) == here, "as in a network without labels"
    made.clear()
    shown.mute("outline", False)
    if hidden_by == "not wired":
        shown.connect("organs.labels", "outline.labels")
    visible = scene(own, shown, "raycast", size=SIZE)
    assert made == ["organs", "outline of labels"]
    assert visible.nodes["organs"].device["output"] == 16**3 * 4, "what is counted here does see labels that are shown"
