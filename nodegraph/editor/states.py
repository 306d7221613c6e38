"""States of nodes as the editor shows them: what the last reports said, as far as it still holds."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from nodegraph.errors import GraphError
from nodegraph.report import State

if TYPE_CHECKING:
    from nodegraph.flat import Flat, FlatNode
    from nodegraph.network import Network
    from nodegraph.report import Report

WORST_FIRST = ("failed", "blocked", "running", "dirty", "clean")


class Running(NamedTuple):
    """A node that runs: for which channel, how far it is (0..1; 0 also where it does not say), and with what."""

    channel: object
    path: str
    fraction: float = 0.0
    text: str = ""


class States:
    """What is known of the nodes of one network.

    A report speaks of the network as it was when it was asked for. What it says of a node holds as long as neither the
    node nor anything above it has changed since; after that the node is dirty.
    """

    def __init__(self, network: Network) -> None:
        self.network = network
        self._known: dict[str, tuple[FlatNode, State]] = {}
        self._running: dict[str, Running] = {}
        self._made: dict[str, State] = {}
        self._made_for: tuple[int, int] | None = None
        self._count = 0

    def learn(self, flat: Flat, report: Report) -> None:
        """Take in what a report says of the nodes of the snapshot that it was made for."""
        for path, state in report.states.items():
            if path in flat.nodes:
                self._known[path] = (flat.nodes[path], state)
        self._count += 1

    def start(self, channel: object, path: str) -> None:
        """Note that a node runs for a channel."""
        self._running[path] = Running(channel, path)

    def progress(self, path: str, fraction: float, text: str) -> None:
        """Note how far a running node is."""
        if path in self._running:
            self._running[path] = self._running[path]._replace(fraction=fraction, text=text)

    def stop(self, channel: object, path: str = "") -> None:
        """Note that a node, or everything, no longer runs for a channel."""
        for name, one in list(self._running.items()):
            if one.channel == channel and path in ("", name):
                del self._running[name]

    def running(self, channel: object) -> Running | None:
        """The node that runs for a channel: the last that began."""
        return next((one for one in reversed(self._running.values()) if one.channel == channel), None)

    def of(self, path: str) -> State:
        """State of a node; that of a group is the worst one inside, with the place."""
        try:
            node = self.network.node(path)
        except GraphError as error:
            return State("blocked", str(error))
        if node.muted:
            return State("clean", "muted: data passes it by")
        if node.network is None:
            return self._plain(path)
        inside = [(leaf.path, self._plain(leaf.path)) for leaf in node.leaves()]
        if not inside:
            return State("clean", "this group is empty")
        where, worst = min(inside, key=lambda item: WORST_FIRST.index(str(item[1])))
        return State(str(worst), f"{where}: {worst.reason}" if worst.reason else "")

    def _plain(self, path: str) -> State:
        if path in self._running:
            one = self._running[path]
            return State("running", one.text or (f"{one.fraction:.0%}" if one.fraction else ""))
        key = (self.network.root.revision, self._count)
        if self._made_for != key:
            self._made = self._all(self.network.flatten())
            self._made_for = key
        return self._made.get(path, State("clean", "muted: data passes it by"))

    def _all(self, flat: Flat) -> dict[str, State]:
        found: dict[str, State] = {}
        holds: set[str] = set()
        for path, node in flat.nodes.items():
            known = self._known.get(path)
            above = {source for sources in node.sources.values() for source, _ in sources}
            above |= {source for source, _ in node.wired.values()}
            if node.problem is not None:
                found[path] = State("blocked", str(node.problem))
            elif known is None:
                found[path] = State("dirty", "not computed yet")
            elif _same(known[0], node) and above <= holds:
                found[path] = known[1]
                holds.add(path)
            else:
                found[path] = State("dirty", "changed since it was computed")
            if known is not None and node.problem is not None and _same(known[0], node):
                holds.add(path)
        return found


def _same(one: FlatNode, other: FlatNode) -> bool:
    return one is other or (one.revision, one.sources, one.wired) == (other.revision, other.sources, other.wired)
