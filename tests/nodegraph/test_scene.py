"""What `scene` tells of a run: who asked, why, kernels with their features, decisions, memos, bytes by purpose."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from nodegraph import Float, Input, Int, Output, Processor
from nodegraph.data import Image, Volume
from nodegraph.engine import Engine
from nodegraph.errors import CommandError
from nodegraph.explain import scene
from nodegraph.explain.scene_text import duration, size_of
from nodegraph.network import Network
from tests.support.steps import Draw, Fail, diamond, ran

SIZE = (12, 10)
PIXELS = 12 * 10

KERNEL = """
#ifndef SQUARED
#define SQUARED 0       // values are squared
#endif
#ifndef ROUNDED
#define ROUNDED 0       // 1: values are rounded; 0: values stay as they are
#endif
field3 volume;
uniform float gain;
vec4 pixel(ivec2 at) {
    float value = gain * fetch3(volume, ivec3(at.x % 4, at.y % 4, 0));
#if SQUARED
    value = value * value;
#endif
    return vec4(value);
}
"""


class Cube(Processor):
    """A field of 4 x 4 x 4 voxels, made on the host."""

    out = Output(Volume, doc="The field.")

    def process(self):
        return Volume(np.arange(64, dtype="f4").reshape(4, 4, 4))


def double(volume):
    """For `memo`."""
    return Volume(volume.data * np.float32(2.0))


class Shade(Processor):
    """Runs a kernel some times over a field that is kept by `memo`."""

    kernels = ("shade",)
    volume = Input(Volume, doc="The field.")
    image = Output(Image, doc="Grey.")
    gain = Float(1.0, doc="Factor.")
    times = Int(3, min=1, doc="How often the kernel runs.")
    limit = Float(1.0, doc="From which gain on values are squared.")

    def process(self, volume, gain, times, limit, *, size, device, memo, explain):
        volume = memo(double, volume)
        squared = gain > limit
        for _ in range(times):
            explain(f"values {'are' if squared else 'are not'} squared: the gain is {gain:g}")
            last = device.run("shade", size, defines={"SQUARED": squared}, volume=volume, gain=gain)
        if squared:
            last = device.run("shade", size, volume=volume, gain=gain)
        return Image(last)


class Count(Processor):
    """Changes the world."""

    effect = True
    volume = Input(Volume, doc="Not looked at.")

    def process(self, volume):
        ran["count"] += 1


@pytest.fixture(autouse=True)
def _anew(tmp_path, monkeypatch) -> None:
    ran.clear()
    (tmp_path / "shade.glsl").write_text(KERNEL)
    monkeypatch.setattr(Shade, "shader_roots", (str(tmp_path),))


@pytest.fixture
def own() -> Iterator[Engine]:
    """An engine whose device and cache belong to the test."""
    with Engine(device="gl", disk=False) as engine:
        yield engine


def shading(**params: object) -> Network:
    network = Network()
    network.add(Cube, "cube")
    network.add(Shade, "shade", **params)
    network.connect("cube.out", "shade.volume")
    return network


def test_a_scene_tells_who_asked_why_and_what_took_no_part() -> None:
    network = diamond()
    network.add(Draw, "draw")
    network.connect("sum.out", "draw.volume")
    network.add(Draw, "unread")
    network.mute("left")
    with Engine(disk=False) as engine:
        told = scene(engine, network, "draw", size=(30, 20))
        assert list(told.nodes) == ["seed", "right", "sum", "draw"]
        assert told.nodes["draw"].asked == "30x20 final, sink"
        assert "asked by" in told.nodes["seed"].asked
        assert all(node.ran and "has not run before" in node.reason for node in told.nodes.values())
        assert all(node.seconds is not None for node in told.nodes.values())
        assert told.idle == {"unread": "nothing that is shown reads it", "left": "muted"}
        assert told.nodes["draw"].host == 30 * 20 * 4 * 4
        assert told.device == ""
        network["right"].by = 3.0
        after = scene(engine, network, "draw", size=(30, 20))
    assert {path: node.ran for path, node in after.nodes.items()} == {
        "seed": False, "right": True, "sum": True, "draw": True
    }  # fmt: skip
    assert "kept" in after.nodes["seed"].reason
    assert after.nodes["sum"].reason.startswith("runs: right: by 20.0 -> 3.0")
    text = str(after)
    assert text.startswith("draw: 4 nodes, 3 ran\n")
    assert "unread  nothing that is shown reads it" in text


def test_a_node_that_is_asked_for_two_sizes_is_told_once(own) -> None:
    network = shading()
    for name, width in (("small", 6), ("large", 12)):
        network.add("output.view", name, width=width, height=10)
        network.connect("shade.image", f"{name}.image")
    own.evaluate(network, "small")
    told = scene(own, network)
    node = told.nodes["shade"]
    assert sorted(node.asked.split("; ")) == ["12x10 final, asked by large", "6x10 final, asked by small"]
    assert "kept" in node.reason
    assert "asked-for size 6x10 -> 12x10" in node.reason
    assert sorted(kernel.run.work for kernel in node.kernels) == ["12x10 pixels", "6x10 pixels"]


def test_kernels_are_told_by_variant_with_features_work_and_bytes(own) -> None:
    told = scene(own, shading(gain=2.0), size=SIZE)
    squared, plain = told.nodes["shade"].kernels
    assert (squared.run.count, plain.run.count) == (3, 1), "equal runs are told once"
    assert squared.run.kernel == "shade"
    assert squared.run.work == "12x10 pixels"
    assert squared.run.device == "gl"
    assert squared.run.seconds > 0.0
    assert {switch.name: switch.held for switch in squared.switches} == {"SQUARED": True, "ROUNDED": False}
    assert {switch.name: switch.held for switch in plain.switches} == {"SQUARED": False, "ROUNDED": False}
    assert [(field.name, field.bytes) for field in squared.run.fields] == [("volume", 256)]
    assert squared.run.fields[0].uploaded
    assert not plain.run.fields[0].uploaded, "it lies there already"
    assert squared.run.outputs == (("", PIXELS * 16),)
    text = str(told)
    assert "shade on gl, 3 times 12x10 pixels" in text
    assert "holds          SQUARED 1: values are squared" in text
    assert "left out       SQUARED (values are squared)" in text
    assert "without effect ROUNDED" in text
    assert "reads          volume 256 B" in text


def test_decisions_are_told_once_and_stay_with_the_result(own) -> None:
    network = shading(gain=2.0)
    told = scene(own, network, size=SIZE)
    assert told.nodes["shade"].decisions == ["values are squared: the gain is 2"]
    assert "decided        values are squared: the gain is 2" in str(told)
    assert told.report.notes == [], "a decision is no remark for who runs the network"
    network["shade"].gain = 0.5
    assert scene(own, network, size=SIZE).nodes["shade"].decisions == ["values are not squared: the gain is 0.5"]
    network["shade"].gain = 2.0
    again = scene(own, network, size=SIZE).nodes["shade"]
    assert not again.ran
    assert again.decisions == ["values are squared: the gain is 2"], "of what made the result that is kept"
    assert [kernel.run.count for kernel in again.kernels] == [3, 1]
    assert again.seconds is None


def test_memos_tell_seconds_bytes_and_whether_they_were_made(own) -> None:
    network = shading()
    (memo,) = scene(own, network, size=SIZE).nodes["shade"].memos
    assert (memo.name, memo.made, memo.bytes) == ("double", True, 256)
    assert memo.seconds is not None
    network["shade"].gain = 0.5
    told = scene(own, network, size=SIZE)
    (memo,) = told.nodes["shade"].memos
    assert not memo.made
    assert memo.seconds is not None, "what it once took"
    assert "256 B, kept from before" in str(told)


def test_bytes_by_purpose_and_node_are_those_that_lie_there(engine_on_each) -> None:
    network = shading()
    network.add(Shade, "other", gain=0.25)
    network.connect("cube.out", "other.volume")
    with Engine(device=engine_on_each.device_name, disk=False) as engine:
        told = scene(engine, network, size=SIZE)
        (device,) = engine.devices.opened
        by_purpose = {what: n for what, n in engine.call(device.memory.by_purpose).items() if n}
    nodes = told.nodes
    totals = dict(told.shared)
    for node in nodes.values():
        for purpose, nbytes in node.device.items():
            totals[purpose] = totals.get(purpose, 0) + nbytes
    assert totals == by_purpose
    real = 8 if device.name == "cl64" else 4
    assert nodes["shade"].device["output"] == nodes["other"].device["output"] == PIXELS * 4 * real
    assert nodes["shade"].device["program"] > 0
    assert "program" not in nodes["other"].device, "one program serves both, and counts for who had it first"
    assert nodes["cube"].device == {}
    assert nodes["cube"].host == 256


def test_effects_do_not_run_for_an_explanation() -> None:
    network = Network()
    network.add(Cube, "cube")
    network.add(Count, "count")
    network.add("output.view", "view")
    network.connect("cube.out", "count.volume")
    with Engine(disk=False) as engine:
        told = scene(engine, network)
        assert ran["count"] == 0
        assert "count" in told.idle
        scene(engine, network, "count")
    assert ran["count"] == 1, "it does where it is named"


def test_failures_are_told_and_the_rest_goes_on() -> None:
    network = diamond()
    network.add(Fail, "fail")
    network.add(Draw, "draw")
    network.connect("sum.out", "fail.volume")
    network.connect("fail.out", "draw.volume")
    with Engine(disk=False) as engine:
        told = scene(engine, network, "draw")
        assert told.nodes["fail"].state == "failed"
        assert "it broke" in told.nodes["fail"].reason
        assert told.nodes["draw"].state == "blocked"
        assert told.nodes["sum"].ran
        assert not told.report.ok
        assert "it broke" in str(told)
        with pytest.raises(CommandError, match="did you mean 'draw'"):
            scene(engine, network, "drew")


def test_units() -> None:
    assert [size_of(n) for n in (0, 999, 1000, 36864, 14_900_000, 2 << 30)] == [
        "0 B", "999 B", "1 kB", "36.9 kB", "14.9 MB", "2.15 GB"
    ]  # fmt: skip
    assert [duration(s) for s in (2.5e-5, 0.0312, 0.45, 2.345)] == ["0.025 ms", "31 ms", "450 ms", "2.35 s"]
