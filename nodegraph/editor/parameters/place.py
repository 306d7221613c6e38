"""One parameter of one node in the document: what it has, who decides it, and how it is changed."""

from __future__ import annotations

import ast
import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from nodegraph import animation, links
from nodegraph.commands import Command, Reset, Set
from nodegraph.data import Volume
from nodegraph.errors import GraphError, ParameterError
from nodegraph.group_commands import HidePort, ShowPort
from nodegraph.network import Kept, Network, Node, Variable, unique
from nodegraph.params import File, Folder, Parameter, Text
from nodegraph.subjects import things_of
from nodegraph.variable_commands import AddVariable, Link, SetExpression, Unlink
from nodegraph.wires import feeds

if TYPE_CHECKING:
    from nodegraph.editor.session import Session

DERIVABLE = ("Float", "Int", "Seed")
"""Kinds that an expression can compute."""


@dataclass(frozen=True, slots=True)
class Tie:
    """Who decides a value. kind: "own" (the node itself), "wire", "variable" or "expression".

    source: ``node.output`` or the name of the variable. text: the expression.
    """

    kind: str = "own"
    source: str = ""
    text: str = ""

    @property
    def locked(self) -> bool:
        """Whether the value cannot be set here."""
        return self.kind in ("wire", "expression")


class Place:
    """A parameter by path and name, looked up anew at each use. All changes go through the session."""

    def __init__(self, session: Session, path: str, name: str) -> None:
        self.session = session
        self.path = path
        self.name = name

    @property
    def target(self) -> str:
        return f"{self.path}.{self.name}"

    @property
    def node(self) -> Node:
        return self.session.network.node(self.path)

    @property
    def declared(self) -> Parameter:
        """The declaration; of a group's parameter the first one behind its face."""
        return links.plain_parameter(self.node, self.name)[2]

    # -- reading ------------------------------------------------------------------------------------------------

    def value(self) -> Any:
        """The effective value; that of a wire where it is known, else what would hold without it.

        Raises ParameterError for a stored value or an expression that cannot be used.
        """
        tie = self.tie()
        if tie.kind == "wire":
            path, _, output = tie.source.rpartition(".")
            carried = self.session.value(path, output)
            if carried is not None:
                return self.declared.check(carried, self.target)
        return links.parameter_value(self.node, self.name)

    def tie(self) -> Tie:
        """Who decides the value now."""
        leaf, name, _ = links.plain_parameter(self.node, self.name)
        wires = feeds(leaf, name)
        if wires:
            level, text = wires[-1]
            return Tie("wire", level.prefix + text)
        link = links.link_of(leaf, name)
        if link is None:
            return Tie()
        variable = self._variable(link)
        if variable is not None and variable.expression:
            return Tie("expression", link[2], variable.expression)
        return Tie("variable", link[2])

    def is_default(self) -> bool:
        """Whether the value is the declared default."""
        try:
            declared = self.declared
            return links.same(declared, links.parameter_value(self.node, self.name), declared.default)
        except ParameterError:
            return False

    def variables(self) -> list[str]:
        """Names of the variables that this parameter could follow."""
        declared, level = self.declared, self.node.parent
        found = []
        for name in links.visible_names(level):
            scoped = links.lookup(level, name) if level is not None else None
            if scoped is not None and links.fits(scoped[0].variables[scoped[1]], declared):
                found.append(name)
        return found

    def fresh_variable(self, name: str = "") -> str:
        """A name for a new variable, made of the parameter's."""
        from nodegraph.expressions import RESERVED

        name = name or self.name
        return unique(f"{name}_value" if name in RESERVED else name, self._all_names())

    def text(self) -> str:
        """The value as text for the clipboard: JSON, or the words themselves."""
        declared = self.declared
        value = self.value()
        return str(value) if isinstance(value, str) else json.dumps(declared.encode(value))

    def volume(self) -> Volume | None:
        """The nearest volume that the node reads, as far as it is known; of a group, the node behind its face."""
        leaf, _, _ = links.plain_parameter(self.node, self.name)
        return nearest_volume(self.session, leaf.path)

    def as_python(self) -> str:
        """What a script says to decide the value in the same way; ``net`` is the network."""
        tie = self.tie()
        if tie.kind == "wire":
            return f"net.connect({tie.source!r}, {self.target!r})"
        if tie.kind == "own":
            return f"net.set({self.target!r}, {_literal(self.declared, self.value())})"
        name = self._level_of(tie.source) + tie.source
        decided = f"net.set({name!r}, {_literal(self.declared, self.value())})"
        if tie.kind == "expression":
            decided = f"net.derive({name!r}, {tie.text!r})"
        return f"net.link({self.target!r}, {tie.source!r})\n{decided}"

    def face(self) -> tuple[str, str] | None:
        """The group around the node, and the name that its face shows the parameter under, if it does."""
        level = self.node.parent
        if level is None or level.owner is None:
            return None
        port = f"{self.node.id}.{self.name}"
        shown = (name for name, ports in level.owner.expose.params.items() if port in ports)
        return level.owner.path, next(shown, "")

    def keys(self) -> list[int]:
        """The frames at which the animation has keys for the value."""
        try:
            return [key.frame for key in animation.track_of(self.session.network, self.target).keys]
        except GraphError:
            return []

    # -- changing: each returns why it was refused, or "" -------------------------------------------------------

    def set(self, value: Any) -> str:
        """Set the value."""
        try:
            self.declared.check(value, self.target)
        except GraphError as error:
            return str(error)
        return self._do(Set(self.target, value))

    def paste(self, text: str) -> str:
        """Set the value from text that `text` wrote, here or elsewhere."""
        declared = self.declared
        try:
            try:
                value = declared.decode(json.loads(text), self.target)
            except (json.JSONDecodeError, RecursionError):
                value = declared.decode(text.strip(), self.target)
            except ParameterError:
                if not isinstance(declared, (Text, File, Folder)):
                    raise
                value = declared.decode(text, self.target)  # digits, for example, are text as well
        except GraphError as error:
            return str(error)
        return self._do(Set(self.target, value))

    def reset(self) -> str:
        """Return to the default."""
        return self._do(Reset(self.target))

    def drop(self) -> str:
        """Drop a stored value that cannot be used."""
        return self._do(Reset(self.target))

    def link(self, variable: str) -> str:
        """Follow a variable, a new one if there is none of this name."""
        return self._do(Link(self.target, variable))

    def unlink(self) -> str:
        """Follow no variable any more."""
        return self._do(Unlink(self.target))

    def express(self, text: str) -> str:
        """Follow an expression: that of the variable that the parameter follows, or of a new one."""
        text = text.strip().removeprefix("=").strip()
        tie = self.tie()
        if not text:
            return self.unlink() if tie.kind == "expression" else ""
        if tie.kind == "expression":
            level = self._level_of(tie.source)
            return self._do(SetExpression(level + tie.source, text))
        name = self.fresh_variable(f"{self.node.id}_{self.name}")
        return self._do(AddVariable(name, self.declared.kind, expression=text), Link(self.target, name), step="derive")

    def show_on_face(self) -> str:
        """Show the parameter on the face of the group around its node."""
        face = self.face()
        assert face is not None
        group = self.session.network.node(face[0])
        name = unique(self.name, [*group.expose.inputs, *group.expose.params])
        return self._do(ShowPort(group.path, "params", name, f"{self.node.id}.{self.name}"))

    def hide_from_face(self) -> str:
        """Take the parameter off the face of the group around its node."""
        face = self.face()
        assert face is not None
        return self._do(HidePort(face[0], "params", face[1]))

    def add_key(self) -> str:
        """Set a key of the animation for the present value at the frame that is shown."""
        return self._animate(animation.key_at)

    def remove_key(self) -> str:
        """Remove the key of the animation at the frame that is shown."""
        return self._animate(animation.without_key)

    def _animate(self, make: Callable[[Network, str, int], Command]) -> str:
        try:
            command = make(self.session.network, self.target, self.session.frame)
        except GraphError as error:
            return str(error)
        return self._do(command)

    def begin(self) -> None:
        """Start a gesture: what follows until `end` is undone together."""
        self.session.begin(f"set {self.name}")

    def end(self) -> None:
        self.session.end()

    def cancel(self) -> None:
        self.session.cancel()

    def _do(self, *commands: Command, step: str = "") -> str:
        """Do commands as one step, all or none."""
        said: list[str] = []

        def listen(message: Any) -> None:
            said.append(message.text)

        session = self.session
        session.message.connect(listen)
        try:
            if len(commands) == 1:
                done = session.do(commands[0])
            else:
                session.begin(step)
                done = all(session.do(command) for command in commands)
                if done:
                    session.end()
                else:
                    session.cancel()
        finally:
            session.message.disconnect(listen)
        return "" if done else (said[-1] if said else f"{self.target}: this was refused")

    def _variable(self, link: tuple[Node, str, str]) -> Variable | None:
        holder, _, name = link
        scoped = links.lookup(holder.parent, name) if holder.parent is not None else None
        return scoped[0].variables[scoped[1]] if scoped is not None else None

    def _level_of(self, variable: str) -> str:
        """The prefix of the level whose table holds a variable."""
        leaf, name, _ = links.plain_parameter(self.node, self.name)
        link = links.link_of(leaf, name)
        scoped = links.lookup(link[0].parent, variable) if link is not None and link[0].parent is not None else None
        return scoped[0].prefix if scoped is not None else ""

    def _all_names(self) -> frozenset[str]:
        return frozenset(name for level in self.session.network.levels() for name in level.variables)


def nearest_volume(session: Session, path: str) -> Volume | None:
    """The nearest volume above a node, as far as it is known. Its numbers may lie on a device."""
    for name in things_of(session.network, path):
        node, _, output = name.rpartition(".")
        value = session.value(node, output) if node != path else None
        if isinstance(value, Volume):
            return value
    return None


def _literal(declared: Parameter, value: Any) -> str:
    """A value as arguments of ``net.set``: itself where Python can write it, else as JSON."""
    text = repr(value)
    try:
        if ast.literal_eval(text) == value:
            return text
    except (ValueError, SyntaxError):
        pass  # an object, or a number such as inf
    return f"{declared.encode(value)!r}, encoded=True"


def shown_parameters(place_of: Session, path: str) -> list[str]:
    """Names of the parameters of a node that mean something now, in the order of the declaration.

    One that depends on a wired parameter counts as shown. Stored values of names that nobody knows come last.
    """
    session, node = place_of, place_of.network.node(path)
    if node.network is not None:
        return [name for name in node.expose.params if _has_declaration(node, name)]
    if node.processor is None:
        return []
    values: dict[str, Any] = {}
    unknown = set()
    for name in node.processor.params:
        place = Place(session, path, name)
        try:
            tie = place.tie()
            if tie.kind == "wire":
                unknown.add(name)
            values[name] = place.value()
        except ParameterError:
            unknown.add(name)
    shown = set(node.processor.visible(values))
    return [
        name
        for name, declared in node.processor.params.items()
        if name in shown or unknown.intersection(declared.visible_if)
    ]


def kept_values(node: Node) -> dict[str, Kept]:
    """Stored values that cannot be used, by name."""
    return {name: value for name, value in node.params.items() if isinstance(value, Kept)}


def _has_declaration(node: Node, name: str) -> bool:
    try:
        links.plain_parameter(node, name)
    except GraphError:
        return False
    return True
