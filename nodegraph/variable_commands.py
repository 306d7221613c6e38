"""Edits of variables and links.

A variable comes into being with its first link or by `AddVariable`, and goes, in the same step, with the last parameter
or expression that used it.
"""

from __future__ import annotations

from typing import Any

from nodegraph import expressions, links
from nodegraph.changes import level_at, put_variable, reap, rename_uses, touch_followers, unlink
from nodegraph.commands import Command
from nodegraph.edits import Edits
from nodegraph.errors import CommandError, ParameterError, near_miss
from nodegraph.links import FRAME, Scoped, label, lookup
from nodegraph.network import Network, Node, Variable, check_id, split
from nodegraph.params import Parameter, kind, stand_in
from nodegraph.wires import targets


class Link(Command):
    """Let a parameter follow a variable.

    A variable that is not there is made at the top level with the parameter's kind and value. One that is there must
    suit: its kind, and its present value, which the parameter takes over. Raises ParameterError with the reason.
    """

    name = "link"

    def __init__(self, target: str, variable: str) -> None:
        super().__init__()
        self.target = target
        self.variable = variable

    def edit(self, network: Network, edits: Edits) -> None:
        path, param = split(self.target, "node.parameter")
        node = network.node(path)
        level = node.parent
        assert level is not None
        links.plain_parameter(node, param)
        ends = [links.plain_parameter(leaf, name) for leaf, name in targets(node, param)]
        for leaf, name, _ in ends:
            link = links.link_of(leaf, name)
            if link is not None and link[0] is not node and _is_inside(node, link[0]):
                raise ParameterError(
                    f"{self.target}: follows {link[2]} through {link[0].path}.{link[1]}; unlink that first"
                )
        old = node.links.get(param)
        if old == self.variable:
            return
        scoped = lookup(level, self.variable)
        if scoped is None:
            scoped = self._make(edits, network, ends[0])
        variable = scoped[0].variables[scoped[1]]
        for _, _, declared in ends:
            if not links.fits(variable, declared):
                raise ParameterError(
                    f"{self.target}: is a {declared.kind} and cannot follow {scoped[1]}, a {variable.kind}"
                )
        self._check_range(scoped, [declared for _, _, declared in ends])
        value = links.evaluate(scoped)
        for _, _, declared in ends:
            declared.check(value, self.target)
        before = lookup(level, old) if old else None
        edits.put(node.links, param, self.variable)
        if param in node.params:
            edits.drop(node.params, param)
        reap(edits, [before] if before else [])
        edits.touch(*[leaf for leaf, _, _ in ends])

    def _make(self, edits: Edits, network: Network, end: tuple[Node, str, Parameter]) -> Scoped:
        leaf, name, declared = end
        try:
            value = links.parameter_value(leaf, name)
        except ParameterError:
            value = declared.default
        check_variable_name(network, self.variable)
        made = Variable(declared.kind, value)
        if self.variable == FRAME and declared.kind != "Int":
            if declared.kind not in links.NUMBERS:
                raise ParameterError(f"{self.target}: {FRAME} counts pictures, and a {declared.kind} is no number")
            made = Variable("Int", int(value))
        edits.put(network.variables, self.variable, made)
        return network, self.variable

    def _check_range(self, scoped: Scoped, added: list[Parameter]) -> None:
        there = [declared for _, _, declared in links.parameters(scoped)]
        low, high = links.common_range([*there, *added])
        if low is not None and high is not None and low > high:
            others = ", ".join(f"{leaf.path}.{name}" for leaf, name, _ in links.parameters(scoped))
            raise ParameterError(f"{self.target}: shares no value with {others}, which follow {scoped[1]}, too")


class Unlink(Command):
    """Let a parameter go its own way, with the value that it has."""

    name = "unlink"

    def __init__(self, target: str) -> None:
        super().__init__()
        self.target = target

    def edit(self, network: Network, edits: Edits) -> None:
        path, param = split(self.target, "node.parameter")
        node = network.node(path)
        if param not in node.links:
            raise ParameterError(f"{self.target}: follows no variable{near_miss(param, node.links)}")
        unlink(edits, node, param)


class SetVariable(Command):
    """Set a plain variable, and so everything that follows it. ``encoded``: the value is JSON."""

    name = "set"

    def __init__(self, variable: str, value: Any, *, encoded: bool = False) -> None:
        super().__init__()
        self.variable = variable
        self.value = value
        self.encoded = encoded

    def edit(self, network: Network, edits: Edits) -> None:
        scoped = find_variable(network, self.variable)
        variable = scoped[0].variables[scoped[1]]
        if variable.expression:
            raise ParameterError(f"{label(scoped)}: follows {variable.expression!r}; change the expression instead")
        value = self.value
        if self.encoded:
            value = links.codec(scoped, value).decode(value, label(scoped))
        put_variable(edits, scoped, value)


class AddVariable(Command):
    """Make a variable that nobody follows yet: plain with a value, or derived with an expression."""

    name = "add variable"

    def __init__(self, variable: str, kind: str, value: Any = None, *, expression: str = "", encoded: bool = False):
        super().__init__()
        self.variable = variable
        self.kind = kind
        self.value = value
        self.expression = expression
        self.encoded = encoded

    def edit(self, network: Network, edits: Edits) -> None:
        group, _, name = self.variable.rpartition("/")
        level = level_at(network, group)
        scoped = (level, name)
        check_variable_name(level, name)
        kind(self.kind)
        if name == FRAME and self.kind != "Int":
            raise ParameterError(f"{label(scoped)}: {FRAME} counts pictures and is an Int, not a {self.kind}")
        made = Variable(self.kind)
        edits.put(level.variables, name, made)
        if self.expression:
            derive(edits, scoped, self.expression)
            return
        declared = stand_in(self.kind, self.value)
        read = declared.decode if self.encoded else declared.check
        edits.assign(made, "value", read(self.value, label(scoped)))
        edits.touch()


class SetExpression(Command):
    """Derive a variable from others; an empty expression makes it plain again, with the value that it has."""

    name = "derive"

    def __init__(self, variable: str, expression: str) -> None:
        super().__init__()
        self.variable = variable
        self.expression = expression

    def edit(self, network: Network, edits: Edits) -> None:
        scoped = find_variable(network, self.variable)
        level, name = scoped
        variable = level.variables[name]
        if variable.expression == self.expression:
            return
        before = [lookup(level, operand) for operand in links.names_in(variable)]
        if self.expression:
            derive(edits, scoped, self.expression)
        else:
            value = links.checked(scoped, links.evaluate(scoped))
            edits.assign(variable, "expression", "")
            edits.assign(variable, "value", value)
            touch_followers(edits, scoped)
        reap(edits, [operand for operand in before if operand is not None])


class RenameVariable(Command):
    """Give a variable another name; links and expressions follow."""

    name = "rename variable"

    def __init__(self, variable: str, new: str) -> None:
        super().__init__()
        self.variable = variable
        self.new = new

    def edit(self, network: Network, edits: Edits) -> None:
        scoped = find_variable(network, self.variable)
        level, name = scoped
        if self.new == name:
            return
        check_variable_name(level, self.new)
        if self.new == FRAME and (level.variables[name].kind != "Int" or level.variables[name].expression):
            raise ParameterError(f"{label(scoped)}: {FRAME} is reserved for the plain Int that counts pictures")
        if any(inner.network is not None and self.new in inner.network.variables for inner in level.walk()):
            raise CommandError(f"{label(scoped)}: a group inside has a variable {self.new!r}; choose another name")
        rename_uses(edits, scoped, self.new)
        edits.rekey(level.variables, name, self.new)


class RemoveVariable(Command):
    """Remove a variable; the parameters that followed it keep the value."""

    name = "remove variable"

    def __init__(self, variable: str) -> None:
        super().__init__()
        self.variable = variable

    def edit(self, network: Network, edits: Edits) -> None:
        scoped = find_variable(network, self.variable)
        level, name = scoped
        for table, other in links.derived_from(scoped):
            raise CommandError(f"{label(scoped)}: {label((table, other))} is derived from it; change that first")
        operands = [lookup(level, operand) for operand in links.names_in(level.variables[name])]
        for node, param in list(links.followers(scoped)):
            unlink(edits, node, param)
        if name in level.variables:
            edits.drop(level.variables, name)
            edits.touch()
        reap(edits, [operand for operand in operands if operand is not None])


# -- shared -------------------------------------------------------------------------------------------------------


def find_variable(network: Network, path: str) -> Scoped:
    """The variable ``coarse``, or ``finish/coarse`` as the inside of a group sees it. Raises ParameterError."""
    group, _, name = path.rpartition("/")
    level = level_at(network, group)
    scoped = lookup(level, name)
    if scoped is None:
        raise ParameterError(f"{path}: no such variable{near_miss(name, links.visible_names(level))}")
    return scoped


def check_variable_name(level: Network, name: str) -> None:
    """Refuse a name that is none, that a function has, or that is seen on the level already. Raises CommandError."""
    check_id(name, links.visible_names(level), "variables.")
    if name in expressions.RESERVED:
        raise CommandError(f"variables.{name}: this is the name of a function; choose another")


def derive(edits: Edits, scoped: Scoped, text: str) -> None:
    """Write an expression. Raises ParameterError where it cannot be read, has no value, or a follower refuses it."""
    level, name = scoped
    if name == FRAME:
        raise ParameterError(f"{label(scoped)}: {FRAME} counts pictures and is never derived; derive others from it")
    expressions.parse(text, label(scoped))
    variable = level.variables[name]
    edits.assign(variable, "expression", text)
    edits.assign(variable, "value", None)
    touch_followers(edits, scoped)
    for one in links.dependents(scoped):
        links.checked(one, links.evaluate(one))


def _is_inside(inner: Node, outer: Node) -> bool:
    """Whether ``outer`` is a group around ``inner``."""
    level = inner.parent
    while level is not None and level.owner is not None:
        if level.owner is outer:
            return True
        level = level.owner.parent
    return False
