"""How nodes stand, in the few words that a node has room for: state, reason, time and device of the last run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodegraph.editor.canvas.node_item import Status
from nodegraph.editor.canvas.told import seconds_told

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.report import Report, State


class Standing:
    """What is known of the nodes of a session from all reports: a report speaks only of what its view needs."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.timings: dict[str, float] = {}  # seconds of each node's last run
        self.devices: dict[str, str] = {}  # that its last kernels ran on, as "gl"

    def forget(self) -> None:
        """Another document is open."""
        self.timings.clear()
        self.devices.clear()

    def learn(self, report: Report) -> None:
        """Keep what a report says of how nodes ran."""
        self.timings.update(report.timings)
        for path, runs in report.kernels.items():
            self.devices[path] = ", ".join(dict.fromkeys(run.device for run in runs))

    def seconds(self, path: str) -> float | None:
        """How long the last run of a node took; of a group all that ran inside."""
        if path in self.timings:
            return self.timings[path]
        inside = [seconds for key, seconds in self.timings.items() if key.startswith(f"{path}/")]
        return sum(inside) if inside else None

    def device(self, path: str) -> str:
        """The devices that the kernels of a node, or of what is in a group, ran on last."""
        found = [name for key, name in self.devices.items() if key == path or key.startswith(f"{path}/")]
        return ", ".join(dict.fromkeys(found))

    def status(self, path: str) -> Status:
        """What the foot line of a node says."""
        session = self.session
        state = session.state(path)
        node = session.network.node(path) if path in session.network else None
        if node is not None and node.muted:
            return Status("dirty", "data passes it by")
        seconds = self.seconds(path)
        last = " ".join(part for part in (seconds_told(seconds) if seconds else "", self.device(path)) if part)
        words = state.reason.split("\n")[0]
        if state == "clean":
            return Status("clean", words or "done", last)
        if state == "running":
            return Status("running", f"running, {words}" if words else "running", last, _fraction(words))
        if state == "failed":
            words = words.removeprefix(f"{path}: ")
            return Status("failed", f"failed: {words}" if words else "failed")
        if state == "blocked":
            return Status("blocked", _blocked(path, state))
        return Status("dirty", "stale" if seconds is not None else words or "not computed yet", last)


def _blocked(path: str, state: State) -> str:
    """Why a node cannot run, the one in the way first."""
    words = state.reason.split("\n")[0]
    if words.startswith("blocked by "):
        return words.partition(":")[0]  # why that one failed is said there
    return words.removeprefix(f"{path}.").removeprefix(f"{path}: ") or "blocked"


def _fraction(words: str) -> float:
    try:
        return float(words.removesuffix("%")) / 100 if words.endswith("%") else 0.0
    except ValueError:
        return 0.0
