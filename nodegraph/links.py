"""Who decides the value of a parameter: a wire, a variable, or the node itself.

A wire beats a link, a link beats the stored value; what a group's face says beats what is inside. A variable is looked
up in the table of its own level and then outwards. It belongs to all parameters that follow it: its value must please
every one of them.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from nodegraph import expressions
from nodegraph.errors import ParameterError, near_miss
from nodegraph.network import Kept, Network, Node, Variable, split
from nodegraph.params import Parameter, stand_in
from nodegraph.wires import feeds, targets

FRAME = "frame"
"""The reserved Int variable that counts the pictures of an animation."""

NUMBERS = ("Float", "Int", "Seed")
"""Kinds that may share a variable; every parameter still checks what it gets."""

Scoped = tuple[Network, str]
"""A variable: the level whose table holds it, and its name."""


# -- finding ------------------------------------------------------------------------------------------------------


def lookup(level: Network, name: str) -> Scoped | None:
    """The variable that a name means on a level: in its own table, or in the nearest one around it."""
    while name not in level.variables:
        if level.owner is None or level.owner.parent is None:
            return None
        level = level.owner.parent
    return level, name


def link_of(node: Node, param: str) -> tuple[Node, str, str] | None:
    """The link that decides a parameter, the outermost one: node (it or a group around it), name there, variable."""
    found = None
    here: Node | None = node
    while here is not None:
        if param in here.links:
            found = (here, param, here.links[param])
        owner = here.parent.owner if here.parent is not None else None
        inner, here = f"{here.id}.{param}", None
        for face, ports in owner.expose.params.items() if owner is not None else ():
            if inner in ports:
                here, param = owner, face
                break
    return found


def is_wired(node: Node, param: str) -> bool:
    """Whether a wire feeds this parameter, directly or through a group's face."""
    return bool(feeds(node, param))


def followers(scoped: Scoped) -> Iterator[tuple[Node, str]]:
    """Nodes and their parameters that are linked to exactly this variable (groups' faces as they are)."""
    level, name = scoped
    for node in level.walk():
        for param, variable in node.links.items():
            if variable == name and node.parent is not None and lookup(node.parent, name) == scoped:
                yield node, param


def derived_from(scoped: Scoped) -> Iterator[Scoped]:
    """Variables whose expressions name this one."""
    level, name = scoped
    for table in level.levels():
        for other, variable in table.variables.items():
            if variable.expression and name in names_in(variable) and lookup(table, name) == scoped:
                yield table, other


def dependents(scoped: Scoped) -> list[Scoped]:
    """This variable and all that are derived from it, directly or not."""
    found = [scoped]
    for one in found:
        found += [other for other in derived_from(one) if other not in found]
    return found


def names_in(variable: Variable) -> tuple[str, ...]:
    """Names in a variable's expression; none when it cannot be read."""
    try:
        return expressions.parse(variable.expression, "").names
    except ParameterError:
        return ()


def parameters(scoped: Scoped) -> Iterator[tuple[Node, str, Parameter]]:
    """Plain, known parameters that a variable decides."""
    for node, param in followers(scoped):
        for leaf, name in targets(node, param):
            declared = leaf.processor.params.get(name) if leaf.processor is not None else None
            if declared is not None:
                yield leaf, name, declared


# -- values -------------------------------------------------------------------------------------------------------


def label(scoped: Scoped) -> str:
    """How messages call a variable: ``variables.coarse``, or ``finish/variables.coarse`` inside a group."""
    return f"{scoped[0].prefix}variables.{scoped[1]}"


def evaluate(scoped: Scoped, _above: tuple[Scoped, ...] = ()) -> Any:
    """The value of a variable, expressions worked out. Raises ParameterError that begins with the variable."""
    level, name = scoped
    variable, where = level.variables[name], label(scoped)
    if scoped in _above:
        circle = " -> ".join(one[1] for one in (*_above[_above.index(scoped) :], scoped))
        raise ParameterError(f"{where}: {circle}: this variable follows itself; change one of the expressions")
    if not variable.expression:
        if isinstance(variable.value, Kept):
            raise variable.value.error(where)
        return variable.value
    expression = expressions.parse(variable.expression, where)
    values = {}
    for operand in expression.names:
        found = lookup(level, operand)
        if found is None:
            raise ParameterError(
                f"{where}: {variable.expression!r} names {operand!r}, which is no variable"
                f"{near_miss(operand, visible_names(level))}"
            )
        values[operand] = evaluate(found, (*_above, scoped))
    return expression.evaluate(values, where)


def visible_names(level: Network | None) -> list[str]:
    """Names of all variables that a level can see."""
    names: list[str] = []
    while level is not None:
        names += level.variables
        level = level.owner.parent if level.owner is not None else None
    return names


def linked_value(node: Node, param: str, declared: Parameter) -> Any:
    """The checked value that a linked parameter has. Raises ParameterError; call only where `link_of` finds a link."""
    link = link_of(node, param)
    assert link is not None
    holder, _, name = link
    where = f"{node.path}.{param}"
    scoped = lookup(holder.parent, name) if holder.parent is not None else None
    if scoped is None:
        level = holder.parent
        raise ParameterError(f"{where}: follows {name!r}, which is no variable{near_miss(name, visible_names(level))}")
    value = evaluate(scoped)
    variable = scoped[0].variables[name]
    if not fits(variable, declared):
        raise ParameterError(f"{where}: is a {declared.kind} and cannot follow {name}, a {variable.kind}")
    return declared.check(value, where)


def fits(variable: Variable, declared: Parameter) -> bool:
    """Whether a parameter may follow a variable: they are of one kind, or both are numbers."""
    return variable.kind == declared.kind or (variable.kind in NUMBERS and declared.kind in NUMBERS)


def checked(scoped: Scoped, value: Any) -> Any:
    """Return a value as a variable keeps it. Raises ParameterError where a parameter that follows it refuses it."""
    level, name = scoped
    variable = level.variables[name]
    return checked_by(variable.kind, [p for _, _, p in parameters(scoped)], value, label(scoped))


def checked_by(kind: str, declared: list[Parameter], value: Any, where: str) -> Any:
    """Return a value in the normal form of a kind, after every one of these parameters has accepted it."""
    normal = None
    for parameter in declared:
        one = parameter.check(value, where)
        if normal is None and parameter.kind == kind:
            normal = (one,)
    if normal is None:
        return stand_in(kind, value).check(value, where)
    return normal[0]


def codec(scoped: Scoped, value: Any) -> Parameter:
    """A declaration that can write and read the value of a variable."""
    variable = scoped[0].variables[scoped[1]]
    for _, _, declared in parameters(scoped):
        if declared.kind == variable.kind:
            return declared
    return stand_in(variable.kind, value)


def common_range(declared: list[Parameter]) -> tuple[float | None, float | None]:
    """The intersection of the hard ranges; None where an end is open. Empty when low > high."""
    lows = [p.min for p in declared if getattr(p, "min", None) is not None]  # type: ignore[attr-defined]
    highs = [p.max for p in declared if getattr(p, "max", None) is not None]  # type: ignore[attr-defined]
    return max(lows, default=None), min(highs, default=None)


def value_of(network: Network, name: str) -> Any:
    """The effective value of ``node.parameter``, or of a variable. Raises ParameterError, CommandError."""
    if "." not in name:
        scoped = lookup(network, name)
        if scoped is None:
            raise ParameterError(f"{name}: no such variable{near_miss(name, visible_names(network))}")
        return evaluate(scoped)
    path, param = split(name, "node.parameter")
    return parameter_value(network.node(path), param)


def parameter_value(node: Node, param: str) -> Any:
    """What a parameter has without looking at wires: the variable's value, the stored one, or the default.

    For a group it is that of the first parameter behind the face. Raises ParameterError.
    """
    leaf, name, declared = plain_parameter(node, param)
    if link_of(leaf, name) is not None:
        return linked_value(leaf, name, declared)
    value = leaf.params.get(name, declared.default)
    if isinstance(value, Kept):
        raise value.error(f"{leaf.path}.{name}")
    return value


def plain_parameter(node: Node, param: str) -> tuple[Node, str, Parameter]:
    """The (first) plain parameter behind ``node.param``. Raises ParameterError with the near miss."""
    where = f"{node.path}.{param}"
    if node.network is not None:
        if param not in node.expose.params:
            miss = near_miss(param, node.expose.params)
            raise ParameterError(f"{where}: the group shows no parameter {param!r}{miss}")
        found = targets(node, param)
        if not found:
            raise ParameterError(f"{where}: nothing is behind this parameter of the group")
        node, param = found[0]
    if node.processor is None:
        raise ParameterError(f"{where}: {node.type} is not available here, so its parameters are not known")
    if param not in node.processor.params:
        known = node.processor.params
        hint = "; it is an input, connect a wire to it" if param in node.processor.inputs else near_miss(param, known)
        raise ParameterError(f"{where}: no such parameter{hint}")
    return node, param, node.processor.params[param]


def same(declared: Parameter, a: Any, b: Any) -> bool:
    """Whether two checked values are written alike."""
    if a is b:
        return True
    return json.dumps(declared.encode(a)) == json.dumps(declared.encode(b))
