"""What ``net["raycast"]`` gives a script: a node by name, its parameters as attributes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from nodegraph import links

if TYPE_CHECKING:
    from nodegraph.network import Network, Node


class Handle:
    """One node of a network, looked up anew at each use, so it stays good through undo and redo.

    ``node.step`` reads the effective value of a parameter, ``node.step = 0.5`` sets it as one undoable command, and
    ``del node.step`` returns it to its default. Few names are taken here, so that parameters may be called path or
    type; what else the document knows of the node is in ``node.node``.
    """

    __slots__ = ("_network", "_path")
    _network: Network
    _path: str

    def __init__(self, network: Network, path: str) -> None:
        object.__setattr__(self, "_network", network)
        object.__setattr__(self, "_path", path)

    @property
    def node(self) -> Node:
        """The record in the document. Raises CommandError when the node was removed."""
        return self._network.node(self._path)

    @property
    def inputs(self) -> Mapping[str, tuple[str, ...]]:
        """Wires into this node: input or parameter to its sources."""
        return dict(self.node.inputs)

    @property
    def params(self) -> dict[str, Any]:
        """The effective values of all parameters, wires not looked at."""
        node = self.node
        names = node.expose.params if node.network is not None else node.processor.params if node.processor else ()
        return {name: links.parameter_value(node, name) for name in names}

    @property
    def muted(self) -> bool:
        return self.node.muted

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # copy, pickle and notebooks ask for such names
            raise AttributeError(name)
        return links.parameter_value(self.node, name)

    def __setattr__(self, name: str, value: Any) -> None:
        if name == "muted":
            self._network.mute(self._path, value)
        else:
            self._network.set(f"{self._path}.{name}", value)

    def __delattr__(self, name: str) -> None:
        from nodegraph.commands import Reset

        self._network.history.do(Reset(f"{self._path}.{name}"))

    def __dir__(self) -> list[str]:
        node = self.node
        names = node.expose.params if node.network is not None else node.processor.params if node.processor else ()
        return [*super().__dir__(), *names]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Handle) and other._network is self._network and other._path == self._path

    def __hash__(self) -> int:
        return hash((id(self._network), self._path))

    def __repr__(self) -> str:
        return f"<{self.node.type} {self._path}>"
