"""Recorded changes: the delta behind every command.

A command changes the document only through an ``Edits``. It notes for every touched entry what was there before and
at which place, so undoing restores the document exactly, order included, and costs what the change cost.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nodegraph.history import History
    from nodegraph.network import Network, Node

MISSING: Any = object()
"""Stands for "no such entry"."""


@dataclass(slots=True)
class _Entry:
    """One key of one dict: its value before and after, and its place among the keys."""

    mapping: dict[str, Any]
    key: str
    old: Any
    new: Any
    place: int

    def write(self, value: Any) -> None:
        mapping, key = self.mapping, self.key
        if value is MISSING:
            mapping.pop(key, None)  # a reloaded processor may have let go of it
        elif key in mapping or self.place >= len(mapping):
            mapping[key] = value
        else:
            items = list(mapping.items())
            items.insert(self.place, (key, value))
            mapping.clear()
            mapping.update(items)


@dataclass(slots=True)
class _Attribute:
    """One attribute of one node or variable."""

    owner: Any
    name: str
    old: Any
    new: Any

    def write(self, value: Any) -> None:
        setattr(self.owner, self.name, value)


class Edits:
    """What one command changed in the network ``root``, in order."""

    def __init__(self, root: Network) -> None:
        self.root = root
        self._changes: list[_Entry | _Attribute] = []
        self._touched: dict[Node, None] = {}
        self._structure = False

    # -- making changes -----------------------------------------------------------------------------------------

    def put(self, mapping: dict[str, Any], key: str, value: Any, place: int | None = None) -> None:
        """Set ``mapping[key]``; a new key goes to ``place``, by default to the end."""
        old = mapping.get(key, MISSING)
        self._do(_Entry(mapping, key, old, value, len(mapping) if place is None else place))

    def drop(self, mapping: dict[str, Any], key: str) -> int:
        """Remove ``mapping[key]`` and return the place where it stood."""
        place = list(mapping).index(key)
        self._do(_Entry(mapping, key, mapping[key], MISSING, place))
        return place

    def rekey(self, mapping: dict[str, Any], old: str, new: str) -> None:
        """Give an entry another key at the same place."""
        value = mapping[old]
        self.put(mapping, new, value, self.drop(mapping, old))

    def assign(self, owner: Any, name: str, value: Any) -> None:
        """Set an attribute."""
        change = _Attribute(owner, name, getattr(owner, name), value)
        self._changes.append(change)
        change.write(value)

    def touch(self, *nodes: Node, structure: bool = False) -> None:
        """Note that the effective parameters of ``nodes`` may have changed, or that the wiring has."""
        self._touched.update(dict.fromkeys(nodes))
        self._structure |= structure
        self.root.note(nodes, structure)

    def _do(self, change: _Entry) -> None:
        self._changes.append(change)
        change.write(change.new)

    # -- history ------------------------------------------------------------------------------------------------

    @property
    def empty(self) -> bool:
        return not self._changes

    @property
    def touched(self) -> Iterable[Node]:
        """Nodes whose values may have changed."""
        return self._touched.keys()

    @property
    def structure(self) -> bool:
        """Whether nodes, wires, groups or muting changed."""
        return self._structure

    def undo(self) -> None:
        """Restore what was there before."""
        for change in reversed(self._changes):
            change.write(change.old)
        self.root.note(self._touched, self._structure)

    def redo(self) -> None:
        """Make the same changes again."""
        for change in self._changes:
            change.write(change.new)
        self.root.note(self._touched, self._structure)

    def absorb(self, later: Edits) -> bool:
        """Take over a later change of the very same entries: a drag is one small delta. False: it does not fit."""
        mine, theirs = self._changes, later._changes
        if len(mine) != len(theirs) or not all(map(_same_entry, mine, theirs)):
            return False
        for change, newer in zip(mine, theirs, strict=True):
            change.new = newer.new
        self._touched.update(later._touched)
        self._structure |= later._structure
        return True


def entries_of(history: History) -> Iterator[_Entry]:
    """Every entry of a dict that the steps of a history write when they are undone or redone."""
    for command in history.commands():
        for change in command._edits._changes if command._edits is not None else ():
            if isinstance(change, _Entry):
                yield change


def _same_entry(a: _Entry | _Attribute, b: _Entry | _Attribute) -> bool:
    if isinstance(a, _Entry) and isinstance(b, _Entry):
        # A key that comes or goes on the way keeps its own record: its place belongs to it.
        return a.mapping is b.mapping and a.key == b.key and MISSING not in (a.new, b.old, b.new)
    return isinstance(a, _Attribute) and isinstance(b, _Attribute) and a.owner is b.owner and a.name == b.name
