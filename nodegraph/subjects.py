"""What a view is about: the cameras and the plane upstream that somebody who looks at it wants to move."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nodegraph import links
from nodegraph.data import Mesh, Volume
from nodegraph.errors import GraphError
from nodegraph.wires import feeds

if TYPE_CHECKING:
    from nodegraph.flat import Flat, FlatNode
    from nodegraph.network import Network


@dataclass(frozen=True, slots=True)
class Subject:
    """What the picture of a view comes from.

    cameras: parameters ``node.parameter`` to set when the view is turned, one for each value that is moved; empty
    where nothing has a camera.
    plane: the parameter of the plane that the picture is a cut with, empty where it is none. window: that of the
    interval of values from black to white, where the cut has one. height: what its picture covers, or empty.
    source: ``node.output`` of the volume that is cut, or empty.
    """

    cameras: tuple[str, ...] = ()
    plane: str = ""
    window: str = ""
    height: str = ""
    source: str = ""


def subject_of(network: Network, view: str) -> Subject:
    """What there is to move in a view. A node that has a camera beats one that has a plane, nearer beats farther."""
    flat = network.flatten()
    for node in upstream(flat, view):
        if any(_is(node, name, "camera") for name in node.values):
            if node.path == view and not _is_shared(network, node):
                continue  # a view's own camera that nobody else follows changes no picture
            return Subject(cameras=tuple(cameras_of(network, view)))
        planes = [name for name in node.values if _is(node, name, "plane")]
        if planes and _settable(network, node.path, planes[0]):
            return _cut(network, node, planes[0])
    return Subject()


def cameras_of(network: Network, view: str) -> list[str]:
    """The cameras that move with a view: the nearest, and all upstream that stand where it stands now.

    Cameras that follow one variable are one. A camera that follows a wire or an expression cannot be moved.
    """
    found: dict[str, tuple[str, Any]] = {}
    flat = network.flatten()
    for node in upstream(flat, view):
        if node.path == view and not _is_shared(network, node):
            continue
        for name, value in node.values.items():
            if _is(node, name, "camera") and _settable(network, node.path, name):
                target = f"{node.path}.{name}"
                found.setdefault(_place(network, target), (target, value))
    first = next(iter(found.values()), None)
    return [target for target, value in found.values() if first is not None and value == first[1]]


def moved_with(network: Network, view: str) -> list[str]:
    """All parameters ``node.parameter`` of a view and upstream of it that change when it is turned, nearest first."""
    places = {_place(network, target) for target in cameras_of(network, view)}
    return [
        f"{node.path}.{name}"
        for node in upstream(network.flatten(), view)
        for name in node.values
        if _is(node, name, "camera") and _place(network, f"{node.path}.{name}") in places
    ]


def upstream(flat: Flat, view: str) -> Iterator[FlatNode]:
    """A node and everything that it needs, what is wired to parameters included, nearest first."""
    waiting, seen = [view], {view}
    while waiting:
        node = flat.nodes.get(waiting.pop(0))
        if node is None:
            continue
        yield node
        for path, _ in (*itertools.chain(*node.sources.values()), *node.wired.values()):
            if path not in seen:
                seen.add(path)
                waiting.append(path)


def things_of(network: Network, view: str) -> list[str]:
    """Outputs ``node.output`` upstream that have a place in the world: volumes and meshes, nearest first."""
    found = []
    for node in upstream(network.flatten(), view):
        for name, port in (node.processor.outputs if node.processor is not None else {}).items():
            if isinstance(port.type, type) and issubclass(port.type, (Volume, Mesh)):
                found.append(f"{node.path}.{name}")
    return found


def _is(node: FlatNode, name: str, handle: str) -> bool:
    return node.processor is not None and node.processor.params[name].handle == handle


def _is_shared(network: Network, view: FlatNode) -> bool:
    """Whether something else follows the variable that the view's camera follows."""
    link = links.link_of(network.node(view.path), "camera")
    scoped = links.lookup(link[0].parent, link[2]) if link is not None and link[0].parent is not None else None
    return scoped is not None and any(leaf.path != view.path for leaf, _, _ in links.parameters(scoped))


def _settable(network: Network, path: str, name: str) -> bool:
    """Whether a parameter can be set: no wire feeds it and it follows no expression."""
    node = network.node(path)
    if feeds(node, name):
        return False
    link = links.link_of(node, name)
    if link is None:
        return True
    scoped = links.lookup(link[0].parent, link[2]) if link[0].parent is not None else None
    return scoped is not None and not scoped[0].variables[scoped[1]].expression


def _place(network: Network, target: str) -> str:
    from nodegraph.animation import shared_place

    try:
        return shared_place(network, target)
    except GraphError:
        return target


def _cut(network: Network, node: FlatNode, plane: str) -> Subject:
    assert node.processor is not None
    params = node.processor.params
    window = next((name for name in node.values if params[name].kind == "Interval"), "")
    height = "height" if "height" in node.values else ""
    source = next((f"{path}.{output}" for ends in node.sources.values() for path, output in ends), "")

    def full(name: str) -> str:
        return f"{node.path}.{name}" if name and _settable(network, node.path, name) else ""

    return Subject((), full(plane), full(window), full(height), source)
