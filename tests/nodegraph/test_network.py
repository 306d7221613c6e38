"""The document, its short forms for scripts, and the flat view."""

from __future__ import annotations

import time

import pytest

from nodegraph.errors import CommandError, CycleError, ParameterError, PortError, UnknownProcessor
from nodegraph.group_commands import Group, HidePort, ShowPort, Ungroup
from nodegraph.network import Network, unique
from nodegraph.workspace import dumps, loads
from tests.support.document import Blur, chain, find


def test_script_sugar_reads_and_writes_parameters() -> None:
    net = chain()
    assert net["blur"].sigma == 2.0
    net["raycast"].step = 0.5
    assert net["raycast"].step == 0.5
    assert net.nodes["raycast"].params == {"step": 0.5}
    del net["raycast"].step
    assert net["raycast"].step == 1.0
    assert net.nodes["raycast"].params == {}
    assert net["blur"].inputs == {"volume": ("ct.volume",)}
    assert [handle.node.id for handle in net] == ["ct", "blur", "raycast"]
    assert len(net) == 3
    assert "blur" in net
    assert "blurr" not in net


def test_a_node_is_named_after_its_type_and_numbered() -> None:
    net = Network(find)
    assert [net.add("blur").node.id, net.add(Blur).node.id, net.add("blur").node.id] == ["blur", "blur_2", "blur_3"]
    assert unique("camera_2", ["camera_2", "camera_3"]) == "camera_4"


@pytest.mark.parametrize(
    ("act", "kind", "says"),
    [
        (lambda net: net["blurr"], CommandError, "blurr: no such node (did you mean 'blur'?)"),
        (lambda net: net["blur"].sigmaa, ParameterError, "blur.sigmaa: no such parameter (did you mean 'sigma'?)"),
        (lambda net: net.set("blur.sigma", -1.0), ParameterError, "blur.sigma: -1.0 mm is outside 0.0..10.0 mm"),
        (lambda net: net.set("blur.volume", 1), ParameterError, "blur.volume: no such parameter; it is an input"),
        (lambda net: net.add("blurr"), UnknownProcessor, "did you mean 'blur'?"),
        (lambda net: net.add("blur", "2x"), CommandError, "'2x': an id has letters"),
        (lambda net: net.add("blur", "blur"), CommandError, "blur: this name is taken"),
        (lambda net: net.add("blur", "other", sigm=1), ParameterError, "other.sigm: no such parameter (did you mean"),
        (lambda net: net.connect("ct.volum", "raycast.labels"), PortError, "ct has no output 'volum' (did you mean"),
        (lambda net: net.connect("ct.picture", "raycast.labels"), PortError, "'picture' (there is volume)"),
        (lambda net: net.connect("ct.volume", "raycast.label"), PortError, "no input or parameter 'label' (did you"),
        (lambda net: net.connect("ctt.volume", "raycast.labels"), CommandError, "ctt: no such node"),
        (
            lambda net: net.connect("raycast.image", "raycast.labels"),
            PortError,
            "takes Volume, but raycast.image gives",
        ),
        (
            lambda net: net.connect("ct.volume", "raycast.volume"),
            PortError,
            "wired to blur.smoothed already; disconnect",
        ),
        (lambda net: net.disconnect("ct.path"), PortError, "ct.path: nothing is connected here"),
        (lambda net: net.connect("ct", "raycast.labels"), CommandError, "'ct': expected node.output"),
    ],
)
def test_what_makes_no_sense_is_refused_with_the_place_and_the_near_miss(act, kind, says) -> None:  # type: ignore[no-untyped-def]
    net = chain()
    before = dumps(net)
    with pytest.raises(kind) as caught:
        act(net)
    assert says in str(caught.value)
    assert dumps(net) == before


def test_a_cycle_is_refused_with_its_path() -> None:
    net = Network(find)
    for id in "abc":
        net.add("blur", id)
    net.connect("a.smoothed", "b.volume")
    net.connect("b.smoothed", "c.volume")
    with pytest.raises(CycleError) as caught:
        net.connect("c.smoothed", "a.volume")
    assert caught.value.path == ("a", "b", "c", "a")
    with pytest.raises(CycleError):
        net.connect("a.smoothed", "a.volume")


def test_a_muted_node_closes_a_cycle_too() -> None:
    net = Network(find)
    net.add("blur", "a")
    net.add("blur", "b")
    net.connect("a.smoothed", "b.volume")
    net.mute("b")
    with pytest.raises(CycleError):
        net.connect("b.smoothed", "a.volume")


def test_editors_may_replace_a_wire_in_one_step() -> None:
    net = chain()
    net.connect("ct.volume", "raycast.volume", replace=True)
    assert net["raycast"].inputs == {"volume": ("ct.volume",)}
    net.undo()
    assert net["raycast"].inputs == {"volume": ("blur.smoothed",)}


def test_an_input_of_many_keeps_wire_order() -> None:
    net = chain()
    net.add("raycast", "other")
    net.add("compose")
    net.connect("raycast.image", "compose.images")
    net.connect("other.image", "compose.images")
    net.connect("raycast.depth", "compose.images")
    assert net.flatten().nodes["compose"].sources["images"] == (
        ("raycast", "image"),
        ("other", "image"),
        ("raycast", "depth"),
    )
    net.disconnect("compose.images", "other.image")
    assert net["compose"].inputs["images"] == ("raycast.image", "raycast.depth")
    with pytest.raises(PortError, match=r"wired to raycast.image already"):
        net.connect("raycast.image", "compose.images")


def test_a_wire_beats_a_link_beats_the_stored_value() -> None:
    net = chain()
    net.add("fly")
    net["raycast"].step = 0.5
    assert net.flatten().nodes["raycast"].values["step"] == 0.5
    net.link("raycast.step", "step")
    net.set("step", 0.25)
    assert net.flatten().nodes["raycast"].values["step"] == 0.25
    net.connect("fly.amount", "raycast.step")
    flat = net.flatten().nodes["raycast"]
    assert "step" not in flat.values
    assert flat.wired == {"step": ("fly", "amount")}
    with pytest.raises(ParameterError, match=r"raycast.step: follows the wire from fly.amount; disconnect it first"):
        net["raycast"].step = 1.0
    with pytest.raises(PortError, match="takes Camera"):
        net.connect("fly.amount", "raycast.camera")
    net.connect("fly.camera", "raycast.camera")
    assert net.flatten().nodes["raycast"].wired["camera"] == ("fly", "camera")


# -- the flat view ------------------------------------------------------------------------------------------------


def test_flat_nodes_stand_after_their_sources() -> None:
    net = Network(find)
    net.add("raycast", "last")
    net.add("blur", "middle")
    net.add("source", "first")
    net.connect("first.volume", "middle.volume")
    net.connect("middle.smoothed", "last.volume")
    flat = net.flatten()
    assert list(flat.nodes) == ["first", "middle", "last"]
    assert flat.nodes["last"].sources == {"volume": (("middle", "smoothed"),), "labels": ()}


def test_invisible_parameters_are_left_out_and_defaults_are_there() -> None:
    net = chain()
    net["raycast"].shininess = 20.0
    assert "shininess" not in net.flatten().nodes["raycast"].values
    net["raycast"].lit = True
    assert net.flatten().params_of("raycast")["shininess"] == 20.0
    assert net.flatten().params_of("raycast")["step"] == 1.0


def test_a_half_wired_node_is_blocked_with_the_cure() -> None:
    net = chain()
    net.disconnect("blur.volume")
    assert net.flatten().nodes["blur"].blocked == "blur.volume: nothing is connected; wire a Volume to it"
    assert net.flatten().nodes["raycast"].blocked == ""


def test_a_muted_node_passes_its_first_input_of_the_type_through() -> None:
    net = chain()
    net.mute("blur")
    flat = net.flatten()
    assert list(flat.nodes) == ["ct", "raycast"]
    assert flat.nodes["raycast"].sources["volume"] == (("ct", "volume"),)
    assert flat.source("blur.smoothed") == ("ct", "volume")
    assert flat.muted == {"blur"}
    net.mute("ct")
    blocked = net.flatten().nodes["raycast"].blocked
    assert blocked == "raycast.volume: ct is muted and has no input that could stand for 'volume'; unmute it"
    net.mute("ct", False)
    net.disconnect("blur.volume")
    assert "its input 'volume' is not wired" in net.flatten().nodes["raycast"].blocked


def test_an_optional_input_that_is_wired_to_nothing_but_muted_nodes_is_unwired() -> None:
    net = chain()
    net.add("source", "mask")
    net.connect("mask.volume", "raycast.labels")
    net.mute("mask")
    flat = net.flatten()
    assert flat.nodes["raycast"].blocked == ""
    assert flat.nodes["raycast"].sources["labels"] == ()
    net.mute("mask", False)
    assert net.flatten().nodes["raycast"].sources["labels"] == (("mask", "volume"),)


def test_unknown_processors_ports_and_nodes_block_with_the_reason() -> None:
    net = loads(
        """{"nodegraph": 1, "nodes": {
            "a": {"type": "filter.gone", "version": 7, "params": {"x": [1, 2]}},
            "b": {"type": "blur", "inputs": {"volume": "a.out", "mask": "a.out"}},
            "c": {"type": "blur", "inputs": {"volume": "aa.out"}},
            "d": {"type": "blur", "inputs": {"volume": "c.smoothd"}},
            "e": {"type": "blur", "params": {"sgma": 1}, "inputs": {"volume": "c.smoothed"}},
            "f": {"type": "blur", "params": {"sigma": 99}, "inputs": {"volume": "c.smoothed"}}}}""",
        find=find,
    )
    nodes = net.flatten().nodes
    assert nodes["a"].blocked.startswith("a: filter.gone: no such processor")
    assert isinstance(nodes["a"].problem, UnknownProcessor)
    assert nodes["a"].processor is None
    assert nodes["b"].blocked == "b.mask: no such input or parameter; disconnect it"
    assert nodes["b"].sources["volume"] == (("a", "out"),)
    assert nodes["c"].blocked == "c.volume: there is no node aa (did you mean 'a'?)"
    assert nodes["d"].blocked == "d.volume: c has no output 'smoothd' (did you mean 'smoothed'?)"
    assert nodes["e"].blocked == "e.sgma: no such parameter (did you mean 'sigma'?); remove it"
    assert nodes["f"].blocked == "f.sigma: 99.0 mm is outside 0.0..10.0 mm"
    net["f"].sigma = 3.0
    assert net.flatten().nodes["f"].blocked == ""
    del net["e"].sgma
    assert net.flatten().nodes["e"].blocked == ""


def test_cycles_of_a_file_are_kept_and_blocked() -> None:
    text = """{"nodegraph": 1, "nodes": {
        "a": {"type": "blur", "inputs": {"volume": "c.smoothed"}},
        "b": {"type": "blur", "inputs": {"volume": "a.smoothed"}},
        "c": {"type": "blur", "inputs": {"volume": "b.smoothed"}},
        "d": {"type": "blur", "inputs": {"volume": "c.smoothed"}},
        "s": {"type": "blur", "inputs": {"volume": "s.smoothed"}},
        "m": {"type": "blur", "inputs": {"volume": "m.smoothed"}, "muted": true},
        "r": {"type": "blur", "inputs": {"volume": "m.smoothed"}}}}"""
    net = loads(text, find=find)
    flat = net.flatten()
    for id in "abc":
        assert "this connection would close a cycle" in flat.nodes[id].blocked
        assert flat.nodes[id].sources == {"volume": ()}
    assert isinstance(flat.nodes["a"].problem, CycleError)
    assert flat.nodes["d"].problem is None
    assert flat.nodes["s"].blocked.startswith("s -> s:")
    assert "cycle" in flat.nodes["r"].blocked
    assert '"volume": "c.smoothed"' in dumps(net)


def test_the_snapshot_does_not_change_and_only_what_changed_is_made_anew() -> None:
    net = chain()
    before = net.flatten()
    assert net.flatten() is before
    net["raycast"].step = 0.5
    after = net.flatten()
    assert before.nodes["raycast"].values["step"] == 1.0
    assert after.nodes["raycast"].values["step"] == 0.5
    assert after.nodes["ct"] is before.nodes["ct"]
    assert after.structure == before.structure
    assert after.nodes["raycast"].revision > before.nodes["raycast"].revision
    net.undo()
    assert net.flatten().nodes["raycast"].revision > after.nodes["raycast"].revision
    net.add("fly")
    assert net.flatten().structure != after.structure
    assert net.flatten().nodes["blur"] is before.nodes["blur"]


def test_replanning_500_nodes_after_one_change_is_quick() -> None:
    net = Network(find)
    net.add("source", "n0")
    for i in range(1, 500):
        net.add("blur", f"n{i}")
        net.connect(f"n{i - 1}.{'smoothed' if i > 1 else 'volume'}", f"n{i}.volume")
    net.flatten()
    spent = []
    for i in range(20):
        start = time.perf_counter()
        net["n250"].sigma = 1.0 + i / 10
        net.flatten()
        spent.append(time.perf_counter() - start)
    assert min(spent) < 0.0025


def test_long_chains_do_not_meet_the_recursion_limit() -> None:
    net = Network(find)
    net.add("source", "n0")
    for i in range(1, 3000):
        net.nodes[f"n{i}"] = type(net.nodes["n0"])(f"n{i}", "blur", Blur, parent=net)
        net.nodes[f"n{i}"].inputs["volume"] = (f"n{i - 1}.{'smoothed' if i > 1 else 'volume'}",)
        net.nodes[f"n{i}"].muted = 1000 < i < 2900
    net.note((), structure=True)
    flat = net.flatten()
    assert flat.nodes["n2900"].sources["volume"] == (("n1000", "smoothed"),)


# -- groups -------------------------------------------------------------------------------------------------------


def grouped() -> Network:
    net = chain()
    net.group("blur", "raycast", id="finish")
    return net


def test_grouping_keeps_what_is_computed() -> None:
    net = grouped()
    assert list(net.nodes) == ["ct", "finish"]
    flat = net.flatten()
    assert list(flat.nodes) == ["ct", "finish/blur", "finish/raycast"]
    assert flat.nodes["finish/blur"].sources["volume"] == (("ct", "volume"),)
    assert flat.nodes["finish/raycast"].sources["volume"] == (("finish/blur", "smoothed"),)
    assert net["finish/blur"].sigma == 2.0
    net["finish/raycast"].step = 0.5
    assert net.flatten().nodes["finish/raycast"].values["step"] == 0.5


def test_ungrouping_restores_the_document() -> None:
    before = dumps(chain())
    net = grouped()
    net.ungroup("finish")
    assert dumps(net) == before
    net.undo()
    net.undo()
    assert dumps(net) == before


def test_a_face_shares_a_name_for_inputs_that_read_the_same_source() -> None:
    net = chain()
    net.connect("ct.volume", "raycast.labels")
    net.add("compose")
    net.connect("raycast.image", "compose.images")
    net.group("blur", "raycast", id="finish")
    face = net.nodes["finish"].expose
    assert face.inputs == {"volume": ("blur.volume", "raycast.labels")}
    assert face.outputs == {"image": "raycast.image"}
    assert net["compose"].inputs == {"images": ("finish.image",)}
    assert net.flatten().nodes["compose"].sources["images"] == (("finish/raycast", "image"),)
    assert net.flatten().source("finish.image") == ("finish/raycast", "image")


def test_shown_parameters_are_set_linked_and_wired_through_the_face() -> None:
    net = grouped()
    net.add("fly")
    net.history.do(ShowPort("finish", "params", "step", "raycast.step"))
    net["finish"].step = 0.5
    assert net["finish/raycast"].step == 0.5
    net.link("finish.step", "coarse")
    net.set("coarse", 0.75)
    assert net.flatten().nodes["finish/raycast"].values["step"] == 0.75
    net["finish/raycast"].step = 0.8
    assert net.get("coarse") == 0.8
    net.connect("fly.amount", "finish.step")
    assert net.flatten().nodes["finish/raycast"].wired == {"step": ("fly", "amount")}
    net.history.do(HidePort("finish", "params", "step"))
    assert net.variables == {}
    assert net.nodes["finish"].inputs == {"volume": ("ct.volume",)}
    assert net.flatten().nodes["finish/raycast"].values["step"] == 0.8


def test_a_muted_group_passes_through() -> None:
    net = chain()
    net.add("blur", "more")
    net.connect("blur.smoothed", "more.volume")
    net.connect("more.smoothed", "raycast.volume", replace=True)
    net.group("blur", "more", id="smooth")
    net.mute("smooth")
    flat = net.flatten()
    assert list(flat.nodes) == ["ct", "raycast"]
    assert flat.nodes["raycast"].sources["volume"] == (("ct", "volume"),)


def test_groups_nest_and_dissolve() -> None:
    net = grouped()
    before = dumps(net)
    net.history.do(Group(["finish/raycast"], "inner"))
    assert "finish/inner/raycast" in net
    assert net.flatten().nodes["finish/inner/raycast"].sources["volume"] == (("finish/blur", "smoothed"),)
    net.history.do(ShowPort("finish/inner", "outputs", "image", "raycast.image"))
    net.history.do(ShowPort("finish", "outputs", "image", "inner.image"))
    net.add("compose")
    net.connect("finish.image", "compose.images")
    assert net.flatten().nodes["compose"].sources["images"] == (("finish/inner/raycast", "image"),)
    net.history.do(Ungroup("finish/inner"))
    assert net.flatten().nodes["compose"].sources["images"] == (("finish/raycast", "image"),)
    net.remove("finish/raycast")
    assert net["compose"].inputs == {}
    while net.history.undo_name != "group":
        net.undo()
    net.undo()
    assert dumps(net) == before


def test_wires_stay_on_their_level() -> None:
    net = grouped()
    with pytest.raises(PortError, match="lies on another level"):
        net.connect("ct.volume", "finish/raycast.labels")


def test_mixed_wires_that_a_group_cannot_keep_in_order_are_refused() -> None:
    net = chain()
    net.add("raycast", "other")
    net.add("compose")
    net.connect("other.image", "compose.images")
    net.connect("raycast.image", "compose.images")
    with pytest.raises(CommandError, match="cannot keep the order"):
        net.group("raycast", "compose")


def test_a_cycle_through_a_group_is_seen() -> None:
    net = chain()
    net.add("blur", "more")
    net.connect("blur.smoothed", "more.volume")
    net.group("blur", "more", id="pair")
    net.add("compose")
    net.history.do(ShowPort("pair", "outputs", "out", "more.smoothed"))
    net.disconnect("pair.volume")
    with pytest.raises(CycleError) as caught:
        net.connect("pair.out", "pair.volume")
    assert caught.value.path == ("pair/blur", "pair/more", "pair/blur")
