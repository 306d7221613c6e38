"""The layered drawing: edges run to the right, nothing overlaps, long edges find room."""

from __future__ import annotations

import random

import pytest

from nodegraph.editor.canvas.layout import layered

SIZE = (150.0, 90.0)


def overlap(a: tuple[float, float], b: tuple[float, float]) -> bool:
    return abs(a[0] - b[0]) < SIZE[0] and abs(a[1] - b[1]) < SIZE[1]


@pytest.mark.parametrize("seed", range(6))
def test_edges_run_right_and_nodes_stand_apart(seed: int) -> None:
    rng = random.Random(seed)
    ids = [f"n{i}" for i in range(40)]
    edges = [(ids[rng.randrange(i)], ids[i]) for i in range(1, 40) for _ in range(rng.randrange(3))]
    places = layered(dict.fromkeys(ids, SIZE), edges)
    assert places.keys() == set(ids)
    assert all(places[a][0] + SIZE[0] < places[b][0] for a, b in edges)
    assert not any(overlap(places[a], places[b]) for a in ids for b in ids if a < b)


def test_a_chain_is_a_straight_line() -> None:
    places = layered(dict.fromkeys("abcd", SIZE), [("a", "b"), ("b", "c"), ("c", "d")])
    assert len({y for _, y in places.values()}) == 1


def test_an_edge_passes_between_nodes() -> None:
    """a feeds d past b and c: these do not stand on the line from a to d."""
    places = layered(dict.fromkeys("abcd", SIZE), [("a", "b"), ("b", "c"), ("c", "d"), ("a", "d")])
    for id in "bc":
        part = (places[id][0] - places["a"][0]) / (places["d"][0] - places["a"][0])
        line = places["a"][1] + part * (places["d"][1] - places["a"][1]) + SIZE[1] / 2
        assert not places[id][1] < line < places[id][1] + SIZE[1]


def test_a_cycle_of_a_broken_file_is_drawn() -> None:
    places = layered(dict.fromkeys("abc", SIZE), [("a", "b"), ("b", "c"), ("c", "a")])
    assert len(set(places.values())) == 3


def test_nothing_and_single_nodes() -> None:
    assert layered({}, []) == {}
    places = layered(dict.fromkeys("abc", SIZE), [])
    assert not any(overlap(places[a], places[b]) for a in "abc" for b in "abc" if a < b)


def test_the_drawing_is_the_same_each_time() -> None:
    edges = [("a", "c"), ("b", "c"), ("c", "d"), ("b", "d")]
    assert layered(dict.fromkeys("abcd", SIZE), edges) == layered(dict.fromkeys("abcd", SIZE), edges)
