"""What the engine itself costs: planning again after one change, and running again when everything is kept.

    python tests/benchmarks/bench_engine.py [--nodes 500]

The two shapes are the hard ones: in a chain every node stands below the first, in a ladder every node has two readers.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections.abc import Callable, Iterator

from nodegraph import Float, Input, Output, Processor
from nodegraph.engine import Engine
from nodegraph.network import Network
from nodegraph.plan import Planner
from tests.benchmarks.measure import Row

REPEATS = 31


class Number(Processor):
    """A number that is the sum of others and of itself."""

    values = Input(float, many=True, required=False, doc="Numbers.")
    total = Output(float, doc="Their sum.")
    own = Float(1.0, doc="Added.")

    def process(self, values, own):
        return float(sum(values)) + own


def network_of(count: int, reach: int) -> Network:
    """Nodes that each read the ``reach`` before them."""
    network = Network()
    for i in range(count):
        network.add(Number, f"n{i}")
        for source in range(max(0, i - reach), i):
            network.connect(f"n{source}.total", f"n{i}.values")
    return network


def median_ms(act: Callable[[], object], prepare: Callable[[int], None] = lambda i: None) -> float:
    """Median time of ``act``, ms; ``prepare`` is not counted."""
    taken = []
    for i in range(REPEATS):
        prepare(i)
        start = time.perf_counter()
        act()
        taken.append(time.perf_counter() - start)
    return statistics.median(taken) * 1e3


def measure(count: int, reach: int) -> dict[str, float]:
    """Times of one network, ms."""
    network = network_of(count, reach)
    sink = f"n{count - 1}"
    planner = Planner()

    def plan() -> object:
        return planner.plan(network.flatten(), [sink])

    def change(node: str) -> Callable[[int], None]:
        return lambda i: setattr(network[node], "own", 2.0 + i)

    found = {"first plan": median_ms(lambda: Planner().plan(network.flatten(), [sink]))}
    found["plan, nothing changed"] = median_ms(plan)
    found["plan, first node changed"] = median_ms(plan, change("n0"))
    found["plan, last node changed"] = median_ms(plan, change(sink))
    with Engine(disk=False) as engine:
        engine.evaluate(network, sink)
        found["run again, one view"] = median_ms(lambda: engine.evaluate(network, sink))
        every = [f"n{i}" for i in range(count)]
        engine.evaluate(network, every)
        found["run again, every node a view"] = median_ms(lambda: engine.evaluate(network, every))
        start = time.perf_counter()
        network["n0"].own = 0.5
        engine.evaluate(network, sink)
        found["run all nodes, doing nothing"] = (time.perf_counter() - start) * 1e3
    return found


def rows() -> Iterator[Row]:
    """The figures that have limits, of 500 nodes, for `make bench`."""
    for shape, found in {"chain": measure(500, 1), "ladder": measure(500, 2)}.items():
        replan = found["plan, first node changed"]
        yield Row(f"plan of 500 nodes after one change, {shape}", replan, "ms", 5.0, "the first node, above all others")
        again = found["run again, every node a view"] / 500 * 1e3
        yield Row(f"fully cached re-run, {shape}", again, "us", 20.0, "a node; every one of 500 is a view")


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nodes", type=int, default=500)
    count = parser.parse_args().nodes
    print(f"{count} nodes; median of {REPEATS}{'chain':>34}{'ladder':>12}")
    chain, ladder = measure(count, 1), measure(count, 2)
    for name in chain:
        each = [f"{found[name]:8.2f} ms" for found in (chain, ladder)]
        print(f"{name:<46}{each[0]:>12}{each[1]:>12}   {chain[name] / count * 1e3:6.2f} us a node")


if __name__ == "__main__":
    main()
