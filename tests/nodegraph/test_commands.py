"""Commands: any sequence can be taken back exactly, done again exactly, and never leaves a stale flat view."""

from __future__ import annotations

import random
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nodegraph.commands import Add, Connect, Disconnect, Mute, Remove, Rename, Reset, Set, SetUI
from nodegraph.errors import CommandError, GraphError, ParameterError
from nodegraph.flat import Flat
from nodegraph.group_commands import Group, HidePort, ShowPort, Ungroup
from nodegraph.network import Network, Node
from nodegraph.variable_commands import (
    AddVariable,
    Link,
    RemoveVariable,
    RenameVariable,
    SetExpression,
    SetVariable,
    Unlink,
)
from nodegraph.workspace import dumps, loads
from tests.support.document import KIT, chain, find

START = """{"nodegraph": 1, "later": [1.5],
  "variables": {"eye": {"kind": "Camera", "value": {"eye": [0, -90, 0]}, "note": "x"},
                "twice": {"kind": "Float", "expression": "once * 2"}, "once": {"kind": "Float", "value": 1}},
  "nodes": {"ct": {"type": "source"},
            "gone": {"type": "filter.gone", "params": {"a": 1}, "inputs": {"v": "ct.volume"}},
            "blur": {"type": "blur", "params": {"sgima": 3, "sigma": 2}, "inputs": {"volume": "ct.volume"}},
            "raycast": {"type": "raycast", "links": {"camera": "eye", "step": "twice"},
                        "inputs": {"volume": "blur.smoothed", "mask": "ct.volume"}},
            "late": {"type": "group",
                     "nodes": {"fly": {"type": "fly"}, "b": {"type": "blur", "links": {"sigma": "in"}}},
                     "variables": {"in": {"kind": "Float", "expression": "once + 1"}},
                     "expose": {"inputs": {"volume": ["b.volume"]}, "params": {"frame": ["fly.frame"]},
                                "outputs": {"smoothed": "b.smoothed", "camera": "fly.camera"}},
                     "inputs": {"volume": "blur.smoothed"}}},
  "ui": {"zoom": 2, "nodes": {"ct": {"x": 1}, "nobody": {"x": 2}}}}"""

VALUES: dict[str, list[Any]] = {
    "step": [0.5, 1.0, 2.0, 9.0],
    "sigma": [0.0, 1.0, 2.5, -1.0],
    "gain": [0.5, 1.0, 3.0],
    "iterations": [1, 2, 30],
    "frame": [0, 5],
    "lit": [True, False],
    "shininess": [8.0, 9.0],
    "title": ["", "a"],
    "mode": ["nearest", "mirror", "none"],
}
VARIABLES = ["eye", "once", "twice", "in", "frame", "a", "b", "late/in"]
EXPRESSIONS = ["", "once / 2", "a + b", "twice", "frame * 0.1", "1 /", "once + nothing", "0.75"]


def random_command(net: Network, draw: random.Random) -> Any:
    """A command that may or may not make sense."""
    nodes = list(net.walk())
    paths = [node.path for node in nodes] or ["none"]
    groups = [node.path for node in nodes if node.network is not None] or ["none"]

    def ports(node: Node) -> list[str]:
        cls = node.processor
        return [*cls.inputs, *cls.params] if cls else [*node.expose.inputs, *node.expose.params, "v"]

    def outputs(node: Node) -> list[str]:
        return [*node.processor.outputs] if node.processor else [*node.expose.outputs, "out"]

    def port() -> str:
        node = draw.choice(nodes) if nodes else None
        return f"{node.path}.{draw.choice(ports(node) or ['x'])}" if node else "none.x"

    def output() -> str:
        node = draw.choice(nodes) if nodes else None
        return f"{node.path}.{draw.choice(outputs(node) or ['x'])}" if node else "none.x"

    def parameter() -> tuple[str, Any]:
        target = port()
        return target, draw.choice(VALUES.get(target.rpartition(".")[2], [0.5]))

    def sibling_wire() -> tuple[str, str]:
        node = draw.choice(nodes)
        other = draw.choice(list(node.parent.nodes.values()))  # type: ignore[union-attr]
        return (
            f"{other.path}.{draw.choice(outputs(other) or ['x'])}",
            f"{node.path}.{draw.choice(ports(node) or ['x'])}",
        )

    def siblings() -> list[str]:
        node = draw.choice(nodes)
        level = [one.path for one in node.parent.nodes.values()]  # type: ignore[union-attr]
        return draw.sample(level, draw.randint(1, min(3, len(level))))

    def face() -> Any:
        return draw.choice(["inputs", "params", "outputs"])

    def inner() -> str:
        return (port() if draw.random() < 0.6 else output()).rpartition("/")[2]

    if not nodes:
        return Add(draw.choice(list(KIT)))
    from nodegraph.clipboard import Paste, copy

    makers = [
        lambda: Add(draw.choice(list(KIT)), group=draw.choice(["", *groups])),
        lambda: Add("blur", draw.choice(["x", "y", "blur"]), {"sigma": draw.choice([1.0, 2.0, 99.0])}),
        lambda: Remove(draw.sample(paths, draw.randint(1, min(2, len(paths))))),
        lambda: Connect(output(), port(), replace=draw.random() < 0.3),
        *[lambda: Connect(*sibling_wire(), replace=draw.random() < 0.5, place=draw.choice([None, 0]))] * 5,
        lambda: Disconnect(port()),
        *[lambda: Set(*parameter())] * 3,
        lambda: Reset(port()),
        lambda: Rename(draw.choice(paths), draw.choice(["p", "q", "ct", "9"])),
        lambda: Mute(draw.choice(paths), draw.random() < 0.5),
        lambda: SetUI(draw.choice(["", *paths]), draw.choice(["x", "zoom"]), draw.choice([None, 1, [2]])),
        *[lambda: Link(port(), draw.choice(VARIABLES[:-1]))] * 3,
        lambda: Unlink(port()),
        lambda: SetVariable(draw.choice(VARIABLES), draw.choice([0.5, 1, 3, 90, "text"])),
        lambda: AddVariable(draw.choice(VARIABLES), draw.choice(["Float", "Int", "Vec"]), draw.choice([0.5, 2])),
        lambda: AddVariable(draw.choice(VARIABLES), "Float", expression=draw.choice(EXPRESSIONS[1:])),
        lambda: SetExpression(draw.choice(VARIABLES), draw.choice(EXPRESSIONS)),
        lambda: RenameVariable(draw.choice(VARIABLES), draw.choice(["a", "b", "sin", "frame"])),
        lambda: RemoveVariable(draw.choice(VARIABLES)),
        *[lambda: Group(siblings(), draw.choice(["group", "g"]))] * 2,
        *[lambda: Ungroup(draw.choice(groups))] * 2,
        *[lambda: ShowPort(draw.choice(groups), face(), draw.choice(["s", "t", "volume"]), inner())] * 3,
        lambda: HidePort(draw.choice(groups), face(), draw.choice(["s", "volume", "smoothed", "frame"])),
        lambda: Paste(copy(net, siblings()), group=draw.choice(["", *groups])),
    ]
    return draw.choice(makers)()


def told(flat: Flat) -> Any:
    """All that a flat view says, but for revisions; variables that differ only in identity look the same."""
    nodes = [
        (
            path,
            node.type,
            node.sources,
            node.wired,
            {name: repr(value) for name, value in node.values.items()},
            node.blocked,
        )
        for path, node in flat.nodes.items()
    ]
    return nodes, {name: str(source) for name, source in flat.outputs.items()}, flat.muted


def what_is_computed(net: Network) -> Any:
    """Nodes with their values, wires counted, paths left out."""
    return sorted(
        (
            node.type,
            sorted((name, repr(value)) for name, value in node.values.items()),
            [(name, len(sources)) for name, sources in node.sources.items()],
            sorted(node.wired),
            bool(node.blocked),
        )
        for node in net.flatten().nodes.values()
    )


@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**32 - 1), length=st.integers(1, 40))
def test_any_sequence_is_undone_and_redone_exactly(seed: int, length: int) -> None:
    draw = random.Random(seed)
    net = loads(START, find=find)
    states = [dumps(net)]
    for _ in range(length):
        before, computed = dumps(net), what_is_computed(net)
        try:
            command = random_command(net, draw)
            net.history.do(command)
        except GraphError:
            assert dumps(net) == before, "a refused command changed the document"
            continue
        after = dumps(net)
        if isinstance(command, Group | Ungroup | ShowPort | Rename | RenameVariable):
            assert what_is_computed(net) == computed, "a new name or group changed a result"
        if not command.empty:
            states.append(after)
        again = loads(after, find=find)
        assert dumps(again) == after, "load and save changed the document"
        assert told(net.flatten()) == told(again.flatten()), "the flat view is stale"
        if draw.random() < 0.2 and len(states) > 1:
            net.undo()
            assert dumps(net) == states[-2]
            assert told(net.flatten()) == told(loads(states[-2], find=find).flatten())
            net.redo()
            assert dumps(net) == after
    for state in reversed(states[:-1]):
        net.undo()
        assert dumps(net) == state
    with pytest.raises(CommandError, match="nothing to undo"):
        net.undo()
    for state in states[1:]:
        net.redo()
        assert dumps(net) == state


def test_a_gesture_is_one_step_and_small() -> None:
    net = chain()
    before = dumps(net)
    with net.history.gesture("drag"):
        for i in range(1000):
            net["raycast"].step = 0.1 + i / 1000
    after = dumps(net)
    assert net.history.undo_name == "drag"
    assert len(net.history._done[-1].commands) <= 4  # through the default, whose record is of another kind
    net.undo()
    assert dumps(net) == before
    net.redo()
    assert dumps(net) == after


def test_a_gesture_that_raises_is_taken_back() -> None:
    net = chain()
    before = dumps(net)

    def build() -> None:
        with net.history.gesture("build"):
            net.add("blur")
            net["raycast"].step = -1.0

    with pytest.raises(ParameterError):
        build()
    assert dumps(net) == before
    net.history.begin("press")
    net["raycast"].step = 0.5
    with pytest.raises(CommandError, match="'press' has not ended"):
        net.undo()
    net.history.cancel()
    assert dumps(net) == before


def test_history_tells_observers_and_knows_what_is_saved() -> None:
    net = chain()
    net.history.mark_saved()
    seen: list[list[str]] = []
    net.history.observers.append(lambda commands: seen.append([command.name for command in commands]))
    net["raycast"].step = 0.5
    assert net.history.modified
    net.undo()
    assert not net.history.modified
    net["raycast"].step = 1.0  # it has this value already
    assert not net.history.modified
    assert net.history.redo_name == "set step"
    net.undo()
    assert net.history.modified
    net["raycast"].step = 0.7  # the saved state can be reached no more
    while net.history.undo_name:
        net.undo()
    assert net.history.modified
    assert seen[:2] == [["set step"], ["set step"]]


def test_commands_tell_what_they_touched() -> None:
    net = chain()
    command = net.history.do(Set("blur.sigma", 3.0))
    assert command.touched == {"blur"}
    assert not command.structural
    assert net.history.do(Connect("ct.volume", "raycast.labels")).structural


def test_a_rename_leads_wires_faces_and_ui_along() -> None:
    net = chain()
    net.history.do(SetUI("blur", "position", [10, 20]))
    net.rename("blur", "smooth")
    assert net["raycast"].inputs == {"volume": ("smooth.smoothed",)}
    assert '"smooth": {"position": [10, 20]}' in dumps(net)
    assert list(net.nodes) == ["ct", "smooth", "raycast"]
    net.group("smooth", id="g")
    net.rename("g/smooth", "blur")
    assert net.nodes["g"].expose.outputs == {"smoothed": "blur.smoothed"}


def test_removing_a_node_cuts_its_wires_and_undo_restores_places() -> None:
    net = chain()
    before = dumps(net)
    net.remove("ct", "blur")
    assert list(net.nodes) == ["raycast"]
    assert net["raycast"].inputs == {}
    net.undo()
    assert dumps(net) == before
    del net["blur"]
    assert "blur" not in net


def test_a_command_is_its_own_record() -> None:
    with pytest.raises(CommandError, match="never done"):
        Mute("blur").revert(chain())
