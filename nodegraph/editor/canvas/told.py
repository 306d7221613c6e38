"""What the canvas says in words: of the value at a port, why there is none, and of times."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from nodegraph.editor.canvas.faces import Port
from nodegraph.ports import port_type

if TYPE_CHECKING:
    from nodegraph.editor.canvas.standing import Standing
    from nodegraph.editor.session import Session
    from nodegraph.network import Node


def seconds_told(seconds: float) -> str:
    """A time in three figures: ``430 µs``, ``12 ms``, ``1.4 s``, ``2 min 5 s``."""
    if seconds < 0.001:
        return f"{seconds * 1e6:.0f} µs"
    if seconds < 1:
        return f"{seconds * 1e3:.3g} ms"
    if seconds < 60:
        return f"{seconds:.3g} s"
    return f"{int(seconds // 60)} min {int(seconds % 60)} s"


def value_told(session: Session, path: str, output: str) -> str:
    """One line about the value of an output, or why there is none."""
    value: Any = session.value(path, output)
    if value is not None:
        state = session.state(path)
        stale = " (of before the last change)" if state == "dirty" else ""
        return f"{port_type(type(value)).summary(value)}{stale}"
    state = session.state(path)
    if state == "failed":
        return f"no value: {path} failed: {state.reason}"
    if state == "blocked":
        return f"no value: {state.reason or 'the node is blocked'}"
    if state == "running":
        return "no value yet: the node is running"
    if path in session.network and session.network.node(path).muted:
        return "no value: the node is muted and nothing stands for this output"
    if state == "clean":
        return "no value: the result was not kept"
    return "no value yet: no open view has asked for it"


def port_tip(session: Session, node: Node, port: Port) -> str:
    """The tooltip of a port."""
    lines = [f"<b>{escape(port.name)}</b>&nbsp; {escape(port.type_name)}{', any number' if port.many else ''}"]
    if port.doc:
        lines.append(escape(port.doc))
    if port.type is None:
        lines.append("Nothing is known of this port here." if node.processor is None else "The node has no such port.")
    if port.output:
        lines.append(escape(value_told(session, node.path, port.name)))
    else:
        sources = node.inputs.get(port.name, ())
        prefix = node.parent.prefix if node.parent is not None else ""
        for source in sources:
            giver, _, output = (prefix + source).rpartition(".")
            told = value_told(session, giver, output) if giver in session.network else "this node does not exist"
            lines.append(f"from {escape(source)}: {escape(told)}")
        if not sources:
            lines.append("Nothing is connected." + (" The node needs it." if port.required else ""))
    return "<br>".join(lines)


def shown_value(session: Session, node: Node, port: Port) -> Any | None:
    """The value at a port as far as it is kept: an output's own, of an input what its first wire brings."""
    if port.output:
        return session.value(node.path, port.name)
    sources = node.inputs.get(port.name, ())
    if not sources or node.parent is None:
        return None
    giver, _, output = (node.parent.prefix + sources[0]).rpartition(".")
    return session.value(giver, output) if giver in session.network else None


def node_tip(session: Session, node: Node, standing: Standing) -> str:
    """The tooltip of a node: its kind, what it does, how it stands, what its last run took and where it ran."""
    state = session.state(node.path)
    lines = [f"<b>{escape(node.path)}</b>&nbsp; {escape(node.type)}"]
    doc = (node.processor.__doc__ or "").strip().split("\n")[0] if node.processor is not None else ""
    if doc:
        lines.append(escape(doc))
    if node.trouble is not None:
        lines.append(escape(str(node.trouble)))
    lines.append(escape(str(state) + (f": {state.reason}" if state.reason else "")))
    seconds, device = standing.seconds(node.path), standing.device(node.path)
    if seconds is not None:
        lines.append(escape(f"last run: {seconds_told(seconds)}" + (f" on {device}" if device else "")))
    return "<br>".join(lines)
