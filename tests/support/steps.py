"""Small processors for tests of planning and running. ``ran`` counts calls by the name that a node was given."""

from __future__ import annotations

import threading
from collections import Counter

import numpy as np

from nodegraph import Float, Input, Int, Output, Processor, Text
from nodegraph.data import Image, Volume
from nodegraph.network import Network

ran: Counter[str] = Counter()
gates: dict[str, threading.Event] = {}


class Seed(Processor):
    """A constant field."""

    out = Output(Volume, doc="The field.")
    number = Int(1, doc="Its value.")
    edge = Int(2, min=1, doc="Voxels along each side.")

    def process(self, number, edge):
        ran["seed"] += 1
        return Volume(np.full((edge,) * 3, number, "f4"))


class Shift(Processor):
    """Add a number."""

    volume = Input(Volume, doc="What it is added to.")
    out = Output(Volume, doc="The sum.")
    by = Float(1.0, doc="The number.")
    name = Text("shift", doc="Counted under this.")

    def process(self, volume, by, name):
        ran[name] += 1
        return volume.with_data(volume.data + np.float32(by))


class Sum(Processor):
    """Add fields."""

    volumes = Input(Volume, many=True, doc="The fields.")
    out = Output(Volume, doc="Their sum.")

    def process(self, volumes):
        ran["sum"] += 1
        return volumes[0].with_data(sum(volume.data for volume in volumes))


class Fail(Processor):
    """Raise an error."""

    volume = Input(Volume, doc="Not looked at.")
    out = Output(Volume, doc="Never there.")
    text = Text("it broke", doc="What the error says.")

    def process(self, volume, text):
        ran["fail"] += 1
        raise RuntimeError(text)


class Wait(Processor):
    """Wait for the gate of a name, without looking at anything else."""

    volume = Input(Volume, required=False, doc="Passed on.")
    out = Output(Volume, doc="The same, or one voxel.")
    gate = Text("gate", doc="Which gate.")

    def process(self, volume, gate):
        ran[gate] += 1
        assert gates[gate].wait(20)
        return Volume(np.zeros((1, 1, 1), "f4")) if volume is None else volume


class Draw(Processor):
    """A picture whose pixels are the mean of a field."""

    volume = Input(Volume, doc="The field.")
    image = Output(Image, doc="A picture of the size that is asked for.")

    def process(self, volume, *, size):
        ran["draw"] += 1
        return Image(np.full((size[1], size[0], 4), volume.data.mean(), "f4"))


def value_of(report, path, output="out"):
    """The first voxel of a field that a sink shows."""
    return float(report.values[path, output].data.flat[0])


def chain(length: int) -> Network:
    """``seed`` followed by ``n0``, ``n1``, ... each adding 1."""
    network = Network()
    network.add(Seed, "seed")
    for i in range(length):
        network.add(Shift, f"n{i}")
        network.connect(f"n{i - 1}.out" if i else "seed.out", f"n{i}.volume")
    return network


def diamond() -> Network:
    """``seed`` read by ``left`` and ``right``, both read by ``sum``."""
    network = Network()
    network.add(Seed, "seed")
    network.add(Shift, "left", by=10.0, name="left")
    network.add(Shift, "right", by=20.0, name="right")
    network.add(Sum, "sum")
    network.connect("seed.out", "left.volume")
    network.connect("seed.out", "right.volume")
    network.connect("left.out", "sum.volumes")
    network.connect("right.out", "sum.volumes")
    return network
