"""Views that turn together: their cameras follow one variable of the document."""

from __future__ import annotations

from typing import TYPE_CHECKING

from nodegraph import links
from nodegraph.errors import GraphError
from nodegraph.network import split, unique
from nodegraph.pictures import views_of
from nodegraph.subjects import moved_with
from nodegraph.variable_commands import Link

if TYPE_CHECKING:
    from nodegraph.editor.session import Session
    from nodegraph.network import Network


def others(session: Session, view: str) -> dict[str, bool]:
    """The other views that have a camera that can be turned, and whether they turn with this one."""
    mine = set(moved_with(session.network, view))
    variables = {_variable(session.network, target) for target in mine} - {""}
    found = {}
    for path in views_of(session.network.flatten(), None):
        theirs = moved_with(session.network, path) if path != view else []
        if theirs:
            followed = {_variable(session.network, target) for target in theirs}
            found[path] = not mine.isdisjoint(theirs) or not variables.isdisjoint(followed)
    return found


def share(session: Session, view: str, paths: list[str]) -> None:
    """Let other views turn with this one, as one step; they look from where it looks now."""
    mine = moved_with(session.network, view)
    if not mine or not paths:
        session.tell("info", "there is no other view with a camera to turn together with", view)
        return
    variable = next(filter(None, (_variable(session.network, target) for target in mine)), "")
    targets = [target for path in paths for target in moved_with(session.network, path)]
    with session.gesture("link cameras"):
        if not variable:
            variable = unique("camera", session.network.variables)
            targets = [*mine, *targets]
        for target in dict.fromkeys(targets):
            session.do(Link(target, variable))


def part(session: Session, view: str) -> None:
    """Give a view a camera of its own, which stands where the common one stands; one step."""
    mine = moved_with(session.network, view)
    flat = session.network.flatten()
    theirs = {target for path in views_of(flat, None) if path != view for target in moved_with(session.network, path)}
    if not theirs.isdisjoint(mine):
        session.tell("info", "this view shows what another shows, too, so they turn together", view)
        return
    if not any(others(session, view).values()):
        session.tell("info", "this view has a camera of its own already", view)
        return
    variable = unique("camera", session.network.variables)
    with session.gesture("a camera of its own"):
        for target in mine:
            session.do(Link(target, variable))  # the first one makes it, with the value that the common one has


def _variable(network: Network, target: str) -> str:
    """The variable that a camera follows, empty for none."""
    path, name = split(target, "node.parameter")
    try:
        link = links.link_of(network.node(path), name)
    except GraphError:
        return ""
    return link[2] if link is not None else ""
