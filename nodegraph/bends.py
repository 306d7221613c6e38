"""Where wires bend on their way, so that they pass around nodes: only editors look at it.

A node keeps the bends of the wires that it reads in its ``ui``: ``{"bends": {input: {"node.output": [[x, y], ...]}}}``,
in the order from the source. They are saved, copied and undone with the node, ignored by whatever computes, and
follow their wire: a source that is renamed takes them along, a wire that is cut loses them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nodegraph.edits import Edits
    from nodegraph.network import Node

BENDS = "bends"
"""Key of a node's ``ui``."""

FARTHEST = 1e9
"""Coordinates beyond that are no place that a hand chose."""

Points = list[tuple[float, float]]


def bends_of(node: Node, name: str, source: str) -> Points:
    """The bends of one wire into a node, from its source on; none where what is stored is not a list of places."""
    stored = _table(node.ui, name).get(source)
    if not isinstance(stored, list):
        return []
    points = [p for p in stored if isinstance(p, (list, tuple)) and len(p) == 2]
    return [(float(x), float(y)) for x, y in points if is_coordinate(x) and is_coordinate(y)]


def with_bends(node: Node, name: str, source: str, points: Points) -> dict[str, Any] | None:
    """What the ``ui`` of a node says of bends when one wire has these; None where nothing is left to say."""
    table = {**_table(node.ui, name), source: [[round(x), round(y)] for x, y in points]}
    if not points:
        del table[source]
    return _with_table(node.ui, name, table)


def renamed(ui: dict[str, Any], new: Callable[[str, str], str | None]) -> dict[str, Any]:
    """A node's ``ui`` in which ``new(input, source)`` is the source of each bent wire, or None for one that is gone."""
    stored = ui.get(BENDS)
    if not isinstance(stored, dict):
        return ui
    for name in list(stored):
        table = _table(ui, name)
        swapped = {text: points for source, points in table.items() if (text := new(name, source)) is not None}
        if swapped != table:
            told = _with_table(ui, name, swapped)
            ui = {key: value for key, value in ui.items() if key != BENDS} | ({BENDS: told} if told else {})
    return ui


def follow(edits: Edits, node: Node, name: str, new: Callable[[str], str | None]) -> None:
    """Let the bends of the wires of one input follow them: ``new(source)`` as in `renamed`."""
    told = renamed(node.ui, lambda other, source: new(source) if other == name else source)
    if told is node.ui:
        return
    if BENDS in told:
        edits.put(node.ui, BENDS, told[BENDS])
    else:
        edits.drop(node.ui, BENDS)


def is_coordinate(number: Any) -> bool:
    """Whether it is a number that lies on a canvas; an integer in a file may be greater than any float."""
    return isinstance(number, (int, float)) and abs(number) <= FARTHEST


def _table(ui: dict[str, Any], name: str) -> dict[str, Any]:
    stored = ui.get(BENDS)
    table = stored.get(name) if isinstance(stored, dict) else None
    return table if isinstance(table, dict) else {}


def _with_table(ui: dict[str, Any], name: str, table: dict[str, Any]) -> dict[str, Any] | None:
    stored = ui.get(BENDS)
    told = {key: value for key, value in stored.items() if key != name} if isinstance(stored, dict) else {}
    return (told | ({name: table} if table else {})) or None
