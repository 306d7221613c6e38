"""The engine alone: planning again after one change, running again when everything is kept.

The two shapes are the hard ones: in a chain every node stands below the first, in a ladder every node has two readers.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Iterator

from nodegraph import Float, Input, Output, Processor
from nodegraph.engine import Engine
from nodegraph.network import Network
from nodegraph.plan import Planner
from tests.benchmarks.measure import Row

NODES = 500
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


def rows() -> Iterator[Row]:
    """The figures, as `tests.benchmarks` prints them."""
    for shape, reach in (("chain", 1), ("ladder", 2)):
        network = network_of(NODES, reach)
        sink = f"n{NODES - 1}"
        every = [f"n{i}" for i in range(NODES)]
        planner = Planner()

        def plan(network: Network = network, planner: Planner = planner, sink: str = sink) -> object:
            return planner.plan(network.flatten(), [sink])

        def change(i: int, network: Network = network) -> None:
            network["n0"].own = 2.0 + i

        what = f"{NODES} nodes, {shape}"
        yield Row(f"{what}: plan again, first node changed", median_ms(plan, change), "ms", 5.0, "flatten and plan")
        yield Row(f"{what}: plan again, nothing changed", median_ms(plan), "ms")
        with Engine(disk=False) as engine:
            engine.evaluate(network, every)

            def again(engine: Engine = engine, network: Network = network, every: list[str] = every) -> object:
                return engine.evaluate(network, every)

            each = median_ms(again) / NODES * 1e3
            yield Row(
                f"{what}: run again, all kept, all shown", each, "us", 20.0, "per node, flatten and plan included"
            )
            change(0)
            start = time.perf_counter()
            engine.evaluate(network, sink)
            cost = (time.perf_counter() - start) / NODES * 1e6
            yield Row(f"{what}: run all, each adding two numbers", cost, "us", None, "per node, on workers")
