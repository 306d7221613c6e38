"""Ports: types, connection rule, conditions, checks of values."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph import data, ports
from nodegraph.data import Image, Labels, Volume
from nodegraph.errors import PortError
from nodegraph.ports import Condition, Input, Output, PortType

VOLUME = Volume(np.zeros((2, 3, 4), "f4"))
IMAGE = Image(np.zeros((2, 3, 4), "f4"))


class CtVolume(Volume):
    """A special volume, as a plug-in may define it."""


def test_every_value_type_has_a_record() -> None:
    small = ("Camera", "Light", "Plane", "TransferFunction", "TransferFunction2D")
    for name in ("Volume", "Labels", "Image", "Mesh", "Table", *small):
        record = ports.port_type(getattr(data, name))
        assert record.name == name
        assert record.type is getattr(data, name)
        assert record.shape in ports.SHAPES
        assert record.doc
    records = ports.port_types()
    assert len({record.name for record in records}) == len(records)
    assert len({record.color for record in records}) == len(records)


def test_a_special_type_looks_like_its_ancestor() -> None:
    assert ports.port_type(CtVolume).name == "Volume"


def test_an_unknown_type_still_has_a_record() -> None:
    class Thing:
        """Something new."""

    assert ports.port_type(Thing).name == "Thing"
    assert ports.port_type(Thing).doc == "Something new."


def test_summary_says_what_a_value_is() -> None:
    assert "4x3x2" in ports.port_type(Volume).summary(VOLUME)


def test_a_record_is_registered_once() -> None:
    class Curve:
        """Points in a row."""

    record = PortType(Curve, "Curve", "#123456", "circle", repr, "Points in a row.")
    ports.register(record)
    ports.register(record)
    assert ports.port_type(Curve) is record
    with pytest.raises(TypeError, match="has a port record already"):
        ports.register(record._replace(name="Line"))
    for bad in ({"shape": "star"}, {"color": "red"}):
        with pytest.raises(TypeError):
            ports.register(PortType(type("New", (), {}), "New", "#123456", "circle", repr, "")._replace(**bad))


def test_an_output_connects_where_it_is_a_special_case() -> None:
    assert ports.connects(Volume, Volume)
    assert ports.connects(CtVolume, Volume)
    assert not ports.connects(Volume, CtVolume)
    assert not ports.connects(Volume, Image)
    assert ports.connects(Labels, data.Grid)
    assert ports.connects(int, float)
    assert not ports.connects(float, int)


def test_wrong_type_names_both_and_the_place() -> None:
    with pytest.raises(PortError, match=r"^blur\.volume: expected a Volume, got an Image$"):
        Input(Volume, doc="v").check(IMAGE, "blur.volume")
    with pytest.raises(PortError, match=r"got a ndarray"):
        Input(Volume, doc="v").check(np.zeros((2, 2, 2)), "blur.volume")


def test_nothing_connected() -> None:
    with pytest.raises(PortError, match="nothing is connected; wire a Volume"):
        Input(Volume, doc="v").check(None, "blur.volume")
    assert Input(Volume, doc="v", required=False).check(None, "blur.volume") is None


def test_many_arrive_as_a_tuple_in_order() -> None:
    many = Input(Volume, doc="v", many=True)
    other = Volume(np.ones((1, 1, 1), "f4"))
    assert many.check([VOLUME, other], "x.volumes") == (VOLUME, other)
    assert many.check(VOLUME, "x.volumes") == (VOLUME,)
    with pytest.raises(PortError, match="wire at least one Volume"):
        many.check((), "x.volumes")
    with pytest.raises(PortError, match=r"^x\.volumes\[1\]: "):
        many.check((VOLUME, IMAGE), "x.volumes")
    assert Input(Volume, doc="v", many=True, required=False).check(None, "x.volumes") == ()


def test_conditions_say_what_is_wanted_and_what_came() -> None:
    scalar = Input(Volume, doc="v", accepts=ports.has_components(1))
    assert scalar.check(VOLUME, "x.v") is VOLUME
    with pytest.raises(PortError, match=r"^x\.v: must have 1 number per voxel; got 4x3x2 .*, 3 components"):
        scalar.check(Volume(np.zeros((2, 3, 4, 3), "f4")), "x.v")


@pytest.mark.parametrize(
    ("condition", "good", "bad"),
    [
        (ports.has_components(3, 4), Volume(np.zeros((1, 1, 1, 3), "f4")), VOLUME),
        (ports.channels(4), IMAGE, Image(np.zeros((2, 2, 2), "f4"))),
        (ports.has_depth(), Image(np.zeros((1, 1, 4), "f4"), np.zeros((1, 1), "f4")), IMAGE),
        (ports.has_ids(), Image(np.zeros((1, 1, 4), "f4"), ids=np.zeros((1, 1), "u4")), IMAGE),
        (ports.min_dims(4, 3, 2), VOLUME, Volume(np.zeros((1, 3, 4), "f4"))),
    ],
)
def test_ready_made_conditions(condition: Condition, good: data.Value, bad: data.Value) -> None:
    port = Input(type(good), doc="v", accepts=[condition])
    assert port.check(good, "x") is good
    with pytest.raises(PortError, match="must"):
        port.check(bad, "x")


def test_number_ports_take_numpy_numbers() -> None:
    value = Output(float, doc="v").check(np.float32(0.5), "x.v")
    assert value == 0.5
    assert type(value) is float
    assert type(Input(float, doc="v").check(2, "x.v")) is float
    with pytest.raises(PortError, match="expected an Integer, got a float"):
        Output(int, doc="v").check(0.5, "x.v")


def test_declarations_that_are_no_ports() -> None:
    with pytest.raises(TypeError, match="first argument is a type"):
        Input("Volume", doc="v")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="accepts="):
        Input(Volume, doc="v", accepts=[lambda v: True])  # type: ignore[list-item]
    with pytest.raises(TypeError, match="give a test and a message"):
        Condition(lambda v: True, "")


def test_describe() -> None:
    told = Input(Volume, doc="Scalar field.", required=False, many=True, accepts=ports.has_components(1)).describe()
    assert told == {
        "type": "Volume",
        "doc": "Scalar field.",
        "required": False,
        "many": True,
        "accepts": ["must have 1 number per voxel"],
    }
