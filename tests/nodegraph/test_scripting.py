from __future__ import annotations

import json
import os
import subprocess
import sys
import threading

import numpy as np
import pytest

import nodegraph
from nodegraph import Float, Input, Output, Processor
from nodegraph.data import Image, Volume
from nodegraph.errors import CommandError, ParameterError, PortError, ProcessError
from nodegraph.network import Network
from nodegraph.scripting import picture_of
from tests.support.steps import Draw, Fail, Seed, Shift, Sum, chain, diamond, ran


@pytest.fixture(autouse=True)
def _count_anew():
    ran.clear()


class Split(Processor):
    """Two outputs."""

    volume = Input(Volume, doc="A field.")
    low = Output(float, doc="Its least value.")
    high = Output(float, doc="Its greatest value.")

    def process(self, volume):
        return self.Outputs(*volume.range)


class Own(Processor):
    """Declares a parameter that is called like a service."""

    out = Output(float, doc="A number.")
    quality = Float(1.0, doc="No level, a number.")

    def process(self, quality):
        return quality


def test_one_processor_on_arrays():
    array = np.arange(8, dtype="f4").reshape(2, 2, 2)
    out = nodegraph.run(Shift, volume=array, by=0.5)
    assert isinstance(out, Volume)
    assert (np.asarray(out) == array + 0.5).all()
    assert not out.data.flags.writeable
    assert (array == np.arange(8).reshape(2, 2, 2)).all()


def test_several_outputs_many_inputs_and_defaults():
    array = np.arange(8, dtype="f4").reshape(2, 2, 2)
    out = nodegraph.run(Split, volume=array)
    assert (out.low, out.high) == (0.0, 7.0)
    assert nodegraph.run(Sum, volumes=[array, array, Volume(array)]).data.max() == 21.0
    assert nodegraph.run(Seed, number=4).data.max() == 4.0
    assert nodegraph.run(Own, quality=3.0) == 3.0
    assert nodegraph.run(Draw, volume=array, size=(5, 3)).size == (5, 3)


def test_a_value_is_keyed_by_itself_and_an_array_each_time_anew():
    """An array may have changed since, and nobody hashes it to find out; a value cannot."""
    volume = Volume(np.ones((2, 2, 2), "f4"))
    for _ in range(2):
        nodegraph.run(Shift, volume=volume, name="value")
    assert ran["value"] == 1
    array = np.ones((2, 2, 2), "f4")
    assert nodegraph.run(Shift, volume=array, name="array").data.max() == 2.0
    array[:] = 5.0
    assert nodegraph.run(Shift, volume=array, name="array").data.max() == 6.0
    assert ran["array"] == 2


def test_a_result_goes_into_the_next_call_without_hashing():
    first = nodegraph.run(Seed, number=7)
    second = nodegraph.run(Shift, volume=first, name="next")
    assert nodegraph.run(Shift, volume=nodegraph.run(Seed, number=7), name="next") is second
    assert ran["next"] == 1


class Scale(Processor):
    """A number times another."""

    number = Input(float, doc="A number.")
    out = Output(float, doc="The product.")
    factor = Float(2.0, doc="The other.")

    def process(self, number, factor):
        ran["scale"] += 1
        return number * factor


def test_plain_numbers_are_given_by_content():
    assert nodegraph.run(Scale, number=3) == 6.0
    assert nodegraph.run(Scale, number=3.0) == 6.0
    assert nodegraph.run(Scale, number=4.0) == 8.0
    assert ran["scale"] == 2


def test_wrong_names_and_values_are_refused_with_the_place():
    array = np.ones((2, 2, 2), "f4")
    with pytest.raises(ParameterError, match="did you mean 'volume'"):
        nodegraph.run(Shift, volumes=array)
    with pytest.raises(PortError, match="nothing is connected"):
        nodegraph.run(Shift)
    with pytest.raises(PortError):
        nodegraph.run(Shift, volume="text")
    with pytest.raises(ParameterError, match="by"):
        nodegraph.run(Shift, volume=array, by="much")
    with pytest.raises(ProcessError, match="it broke"):
        nodegraph.run(Fail, volume=array)


def test_a_built_in_processor_by_id_and_by_name():
    array = np.zeros((5, 5, 5), "f4")
    array[2, 2, 2] = 1.0
    one = nodegraph.run("filter.gaussian_blur", volume=array, sigma=1.0)
    two = nodegraph.run(nodegraph.processors.filter.GaussianBlur, volume=array, sigma=1.0)
    assert one.data[2, 2, 2] < 1.0
    assert (one.data == two.data).all()


def test_a_network_runs_and_shows():
    network = diamond()
    assert network.run("sum").data.max() == 32.0
    network["left"].by = 0.0
    assert network.run("sum.out").data.max() == 22.0
    assert set(network.run(["left", "right"])) == {"left", "right"}
    assert list(network.run()) == ["sum"]
    with pytest.raises(CommandError, match="did you mean"):
        network.run("sim")
    network.add(Fail, "fail")
    network.connect("sum.out", "fail.volume")
    with pytest.raises(ProcessError, match="fail: RuntimeError: it broke"):
        network.run("fail")


def test_several_outputs_of_a_sink_are_a_dict():
    network = chain(0)
    network.add(Split, "split")
    network.connect("seed.out", "split.volume")
    assert network.run("split") == {"low": 1.0, "high": 1.0}
    assert network.run("split.high") == 1.0


def test_a_notebook_gets_a_picture_of_a_network_and_nothing_of_an_unfinished_one():
    network = chain(0)
    assert network._repr_png_() is None
    network.add("output.view", "view", width=2000, height=1000)
    network.add(Draw, "draw")
    network.connect("draw.image", "view.image")
    assert network._repr_png_() is None
    network.connect("seed.out", "draw.volume")
    picture = picture_of(network)
    assert isinstance(picture, Image)
    assert picture.size == (512, 256)
    assert network._repr_png_().startswith(b"\x89PNG")


def test_a_workspace_is_loaded_changed_and_run(tmp_path):
    document = {
        "nodegraph": 1,
        "nodes": {
            "blobs": {"type": "source.synthetic", "version": 1, "params": {"voxels": [8, 8, 8]}},
            "blur": {"type": "filter.gaussian_blur", "version": 1, "inputs": {"volume": "blobs.volume"}},
        },
    }
    path = tmp_path / "small.json"
    path.write_text(json.dumps(document))
    network = nodegraph.load(path)
    network["blur"].sigma = 2.0
    assert network.run("blur").dims == (8, 8, 8)


def test_the_engine_of_the_process_is_one_and_is_made_anew_after_close():
    engines = []
    threads = [threading.Thread(target=lambda: engines.append(nodegraph.engine())) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len({id(engine) for engine in engines}) == 1
    engines[0].close()
    assert nodegraph.engine() is not engines[0]
    assert isinstance(nodegraph.run(Seed), Volume)


def test_an_empty_network_shows_nothing():
    assert Network().run() == {}


FORKED = """
import os, nodegraph
from tests.support.steps import Seed
old = nodegraph.engine()
assert nodegraph.run(Seed, number=3).data.max() == 3.0
child = os.fork()
if child == 0:
    try:
        old.evaluate(nodegraph.Network())
    except nodegraph.GraphError as error:
        assert "forked" in str(error), error
        assert nodegraph.run(Seed, number=4).data.max() == 4.0
        os._exit(7)
    os._exit(1)
print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""


def test_a_forked_process_has_an_engine_of_its_own():
    done = subprocess.run(
        [sys.executable, "-W", "ignore:This process:DeprecationWarning", "-c", FORKED],  # 3.12 warns of fork itself
        capture_output=True,
        text=True,
        timeout=30,
        env={**os.environ, "PYTHONPATH": "."},
    )
    assert (done.stdout.strip(), done.stderr) == ("7", "")


SCRIPT = """
import nodegraph, sys, threading, time
from nodegraph import Processor, Output
class Forever(Processor):
    "Never returns."
    out = Output(float, doc="Nothing.")
    def process(self):
        time.sleep(1000)
net = nodegraph.Network()
net.add(Forever, "forever")
evaluation = nodegraph.engine().submit(net, "forever")
time.sleep(0.1)
heavy = [name for name in ("moderngl", "pyopencl", "asyncio", "platformdirs", "multiprocessing") if name in sys.modules]
print(heavy)
"""


def test_a_program_ends_although_a_library_call_does_not_and_loads_nothing_heavy(tmp_path):
    path = tmp_path / "script.py"
    path.write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, str(path)], capture_output=True, text=True, timeout=20, env={**os.environ, "PYTHONPATH": "."}
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == "[]"
    assert done.stderr == ""
