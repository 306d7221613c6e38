"""What is measured in the document: the list of it, the statistics of its regions, and which one is marked.

Measures are kept in the ``ui`` of the view in which they were made, under ``measures``, as `Measure.to_json` writes
them: they are saved, undone, renamed and removed with it. Statistics are those of the volume that this view shows now.
"""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, NamedTuple

from PySide6.QtCore import QObject, Signal

from nodegraph.commands import SetUI
from nodegraph.data import Volume
from nodegraph.editor.views.measures import Measure, Statistics, statistics
from nodegraph.errors import CommandError, GraphError
from nodegraph.subjects import subject_of

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

KEY = "measures"
"""Key of the ``ui`` of a view."""
MOST_AT_ONCE = 2
"""Questions under way; `changed` comes after each, and then who still wants to know asks again."""


class Entry(NamedTuple):
    """One measure: path of the view it belongs to, its place in the list of that view, and what it is."""

    view: str
    place: int
    measure: Measure


class Measured(QObject):
    """One for each session, made by `of` when somebody first asks. ``changed``: the list, a value or the mark."""

    changed = Signal()

    def __init__(self, session: Session) -> None:
        super().__init__(session)
        self.session = session
        self.marked: tuple[str, int] | None = None
        self._entries: list[Entry] | None = None
        self._known: dict[Measure, tuple[weakref.ref[Volume], Statistics | None]] = {}
        self._asked: dict[Measure, Volume] = {}
        session.changed.connect(self._change)
        session.replaced.connect(self._replaced)
        session.values_changed.connect(lambda _: self.changed.emit() if self._regions() else None)

    @classmethod
    def of(cls, session: Session) -> Measured:
        """The one of a session."""
        found = session.findChild(cls)
        return found if isinstance(found, Measured) else cls(session)

    def entries(self) -> list[Entry]:
        """All measures, view by view in the order of the document."""
        if self._entries is None:
            self._entries = []
            for node in self.session.network.walk():
                kept = node.ui.get(KEY)
                for place, json in enumerate(kept if isinstance(kept, list) else ()):
                    measure = Measure.from_json(json)
                    if measure is not None:
                        self._entries.append(Entry(node.path, place, measure))
        return self._entries

    def statistics(self, entry: Entry) -> Statistics | None:
        """Of a region, as far as they are known; else they are worked out and `changed` follows."""
        volume = self._volume(entry) if entry.measure.is_region else None
        if volume is None:
            return None
        measure = entry.measure
        known = self._known.get(measure)
        if known is not None and known[0]() is volume:
            return known[1]
        if self._asked.get(measure) is not volume and len(self._asked) < MOST_AT_ONCE:
            self._asked[measure] = volume
            self.session.work(
                lambda: statistics(volume, measure.array), lambda found: self._take(measure, volume, found)
            )
        return None

    def entry(self, view: str, place: int) -> Entry | None:
        """A measure by its view and its place there."""
        return next((one for one in self.entries() if one[:2] == (view, place)), None)

    # -- edits --------------------------------------------------------------------------------------------------------

    def add(self, view: str, measure: Measure) -> None:
        """Keep another measure."""
        kept = self._list(view)
        with self.session.gesture(f"measure {article(measure.kind)}"):
            self.marked = view, len(kept)
            self.session.do(SetUI(view, KEY, [*kept, measure.to_json()]))

    def replace(self, entry: Entry, measure: Measure) -> None:
        """Put another in its place; part of the gesture that is open."""
        kept = self._list(entry.view)
        kept[entry.place] = measure.to_json()
        self.session.do(SetUI(entry.view, KEY, kept))

    def remove(self, entries: list[Entry]) -> None:
        """Delete measures, as one step."""
        if not entries:
            return
        with self.session.gesture("delete a measure" if len(entries) == 1 else "delete measures"):
            for view in dict.fromkeys(entry.view for entry in entries):
                gone = {entry.place for entry in entries if entry.view == view}
                kept = [json for place, json in enumerate(self._list(view)) if place not in gone]
                self.session.do(SetUI(view, KEY, kept or None))

    def mark(self, chosen: tuple[str, int] | None) -> None:
        """Show one in every view as the one that is meant."""
        if chosen != self.marked:
            self.marked = chosen
            self.changed.emit()

    # -- behind it ----------------------------------------------------------------------------------------------------

    def _list(self, view: str) -> list[object]:
        try:
            kept = self.session.network.node(view).ui.get(KEY)
        except CommandError:
            return []
        return list(kept) if isinstance(kept, list) else []

    def _regions(self) -> bool:
        return any(entry.measure.is_region for entry in self.entries())

    def _volume(self, entry: Entry) -> Volume | None:
        try:
            source = subject_of(self.session.network, entry.view).source
        except GraphError:
            return None
        path, _, output = source.rpartition(".")
        value = self.session.value(path, output) if path else None
        return value if isinstance(value, Volume) else None

    def _take(self, measure: Measure, volume: Volume, found: Statistics | None) -> None:
        if self._asked.get(measure) is volume:
            del self._asked[measure]
            self._known[measure] = weakref.ref(volume), found
            self.changed.emit()

    def _change(self, _: object) -> None:
        before, self._entries = self._entries, None
        now = self.entries()
        if now == before:
            return
        there = {entry.measure for entry in now}
        self._known = {measure: known for measure, known in self._known.items() if measure in there}
        if self.marked is not None and self.entry(*self.marked) is None:
            self.marked = None
        self.changed.emit()

    def _replaced(self) -> None:
        self._entries, self.marked = None, None
        self._known.clear()
        self._asked.clear()
        self.changed.emit()


def article(kind: str) -> str:
    """A kind of measure with its article."""
    return f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"
