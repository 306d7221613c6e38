"""Reloading: what changed is taken over, what fails is told and leaves the old in use, open documents follow."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from nodegraph import kernel_sources, locations, workspace
from nodegraph.data import Image, Volume
from nodegraph.engine import Engine
from nodegraph.errors import PortError
from nodegraph.network import Kept, Network
from nodegraph.rebinding import Rebind
from nodegraph.registry import Registry
from nodegraph.reloading import Reloading

PYTHON = '''
"""Multiply a volume."""
from nodegraph import Float, Input, Int, Output, Processor
from nodegraph.data import Volume


class Scale(Processor):
    """Multiply every voxel."""

    {volume} = Input(Volume, doc="Field.")
    scaled = Output(Volume, doc="Same grid.")
    {params}

    def process(self, {volume}, {names}):
        return {volume}.with_data({volume}.real() * {value})
'''
FACTOR = 'factor = Float(2.0, doc="Factor.")'
GAIN = """\
// Brighten a picture.
field2 image;                // Picture.
uniform float gain = 2.0;    // 0..10; Factor.

vec4 pixel(ivec2 at) {
    vec4 color = fetch2(image, at);
    return vec4(gain * color.rgb, color.a);
}
"""


def scale(
    folder: Path, value: str = "factor", params: str = FACTOR, names: str = "factor", volume: str = "volume"
) -> Path:
    path = folder / "filter" / "scale.py"
    path.parent.mkdir(exist_ok=True, parents=True)
    path.write_text(PYTHON.format(value=value, params=params, names=names, volume=volume))
    return path


def gain(folder: Path, text: str = GAIN) -> Path:
    path = folder / "image" / "gain.glsl"
    path.parent.mkdir(exist_ok=True, parents=True)
    path.write_text(text)
    return path


@pytest.fixture
def found(tmp_path: Path) -> Registry:
    return Registry([locations.plugin_folder(tmp_path, str(tmp_path))])


@pytest.fixture
def engine() -> Iterator[Engine]:
    with Engine("cl", disk=False) as made:
        yield made


def run_gain(engine: Engine, found: Registry) -> float:
    net = Network(find=found.find)
    net.add("image.gain", "gain")
    report = engine.evaluate(
        _with_image(net), "gain", size=(4, 4), given={"image": Image(np.full((4, 4, 4), 0.5, "f4"))}
    )
    report.raise_first()
    return float(report.shown["gain"]["result"].color[0, 0, 0])


def _with_image(net: Network):
    from dataclasses import replace

    from nodegraph.flat import FlatNode

    flat = net.flatten()
    node = flat.nodes["gain"]
    given = FlatNode("image", "given", None, {}, {}, {}, None, 1)
    fed = replace(node, sources={"image": (("image", "value"),)}, problem=None)
    return replace(flat, nodes={"image": given, "gain": fed})


def test_a_changed_file_is_loaded_and_one_that_fails_leaves_the_old(tmp_path: Path, found: Registry) -> None:
    path = scale(tmp_path)
    old = found.find("filter.scale")
    with Reloading(found) as reloading:
        assert reloading.look() == []
        scale(tmp_path, value="factor * 10.0")
        assert [(one.id, one.file, one.reason) for one in reloading.look()] == [("filter.scale", path, "")]
        new = found.find("filter.scale")
        assert new is not old
        path.write_text("x = 1\n1 / 0\n")
        (outcome,) = reloading.look()
        assert (outcome.line, outcome.reason) == (2, "ZeroDivisionError: division by zero")
        assert found.find("filter.scale") is new
        assert reloading.look() == []  # told once
        assert reloading.refused == [outcome]
        scale(tmp_path, value="factor * 10.0")
        assert reloading.look() == []  # it is what is in use
        assert reloading.refused == []


def test_a_new_file_is_found_and_one_that_fails_is_told(tmp_path: Path, found: Registry) -> None:
    gain(tmp_path)
    with Reloading(found) as reloading:
        reloading.look()
        path = scale(tmp_path, value="factor (")
        (outcome,) = reloading.look()
        assert (outcome.id, outcome.file) == ("filter.scale", path)
        assert outcome.line == 15
        scale(tmp_path)
        assert [(one.id, one.reason) for one in reloading.look()] == [("filter.scale", "")]
        path.unlink()
        assert reloading.look() == []
        assert reloading.refused == []


def test_a_kernel_counts_when_it_compiles(tmp_path: Path, found: Registry, engine: Engine) -> None:
    path = gain(tmp_path)
    assert run_gain(engine, found) == 1.0
    with Reloading(found) as reloading:
        gain(tmp_path, GAIN.replace("gain * color.rgb", "gain * color.rgb + 0.25"))
        assert run_gain(engine, found) == 1.0  # held until it was tried
        assert [one.reason for one in reloading.look(engine)] == [""]
        assert run_gain(engine, found) == 1.25
        gain(tmp_path, GAIN.replace("gain * color.rgb", "gian * color.rgb"))
        (outcome,) = reloading.look(engine)
        assert (outcome.file, outcome.line) == (path, 7)
        assert "gian" in outcome.reason
        assert run_gain(engine, found) == 1.25
    assert kernel_sources.changed() != []  # nothing is held any more, and the broken text is on disk


def test_a_broken_include_is_told_once_with_its_own_place(tmp_path: Path, found: Registry, engine: Engine) -> None:
    part = tmp_path / "shaders" / "common" / "part.glsl"
    part.parent.mkdir(parents=True)
    part.write_text("float part(float x) { return x; }\n")
    for name in ("one", "two"):
        path = tmp_path / "shaders" / "image" / f"{name}.glsl"
        path.parent.mkdir(exist_ok=True)
        path.write_text(
            '#include "common/part.glsl"\nuniform float x;\nvec4 pixel(ivec2 at) { return vec4(part(x)); }\n'
        )
        python = tmp_path / "processors" / "image" / f"{name}.py"
        python.parent.mkdir(parents=True, exist_ok=True)
        python.write_text(
            "from nodegraph import Output, Processor\nfrom nodegraph.data import Image\n\n\n"
            f'class {name.title()}(Processor):\n    """Grey."""\n\n    image = Output(Image, doc="Grey.")\n\n'
            f"    def process(self, *, device):\n        return Image(device.run('image/{name}', (4, 4), x=0.5))\n"
        )
    found = Registry([locations.plugin_folder(tmp_path, "own")])

    def seen(name: str) -> float:
        net = Network(find=found.find)
        net.add(f"image.{name}", "it")
        report = engine.evaluate(net, "it", size=(4, 4))
        report.raise_first()
        return float(report.shown["it"]["image"].color[0, 0, 0])

    assert (seen("one"), seen("two")) == (0.5, 0.5)
    with Reloading(found) as reloading:
        assert part.parent in reloading.folders()
        assert part in reloading.files()
        part.write_text("float part(float x) { return x + ; }\n")
        (outcome,) = reloading.look(engine)
        assert (outcome.file, outcome.line) == (part, 1)
        assert (seen("one"), seen("two")) == (0.5, 0.5)
        part.write_text("float part(float x) { return 2.0 * x; }\n")
        assert {one.id for one in reloading.look(engine)} == {"image/one", "image/two"}
        assert (seen("one"), seen("two")) == (1.0, 1.0)
        assert reloading.refused == []


def test_nodes_keep_their_values_through_a_reload_and_what_is_gone_is_kept(tmp_path: Path, found: Registry) -> None:
    scale(tmp_path, params=FACTOR + '\n    shift = Float(0.0, doc="Added.")', names="factor, shift")
    net = Network(find=found.find)
    net.add("filter.scale", "one")
    net.add("filter.scale", "two", factor=5.0, shift=1.5)
    net.connect("one.scaled", "two.volume")
    net.set("one.shift", 0.5)
    net.set("one.shift", 0.75)
    net.set("one.factor", 3.0)
    net.set("one.factor", 4.0)
    with Reloading(found) as reloading:
        scale(tmp_path, params='factor = Int(2, doc="Factor.")', volume="field")
        reloading.look()
        rebind = Rebind()
        rebind.apply(net)
    assert net["two"].factor == 5
    assert isinstance(net.node("two").params["shift"], Kept)
    assert net.node("two").inputs == {"volume": ("one.scaled",)}
    assert [text.partition(":")[0] for text in rebind.told] == ["one.shift", "two.shift", "two.volume"]
    assert isinstance(net.flatten().nodes["two"].problem, PortError)
    assert {node.path for node in rebind._edits.touched} == {"one", "two"}
    # What was done before is undone and redone in the terms of the new declaration, and the file keeps it all.
    net.undo()
    assert net["one"].factor == 3
    assert isinstance(net["one"].factor, int)
    net.undo()
    assert net["one"].factor == 2
    net.undo()
    assert isinstance(net.node("one").params["shift"], Kept)
    assert net.node("one").params["shift"].json == 0.5
    net.redo()
    net.redo()
    net.redo()
    assert net["one"].factor == 4
    assert '"shift": 1.5' in workspace.dumps(net)


def test_a_removed_node_comes_back_with_the_new_class_and_an_unknown_one_wakes_up(
    tmp_path: Path, found: Registry
) -> None:
    gain(tmp_path)
    net = workspace.loads(
        '{"nodegraph": 1, "nodes": {"late": {"type": "filter.scale", "params": {"factor": 7.0}, "muted": true}}}',
        find=found.find,
    )
    net.add("image.gain", "gain", gain=3.0)
    net.remove("gain")
    assert net.node("late").processor is None
    with Reloading(found) as reloading:
        reloading.look()
        scale(tmp_path)
        gain(tmp_path, GAIN.replace("Factor", "How bright"))
        assert {one.id for one in reloading.look()} == {"filter.scale", "image.gain"}
        Rebind().apply(net)
    assert net["late"].factor == 7.0
    net.undo()
    assert net.node("gain").processor is found.find("image.gain")
    assert net["gain"].gain == 3.0


def test_a_reloaded_processor_is_computed_anew(tmp_path: Path, found: Registry, engine: Engine) -> None:
    scale(tmp_path)
    net = Network(find=found.find)
    net.add("filter.scale", "scale")
    volume = Volume(np.ones((2, 2, 2), "f4"))
    with Reloading(found) as reloading:
        assert found.find("filter.scale")().process(volume, 2.0).data.max() == 2.0
        scale(tmp_path, value="factor * 10.0")
        reloading.look(engine)
        rebind = Rebind()
        rebind.apply(net)
        assert rebind.structural
        assert net.node("scale").processor().process(volume, 2.0).data.max() == 20.0
        again = Rebind()
        again.apply(net)
        assert not again.touched
