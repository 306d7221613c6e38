"""Edits of groups: put nodes into one, dissolve it, change what its face shows.

None of these changes what a network computes: the flat view is the same before and after, but for the paths.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from nodegraph import bends, links
from nodegraph.changes import hide_face, level_at, put_wires, reap, rename_uses, swap_faces, swap_sources, with_id
from nodegraph.commands import Command
from nodegraph.edits import Edits
from nodegraph.errors import CommandError, PortError, near_miss
from nodegraph.network import GROUP, Network, Node, check_id, split, unique
from nodegraph.wires import declaration, is_many, output_leaf

Face = Literal["inputs", "params", "outputs"]


class Group(Command):
    """Put nodes of one level into a new group that stands where the first of them stood. ``path``: the group's.

    Wires that cross its border go through its face; links stay, since a group sees the variables around it.
    """

    name = "group"

    def __init__(self, paths: Iterable[str], id: str = GROUP) -> None:
        super().__init__()
        self.paths = list(paths)
        self.id = id
        self.path = ""

    def edit(self, network: Network, edits: Edits) -> None:
        chosen = [network.node(path) for path in dict.fromkeys(self.paths)]
        if not chosen:
            raise CommandError("group: name at least one node")
        level = chosen[0].parent
        assert level is not None
        if any(node.parent is not level for node in chosen):
            raise CommandError(f"group: {', '.join(self.paths)} lie on different levels; choose nodes of one")
        moved = [node for node in level.nodes.values() if node in chosen]  # in file order
        id = self.id if self.id != GROUP else unique(GROUP, level.nodes)
        check_id(id, [other for other in level.nodes if level.nodes[other] not in moved], level.prefix)
        group = Node(id, GROUP, parent=level)
        group.network = Network(owner=group)
        self._check_order(moved)
        place = list(level.nodes).index(moved[0].id)
        inside = {node.id for node in moved}
        for node in moved:
            edits.drop(level.nodes, node.id)
        for node in moved:
            edits.assign(node, "parent", group.network)
            edits.put(group.network.nodes, node.id, node)
        edits.put(level.nodes, id, group, place)
        for node in moved:
            self._move_inputs(edits, group, node, inside)
        self._move_outputs(edits, level, group, inside)
        self._move_face(edits, level, group, inside)
        self.path = group.path
        edits.touch(*group.leaves(), structure=True)

    def _check_order(self, moved: list[Node]) -> None:
        """Inside a group its own wires come first, then those through the face. Refuse where that changes an order."""
        inside = {node.id for node in moved}
        for node in moved:
            for name, wires in node.inputs.items():
                crossing = [text.rpartition(".")[0] not in inside for text in wires]
                if crossing != sorted(crossing):
                    raise CommandError(
                        f"{node.path}.{name}: a group cannot keep the order of these wires; "
                        "move those from outside to the end"
                    )

    def _move_inputs(self, edits: Edits, group: Node, node: Node, inside: set[str]) -> None:
        """Lead wires from outside through the face. Inputs that read the same source share one name on it."""
        for name, wires in list(node.inputs.items()):
            crossing = tuple(text for text in wires if text.rpartition(".")[0] not in inside)
            if not crossing:
                continue
            table: dict[str, tuple[str, ...]] = group.expose.inputs if _is_input(node, name) else group.expose.params
            port = f"{node.id}.{name}"
            many = len(crossing) > 1 or is_many(node, name)
            shared = None if many else next((face for face in table if group.inputs.get(face) == crossing), None)
            put_wires(edits, node, name, tuple(text for text in wires if text not in crossing))
            if shared is not None:
                edits.put(table, shared, (*table[shared], port))
            else:
                face = unique(name, [*group.expose.inputs, *group.expose.params])
                edits.put(table, face, (port,))
                edits.put(group.inputs, face, crossing)

    def _move_outputs(self, edits: Edits, level: Network, group: Node, inside: set[str]) -> None:
        """Lead wires that leave through the face."""

        def through_face(text: str) -> str:
            return f"{group.id}.{_show_output(edits, group, text)}" if text.partition(".")[0] in inside else text

        swap_sources(edits, level, through_face)

    def _move_face(self, edits: Edits, level: Network, group: Node, inside: set[str]) -> None:
        """What the group around showed of the moved nodes, it now shows of the new group."""
        owner = level.owner
        if owner is None:
            return
        for outer, table in ((owner.expose.inputs, group.expose.inputs), (owner.expose.params, group.expose.params)):
            for face, ports in list(outer.items()):
                swapped = []
                for port in ports:
                    id, _, name = port.partition(".")
                    if id in inside:
                        shown = unique(name, [*group.expose.inputs, *group.expose.params])
                        edits.put(table, shown, (port,))
                        port = f"{group.id}.{shown}"
                    swapped.append(port)
                if tuple(swapped) != ports:
                    edits.put(outer, face, tuple(swapped))
        for face, port in list(owner.expose.outputs.items()):
            if port.partition(".")[0] in inside:
                edits.put(owner.expose.outputs, face, f"{group.id}.{_show_output(edits, group, port)}")


class Ungroup(Command):
    """Dissolve a group: its nodes move to the level around it, wires and links keep what they mean."""

    name = "ungroup"

    def __init__(self, path: str) -> None:
        super().__init__()
        self.path = path
        self.paths: list[str] = []

    def edit(self, network: Network, edits: Edits) -> None:
        inside = level_at(network, self.path)
        group = inside.owner
        assert group is not None
        level = group.parent
        assert level is not None
        if group.muted:
            raise CommandError(f"{self.path}: the group is muted as a whole; unmute it first")
        moved = list(inside.nodes.values())
        leaves = list(group.leaves())
        taken = set(level.nodes) - {group.id}
        ids: dict[str, str] = {}
        for node in moved:
            ids[node.id] = unique(node.id, taken | (set(inside.nodes) - {node.id}) if node.id in taken else taken)
            taken.add(ids[node.id])
        self._move_variables(edits, inside, level)
        self._move_links(edits, group)
        place = edits.drop(level.nodes, group.id)
        outer = dict(group.inputs)
        for node in moved:
            edits.drop(inside.nodes, node.id)
            edits.assign(node, "parent", level)
            if ids[node.id] != node.id:
                edits.assign(node, "id", ids[node.id])
        for i, node in enumerate(moved):
            edits.put(level.nodes, node.id, node, place + i)
            for name, wires in list(node.inputs.items()):
                bends.follow(edits, node, name, lambda text: with_id(text, ids))
                edits.put(node.inputs, name, tuple(with_id(text, ids) for text in wires))
        for table in (group.expose.inputs, group.expose.params):
            for face, ports in table.items():
                for port in ports if face in outer else ():
                    end, _, name = with_id(port, ids).partition(".")
                    node = level.nodes[end]
                    edits.put(node.inputs, name, (*node.inputs.get(name, ()), *outer[face]))
        out = {f"{group.id}.{face}": with_id(port, ids) for face, port in group.expose.outputs.items()}
        swap_sources(edits, level, lambda text: out.get(text, text))
        self._move_face(edits, level, group, ids, out)
        self.paths = [node.path for node in moved]
        edits.touch(*leaves, structure=True)

    def _move_variables(self, edits: Edits, inside: Network, level: Network) -> None:
        """The group's own variables move out, under a new name where another of that name is about."""
        for name, variable in list(inside.variables.items()):
            taken = [other for table in level.root.levels() for other in table.variables if table is not inside]
            new = unique(name, [*taken, *(other for other in inside.variables if other != name)])
            if new != name:
                rename_uses(edits, (inside, name), new)
            edits.drop(inside.variables, name)
            edits.put(level.variables, new, variable)

    def _move_links(self, edits: Edits, group: Node) -> None:
        """A link on the face becomes a link of every parameter behind it."""
        assert group.network is not None
        for face, variable in list(group.links.items()):
            for port in group.expose.params.get(face, ()):
                id, _, param = port.partition(".")
                node = group.network.nodes[id]
                old = links.lookup(group.network, node.links[param]) if param in node.links else None
                edits.put(node.links, param, variable)
                reap(edits, [old] if old is not None else [])

    def _move_face(self, edits: Edits, level: Network, group: Node, ids: dict[str, str], out: dict[str, str]) -> None:
        """What the group around showed of this one, it now shows of its nodes."""
        if level.owner is None:
            return
        inner = {**group.expose.inputs, **group.expose.params}

        def leads(port: str) -> tuple[str, ...]:
            id, _, name = port.partition(".")
            return tuple(with_id(one, ids) for one in inner[name]) if id == group.id else (port,)

        swap_faces(edits, level, leads, lambda port: out.get(port, port))


class ShowPort(Command):
    """Show a port of the inside on a group's face. A name that is there leads to this port, too (inputs, params)."""

    name = "expose"

    def __init__(self, group: str, face: Face, name: str, port: str) -> None:
        super().__init__()
        self.group = group
        self.face: Face = face
        self.shown = name
        self.port = port

    def edit(self, network: Network, edits: Edits) -> None:
        inside = level_at(network, self.group)
        group = inside.owner
        assert group is not None
        where = f"{self.group}.{self.shown}"
        id, name = split(self.port, "node.port")
        node = inside.node(id)
        if node.parent is not inside:
            raise CommandError(f"{where}: {self.port} lies deeper; show it on the face of its own group first")
        if self.face == "outputs":
            output_leaf(node, name, where)
            check_id(self.shown, group.expose.outputs, f"{self.group}.")
            edits.put(group.expose.outputs, self.shown, self.port)
        else:
            self._show_input(edits, group, node, name, where)
        edits.touch(*group.leaves(), structure=True)

    def _show_input(self, edits: Edits, group: Node, node: Node, name: str, where: str) -> None:
        table = group.expose.inputs if self.face == "inputs" else group.expose.params
        other = group.expose.params if self.face == "inputs" else group.expose.inputs
        declaration(node, name, where)
        if _is_input(node, name) != (self.face == "inputs"):
            raise CommandError(f"{where}: {self.port} is no {'input' if self.face == 'inputs' else 'parameter'}")
        ports = table.get(self.shown, ())
        if self.shown not in table:
            check_id(self.shown, other, f"{group.path}.")
        if any(self.port in shown for shown in table.values()):
            raise CommandError(f"{where}: {self.port} is shown already")
        if node.inputs.get(name) and not is_many(node, name):
            raise PortError(f"{where}: {self.port} is wired inside; disconnect it first")
        if ports and (group.inputs.get(self.shown) or self.shown in group.links):
            raise CommandError(f"{where}: something is connected to it outside; disconnect that first")
        edits.put(table, self.shown, (*ports, self.port))


class HidePort(Command):
    """Take a name off a group's face, with the wires outside that hang on it."""

    name = "hide"

    def __init__(self, group: str, face: Face, name: str) -> None:
        super().__init__()
        self.group = group
        self.face: Face = face
        self.shown = name

    def edit(self, network: Network, edits: Edits) -> None:
        group = level_at(network, self.group).owner
        assert group is not None
        table = getattr(group.expose, self.face)
        if self.shown not in table:
            raise CommandError(f"{self.group}.{self.shown}: the group shows no such port{near_miss(self.shown, table)}")
        hide_face(edits, group, self.face, self.shown)


def _is_input(node: Node, name: str) -> bool:
    """Whether a port counts as an input: all but parameters do, unknown ports too."""
    if node.network is not None:
        return name not in node.expose.params
    return node.processor is None or name not in node.processor.params


def _show_output(edits: Edits, group: Node, port: str) -> str:
    """The name under which a group's face shows an inner output; it is shown now if it was not."""
    for name, shown in group.expose.outputs.items():
        if shown == port:
            return name
    name = unique(port.rpartition(".")[2], group.expose.outputs)
    edits.put(group.expose.outputs, name, port)
    return name
