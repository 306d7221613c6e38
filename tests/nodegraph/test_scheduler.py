"""Laws of planning and running, on small networks without a device."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nodegraph import Bool, Condition, Float, Input, Int, Output, Processor, has_components
from nodegraph.cache import ResultCache
from nodegraph.data import Image, Volume
from nodegraph.errors import Cancelled, CommandError, ParameterError, PortError
from nodegraph.flat import Flat, FlatNode
from nodegraph.network import Network
from nodegraph.plan import Planner, Request
from nodegraph.scheduler import Context, run
from nodegraph.workers import Inbox, Workers
from tests.support import steps
from tests.support.steps import Draw, Fail, Seed, Shift, Wait, chain, diamond, gates, ran, value_of


@pytest.fixture(autouse=True)
def _count_anew():
    ran.clear()
    gates.clear()


@pytest.fixture
def context():
    """A run on the test's own thread, with no device to open."""

    def refuse(*_):
        raise AssertionError("no task here names a device")

    devices = SimpleNamespace(main=refuse, opengl=refuse, after=refuse)
    workers = Workers(3)
    yield Context(ResultCache(1 << 24), workers, Inbox(), devices)
    workers.close()


@pytest.fixture
def evaluate(context):
    """Plan and run, as the engine does."""
    planners: dict = {}

    def act(network, sinks=None, *, on_event=None, cancelled=lambda: False, **asked):
        planner = Planner() if isinstance(network, Flat) else planners.setdefault(network, Planner())
        flat = network if isinstance(network, Flat) else network.flatten()
        return run(planner.plan(flat, sinks, **asked), context, on_event, cancelled)

    act.context = context
    return act


# -- what runs ----------------------------------------------------------------------------------------------------


def test_a_diamond_runs_every_node_once_and_again_nothing(evaluate):
    network = diamond()
    report = evaluate(network, "sum.out".split())
    assert value_of(report, "sum") == 32.0
    assert ran == {"seed": 1, "left": 1, "right": 1, "sum": 1}
    assert report.ran[0] == "seed"
    assert report.ran[-1] == "sum"
    assert set(report.timings) == {"seed", "left", "right", "sum"}
    assert report.bytes["sum"] == 32
    again = evaluate(network, ["sum"])
    assert again.ran == []
    assert again.cached == ["sum"]
    assert again.states == dict.fromkeys(("seed", "left", "right", "sum"), "clean")
    assert sum(ran.values()) == 4


def test_a_change_runs_what_is_below_it_and_changing_it_back_runs_nothing(evaluate):
    network = diamond()
    evaluate(network, ["sum"])
    network["left"].by = 11.0
    assert sorted(evaluate(network, ["sum"]).ran) == ["left", "sum"]
    network["left"].by = 10.0
    report = evaluate(network, ["sum"])
    assert report.ran == []
    assert value_of(report, "sum") == 32.0


def test_what_no_sink_asks_for_does_not_run(evaluate):
    network = diamond()
    evaluate(network, ["left"])
    assert ran == {"seed": 1, "left": 1}


def test_a_budget_of_0_gives_the_same_results_and_keeps_nothing(evaluate):
    evaluate.context.cache.limit = 0
    network = diamond()
    for _ in range(2):
        assert value_of(evaluate(network, ["sum"]), "sum") == 32.0
    assert ran == {"seed": 2, "left": 2, "right": 2, "sum": 2}
    assert evaluate.context.cache.nbytes == 0


def test_an_evicted_result_above_a_kept_one_is_not_missed(evaluate):
    network = chain(2)
    evaluate(network, ["n1"])
    cache = evaluate.context.cache
    for task in Planner().plan(network.flatten(), ["n1"]).tasks[:2]:
        cache._remove(task.fingerprint)
    assert evaluate(network, ["n1"]).ran == []
    network["n1"].by = 5.0
    assert evaluate(network, ["n1"]).ran == ["seed", "n0", "n1"]


def test_without_sinks_all_views_and_effects_run_else_what_nobody_reads(evaluate):
    network = diamond()
    assert set(evaluate(network).shown) == {"sum"}
    network.add(Writes, "writes")
    network.connect("seed.out", "writes.volume")
    report = evaluate(network)
    assert set(report.shown) == {"writes"}
    assert ran["written"] == 1


def test_an_unknown_sink_is_refused_with_the_near_miss(evaluate):
    with pytest.raises(CommandError, match="did you mean 'sum'"):
        evaluate(diamond(), ["sun"])
    with pytest.raises(CommandError, match="no output"):
        evaluate(diamond(), ["sum.ou"])
    with pytest.raises(ParameterError, match="interactive, final"):
        evaluate(diamond(), ["sum"], quality="best")


def test_a_muted_node_passes_through_and_may_be_named(evaluate):
    network = chain(2)
    network.mute("n0")
    assert value_of(evaluate(network, ["n1"]), "n1") == 2.0
    report = evaluate(network, ["n0"])
    assert report.shown["n0"]["out"].data.flat[0] == 1.0


class Writes(Processor):
    """Counts how often it changed the world."""

    effect = True
    volume = Input(Volume, doc="Written.")

    def process(self, volume):
        ran["written"] += 1


def test_an_effect_runs_each_time_it_is_named_and_shows_its_input(evaluate):
    network = chain(1)
    network.add(Writes, "writes")
    network.connect("n0.out", "writes.volume")
    for count in (1, 2):
        report = evaluate(network, ["writes"])
        assert ran["written"] == count
    assert report.ran == ["writes"]
    assert report.values["writes", "volume"].data.flat[0] == 2.0


class Passes(Processor):
    """An effect that somebody may read."""

    effect = True
    volume = Input(Volume, doc="Written.")
    out = Output(Volume, doc="The same.")

    def process(self, volume):
        ran["passes"] += 1
        return volume


def test_an_effect_above_a_sink_blocks_unless_it_is_named(evaluate):
    network = chain(1)
    network.add(Passes, "passes")
    network.add(Shift, "below")
    network.connect("n0.out", "passes.volume")
    network.connect("passes.out", "below.volume")
    report = evaluate(network, ["below"])
    assert report.states["below"] == "blocked"
    assert "only when it is named" in report.states["below"].reason
    assert ran["passes"] == 0
    assert evaluate(network, ["passes", "below"]).ok


# -- requests -----------------------------------------------------------------------------------------------------


def test_one_node_runs_for_two_sizes_and_what_cannot_tell_runs_once(evaluate):
    network = chain(1)
    network.add(Draw, "draw")
    network.connect("n0.out", "draw.volume")
    for width in (4, 8):
        network.add(View, f"view{width}", width=width, height=2)
        network.connect("draw.image", f"view{width}.image")
    report = evaluate(network, ["view4", "view8"])
    assert report.values["view4", "shown"].size == (4, 2)
    assert report.values["view8", "shown"].size == (8, 2)
    assert ran == {"seed": 1, "shift": 1, "draw": 2}
    assert evaluate(network, ["view4"], size=(8, 2)).ran == ["view4"]
    assert ran["draw"] == 2


class View(Processor):
    """Shows."""

    image = Input(Image, doc="Shown.")
    shown = Output(Image, doc="The same.")
    width = Int(64, doc="Pixels.")
    height = Int(64, doc="Pixels.")

    def process(self, image, width, height):
        return image


class Pick(Processor):
    """Reads one of two branches, at half the size."""

    first = Input(Image, doc="Read when chosen.", required=False)
    second = Input(Image, doc="Read when not.", required=False)
    out = Output(Image, doc="The chosen one.")
    use_first = Bool(True, doc="Which.")

    def needs(self, size, quality, wanted, params):
        half = (size[0] // 2, size[1] // 2)
        first = params["use_first"]
        return {"first": half if first else None, "second": None if first else Request(half, "interactive")}

    def process(self, first, second, use_first):
        assert (first is None) != (second is None)
        return first if use_first else second


def pick_network():
    network = chain(0)
    network.add(Shift, "other", name="other")
    network.connect("seed.out", "other.volume")
    for name, source in (("a", "seed"), ("b", "other")):
        network.add(Draw, name)
        network.connect(f"{source}.out", f"{name}.volume")
    network.add(Pick, "pick")
    network.connect("a.image", "pick.first")
    network.connect("b.image", "pick.second")
    return network


def test_needs_cuts_a_branch_and_changes_the_request(evaluate):
    network = pick_network()
    report = evaluate(network, ["pick"], size=(16, 8))
    assert report.values["pick", "out"].size == (8, 4)
    assert report.ran == ["seed", "a", "pick"]
    network["other"].by = 7.0
    assert evaluate(network, ["pick"], size=(16, 8)).ran == []
    network["pick"].use_first = False
    report = evaluate(network, ["pick"], size=(16, 8))
    assert sorted(report.ran) == ["b", "other", "pick"]
    assert report.values["pick", "out"].color[0, 0, 0] == 8.0


def test_needs_that_reads_a_wired_parameter_asks_for_everything(evaluate):
    class Both(Pick):
        """The same, taking what is chosen."""

        def process(self, first, second, use_first):
            return first if use_first else second

    class Chooses(Processor):
        """A switch."""

        out = Output(bool, doc="False.")

        def process(self):
            return False

    network = pick_network()
    network.add(Both, "both")
    network.add(Chooses, "switch")
    network.connect("a.image", "both.first")
    network.connect("b.image", "both.second")
    network.connect("switch.out", "both.use_first")
    report = evaluate(network, ["both"], size=(16, 8))
    assert {"a", "b", "switch"} <= set(report.ran)
    assert report.values["both", "out"].size == (16, 8)


def test_needs_that_raises_or_answers_nonsense_blocks_with_the_place(evaluate):
    class Raises(Pick):
        """Bad."""

        def needs(self, size, quality, wanted, params):
            return {"first": params["use_first"] / 0}

        def process(self, first, second, use_first):
            return first

    class Names(Pick):
        """Bad."""

        def needs(self, size, quality, wanted, params):
            return {"third": None}

        def process(self, first, second, use_first):
            return first

    for bad, text in ((Raises, "bad: ZeroDivisionError"), (Names, "bad.third")):
        network = pick_network()
        network.add(bad, "bad")
        network.connect("a.image", "bad.first")
        report = evaluate(network, ["bad"])
        assert not report.ok
        assert text in str(report.errors["bad"])


class Two(Processor):
    """Two outputs; makes what is wanted."""

    low = Output(float, doc="One.")
    high = Output(float, doc="Two.")

    def process(self, *, wanted):
        ran[" ".join(sorted(wanted))] += 1
        return self.Outputs(low=1.0 if "low" in wanted else None, high=2.0 if "high" in wanted else None)


class AddNumbers(Processor):
    """A sum."""

    one = Input(float, doc="A number.")
    two = Input(float, doc="A number.", required=False)
    out = Output(float, doc="The sum.")

    def process(self, one, two):
        return one + (two or 0.0)


def test_only_outputs_that_are_read_are_wanted(evaluate):
    network = Network()
    network.add(Two, "two")
    network.add(AddNumbers, "add")
    network.connect("two.low", "add.one")
    evaluate(network, ["add"])
    assert ran == {"low": 1}
    network.connect("two.high", "add.two")
    assert evaluate(network, ["add"]).values["add", "out"] == 3.0
    assert ran == {"low": 1, "high low": 1}
    assert evaluate(network, ["two.high"]).values == {("two", "high"): 2.0}


# -- failing ------------------------------------------------------------------------------------------------------


def failing():
    network = diamond()
    network.remove("left")
    network.add(Fail, "left")
    network.connect("seed.out", "left.volume")
    network.connect("left.out", "sum.volumes")
    network.add(Shift, "far")
    network.connect("sum.out", "far.volume")
    return network


def test_a_failure_blocks_what_is_below_and_nothing_else(evaluate):
    network = failing()
    events = []
    report = evaluate(network, ["far", "right"], on_event=events.append)
    assert report.states == {
        "seed": "clean", "left": "failed", "right": "clean", "sum": "blocked", "far": "blocked"
    }  # fmt: skip
    assert str(report.errors["left"]) == "left: RuntimeError: it broke"
    assert list(report.errors) == ["left"]
    assert report.exit_code == 1
    assert report.states["far"].reason == "blocked by left: RuntimeError: it broke"
    assert value_of(report, "right") == 21.0
    assert ("far", "out") not in report.values
    assert {(e.kind, e.path) for e in events} >= {("failed", "left"), ("blocked", "sum"), ("finished", "right")}


def test_a_failure_is_not_tried_again_until_something_changes(evaluate):
    network = failing()
    evaluate(network, ["far"])
    again = evaluate(network, ["far"])
    assert ran["fail"] == 1
    assert str(again.errors["left"]) == "left: RuntimeError: it broke"
    assert again.states["far"] == "blocked"
    network["left"].text = "otherwise"
    assert str(evaluate(network, ["far"]).errors["left"]).endswith("otherwise")
    assert ran["fail"] == 2
    network["left"].text = "it broke"
    evaluate(network, ["far"])
    assert ran["fail"] == 2
    evaluate.context.cache.forget_failures()
    evaluate(network, ["far"])
    assert ran["fail"] == 3


def test_a_failure_keeps_none_of_its_inputs_alive(evaluate):
    import gc
    import weakref

    evaluate.context.cache.limit = 0
    network = failing()
    held = []
    evaluate(network, ["left"], on_event=lambda e: held.extend(weakref.ref(v) for v in e.values.values()))
    gc.collect()
    assert held
    assert [ref() for ref in held] == [None]


class Exits(Processor):
    """Tries to end the program."""

    out = Output(float, doc="Never there.")

    def process(self):
        raise SystemExit(3)


def test_a_processor_that_exits_is_a_failed_node(evaluate):
    network = Network()
    network.add(Exits, "exits")
    assert evaluate(network, ["exits"]).states["exits"] == "failed"


class WritesInput(Processor):
    """Changes what it was given."""

    volume = Input(Volume, doc="A field.")
    out = Output(Volume, doc="The same.")

    def process(self, volume):
        volume.data[:] = 0
        return volume


def test_inputs_cannot_be_changed(evaluate):
    network = chain(0)
    network.add(WritesInput, "writes")
    network.connect("seed.out", "writes.volume")
    report = evaluate(network, ["writes", "seed"])
    assert "read-only" in str(report.errors["writes"])
    assert value_of(report, "seed") == 1.0


def test_an_unwired_or_unknown_node_is_blocked_with_the_cure(evaluate):
    network = Network()
    network.add(Shift, "alone")
    report = evaluate(network, ["alone"])
    assert report.states["alone"] == "blocked"
    assert "alone.volume" in str(report.errors["alone"])
    assert report.exit_code == 2


class Picky(Processor):
    """Wants small fields of one component."""

    volume = Input(Volume, doc="A field.", accepts=(has_components(1), Condition(lambda v: v.dims[0] < 3, "be small")))
    factor = Float(1.0, min=0.0, max=2.0, doc="A number.")
    out = Output(float, doc="A number.")

    def process(self, volume, factor):
        return factor


def test_conditions_and_wired_values_are_checked_on_arrival(evaluate):
    network = chain(0)
    network.add(Picky, "picky")
    network.connect("seed.out", "picky.volume")
    assert evaluate(network, ["picky"]).ok
    network["seed"].edge = 3
    report = evaluate(network, ["picky"])
    assert "picky.volume: be small" in str(report.errors["picky"])
    assert isinstance(report.errors["picky"].__cause__, PortError)
    assert report.exit_code == 2
    network["seed"].edge = 2
    network.add(Two, "two")
    network.add(AddNumbers, "add")
    network.connect("two.high", "add.one")
    network.connect("two.low", "add.two")
    network.connect("add.out", "picky.factor")
    report = evaluate(network, ["picky"])
    assert str(report.errors["picky"]).startswith("picky.factor: 3")


class Liar(Processor):
    """Returns what it did not declare."""

    out = Output(Volume, doc="Said to be a field.")

    def process(self):
        return "text"


def test_a_wrong_result_is_refused(evaluate):
    network = Network()
    network.add(Liar, "liar")
    assert "liar.out: expected a Volume" in str(evaluate(network, ["liar"]).errors["liar"])


def flat_chain(length: int, first: type[Processor]) -> Flat:
    """The snapshot of a long chain, made without the document."""
    nodes = {"start": FlatNode("start", "", Seed, {}, {}, {"number": 1, "edge": 1}, None, 1)}
    above = "start"
    for i in range(length):
        processor = first if i == 0 else Shift
        values = {"text": "it broke"} if processor is Fail else {"by": 1.0, "name": "n"}
        nodes[f"n{i}"] = FlatNode(f"n{i}", "", processor, {"volume": ((above, "out"),)}, {}, values, None, 1)
        above = f"n{i}"
    return Flat(nodes, {}, frozenset(), 1, 1)


def test_a_chain_longer_than_the_stack_runs_and_is_blocked(evaluate):
    assert value_of(evaluate(flat_chain(1100, Shift), ["n1099"]), "n1099") == 1101.0
    report = evaluate(flat_chain(1100, Fail), ["n1099"])
    assert report.states["n1099"] == "blocked"
    assert len(report.errors) == 1


# -- generators, progress, cancel ------------------------------------------------------------------------------------


class Refine(Processor):
    """Comes nearer with every step."""

    volume = Input(Volume, required=False, doc="Not looked at.")
    out = Output(float, doc="The last number.")
    count = Int(3, doc="Steps.")

    def process(self, volume, count):
        for i in range(count):
            ran["refine"] += 1
            time.sleep(0.001)
            yield float(i)
            yield None


def test_each_yield_is_a_preview_and_the_last_one_is_the_result(evaluate):
    network = Network()
    network.add(Refine, "refine")
    seen = []
    report = evaluate(network, ["refine"], on_event=lambda e: seen.append((e.kind, dict(e.values))))
    assert [values["out"] for kind, values in seen if kind == "preview"] == [0.0, 1.0, 2.0]
    assert seen[-1] == ("finished", {"out": 2.0})
    assert report.values["refine", "out"] == 2.0
    assert evaluate(network, ["refine"]).ran == []


def test_a_generator_that_yields_nothing_fails(evaluate):
    network = Network()
    network.add(Refine, "refine", count=0)
    assert "refine.out" in str(evaluate(network, ["refine"]).errors["refine"])


def test_cancel_between_yields_keeps_nothing(evaluate):
    network = Network()
    network.add(Refine, "refine", count=1000)
    stop = threading.Event()

    def watch(event):
        if event.kind == "preview" and event.values["out"] >= 2.0:
            stop.set()

    with pytest.raises(Cancelled):
        evaluate(network, ["refine"], on_event=watch, cancelled=stop.is_set)
    assert ran["refine"] < 1000
    network["refine"].count = 2
    assert evaluate(network, ["refine"]).values["refine", "out"] == 1.0


class Reports(Processor):
    """Says how far it is."""

    out = Output(float, doc="A number.")

    def process(self, *, progress):
        for i in range(200):
            ran["reports"] += 1
            progress(i / 200, "working")
            time.sleep(0.001)
        progress(1.0)
        return 1.0


def test_progress_is_reported_and_is_a_place_to_cancel(evaluate):
    network = Network()
    network.add(Reports, "reports")
    stop = threading.Event()
    with pytest.raises(Cancelled):
        evaluate(
            network,
            ["reports"],
            on_event=lambda event: stop.set() if event.kind == "progress" else None,
            cancelled=stop.is_set,
        )
    assert 0 < ran["reports"] < 200
    seen = []
    evaluate(network, ["reports"], on_event=lambda event: seen.append(event) if event.kind == "progress" else None)
    fractions = [event.fraction for event in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert seen[0].text == "working"
    assert len(seen) < 100, "not every report is worth an event"


def test_an_observer_that_raises_stops_nothing_and_is_noted_once(evaluate):
    def watch(event):
        raise ValueError("no")

    report = evaluate(diamond(), ["sum"], on_event=watch)
    assert value_of(report, "sum") == 32.0
    assert report.notes == ["the observer of this evaluation raised ValueError: no"]


def test_nodes_without_a_device_run_beside_each_other(evaluate):
    """Each of two waits for a gate that is opened only when both have started."""
    network = Network()
    for name in ("one", "two"):
        gates[name] = threading.Event()
        network.add(Wait, name, gate=name)

    def watch(event):
        if event.kind == "started" and ran.keys() >= {"one", "two"}:
            open_both()

    def open_both():
        gates["one"].set()
        gates["two"].set()

    def poll():
        while not ran.keys() >= {"one", "two"}:
            time.sleep(0.001)
        open_both()

    threading.Thread(target=poll, daemon=True).start()
    assert evaluate(network, ["one", "two"], on_event=watch).ok


# -- memo ---------------------------------------------------------------------------------------------------------


def costly(volume, number, table):
    ran["costly"] += 1
    return volume.with_data(volume.data * np.float32(number) + table[0])


class Remembers(Processor):
    """Keeps an intermediate that does not depend on one of its parameters."""

    volume = Input(Volume, doc="A field.")
    out = Output(Volume, doc="A field.")
    factor = Float(2.0, doc="The intermediate depends on it.")
    late = Float(0.0, doc="The intermediate does not.")

    def process(self, volume, factor, late, *, memo):
        ran["remembers"] += 1
        scaled = memo(costly, volume, factor, np.zeros(1, "f4"))
        return scaled.with_data(scaled.data + np.float32(late))


def test_memo_is_made_once_per_arguments(evaluate):
    network = chain(0)
    network.add(Remembers, "shadow")
    network.connect("seed.out", "shadow.volume")
    report = evaluate(network, ["shadow"])
    assert report.ran == ["seed", "shadow/costly", "shadow"]
    assert report.memos == {"shadow": ["shadow/costly"]}
    assert report.timings["shadow/costly"] >= 0
    network["shadow"].late = 3.0
    report = evaluate(network, ["shadow"])
    assert value_of(report, "shadow") == 5.0
    assert report.ran == ["shadow"]
    assert "shadow/costly" in report.cached
    network["shadow"].factor = 3.0
    assert value_of(evaluate(network, ["shadow"]), "shadow") == 6.0
    network["seed"].number = 2
    assert value_of(evaluate(network, ["shadow"]), "shadow") == 9.0
    assert ran["costly"] == 3
    assert ran["remembers"] == 4


class RemembersLambda(Processor):
    """Refused."""

    out = Output(float, doc="A number.")

    def process(self, *, memo):
        return memo(lambda: 1.0)


def test_memo_refuses_a_lambda_with_the_reason(evaluate):
    network = Network()
    network.add(RemembersLambda, "bad")
    assert "lambda has no name" in str(evaluate(network, ["bad"]).errors["bad"])


# -- order --------------------------------------------------------------------------------------------------------


@st.composite
def graphs(draw):
    """Edges of an acyclic graph of up to 12 nodes, and the nodes that are sinks."""
    count = draw(st.integers(1, 12))
    edges = [sorted(draw(st.sets(st.integers(0, i - 1), max_size=3))) if i else [] for i in range(count)]
    sinks = draw(st.sets(st.integers(0, count - 1), min_size=1))
    return edges, sorted(sinks)


class Any_(Processor):
    """Sums what comes in, plus one."""

    values = Input(float, many=True, required=False, doc="Numbers.")
    out = Output(float, doc="Their sum plus one.")

    def process(self, values):
        return float(sum(values)) + 1.0


@settings(max_examples=40, deadline=None)
@given(graphs())
def test_no_node_runs_before_its_inputs_and_only_ancestors_of_sinks_run(graph):
    edges, sinks = graph
    network = Network()
    for i, sources in enumerate(edges):
        network.add(Any_, f"n{i}")
        for source in sources:
            network.connect(f"n{source}.out", f"n{i}.values")
    expected: list[float] = []
    for sources in edges:
        expected.append(sum(expected[source] for source in sources) + 1.0)
    needed, rest = set(sinks), list(sinks)
    while rest:
        above = set(edges[rest.pop()]) - needed
        needed |= above
        rest += above
    workers = Workers(2)
    context = Context(ResultCache(0), workers, Inbox(), SimpleNamespace())
    events = []
    try:
        report = run(Planner().plan(network.flatten(), [f"n{i}" for i in sinks]), context, events.append)
    finally:
        workers.close()
    for i in sinks:
        assert report.values[f"n{i}", "out"] == expected[i]
    # Nodes that do the same on the same inputs have equal fingerprints, and one result serves them all.
    assert set(report.ran) <= {f"n{i}" for i in needed}
    finished: set[str] = set()
    for event in events:
        if event.kind == "started":
            assert {f"n{source}" for source in edges[int(event.path[1:])]} <= finished | set(report.cached)
        elif event.kind == "finished":
            finished.add(event.path)
    assert finished | set(report.cached) == {f"n{i}" for i in needed}


def test_two_nodes_that_do_the_same_are_made_once(evaluate):
    network = Network()
    network.add(Seed, "one")
    network.add(Seed, "two")
    report = evaluate(network, ["one", "two"])
    assert ran["seed"] == 1
    assert report.values["one", "out"] is report.values["two", "out"]
    assert steps.ran is ran
