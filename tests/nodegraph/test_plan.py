"""A planner that remembers must answer as one that does not."""

from __future__ import annotations

import contextlib

from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph import Bool, Float, Input, Output, Processor
from nodegraph.data import Image
from nodegraph.errors import GraphError
from nodegraph.network import Network
from nodegraph.plan import Planner, default_sinks
from nodegraph.requests import DEFAULT_SIZE, Request, sink_size


class Source(Processor):
    """A number."""

    out = Output(float, doc="The number.")
    number = Float(1.0, doc="The number.")

    def process(self, number):
        return number


class Mix(Processor):
    """Reads one or the other, and a parameter that means something only sometimes."""

    first = Input(float, required=False, doc="A number.")
    second = Input(float, required=False, doc="A number.")
    out = Output(float, doc="A number.")
    use_first = Bool(True, doc="Which is read.")
    gain = Float(1.0, doc="A factor.", visible_if={"use_first": True})

    def needs(self, size, quality, wanted, params):
        return {"second" if params["use_first"] else "first": None}

    def process(self, first, second, use_first, gain):
        return (first if use_first else second) or 0.0


class Sized(Processor):
    """Depends on the size that is asked for."""

    value = Input(float, required=False, doc="A number.")
    out = Output(float, doc="A number.")
    image = Output(Image, doc="Never made.")

    def process(self, value, *, size, wanted):
        return self.Outputs(out=float(size[0]))


class Lit(Processor):
    """A parameter that means something only sometimes; no ``needs``."""

    value = Input(float, required=False, doc="A number.")
    out = Output(float, doc="A number.")
    lit = Bool(True, doc="Whether the gain counts.")
    gain = Float(1.0, doc="A factor.", visible_if={"lit": True})

    def process(self, value, lit, gain):
        return gain


NAMES = {"source0": Source, "source1": Source, "mix0": Mix, "mix1": Mix, "lit0": Lit, "sized0": Sized}


def network_of_all() -> Network:
    """A network in which every edit below matters to ``sized0``."""
    network = Network()
    for name, kind in NAMES.items():
        network.add(kind, name)
    for source, target in (
        ("source0", "mix0.first"), ("source1", "mix0.second"), ("mix0", "mix1.first"), ("source1", "mix1.second"),
        ("mix1", "lit0.value"), ("source0", "lit0.gain"), ("source1", "mix1.gain"), ("lit0", "sized0.value"),
    ):  # fmt: skip
        network.connect(f"{source}.out", target)
    return network


names = st.sampled_from(list(NAMES))
mixes = st.sampled_from(["mix0", "mix1"])
numbers = st.sampled_from([1.0, 2.0])
edits = st.one_of(
    st.tuples(st.just("connect"), names, mixes, st.sampled_from(["first", "second", "gain"])),
    st.tuples(st.just("connect"), names, st.sampled_from(["lit0", "sized0"]), st.just("value")),
    st.tuples(st.just("disconnect"), mixes, st.sampled_from(["first", "second", "gain"])),
    st.tuples(st.just("disconnect"), st.sampled_from(["lit0", "sized0"]), st.sampled_from(["value", "gain"])),
    st.tuples(st.just("number"), st.sampled_from(["source0", "source1"]), numbers),
    st.tuples(st.just("gain"), mixes, numbers),
    st.tuples(st.just("use_first"), mixes, st.booleans()),
    st.tuples(st.just("lit"), st.just("lit0"), st.booleans()),
    st.tuples(st.just("mute"), names, st.booleans()),
    st.tuples(st.just("remove"), names),
    st.tuples(st.just("undo"), names),
    st.tuples(st.just("plan"), st.lists(names, min_size=1, max_size=3), st.sampled_from([None, (8, 8), (16, 8)])),
)


def apply(network: Network, edit) -> None:
    """Make an edit; one that is refused changes nothing."""
    kind, node, *rest = edit
    if kind == "connect":
        network.connect(f"{node}.out", f"{rest[0]}.{rest[1]}", replace=True)
    elif kind == "disconnect":
        network.disconnect(f"{node}.{rest[0]}")
    elif kind == "mute":
        network.mute(node, rest[0])
    elif kind == "remove":
        network.remove(node)
    elif kind == "undo":
        network.undo()
    else:
        network.set(f"{node}.{kind}", rest[0])


def facts(planner: Planner, network: Network, sinks, size):
    """All of a plan that running and explaining look at, or the refusal."""
    try:
        plan = planner.plan(network.flatten(), sinks, size=size)
    except GraphError as error:
        return str(error)
    told = []
    for task in plan.tasks:
        told.append((task.path, task.request, task.wanted, dict(task.feeds), task.fingerprint, task.reason))
        told.append((str(task.problem), task.stable, task.services))
    return plan.sinks, told


@settings(max_examples=40, deadline=None)
@given(st.lists(edits, min_size=5, max_size=25))
def test_plans_after_any_edits_are_those_of_a_fresh_planner(all_edits):
    network, planner = network_of_all(), Planner()
    for edit in [*all_edits, ("plan", ["mix0", "lit0"], None)]:
        if edit[0] == "plan":
            _, sinks, size = edit
            assert facts(planner, network, sinks, size) == facts(Planner(), network, sinks, size)
        else:
            with contextlib.suppress(Exception):
                apply(network, edit)
            for sinks in (["sized0"], ["lit0", "mix0"]):
                assert facts(planner, network, sinks, (8, 8)) == facts(Planner(), network, sinks, (8, 8))


def test_every_task_stands_after_its_feeds():
    network = network_of_all()
    plan = Planner().plan(network.flatten(), ["sized0.out"], size=(8, 4))
    for place, task in enumerate(plan.tasks):
        assert all(source < place for feeds in task.feeds.values() for source, _ in feeds or ())
    last = plan.tasks[-1]
    assert (last.path, last.request, last.wanted, last.reason) == ("sized0", Request((8, 4)), {"out"}, "sink")
    assert plan.sinks == {"sized0.out": ((len(plan.tasks) - 1, "out"),)}


def test_the_size_of_a_sink_is_the_callers_or_its_own_or_1024():
    network = network_of_all()
    network.add("output.view", "view", width=30, height=20)
    flat = network.flatten()
    assert sink_size(flat, "view") == (30, 20)
    assert sink_size(flat, "view.shown", (4, 5)) == (4, 5)
    assert sink_size(flat, "source0") == DEFAULT_SIZE
    assert default_sinks(flat) == ["view"]
