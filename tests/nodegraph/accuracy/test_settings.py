"""Knobs of a network: which there are, what they may take, and copies of a network with other values."""

from __future__ import annotations

import json

import pytest

from nodegraph import workspace
from nodegraph.accuracy import settings
from nodegraph.accuracy.ladders import ladder, refined
from nodegraph.errors import CommandError, GraphError, ParameterError
from nodegraph.params import Bool, Choice, Float, Int
from tests.support.slab import Noise, Number, Slab, Tint, find, slab

STEP = Slab.params["step"]


def tinted():
    net = slab()
    net.add(Tint, "tint")
    net.disconnect("view.image")
    net.connect("slab.image", "tint.image")
    net.connect("tint.tinted", "view.image")
    return net


def test_the_knobs_above_a_view_are_its_visible_parameters_of_quality() -> None:
    net = tinted()
    net.add(Noise, "elsewhere")
    knobs = settings.quality_parameters(net, "view")
    assert [knob.place for knob in knobs] == ["slab.step", "slab.rule", "tint.careful", "tint.width"]
    assert [knob.value for knob in knobs] == [0.25, "left", False, 1.0]
    assert [knob.direction for knob in knobs] == ["lower", ("left", "exact"), "on", "lower"]
    net["tint"].careful = True
    assert "tint.rounds" in [knob.place for knob in settings.quality_parameters(net, "view")]
    assert [knob.place for knob in settings.quality_parameters(net, "slab.image")] == ["slab.step", "slab.rule"]


def test_what_a_wire_or_an_expression_decides_is_left_out_and_said() -> None:
    net = tinted()
    net.add(Number, "number")
    net.connect("number.value", "tint.width")
    net.link("slab.step", "fine")
    net.add(Slab, "other")
    net.link("other.step", "coarse")
    net.derive("fine", "coarse / 2")
    found = settings.find_knobs(net, "view")
    assert [knob.place for knob in found.knobs] == ["slab.rule", "tint.careful"]
    assert found.left_out == {
        "slab.step": "it follows fine = coarse / 2",
        "tint.width": "a wire decides its value",
    }


def test_parameters_that_share_a_variable_are_one_knob_with_the_range_of_all() -> None:
    net = tinted()
    net.link("tint.width", "detail")
    net.link("slab.step", "detail")
    knobs = settings.quality_parameters(net, "view")
    (shared,) = [knob for knob in knobs if knob.variable]
    assert (shared.place, shared.shared, shared.variable) == ("slab.step", ("tint.width",), "variables.detail")
    assert (shared.low, shared.high) == (2.0**-16, 1.0)
    copy = settings.applied(net, {shared.place: 0.5})
    assert (copy.get("slab.step"), copy.get("tint.width"), copy.get("detail")) == (0.5, 0.5, 0.5)


def test_settings_go_to_a_copy() -> None:
    net = slab()
    before, revision = workspace.dumps(net), net.revision
    copy = settings.applied(net, {"slab.step": 0.125, "slab.rule": "exact"})
    assert (copy.get("slab.step"), copy.get("slab.rule")) == (0.125, "exact")
    assert (workspace.dumps(net), net.revision) == (before, revision)
    with pytest.raises(ParameterError, match=r"slab\.step: 9\.0 mm is outside"):
        settings.applied(net, {"slab.step": 9.0})
    assert settings.encoded(net, {"slab.step": 0.5}) == {"slab.step": 0.5}


def test_a_copy_keeps_processors_that_are_in_no_registry_and_what_nobody_knows() -> None:
    nodes = {"slab": {"type": Slab.id, "params": {"colour": 3}}, "unknown": {"type": "no.such"}}
    net = workspace.loads(json.dumps({"nodegraph": 1, "nodes": nodes, "own": 1}), find=find)
    copy = settings.copy_of(net)
    assert copy.node("slab").processor is Slab
    assert workspace.dumps(copy) == workspace.dumps(net)


def test_a_view_that_does_not_exist_is_one_sentence() -> None:
    with pytest.raises(CommandError, match=r"veiw: no such node .did you mean 'view'"):
        settings.quality_parameters(slab(), "veiw")


def test_a_knob_steps_along_its_ladder() -> None:
    (step, rule) = settings.quality_parameters(slab(), "view")
    assert (step.coarser(), step.finer()) == (0.5, 0.125)
    assert (rule.coarser(), rule.finer()) == (None, "exact")
    assert step.ladder() == tuple(sorted(step.ladder(), reverse=True))


@pytest.mark.parametrize(
    ("parameter", "value", "values"),
    [
        (Float(1.0, soft_min=0.25, soft_max=4.0, quality="lower"), 1.0, (4.0, 2.0, 1.0, 0.5, 0.25)),
        (Float(1.0, soft_min=0.25, soft_max=4.0, quality="lower"), 16.0, (16.0, 4.0, 2.0, 1.0, 0.5, 0.25)),
        (Int(4, min=1, max=16, quality="higher"), 4, (1, 2, 4, 8, 16)),
        (Int(3, min=1, max=6, quality="higher"), 3, (1, 3, 6)),
        (Bool(True, quality="off"), True, (True, False)),
        (Bool(True, quality="on"), True, (False, True)),
        (Choice("a", "b", "c", quality=("c", "a")), "a", ("c", "a")),
        (Choice("a", "b", "c", quality=("c", "a")), "b", ("b", "c", "a")),
        (Float(0.0, quality="higher"), 0.0, (0.0,)),
    ],
)
def test_ladders_lead_from_fast_to_accurate(parameter, value, values) -> None:
    assert ladder(parameter, value) == values


def test_a_narrow_range_is_cut_towards_its_accurate_end() -> None:
    termination = Float(0.999, min=0.5, max=1.0, quality="higher")
    values = ladder(termination, 0.999)
    assert values[:3] == (0.5, 0.75, 0.875)
    assert values[-1] == 1.0
    assert 0.999 in values
    tolerance = Float(0.0, min=0.0, soft_max=1.0, quality="lower")
    assert ladder(tolerance, 0.0)[:2] == (1.0, 0.5)
    assert ladder(tolerance, 0.0)[-1] == 0.0


def test_limits_of_others_that_share_the_value_end_a_ladder() -> None:
    assert ladder(Float(1.0, quality="lower"), 1.0, 0.5, 2.0) == (2.0, 1.0, 0.5)


@pytest.mark.parametrize(
    ("parameter", "value", "next_value"),
    [
        (Float(1.0, min=0.4, quality="lower"), 1.0, 0.5),
        (Float(1.0, min=0.4, quality="lower"), 0.5, 0.4),
        (Float(0.9, max=1.0, quality="higher"), 0.9, 1.0),
        (Int(3, min=1, quality="lower"), 3, 1),
        (Int(3, max=4, quality="higher"), 3, 4),
        (Int(0, min=0, quality="higher"), 0, 1),
        (Bool(True, quality="off"), True, False),
        (Choice("a", "b", quality=("b", "a")), "b", "a"),
    ],
)
def test_a_reference_refines_within_the_hard_limits(parameter, value, next_value) -> None:
    assert refined(parameter, value, getattr(parameter, "min", None), getattr(parameter, "max", None)) == next_value


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("slab.step=0.125..1", (0.125, 0.25, 0.5, 1.0)),
        ("slab.step=1..0.3", (1.0, 0.5, 0.3)),
        ("slab.step=0.25..0.75:3", (0.25, 0.5, 0.75)),
        ("slab.step=0.1, 0.3", (0.1, 0.3)),
        ("slab.rule=all", ("left", "exact")),
        ("slab.rule=exact", ("exact",)),
        ("view.width=4..16:4", (4, 8, 12, 16)),
    ],
)
def test_vary_expands_ranges_and_lists(text, values) -> None:
    assert settings.variants(text, slab()) == (text.partition("=")[0], values)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("slab.setp=0.1", "no such parameter .did you mean 'step'"),
        ("slap.step=0.1", "no such node .did you mean 'slab'"),
        ("slab.step=0.5..9", "outside"),
        ("slab.rule=exakt", "did you mean 'exact'"),
        ("slab.step=a..b", "slab.step"),
        ("view.width=4..16", "say how many"),
        ("slab.step", "not of the form"),
        ("slab.step=0..1", "above 0"),
        ("slab.step=0..1:0", "number of values"),
        ("slab.step=0..1:" + 5000 * "9", "slab.step: the number of values"),
        ("slab.step=,,", "slab.step: ',,' holds no value"),
    ],
)
def test_vary_refuses_what_set_refuses(text, message) -> None:
    with pytest.raises(GraphError, match=message):
        settings.variants(text, slab())


def test_combinations_of_what_varies() -> None:
    rows = settings.combinations([("a.x", (1, 2)), ("b.y", ("p", "q"))])
    assert rows == [
        {"a.x": 1, "b.y": "p"},
        {"a.x": 1, "b.y": "q"},
        {"a.x": 2, "b.y": "p"},
        {"a.x": 2, "b.y": "q"},
    ]
    with pytest.raises(ParameterError, match="varied twice"):
        settings.combinations([("a.x", (1,)), ("a.x", (2,))])
    with pytest.raises(ParameterError, match="more than"):
        settings.combinations([("a.x", tuple(range(200))), ("b.y", tuple(range(200)))])
