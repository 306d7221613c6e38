"""What nodes share: variables, what follows them and what they are derived from. Reads the network, knows no Qt."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from nodegraph import links
from nodegraph.errors import GraphError
from nodegraph.network import Kept, Network
from nodegraph.ports import port_type
from nodegraph.wires import value_type

LONG = 60
"""Letters of a value that are shown."""


@dataclass(frozen=True, slots=True)
class Shared:
    """One variable.

    path: ``camera``, or ``group/camera`` of one that belongs to a group. users: ``node.parameter``, full paths, in the
    order of the document. operands, derived: paths of the variables in its expression, and of those that name it.
    trouble: why it has no value.
    """

    path: str
    kind: str
    expression: str
    value: str
    plain: bool
    color: str
    users: tuple[str, ...]
    operands: tuple[str, ...]
    derived: tuple[str, ...]
    trouble: str = ""

    @property
    def name(self) -> str:
        return self.path.rpartition("/")[2]


def shared(network: Network) -> list[Shared]:
    """All variables of a document, those of the top level first."""
    users: dict[links.Scoped, list[str]] = {}
    for node in network.root.walk():
        for param, variable in node.links.items():
            scoped = links.lookup(node.parent, variable) if node.parent is not None else None
            if scoped is not None:
                users.setdefault(scoped, []).append(f"{node.path}.{param}")
    tables = [(level, name) for level in network.root.levels() for name in level.variables]
    operands = {scoped: _operands(scoped) for scoped in tables}
    return [
        _told(
            scoped,
            tuple(users.get(scoped, ())),
            tuple(map(_path, operands[scoped])),
            tuple(_path(other) for other in tables if scoped in operands[other]),
        )
        for scoped in tables
    ]


def value_text(value: Any) -> str:
    """A value in one short line: as JSON where it is a number, text or several, else what it says of itself."""
    if isinstance(value, (bool, int, str)):
        text = json.dumps(value, ensure_ascii=False)
    elif isinstance(value, float):
        text = f"{value:.6g}"
    elif isinstance(value, (tuple, list)):
        text = "[" + ", ".join(value_text(part) for part in value) + "]"
    else:
        text = port_type(type(value)).summary(value)
    return text if len(text) <= LONG else f"{text[: LONG - 1]}\u2026"


def _told(scoped: links.Scoped, users: tuple[str, ...], operands: tuple[str, ...], derived: tuple[str, ...]) -> Shared:
    level, name = scoped
    variable = level.variables[name]
    value, plain, trouble = "", False, ""
    try:
        got = links.evaluate(scoped)
        value = value_text(got)
        plain = not variable.expression and isinstance(got, (bool, int, float, str, tuple, list))
    except GraphError as error:
        trouble = str(error)
        value = "" if isinstance(variable.value, Kept) or variable.expression else str(variable.value)
    return Shared(
        _path(scoped), variable.kind, variable.expression, value, plain, _color(level, users), users, operands, derived,
        trouble,
    )  # fmt: skip


def _operands(scoped: links.Scoped) -> list[links.Scoped]:
    level, name = scoped
    found = [links.lookup(level, operand) for operand in links.names_in(level.variables[name])]
    return [one for one in found if one is not None]


def _path(scoped: links.Scoped) -> str:
    return scoped[0].prefix + scoped[1]


def _color(level: Network, users: tuple[str, ...]) -> str:
    """The colour of the plugs of what the variable holds."""
    for user in users:
        path, _, param = user.rpartition(".")
        try:
            return port_type(value_type(links.plain_parameter(level.root.node(path), param)[2])).color
        except GraphError:
            continue
    return "#b0b0b0"
