"""Parameter kinds: what they accept, what they refuse and how they say it, and their JSON form."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

from nodegraph import data, params
from nodegraph.errors import ParameterError
from nodegraph.params import Parameter

DOC = "What it is."

CAMERA = data.Camera(eye=(1.0, 2.0, 3.0), field_of_view=25.0)
LIGHT = data.Light(position=(1.0, 0.0, 0.0), intensity=0.5)
PLANE = data.Plane((1.0, 2.0, 3.0), (0.0, 1.0, 0.0))
TABLE = data.TransferFunction([(0.0, (1.0, 0.0, 0.0), 0.0), (10.0, (1.0, 1.0, 1.0), 0.9)])

AREAS = data.TransferFunction2D(
    [
        data.Trapezoid((20.0, 40.0), (25.0, 30.0), (0.0, 15.0), 0.2, (1.0, 0.5, 0.0), 0.5),
        data.Gaussian((60.0, 10.0), (10.0, 3.0), (0.0, 0.5, 1.0), 0.25),
    ],
    2.5,
)

# One line per kind: a declaration, values with their normal form, values that are refused.
KINDS: list[tuple[Parameter, list[tuple[Any, Any]], list[Any]]] = [
    (
        params.Float(1.0, min=0.0, max=4.0, doc=DOC),
        [(2, 2.0), (np.float32(0.5), 0.5), (np.int8(3), 3.0), (0.0, 0.0), (4.0, 4.0)],
        [-0.1, 4.1, math.nan, math.inf, True, np.True_, "1", None, [1.0], np.ones(1)],
    ),
    (
        params.Float(math.inf, finite=False, nan=True, doc=DOC),
        [("inf", math.inf), (-math.inf, -math.inf), ("-inf", -math.inf)],
        ["infinite", None],
    ),
    (
        params.Int(3, min=-1, max=10, doc=DOC),
        [(4.0, 4), (np.uint8(7), 7), (-1, -1)],
        [1.5, 11, -2, True, "4", math.nan, math.inf],
    ),
    (params.Int(0, doc=DOC), [(2**60 + 1, 2**60 + 1)], [0.5]),
    (params.Seed(doc=DOC), [(2**32 - 1, 2**32 - 1)], [-1, 2**32, 0.5]),
    (params.Bool(True, doc=DOC), [(False, False), (np.True_, True)], [0, 1, "true", None]),
    (params.Choice("linear", "nearest", doc=DOC), [("nearest", "nearest")], ["cubic", "", None, 0]),
    (params.Text("a", doc=DOC), [("", ""), ("é", "é")], [1, None, "two\nlines"]),
    (params.Text("a\nb", multiline=True, doc=DOC), [("x\ny", "x\ny")], [b"x"]),
    (params.File(suffixes=(".nii",), doc=DOC), [(Path("a/b.nii"), str(Path("a/b.nii"))), ("", "")], [3, "a\0b", None]),
    (params.Folder(doc=DOC), [(Path("a"), "a")], [None]),
    (
        params.Color((1.0, 0.5, 0.0), doc=DOC),
        [([0, 0, 0], (0.0, 0.0, 0.0)), ("#ff0000", (1.0, 0.0, 0.0)), (np.zeros(3), (0.0, 0.0, 0.0))],
        [(1.0, 1.0), (2.0, 0.0, 0.0), "red", "#ff00", (1.0, math.nan, 0.0), 1.0],
    ),
    (
        params.Color((1.0, 1.0, 1.0, 0.5), doc=DOC),
        [((0, 0, 0), (0.0, 0.0, 0.0, 1.0)), ("#00000000", (0.0, 0.0, 0.0, 0.0))],
        [(1.0,) * 5],
    ),
    (
        params.Vector((0.0, 0.0, 1.0), min=-1.0, max=1.0, doc=DOC),
        [(np.array([1, 0, 0]), (1.0, 0.0, 0.0)), ([0, 0.5, 0], (0.0, 0.5, 0.0))],
        [(1.0, 0.0), "abc", (0.0, 0.0, 2.0), (0.0, 0.0, True), 1.0],
    ),
    (params.Vector((8, 8), integer=True, min=1, doc=DOC), [((4.0, 2), (4, 2))], [(1.5, 2), (0, 2)]),
    (
        params.Matrix(doc=DOC),
        [(np.eye(4) * 2, tuple(tuple(row) for row in (np.eye(4) * 2).tolist()))],
        [np.eye(3), [[1.0] * 4] * 3, np.full((4, 4), np.nan), "identity", None],
    ),
    (
        params.Interval((0.0, 1.0), max=5.0, doc=DOC),
        [([1, 1], (1.0, 1.0)), ((-3.0, 5.0), (-3.0, 5.0))],
        [(2.0, 1.0), (0.0, 6.0), (0.0,), 1.0, None],
    ),
    (
        params.Box(doc=DOC),
        [(None, None), ([[0, 0, 0], [1, 2, 3]], ((0.0, 0.0, 0.0), (1.0, 2.0, 3.0)))],
        [((1, 0, 0), (0, 0, 0)), ((0, 0), (1, 1)), "all", ((0, 0, 0), (math.inf, 0, 0))],
    ),
    (params.Camera(doc=DOC), [(CAMERA, CAMERA)], [None, {}, LIGHT]),
    (params.Light(doc=DOC), [(LIGHT, LIGHT)], [None, 1]),
    (params.Plane(doc=DOC), [(PLANE, PLANE)], [None]),
    (params.Plane(optional=True, doc=DOC), [(None, None), (PLANE, PLANE)], [0]),
    (params.TransferFunction(doc=DOC), [(TABLE, TABLE)], [None, "red"]),
    (params.TransferFunction2D(doc=DOC), [(AREAS, AREAS)], [None, "red", TABLE]),
]
NAMES = [f"{parameter.kind}{number}" for number, (parameter, _, _) in enumerate(KINDS)]


@pytest.mark.parametrize(("parameter", "good", "bad"), KINDS, ids=NAMES)
class TestEveryKind:
    def test_normal_form(self, parameter: Parameter, good: list[tuple[Any, Any]], bad: list[Any]) -> None:
        for given, normal in good:
            checked = parameter.check(given, "node.name")
            assert checked == normal
            assert type(checked) is type(normal)
            assert parameter.check(checked, "node.name") == checked

    def test_refusal_begins_with_the_place(
        self, parameter: Parameter, good: list[tuple[Any, Any]], bad: list[Any]
    ) -> None:
        for given in bad:
            with pytest.raises(ParameterError) as raised:
                parameter.check(given, "group/node.name")
            assert str(raised.value).startswith("group/node.name")
            assert "\n" not in str(raised.value)

    def test_json_round_trip(self, parameter: Parameter, good: list[tuple[Any, Any]], bad: list[Any]) -> None:
        for _, normal in [*good, (None, parameter.default)]:
            text = json.dumps(parameter.encode(normal), allow_nan=False)
            assert parameter.decode(json.loads(text), "node.name") == normal

    def test_schema_accepts_what_encode_writes(
        self, parameter: Parameter, good: list[tuple[Any, Any]], bad: list[Any]
    ) -> None:
        schema = parameter.schema()
        jsonschema.Draft202012Validator.check_schema(schema)
        for _, normal in good:
            jsonschema.validate(json.loads(json.dumps(parameter.encode(normal))), schema)

    def test_describe_is_json_and_names_the_kind(
        self, parameter: Parameter, good: list[tuple[Any, Any]], bad: list[Any]
    ) -> None:
        told = json.loads(json.dumps(parameter.describe(), allow_nan=False))
        assert told["kind"] == type(parameter).__name__
        assert told["doc"] == DOC
        assert parameter.decode(told["default"], "x") == parameter.default


def test_every_kind_is_in_the_table() -> None:
    assert {parameter.kind for parameter, _, _ in KINDS} == set(params.kinds())


def test_message_names_value_unit_and_range() -> None:
    step = params.Float(1.0, min=0.05, max=4.0, unit="voxel", doc=DOC)
    with pytest.raises(ParameterError, match=r"^render/raycast\.step: 9\.0 voxel is outside 0\.05\.\.4\.0 voxel$"):
        step.check(9, "render/raycast.step")
    with pytest.raises(ParameterError, match=r"^a\.b: -1\.0 mm is below 0\.0 mm$"):
        params.Float(1.0, min=0.0, unit="mm", doc=DOC).check(-1, "a.b")
    with pytest.raises(ParameterError, match=r"^a\.b: 3 is above 2$"):
        params.Int(1, max=2, doc=DOC).check(3, "a.b")


def test_choice_names_the_near_miss() -> None:
    with pytest.raises(ParameterError, match="did you mean 'composite'"):
        params.Choice("composite", "maximum", doc=DOC).check("compsite", "a.b")


def test_infinity_and_nan_are_text_in_json() -> None:
    anything = params.Float(0.0, finite=False, nan=True, doc=DOC)
    assert anything.encode(math.inf) == "inf"
    assert anything.encode(-math.inf) == "-inf"
    assert math.isnan(anything.decode(anything.encode(math.nan), "x"))
    assert params.Interval((-math.inf, 1.0), finite=False, doc=DOC).encode((-math.inf, 1.0)) == ["-inf", 1.0]


def test_hex_colours_are_srgb_and_become_linear() -> None:
    color = params.Color("#808080", doc=DOC)
    assert color.default == pytest.approx((0.21586, 0.21586, 0.21586), abs=1e-5)  # IEC 61966-2-1 of 128/255


def test_soft_ends_do_not_limit() -> None:
    sigma = params.Float(1.0, min=0.0, soft_max=10.0, doc=DOC)
    assert sigma.check(50.0, "x") == 50.0
    assert (sigma.soft_min, sigma.soft_max) == (0.0, 10.0)


@pytest.mark.parametrize(
    "make",
    [
        lambda: params.Float(1.0, min=2.0, max=1.0, doc=DOC),
        lambda: params.Float(1.0, min=0.0, soft_min=-1.0, doc=DOC),
        lambda: params.Choice("one", doc=DOC),
        lambda: params.Choice("one", "one", doc=DOC),
        lambda: params.Vector((1.0,), doc=DOC),
        lambda: params.Color((1.0, 1.0), doc=DOC),
        lambda: params.Interval((1.0, 2.0, 3.0), doc=DOC),
        lambda: params.File(suffixes=("nii",), doc=DOC),
        lambda: params.Float(1.0, quality="better", doc=DOC),
        lambda: params.Bool(True, quality="lower", doc=DOC),
        lambda: params.Choice("a", "b", quality=("a", "c"), doc=DOC),
        lambda: params.Text(quality="lower", doc=DOC),
        lambda: params.Float(1.0, quality="lower", reference=(0.1, 0.2), doc=DOC),
        lambda: params.Int(1, quality="higher", reference=(5, 3), doc=DOC),
        lambda: params.Float(1.0, reference=(0.1, 0.3, 0.2), doc=DOC),
        lambda: params.Choice("a", "b", quality=("a", "b"), reference=("b", "a"), doc=DOC),
        lambda: params.Bool(True, quality="on", reference=(), doc=DOC),
        lambda: params.Vector((1.0, 2.0), reference=(1.0, 2.0), doc=DOC),
        lambda: params.Text(reference="x", doc=DOC),
        lambda: params.Float(1.0, handle="grip", doc=DOC),
        lambda: params.Float(1.0, visible_if={}, doc=DOC),
        lambda: params.Float(1.0, visible_if="lit", doc=DOC),  # type: ignore[arg-type]
    ],
)
def test_senseless_declarations_are_refused(make: Any) -> None:
    with pytest.raises(TypeError):
        make()


def test_a_default_outside_its_range_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"default of Float: 5\.0 is outside"):
        params.Float(5.0, min=0.0, max=1.0, doc=DOC)


def test_quality_directions() -> None:
    assert params.Float(1.0, quality="lower", doc=DOC).describe()["quality"] == "lower"
    assert params.Bool(True, quality="off", doc=DOC).describe()["quality"] == "off"
    assert params.Choice("a", "b", quality=("b", "a"), doc=DOC).describe()["quality"] == ["b", "a"]


def test_a_reference_is_one_value_or_a_walk_towards_accuracy() -> None:
    assert params.Float(0.9, quality="higher", reference=1.0, doc=DOC).reference == (1.0,)
    order = params.Int(2, min=1, quality="higher", reference=(3, 5, 8), doc=DOC)
    assert order.reference == (3, 5, 8)
    assert order.describe()["reference"] == [3, 5, 8]
    rule = params.Choice("slow", "fast", quality=("fast", "slow"), reference="slow", doc=DOC)
    assert rule.reference == ("slow",)
    assert params.Bool(True, quality="off", reference=False, doc=DOC).describe()["reference"] == [False]
    assert params.Float(1.0, doc=DOC).reference == ()
    assert "reference" not in params.Float(1.0, doc=DOC).describe()


def test_a_reference_outside_the_limits_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"reference of Int: 9 is outside 1\.\.8"):
        params.Int(2, min=1, max=8, reference=(3, 9), doc=DOC)


def test_values_point_into_their_json() -> None:
    with pytest.raises(ParameterError, match=r"^raycast\.camera"):
        params.Camera(doc=DOC).decode({"eye": "here"}, "raycast.camera")
    with pytest.raises(ParameterError, match=r"^raycast\.camera: expected an object"):
        params.Camera(doc=DOC).decode([1, 2], "raycast.camera")


def test_handles_follow_the_kind() -> None:
    assert params.Camera(doc=DOC).handle == "camera"
    assert params.Light(doc=DOC).handle == "light"
    assert params.Float(1.0, handle="wheel", doc=DOC).handle == "wheel"


def test_kinds_by_name() -> None:
    assert params.kind("Float") is params.Float
    with pytest.raises(ParameterError, match="did you mean 'Float'"):
        params.kind("Flaot")


@pytest.mark.parametrize(
    ("kind", "value", "other"),
    [
        ("Float", math.inf, -1e30),
        ("Int", -5, 10**12),
        ("Choice", "composite", "anything"),
        ("Color", (2.0, 0.0, 0.0), (0.0, 9.0, 0.0)),
        ("Vector", (1.0, 2.0), (-5.0, 0.5)),
        ("Camera", CAMERA, data.Camera()),
        ("Box", None, ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))),
        ("Seed", 3, 2**32 - 1),
    ],
)
def test_stand_in_has_the_widest_limits(kind: str, value: Any, other: Any) -> None:
    parameter = params.stand_in(kind, value)
    assert parameter.default == value
    assert parameter.check(other, "variables.x") == other
    assert parameter.decode(json.loads(json.dumps(parameter.encode(value))), "variables.x") == value


def test_a_declaration_in_the_place_of_a_value_is_told() -> None:
    with pytest.raises(TypeError, match=r"has no 'eye'; the value is made by nodegraph\.data\.Camera"):
        params.Camera(eye=(0, 0, 0))
    with pytest.raises(ParameterError, match=r"r\.camera: got a declaration; .* nodegraph\.data\.Camera"):
        params.Camera(doc=DOC).check(params.Camera(doc=DOC), "r.camera")
