"""Keys that another process finds again, for the disk cache."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodegraph.fingerprint import content_key, digest
from nodegraph.services import provenance

if TYPE_CHECKING:
    from nodegraph.plan import Plan


class LastingKeys:
    """Fingerprints of a plan's tasks in which values given by a script count by their content.

    Where no script gave anything above a task, that is its fingerprint. Otherwise the data is hashed, once,
    when a task that keeps results on disk first asks.
    """

    def __init__(self, plan: Plan) -> None:
        self._plan = plan
        self._known: dict[int, bytes] = {}

    def key(self, place: int) -> bytes:
        """The lasting key of the task at this place of the plan."""
        task = self._plan.tasks[place]
        if task.stable:
            return task.fingerprint
        key = self._known.get(place)
        if key is None:
            if task.path in self._plan.given:
                key = content_key(self._plan.given[task.path], task.path)
            else:
                parts: list[bytes | str] = []
                for port, sources in task.feeds.items():
                    parts += [port, "cut" if sources is None else str(len(sources))]
                    for source, output in sources or ():
                        parts += [self.key(source), output]
                key = digest("lasting", task.local.digest, str(len(task.services)), *task.services, *parts)
            self._known[place] = key
        return key

    def of_input(self, place: int, made: bytes) -> bytes | None:
        """The lasting key of the input of a task that has this provenance; None when it is none of them."""
        for sources in self._plan.tasks[place].feeds.values():
            for source, output in sources or ():
                task = self._plan.tasks[source]
                is_given = task.path in self._plan.given
                if made == (task.fingerprint if is_given else provenance(task.fingerprint, output)):
                    return provenance(self.key(source), output)
        return None
