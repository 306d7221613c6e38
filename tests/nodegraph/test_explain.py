from __future__ import annotations

import pytest

from nodegraph import Float, Input, Output, Processor
from nodegraph.data import Volume
from nodegraph.disk_cache import DiskCache
from nodegraph.engine import Engine
from nodegraph.errors import CommandError
from nodegraph.explain import explain, states, why
from nodegraph.network import Network
from tests.support.steps import Draw, Fail, Seed, diamond, ran


@pytest.fixture(autouse=True)
def _count_anew():
    ran.clear()


@pytest.fixture
def engine():
    with Engine(disk=False) as engine:
        yield engine


def drawing():
    network = diamond()
    network.add(Draw, "draw")
    network.connect("sum.out", "draw.volume")
    return network


def fates(text):
    """Path to the words after it."""
    return {line.split()[0]: line for line in text.splitlines()[1:]}


def test_a_plan_tells_order_size_who_asked_and_what_runs(engine):
    network = drawing()
    before = explain(engine, network, "draw", size=(30, 20))
    assert before.splitlines()[0] == "draw: 5 tasks, 5 to run"
    lines = fates(before)
    assert list(lines) == ["seed", "left", "right", "sum", "draw"]
    assert "30x20 final, sink" in lines["draw"]
    assert "asked by left, right" in lines["seed"] or "asked by right, left" in lines["seed"]
    assert "30x20" not in lines["sum"], "no size matters there"
    assert all("has not run before" in line for line in lines.values())
    assert not ran, "explaining runs nothing"
    engine.evaluate(network, "draw", size=(30, 20))
    after = explain(engine, network, "draw", size=(30, 20))
    assert after.splitlines()[0] == "draw: 5 tasks, 0 to run"
    assert all("kept" in line for line in fates(after).values())
    assert " s, " in fates(after)["draw"]
    assert "MB" in fates(after)["draw"]


def test_why_names_the_parameter_and_the_node_where_the_change_began(engine):
    network = drawing()
    text = why(engine, network, "sum", "draw")
    assert text.splitlines()[0] == "sum: runs: it has not run before in this engine"
    assert "volumes: left.out " in text
    assert "by = 10.0" in why(engine, network, "left", "draw")
    engine.evaluate(network, "draw")
    assert "kept: nothing it depends on has changed" in why(engine, network, "sum", "draw")
    network["left"].by = 11.0
    assert "left: runs: by 10.0 -> 11.0" in why(engine, network, "left", "draw")
    assert "draw: runs: left: by 10.0 -> 11.0" in why(engine, network, "draw", "draw")
    assert "kept" in why(engine, network, "right", "draw")
    network["left"].by = 10.0
    assert "kept" in why(engine, network, "draw", "draw")


def test_why_names_sizes_wires_files_and_eviction(engine):
    network = drawing()
    engine.evaluate(network, "draw", size=(4, 4))
    assert "asked-for size 4x4 -> 8x4" in why(engine, network, "draw", "draw", size=(8, 4))
    network.disconnect("sum.volumes", "right.out")
    assert "wires of volumes left.out right.out -> left.out" in why(engine, network, "sum", "draw", size=(4, 4))
    network.undo()
    engine.cache.clear()
    assert "let go to stay within the budget" in why(engine, network, "draw", "draw", size=(4, 4))


def test_why_tells_what_stands_in_the_way(engine):
    network = diamond()
    network.add(Fail, "fail")
    network.add(Draw, "draw")
    network.add(Draw, "alone")
    network.connect("sum.out", "fail.volume")
    network.connect("fail.out", "draw.volume")
    engine.evaluate(network, "draw")
    assert "failed, and nothing it depends on has changed since: fail: RuntimeError" in why(
        engine, network, "fail", "draw"
    )
    assert "draw: blocked by fail: RuntimeError" in why(engine, network, "draw", "draw")
    assert "alone: blocked: alone.volume: nothing is connected" in why(engine, network, "alone", "alone")
    network["fail"].text = "other"
    assert 'text "it broke" -> "other"' in why(engine, network, "fail", "draw")
    with pytest.raises(CommandError, match="did you mean 'draw'"):
        why(engine, network, "drew")
    network.mute("left")
    assert "muted" in why(engine, network, "left")


def test_states_are_known_without_running(engine):
    network = diamond()
    network.add(Fail, "fail")
    network.add(Draw, "draw")
    network.connect("sum.out", "fail.volume")
    network.connect("fail.out", "draw.volume")
    before = states(engine, network, "draw")
    assert set(before.values()) == {"dirty"}
    assert not ran
    engine.evaluate(network, "draw")
    after = states(engine, network, "draw")
    assert after["sum"] == "clean"
    assert after["fail"] == "failed"
    assert after["draw"] == "blocked"
    network["left"].by = 3.0
    after = states(engine, network, "draw")
    assert (after["right"], after["left"], after["sum"], after["fail"]) == ("clean", "dirty", "dirty", "dirty")
    assert "left: by 10.0 -> 3.0" in after["sum"].reason


def test_a_result_on_disk_is_told(tmp_path):
    network = Network()
    network.add(Keeps, "keeps")
    for expected in ("runs", "kept on disk"):
        with Engine(disk=DiskCache(tmp_path)) as engine:
            assert f"keeps: {expected}" in why(engine, network, "keeps")
            engine.evaluate(network, "keeps")


class Keeps(Processor):
    """Worth keeping."""

    disk_cache = True
    out = Output(float, doc="A number.")

    def process(self):
        return 1.0


def test_why_of_a_node_that_nobody_asks_for_says_so(engine):
    network = diamond()
    network.add(Seed, "idle")
    text = why(engine, network, "idle", "sum")
    assert text.splitlines()[0] == "idle: nothing that is asked for needs it (sum)"


def trebled(volume):
    return volume.with_data(volume.data * 3)


class Memos(Processor):
    """Keeps an intermediate."""

    volume = Input(Volume, doc="A field.")
    out = Output(Volume, doc="A field.")
    late = Float(0.0, doc="A number.")

    def process(self, volume, late, *, memo):
        return memo(trebled, volume)


class Writes(Processor):
    """Changes the world."""

    effect = True
    volume = Input(Volume, doc="A field.")

    def process(self, volume):
        ran["writes"] += 1


def test_memos_and_effects_are_told(engine):
    network = Network()
    network.add(Seed, "seed")
    network.add(Memos, "shadow")
    network.add(Writes, "writes")
    network.connect("seed.out", "shadow.volume")
    network.connect("shadow.out", "writes.volume")
    engine.evaluate(network)
    text = explain(engine, network)
    assert "shadow/trebled" in text
    assert "runs: it changes the world, so it is never kept" in fates(text)["writes"]
    assert text.splitlines()[0] == "writes: 3 tasks, 1 to run"
