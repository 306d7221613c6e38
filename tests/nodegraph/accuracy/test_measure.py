"""Varying, timing and comparing: what runs, what stays, what is told, and the front."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph import Bool, Choice, Float, Input, Int, Network, Output, Processor
from nodegraph.accuracy.front import pareto
from nodegraph.accuracy.measure import measure
from nodegraph.accuracy.reference import Reference
from nodegraph.accuracy.settings import combinations, variants
from nodegraph.data import Image, Mesh, Table, Volume
from nodegraph.data.mesh import box
from nodegraph.errors import CommandError, DeviceError, DeviceMissing, ParameterError, PortError

pytestmark = pytest.mark.slow

RAN: list[str] = []
MADE: list[str] = []


class Ramp(Processor):
    """What the timed nodes read."""

    volume = Output(Volume, doc="A ramp.")
    slope = Float(1.0, doc="Its slope.")

    def process(self, slope):
        RAN.append("ramp")
        return Volume(np.arange(27.0).reshape(3, 3, 3) * slope)


def prepare(volume, fine):
    MADE.append(f"table {fine}")
    return np.zeros(1000 if fine else 10)


def shared(volume):
    MADE.append("bricks")
    return np.zeros(100)


class Render(Processor):
    """A picture whose error is its step, or twice that where it is rough."""

    volume = Input(Volume, doc="The ramp.")
    image = Output(Image, doc="The picture.")
    mesh = Output(Mesh, doc="A box.")
    table = Output(Table, doc="A row.")
    number = Output(float, doc="The step.")
    step = Float(1.0, min=0.25, max=4.0, quality="lower", doc="The error.")
    rough = Bool(False, quality="off", doc="Twice the error.")
    shade = Choice("plain", "loud", doc="No knob: another picture.")
    fine = Bool(False, doc="What the memo depends on.")
    fails_at = Float(0.0, doc="The step at which it fails.")

    def process(self, volume, step, rough, shade, fine, fails_at, *, size, memo):
        RAN.append(f"render {step:g}")
        memo(prepare, volume, fine)
        memo(shared, volume)
        if step == fails_at:
            raise PortError(f"the step {step} is not to my taste")
        error = (2.0 if rough else 1.0) * step / 100
        color = np.full((size[1], size[0], 4), (0.5 if shade == "plain" else 0.75) + error)
        corners = [[i & 1, i >> 1 & 1, (i >> 2 & 1) + error] for i in range(8)]
        return self.Outputs(Image(color), box(corners), Table({"step": [1.0 + error]}), 1.0 + error)


class Pass(Processor):
    """Below the node that is varied."""

    image = Input(Image, doc="In.")
    same = Output(Image, doc="Out.")
    number = Int(0, doc="Of no effect.")

    def process(self, image, number):
        RAN.append("pass")
        return image


def scene(**params: Any) -> Network:
    net = Network()
    net.add(Ramp, "ramp")
    net.add(Render, "render", **params)
    net.add(Pass, "pass")
    net.connect("ramp.volume", "render.volume")
    net.connect("render.image", "pass.image")
    RAN.clear()
    MADE.clear()
    return net


def exact(level: float = 0.5) -> Any:
    """References without a device: the picture with no error."""
    asked: list[Network] = []

    def refer(network: Network) -> Reference:
        asked.append(network)
        shade = network["render"].shade
        color = np.full((6, 8, 4), level if shade == "plain" else 0.75)
        return Reference(Image(color), np.ones((6, 8), bool), 0.0, 2, True, 1e-5)

    refer.asked = asked
    return refer


def varied(net: Network, *texts: str) -> list[dict[str, Any]]:
    return combinations([variants(text, net) for text in texts])


def take(net: Network, *texts: str, view: str = "pass", refer: Any = None, **how: Any) -> Any:
    return measure(net, view, varied(net, *texts), size=(8, 6), refer=refer or exact(), **{"repeats": 2, **how})


# -- what runs -------------------------------------------------------------------------------------------------------


def test_what_is_timed_runs_each_time_and_what_is_above_runs_once() -> None:
    found = take(scene(), "render.step=1,2", repeats=3)
    assert found.timed == ("render", "pass")
    assert RAN.count("ramp") == 1
    assert RAN.count("render 1") == RAN.count("render 2") == 4  # one that is not counted
    assert RAN.count("pass") == 8
    assert [len(point.runs) for point in found.points] == [3, 3]
    assert all(point.seconds == sorted(point.runs)[1] for point in found.points)


def test_settings_take_turns_and_every_other_repeat_goes_backwards() -> None:
    take(scene(), "render.step=1,2,4", repeats=3)
    order = [ran for ran in RAN if ran.startswith("render")]
    first, turns = order[:3], order[3:]
    assert first == ["render 1", "render 2", "render 4"]
    assert turns == first + first[::-1] + first


def test_what_memos_made_stays_and_is_told_apart() -> None:
    found = take(scene(), "render.step=1,2", "render.fine=no,yes")
    assert sorted(MADE) == ["bricks", "table False", "table True"]
    assert all(point.prepare_seconds > 0.0 for point in found.points)
    small, large = (point.bytes for point in found.points[:2])
    assert large - small == 8 * (1000 - 10), "the picture, the table of the setting, the bricks"


def test_a_parameter_that_changes_nothing_below_is_not_timed_again() -> None:
    assert take(scene(), "pass.number=1,2").timed == ("pass",)


def test_one_setting_alone_times_the_nodes_with_knobs_and_below() -> None:
    assert take(scene(), "render.step=2").timed == ("render", "pass")
    assert measure(scene(), "pass", size=(8, 6), refer=exact(), repeats=1).timed == ("render", "pass")
    alone = Network()
    alone.add(Ramp, "ramp")
    refer = lambda _: Reference(Volume(np.zeros((3, 3, 3))), None, 0.0, 1, True, 1e-5)  # noqa: E731
    assert measure(alone, "ramp", refer=refer, repeats=1).timed == ("ramp",), "no knob: all of it"


# -- what is told ----------------------------------------------------------------------------------------------------


def test_errors_and_the_front() -> None:
    found = take(scene(), "render.step=0.25..4", "render.rough=all")
    assert [point.settings["render.step"] for point in found.points[::2]] == [0.25, 0.5, 1.0, 2.0, 4.0]
    for point in found.points:
        expected = point.settings["render.step"] / 100 * (2 if point.settings["render.rough"] else 1)
        assert point.errors["max"] == pytest.approx(expected)
        assert point.device == found.points[0].device
        assert isinstance(point.image, Image)
    assert len(found.references) == 1
    marks = [point.front for point in found.points]
    assert marks == pareto([p.seconds for p in found.points], [p.errors["max"] for p in found.points])
    assert min(found.points, key=lambda point: point.errors["max"]).front
    best = found.with_front("psnr")
    assert max(best.points, key=lambda point: point.errors["psnr"]).front, "more is better"
    with pytest.raises(ParameterError, match="rmsee: no such error here"):
        found.with_front("rmsee")


def test_the_network_is_not_touched() -> None:
    net = scene(step=0.5)
    take(net, "render.step=1,2")
    assert net["render"].step == 0.5


def test_settings_beat_each_other_only_under_one_reference() -> None:
    """A narrow filter that is fast and exact makes no wide one needless."""
    refer = lambda net: Reference(Volume(np.arange(27.0).reshape(3, 3, 3) * net["ramp"].slope), None, 0.0, 1, True, 1.0)  # noqa: E731
    found = take(scene(), "ramp.slope=1,2,3", view="ramp", refer=refer)
    assert [point.reference for point in found.points] == [0, 1, 2]
    assert all(point.front for point in found.points)


def test_settings_that_differ_in_knobs_alone_have_one_reference() -> None:
    refer = exact()
    found = take(scene(), "render.step=1,2", "render.shade=all", refer=refer)
    assert [network["render"].shade for network in refer.asked] == ["plain", "loud"]
    assert [network["render"].step for network in refer.asked] == [1.0, 1.0], "as it is in the network"
    assert [point.reference for point in found.points] == [0, 1, 0, 1]
    assert [point.errors["max"] for point in found.points] == pytest.approx([0.01, 0.01, 0.02, 0.02])


@pytest.mark.parametrize(
    ("view", "reference", "figure", "expected"),
    [
        ("render.mesh", box([[i & 1, i >> 1 & 1, i >> 2 & 1] for i in range(8)]), "max", 0.02),
        ("render.table", Table({"step": [1.0]}), "relative", 0.02),
        ("render.number", 1.0, "absolute", 0.02),
    ],
)
def test_any_output_is_measured(view: str, reference: Any, figure: str, expected: float) -> None:
    found = take(scene(), "render.step=2", view=view, refer=lambda _: Reference(reference, None, 0.0, 1, True, 1e-5))
    assert found.points[0].errors[figure] == pytest.approx(expected)
    assert found.points[0].image is None


def test_a_volume_is_measured_in_its_own_unit() -> None:
    reference = Volume(np.arange(27.0).reshape(3, 3, 3), mapping=(1.0, 0.0, "HU"))
    refer = lambda _: Reference(reference, None, 0.0, 1, True, 1e-5)  # noqa: E731
    found = take(scene(), "ramp.slope=1,2", view="ramp", refer=refer)
    assert [point.errors["max"] for point in found.points] == [0.0, 26.0]
    assert found.units["max"] == "HU"
    assert found.timed == ("ramp",)


def test_a_setting_that_fails_is_a_row_with_its_reason() -> None:
    found = take(scene(fails_at=2.0), "render.step=1,2,4")
    good, bad, other = found.points
    assert "render: the step 2.0 is not to my taste" in bad.failure
    assert math.isnan(bad.seconds)
    assert not bad.front
    assert not good.failure
    assert other.errors["max"] == pytest.approx(0.04)
    assert RAN.count("render 2") == 1, "it is not tried again"


def test_a_reference_that_fails_leaves_the_time_and_no_error() -> None:
    def refer(network: Network) -> Reference:
        raise ParameterError("no way")

    (point,) = take(scene(), "render.step=2", refer=refer).points
    assert point.failure == "no reference: no way"
    assert point.seconds > 0.0
    assert not point.errors
    assert not point.front


class Fussy(Processor):
    """Runs on OpenCL only, as a driver with a fault makes it."""

    image = Output(Image, doc="White.")
    level = Float(1.0, doc="How white.")

    def process(self, level, *, device, size):
        if device.name == "gl":
            raise DeviceError("the driver fell over")
        return Image(np.full((size[1], size[0], 4), level))


def test_what_another_device_takes_over_is_a_failure_of_this_one() -> None:
    net = Network()
    net.add(Fussy, "fussy")
    found = measure(net, "fussy", devices=("gl", "cl"), size=(8, 6), repeats=1, refer=lambda _: white())
    failed, good = found.points
    assert (failed.device, good.device) == ("gl", "cl")
    assert failed.failure == "fussy: gl failed (the driver fell over); running on cl instead"
    assert not failed.errors
    assert good.errors["max"] == 0.0
    assert good.front
    assert not failed.front


def white() -> Reference:
    return Reference(Image(np.ones((6, 8, 4))), None, 0.0, 1, True, 1e-5)


def test_variables_and_groups_are_varied_as_parameters_are() -> None:
    net = scene()
    net.link("render.step", "fine")
    refer = exact()
    found = take(net, "fine=1,2", refer=refer)
    assert [point.errors["max"] for point in found.points] == pytest.approx([0.01, 0.02])
    assert len(refer.asked) == 1, "the variable of a knob is a knob"
    assert found.timed == ("render", "pass")
    grouped = scene()
    grouped.group("render", "pass", id="finish")
    refer = lambda _: Reference(Image(np.full((6, 8, 4), 0.5)), None, 0.0, 1, True, 1e-5)  # noqa: E731
    found = take(grouped, "finish/render.step=1,4", view="finish/pass", refer=refer)
    assert [point.errors["max"] for point in found.points] == pytest.approx([0.01, 0.04])
    assert found.timed == ("finish/render", "finish/pass")
    assert found.points[0].prepare_seconds > 0.0


def test_pictures_of_several_sizes_have_a_reference_each() -> None:
    net = scene()
    net.add("output.view", "view", width=8, height=6)
    net.connect("pass.same", "view.image")
    asked: list[tuple[int, int]] = []

    def refer(network: Network) -> Reference:
        asked.append((network["view"].width, network["view"].height))
        return Reference(Image(np.full((*asked[-1][::-1], 4), 0.5)), None, 0.0, 1, True, 1e-5)

    found = measure(net, "view", varied(net, "view.width=8,16"), repeats=1, refer=refer)
    assert asked == [(8, 6), (16, 6)]
    assert [point.errors["max"] for point in found.points] == pytest.approx([0.01, 0.01])


def test_masked_pixels_do_not_count() -> None:
    def refer(network: Network) -> Reference:
        color = np.full((6, 8, 4), 0.51)
        color[0, 0] = 9.0
        mask = np.ones((6, 8), bool)
        mask[0, 0] = False
        return Reference(Image(color), mask, 3.0, 9, False, 1e-5)

    found = take(scene(), "render.step=1", refer=refer)
    assert found.points[0].errors["max"] == pytest.approx(0.0)
    assert found.references[0].left_out == pytest.approx(1 / 48)
    assert not found.references[0].converged


def test_where_nothing_converged_the_whole_is_compared_and_that_is_said() -> None:
    color = np.full((6, 8, 4), 0.5)
    refer = lambda _: Reference(Image(color), np.zeros((6, 8), bool), 0.3, 9, False, 1e-5)  # noqa: E731
    found = take(scene(), "render.step=1", refer=refer)
    assert found.points[0].errors["max"] == pytest.approx(0.01)
    assert found.references[0].left_out == 0.0
    assert "nothing of the reference converged" in found.references[0].notes[0]


# -- bad input -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("texts", "how", "message"),
    [
        (["render.step=1,9"], {}, r"render.step: 9.0 is outside 0.25..4.0"),
        (["render.stepp=1"], {}, r"no such parameter|no parameter"),
        (["render.step=1"], {"view": "nowhere"}, "nowhere: no such node"),
        (["render.step=1"], {"view": "render"}, r"several values; name one: render.image, render.mesh"),
        (["render.step=1"], {"error": "rmsee"}, r"rmsee: no such error of pass \(did you mean 'rmse'\?\)"),
        (["render.step=1"], {"error": "flip"}, "flip: no such error of pass; say --flip as well"),
        (["render.step=1"], {"repeats": 0}, "repeats: 0 is below 1"),
        (["render.step=1"], {"devices": "vulkan"}, "vulkan: no such device"),
    ],
)
def test_what_makes_no_sense_is_refused_before_anything_runs(
    texts: list[str], how: dict[str, Any], message: str
) -> None:
    with pytest.raises((ParameterError, CommandError, DeviceMissing), match=message):
        take(scene(), *texts, **how)
    assert not RAN


# -- the front -------------------------------------------------------------------------------------------------------

numbers = st.one_of(st.sampled_from([0.0, 1.0, 2.0, math.inf, -math.inf, math.nan]), st.floats(0, 4))


@settings(max_examples=300, deadline=None)
@given(st.lists(st.tuples(numbers, numbers), max_size=12))
def test_the_front_is_what_nobody_beats(points: list[tuple[float, float]]) -> None:
    def beats(a: tuple[float, float], b: tuple[float, float]) -> bool:
        return a[0] <= b[0] and a[1] <= b[1] and a != b

    whole = [not (math.isnan(cost) or math.isnan(error)) for cost, error in points]
    expected = [
        ok and not any(good and beats(other, point) for other, good in zip(points, whole, strict=True))
        for point, ok in zip(points, whole, strict=True)
    ]
    assert pareto([cost for cost, _ in points], [error for _, error in points]) == expected
