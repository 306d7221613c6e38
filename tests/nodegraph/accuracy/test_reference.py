"""References: against closed forms, where they converge and where they cannot, and kept on disk."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from nodegraph import Int, workspace
from nodegraph.accuracy.reference import agreement, reference
from nodegraph.data import Image, Volume
from nodegraph.disk_cache import DiskCache
from nodegraph.engine import Engine
from nodegraph.errors import Cancelled, CommandError, DeviceError, DeviceMissing, ParameterError
from nodegraph.network import Network
from tests.support.slab import Eye as Camera
from tests.support.slab import Noise, Number, Root, Slab, Tint, exact, find, left_sum, ran, slab


@pytest.fixture(scope="module")
def double():
    """An engine in double precision that keeps nothing on disk."""
    with Engine("cl64", disk=False) as engine:
        yield engine


@pytest.fixture
def root_net():
    net = Network(find)
    net.add(Root, "root")
    return net


def test_halving_ends_when_two_rounds_agree_and_comes_as_near_as_the_closed_form_says(double) -> None:
    bound = 2e-3
    net = slab(step=0.25)
    found = reference(net, "view", bound=bound, engine=double)
    steps = [0.25 / 2**k for k in range(12)]
    eye = Camera()
    apart = [
        np.abs(left_sum(eye, round(1 / a)) - left_sum(eye, round(1 / b))).max() for a, b in itertools.pairwise(steps)
    ]
    expected = next(k for k, difference in enumerate(apart) if difference <= bound)
    assert found.converged
    assert found.rounds == expected + 2
    assert found.settings == {"slab.step": steps[expected + 1], "slab.rule": "left"}
    assert found.difference == pytest.approx(apart[expected], rel=1e-9)
    assert found.value.color.dtype == np.float64
    np.testing.assert_allclose(found.value.color[0, :, 0], exact(), atol=2 * bound)
    assert found.mask.shape == (2, 4)
    assert found.mask.all()
    assert found.left_out == 0


def test_the_network_is_not_touched(double) -> None:
    net = slab(step=0.25)
    before, revision = workspace.dumps(net), net.revision
    reference(net, "view", bound=0.05, engine=double)
    assert (workspace.dumps(net), net.revision) == (before, revision)


def test_what_does_not_converge_is_said_counted_and_masked(double) -> None:
    net = Network(find)
    net.add(Noise, "noise")
    found = reference(net, "noise", engine=double, max_rounds=4)
    assert not found.converged
    assert found.rounds == 4
    assert found.difference == 1.0  # 4 % 3 and 8 % 3
    expected = np.ones((2, 4), bool)
    expected[0, 0] = False
    np.testing.assert_array_equal(found.mask, expected)
    assert found.left_out == 1
    assert found.share_left_out == 1 / 8
    assert found.summary() == ("the reference did not converge in 4 rounds: 1 of 8 pixels still differ, by up to 1")


@pytest.mark.parametrize("output", ["number", "field", "table"])
def test_numbers_volumes_and_tables_walk_through_what_is_declared(double, root_net, output) -> None:
    found = reference(root_net, f"root.{output}", bound=1e-12, engine=double)
    assert found.converged
    assert found.settings == {"root.iterations": 8}
    assert found.rounds == 3
    value = found.value
    root = value if output == "number" else value.data if output == "field" else value["root"]
    np.testing.assert_allclose(root, np.sqrt(2.0), rtol=1e-15)
    assert (found.mask is not None) == (output == "field")


def test_a_walk_that_is_used_up_before_it_agrees_has_not_converged(double) -> None:
    class Slow(Root):
        """Never near."""

        iterations = Int(1, min=1, quality="higher", reference=(1, 2), doc="How often.")

    net = Network(find)
    net.add(Slow, "root")
    found = reference(net, "root.number", engine=double)
    assert (found.rounds, found.converged, found.mask) == (2, False, None)
    assert found.difference == pytest.approx((1.5 - 17 / 12) / 1.5)
    assert "the last two differ by 0.056" in found.summary()


def test_choices_and_switches_take_their_most_accurate_value_and_show_what_was_hidden(double) -> None:
    net = slab(step=0.5)
    net.add(Tint, "tint")
    net.disconnect("view.image")
    net.connect("slab.image", "tint.image")
    net.connect("tint.tinted", "view.image")
    found = reference(net, "view", bound=0.1, engine=double)
    assert found.settings["tint.careful"] is True
    assert found.settings["tint.rounds"] == 4  # only visible with `careful`
    assert found.settings["slab.rule"] == "left"  # declared, against the general rule


def test_a_reference_follows_no_expression_and_tells_what_a_wire_decides(double) -> None:
    net = slab()
    net.add(Slab, "other")
    net.link("other.step", "coarse")
    net.link("slab.step", "fine")
    net.derive("fine", "coarse / 2")
    net.add(Tint, "tint")
    net.add(Number, "number")
    net.connect("slab.image", "tint.image")
    net.connect("number.value", "tint.width")
    found = reference(net, "tint.tinted", bound=0.02, engine=double)
    assert found.converged
    assert found.settings["slab.step"] < 0.125
    assert found.notes == ("tint.width: a wire decides its value, so the reference takes it as it is",)


def test_without_anything_to_refine_one_round_is_the_reference(double) -> None:
    net = Network(find)
    net.add(Number, "number")
    found = reference(net, "number", engine=double)
    assert (found.value, found.rounds, found.converged, found.difference) == (0.5, 1, True, 0.0)
    assert "nothing in it can be refined" in found.summary()


def test_it_is_kept_on_disk_for_every_process_and_made_anew_when_something_changes(tmp_path) -> None:
    net = slab(step=0.25)
    with Engine("cl64", disk=DiskCache(tmp_path)) as engine:
        first = reference(net, "view", bound=0.05, engine=engine)
    with Engine("cl64", disk=DiskCache(tmp_path)) as engine:
        ran.clear()
        again = reference(net, "view", bound=0.05, engine=engine)
        assert ran["slab"] == 0
        assert again.kept
        assert not first.kept
        np.testing.assert_array_equal(again.value.color, first.value.color)
        np.testing.assert_array_equal(again.mask, first.mask)
        assert (again.difference, again.rounds, again.settings) == (first.difference, first.rounds, first.settings)
        assert not reference(net, "view", bound=0.01, engine=engine).kept
        net.set("camera", Camera((300.0, -500.0, 0.0)))
        moved = reference(net, "view", bound=0.05, engine=engine)
        assert not moved.kept
        assert ran["slab"] > 0
        assert not np.array_equal(moved.value.color, first.value.color)


def test_without_a_disk_it_is_kept_while_the_engine_lives(double) -> None:
    net = slab(step=0.3)
    assert not reference(net, "view", bound=0.05, engine=double).kept
    assert reference(net, "view", bound=0.05, engine=double).kept


def test_no_double_precision_is_one_sentence(monkeypatch) -> None:
    from nodegraph.compute import devices

    def missing(name, roots=None):
        raise DeviceMissing("cl64: no OpenCL device computes in double precision; install pocl-opencl-icd")

    monkeypatch.setattr(devices, "open_device", missing)
    with Engine("cl64", disk=False) as engine, pytest.raises(DeviceError, match="needs double precision") as caught:
        reference(slab(), "view", engine=engine)
    assert "\n" not in str(caught.value)
    assert "pocl-opencl-icd" in str(caught.value)


def test_cancel_and_progress(double) -> None:
    shown = []
    net = slab(step=0.11)
    reference(net, "view", bound=0.04, engine=double, show=lambda text, fraction: shown.append(text))
    assert "reference, round 1: slab" in shown
    assert "reference, round 2: slab" in shown
    with pytest.raises(Cancelled):
        reference(slab(step=2.0**-12), "view", engine=double, cancelled=lambda: True)


def test_bad_questions_are_one_sentence(double, root_net) -> None:
    with pytest.raises(CommandError, match="no such node"):
        reference(root_net, "rot", engine=double)
    with pytest.raises(CommandError, match=r"root: shows 3 values.*name one of root\.number"):
        reference(root_net, "root", engine=double)
    with pytest.raises(ParameterError, match="above 0"):
        reference(root_net, "root.number", bound=0.0, engine=double)
    with pytest.raises(ParameterError, match="at least 2"):
        reference(root_net, "root.number", max_rounds=1, engine=double)


def test_agreement_looks_at_every_channel_and_at_what_is_not_finite() -> None:
    one = np.zeros((1, 3, 4))
    other = one.copy()
    other[0, 1, 3] = 0.5
    other[0, 2, 0] = np.nan
    mask, difference = agreement(Image(other), Image(one), 1e-3)
    assert mask.tolist() == [[True, False, False]]
    assert difference == np.inf
    field = np.zeros((1, 1, 2))
    field[0, 0, 1] = 1000.0
    mask, difference = agreement(Volume(field + np.array([0.0, 1.0])), Volume(field), 1e-2)
    assert mask.all()
    assert difference == pytest.approx(1 / 1001)
