"""Variables, links and expressions."""

from __future__ import annotations

import pytest

from nodegraph import expressions
from nodegraph.data import Camera
from nodegraph.errors import CommandError, ParameterError
from nodegraph.network import Network
from nodegraph.variable_commands import AddVariable, RemoveVariable, RenameVariable, SetExpression
from nodegraph.workspace import dumps, loads
from tests.support.document import chain, find

# -- expressions --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3", 7),
        ("(1 + 2) * 3", 9),
        ("-2 ** 2", -4.0),
        ("2 ** -1", 0.5),
        ("2 ** 3 ** 2", 512.0),
        ("10 - 3 - 2", 5),
        ("7 // 2", 3),
        ("-7 % 3", 2),
        ("a / (b - 2)", 4.0),
        ("-a + +b", -1),
        ("clamp(a * 3, 0, 10)", 10),
        ("max(a, b, 7)", 7),
        ("round(2.5)", 3),
        ("mix(0, 10, 0.25)", 2.5),
        ("degrees(pi)", 180.0),
        ("sign(b - a) * 1e1", -10.0),
        (".5 + 1.", 1.5),
    ],
)
def test_arithmetic(text: str, value: float) -> None:
    found = expressions.parse(text, "variables.x").evaluate({"a": 4, "b": 3}, "variables.x")
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "column 1: expected a value, found the end"),
        ("1 +", "column 4: expected a value, found the end"),
        ("a b", "column 3: expected an operator, found 'b'"),
        ("a $ b", "column 3: unexpected character, found '$'"),
        ("sinn(1)", "no function 'sinn' (did you mean 'sin'?)"),
        ("sin", "sin is a function; expected '('"),
        ("clamp(1)", "clamp takes 3 arguments, not 1"),
        ("(1", "expected ')', found the end"),
        ("1 / 0", "divides by zero"),
        ("sqrt(-1)", "has no value here"),
        ("9.0 ** 9 ** 9", "too large for a number"),
        ("(" * 60 + "1" + ")" * 60, "more than 50 levels of nesting"),
        ("1" + " + 1" * 300, "at most 500 are read"),
        ("camera * 2", "camera is no number"),
        ("__import__('os')", "no function '__import__'"),
        ("a.real", "unexpected character"),
    ],
)
def test_what_is_no_expression_is_refused_with_its_column(text: str, says: str) -> None:
    with pytest.raises(ParameterError) as caught:
        expressions.parse(text, "variables.x").evaluate({"a": 1, "b": 2, "camera": Camera()}, "variables.x")
    assert str(caught.value).startswith("variables.x: ")
    assert says in str(caught.value)


def test_a_long_sum_needs_no_deep_stack() -> None:
    assert expressions.parse("1" + "+1" * 249, "x").evaluate({}, "x") == 250


def test_renaming_keeps_spacing_and_leaves_numbers_alone() -> None:
    assert (
        expressions.parse("a+2e5 * e5 -  max(a, aa)", "x").renamed({"e5": "q", "a": "b"}) == "b+2e5 * q -  max(b, aa)"
    )


# -- links --------------------------------------------------------------------------------------------------------


def linked() -> Network:
    """blur.sigma and raycast.step follow ``coarse``."""
    net = chain()
    net.link("blur.sigma", "coarse")
    net.link("raycast.step", "coarse")
    return net


def test_linked_parameters_share_one_value() -> None:
    net = linked()
    assert net.get("coarse") == 2.0
    assert net["raycast"].step == 2.0
    net["raycast"].step = 0.5
    assert net["blur"].sigma == 0.5
    assert net.flatten().nodes["blur"].values["sigma"] == 0.5
    net.undo()
    assert net["blur"].sigma == 2.0
    assert net.flatten().nodes["blur"].values["sigma"] == 2.0


def test_the_allowed_range_is_the_intersection() -> None:
    net = linked()
    with pytest.raises(ParameterError, match=r"5.0 voxel is outside 0.05..4.0 voxel"):
        net.set("coarse", 5.0)
    with pytest.raises(ParameterError, match="outside"):
        net["blur"].sigma = 5.0
    assert net.get("coarse") == 2.0
    net.add("compose")
    net.link("compose.gain", "coarse")
    with pytest.raises(ParameterError, match=r"outside 0.5..2.0"):
        net.set("coarse", 3.0)


def test_an_empty_intersection_is_refused() -> None:
    net = chain()
    net.link("raycast.shininess", "x")
    with pytest.raises(ParameterError, match=r"raycast.step: 8.0 voxel is outside"):
        net.link("raycast.step", "x")
    net["raycast"].shininess = 9.0
    net.link("blur.iterations", "y")
    net.add("compose", "c")
    net.add("source", "s")
    with pytest.raises(ParameterError, match=r"raycast.camera: is a Camera and cannot follow y, a Int"):
        net.link("raycast.camera", "y")


def test_ranges_that_do_not_meet_name_the_others() -> None:
    from nodegraph import Float, Output, Processor
    from nodegraph.data import Volume

    class Far(Processor):
        """Out of reach of a step."""

        made = Output(Volume, doc="Data.")
        distance = Float(50.0, min=40.0, doc="Far.")

        def process(self, distance: float) -> object:
            return None

    net = chain()
    net.add(Far, "far")
    net.link("raycast.step", "x")
    with pytest.raises(ParameterError) as caught:
        net.link("far.distance", "x")
    assert str(caught.value) == "far.distance: shares no value with raycast.step, which follow x, too"
    assert net.variables.keys() == {"x"}


def test_setting_one_that_follows_an_expression_is_refused_naming_it() -> None:
    net = linked()
    net.history.do(AddVariable("fine", "Float", expression="coarse / 2"))
    net.link("raycast.quality_limit", "fine")
    assert net["raycast"].quality_limit == 1.0
    before = dumps(net)
    with pytest.raises(ParameterError) as caught:
        net["raycast"].quality_limit = 3.0
    assert (
        str(caught.value)
        == "raycast.quality_limit: follows variables.fine = coarse / 2; change the expression or unlink it"
    )
    with pytest.raises(ParameterError, match=r"variables.fine: follows 'coarse / 2'"):
        net.set("fine", 3.0)
    assert dumps(net) == before
    net.set("coarse", 1.0)
    assert net.flatten().nodes["raycast"].values["quality_limit"] == 0.5


def test_a_value_that_spoils_something_derived_is_refused() -> None:
    net = chain()
    net.link("blur.sigma", "coarse")
    net.history.do(AddVariable("fine", "Float", expression="4 / coarse"))
    net.link("raycast.step", "fine")
    with pytest.raises(ParameterError, match=r"variables.coarse: 0.5 is refused, because variables.fine: 8.0 voxel"):
        net.set("coarse", 0.5)
    with pytest.raises(ParameterError, match="divides by zero"):
        net.set("coarse", 0.0)
    assert net.get("fine") == 2.0


def test_unlinking_keeps_the_value_and_the_last_user_takes_the_variable_along() -> None:
    net = linked()
    before = dumps(net)
    net.unlink("blur.sigma")
    assert net["blur"].sigma == 2.0
    assert "coarse" in net.variables
    net.unlink("raycast.step")
    assert net["raycast"].step == 2.0
    assert net.variables == {}
    net.undo()
    assert "coarse" in net.variables
    net.undo()
    assert dumps(net) == before
    net.remove("blur", "raycast")
    assert net.variables == {}
    net.undo()
    assert dumps(net) == before


def test_a_derived_variable_takes_its_operands_along() -> None:
    net = chain()
    net.history.do(AddVariable("coarse", "Float", 1.0))
    net.history.do(AddVariable("fine", "Float", expression="coarse / 2"))
    net.link("raycast.step", "fine")
    net.remove("raycast")
    assert net.variables == {}


def test_variables_that_follow_themselves_are_refused() -> None:
    net = linked()
    net.history.do(AddVariable("fine", "Float", expression="coarse / 2"))
    with pytest.raises(ParameterError, match="coarse -> fine -> coarse: this variable follows itself"):
        net.history.do(SetExpression("coarse", "fine * 2"))
    with pytest.raises(ParameterError, match=r"names 'coars', which is no variable \(did you mean 'coarse'\?\)"):
        net.history.do(SetExpression("fine", "coars / 2"))


def test_an_expression_becomes_plain_with_its_value() -> None:
    net = linked()
    net.history.do(AddVariable("base", "Float", 3.0))
    net.history.do(SetExpression("coarse", "base / 2"))
    assert net["raycast"].step == 1.5
    net.history.do(SetExpression("coarse", ""))
    assert net.get("coarse") == 1.5
    assert list(net.variables) == ["coarse"]
    net["raycast"].step = 1.0
    assert net["blur"].sigma == 1.0


def test_cameras_link_like_numbers() -> None:
    net = chain()
    net.add("raycast", "other")
    net.link("raycast.camera", "camera")
    net.link("other.camera", "camera")
    net["other"].camera = Camera(eye=(0.0, -50.0, 0.0))
    assert net["raycast"].camera.eye == (0.0, -50.0, 0.0)
    net.history.do(AddVariable("second", "Camera", expression="camera"))
    assert net.get("second").eye == (0.0, -50.0, 0.0)


def test_frame_is_a_reserved_int() -> None:
    net = chain()
    net.add("fly")
    with pytest.raises(ParameterError, match="frame counts pictures and is an Int"):
        net.history.do(AddVariable("frame", "Float", 1.0))
    with pytest.raises(ParameterError, match="a Camera is no number"):
        net.link("raycast.camera", "frame")
    net.link("fly.frame", "frame")
    net.set("frame", 7)
    assert net.flatten().nodes["fly"].values["frame"] == 7
    with pytest.raises(ParameterError, match="never derived"):
        net.history.do(SetExpression("frame", "1 + 1"))
    with pytest.raises(ParameterError, match="whole number"):
        net.set("frame", 0.5)
    net.history.do(AddVariable("angle", "Float", expression="frame / 10"))
    net.link("raycast.step", "angle")
    assert net["raycast"].step == 0.7


def test_variables_are_renamed_everywhere_and_removed_with_the_value_kept() -> None:
    net = linked()
    net.history.do(AddVariable("fine", "Float", expression="coarse / 2"))
    net.link("raycast.quality_limit", "fine")
    net.history.do(RenameVariable("coarse", "rough"))
    assert net.variables["fine"].expression == "rough / 2"
    assert net.nodes["blur"].links == {"sigma": "rough"}
    with pytest.raises(CommandError, match="name of a function"):
        net.history.do(RenameVariable("rough", "sin"))
    with pytest.raises(CommandError, match=r"variables.fine is derived from it"):
        net.history.do(RemoveVariable("rough"))
    net.unlink("raycast.quality_limit")
    net.history.do(RemoveVariable("rough"))
    assert net.variables == {}
    assert net["raycast"].step == 2.0


# -- pasting ------------------------------------------------------------------------------------------------------


def test_pasting_in_the_same_document_keeps_the_variable() -> None:
    net = linked()
    copied = net.copy("blur", "raycast")
    net.set("coarse", 1.0)
    new = net.paste(copied)
    assert [handle.node.id for handle in new] == ["blur_2", "raycast_2"]
    assert new[1].inputs == {"volume": ("blur_2.smoothed",)}
    assert new[0].inputs == {}
    assert new[1].node.links == {"step": "coarse"}
    assert list(net.variables) == ["coarse"]
    assert new[1].step == 1.0


def test_pasting_elsewhere_brings_variables_and_renames_what_is_taken() -> None:
    net = linked()
    net.history.do(AddVariable("fine", "Float", expression="coarse / 2"))
    net.link("raycast.quality_limit", "fine")
    copied = net.copy("raycast")
    assert set(copied["variables"]) == {"coarse", "fine"}
    empty = Network(find)
    empty.paste(copied)
    assert dumps(empty).count("coarse") == 3
    assert empty["raycast"].quality_limit == 1.0
    same = chain()
    same.link("blur.sigma", "coarse")
    same.paste(copied)
    assert set(same.variables) == {"coarse", "fine"}
    taken = chain()
    taken.history.do(AddVariable("coarse", "Float", 9.0))
    before = dumps(taken)
    (new,) = taken.paste(copied)
    assert set(taken.variables) == {"coarse", "coarse_2", "fine"}
    assert taken.variables["fine"].expression == "coarse_2 / 2"
    assert new.step == 2.0
    taken.undo()
    assert dumps(taken) == before


def test_groups_are_copied_with_their_inside() -> None:
    net = linked()
    net.group("blur", "raycast", id="finish")
    other = Network(find)
    other.paste(net.copy("finish"))
    assert "finish/raycast" in other
    assert other["finish/raycast"].step == 2.0
    assert other.variables.keys() == {"coarse"}


def test_a_group_may_have_variables_of_its_own() -> None:
    net = loads(
        """{"nodegraph": 1, "variables": {"x": {"kind": "Float", "value": 3.0}},
        "nodes": {"g": {"type": "group",
            "nodes": {"b": {"type": "blur", "links": {"sigma": "x"}}, "c": {"type": "blur", "links": {"sigma": "y"}}},
            "variables": {"x": {"kind": "Float", "value": 1.5}, "y": {"kind": "Float", "expression": "x * 2"}}},
          "d": {"type": "blur", "links": {"sigma": "x"}}}}""",
        find=find,
    )
    assert [net["g/b"].sigma, net["g/c"].sigma, net["d"].sigma] == [1.5, 3.0, 3.0]
    net["g/b"].sigma = 2.0
    assert [net["g/b"].sigma, net["g/c"].sigma, net["d"].sigma] == [2.0, 4.0, 3.0]
    net.ungroup("g")
    assert [net["b"].sigma, net["c"].sigma, net["d"].sigma] == [2.0, 4.0, 3.0]
    assert set(net.variables) == {"x", "x_2", "y"}
    assert net.variables["y"].expression == "x_2 * 2"


def test_a_script_derives_a_variable_and_makes_it_plain_again() -> None:
    net = chain()
    net.link("blur.sigma", "fine")
    net.link("raycast.step", "coarse")
    net.derive("fine", "coarse / 2")
    net["raycast"].step = 1.0
    assert net["blur"].sigma == 0.5
    net.derive("fine", "")
    net["raycast"].step = 2.0
    assert net["blur"].sigma == 0.5
    net.undo(), net.undo()
    assert net.variables["fine"].expression == "coarse / 2"
