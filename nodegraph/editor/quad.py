"""The quad view: a volume in three dimensions beside its axial, coronal and sagittal cuts."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from nodegraph.commands import Add, Connect
from nodegraph.data import Plane, Volume
from nodegraph.editor.session import Session
from nodegraph.errors import FormatError
from nodegraph.flat import Flat
from nodegraph.links import value_of
from nodegraph.network import unique
from nodegraph.offers import RADIOLOGICAL, nature_of
from nodegraph.subjects import subject_of, upstream
from nodegraph.variable_commands import Link

FEW_BYTES = 1 << 17
"""Of voxels that are looked at for a window: this is done while the window waits."""


def volume_of(session: Session) -> str:
    """``node.output`` of the volume that is meant: of the selection, else of what the first view shows; or empty."""
    flat = session.network.flatten()
    views = [path for path, node in flat.nodes.items() if node.type == "output.view"]
    for path in (*session.selection, *views, *flat.nodes):
        for node in upstream(flat, path):
            found = _volumes(flat, node.path)
            if found and session.network.node(node.path).parent is session.network:
                return found[0]
    return ""


def quad(session: Session) -> tuple[str, ...]:
    """The views of a quad, 3-D first, then the cuts as `RADIOLOGICAL` names them. What is missing is added, one step.

    Empty, with a message, where there is no volume.
    """
    volume = volume_of(session)
    if not volume:
        session.tell("warning", "There is no volume to show: add one, or select its node.")
        return ()
    with session.gesture("quad view"):
        there = _cuts_there(session, volume)
        made = [_turned(session) or _add_cast(session, volume)]
        made += [there.get(name) or _add_cut(session, volume, name) for name in RADIOLOGICAL]
    return tuple(made)


def _volumes(flat: Flat, path: str) -> list[str]:
    node = flat.nodes.get(path)
    outputs = node.processor.outputs if node is not None and node.processor is not None else {}
    return [f"{path}.{name}" for name, port in outputs.items() if port.type is Volume]


def _views(session: Session) -> list[str]:
    return [node.path for node in session.network.walk() if node.type == "output.view"]


def _turned(session: Session) -> str:
    """The first view that can be turned, or empty."""
    return next((path for path in _views(session) if subject_of(session.network, path).cameras), "")


def _cuts_there(session: Session, volume: str) -> dict[str, str]:
    """Views that cut this volume across an axis already, by the name of the cut."""
    found: dict[str, str] = {}
    for path in _views(session):
        subject = subject_of(session.network, path)
        if not subject.plane or subject.source != volume:
            continue
        plane = value_of(session.network, subject.plane)
        for name, normal in RADIOLOGICAL.items():
            if isinstance(plane, Plane) and abs(float(plane.unit_normal @ normal)) > 0.999:
                found.setdefault(name, path)
    return found


def _add_cut(session: Session, volume: str, name: str) -> str:
    plane = Plane(_middle(session, volume), RADIOLOGICAL[name])
    cut = _add(session, "render.slice", f"{name}_cut", plane=plane, **_window(session, volume))
    session.do(Connect(volume, f"{cut}.volume"))
    view = _add(session, "output.view", name)
    session.do(Connect(f"{cut}.image", f"{view}.image"))
    return view


def _add_cast(session: Session, volume: str) -> str:
    box = _add(session, "geometry.proxy_box", "box")
    rays = _add(session, "render.entry_exit_points", "rays")
    cast = _add(session, "render.raycast", "raycast")
    view = _add(session, "output.view", "view")
    for source, target in (
        (volume, f"{box}.volume"),
        (f"{box}.geometry", f"{rays}.geometry"),
        (volume, f"{cast}.volume"),
        (f"{rays}.interval", f"{cast}.interval"),
        (f"{cast}.image", f"{view}.image"),
    ):
        session.do(Connect(source, target))
    camera = unique("camera", session.network.variables)
    for node in (rays, cast, view):
        session.do(Link(f"{node}.camera", camera))
    return view


def _add(session: Session, type: str, id: str, **params: object) -> str:
    """Add a node; the canvas finds a place for it. Returns its path."""
    command = Add(type, unique(id, session.network.nodes), params)
    session.do(command)
    return command.path


def _window(session: Session, volume: str) -> dict[str, tuple[float, float]]:
    """What the cuts show of the values, where these are at hand; else the whole range, as cuts do by themselves."""
    value = _value(session, volume)
    if value is None or value.components > 1 or value.buffer.chunks is not None or not value.buffer.on_host:
        return {}
    some = max(1, round((value.buffer.nbytes / FEW_BYTES) ** (1 / 3)))
    try:
        return {"window": nature_of(Volume(value.data[::some, ::some, ::some], mapping=value.mapping), Path()).window}
    except FormatError:
        return {}


def _value(session: Session, volume: str) -> Volume | None:
    path, _, output = volume.rpartition(".")
    value = session.value(path, output)
    return value if isinstance(value, Volume) else None


def _middle(session: Session, volume: str) -> tuple[float, float, float]:
    """The middle of the volume, world mm, as far as it is known; else the origin."""
    value = _value(session, volume)
    if value is None:
        return (0.0, 0.0, 0.0)
    x, y, z = np.mean(value.corners, axis=0).tolist()
    return x, y, z
