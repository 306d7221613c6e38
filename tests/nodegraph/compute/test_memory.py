"""One owner of device objects: counts, budgets, eviction, and what threads may do."""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from nodegraph.compute.devices import open_device
from nodegraph.compute.memory import Budget, Memory
from nodegraph.data import Volume
from nodegraph.data.buffer import Buffer
from nodegraph.errors import DeviceError
from nodegraph.shaders import Source

SCALE = Source.of(
    "field3 v;\nuniform float gain;\nfloat voxel(ivec3 at) { return gain * fetch3(v, at); }", "tests/scale.glsl"
)
SHAPE = (16, 16, 16)
NBYTES = 16**3 * 4


@pytest.fixture(params=["gl", "cl", "cl64"])
def own(request: pytest.FixtureRequest) -> Iterator[Any]:
    """A device of this test's own, so that nobody else's objects are counted."""
    device = open_device(request.param)
    yield device
    device.close()


def volume(value: float = 1.0) -> Volume:
    return Volume(np.full(SHAPE, value, np.float32))


class Thing:
    """Stands for a device object."""

    def __init__(self) -> None:
        self.released = 0

    def release(self) -> None:
        self.released += 1


def add(memory: Memory, nbytes: int, owner: Buffer | None = None, **more: Any) -> tuple[Thing, Any]:
    thing = Thing()
    memory.reserve(nbytes, "test")
    return thing, memory.add(thing, nbytes, "input", thing.release, owner=owner, key="f4", **more)


def host() -> Buffer:
    return Buffer(np.zeros(4))


def on_device() -> tuple[Buffer, dict[str, Any]]:
    """A buffer whose data lies on a device, and what Memory is told of its object."""
    saved: list[np.ndarray[Any, Any]] = []
    buffer = Buffer.on_device((4,), np.float64, lambda: saved[0])
    return buffer, {"read_back": lambda: saved.append(np.ones(4)), "saved": lambda: bool(saved)}


def test_counts_and_release_on_death() -> None:
    memory = Memory()
    buffer = host()
    thing, entry = add(memory, 100, buffer)
    assert (memory.objects, memory.bytes, memory.by_purpose()) == (1, 100, {"input": 100})
    assert memory.find(buffer, "f4") is entry
    assert memory.find(buffer, "u2") is None
    assert memory.find(host(), "f4") is None
    del buffer
    gc.collect()
    assert thing.released == 0
    memory.drain()
    assert (thing.released, memory.objects, memory.bytes) == (1, 0, 0)


def test_the_oldest_copies_of_host_data_go_first() -> None:
    memory = Memory(250)
    buffers = [host() for _ in range(3)]
    things = [add(memory, 100, buffer)[0] for buffer in buffers[:2]]
    memory.find(buffers[0], "f4")  # the first was used last
    add(memory, 100, buffers[2])
    assert [thing.released for thing in things] == [0, 1]
    assert memory.bytes == 200


def test_dear_results_are_read_back_only_after_the_cache_was_asked() -> None:
    asked: list[int] = []
    memory = Memory(250, on_pressure=asked.append)
    result, told = on_device()
    thing, _ = add(memory, 100, result, **told)
    copy = host()
    copied, _ = add(memory, 100, copy)
    add(memory, 150, host_kept := host())
    assert (copied.released, thing.released, asked) == (1, 0, [])
    add(memory, 100, other := host())
    assert (thing.released, asked) == (0, [])  # the copy of 150 went instead
    with memory.pinned([memory.find(other, "f4")]):
        add(memory, 150, host_kept)
    assert asked == [100]
    assert thing.released == 1
    assert result.array.tolist() == [1.0] * 4


def test_what_the_cache_lets_go_is_enough() -> None:
    results = []

    def let_go(wanted: int) -> None:
        assert wanted == 50
        results.clear()

    memory = Memory(150, on_pressure=let_go)
    buffer, told = on_device()
    thing, _ = add(memory, 100, buffer, **told)
    results.append(buffer)
    del buffer
    add(memory, 100, host())
    assert thing.released == 1


def test_pinned_entries_stay_and_what_does_not_fit_is_refused() -> None:
    memory = Memory(150, name="gl")
    buffer = host()
    thing, entry = add(memory, 100, buffer)
    with memory.pinned([entry]), pytest.raises(DeviceError, match=r"^gl: 100 bytes for test do not fit, 100 of .* 150"):
        memory.reserve(100, "test")
    assert thing.released == 0
    memory.reserve(100, "test")
    assert thing.released == 1
    with pytest.raises(DeviceError, match="raise the budget"):
        memory.reserve(151, "test")


def test_owners_that_share_a_budget_count_together() -> None:
    budget = Budget(200)
    cache_bytes = 120
    budget.watch(lambda: cache_bytes)
    memory = Memory(budget)
    add(memory, 80, buffer := host())
    assert (budget.used, budget.room) == (200, 0)
    with memory.pinned([memory.find(buffer, "f4")]), pytest.raises(DeviceError):
        memory.reserve(1, "test")
    memory.close()
    assert budget.used == 120


def test_300_evaluations_keep_the_number_of_objects(own: Any) -> None:
    data = volume()
    counts = set()
    for i in range(300):
        result = own.run(SCALE, SHAPE, v=data, gain=float(i))
        counts.add((own.memory.objects, own.memory.bytes))
        del result
    assert len(counts) == 1
    own.close()
    assert (own.memory.objects, own.memory.bytes) == (0, 0)


def test_bytes_never_exceed_the_budget_and_nothing_is_lost(own: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    limit = 5 * NBYTES * own.real.itemsize // 4 + 60_000
    own.memory.join(Budget(limit))
    worst = []
    add = Memory.add

    def counted(self: Memory, *args: Any, **more: Any) -> Any:
        entry = add(self, *args, **more)
        worst.append(self.bytes)
        return entry

    monkeypatch.setattr(Memory, "add", counted)
    volumes = [volume(float(i)) for i in range(12)]
    results = [own.run(SCALE, SHAPE, v=v, gain=2.0) for v in volumes]
    again = [own.run(SCALE, SHAPE, v=r, gain=10.0) for r in results]
    assert max(worst) <= limit
    assert sum(r.nbytes for r in results + again) > 2 * limit
    assert [float(a.array[3, 4, 5]) for a in again] == [20.0 * i for i in range(12)]
    assert [float(r.array[3, 4, 5]) for r in results] == [2.0 * i for i in range(12)]


def test_a_budget_that_is_too_small_is_named(own: Any) -> None:
    own.memory.join(Budget(NBYTES // 2))
    with pytest.raises(
        DeviceError, match=rf"^{own.name}: \d+ bytes for .* do not fit, .* budget of {NBYTES // 2} bytes"
    ):
        own.run(SCALE, SHAPE, v=volume(), gain=1.0)
    own.memory.join(Budget(None))
    assert own.run(SCALE, SHAPE, v=volume(), gain=3.0).array[0, 0, 0] == 3.0


def test_uploads_are_reused(own: Any) -> None:
    data = volume()
    first = own.run(SCALE, SHAPE, v=data, gain=1.0)
    before = own.memory.objects
    # Another value mapping is another pair of uniforms, not another copy.
    second = own.run(SCALE, SHAPE, v=Volume(data.buffer, mapping=(2.0, 1.0, "")), gain=1.0)
    inputs = [entry for entry in own.memory._entries.values() if entry.purpose == "input"]
    assert len(inputs) == 1
    assert own.memory.objects - before <= 3  # one more result, and a program (with its kernel) for mapped data
    assert (first.array[0, 0, 0], second.array[0, 0, 0]) == (1.0, 3.0)


def test_buffers_may_die_on_another_thread(own: Any) -> None:
    results = [own.run(SCALE, SHAPE, v=volume(), gain=1.0) for _ in range(5)]
    own.memory.drain()
    before = own.memory.objects
    thread = threading.Thread(target=results.clear)
    thread.start()
    thread.join()
    gc.collect()
    assert own.memory.objects == before
    own.memory.drain()
    assert own.memory.objects == before - 5


def test_results_outlive_the_device(own: Any) -> None:
    result = own.run(SCALE, SHAPE, v=volume(), gain=7.0)
    own.close()
    assert (own.memory.objects, own.memory.bytes) == (0, 0)
    assert (result.array == 7.0).all()
    with pytest.raises(DeviceError, match="is closed"):
        own.run(SCALE, SHAPE, v=volume(), gain=1.0)


def test_results_are_read_from_other_threads_through_call(own: Any) -> None:
    result = own.run(SCALE, SHAPE, v=volume(), gain=7.0)
    other = own.run(SCALE, SHAPE, v=volume(), gain=8.0)
    requests: list[Any] = []
    posted, done = threading.Event(), threading.Event()
    caught: list[Any] = []

    def work() -> None:
        try:
            caught.append(other.array)
        except DeviceError as error:
            caught.append(error)
        own.call = lambda action: (requests.append(action), posted.set(), done.wait(10))
        caught.append(result.array)

    thread = threading.Thread(target=work)
    thread.start()
    assert posted.wait(10)
    requests[0]()
    done.set()
    thread.join(10)
    assert "lies on a device of another thread" in str(caught[0])
    assert (caught[1] == 7.0).all()


def test_cpu_drivers_read_host_memory_in_place(cl: Any) -> None:
    data = np.zeros((4, 128, 128), np.float32)
    buffer = Buffer(data)
    cl.memory.drain()  # what earlier tests left behind
    before = cl.memory.by_purpose().get("input", 0)
    cl.run(SCALE, (4, 4, 4), v=buffer, gain=1.0)
    assert cl.is_host_memory
    assert cl.memory.by_purpose().get("input", 0) == before


def test_texture_limits_are_found_before_allocating(gl: Any) -> None:
    before = gl.memory.bytes
    long = np.zeros((1, 1, gl.limits["texture_3d"] + 1), np.uint8)
    with pytest.raises(DeviceError, match=r"^gl: tests/scale.v: 2049x1x1 passes this driver's texture limit of 2048"):
        gl.run(SCALE, (1, 1, 1), v=long, gain=1.0)
    with pytest.raises(DeviceError, match=r"takes 2147483648 bytes, this driver's textures hold at most 1879048192"):
        gl.run(SCALE, (1024, 1024, 512), v=volume(), gain=1.0)
    gl.memory.drain()
    assert gl.memory.bytes - before < 100_000


def test_an_allocation_that_the_driver_refuses_is_a_device_error(gl: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(gl.limits, "texture_3d", 1 << 20)
    before = gl.memory.objects
    with pytest.raises(DeviceError, match="failed: OpenGL error 0x0501"):
        gl.run(SCALE, (5000, 1, 1), v=volume(), gain=1.0)
    gl.memory.drain()
    assert gl.memory.objects <= before + 3


def test_buffer_limits_of_opencl(cl: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(cl.limits, "object_bytes", NBYTES - 1)
    with pytest.raises(DeviceError, match=rf"^cl: .*16x16x16 takes {NBYTES} bytes, this driver's buffers hold at most"):
        cl.run(SCALE, SHAPE, v=np.zeros((2, 2, 2), np.float32), gain=1.0)


def test_what_a_dead_result_lay_in_serves_the_next_of_its_form() -> None:
    memory = Memory(16_000)
    first, second = host(), host()
    thing, _ = add(memory, 200, first, form="picture")
    other, _ = add(memory, 200, second, form="other")
    assert memory.take("picture") is None  # it is in use
    del first, second
    gc.collect()
    spare = memory.take("picture")
    assert spare is not None
    assert (*spare[:2], thing.released, other.released) == (thing, 200, 0, 0)
    assert (memory.objects, memory.bytes, memory.spare_bytes, memory.budget.used) == (0, 0, 200, 200)
    assert memory.take("picture") is None
    memory.close()
    assert (other.released, memory.spare_bytes, memory.budget.used) == (1, 0, 0)


def test_few_spares_are_kept_and_none_under_pressure() -> None:
    memory = Memory(16_000)  # a share of 1000
    things = []
    for _ in range(6):
        things.append(add(memory, 240, buffer := host(), form="picture")[0])
        del buffer
        gc.collect()
        memory.drain()
    assert [thing.released for thing in things] == [1, 1, 0, 0, 0, 0]
    large, _ = add(memory, 260, buffer := host(), form="large")
    del buffer
    gc.collect()
    memory.drain()
    assert (large.released, memory.spare_bytes) == (1, 960)
    kept = host()
    with memory.pinned([add(memory, 15_000, kept)[1]]):
        memory.reserve(500, "test")
    assert [thing.released for thing in things] == [1] * 6
    assert memory.spare_bytes == 0


def test_a_result_that_somebody_has_is_never_drawn_over(own: Any) -> None:
    size = (512, 128)
    gain = Source.of("uniform float gain;\nvec4 pixel(ivec2 at) { return vec4(gain, at, 1.0); }", "tests/gain.glsl")
    views, results = [], []
    for i in range(12):
        result = own.run(gain, size, gain=float(i))
        views.append(result.array[:, ::2, 0])  # the array dies, its memory must not
        if i % 3 == 0:
            results.append(result)
        del result
        own.memory.drain()
    for i, view in enumerate(views):
        assert np.all(view == i)
    for i, kept in enumerate(results):
        assert np.all(kept.array[..., 0] == 3 * i)
    nbytes = views[0].base.nbytes
    assert own.memory.host.nbytes == 0
    del views, view, results, kept
    gc.collect()
    assert 0 < own.memory.host.nbytes <= 4 * (nbytes + 128)
    pictures = {own.run(gain, size, gain=0.0).array.ctypes.data for _ in range(8)}
    assert len(pictures) <= 4
    own.close()
    assert (own.memory.host.nbytes, own.memory.spare_bytes) == (0, 0)


def test_arrays_that_come_back_take_a_share_and_none_after_the_end() -> None:
    memory = Memory(64 << 20)  # a share of 4 MiB, a quarter of it for each
    large, small = memory.host.empty(2 << 20), memory.host.empty(512 << 10)
    del large
    assert memory.host.nbytes == 0
    del small
    assert 512 << 10 <= memory.host.nbytes < 600 << 10
    last = memory.host.empty(512 << 10)
    memory.close()
    del last
    assert memory.host.nbytes == 0
