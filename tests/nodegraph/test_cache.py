from __future__ import annotations

import threading

import numpy as np

from nodegraph.cache import Result, ResultCache, blocks
from nodegraph.data import Buffer, Image, Volume


def made(count: int, seconds: float = 1.0) -> Result:
    """A result of so many bytes."""
    return Result({"out": Volume(np.zeros((1, 1, count), "u1"))}, seconds)


def test_least_recently_used_goes_first():
    cache = ResultCache(300)
    for key in (b"a", b"b", b"c"):
        cache.put(key, made(100))
    cache.get(b"a")
    cache.put(b"d", made(100))
    assert [key for key in (b"a", b"b", b"c", b"d") if key in cache] == [b"a", b"c", b"d"]
    assert cache.nbytes == 300


def test_a_result_larger_than_the_budget_is_not_kept_and_a_budget_of_0_keeps_nothing():
    cache = ResultCache(99)
    assert not cache.put(b"a", made(100))
    assert cache.nbytes == 0
    none = ResultCache(0)
    assert not none.put(b"a", made(0 + 1))
    assert len(none) == 0


def test_shared_memory_counts_once_and_a_view_counts_what_it_keeps_alive():
    array = np.zeros((10, 10, 10), "u1")
    volume = Volume(array)
    cache = ResultCache(10_000)
    cache.put(b"whole", Result({"out": volume}))
    cache.put(b"same", Result({"out": Volume(array, np.diag([2.0, 2, 2, 1]))}))
    assert cache.nbytes == 1000
    cache.put(b"part", Result({"out": Volume(array[:1])}))
    assert cache.nbytes == 1000
    cache.clear()
    assert cache.nbytes == 0
    cache.put(b"part", Result({"out": Volume(array[:1])}))
    assert cache.nbytes == 1000


def test_a_value_on_a_device_counts_without_being_fetched():
    def fetch():
        raise AssertionError("the cache must not fetch")

    buffer = Buffer.on_device((4, 4, 4), "f4", fetch)
    cache = ResultCache(1000)
    cache.put(b"a", Result({"out": Image(buffer)}))
    assert cache.nbytes == 256
    assert cache.host_bytes() == 0
    assert [count for _, count, _ in blocks([buffer, buffer])] == [256]


def test_pinned_results_stay_and_leave_with_the_pin():
    cache = ResultCache(100)
    cache.pin(b"a")
    cache.pin(b"b")
    cache.put(b"a", made(100))
    cache.put(b"b", made(100))
    assert b"a" in cache
    assert b"b" in cache
    cache.unpin(b"a")
    assert b"a" not in cache
    assert b"b" in cache
    cache.unpin(b"b")
    assert cache.nbytes == 100


def test_pressure_takes_the_cheapest_per_byte_that_lies_on_a_device():
    cache = ResultCache(10_000)

    def on_device() -> Image:
        return Image(Buffer.on_device((5, 5, 4), "f4", lambda: np.zeros((5, 5, 4), "f4")))

    cache.put(b"dear", Result({"out": on_device()}, 10.0))
    cache.put(b"cheap", Result({"out": on_device()}, 0.1))
    cache.put(b"host", made(400, 0.0))
    cache.put(b"pinned", Result({"out": on_device()}, 0.0))
    cache.pin(b"pinned")
    assert cache.release_cheap(1) == 400
    assert b"cheap" not in cache
    assert cache.release_cheap(100_000) == 400
    assert b"host" in cache
    assert b"pinned" in cache


def test_a_budget_that_a_device_shares_holds_for_both():
    class Budget:
        device = 0

        def exceeded(self, wanted: int = 0) -> int:
            return max(0, self.device + cache.host_bytes() + wanted - 500)

    cache = ResultCache(1000)
    cache.shared = budget = Budget()
    cache.put(b"a", made(200))
    cache.put(b"b", made(200))
    assert len(cache) == 2
    budget.device = 250
    cache.trim()
    assert len(cache) == 1


def test_replacing_a_result_and_failures():
    cache = ResultCache(1000)
    cache.put(b"a", made(100))
    cache.put(b"a", made(200))
    assert cache.nbytes == 200
    error = ValueError("no")
    cache.fail(b"b", error)
    assert cache.failure(b"b") is error
    cache.put(b"b", made(1))
    assert cache.failure(b"b") is None
    cache.fail(b"c", error)
    cache.forget_failures()
    assert cache.failure(b"c") is None


def test_many_threads_leave_the_count_right():
    cache = ResultCache(2000)
    arrays = [np.zeros((1, 1, 100), "u1") for _ in range(8)]

    def work(seed: int) -> None:
        rng = np.random.default_rng(seed)
        for _ in range(300):
            pick = int(rng.integers(0, 40))
            key = bytes([pick])
            if rng.random() < 0.7:
                cache.put(key, Result({"out": Volume(arrays[pick % 8])}))
            else:
                cache.get(key)
            cache.pin(key)
            cache.unpin(key)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert cache.nbytes <= 800
    cache.clear()
    assert cache.nbytes == 0


def test_quick_results_of_a_node_take_a_share_and_its_latest_stay():
    cache = ResultCache(1600)  # a share of 100

    def kept(keys):
        return [key.decode() for key in keys if key in cache]

    cache.put(b"volume", made(300, 0.1), "volume")  # more than the share, and one of the latest four
    cache.put(b"dear", made(90, 2.0), "view")
    views = [b"%d" % i for i in range(9)]
    for key in views[:6]:
        cache.put(key, made(20, 0.1), "view")
    assert kept(views) == ["1", "2", "3", "4", "5"]
    cache.get(b"1")
    cache.pin(b"2")
    cache.put(b"6", made(60, 0.1), "view")
    assert kept(views) == ["1", "2", "4", "5", "6"]  # 1 was used, 2 is pinned
    cache.unpin(b"2")
    cache.put(b"7", made(200, 0.1), "view")
    assert kept(views) == ["1", "5", "6", "7"]
    cache.put(b"8", made(200, 0.1), "view")
    assert kept(views) == ["1", "6", "7", "8"]  # four, whatever they take
    for key in (b"memo", b"memo too", b"third", b"fourth", b"fifth"):
        cache.put(key, made(30, 0.1))  # what no node made has no share
    assert kept((b"volume", b"dear", b"memo", b"memo too", b"third", b"fourth", b"fifth"))[:3] == [
        "volume",
        "dear",
        "memo",
    ]
    cache.clear()
    assert cache.nbytes == 0
