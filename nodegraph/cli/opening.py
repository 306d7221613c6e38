"""Opening the workspace that a command line names."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from nodegraph.cli.arguments import Assignment

if TYPE_CHECKING:
    from nodegraph.network import Network


def open_workspace(file: str, assignments: Iterable[Assignment] = ()) -> Network:
    """Load a workspace, or the one that a picture carries, and set what ``--set`` says, in that order."""
    from nodegraph import workspace
    from nodegraph.overrides import assign

    network = workspace.load(file)
    for assignment in assignments:
        assign(network, assignment.place, assignment.text)
    return network
