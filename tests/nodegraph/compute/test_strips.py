"""Work in strips: the same bytes, other threads keep running, cancel takes effect."""

from __future__ import annotations

import threading
import time
from typing import Any

import numpy as np
import pytest

from nodegraph.compute import strips
from nodegraph.compute.strips import Pace, boxes, run_in_strips
from nodegraph.errors import Cancelled
from nodegraph.shaders import Source

HEAVY = Source.of(
    """
uniform int rounds;
struct Out { vec4 a; int b; };
Out pixel(ivec2 at) {
    float s = float(at.x) * 0.001;
    for (int i = 0; i < rounds; i++) {
        s = fract(s * 1.7 + 0.1 + sin(s));
    }
    return Out(vec4(s, float(at.x), float(at.y), 1.0), at.x + at.y * 1000);
}
""",
    "tests/heavy.glsl",
)
SLICES = Source.of("float voxel(ivec3 at) { return sqrt(float(at.x + 10 * at.y + 100 * at.z)); }", "tests/slices.glsl")


class Clock:
    """Time that passes only when a strip is drawn."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 0.0
        monkeypatch.setattr(strips.time, "perf_counter", lambda: self.now)


def test_boxes_cover_rows_of_a_stack_once() -> None:
    for height, depth in ((1, 7), (5, 4), (3, 1)):
        for step in (1, 2, 4, 7, 100):
            seen = np.zeros((depth, height), int)
            for first in range(0, height * depth, step):
                found = boxes(first, min(step, height * depth - first), height)
                assert len(found) <= 3
                for y, rows, z, slices in found:
                    seen[z : z + slices, y : y + rows] += 1
            assert (seen == 1).all()


def test_strips_take_about_30_ms_also_when_rows_get_dearer(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    cost = np.where(np.arange(1024) < 512, 1e-6, 0.6e-3)  # an empty sky above 300 ms of work
    times: list[float] = []

    def draw(first: int, count: int) -> None:
        times.append(float(cost[first : first + count].sum()))
        clock.now += times[-1]

    pace = Pace()
    run_in_strips(draw, 1024, 1024, pace)
    assert max(times) <= 0.050
    times.clear()
    run_in_strips(draw, 1024, 1024, pace)
    assert max(times) <= 0.050
    assert sum(times) / len(times) <= 0.031
    assert len(times) <= 1024 / (0.9 * 0.030 / 0.6e-3)


def test_small_pictures_are_one_strip(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    counts: list[int] = []

    def draw(first: int, count: int) -> None:
        counts.append(count)
        clock.now += 0.0002

    pace = Pace()
    run_in_strips(draw, 64, 64, pace)
    run_in_strips(draw, 512, 512, pace)
    assert counts == [64, 512]


def test_one_dispatch_and_many_give_the_same_bytes(device: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    size = (130, 97)
    whole = device.run(HEAVY, size, rounds=40)
    voxels = device.run(SLICES, (33, 9, 7)).array
    for rows in (1, 13, 64):
        monkeypatch.setattr(
            "nodegraph.compute.device.run_in_strips",
            lambda draw, total, *_args, rows=rows, **_more: [
                draw(first, min(rows, total - first)) for first in range(0, total, rows)
            ],
        )
        cut = device.run(HEAVY, size, rounds=40)
        assert cut.a.array.tobytes() == whole.a.array.tobytes()
        assert cut.b.array.tobytes() == whole.b.array.tobytes()
        assert device.run(SLICES, (33, 9, 7)).array.tobytes() == voxels.tobytes()


def rounds_for(device: Any, seconds: float) -> int:
    """Return how many rounds make a warm draw of 512 x 512 last about ``seconds``."""
    device.run(HEAVY, (512, 512), rounds=8).a.array  # noqa: B018 (waits)
    start = time.perf_counter()
    device.run(HEAVY, (512, 512), rounds=32)
    return max(8, int(32 * seconds / (time.perf_counter() - start)))


def test_another_thread_ticks_during_a_long_draw(device: Any) -> None:
    rounds = rounds_for(device, 0.3)
    device.run(HEAVY, (512, 512), rounds=rounds)
    gaps: list[float] = []
    for _ in range(3):  # other work on this machine may stop any thread for a while; three draws in a row it will not
        running, ticks = threading.Event(), [time.perf_counter()]

        def tick(running: threading.Event = running, ticks: list[float] = ticks) -> None:
            while not running.is_set():
                time.sleep(0.002)
                ticks.append(time.perf_counter())

        thread = threading.Thread(target=tick)
        thread.start()
        start = time.perf_counter()
        device.run(HEAVY, (512, 512), rounds=rounds)
        seconds = time.perf_counter() - start
        running.set()
        thread.join()
        assert seconds > 0.1
        gaps.append(float(np.diff(ticks).max()))
        if gaps[-1] <= 0.050:
            return
    pytest.fail(f"the other thread stood still for {[f'{gap * 1000:.0f} ms' for gap in gaps]}")


def test_cancel_takes_effect_at_the_next_strip(device: Any) -> None:
    rounds = rounds_for(device, 0.3)
    device.run(HEAVY, (512, 512), rounds=rounds)
    strips_done = 0

    def check() -> None:
        nonlocal strips_done
        strips_done += 1
        if strips_done == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        device.run(HEAVY, (512, 512), rounds=rounds, check=check)
    assert strips_done == 3


def test_one_slow_draw_does_not_keep_strips_small(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Clock(monkeypatch)
    slow = [1.0]
    counts: list[int] = []

    def draw(first: int, count: int) -> None:
        counts.append(count)
        # A software rasteriser: every 64-row tile that a strip touches costs five rows on top.
        tiles = (first + count - 1) // 64 - first // 64 + 1
        clock.now += slow[0] * 0.5e-3 * (count + 5 * tiles)

    pace = Pace()
    for slow[0] in (1.0, 10.0, 1.0, 1.0, 1.0):
        counts.clear()
        run_in_strips(draw, 1024, 1024, pace, multiple=64)
        assert sum(counts) == 1024
    assert counts == [64] * 16


@pytest.mark.parametrize("known", [False, True])
@pytest.mark.parametrize("multiple", [1, 64])
def test_rows_that_take_seconds_are_cut_into_columns(
    monkeypatch: pytest.MonkeyPatch, known: bool, multiple: int
) -> None:
    """A thousandfold number of samples below an empty sky, on a first draw and after an ordinary one."""
    clock = Clock(monkeypatch)
    cell = np.where(np.arange(256) < 100, 0.0, 2e-6)[:, None] * np.ones(512)
    seen = np.zeros((256, 512), int)
    times: list[float] = []
    work = 1.0

    def draw(first: int, count: int, x: int = 0, columns: int = 512) -> None:
        seen[first : first + count, x : x + columns] += 1
        times.append(float(cell[first : first + count, x : x + columns].sum()) * work)
        clock.now += times[-1]

    pace = Pace()
    if known:
        run_in_strips(draw, 256, 512, pace, multiple=multiple, least_columns=16)
    seen[:], times[:], work = 0, [], 1000.0
    checks: list[int] = []
    run_in_strips(
        draw, 256, 512, pace, work=work, multiple=multiple, least_columns=16, check=lambda: checks.append(len(times))
    )
    assert (seen == 1).all()
    assert checks == list(range(len(times)))
    # A row takes a second. The least part is 16 columns of the least strip: 4 rows where tiles are whole.
    assert max(times) <= 0.6


@pytest.mark.parametrize("parts", [1, 7])
def test_columns_make_the_same_picture(device: Any, monkeypatch: pytest.MonkeyPatch, parts: int) -> None:
    whole = device.run(HEAVY, (150, 40), rounds=3)
    monkeypatch.setattr(strips, "LONG_SECONDS", 0.0)
    monkeypatch.setattr(strips, "TARGET_SECONDS", 1e-6)
    cut = device.run(HEAVY, (150, 40), rounds=3, work=1e3 * parts)
    assert np.array_equal(whole.a.array, cut.a.array)
    assert np.array_equal(whole.b.array, cut.b.array)
    slices = device.run(SLICES, (70, 5, 3), work=1e3 * parts).array
    z, y, x = np.meshgrid(np.arange(3), np.arange(5), np.arange(70), indexing="ij")
    assert np.allclose(slices, np.sqrt(x + 10 * y + 100 * z), rtol=1e-6)
