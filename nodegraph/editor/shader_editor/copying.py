"""A copy of a processor among the user's plug-ins, in the place of the original in a network."""

from __future__ import annotations

import os
from pathlib import Path

from nodegraph import locations, registry, scaffold
from nodegraph.commands import Add, Connect, Mute, Remove, Rename, SetUI
from nodegraph.editor.session import Session
from nodegraph.editor.settings import config_folder
from nodegraph.errors import CommandError
from nodegraph.network import Kept, Network
from nodegraph.variable_commands import Link
from nodegraph.wires import is_many


def plugin_folder() -> Path:
    """The user's folder: the first of NODEGRAPH_PATH that can be written, else one beside the settings.

    The latter is made, and added to NODEGRAPH_PATH of this process.
    """
    for folder in locations.on_path():
        if not folder.reason and os.access(folder.processors, os.W_OK):
            return Path(folder.origin).expanduser()
    own = config_folder() / "plugins"
    own.mkdir(parents=True, exist_ok=True)
    use_own_folder()
    return own


def use_own_folder() -> None:
    """Add the folder beside the settings to NODEGRAPH_PATH of this process, if it is there."""
    folder = config_folder() / "plugins"
    named = os.environ.get(locations.VARIABLE, "")
    if folder.is_dir() and str(folder) not in named.split(os.pathsep):
        os.environ[locations.VARIABLE] = os.pathsep.join(filter(None, (named, str(folder))))


def copy_and_use(session: Session, path: str) -> list[Path]:
    """Copy the processor of a node and let the node use the copy, as one step. Returns the files.

    Raises CommandError.
    """
    node = session.network.node(path)
    made, id = scaffold.copy_processor(node.type, plugin_folder())
    registry.default().refresh()
    with session.gesture(f"use a copy of {node.type}"):
        replace(session, path, id)
    return made


def replace(session: Session, path: str, type: str) -> None:
    """Put a node of another type, which has the same ports and parameters, in the place of one."""
    network = session.network
    node = network.node(path)
    level = node.parent
    assert level is not None
    if level.owner is not None and any(
        port.partition(".")[0] == node.id
        for table in (level.owner.expose.inputs, level.owner.expose.params)
        for ports in table.values()
        for port in ports
    ):
        raise CommandError(f"{path}: shows ports on the face of its group; take them off first")
    params = {name: value for name, value in node.params.items() if not isinstance(value, Kept)}
    add = Add(type, "", params, group=level.prefix.rstrip("/"))
    session.do(add)
    ui, muted = dict(node.ui), node.muted
    for name, variable in node.links.items():
        session.do(Link(f"{add.path}.{name}", variable))
    for name, wires in node.inputs.items():
        for wire in wires:
            session.do(Connect(level.prefix + wire, f"{add.path}.{name}"))
    _lead_outputs(session, level, node.id, add.path)
    session.do(Remove([path]))
    session.do(Rename(add.path, node.id))
    for key, value in ui.items():
        session.do(SetUI(path, key, value))
    if muted:
        session.do(Mute(path))
    session.select(path)


def _lead_outputs(session: Session, level: Network, id: str, other: str) -> None:
    for reader in list(level.nodes.values()):
        for name, wires in list(reader.inputs.items()):
            for place, wire in enumerate(wires):
                giver, _, output = wire.rpartition(".")
                if giver == id:
                    where = place if is_many(reader, name) else None
                    session.do(Connect(f"{other}.{output}", f"{reader.path}.{name}", replace=True, place=where))
