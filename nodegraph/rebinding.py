"""Give the nodes of an open document the processors that there are now: after a plug-in was written, mended, changed.

A node keeps its values, wires and links. Values that the new declaration does not know or refuses stay as JSON, as
they do where a workspace is read, and wires into ports that are gone stay until somebody cuts them. A node whose
processor went away keeps the class that it has.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from nodegraph.commands import Command
from nodegraph.edits import MISSING, Edits, entries_of
from nodegraph.errors import UnknownProcessor
from nodegraph.network import Kept, Network, Node
from nodegraph.workspace_reader import decoded
from nodegraph.workspace_writer import encoded

if TYPE_CHECKING:
    from nodegraph.processor import Processor


class Rebind(Command):
    """Bind every node to the processor that its type now finds.

    This is no step of the history, which it brings up to date instead: what was done before can be undone afterwards.
    ``apply`` it to the network; ``told`` says, a sentence each, what the new declarations no longer know.
    """

    name = "reload"

    def __init__(self) -> None:
        super().__init__()
        self.told: list[str] = []

    def edit(self, network: Network, edits: Edits) -> None:
        remembered = list(entries_of(network.history))
        found = {node: None for node in network.walk() if node.network is None}
        for entry in remembered:
            for value in (entry.old, entry.new):
                if isinstance(value, Node):
                    found.update(dict.fromkeys(value.leaves()))
        there = set(network.walk())
        for node in found:
            try:
                cls = network.find(node.type)
            except UnknownProcessor as error:
                if node.processor is None and str(error) != str(node.trouble):
                    node.trouble = error
                    edits.touch(node, structure=True)
                continue
            if cls is node.processor:
                continue
            for entry in remembered:
                if entry.mapping is node.params:
                    entry.old, entry.new = (
                        _translated(node, cls, entry.key, value) for value in (entry.old, entry.new)
                    )
            _bind(node, cls)
            edits.touch(node, structure=True)
            if node in there:
                self.told += _lost(node, cls)


def _bind(node: Node, cls: type[Processor]) -> None:
    made = decoded(node, cls, encoded(node, node.params), node.version)
    node.processor, node.trouble, node.type, node.version = made.processor, made.trouble, made.type, made.version
    # The history writes into this very dict.
    node.params.clear()
    node.params.update(made.params)


def _translated(node: Node, cls: type[Processor], name: str, value: Any) -> Any:
    """A value that the history remembers, as the new declaration has it."""
    if value is MISSING:
        return value
    json = encoded(node, {name: value})[name]
    declared = cls.params.get(name)
    return decoded(node, cls, {name: json}, None).params.get(name, declared.default if declared is not None else value)


def _lost(node: Node, cls: type[Processor]) -> Iterator[str]:
    for name, value in node.params.items():
        if isinstance(value, Kept):
            yield f"{node.path}.{name}{value.reason}"
    for name in node.inputs:
        if name not in cls.inputs and name not in cls.params:
            yield f"{node.path}.{name}: {cls.id} no longer has this input; disconnect it"
    for other in node.parent.nodes.values() if node.parent is not None else ():
        for name, wires in other.inputs.items():
            for text in wires:
                id, _, output = text.rpartition(".")
                if id == node.id and output not in cls.outputs:
                    yield f"{other.path}.{name}: {cls.id} no longer has the output {output}; wire another one to it"
