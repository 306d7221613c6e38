from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest

from nodegraph import Bool, File, Float, Input, Output, Processor
from nodegraph.data import Camera, Volume
from nodegraph.fingerprint import (
    array_key,
    canonical,
    code_of,
    content_key,
    digest,
    file_state,
    function_key,
    unique_key,
)
from nodegraph.network import Network
from nodegraph.plan import Planner
from tests.support.steps import Seed, Shift, chain, diamond


def fingerprints(network, sinks=None, **asked):
    return {task.path: task.fingerprint for task in Planner().plan(network.flatten(), sinks, **asked).tasks}


def test_lists_of_parts_do_not_collide_by_joining():
    assert digest("ab", "c") != digest("a", "bc")
    assert digest("a") != digest("a", "")
    assert digest("a") == digest(b"a")


def test_canonical_ignores_order_of_keys_and_tells_zeros_apart():
    assert canonical({"b": 1, "a": (1.0, 2)}) == canonical({"a": [1.0, 2], "b": 1})
    assert canonical(-0.0) != canonical(0.0)
    assert canonical(float("nan")) == canonical(float("nan"))
    assert canonical(float("inf")) != canonical("inf")
    assert canonical(np.float32(0.5)) == canonical(0.5)


def test_a_parameter_changes_its_node_and_what_stands_below_only():
    network = diamond()
    before = fingerprints(network)
    network["left"].by = 11.0
    after = fingerprints(network)
    assert before["seed"] == after["seed"]
    assert before["right"] == after["right"]
    assert before["left"] != after["left"]
    assert before["sum"] != after["sum"]
    network["left"].by = 10.0
    assert fingerprints(network) == before


def test_wire_order_counts():
    network = diamond()
    before = fingerprints(network)
    network.disconnect("sum.volumes", "left.out")
    network.connect("left.out", "sum.volumes")
    assert fingerprints(network)["sum"] != before["sum"]


def test_equal_networks_have_equal_fingerprints_under_any_names():
    one, two = chain(3), Network()
    two.add(Seed, "start")
    two.add(Shift, "a")
    two.connect("start.out", "a.volume")
    assert fingerprints(one)["n0"] == fingerprints(two)["a"]


class Hidden(Processor):
    """One parameter means something only when another says so."""

    out = Output(float, doc="A number.")
    lit = Bool(False, doc="Whether strength counts.")
    strength = Float(1.0, doc="Counts when lit.", visible_if={"lit": True})

    def process(self, lit, strength):
        return strength


def test_a_parameter_that_is_not_visible_does_not_count():
    network = Network()
    network.add(Hidden, "hidden", strength=1.0)
    before = fingerprints(network)
    network["hidden"].strength = 5.0
    assert fingerprints(network) == before
    network["hidden"].lit = True
    lit = fingerprints(network)
    network["hidden"].strength = 6.0
    assert fingerprints(network) != lit


class Reads(Processor):
    """Reads one file and writes another."""

    out = Output(float, doc="Length.")
    path = File(doc="Read.")
    target = File(doc="Written.", write=True)

    def process(self, path, target):
        return float(os.stat(path).st_size)


def test_files_count_by_size_and_time_and_written_ones_do_not(tmp_path):
    read, written = tmp_path / "in", tmp_path / "out"
    network = Network()
    network.add(Reads, "reads", path=str(read), target=str(written))
    planner = Planner()

    def key():
        return planner.plan(network.flatten()).tasks[0].fingerprint

    missing = key()
    read.write_bytes(b"1")
    there = key()
    assert there != missing
    written.write_bytes(b"1")
    assert key() == there
    os.utime(read, ns=(1, 1))
    assert key() != there
    assert "missing" in file_state(tmp_path / "nowhere")


class Sized(Processor):
    """Names some services."""

    volume = Input(Volume, required=False, doc="Not looked at.")
    out = Output(float, doc="A number.")

    def process(self, volume, *, size, quality, wanted):
        return 1.0


def test_services_count_where_they_are_named_and_nowhere_else():
    network = chain(1)
    network.add(Sized, "sized")
    network.connect("n0.out", "sized.volume")
    small, large = fingerprints(network, size=(8, 8)), fingerprints(network, size=(16, 16))
    assert small["sized"] != large["sized"]
    assert small["n0"] == large["n0"]
    assert fingerprints(network, size=(8, 8), quality="interactive")["sized"] != small["sized"]


class OnDevice(Processor):
    """Names the device."""

    out = Output(float, doc="A number.")

    def process(self, *, device):
        return 1.0


def test_the_device_counts_where_it_is_named():
    network = Network()
    network.add(OnDevice, "one")
    keys = {
        name: Planner(lambda n=name: n).plan(network.flatten()).tasks[0].fingerprint for name in ("gl", "cl", "cl64")
    }
    assert len(set(keys.values())) == 3


def test_a_planner_asks_for_no_device_that_no_task_names():
    def refuse() -> str:
        raise AssertionError("a device was asked for")

    assert len(Planner(refuse).plan(chain(2).flatten()).tasks) == 3


def make(name: str, version: int = 1) -> type[Processor]:
    space: dict = {}
    exec(
        f"class {name}(Processor):\n    'd'\n    out = Output(float, doc='d')\n    version = {version}\n"
        f"    def process(self):\n        return {len(name)}.0\n",
        {"Processor": Processor, "Output": Output, "__name__": "typed.in"},
        space,
    )
    return space[name]


def test_version_name_and_code_count():
    assert code_of(make("One")).digest == code_of(make("One")).digest
    assert code_of(make("One")).digest != code_of(make("One", 2)).digest
    assert code_of(make("One")).digest != code_of(make("Three")).digest


def test_an_edited_kernel_changes_the_fingerprint(tmp_path):
    (tmp_path / "common").mkdir()
    shared = tmp_path / "common" / "shared.glsl"
    shared.write_text("float twice(float x) { return 2.0 * x; }\n")
    (tmp_path / "kernel.glsl").write_text(
        '#include "common/shared.glsl"\nfloat pixel(ivec2 at) { return twice(1.0); }\n'
    )

    class Runs(Processor):
        """Runs a kernel."""

        kernels = ("kernel",)
        shader_roots = (str(tmp_path),)
        out = Output(float, doc="A number.")

        def process(self, *, device):
            return 1.0

    network = Network()
    network.add(Runs, "runs")
    planner = Planner()
    before = planner.plan(network.flatten()).tasks[0].fingerprint
    assert planner.plan(network.flatten()).tasks[0].fingerprint == before
    shared.write_text("float twice(float x) { return x + x; }\n")
    after = planner.plan(network.flatten()).tasks[0].fingerprint
    assert after != before


def test_given_values_are_never_equal():
    assert unique_key() != unique_key()


def test_content_keys():
    array = np.arange(24, dtype="f4").reshape(2, 3, 4)
    assert array_key(array) == array_key(array.copy())
    assert array_key(array) != array_key(array.reshape(3, 2, 4))
    assert array_key(array) != array_key(array.view("i4"))
    assert array_key(array[:, ::2]) == array_key(array[:, ::2].copy())
    assert array_key(np.zeros((0, 3))) == array_key(np.zeros((0, 3)))
    assert content_key(Volume(array)) == content_key(Volume(array.copy()))
    assert content_key(Volume(array)) != content_key(Volume(array, np.diag([2.0, 1, 1, 1])))
    assert content_key(Camera()) == content_key(Camera())
    assert content_key([1, 2]) != content_key([1.0, 2])
    assert content_key({"a": 1, "b": 2}) == content_key({"b": 2, "a": 1})
    with pytest.raises(TypeError, match="no key"):
        content_key(object())
    with pytest.raises(TypeError, match="objects"):
        array_key(np.array([object()]))


def outer():
    def inner():
        return 1

    return inner


def test_functions_without_a_name_of_their_own_are_refused():
    assert function_key(outer) == function_key(outer)
    assert function_key(outer) != function_key(make)
    for function, reason in (
        (lambda: 1, "lambda"),
        (outer(), "nested"),
        (Network.flatten, "method"),
        (len, "function"),
    ):
        with pytest.raises(TypeError, match=reason):
            function_key(function)


@pytest.mark.slow
def test_fingerprints_are_the_same_in_another_process():
    """The disk cache lives on it. The hash seed differs between the two."""
    code = (
        "from tests.support.steps import diamond\nfrom nodegraph.plan import Planner\n"
        "print(Planner().plan(diamond().flatten()).tasks[-1].fingerprint.hex())"
    )
    found = {
        subprocess.run(
            [sys.executable, "-c", code],
            check=True, capture_output=True, text=True, env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": "."},
        ).stdout
        for seed in ("1", "2")
    }  # fmt: skip
    assert len(found) == 1
    assert len(found.pop().strip()) == 40
