"""Levels of quality, and which of them is asked for next by what was measured."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nodegraph import Input, Output, Processor
from nodegraph.data import Image, Volume
from nodegraph.errors import ParameterError
from nodegraph.network import Network
from nodegraph.pacing import Cost, Pacing
from nodegraph.plan import plan
from nodegraph.report import Report
from nodegraph.requests import LEVELS, QUALITIES, Request, coarseness, level
from tests.support.steps import Seed


class Listens(Processor):
    """A picture that holds the level it was made at."""

    volume = Input(Volume, doc="The field.")
    image = Output(Image, doc="One pixel.")

    def process(self, volume, *, quality):
        return Image(np.full((1, 1, 1), coarseness(quality), "f4"))


class AsksCoarse(Processor):
    """Wants what stands above it coarse, whatever is asked of itself."""

    image = Input(Image, doc="A picture.")
    out = Output(Image, doc="The same.")

    def needs(self, size, quality, wanted, params):
        return {"image": Request(size, "interactive")}

    def process(self, image):
        return image


def listening() -> Network:
    network = Network()
    network.add(Seed, "seed")
    network.add(Listens, "listens")
    network.connect("seed.out", "listens.volume")
    return network


def measured(**seconds: float) -> Report:
    """A report of nodes that ran; ``render__memo`` is what ``render`` prepared."""
    report = Report(ran=[path for path in seconds if "__" not in path])
    for path, taken in seconds.items():
        report.timings[path.replace("__", "/")] = taken
        if "__" in path:
            report.memos[path.partition("__")[0]] = [path.replace("__", "/")]
    return report


def test_a_level_is_a_word_and_back():
    assert [coarseness(level(n)) for n in (1, *LEVELS)] == [1, *LEVELS]
    assert coarseness("interactive") == 4
    assert {level(n) for n in (1, *LEVELS)} | {"interactive"} == set(QUALITIES)
    for word in ("best", "interactive/3", "interactive/", "final/2", "interactive/1"):
        with pytest.raises(ParameterError, match="expected one of interactive, final, interactive/2"):
            coarseness(word)


def test_the_level_is_part_of_the_fingerprint_where_it_is_named():
    network = listening()
    prints = {}
    for quality in QUALITIES:
        tasks = {task.path: task.fingerprint for task in plan(network.flatten(), ["listens"], quality=quality).tasks}
        prints[quality] = tasks["listens"]
        assert tasks["seed"] == plan(network.flatten(), ["seed"]).tasks[0].fingerprint
    assert len(set(prints.values())) == len(QUALITIES) - 1
    assert prints["interactive"] == prints["interactive/4"]


def test_a_processor_is_told_a_level(engine):
    network = listening()
    for quality, expected in (("final", 1), ("interactive", 4), ("interactive/32", 32)):
        report = engine.evaluate(network, "listens", quality=quality)
        assert report.values["listens", "image"].color.item() == expected
    network.add(AsksCoarse, "coarse")
    network.connect("listens.image", "coarse.image")
    assert engine.evaluate(network, "coarse").values["coarse", "out"].color.item() == 4


def test_a_cost_is_a_fixed_part_and_work():
    cost = Cost()
    cost.learn(4, 0.5)
    assert cost.seconds(4) == pytest.approx(0.5)
    assert cost.seconds(1) == pytest.approx(2.0)  # one level alone is taken for work
    for n in (2, 8, 16):
        cost.learn(n, 0.1 + 1.6 / n)
    for _ in range(30):
        cost.learn(4, 0.1 + 1.6 / 4)
        cost.learn(8, 0.1 + 1.6 / 8)
    assert cost.seconds(1) == pytest.approx(1.7, rel=1e-4)
    assert cost.seconds(64) == pytest.approx(0.125, rel=1e-4)
    constant = Cost()
    for n in (1, 4, 16):
        constant.learn(n, 0.25)
    assert constant.seconds(2) == pytest.approx(0.25)


def test_a_cost_is_never_negative_and_never_falls_with_more_work():
    rng = np.random.default_rng(3)
    for _ in range(50):
        cost = Cost()
        for n, seconds in zip(rng.choice([1, *LEVELS], 12), rng.random(12), strict=True):
            cost.learn(int(n), float(seconds))
        expected = [cost.seconds(n) for n in (1, *LEVELS)]
        assert all(one >= other >= 0.0 for one, other in itertools.pairwise(expected))


def test_the_finest_level_that_keeps_the_budget():
    pacing = Pacing(100)
    assert pacing.quality() == "interactive/64"  # nothing is known yet
    assert pacing.seconds("final") is None
    pacing.learn(measured(render=1.0), "final")
    assert pacing.quality() == "interactive/16"  # 62 ms; a half of it would not do
    pacing.budget_ms = 600
    assert pacing.quality() == "interactive/2"
    pacing.budget_ms = 1001
    assert pacing.quality() == "final"
    pacing.budget_ms = 1
    assert pacing.quality() == "interactive/64"  # the best that there is


def test_what_does_not_listen_is_not_thought_to_get_cheaper():
    """40 ms of 50 are another node's: of a budget of 61 ms, 21 are left to the rays."""
    pacing = Pacing(61)
    for n in (8, 16, 8, 16):
        pacing.learn(measured(effect=0.04, render=0.16 / n), level(n))
    assert pacing.quality() == "interactive/8"
    assert pacing.node_seconds("interactive/8") == pytest.approx({"effect": 0.04, "render": 0.02}, rel=0.02)


def test_what_was_prepared_once_does_not_count():
    pacing = Pacing(100)
    pacing.learn(measured(render=3.05, render__ranges=3.0), "final")
    assert pacing.quality() == "final"


def test_nodes_that_are_kept_cost_nothing():
    pacing = Pacing(100)
    pacing.learn(measured(read=5.0, render=0.08), "final")
    assert pacing.quality() == "interactive/64"
    pacing.learn(measured(render=0.08), "final")
    assert pacing.quality() == "final"
    pacing.learn(Report(cached=["read", "render"]), "final")  # nothing ran: nothing was learnt
    assert pacing.quality() == "final"


def test_a_machine_that_slows_down_is_followed():
    """Checks: Orhun 2004, T37: coarse at once where it must be, finer again when there is time."""
    pacing = Pacing(100)
    work, asked = 0.9, []
    for i in range(40):
        quality = pacing.quality()
        asked.append(coarseness(quality))
        slower = 8.0 if 10 <= i < 25 else 1.0
        pacing.learn(measured(render=slower * (0.004 + work / coarseness(quality))), quality)
    assert asked[0] == 64
    assert set(asked[5:10]) <= {8, 16}
    assert min(asked[14:25]) >= 64
    assert set(asked[32:]) <= {8, 16}


def test_noise_does_not_make_it_leap_to_final():
    """A busy machine took longer for the coarser pictures: the levels seem to cost the same. One step is tried."""
    pacing = Pacing(100)
    for n, seconds in ((16, 0.07), (32, 0.08), (64, 0.09)):
        pacing.learn(measured(render=seconds), level(n))
    assert pacing.seconds("final") < 0.1
    assert pacing.quality() == "interactive/32"
    pacing.learn(measured(render=0.3), "interactive/32")
    assert pacing.quality() == "interactive/64"


def test_at_rest_pictures_grow_finer_to_final():
    """Checks: Orhun 2004, OR-73; Rezk-Salama 2001, R20."""
    pacing = Pacing(50)
    pacing.learn(measured(render=2.0), "final")
    shown, seen = "interactive/64", []
    while (quality := pacing.finer(shown)) is not None:
        seen.append(quality)
        shown = quality
    assert seen == ["interactive/16", "interactive/4", "final"]
    assert pacing.finer("interactive/2") == "final"
    pacing.learn(measured(render=0.01), "final")
    for _ in range(10):
        pacing.learn(measured(render=0.01), "final")
    assert pacing.finer("interactive/64") == "final"  # it keeps the budget, so nobody needs less


@pytest.mark.parametrize("budget", [0, -5, float("nan"), float("inf")])
def test_a_budget_is_a_time(budget):
    with pytest.raises(ParameterError, match="expected a time above 0 ms"):
        Pacing(budget)
