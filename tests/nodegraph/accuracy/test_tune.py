"""Tuning against closed forms: what is chosen is the cheapest that keeps the bound, also on views it never saw."""

from __future__ import annotations

import numpy as np
import pytest

from nodegraph import Float, Output, Processor, workspace
from nodegraph.accuracy import orbit
from nodegraph.accuracy.descent import combinations_of_choices, descend
from nodegraph.accuracy.reference import Reference
from nodegraph.accuracy.settings import applied, quality_parameters
from nodegraph.accuracy.tune import MARGIN, tune
from nodegraph.data import Camera, Image
from nodegraph.engine import Engine
from nodegraph.errors import Cancelled, CommandError, GraphError, ParameterError
from nodegraph.network import Network
from tests.support.slab import Number, Root, Tint, exact, find, left_sum, slab

pytestmark = pytest.mark.slow

LADDER = [0.25 * 2.0**k for k in range(-5, 3)]


@pytest.fixture(scope="module")
def double():
    """An engine in double precision that keeps nothing on disk."""
    with Engine("cl64", disk=False) as engine:
        yield engine


def closed(network, view, size, bound, **_):
    """The reference of the slab in closed form."""
    hidden = exact(network.get("slab.camera"))
    return Reference(
        Image(np.broadcast_to(hidden[None, :, None], (2, 4, 4)).copy()), np.ones((2, 4), bool), 0.0, 2, True, bound
    )


def camera(number, given=None):
    return orbit.turned(given or Camera(), *orbit.turns(number))


def error(step, numbers, given=None):
    """The error of a step on some cameras, in closed form."""
    eyes = [camera(number, given) for number in numbers]
    return max(float(np.abs(left_sum(eye, round(1 / step)) - exact(eye)).max()) for eye in eyes)


def coarsest(limit, numbers, given=None):
    return max(step for step in LADDER if error(step, numbers, given) <= limit)


def test_the_cheapest_setting_that_keeps_the_error_is_chosen(double) -> None:
    max_error = 0.02
    net = slab(step=0.25)
    before = workspace.dumps(net)
    found = tune(net, "view", max_error, cameras=3, held_out=3, repeats=2, engine=double, refer=closed)
    expected = coarsest(MARGIN * max_error, range(3))
    assert found.met
    assert found.settings == {"slab.step": expected}
    assert found.best.errors["max"] == pytest.approx(error(expected, range(3)), rel=1e-9)
    assert found.held_out is not None
    assert found.held_out.cameras == (3, 4, 5)
    assert found.held_out.errors["max"] == pytest.approx(error(expected, (3, 4, 5)), rel=1e-9)
    assert found.error <= max_error
    assert found.before.errors["max"] == pytest.approx(error(0.25, range(3)), rel=1e-9)
    assert workspace.dumps(net) == before


def test_where_many_samples_are_dearer_than_the_exact_rule_it_is_chosen(double) -> None:
    found = tune(slab(step=0.25), "view", 1e-9, cameras=2, held_out=1, repeats=1, engine=double, refer=closed)
    assert found.met
    assert found.settings["slab.rule"] == "exact"
    assert found.error < 1e-15


def test_a_setting_that_is_best_already_changes_nothing(double) -> None:
    step = coarsest(MARGIN * 0.02, range(3))
    found = tune(slab(step=step), "view", 0.02, cameras=3, held_out=0, engine=double, refer=closed)
    assert found.met
    assert found.settings == {}


def test_views_that_break_the_bound_join_the_search_and_new_ones_are_tried(double) -> None:
    max_error = 0.02
    along = Camera(eye=(-600.0, -1.0, 0.0))  # looks along the slab, where everything is hidden and no step matters
    step = coarsest(max_error, [0], along)
    assert error(step, (1, 2), along) > max_error, "the cameras of this test must break the bound"
    net = slab(step=0.25)
    net.set("camera", along)
    found = tune(net, "view", max_error, cameras=1, held_out=2, margin=1.0, repeats=2, engine=double, refer=closed)
    assert found.met
    assert found.rounds > 1
    assert found.settings["slab.step"] < step
    assert found.held_out is not None
    assert not set(found.held_out.cameras) & set(found.best.cameras)
    assert len(found.best.cameras) > 1
    assert found.held_out.errors["max"] <= max_error


def test_the_most_accurate_within_a_budget(double) -> None:
    found = tune(
        slab(step=0.25), "view", budget_ms=200.0, cameras=1, held_out=1, repeats=1, engine=double, refer=closed
    )
    assert found.met
    # The exact rule takes 300 ms, so it is not allowed; the finer a step, the better.
    assert "slab.rule" not in found.settings
    assert found.settings["slab.step"] == LADDER[0]
    assert found.best.seconds <= MARGIN * 0.2
    assert found.size == (4, 2)


def test_what_cannot_be_kept_offers_the_best_in_one_sentence(double) -> None:
    found = tune(slab(step=0.25), "view", budget_ms=1e-3, cameras=1, held_out=0, repeats=1, engine=double, refer=closed)
    assert not found.met
    assert found.summary().startswith("no setting that was tried keeps 0.001 ms; the best of them has max 0.")
    assert "\n" not in found.summary()
    both = tune(slab(step=0.25), "view", 1e-9, 1.0, cameras=1, held_out=0, repeats=1, engine=double, refer=closed)
    assert not both.met
    assert "keeps max 1e-09 and 1 ms" in both.summary()


def test_the_front_is_of_what_was_tried(double) -> None:
    found = tune(slab(step=0.25), "view", 0.02, cameras=1, held_out=0, engine=double, refer=closed)
    front = [one for one in found.tried if one.front]
    assert front
    for one in front:
        for other in found.tried:
            if other.cameras == one.cameras:
                cheaper, better = other.seconds <= one.seconds, other.errors["max"] <= one.errors["max"]
                strictly = other.seconds < one.seconds or other.errors["max"] < one.errors["max"]
                assert not (cheaper and better and strictly)
    assert found.held_out is None


def test_another_figure_is_a_bound_on_that(double) -> None:
    found = tune(slab(step=0.25), "view", 0.01, figure="rmse", cameras=1, held_out=0, engine=double, refer=closed)
    assert found.figure == "rmse"
    assert found.best.errors["rmse"] <= 0.01
    with pytest.raises(ParameterError, match=r"rsme: no such error of view .did you mean 'rmse'"):
        tune(slab(), "view", 0.01, figure="rsme", engine=double, refer=lambda *_, **__: pytest.fail("too late"))


@pytest.mark.parametrize("name", ["cameras", "held_out", "repeats"])
def test_more_work_than_anybody_would_wait_for_is_refused(name) -> None:
    with pytest.raises(ParameterError, match="ask for fewer"):
        tune(slab(), "view", 0.01, refer=closed, **{name: 100_000_000})


def test_numbers_are_tuned_with_a_real_reference(double) -> None:
    net = Network(find)
    net.add(Root, "root", iterations=8)
    found = tune(net, "root.number", 1e-4, repeats=1, engine=double)
    assert found.met
    # Newton from 2: 1.5, 1.41667, 1.414216, ...; three rounds are the first within 0.8e-4, and the ladder has 2 and 4.
    assert found.settings == {"root.iterations": 4}
    assert found.notes == ("no camera is above this view, so there is only one to look at",)
    assert found.held_out is None


class Pair(Processor):
    """An error of two parts, of which one is dear to lessen and the other cheap."""

    image = Output(Image, doc="Grey.")
    dear = Float(1.0, min=2.0**-8, max=1.0, quality="lower", doc="Costs much.")
    cheap = Float(1.0, min=2.0**-8, max=1.0, quality="lower", doc="Costs little.")

    def process(self, dear, cheap):
        return Image(np.full((1, 1, 1), dear + cheap))


def test_descent_finds_the_least_on_ladders_and_trades_one_knob_for_another() -> None:
    net = Network(lambda id: Pair)
    net.add(Pair, "pair")
    knobs = quality_parameters(net, "pair")
    seen = []

    def rank(settings):
        seen.append(tuple(settings.values()))
        dear, cheap = settings["pair.dear"], settings["pair.cheap"]
        return max(0.0, (dear + cheap) / 0.3 - 1.0), 10.0 / dear + 1.0 / cheap

    found = descend({"pair.dear": 2.0**-4, "pair.cheap": 2.0**-3}, knobs, rank)
    ladder = knobs[0].ladder()
    every = [{"pair.dear": a, "pair.cheap": b} for a in ladder for b in ladder]
    assert found == min(every, key=rank)
    assert found == {"pair.dear": 0.25, "pair.cheap": 2.0**-5}


def test_choices_are_gone_through_beginning_with_the_present_one() -> None:
    net = slab(rule="exact")
    net.add(Tint, "tint")
    net.connect("slab.image", "tint.image")
    rows = combinations_of_choices(quality_parameters(net, "tint.tinted"))
    assert rows[0] == {"slab.rule": "exact", "tint.careful": False}
    assert len(rows) == 4
    assert {tuple(row.values()) for row in rows} == {(a, b) for a in ("left", "exact") for b in (False, True)}


def test_cameras_go_around_the_scene_and_keep_distance_and_target() -> None:
    given = Camera(eye=(10.0, -300.0, 40.0), target=(10.0, 0.0, 5.0), up=(0.0, 0.2, 1.0), field_of_view=20.0)
    assert orbit.turned(given, 0.0, 0.0) == given
    distance = np.linalg.norm(np.subtract(given.eye, given.target))
    eyes = []
    for number in range(1, 9):
        azimuth, elevation = orbit.turns(number)
        assert abs(elevation) <= orbit.MOST_ELEVATION
        other = orbit.turned(given, azimuth, elevation)
        assert other.target == given.target
        assert other.field_of_view == given.field_of_view
        assert np.linalg.norm(np.subtract(other.eye, other.target)) == pytest.approx(distance)
        eyes.append(np.subtract(other.eye, other.target) / distance)
    apart = [np.degrees(np.arccos(np.clip(a @ b, -1, 1))) for i, a in enumerate(eyes) for b in eyes[:i]]
    assert min(apart) > 20.0
    assert np.linalg.norm(np.sum(eyes, axis=0)) < 3.0  # on all sides


def test_a_shared_camera_is_turned_once_and_a_wired_one_not_at_all() -> None:
    assert orbit.Orbit(slab(), "view").places == ("slab.camera",)
    turned = applied(slab(), orbit.Orbit(slab(), "view").settings(2))
    assert turned.get("view.camera") == turned.get("slab.camera") == camera(2)
    net = Network(find)
    net.add(Number, "number")
    assert orbit.Orbit(net, "number").settings(3) == {}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "--max-error"),
        ({"max_error": 0.0}, "above 0"),
        ({"budget_ms": float("inf")}, "finite"),
        ({"max_error": 0.1, "cameras": 0}, "at least 1 camera"),
        ({"max_error": 0.1, "margin": 1.5}, "margin"),
    ],
)
def test_senseless_questions_are_one_sentence(double, arguments, message) -> None:
    with pytest.raises(GraphError, match=message):
        tune(slab(), "view", engine=double, refer=closed, **arguments)


def test_a_view_without_knobs_or_without_a_node_is_refused(double) -> None:
    net = Network(find)
    net.add(Number, "number")
    with pytest.raises(CommandError, match="number: nothing above it declares a quality"):
        tune(net, "number", 0.1, engine=double)
    with pytest.raises(CommandError, match="no such node"):
        tune(net, "numbr", 0.1, engine=double)


def test_it_can_be_cancelled(double) -> None:
    calls = []

    def stop():
        calls.append(1)
        return len(calls) > 3

    with pytest.raises(Cancelled):
        tune(slab(), "view", 0.02, engine=double, refer=closed, cancelled=stop)
