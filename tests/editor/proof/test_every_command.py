"""Every command of the package is done, undone and done again; one that is not told here fails the test."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Iterator

import pytest

import nodegraph
from nodegraph import Network, clipboard, workspace
from nodegraph import commands as c
from nodegraph import group_commands as g
from nodegraph import variable_commands as v
from nodegraph.editor.session import Session
from tests.editor.test_session import small

COMMANDS: dict[type[c.Command], Callable[[Network], c.Command]] = {
    c.Add: lambda net: c.Add("filter.gradient", "new", {}),
    c.Remove: lambda net: c.Remove(["blur", "group"]),
    c.Connect: lambda net: c.Connect("volume.volume", "slice.volume", replace=True),
    c.Disconnect: lambda net: c.Disconnect("slice.volume"),
    c.Set: lambda net: c.Set("blur.sigma", 3.0),
    c.Reset: lambda net: c.Reset("second.sigma"),
    c.Rename: lambda net: c.Rename("blur", "other"),
    c.Mute: lambda net: c.Mute("blur"),
    c.SetUI: lambda net: c.SetUI("blur", "position", [1, 2]),
    g.Group: lambda net: g.Group(["blur", "slice"], "both"),
    g.Ungroup: lambda net: g.Ungroup("group"),
    g.ShowPort: lambda net: g.ShowPort("group", "params", "width", "inner.sigma"),
    g.HidePort: lambda net: g.HidePort("group", "inputs", next(iter(net.node("group").expose.inputs))),
    v.Link: lambda net: v.Link("second.sigma", "width"),
    v.Unlink: lambda net: v.Unlink("blur.sigma"),
    v.SetVariable: lambda net: v.SetVariable("width", 7.0),
    v.AddVariable: lambda net: v.AddVariable("spare", "Float", 1.5),
    v.SetExpression: lambda net: v.SetExpression("twice", "3 * width"),
    v.RenameVariable: lambda net: v.RenameVariable("width", "breadth"),
    v.RemoveVariable: lambda net: v.RemoveVariable("twice"),
    clipboard.Paste: lambda net: clipboard.Paste(clipboard.copy(net, ["blur", "slice"])),
}
NO_STEPS = {"Rebind"}
"""Commands that never become a step of the history: a plug-in that was reloaded changes no document."""


def document() -> Network:
    """Four nodes, a group of two, variables, one of them derived, and a value that is no default."""
    network = small()
    for id in ("second", "inner", "end"):
        network.add("filter.gaussian_blur", id)
    network.connect("volume.volume", "inner.volume")
    network.connect("inner.smoothed", "end.volume")
    network.set("second.sigma", 2.0)
    network.link("blur.sigma", "width")
    network.history.do(v.AddVariable("twice", "Float", expression="2 * width"))
    network.history.do(g.Group(["inner", "end"], "group"))
    network.history.clear()
    return network


def found(cls: type[c.Command]) -> Iterator[type[c.Command]]:
    for below in cls.__subclasses__():
        if below.__module__.startswith("nodegraph."):
            yield below
        yield from found(below)


def test_every_command_is_told_here() -> None:
    for module in pkgutil.iter_modules(nodegraph.__path__):
        if not module.ispkg and module.name != "__main__":
            importlib.import_module(f"nodegraph.{module.name}")
    names = {cls.__name__ for cls in found(c.Command)}
    assert names - NO_STEPS == {cls.__name__ for cls in COMMANDS}
    assert names >= NO_STEPS


@pytest.mark.parametrize("cls", COMMANDS, ids=lambda cls: cls.__name__)
def test_undo_takes_it_back_and_redo_does_it_again(cls: type[c.Command], session: Session) -> None:
    session.adopt(document())
    before = workspace.dumps(session.network)
    assert session.do(COMMANDS[cls](session.network))
    after = workspace.dumps(session.network)
    assert after != before
    for _ in range(2):
        session.undo()
        assert workspace.dumps(session.network) == before
        session.redo()
        assert workspace.dumps(session.network) == after
