"""The engine: threads, cancel, devices that fail, and real kernels on each device."""

from __future__ import annotations

import os
import signal
import threading
import time

import numpy as np
import pytest

from nodegraph import Float, Input, Output, Processor
from nodegraph.data import Buffer, Image, Volume
from nodegraph.engine import Engine
from nodegraph.errors import Cancelled, CommandError, DeviceError, DeviceMissing, GraphError
from nodegraph.network import Network
from tests.support.steps import Draw, Fail, Seed, Shift, Wait, chain, diamond, gates, ran, value_of


class FakeDevice:
    """Runs a Python function as a kernel, in four strips."""

    description = "pretended"
    is_hardware = False
    limits: dict = {}

    def __init__(self, name: str, broken: bool = False) -> None:
        self.name = name
        self.broken = broken
        self.real = np.dtype("f8" if name == "cl64" else "f4")
        self.threads: set[int] = set()

    def run(self, kernel, size, *, defines=None, check, progress, **bindings):
        self.threads.add(threading.get_ident())
        for strip in range(4):
            check()
            if self.broken:
                raise DeviceError(f"{self.name}: context lost")
            time.sleep(0.002)
            progress((strip + 1) / 4)
        full = (size[1], size[0], 4)
        return Buffer.on_device(full, self.real, lambda: np.full(full, bindings["value"], self.real))


class FakeDevices:
    """Two devices, of which the first may be broken."""

    def __init__(self, *devices: FakeDevice, refuse: str = "") -> None:
        self.all = devices
        self.refuse = refuse
        self.asked: list[str] = []
        self.closed = False

    def choose(self, name="auto"):
        self.asked.append(name)
        if self.refuse:
            raise DeviceMissing(self.refuse)
        return self.all[0], "it is the first"

    def next_after(self, device):
        left = self.all[self.all.index(device) + 1 :]
        return (left[0], "it is the next") if left else None

    def close(self):
        self.closed = True


class Paint(Processor):
    """Runs a kernel."""

    kernels = ("paint",)
    image = Output(Image, doc="A picture.")
    value = Float(1.0, doc="Of every pixel.")

    def process(self, value, *, size, device):
        ran["paint"] += 1
        return Image(device.run("paint", size, value=value))


@pytest.fixture(autouse=True)
def _count_anew():
    ran.clear()
    gates.clear()


@pytest.fixture(autouse=True)
def kernels(monkeypatch, tmp_path):
    """Kernel files for `Paint` and `Gain`."""
    (tmp_path / "paint.glsl").write_text("uniform float value;\nvec4 pixel(ivec2 at) { return vec4(value); }\n")
    (tmp_path / "gain.glsl").write_text(
        "uniform float gain;\nfield3 volume;\nfloat voxel(ivec3 at) { return gain * fetch3(volume, at); }\n"
    )
    for processor in (Paint, Gain):
        monkeypatch.setattr(processor, "shader_roots", (str(tmp_path),))


@pytest.fixture
def cpu():
    """An engine that must not open a device."""
    with Engine(devices=FakeDevices(refuse="no device may be opened here"), disk=False, workers=2) as engine:
        yield engine


def paint_network():
    network = Network()
    network.add(Paint, "paint")
    return network


# -- evaluating -----------------------------------------------------------------------------------------------------


def test_a_network_without_kernels_opens_no_device(cpu):
    assert value_of(cpu.evaluate(diamond(), "sum"), "sum") == 32.0
    assert cpu.device_in_use is None
    assert cpu._devices.asked == []


def test_edits_after_submit_do_not_change_the_evaluation(cpu):
    network = diamond()
    gates["hold"] = threading.Event()
    network.add(Wait, "wait", gate="hold")
    network.connect("sum.out", "wait.volume")
    evaluation = cpu.submit(network, "wait")
    network["left"].by = 1000.0
    gates["hold"].set()
    assert value_of(evaluation.result(20), "wait") == 32.0


def test_the_latest_of_a_channel_wins_and_other_channels_are_left_alone(cpu):
    gates["slow"] = threading.Event()
    slow = Network()
    slow.add(Wait, "wait", gate="slow")
    other = cpu.submit(diamond(), "sum", channel="other")
    first = cpu.submit(slow, "wait", channel="drag")
    while not ran["slow"]:
        time.sleep(0.001)
    second = cpu.submit(chain(1), "n0", channel="drag")
    third = cpu.submit(chain(2), "n1", channel="drag")
    assert value_of(third.result(20), "n1") == 3.0
    assert value_of(other.result(20), "sum") == 32.0
    for evaluation in (first, second):
        with pytest.raises(Cancelled):
            evaluation.result(20)
    gates["slow"].set()


def test_cancel_abandons_a_library_call_and_nothing_waits_for_it(cpu):
    """Both workers are stuck in calls that do not return; a later evaluation still runs at once."""
    network = Network()
    for name in ("one", "two", "three"):
        gates[name] = threading.Event()
        network.add(Wait, name, gate=name)
    evaluation = cpu.submit(network, ["one", "two", "three"])
    while not (ran["one"] and ran["two"]):
        time.sleep(0.001)
    evaluation.cancel()
    with pytest.raises(Cancelled):
        evaluation.result(5)
    assert value_of(cpu.evaluate(diamond(), "sum"), "sum") == 32.0
    assert ran["three"] == 0
    for gate in gates.values():
        gate.set()
    assert cpu._workers.join(5)
    report = cpu.evaluate(network, ["one"])
    assert report.ran == ["one"], "the result of an abandoned call is thrown away"
    assert ran["one"] == 2


def test_a_cancelled_failure_is_not_remembered(cpu):
    network = chain(1)
    network.add(Fail, "fail")
    network.connect("n0.out", "fail.volume")
    evaluation = cpu.submit(network, "fail", on_event=lambda event: evaluation.cancel())
    with pytest.raises(Cancelled):
        evaluation.result(5)
    assert "it broke" in str(cpu.evaluate(network, "fail").errors["fail"])
    cpu.evaluate(network, "fail")
    assert ran["fail"] == 1
    cpu.retry()
    cpu.evaluate(network, "fail")
    assert ran["fail"] == 2


def test_ctrl_c_cancels_and_the_engine_lives_on(cpu):
    gates["stuck"] = threading.Event()
    network = Network()
    network.add(Wait, "wait", gate="stuck")

    def interrupt():
        while not ran["stuck"]:
            time.sleep(0.001)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt, daemon=True).start()
    with pytest.raises(KeyboardInterrupt):
        cpu.evaluate(network, "wait")
    assert value_of(cpu.evaluate(diamond(), "sum"), "sum") == 32.0
    gates["stuck"].set()


def test_call_runs_on_the_engines_thread_also_while_a_worker_is_waited_for(cpu):
    assert cpu.call(threading.get_ident) == cpu._thread.ident
    assert cpu.call(lambda: cpu.call(threading.get_ident)) == cpu._thread.ident
    with pytest.raises(ZeroDivisionError):
        cpu.call(lambda: 1 / 0)
    gates["busy"] = threading.Event()
    network = Network()
    network.add(Wait, "wait", gate="busy")
    evaluation = cpu.submit(network, "wait")
    while not ran["busy"]:
        time.sleep(0.001)
    assert cpu.call(lambda: 7) == 7
    assert not evaluation.done()
    gates["busy"].set()
    assert evaluation.result(5).ok


def test_an_evaluation_on_the_engines_own_thread_is_refused_instead_of_waiting_forever(cpu):
    with pytest.raises(GraphError, match="own thread"):
        cpu.call(lambda: cpu.evaluate(diamond(), "sum"))


def test_what_planning_raises_reaches_the_caller(cpu):
    with pytest.raises(CommandError, match="no such node"):
        cpu.evaluate(diamond(), "nowhere")
    gates["never"] = threading.Event()
    network = Network()
    network.add(Wait, "wait", gate="never")
    evaluation = cpu.submit(network, "wait")
    with pytest.raises(TimeoutError):
        evaluation.result(0.01)
    gates["never"].set()
    assert evaluation.result(5).ok


def test_close_ends_what_runs_and_refuses_what_comes():
    engine = Engine(devices=FakeDevices(), disk=False)
    gates["held"] = threading.Event()
    network = Network()
    network.add(Wait, "wait", gate="held")
    running = engine.submit(network, "wait")
    waiting = engine.submit(diamond(), "sum")
    while not ran["held"]:
        time.sleep(0.001)
    engine.close()
    engine.close()
    assert not engine._thread.is_alive()
    for evaluation in (running, waiting):
        with pytest.raises(Cancelled):
            evaluation.result(5)
    with pytest.raises(GraphError, match="closed"):
        engine.evaluate(diamond(), "sum")
    with pytest.raises(GraphError, match="closed"):
        engine.call(lambda: 1)
    gates["held"].set()


def test_two_engines_share_nothing(cpu):
    network = diamond()
    with Engine(devices=FakeDevices(), disk=False) as other:
        assert cpu.evaluate(network, "sum").ran
        assert other.evaluate(network, "sum").ran
    assert ran["sum"] == 2
    assert cpu.evaluate(network, "sum").ran == []


def test_many_threads_ask_at_once(cpu):
    network = diamond()
    found = []
    threads = [
        threading.Thread(target=lambda: found.append(value_of(cpu.evaluate(network, "sum"), "sum"))) for _ in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(20)
    assert found == [32.0] * 8
    assert ran["sum"] == 1


# -- devices ----------------------------------------------------------------------------------------------------------


def test_the_device_is_announced_once_and_kernels_run_on_the_engines_thread():
    device = FakeDevice("gl")
    notes = []
    with Engine(devices=FakeDevices(device), disk=False) as engine:
        network = paint_network()
        for value in (1.0, 2.0):
            network["paint"].value = value
            report = engine.evaluate(
                network, "paint", size=(4, 2), on_event=lambda e: notes.append(e.text) if e.kind == "note" else None
            )
            assert report.values["paint", "image"].color[1, 3, 0] == value
            assert 0.008 <= report.device_seconds["paint"] <= report.timings["paint"]
        assert device.threads == {engine._thread.ident}
        assert engine.device_in_use == {"name": "gl", "description": "pretended", "reason": "it is the first"}
    assert notes == ["device it is the first"]


def test_strips_are_places_to_cancel_and_to_report_progress():
    with Engine(devices=FakeDevices(FakeDevice("gl")), disk=False) as engine:
        seen = []
        engine.evaluate(
            paint_network(), "paint", on_event=lambda e: seen.append(e.fraction) if e.kind == "progress" else 0
        )
        assert seen[-1] == 1.0
        network = paint_network()
        network["paint"].value = 5.0
        evaluation = engine.submit(
            network, "paint", on_event=lambda e: evaluation.cancel() if e.kind == "progress" else 0
        )
        with pytest.raises(Cancelled):
            evaluation.result(5)
        assert engine.evaluate(network, "paint").ran == ["paint"]


def test_a_node_moves_to_the_next_device_once_and_says_so_also_from_the_cache():
    devices = FakeDevices(FakeDevice("gl", broken=True), FakeDevice("cl"))
    with Engine(devices=devices, disk=False) as engine:
        network = paint_network()
        report = engine.evaluate(network, "paint", size=(2, 2))
        assert report.ok
        assert ran["paint"] == 2
        assert report.notes == ["paint: gl failed (gl: context lost); running on cl instead"]
        again = engine.evaluate(network, "paint", size=(2, 2))
        assert again.ran == []
        assert again.notes == report.notes


def test_a_node_fails_when_the_next_device_fails_too_or_there_is_none():
    for devices in (
        FakeDevices(FakeDevice("gl", broken=True), FakeDevice("cl", broken=True), FakeDevice("cl64")),
        FakeDevices(FakeDevice("cl64", broken=True)),
    ):
        ran.clear()
        with Engine(devices=devices, disk=False) as engine:
            network = paint_network()
            network.add(Seed, "seed")
            report = engine.evaluate(network, ["paint", "seed"])
            assert report.states["paint"] == "failed"
            assert report.states["seed"] == "clean"
            assert "context lost" in str(report.errors["paint"])
            assert ran["paint"] == min(2, len(devices.all))
            assert report.exit_code == 1


def test_a_device_that_is_not_there_is_an_error_of_the_call():
    with (
        Engine("gl", devices=FakeDevices(refuse="gl: no OpenGL here; install libegl1"), disk=False) as engine,
        pytest.raises(DeviceMissing, match="install libegl1"),
    ):
        engine.evaluate(paint_network(), "paint")


class Undeclared(Processor):
    """Runs a kernel that it does not declare."""

    kernels = ("paint",)
    image = Output(Image, doc="A picture.")

    def process(self, *, size, device):
        return Image(device.run("pain", size))


class Rasters(Processor):
    """Asks for the rasteriser."""

    image = Output(Image, doc="A picture.")

    def process(self, *, gl):
        return Image(np.zeros((1, 1, 4), "f4"))


def test_only_declared_kernels_run_and_gl_needs_opengl():
    with Engine(devices=FakeDevices(FakeDevice("cl")), disk=False) as engine:
        network = Network()
        network.add(Undeclared, "bad")
        network.add(Rasters, "raster")
        report = engine.evaluate(network, ["bad", "raster"])
        assert "did you mean 'paint'" in str(report.errors["bad"])
        assert "needs OpenGL" in str(report.errors["raster"])


def test_what_a_worker_reads_is_on_the_host_before_it_starts():
    """Fetching on a worker would have to wait for the engine's thread."""
    threads = []

    class Recording(FakeDevice):
        def run(self, kernel, size, **bindings):
            def fetch():
                threads.append(threading.get_ident())
                return np.ones((size[1], size[0], 4), "f4")

            return Buffer.on_device((size[1], size[0], 4), "f4", fetch)

    class Mean(Processor):
        """Reads a picture."""

        image = Input(Image, doc="A picture.")
        out = Output(float, doc="Its mean.")

        def process(self, image):
            return float(image.color.mean())

    with Engine(devices=FakeDevices(Recording("gl")), disk=False) as engine:
        network = paint_network()
        network.add(Mean, "mean")
        network.connect("paint.image", "mean.image")
        assert engine.evaluate(network, "mean").values["mean", "out"] == 1.0
        assert threads == [engine._thread.ident]


# -- real kernels -----------------------------------------------------------------------------------------------------


class Gain(Processor):
    """Multiply on a device."""

    kernels = ("gain",)
    volume = Input(Volume, doc="A field.")
    out = Output(Volume, doc="The product.")
    gain = Float(2.0, doc="The factor.")

    def process(self, volume, gain, *, device):
        return volume.with_data(device.run("gain", volume.dims, volume=volume, gain=gain))


@pytest.fixture(scope="module", params=("gl", "cl", "cl64"))
def real(request):
    engines = [Engine(request.param, cache_bytes=0, disk=False), Engine(request.param, disk=False)]
    yield engines
    for engine in engines:
        devices = engine.devices.opened
        engine.close()
        assert [(device.memory.objects, device.memory.bytes) for device in devices] == [(0, 0)] * len(devices)


def kernel_network():
    """A field, multiplied twice on the device, shifted on the host, drawn."""
    network = Network()
    network.add(Seed, "seed", edge=4)
    network.add(Gain, "one")
    network.add(Gain, "two", gain=3.0)
    network.add(Shift, "shift")
    network.add(Draw, "draw")
    for source, target in (
        ("seed.out", "one.volume"), ("one.out", "two.volume"), ("two.out", "shift.volume"), ("shift.out", "draw.volume")
    ):  # fmt: skip
        network.connect(source, target)
    return network


def test_kernels_and_host_processors_make_one_network(real):
    network = kernel_network()
    for engine in real:
        report = engine.evaluate(network, ["draw", "two"], size=(3, 2))
        assert report.ok, report.errors
        assert report.values["draw", "image"].color[0, 0, 0] == 7.0
        # Read on this thread, fetched on the engine's.
        assert report.values["two", "out"].data[0, 0, 0] == 6.0
    assert real[1].evaluate(network, ["draw", "two"], size=(3, 2)).ran == []


def test_device_objects_stay_constant_without_a_cache(real):
    engine = real[0]
    network = kernel_network()
    counts = set()
    for i in range(30):
        network["one"].gain = float(i)
        engine.evaluate(network, "draw", size=(2, 2))
        memory = engine.devices.opened[0].memory
        engine.call(memory.drain)
        counts.add(memory.objects)
    assert len(counts) == 1


def test_two_threads_read_one_result_from_the_device(real):
    """The engine's thread reads a buffer while another thread waits for it to fetch the same one."""
    engine = real[1]
    value = engine.evaluate(kernel_network(), "one").values["one", "out"]
    found = []
    other = threading.Thread(target=lambda: found.append(value.data[0, 0, 0]), daemon=True)

    def read():
        other.start()
        time.sleep(0.05)
        return value.data[0, 0, 0]

    evaluation = threading.Thread(target=lambda: found.append(engine.call(read)), daemon=True)
    evaluation.start()
    evaluation.join(5)
    other.join(5)
    assert found == [2.0, 2.0]


@pytest.mark.parametrize("name", ["gl", "cl"])
def test_budgets_hold_while_many_things_are_made(name):
    """16 kB a field; cache and device share a budget here, since the devices of the tests use the host's memory."""
    with Engine(name, cache_bytes=100_000, device_bytes=200_000, disk=False) as engine:
        network = kernel_network()
        network["seed"].edge = 16
        devices = engine.devices
        most = [0, 0]

        def watch(event):
            if event.kind == "finished" and devices.opened:
                memory = devices.opened[0].memory
                most[0] = max(most[0], memory.bytes)
                most[1] = max(most[1], memory.budget.used)

        for i in range(40):
            network["one"].gain = float(i)
            report = engine.evaluate(network, ["draw", "two"], size=(8, 8), on_event=watch)
            assert report.ok, report.errors
            assert report.values["two", "out"].data[0, 0, 0] == 3.0 * i
            assert engine.cache.nbytes <= 100_000
        assert devices.opened[0].is_host_memory
        assert 0 < most[0] <= most[1] <= devices.opened[0].memory.budget.limit == 300_000
